"""What a fit varies: numbers of a scene by their paths, from where they start, within bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any, cast

from pydantic_core import PydanticCustomError

from exudyn_flexlink.loading import document_of
from exudyn_flexlink.quantities import Quantity, to_si
from exudyn_flexlink.scene import Scene, apply_settings, check_document
from exudyn_flexlink.source import Document, Mistake, SceneError
from exudyn_flexlink.sweeps import ValuesError, quantity_at, range_of, symbol_of
from exudyn_flexlink.units import Dimension, Measure

Vary = str | Sequence[str] | Mapping[str, Any]
"""A path, or several, or with their bounds: two numbers (SI), a text '1:20 N/m', or None."""


@dataclass(frozen=True)
class Parameter:
    """A number of a scene that a fit varies, in its SI `unit`, from `start` within bounds."""

    path: str
    unit: str
    start: float
    low: float
    high: float


def parameters_of(scene: Scene, vary: Vary) -> list[Parameter]:
    """Return what is varied, each from the scene's own value; bounds by default are its key's.

    Raises:
        SceneError: a path leads to no number, or bounds can't be; all such mistakes are in it.

    """
    paths = [vary] if isinstance(vary, str) else vary
    given = paths if isinstance(paths, Mapping) else dict.fromkeys(paths)
    mistakes, found = list[Mistake](), list[Parameter]()
    if not given:
        mistakes.append(Mistake((), "nothing is varied", "for example springs.s.stiffness"))
    for path, bounds in given.items():
        try:
            found.append(_parameter(scene, path, bounds))
        except (SceneError, ValuesError) as error:
            each = error.mistakes if isinstance(error, SceneError) else [error]
            mistakes += [Mistake(tuple(path.split(".")), one.message, one.hint) for one in each]
    if mistakes:
        raise SceneError(Document("vary"), mistakes)
    return found


def _parameter(scene: Scene, path: str, given: Any) -> Parameter:
    steps, value = tuple(path.split(".")), cast(Any, scene.to_data())
    for step in steps:
        value = value.get(step) if isinstance(value, Mapping) else None
    # Says where the path leads nowhere, and of a key that is not there whether it may be.
    tried = apply_settings(document_of(scene), [(path, 1.0 if value is None else value)])
    if value is None:
        mistakes = [
            mistake
            for mistake in check_document(tried, True).mistakes
            if mistake.path and mistake.path[: len(steps)] == steps[: len(mistake.path)]
        ]
        if mistakes:
            raise SceneError(tried, mistakes)
        raise ValuesError("has no number to start from", f"give it one: {path}=...")
    if not isinstance(value, float):
        raise ValuesError("is no number that varies without steps", "")
    quantity = quantity_at(scene, path) or Quantity(Dimension.NUMBER)
    lows = [end for end in (quantity.above, quantity.at_least) if end is not None]
    low, high = max(lows, default=-inf), inf if quantity.at_most is None else quantity.at_most
    if given is not None:
        bounds = range_of(given)
        ends = [_in_si(bounds.at(part), quantity.dimension) for part in (0.0, 1.0)]
        low, high = max(low, ends[0]), min(high, ends[1])
    if not low <= value <= high:
        raise ValuesError(f"starts at {value:g}, outside its bounds {low:g} to {high:g}", "")
    return Parameter(path, symbol_of(quantity.dimension), value, low, high)


def _in_si(value: float | str, dimension: Measure) -> float:
    try:
        return to_si(value, dimension)
    except PydanticCustomError as error:
        context = error.context or {}
        raise ValuesError(context["message"], context["hint"]) from None

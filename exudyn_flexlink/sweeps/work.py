"""The runs of one point: what every executor does, in whatever process."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import isfinite
from time import perf_counter
from typing import Any

from exudyn_flexlink.loading import scene_of
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.source import Document, SceneError, dotted
from exudyn_flexlink.sweeps.plan import Point
from exudyn_flexlink.sweeps.rows import (
    COLUMNS,
    DONE,
    DOUBTFUL,
    FAILED,
    Observe,
    Row,
    RunFailedError,
    Scalar,
    Simulate,
)

LONGEST_REASON = 500  # characters: a row is read by people

Keep = Callable[[Result, str], None]
"""Saves a run under a name."""


@dataclass(frozen=True)
class Work:
    """What is the same at all points, and sent to each process once.

    `document` is the scene as plain data, with the points of its files in it; `simulate` runs a
    scene, `observe` tells of the runs what goes into the row; `keep`, if there is one, saves each.
    """

    document: Document
    simulate: Simulate
    observe: Observe
    keep: Keep | None = None
    allow_outside: bool = False

    def row(self, point: Point) -> Row:
        """Make the runs of a point; whatever goes wrong in them is told in the row."""
        began = perf_counter()
        runs = _Runs(self.simulate, self.keep, point.id)
        numbers: Mapping[str, Scalar] = {}
        try:
            scene = scene_of(self.document, point.settings, self.allow_outside)
            numbers = _checked(self.observe(scene, runs))
        except SceneError as error:
            first = error.mistakes[0]
            why = f"{dotted(first.path)}: {first.message}" if first.path else first.message
        except RunFailedError as error:
            why = str(error)
        except MemoryError:
            why = "not enough memory"
        except Exception as error:  # of an engine that refuses the scene, or of the user's function
            why = f"{type(error).__name__}: {error}"
        else:
            why = ""
        status = FAILED if why else DOUBTFUL if runs.told else DONE
        reason = why or "; ".join(dict.fromkeys(runs.told))
        wall = perf_counter() - began
        told = shortened(reason, LONGEST_REASON)
        return Row(point.number, point.id, status, told, len(runs.told), wall, numbers)


def shortened(text: str, most: int) -> str:
    """Return a text of no more than so many characters, with dots for what is left out."""
    return text if len(text) <= most else f"{text[: most - 4]} ..."


@dataclass
class _Runs:
    """Makes runs, saves them if they are to be, and collects what they warn of."""

    simulate: Simulate
    keep: Keep | None
    name: str
    told: list[str] = field(default_factory=list)
    made: int = 0

    def __call__(self, scene: Scene, /) -> Result:
        result = self.simulate(scene)
        self.made += 1
        self.told += result.warnings
        if not result.outcome.completed:
            self.told.append(f"a run {result.outcome.told}")
        if self.keep is not None:
            self.keep(result, self.name if self.made == 1 else f"{self.name}-{self.made}")
        return result


def _checked(observed: Mapping[str, Any]) -> Mapping[str, Scalar]:
    """Return observables as what a row holds.

    Raises:
        TypeError: a name is no text, or a value no number, text, bool or None.
        ValueError: a name is that of a column that every sweep has.

    """
    for name in observed:
        if not isinstance(name, str):
            raise TypeError(f"a column's name is a text, no {type(name).__name__}")
        if name in COLUMNS:
            raise ValueError(f"every sweep has a column '{name}': give yours another name")
    return {name: _plain(value) for name, value in observed.items()}


def _plain(value: Any) -> Scalar:
    """Return an observable as what a table holds; there is no number that is not finite.

    Raises:
        TypeError: it is no number, text, bool or None.

    """
    if hasattr(value, "item"):  # of numpy
        value = value.item()
    if isinstance(value, float) and not isfinite(value):
        return None
    if value is None or isinstance(value, float | int | bool | str):
        return value
    raise TypeError(f"a row holds numbers and texts, no {type(value).__name__}")

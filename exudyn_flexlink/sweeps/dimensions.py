"""What the values of a path are measured in: the SI unit of a number of the scene."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, get_args

from exudyn_flexlink.quantities import Quantity, StiffnessOfPower
from exudyn_flexlink.scene import Part, Scene
from exudyn_flexlink.scene.varying import Measured, Varying
from exudyn_flexlink.sweeps.values import Value, parts_of
from exudyn_flexlink.units import Dimension, Measure, UnknownUnitError, find_unit

_SYMBOLS = {"metres": "m", "radians": "rad", "seconds": "s"}
_ALL = {_SYMBOLS.get(one.si, one.si) for one in Dimension} - {""}
_UNITS = sorted(_ALL | {"J", "W", "N s", "1/s"}, key=len, reverse=True)
"""Units that end the names of columns, the longest first: rad/s is not s."""


def si_unit(scene: Scene, path: str) -> str:
    """Return the SI unit of the number at a path, such as 'rad/s'; empty where it has none."""
    measured = quantity_at(scene, path)
    return "" if measured is None else symbol_of(measured.dimension)


def symbol_of(dimension: Measure) -> str:
    """Return the SI unit of a dimension as it is written behind a number."""
    return _SYMBOLS.get(dimension.si, dimension.si)


def column_of(path: str, unit: str) -> str:
    """Return the name of a path's column, which ends in the unit: 'run.sample_s'."""
    told = unit.replace("/", "_per_").replace(" ", "_").replace("^", "")
    return f"{path}_{told}" if told else path


def in_si(value: Value, unit: str) -> Value:
    """Return a number in the SI's `unit`; a text that is no quantity stays as it is."""
    parts = parts_of(value)
    measures = (measure for measure in Dimension if symbol_of(measure) == unit)
    wanted = next(measures, Dimension.NUMBER)
    try:
        return value if parts is None else parts[0] * find_unit(parts[1], wanted).factor
    except UnknownUnitError:
        return value


def quantity_at(scene: Scene, path: str) -> Quantity | None:
    """Return dimension and limits of the number at a path; None where nothing tells them."""
    value: Any = scene
    owner: Any = None
    hints: tuple[Any, ...] = ()
    for step in path.split("."):
        if isinstance(value, Part):
            fields = type(value).model_fields.items()
            key = next((key for key, field in fields if step in (key, field.alias)), None)
            if key is None:
                return None
            field = type(value).model_fields[key]
            owner, hints, value = value, (field.annotation, *field.metadata), getattr(value, key)
        elif isinstance(value, Mapping):  # what is not there yet is as what may be there
            value = value.get(step)
        elif isinstance(value, tuple):
            value = value[int(step)] if step.isdecimal() and int(step) < len(value) else None
        else:
            return None
    if isinstance(value, Measured):
        return Quantity(value.dimension)
    found = next((one for hint in hints for one in _quantities(hint)), None)
    return found.beside(owner.exponent) if isinstance(found, StiffnessOfPower) else found


def _quantities(hint: Any) -> Iterator[Quantity]:
    """Quantities that the annotations in a type name, if they leave no choice."""
    if isinstance(hint, Quantity):
        yield hint
    elif isinstance(hint, Varying):
        yield from map(Quantity, hint.dimensions if len(hint.dimensions) == 1 else ())
    else:
        for inner in (*get_args(hint), *getattr(hint, "__metadata__", ())):
            yield from _quantities(inner)


def label_of(column: str) -> tuple[str, str]:
    """Return a column's name without its unit, and the unit as it is written; empty if it has none.

    >>> label_of("lever.swing_rad")
    ('lever.swing', 'rad')
    """
    for unit in _UNITS:
        ending = column_of("", unit)
        if column.endswith(ending):
            return column.removesuffix(ending), unit
    return column, ""

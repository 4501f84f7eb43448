"""Quantities of a run by name, such as 'lever.angle': what a column of measurements holds."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import build_mechanism
from exudyn_flexlink.observables.answers import ANGLE, measures
from exudyn_flexlink.observables.levers import lever_response, struck_bodies
from exudyn_flexlink.observables.points import (
    between_samples,
    path,
    point_names,
    straight_between,
    watched_point,
)
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.source import did_you_mean
from exudyn_flexlink.units import Dimension

MOST_NAMED = 12  # in a message
_UNITS = {Dimension.LENGTH: "m", Dimension.ANGLE: "rad", Dimension.ANGULAR_SPEED: "rad/s"}


@dataclass(frozen=True)
class Signal:
    """A quantity of a scene's runs; `at` gives its values (M,) at instants (M,) s within a run."""

    name: str
    dimension: Dimension
    at: Callable[[Result, FloatArray], FloatArray]

    @property
    def unit(self) -> str:
        """Its SI unit."""
        return _UNITS[self.dimension]


def signals(scene: Scene) -> dict[str, Signal]:
    """Return all quantities of a scene's runs, by name.

    ``BODY.angle`` (from +x of the ground, as `initial.angles` counts it; of a flexible body that of
    its first rod), ``BODY.rate``, ``BODY.POINT.x`` and ``.y``; of a struck body ``BODY.response``,
    its angle or displacement from the start on, as its own table has it.
    """
    found = []
    for body, parts in build_mechanism(scene).bodies.items():
        found.append(Signal(f"{body}.angle", Dimension.ANGLE, partial(_angle, parts[0])))
        found.append(Signal(f"{body}.rate", Dimension.ANGULAR_SPEED, partial(_rate, parts[0])))
    for point in point_names(scene):
        for i, axis in enumerate("xy"):
            found.append(Signal(f"{point}.{axis}", Dimension.LENGTH, partial(_place, point, i)))
    told = measures(scene)
    for body, contact in struck_bodies(scene).items():
        kind = Dimension.ANGLE if told[body] is ANGLE else Dimension.LENGTH
        found.append(Signal(f"{body}.response", kind, partial(_response, contact)))
    return {signal.name: signal for signal in found}


def _angle(part: int, run: Result, time: FloatArray) -> FloatArray:
    return between_samples(run.time, run.poses[:, part, 2], run.rates[:, part, 2], time)


def _rate(part: int, run: Result, time: FloatArray) -> FloatArray:
    return straight_between(run.time, run.rates[:, part, 2], time)


def _place(point: str, axis: int, run: Result, time: FloatArray) -> FloatArray:
    return path(run, point).at(time)[:, axis]


def _response(contact: str, run: Result, time: FloatArray) -> FloatArray:
    return lever_response(run, contact).value_at(time)


def own_columns(scene: Scene) -> dict[str, str]:
    """Names of quantities by those that columns have in the tables of a run, without units."""
    watched, told = watched_point(scene), measures(scene)
    found = {axis: f"{watched}.{axis}" for axis in "xy"}
    if len(told) == 1:  # of two struck bodies the tables have the same names of columns
        found |= {measure.word: f"{body}.response" for body, measure in told.items()}
    return found


def unknown_signal(name: str, known: Iterable[str]) -> str:
    """Say that no quantity has this name, and which there are."""
    names = list(known)
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    near = did_you_mean(name, names) or f"; there are: {', '.join(names[:MOST_NAMED])}{more}"
    return f"the scene has no quantity '{name}'{near}"

"""Quantities of a run by name, such as 'lever.angle': what a column of measurements holds."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables.answers import ANGLE, measures
from exudyn_flexlink.observables.levers import lever_response, struck_bodies
from exudyn_flexlink.observables.points import (
    between_samples,
    body_motion,
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
    """A quantity of a scene's runs: its values (N,) in SI at samples, and their rates if known."""

    name: str
    dimension: Dimension
    samples: Callable[[Result], tuple[FloatArray, FloatArray | None]]

    @property
    def unit(self) -> str:
        """Its SI unit."""
        return _UNITS[self.dimension]

    def at(self, run: Result, time: FloatArray) -> FloatArray:
        """Values (M,) at instants (M,) s within a run."""
        values, rates = self.samples(run)
        if rates is None:
            return straight_between(run.time, values, time)
        return between_samples(run.time, values, rates, time)


def signals(scene: Scene) -> dict[str, Signal]:
    """Return all quantities of a scene's runs, by name.

    ``BODY.angle`` (from +x of the ground, as `initial.angles` counts it; of a flexible body that of
    its first rod), ``BODY.rate``, ``BODY.POINT.x`` and ``.y``; of a struck body ``BODY.response``,
    its angle or displacement from the start on, as its own table has it.
    """
    found, told = list[Signal](), measures(scene)
    for body in scene.bodies:
        found.append(Signal(f"{body}.angle", Dimension.ANGLE, partial(_angle, body)))
        found.append(Signal(f"{body}.rate", Dimension.ANGULAR_SPEED, partial(_rate, body)))
    for point in point_names(scene):
        for i, axis in enumerate("xy"):
            found.append(Signal(f"{point}.{axis}", Dimension.LENGTH, partial(_place, point, i)))
    for body, contact in struck_bodies(scene).items():
        kind = Dimension.ANGLE if told[body] is ANGLE else Dimension.LENGTH
        found.append(Signal(f"{body}.response", kind, partial(_response, contact)))
    return {signal.name: signal for signal in found}


def _angle(body: str, run: Result) -> tuple[FloatArray, FloatArray]:
    own = body_motion(run, body)
    return own.angle, own.rate


def _rate(body: str, run: Result) -> tuple[FloatArray, None]:
    return body_motion(run, body).rate, None


def _place(point: str, axis: int, run: Result) -> tuple[FloatArray, FloatArray]:
    own = path(run, point)
    return own.position[:, axis], own.velocity[:, axis]


def _response(contact: str, run: Result) -> tuple[FloatArray, FloatArray]:
    own = lever_response(run, contact)
    return own.value, own.rate


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

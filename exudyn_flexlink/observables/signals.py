"""Quantities of a run by name, such as 'lever.angle': what a column of measurements holds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

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
_UNITS = {Dimension.LENGTH: "m", Dimension.ANGLE: "rad"}  # others are as `Dimension` has them


class Samples(NamedTuple):
    """Values (N,) at a run's samples, and their rates (N,) where these are known."""

    values: FloatArray
    rates: FloatArray | None = None


@dataclass(frozen=True)
class Signal:
    """A quantity of a scene's runs: its name, and what it measures."""

    name: str
    dimension: Dimension
    samples: Callable[[Result], Samples]

    @property
    def unit(self) -> str:
        """Its SI unit."""
        return _UNITS.get(self.dimension, self.dimension.si)

    def at(self, result: Result, time: FloatArray) -> FloatArray:
        """Values (M,) at instants (M,) s within a run, interpolated: see `between_samples`."""
        values, rates = self.samples(result)
        if rates is None:
            return straight_between(result.time, values, time)
        return between_samples(result.time, values, rates, time)


def signals(scene: Scene) -> dict[str, Signal]:
    """Return all quantities of a scene's runs, by name.

    ``BODY.angle`` (from +x of the ground, as `initial.angles` counts it; of a flexible body that of
    its first rod) and ``BODY.rate``; ``BODY.POINT.x``, ``.y``, ``.vx``, ``.vy``; of a struck body
    ``BODY.response``, its angle or displacement from the start on as its own table has it,
    ``BODY.response_rate`` and ``BODY.tip_displacement``.
    """
    return {found.name: found for found in _signals(scene)}


def _signals(scene: Scene) -> Iterator[Signal]:
    length, speed = Dimension.LENGTH, Dimension.SPEED
    angle, turning = Dimension.ANGLE, Dimension.ANGULAR_SPEED
    for body, parts in build_mechanism(scene).bodies.items():
        k = parts[0]
        yield Signal(
            f"{body}.angle", angle, lambda r, k=k: Samples(r.poses[:, k, 2], r.rates[:, k, 2])
        )
        yield Signal(f"{body}.rate", turning, lambda r, k=k: Samples(r.rates[:, k, 2]))
    for point in point_names(scene):
        for i, axis in enumerate("xy"):

            def place(r: Result, point: str = point, i: int = i) -> Samples:
                seen = path(r, point)
                return Samples(seen.position[:, i], seen.velocity[:, i])

            yield Signal(f"{point}.{axis}", length, place)
            yield Signal(f"{point}.v{axis}", speed, lambda r, of=place: Samples(of(r).rates))
    told = measures(scene)
    for body, contact in struck_bodies(scene).items():

        def response(r: Result, contact: str = contact) -> Samples:
            seen = lever_response(r, contact)
            return Samples(seen.value, seen.rate)

        def tip(r: Result, contact: str = contact) -> Samples:
            return Samples(lever_response(r, contact).tip_displacement)

        kinds = (angle, turning) if told[body] is ANGLE else (length, speed)
        yield Signal(f"{body}.response", kinds[0], response)
        yield Signal(f"{body}.response_rate", kinds[1], lambda r, of=response: Samples(of(r).rates))
        yield Signal(f"{body}.tip_displacement", length, tip)


def own_columns(scene: Scene) -> dict[str, str]:
    """Names of quantities by those that columns have in the tables of a run, without units."""
    watched, told = watched_point(scene), measures(scene)
    found = {axis: f"{watched}.{axis}" for axis in ("x", "y", "vx", "vy")}
    if len(told) == 1:  # of two struck bodies the tables have the same names of columns
        ((body, measure),) = told.items()
        found |= {measure.word: f"{body}.response", "rate": f"{body}.response_rate"}
        found["tip_displacement"] = f"{body}.tip_displacement"
    return found


def unknown_signal(name: str, known: Iterable[str]) -> str:
    """Say that no quantity has this name, and which there are."""
    names = list(known)
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    near = did_you_mean(name, names) or f"; there are: {', '.join(names[:MOST_NAMED])}{more}"
    return f"the scene has no quantity '{name}'{near}"

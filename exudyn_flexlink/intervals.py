"""Contacts as intervals, each from the first touch to the separation, and rests of joints."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields
from math import inf, isfinite
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.arrays import BoolArray, FloatArray, IntArray
from exudyn_flexlink.variables import Variable, members


@dataclass(frozen=True)
class Interval:
    """One contact of a point and a face, from the first touch to the separation.

    `begin` and `end` are in s; what still touches as the run ends has no end: `end` is inf, and
    impulse and energy count up to there. `place` and `end_place` (m) are along the face from its
    start. `approach_speed` and `separation_speed` (m/s) are those along its normal at begin and
    end. `impulse` (N s) is that of the normal force, `energy_lost` (J) has friction in it.
    `peak_force` (N) and `penetration` (m) are the largest. An impact, under an impulse law, begins
    and ends at one instant: its force is inf, and `motor_work` (J) is what a speed drive supplied
    in it. `slides_off` tells that the point slid off an end of the face while pressed to it.
    `pair` is an index into the `pairs` of a sleeve; 0 of a contact of the scene.
    """

    begin: float
    end: float = inf
    place: float = 0.0
    end_place: float = 0.0
    approach_speed: float = 0.0
    separation_speed: float = 0.0
    impulse: float = 0.0
    energy_lost: float = 0.0
    peak_force: float = 0.0
    penetration: float = 0.0
    motor_work: float = 0.0
    slides_off: bool = False
    pair: int = 0

    @property
    def lasts(self) -> bool:
        """Whether it has no end within the run."""
        return not isfinite(self.end)

    @property
    def impact(self) -> bool:
        """Whether it is an impulse without duration."""
        return not isfinite(self.peak_force)


@dataclass(frozen=True)
class Intervals:
    """Every contact of one contact of the scene, or of all pairs of one sleeve.

    Columns (K,) of the fields of `Interval`, in order of `begin`. Events, strikes, tables, figures
    and warnings are all made of these.
    """

    begin: Annotated[FloatArray, Variable(".", "s", "first touch")]
    end: Annotated[FloatArray, Variable(".", "s", "separation; inf: lasts")]
    place: Annotated[FloatArray, Variable(".", "m", "place along the face at begin")]
    end_place: Annotated[FloatArray, Variable(".", "m", "place along the face at end")]
    approach_speed: Annotated[FloatArray, Variable(".", "m/s", "normal speed at begin")]
    separation_speed: Annotated[FloatArray, Variable(".", "m/s", "normal speed at end")]
    impulse: Annotated[FloatArray, Variable(".", "N s", "impulse of the normal force")]
    energy_lost: Annotated[FloatArray, Variable(".", "J", "energy lost, friction included")]
    peak_force: Annotated[FloatArray, Variable(".", "N", "largest force; inf: an impact")]
    penetration: Annotated[FloatArray, Variable(".", "m", "largest penetration")]
    motor_work: Annotated[FloatArray, Variable(".", "J", "work of a drive in an impact")]
    slides_off: Annotated[BoolArray, Variable(".", "", "slid off an end of the face", kind=bool)]
    pair: Annotated[IntArray, Variable(".", "1", "pair of a sleeve, from 0", kind=int)]

    @classmethod
    def of(cls, found: Iterable[Interval] = ()) -> Intervals:
        """Return intervals as columns, in order of their begins."""
        rows = sorted(found, key=lambda row: (row.begin, row.pair))
        kinds = {own.name: own.variable.kind for own in members(cls) if own.variable}
        columns: dict[str, NDArray[Any]] = {
            name: np.array([getattr(row, name) for row in rows], kind)
            for name, kind in kinds.items()
        }
        return cls(**columns)

    def __len__(self) -> int:
        return len(self.begin)

    def __iter__(self) -> Iterator[Interval]:
        columns = [getattr(self, column.name).tolist() for column in fields(Interval)]
        return (Interval(*row) for row in zip(*columns, strict=True))

    def where(self, chosen: NDArray[Any]) -> Intervals:
        """Those that `chosen`, a mask or indices, picks."""
        return Intervals(**{c.name: getattr(self, c.name)[chosen] for c in fields(Intervals)})

    def lasting(self, time: FloatArray) -> IntArray:
        """How many last at instants (N,) s, their begin and end among these."""
        begun = np.searchsorted(np.sort(self.begin), time, side="right")
        return np.asarray(begun - np.searchsorted(np.sort(self.end), time, side="left"))

    def until(self, last: float) -> FloatArray:
        """Ends (K,) s, `last` of what lasts longer."""
        return np.minimum(self.end, last)


@dataclass(frozen=True)
class FrictionHistory:
    """How dry friction braked a joint: on its second body (N m, along a slide N), and what it took.

    It rests from `begin` to `end` (s) each time; inf where it still does as the run ends. Redundant
    coordinates hold nothing: there it creeps, and never rests.
    """

    torque: Annotated[FloatArray, Variable("time", "N m", "friction in a joint")]
    lost: Annotated[FloatArray, Variable("time", "J", "energy lost by friction in a joint")]
    begin: Annotated[FloatArray, Variable(".", "s", "begin of a rest")]
    end: Annotated[FloatArray, Variable(".", "s", "end of a rest")]

    def rest_until(self, end: float) -> float:
        """Time (s) at rest up to the end (s) of a run."""
        return float(np.sum(np.minimum(self.end, end) - self.begin))

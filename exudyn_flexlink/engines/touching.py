"""The touch: how a point and its face stand to each other, and what leads from one to another.

    is        what happens                                        becomes   told
    apart     it closes: a law gives way, or no bounce is left    pressed   a touch begins
    apart     it bounces, by an impulse law                       apart     an impact
    apart     its point passes the face's line, beside the face   behind
    behind    its point is back on the line                       apart
    pressed   it opens                                            apart     the touch ends
    pressed   its point slides off an end of the face             behind    the touch ends

Behind its face a point is free: it came there beside it. Walls of sleeves, and bearings, hold from
behind as well, and are only apart or pressed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from enum import Enum, auto
from math import inf
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.extremes import ExtremeSeeker
from exudyn_flexlink.integrate.collocation import POWERS, STAGES
from exudyn_flexlink.integrate.events import GAP_ROUNDING
from exudyn_flexlink.intervals import Interval, Intervals
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.mechanism import TOUCHING, Contact

# Of a contact's half period: the first step in it, or any without control of errors. No stage of a
# longer one may see the touch.
FIRST = 0.15
OFF_THE_END = 1e-9  # m: so near the end of its face a point that leaves it slid off
# Where the largest force in a step is looked for, on the polynomial through its nodes.
TO_LOOKS = np.vander(np.linspace(0.0, 1.0, 33), STAGES + 1, increasing=True) @ POWERS


class Side(Enum):
    """Where the point is."""

    APART = auto()
    PRESSED = auto()
    BEHIND = auto()


class Change(Enum):
    """What happens to a contact."""

    CLOSES = auto()
    BOUNCES = auto()
    PASSES = auto()  # the face's line, beside it or from behind
    OPENS = auto()
    SLIDES_OFF = auto()


BECOMES = {
    (Side.APART, Change.CLOSES): Side.PRESSED,
    (Side.APART, Change.BOUNCES): Side.APART,
    (Side.APART, Change.PASSES): Side.BEHIND,
    (Side.BEHIND, Change.PASSES): Side.APART,
    (Side.PRESSED, Change.OPENS): Side.APART,
    (Side.PRESSED, Change.SLIDES_OFF): Side.BEHIND,
}


class Moment(NamedTuple):
    """A contact as it begins or ends, and what it has taken so far; see `BlockRecorder.totals_of`.

    Place on the face (m), rate of the gap (m/s), impulse (N s) and energy (J); `press` (N) is the
    force with which it begins, where a step ended in it already.
    """

    time: float
    place: float
    gap_rate: float
    totals: tuple[float, float] = (0.0, 0.0)
    press: float = 0.0


class Touches:
    """Where all contacts of a run are now, and what they did; the first `faces` may be behind."""

    def __init__(self, contacts: Sequence[Contact], faces: int) -> None:
        self.rigid = np.array([isinstance(own.law, Impulse) for own in contacts], dtype=bool)
        self.sides = [Side.APART] * len(contacts)
        self.pressed = np.zeros(len(contacts), dtype=bool)  # a new array with every change
        self.pressing: list[int] = []  # the numbers of those that press
        # m/s: with which the last touch of each began, as laws ask; a new array with every one.
        self.approach = np.zeros(len(contacts))
        self._faces = faces
        self._ended: dict[int, list[Interval]] = {}
        self._open: dict[int, Interval] = {}  # with what its contact had taken as it began

    # --- where they are -----------------------------------------------------------------------

    def start(self, gaps: FloatArray) -> None:
        """Take the gaps (faces,), m, at time 0."""
        for k in np.flatnonzero(gaps < -TOUCHING).tolist():
            self.sides[k] = Side.BEHIND

    def beside(self, k: int, gap: float) -> None:
        """Take up where a point is that is beside its face."""
        if self.sides[k] is not Side.PRESSED:
            self.sides[k] = Side.BEHIND if gap < -GAP_ROUNDING else Side.APART

    def crossing(self, k: int, gap: float, inside: float) -> Change:
        """Tell what an event of a contact is, which is `inside` (m) the ends of its face.

        What closes may bounce: its law tells.
        """
        if self.sides[k] is Side.PRESSED:
            off = inside < (OFF_THE_END if self.rigid[k] else min(-gap, OFF_THE_END))
            return Change.SLIDES_OFF if off and k < self._faces else Change.OPENS
        passes = k < self._faces and (inside < 0 or self.sides[k] is Side.BEHIND)
        return Change.PASSES if passes else Change.CLOSES

    @contextmanager
    def without(self, which: Sequence[int]) -> Iterator[None]:
        """Look at a state as if some contacts did not press."""
        before = self.sides.copy(), self.pressed, self.pressing
        for k in which:
            self._set(k, Side.APART)
        try:
            yield
        finally:
            self.sides, self.pressed, self.pressing = before

    def _set(self, k: int, side: Side) -> None:
        self.sides[k] = side
        self.pressed = self.pressed.copy()
        self.pressed[k] = side is Side.PRESSED
        self.pressing = np.flatnonzero(self.pressed).tolist()

    # --- what happens -------------------------------------------------------------------------

    def change(self, k: int, what: Change, now: Moment) -> None:
        """Let something happen to a contact, but for a bounce."""
        if what is Change.PASSES:
            # By its rate, not to the other side: a step may have ended so far past the line that
            # `beside` told it already.
            self._set(k, Side.BEHIND if now.gap_rate < 0 else Side.APART)
            return
        self._set(k, BECOMES[self.sides[k], what])
        if what is Change.CLOSES:
            impulse, lost = now.totals
            self.approach = self.approach.copy()
            self.approach[k] = -now.gap_rate
            self._open[k] = Interval(
                now.time,
                place=now.place,
                approach_speed=-now.gap_rate,
                impulse=impulse,
                energy_lost=lost,
                peak_force=now.press,
            )
        else:
            last = _until(self._open.pop(k), now.place, now.totals)
            off = what is Change.SLIDES_OFF
            last = replace(last, end=now.time, separation_speed=now.gap_rate, slides_off=off)
            self._ended.setdefault(k, []).append(last)

    def bounce(self, k: int, impact: Interval) -> None:
        """A contact bounces, in no time."""
        self._set(k, BECOMES[self.sides[k], Change.BOUNCES])
        self._ended.setdefault(k, []).append(impact)

    def note(self, press: FloatArray) -> None:
        """Take forces (steps, nodes, c) in steps: by an impulse law no depth tells the largest."""
        for k in np.flatnonzero(self.pressed & self.rigid).tolist():
            largest = max(self._open[k].peak_force, float((TO_LOOKS @ press[:, :, k].T).max()))
            self._open[k] = replace(self._open[k], peak_force=largest)

    # --- what they did ------------------------------------------------------------------------

    @property
    def ever(self) -> set[int]:
        """Contacts that touched so far."""
        return {*self._ended, *self._open}

    def intervals(
        self, first: int, now: Sequence[tuple[float, tuple[float, float]]], seeker: ExtremeSeeker
    ) -> Intervals:
        """Touches of the contacts from `first` on, `now` (pairs,) at places (m) with totals.

        `seeker` knows the largest forces and depths.
        """
        found = []
        for pair, (place, totals) in enumerate(now):
            k = first + pair
            lasting = [_until(self._open[k], place, totals)] if k in self._open else []
            for own in (*self._ended.get(k, ()), *lasting):
                force, depth = seeker.peaks(k, own.begin, own.end)
                peak = inf if own.impact else max(own.peak_force, force)
                found.append(replace(own, peak_force=peak, penetration=depth, pair=pair))
        return Intervals.of(found)


def _until(begun: Interval, place: float, totals: tuple[float, float]) -> Interval:
    """Return a touch up to now: it took the difference of both totals."""
    impulse, lost = totals[0] - begun.impulse, totals[1] - begun.energy_lost
    return replace(begun, end_place=place, impulse=impulse, energy_lost=lost)

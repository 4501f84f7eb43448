"""The touch: the states of a point and its face, and the events that change them.

    state     event                                               becomes   recorded
    apart     it closes: a law gives way, or no bounce is left    pressed   a touch begins
    apart     it bounces, by an impulse law                       apart     an impact
    apart     its point passes the face's line, beside the face   behind
    behind    its point is back on the line                       apart
    pressed   it opens                                            apart     the touch ends
    pressed   its point slides off an end of the face             behind    the touch ends

Behind its face a point is free: it passed the face beside its end. Walls of sleeves, and bearings,
hold from behind as well; their contacts are only apart or pressed.

`Laws` has the forces of many penalty contacts, from gaps and rates, with their slopes. A force goes
on smoothly where a gap has opened, since a touch ends within a step. `error_times` tells how errors
of speeds become errors of places, as in a lever that swings slowly. `ExtremeSeeker` finds the
extremes of a run from the polynomials of its steps. All engines use these.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from enum import Enum, auto
from functools import cache
from math import inf
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray, IndexArray
from exudyn_flexlink.integrate.events import (
    GAP_ROUNDING,
    StepPolynomial,
    TurnSeeker,
    highest,
)
from exudyn_flexlink.integrate.problem import Press, Pressing
from exudyn_flexlink.integrate.radau import ErrorTimes, collocation
from exudyn_flexlink.laws import Impulse, Penalty, PressingLaw
from exudyn_flexlink.mechanism import Channel, Contact, Mechanism, approach, swings
from exudyn_flexlink.observables import Watched
from exudyn_flexlink.result import Extremes, Interval, Intervals
from exudyn_flexlink.rounding import INVISIBLE, PLACE_ROUNDING, ROUNDING


class Laws:
    """Laws of contacts (c,); rigid ones have no force."""

    def __init__(self, laws: Sequence[PressingLaw]) -> None:
        self.exponents = np.array([getattr(law, "exponent", 1.0) for law in laws])
        giving = dict.fromkeys(law for law in laws if not isinstance(law, Impulse))
        self._members = [(law, np.array([given == law for given in laws])) for law in giving]
        self._only = next(iter(giving), None) if len(set(laws)) == 1 else None

    def pressing(
        self, which: IndexArray, gap: FloatArray, rate: FloatArray, approach: FloatArray
    ) -> Pressing:
        """Forces of the contacts `which` (k,), from their gaps and rates (..., k).

        `approach` (c,) are the speeds (m/s) with which the touches of all contacts began.
        """
        if self._only is not None:
            return Pressing(*self._only.pressing(-gap, -rate, approach[which]))
        pushes = Pressing(*np.zeros((3, *gap.shape)))
        for law, members in self._members:
            law_members = members[which]
            if law_members.any():
                parts = law.pressing(
                    -gap[..., law_members], -rate[..., law_members], approach[which[law_members]]
                )
                for column, part in zip(pushes, parts, strict=True):
                    column[..., law_members] = part
        return pushes


def rubbing(contacts: Sequence[Contact | Channel]) -> FloatArray:
    """Friction of contacts (2, c): coefficients, 0 if smooth, and slip speeds (m/s)."""
    rubs = [contact.friction for contact in contacts]
    numbers = [(rub.coefficient, rub.slip_speed) if rub else (0.0, 1.0) for rub in rubs]
    return np.asarray(np.array(numbers).reshape(-1, 2).T, dtype=np.float64)


def press_by(laws: Sequence[PressingLaw], approach: FloatArray) -> Press:
    """Function that returns forces of contacts, and their slopes, from gaps and rates (..., c, 2).

    Touches began with the speeds `approach` (c,), m/s. A contact that is open has no force, unless
    its law lets go before it opens: then the force goes on beyond that.
    """
    by_laws, numbers = Laws(laws), np.arange(len(laws))
    lets_go = np.array([not isinstance(law, Impulse) and law.lets_go for law in laws], dtype=bool)
    always = bool(lets_go.all())

    def press(touching: FloatArray) -> Pressing:
        gap = touching[..., 0]
        pushes = by_laws.pressing(numbers, gap, touching[..., 1], approach)
        if always or gap.max(initial=-1.0) < 0:
            return pushes
        closed = (gap < 0) | lets_go
        return pushes._replace(force=pushes.force * closed, stiffness=pushes.stiffness * closed)

    return press


SHORTEST_SWING = 4e-3  # s, 1/omega at 40 Hz: lower limit
FREE = 0.25  # of SHORTEST_SWING: so long errors of speeds count out of contact


def error_times(mechanism: Mechanism, end: float) -> ErrorTimes:
    """Times that turn errors of speeds into errors of places, in a run to `end` (s)."""
    longest = max(swings(mechanism), default=0.0)
    tau = max(SHORTEST_SWING, min(longest, end))
    return ErrorTimes(tau, tau - (1 - FREE) * SHORTEST_SWING)


# Where a point in a contact turns back, its force falls steeply: that takes more looks.
LOOKS_AT_FORCES = (17, 9, 9)
EPSILON = float(np.finfo(float).eps)
HERMITE = np.array([0.0, 1.0])  # nodes of a step that is known by its ends: a cubic


class ExtremeSeeker:
    """Takes the steps of a run, and finds the extremes of watched quantities.

    Forces and depths of `contacts` (c,) are watched while they press; `nodes` (n,) are the parts of
    a step, from 0 to 1, at which its motion is given.
    """

    def __init__(self, watched: Watched, contacts: Sequence[Contact], nodes: FloatArray) -> None:
        self.contacts = contacts
        self.nodes = nodes
        self.deepest = np.zeros(len(contacts))  # m
        self._watched = watched
        self._polynomial = StepPolynomial(nodes)
        self._seeker = TurnSeeker(len(self._watched.names))
        self._pressed: list[list[tuple[FloatArray, ...]]] = [[] for _ in contacts]
        self._laws: dict[Penalty, list[int]] = {}
        for k, contact in enumerate(contacts):
            if not isinstance(contact.law, Impulse):  # a rigid contact has no force by depth
                self._laws.setdefault(contact.law, []).append(k)
        self._peaks: dict[int, tuple[Extremes, Extremes]] = {}

    def take(
        self,
        time: FloatArray,
        length: FloatArray,
        motion: tuple[FloatArray, FloatArray],
        pressed: BoolArray,
        began: FloatArray,
    ) -> None:
        """Take steps in a row that begin at `time` (m,) s, of `length` (m,) s.

        `motion` are poses and rates (m, n, parts, 3) at the nodes; `pressed` (m, c) tells which
        contacts press through each step, `began` (m, c) how fast (m/s) their touches began.
        """
        if not len(time):
            return
        polynomial = self._polynomial
        places, rates, speeds, changes = self._watched.of(*motion, polynomial.slopes)
        values = np.concatenate([places, speeds], axis=2)
        slopes = np.concatenate([rates * length[:, None, None], changes], axis=2)
        rounding = _rounding(self._watched.sizes(motion[0]), speeds, float(length.min()))
        # Near a dead centre things are so fast that the rounding of the clock moves them.
        clock = np.spacing(time[-1]) / length[:, None, None]
        rounding += (clock * np.abs(slopes)).max(axis=(0, 1))
        self._seeker.take(polynomial, (time, length), values, slopes, rounding)
        if pressed.any():
            for law, members in self._laws.items():
                self._press(law, [k for k in members if pressed[:, k].any()], (time, length),
                            motion, (pressed, began))  # fmt: skip

    def _press(
        self,
        law: Penalty,
        which: list[int],
        steps: tuple[FloatArray, FloatArray],
        motion: tuple[FloatArray, FloatArray],
        touches: tuple[BoolArray, FloatArray],
    ) -> None:
        """Find the largest depth and force of each of the contacts in each step."""
        if not which:
            return
        pressed, began = touches
        rows = [np.flatnonzero(pressed[:, k]) for k in which]
        instants = steps[0][:, None] + steps[1][:, None] * self.nodes
        seen = [
            approach(self.contacts[k], *(part[pressing_rows] for part in (*motion, instants)))
            for k, pressing_rows in zip(which, rows, strict=True)
        ]
        time, length = (part[np.concatenate(rows)] for part in steps)
        depth = np.concatenate([-look.gap for look in seen])
        rate = np.concatenate([-look.gap_rate for look in seen])
        speeds = np.concatenate(
            [began[pressing_rows, k] for k, pressing_rows in zip(which, rows, strict=True)]
        )
        step = self._polynomial
        depths = step.coefficients(depth, rate * length[:, None])
        speed = step.derivative(depths) / length[:, None]
        low, high = np.zeros(len(depths)), np.ones(len(depths))

        def force(times: FloatArray) -> FloatArray:
            return law.force(step.value(depths, times), step.value(speed, times), speeds[:, None])

        hardest = highest(force, low, high, LOOKS_AT_FORCES)
        lowest = highest(lambda times: step.value(depths, times), low, high, LOOKS_AT_FORCES)
        columns = (
            time + hardest * length,
            force(hardest[:, None])[:, 0],
            time + lowest * length,
            np.maximum(step.value(depths, lowest[:, None])[:, 0], 0.0),
        )
        ends = np.cumsum([len(pressing_rows) for pressing_rows in rows])[:-1]
        for k, *peaks in zip(which, *(np.split(column, ends) for column in columns), strict=True):
            self._pressed[k].append(tuple(peaks))
            self.deepest[k] = max(self.deepest[k], float(peaks[3].max()))

    def peaks(self, contact: int, begin: float, end: float) -> tuple[float, float]:
        """Largest force (N) and penetration (m) of a contact from `begin` to `end` (s).

        All steps have to be taken before.
        """
        if contact not in self._peaks:
            self._peaks[contact] = self._of_contact(contact)
        within = (peak.between(begin, end).value for peak in self._peaks[contact])
        force, depth = (float(values.max(initial=0.0)) for values in within)
        return force, depth

    def _of_contact(self, k: int) -> tuple[Extremes, Extremes]:
        """Largest force and penetration of a contact, of every step in which it presses."""
        columns = [np.concatenate([np.zeros(0), *c]) for c in zip(*self._pressed[k], strict=True)]
        force_at, force, depth_at, depth = columns or [np.zeros(0)] * 4
        return Extremes(force_at, force), Extremes(depth_at, depth)

    def extremes(self) -> dict[str, Extremes]:
        """All extremes, for the Result: see `result.Result.extremes`."""
        by_name = {}
        for i, name in enumerate(self._watched.names):
            time, value = self._seeker.turning_points(i)
            by_name[name] = Extremes(time, self._watched.unsquared(i, value))
        for k, contact in enumerate(self.contacts):
            if contact.name in self._watched.contacts:
                force, depth = self._of_contact(k)
                names = self._watched.of_contact(contact.name)
                by_name |= dict(zip(names, (force, depth), strict=True))
        return by_name


def _rounding(sizes: FloatArray, speeds: FloatArray, shortest: float) -> FloatArray:
    """Rounding of the watched quantities in a step, in their order.

    Places are differences of lengths with these `sizes`; `speeds` (m, n, speeds) have the square of
    the point's speed last. In redundant coordinates joints hold places, and speeds follow from
    places: so speeds have the rounding of places over the `shortest` step (s).
    """
    of_rates = EPSILON / shortest * sizes[:-2]  # of answers and of x
    fastest = float(np.sqrt(speeds[..., -1].max()))
    of_square = (fastest + of_rates[-1]) ** 2 - fastest**2
    return np.array([*(ROUNDING * sizes), *of_rates[:-1], of_square])


# Of a contact's half period: length of the first step in it, or of any step without error control.
# The stages of a longer step could all miss the touch.
FIRST = 0.15
# Parts of a step at which its largest force is looked for, on the polynomial through its nodes.
LOOKS_IN_STEPS = np.linspace(0.0, 1.0, 33)


@cache
def to_looks(nodes: int) -> FloatArray:
    """Weights (looks, nodes) that give values at looks within a step from those at its nodes."""
    return collocation(nodes - 1).to_parts(LOOKS_IN_STEPS)


class Side(Enum):
    """State of a contact: where its point is."""

    APART = auto()
    PRESSED = auto()
    BEHIND = auto()


class Change(Enum):
    """Event of a contact."""

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
    """A contact at the instant at which a touch begins or ends.

    `place` on the face (m), rate of the gap (m/s), and `totals`: impulse (N s) and energy (J) that
    the contact has taken so far, see `BlockRecorder.totals_of`. `press` (N) is the force at the
    begin, if the step ended after it.
    """

    time: float
    place: float
    gap_rate: float
    totals: tuple[float, float] = (0.0, 0.0)
    press: float = 0.0


class Touches:
    """States and touches of all contacts of a run; the first `faces` contacts may be behind."""

    def __init__(self, contacts: Sequence[Contact], faces: int) -> None:
        self.rigid = np.array(
            [isinstance(contact.law, Impulse) for contact in contacts], dtype=bool
        )
        self.sides = [Side.APART] * len(contacts)
        self.pressed = np.zeros(len(contacts), dtype=bool)  # a new array with every change
        self.pressing: list[int] = []  # numbers of the contacts that press
        # m/s: speed with which the last touch of each contact began; a new array with every touch.
        self.approach = np.zeros(len(contacts))
        self._faces = faces
        self._ended: dict[int, list[Interval]] = {}
        self._open: dict[int, Interval] = {}  # with the totals at its begin

    # --- where they are -----------------------------------------------------------------------

    def start(self, gaps: FloatArray) -> None:
        """Take the gaps (faces,), m, at time 0."""
        for k in np.flatnonzero(gaps < -PLACE_ROUNDING).tolist():
            self.sides[k] = Side.BEHIND

    def beside(self, k: int, gap: float) -> None:
        """Set the state of a contact whose point is beside its face."""
        if self.sides[k] is not Side.PRESSED:
            self.sides[k] = Side.BEHIND if gap < -GAP_ROUNDING else Side.APART

    def idle(self, k: int, *, idle: bool = True) -> None:
        """Put a contact aside, as if its point were behind the face; or take it up again."""
        self._set(k, Side.BEHIND if idle else Side.APART)

    def crossing(self, k: int, gap: float, gap_rate: float, inside: float) -> Change:
        """Tell which event a contact has; its point is `inside` (m) the ends of the face.

        A contact that closes may bounce, by its law. One that still closes does not open.
        """
        if self.sides[k] is Side.PRESSED:
            # A point that leaves its face so near to the end slid off.
            stays = self.rigid[k] or gap_rate < 0 or inside < -gap
            off = stays and inside < INVISIBLE
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
        """Let an event change a contact, except a bounce."""
        if what is Change.PASSES:
            # The rate decides, not the state before: if a step ended far past the line, `beside`
            # has changed the state already.
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
        """Let a contact bounce: an impact, which takes no time."""
        self._set(k, BECOMES[self.sides[k], Change.BOUNCES])
        self._ended.setdefault(k, []).append(impact)

    def note(self, press: FloatArray) -> None:
        """Take forces (steps, nodes, c): those by an impulse law do not follow from a depth."""
        for k in np.flatnonzero(self.pressed & self.rigid).tolist():
            looks = to_looks(press.shape[1]) @ press[:, :, k].T
            largest = max(self._open[k].peak_force, float(looks.max()))
            self._open[k] = replace(self._open[k], peak_force=largest)

    # --- what they did ------------------------------------------------------------------------

    @property
    def ever(self) -> set[int]:
        """Contacts that touched so far."""
        return {*self._ended, *self._open}

    def intervals(
        self, first: int, now: Sequence[tuple[float, tuple[float, float]]], seeker: ExtremeSeeker
    ) -> Intervals:
        """Touches of the contacts from `first` on.

        `now` (pairs,) has their present places (m) and totals; `seeker` has the largest forces and
        depths.
        """
        touches = []
        for pair, (place, totals) in enumerate(now):
            k = first + pair
            lasting = [_until(self._open[k], place, totals)] if k in self._open else []
            for interval in (*self._ended.get(k, ()), *lasting):
                force, depth = seeker.peaks(k, interval.begin, interval.end)
                peak = inf if interval.impact else max(interval.peak_force, force)
                touches.append(replace(interval, peak_force=peak, penetration=depth, pair=pair))
        return Intervals.of(touches)


def _until(begun: Interval, place: float, totals: tuple[float, float]) -> Interval:
    """Return a touch up to now; its impulse and energy are differences of totals."""
    impulse, lost = totals[0] - begun.impulse, totals[1] - begun.energy_lost
    return replace(begun, end_place=place, impulse=impulse, energy_lost=lost)

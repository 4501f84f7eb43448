"""The first event within a step: of contacts, pieces of slots, dry friction, kinks of formulas.

Between two events dry friction in a joint has one sign. A joint that slides comes to rest where its
speed is zero; one that rests slides where the torque that holds it reaches its bound. The force of
a slide changes sides where it is zero.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum, auto
from functools import partial
from math import inf
from typing import Any, Protocol

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray, IndexArray
from exudyn_flexlink.engines.exudyn.minimal.contacts import (
    CurveFollower,
    LapFollower,
    TableFollower,
    Touch,
)
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeState
from exudyn_flexlink.engines.exudyn.minimal.formulas import KinkWatch
from exudyn_flexlink.engines.exudyn.minimal.friction import STILL, JointFrictions
from exudyn_flexlink.engines.exudyn.minimal.kinematics import TrackPoint
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel, TreeForces
from exudyn_flexlink.engines.pair_events import (
    Flight,
    Path,
    RopeFlight,
    RopePaths,
    calm,
    changed,
    first_of,
    first_part,
    late_by,
)
from exudyn_flexlink.engines.touching import Side, to_looks
from exudyn_flexlink.integrate.events import (
    EVENT_TIME,
    GAP_ROUNDING,
    Crossing,
    Guard,
    fall,
    first_fall,
)
from exudyn_flexlink.integrate.problem import instant
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.mechanism import Poses, RopeContact, Seen

Value = Callable[[TreeForces], FloatArray]
"""Event function of a joint: values (n,) of a tree's state and forces, positive until the event."""


class Happens(Enum):
    """What becomes of the friction in a joint."""

    RESTS = auto()  # or slides back
    SLIDES = auto()
    SWEPT_ALONG = auto()  # by a drive, from rest
    CHANGES_SIDES = auto()


@dataclass(frozen=True)
class FrictionGuard(Guard):
    """The event `what` of friction number `joint`: its event function `value` comes to zero."""

    watch: FrictionWatch
    joint: int
    what: Happens
    value: Value

    @property
    def bends(self) -> bool:  # type: ignore[override]
        """Whether the friction is continuous at the event, and only bends there."""
        return self.what in (Happens.SLIDES, Happens.CHANGES_SIDES)

    def late(self, step: Step) -> float:
        """How long (s) before a step's end a joint came to rest; negative: after; else 0."""
        return self.watch.late(self.joint, step) if self.what is Happens.RESTS else 0.0

    def cross(self, time: float) -> None:
        """Change the friction. A joint comes to rest, or is swept along, as equations restart."""
        self.watch.cross(time, self.joint, self.what, leaps=not self.bends)


class FrictionWatch:
    """Looks at the steps of a model, and tells its friction what happens."""

    def __init__(self, model: MinimalModel, changes: Changes) -> None:
        self._model, self._frictions, self._changes = model, model.frictions, changes

    def settle(self, time: float, q: FloatArray, v: FloatArray) -> None:
        """Let joints slide or rest as the present state tells: speeds or forces may have jumped."""
        if self._frictions.all:
            states = self._model.states(np.array([time]), q[None], v[None])
            inside = self._model.window.all_inside(np.array([time]))
            self._frictions.settle(self._model.without_reactions(inside, states))

    def events(self, step: Step) -> list[Crossing]:
        """What happens first to each joint within a step."""
        if not self._frictions.all:
            return []
        known = [step.begin.kept.pick(None), step.stages.kept]
        happening = []
        for guard in self._guards(step):
            at_nodes = np.concatenate([guard.value(state) for state in known])
            if (to_looks(len(at_nodes)) @ at_nodes)[1:].min() > 0:
                continue
            value = partial(self._value, step, guard.value)
            time = first_fall(value, step.slope(at_nodes), (step.t, step.end))
            if time is not None:
                happening.append(Crossing(time, guard))
        return happening

    def _guards(self, step: Step) -> Iterator[FrictionGuard]:
        """What may happen to each joint, as it slides or rests now."""
        joints, rows, guard = self._frictions, self._frictions.rows, partial(FrictionGuard, self)
        driven = joints.driven(step.begin.kept.state)
        for k, way in enumerate(joints.way.tolist()):
            if way:
                yield guard(k, Happens.RESTS, _speed(rows[k], way, joints.since[k]))
            elif driven[k]:
                yield guard(k, Happens.SWEPT_ALONG, _stillness(rows[k]))
            else:
                yield guard(k, Happens.SLIDES, partial(_left_of_bound, joints, k))
        for k in joints.has_sides.tolist():
            if joints.way[k]:
                yield guard(k, Happens.CHANGES_SIDES, _press(k, joints.side[k]))

    def _value(self, step: Step, value: Value, t: float) -> float:
        """Event function at a time (s) within the step."""
        q, v = step.at(np.array([t]))
        return float(value(self._model.evaluate(t, q[0], v[0]).kept.pick(None))[0])

    def late(self, k: int, step: Step) -> float:
        """How long (s) before a step's end joint k came to rest; negative: after."""
        row = self._frictions.rows[k]
        q, v = step.finish.q, step.finish.v
        state = self._model.state(step.end, q, v)
        speed = row @ state.v - self._frictions.since[k]
        slope = row @ (state.b + state.transform.expanded(step.finish.a))
        near = abs(speed) <= abs(slope) * instant(step.end, EVENT_TIME)
        return 0.0 if near or slope == 0 else float(speed / slope)

    def cross(self, time: float, k: int, what: Happens, *, leaps: bool) -> None:
        """Change the friction of joint k."""
        self._changes.keep(leaps=leaps)
        if what is Happens.SLIDES:
            known = self._model.evaluate(time, *self._model.coordinates.independent()).kept
            self._frictions.slide(k, known.friction, known.state.v)
        elif what is Happens.RESTS:
            self._frictions.stopped = k
        elif what is Happens.CHANGES_SIDES:
            self._frictions.side[k] *= -1


def _speed(row: FloatArray, way: float, since: float) -> Value:
    return lambda tree: np.asarray(way * (tree.state.v @ row - since))


def _stillness(row: FloatArray) -> Value:
    return lambda tree: np.asarray(STILL - np.abs(tree.state.v @ row))


def _left_of_bound(joints: JointFrictions, k: int, tree: TreeForces) -> FloatArray:
    """How far the torque or force that holds a joint at rest is below its bound."""
    return joints.left_of_bound(k, tree.friction[:, k])


def _press(k: int, side: float) -> Value:
    return lambda tree: np.asarray(side * tree.friction[:, k, 2])


Goal = Callable[[FloatArray], float]
"""Angle (rad) that is still to turn, by all coordinates (links,) of the tree."""
Followed = TrackPoint | CurveFollower | TableFollower | LapFollower
PlaceOf = Callable[[FloatArray, FloatArray], Any]
"""Places (n,) of what is followed, from coordinates (n, links) and slots' places (n, slots)."""
Following = tuple[Followed, PlaceOf]
"""What is followed along pieces, and where it is."""

LEAST_PRESS = 0.5  # of a step's largest reaction: one that stays above did not vanish in between
MOST_LATE = 1e-6  # of the step: rounding makes no event later than that


class Changes(Protocol):
    """What guards change as events happen: `MinimalProblem` is that."""

    def end_of(self, step: Step) -> TreeState:
        """All coordinates at the end of a step."""

    def keep(self, *, leaps: bool) -> None:
        """Record the present instant; where something leaps, also the state before it does."""

    def contact_guard(self, k: int) -> Guard:
        """Guard of contact k, which begins or ends; pairs of link and guide follow the scene's."""

    def piece_guard(self, point: Followed, way: int) -> Guard:
        """Guard of what comes to the end of its piece of a curve (way 1), or to its start (-1)."""

    def turns_guard(self) -> Guard:
        """Guard of the turns that end the run."""

    def short_guard(self, rope: str) -> Guard:
        """Guard of a rope over points, of which a piece has no length left."""


class EventFinder:
    """Finds the first event of a step; `seen` are all contacts after the last accepted step."""

    def __init__(self, model: MinimalModel, goal: Goal | None, changes: Changes) -> None:
        x, v = model.start
        self.model, self.goal, self._changes = model, goal, changes
        self._sides, self._contacts = model.touches, model.contacts
        self._count = self._contacts.count
        self._lengths = self._contacts.length
        self._endless = np.isinf(self._lengths)
        self._held = np.array(
            [getattr(contact, "side", 1.0) == 0 for contact in self._contacts.all], dtype=bool
        )
        self._pairs = slice(self._count, None)  # of link and guide: they follow the scene's
        self._poses = model.contacts.poses
        self.x, self._v, self._t = x, v, 0.0
        self.seen = self._contacts.whole_group.seen(self._poses(x, v))
        self.kinks = KinkWatch(model, changes.end_of)
        self.frictions = FrictionWatch(model, changes)
        self._states: dict[float, TreeState] = {}  # by time (s), within the present step
        self._ahead: tuple[TreeState, Seen] | None = None  # contacts where a tried step ends

    def accept(self, end: TreeState) -> None:
        """Take the coordinates at the end of a step."""
        self.x, self._v, self._t, self.seen = end.x, end.v, float(end.t), self._seen_at(end)
        for k in np.flatnonzero(self._inside(self.seen)[: self._count] < 0).tolist():
            self._sides.beside(k, float(self.seen.gap[k]))
        for k in {**self._contacts.curves, **self._contacts.tables}:
            self._contacts.follow(k, end.x, presses=self.presses(k))
        for pin, view in self._contacts.lap_views():
            pin.follow(complex(view(end.x[None], end.x)[0]))

    def presses(self, k: int) -> bool:
        """Tell whether contact k presses."""
        return bool(self._sides.pressed[k])

    def touch(self, k: int) -> Touch:
        """Where contact k is at the end of the last step."""
        return self._contacts.touch_of(k, self.seen.of(k))

    def touch_at(self, k: int, end: TreeState) -> Touch:
        """Where contact k is at the end of a step that is looked at."""
        return self._contacts.touch_of(k, self._seen_at(end).of(k))

    def first(self, step: Step, end: TreeState) -> Crossing | None:
        """What happens first within the step, which ends at these coordinates."""
        self._states = {step.end: end}
        happening = self._ends_of_pieces(step, end)
        if len(self._contacts.all):
            nodes = self._at_nodes(step.stages.kept.state.pick(slice(-1)), end)
            path, watched = self._path(nodes, end)
            happening += self._changes_of_contacts(step, nodes, end, (path, watched))
            if pairs := len(self._contacts.all) - self._count:  # `watched` ends with all of them
                happening += self._touch_of_pairs(step, path.of(slice(-pairs, None)))
        if (kink := self.kinks.first(step)) is not None:
            happening.append(kink)
        happening += self.frictions.events(step)
        if self.goal is not None and self.goal(end.x) < 0:
            time = fall(lambda t: self._to_turn(step, t), step.t, step.end)
            happening.append(Crossing(time, self._changes.turns_guard()))
        return min(happening, key=lambda crossing: crossing.time, default=None)

    def look_again(self, end: TreeState) -> None:
        """Take the present state after speeds have jumped."""
        self._v, self.seen = end.v, self._seen_at(end)

    def _at_nodes(self, within: TreeState, end: TreeState) -> Poses:
        """Poses at a step's nodes: where the last step ended, `within` the step, and at its end."""
        x = np.vstack([self.x, within.x, end.x])
        v = np.vstack([self._v, within.v, end.v])
        return self._poses(x, v, np.hstack([self._t, within.t, end.t]))

    def _seen_at(self, end: TreeState) -> Seen:
        """All contacts at the end of a step; they are kept for when the step is accepted."""
        if not self._contacts.all:
            return self.seen
        if self._ahead is None or self._ahead[0] is not end:
            self._ahead = end, self._contacts.whole_group.seen(self._poses(end.x, end.v, end.t))
        return self._ahead[1]

    def _inside(self, seen: Seen) -> FloatArray:
        """How far (m) places are from the nearer ends of faces; infinite where there are none."""
        if self._endless.all():
            return np.full(seen.place.shape, inf)
        return np.where(self._endless, inf, np.minimum(seen.place, self._lengths - seen.place))

    # --- pairs of link and guide --------------------------------------------------------------

    def changed_pairs(self, time: float, contact: int | None = None) -> list[int]:
        """Pairs that now (s), at an event of this `contact`, begin or cease to press."""
        pairs, first = self._pairs, self._count
        now = self.seen.of(pairs).closed(self._held[pairs])
        event = None if contact is None else contact - first
        which = changed(now, self._lengths[pairs], self._sides.pressed[pairs], time, event)
        return [first + k for k in np.flatnonzero(which).tolist()]

    def late_pair(self, k: int, end: TreeState, time: float) -> float:
        """How long (s) before a step's end at this time pair k's event was; negative: after."""
        return late_by(self._seen_at(end).closed(self._held), self._lengths, k, time)

    def _touch_of_pairs(self, step: Step, path: Seen) -> list[Crossing]:
        """What a pair of link and guide does first within a step."""
        path = path.closed(self._held[self._pairs])
        lengths, pressing = self._lengths[self._pairs], self._sides.pressed[self._pairs]
        restless = np.flatnonzero(~calm(path, lengths, pressing, step.h))
        if not len(restless):
            return []
        at_once = self.changed_pairs(step.t)
        if at_once:
            return [Crossing(step.t, self._changes.contact_guard(at_once[0]))]
        touch = first_of(restless, path, lengths, pressing, step.h)
        if touch is None:
            return []
        part, pair = touch
        guard = self._changes.contact_guard(self._count + pair)
        return [Crossing(step.t + part * step.h, guard)]

    # --- ends of pieces -----------------------------------------------------------------------

    def _state(self, step: Step, t: float) -> TreeState:
        """All coordinates at a time within the step."""
        state = self._states.get(t)
        if state is None:
            q, v = step.at(np.array([t]))
            state = self._states[t] = self.model.state(t, q[0], v[0])
        return state

    def _to_turn(self, step: Step, t: float) -> float:
        assert self.goal is not None
        return float(self.goal(self._state(step, t).x))

    def _ends_of_pieces(self, step: Step, end: TreeState) -> list[Crossing]:
        """Where slots' points, and what presses on curves, come to ends of their pieces.

        A point may pass the end of a piece and return within the step, so the stages count, too.
        """
        stages, points = step.stages.kept.state, self.model.coordinates.points
        passed = np.vstack([stages.places[:-1], end.places])
        lowest, highest = passed.min(0).tolist(), passed.max(0).tolist()
        leaving = [
            k
            for k, (point, low, high) in enumerate(zip(points, lowest, highest, strict=True))
            if point.left(high)[0] < -point.seam or point.left(low)[1] < -point.seam
        ]
        followed: list[Following] = [(points[k], partial(_place_of, k)) for k in leaving]
        for k in self._sides.pressing:
            followed += self._contacts.followed(k)
        followed += self._contacts.lap_views()
        if not followed:
            return []
        nodes = np.vstack([stages.x[:-1], end.x]), passed
        passages = [self._end_of_piece(step, *point_followed, nodes) for point_followed in followed]
        return [event for event in passages if event is not None]

    def _end_of_piece(
        self, step: Step, point: Followed, place_of: PlaceOf, nodes: tuple[FloatArray, FloatArray]
    ) -> Crossing | None:
        """Where what is followed comes to the end of its piece; `nodes` go into `place_of`."""
        times = (step.t + step.h * step.method.c).tolist()
        for time, place in zip(times, place_of(*nodes).tolist(), strict=True):
            ahead, behind = point.left(place)
            if min(ahead, behind) >= -point.seam:
                continue
            side, way = (0, 1) if ahead < behind else (1, -1)
            on_piece = partial(self._on_piece, step, point, place_of, side)
            passed = first_fall(on_piece, None, (step.t, time))
            if passed is not None:
                return Crossing(passed, self._changes.piece_guard(point, way))
        return None

    def _on_piece(
        self, step: Step, point: Followed, place_of: PlaceOf, side: int, t: float
    ) -> float:
        """How much of the piece is left ahead (side 0) or behind (1) at a time (s) in the step."""
        state = self._state(step, t)
        return point.left(place_of(state.x[None], state.places[None])[0])[side]

    # --- contacts -----------------------------------------------------------------------------

    def _path(self, nodes: Poses, end: TreeState) -> tuple[Seen, IndexArray]:
        """Contacts at a step's nodes, and their numbers.

        Free contacts on curves are left out: to look at them takes long.
        """
        numbers = range(len(self._contacts.all))
        curves = self._contacts.curves
        watched = [k for k in numbers if k not in curves or self.presses(k) or self.let_go(k)]
        if len(watched) < len(numbers):
            return self._contacts.group(tuple(watched)).seen(nodes), np.array(watched, dtype=int)
        path = self._contacts.whole_group.seen(nodes)
        self._ahead = end, path.pick(-1)
        return path, np.array(watched, dtype=int)

    def _changes_of_contacts(
        self, step: Step, nodes: Poses, end: TreeState, path: tuple[Seen, IndexArray]
    ) -> list[Crossing]:
        numbers = range(self._count)
        held = [k for k in numbers if self.presses(k) or self.let_go(k)]
        others = {*held, *self._contacts.idle, *self._contacts.pieces}
        free = np.array([k for k in numbers if k not in others], dtype=int)
        times = [(self._change(k, step), k) for k in self._restless(step, *path, held)]
        for k, search in self._flights(step, nodes, end, free):
            times.append((self._closing(k, first_part(search), step), k))
        guard, short = self._changes.contact_guard, list[Crossing]()
        for k, paths in self._ropes(step, end):
            if k not in held:
                times.append((self._closing(k, first_part(RopeFlight(*paths)), step), k))
            short += self._shrinking(k, step, paths[0])
        return [*short, *(Crossing(time, guard(k)) for time, k in times if time is not None)]

    def _ropes(self, step: Step, end: TreeState) -> Iterator[tuple[int, RopePaths]]:
        """Numbers of ropes over points, and the paths of their pieces at the nodes of a step."""
        if not self._contacts.pieces:
            return
        nodes = self._exact_nodes(step, end)
        t = np.asarray(nodes.t)
        for k, pieces in self._contacts.pieces.items():
            rope, (place, rate) = self._contacts.all[k], pieces.path(nodes)
            assert isinstance(rope, RopeContact)
            length = rope.free_length.values(t), step.h * rope.free_length.rates(t)
            yield k, ((place.T, step.h * rate.T), length)

    def _shrinking(self, k: int, step: Step, paths: Path) -> Iterator[Crossing]:
        """Where pieces of a rope become too short within a step."""
        rope = self._contacts.all[k]
        assert isinstance(rope, RopeContact)
        glimpse = self._contacts.group((k,)).shapes.glimpse(0)
        for path in zip(*paths, strict=True):
            part = first_part(Flight(glimpse, rope.shortest, path, 1.0))
            if part is not None:
                guard = self._changes.short_guard(rope.name)
                yield Crossing(step.t + part * step.h, guard)

    def _closing(self, k: int, part: float | None, step: Step) -> float | None:
        """Instant (s) of an event of contact k after a part of the step; None where there is none.

        It follows from the state there: along a long step a place is rounded by more than the
        height of a small bounce.
        """
        if not part:
            return None if part is None else step.t
        time = step.t + part * step.h
        touch = self._touch(k, step, time)
        late = touch.gap / touch.gap_rate if touch.gap_rate else 0.0
        return time - late if abs(late) < MOST_LATE * step.h else time

    def _flights(
        self, step: Step, nodes: Poses, end: TreeState, free: IndexArray
    ) -> Iterator[tuple[int, Flight]]:
        """Searches for contacts `free` that may close, since they move farther than their gap.

        A point that surely stays beside its face is left out, though it may cross the face's line.
        """
        if not len(free):
            return
        place, rate = self._places(step.h, nodes, free)
        moved = step.method.polynomial.coefficients(place, rate, 1)
        along, across = (np.abs(part).sum(axis=1) for part in (moved.real, moved.imag))
        straight = self._contacts.scene_group.shapes.straight[free]
        way = np.where(straight, across, np.abs(moved).sum(axis=1))
        ends = self.seen, self._seen_at(end)
        gap = (ends[0].gap + ends[1].gap)[free]
        inside = (self._inside(ends[0]) + self._inside(ends[1]))[free]
        sides = np.array([self._way(k) for k in free.tolist()])
        passes = straight & (inside < -along)
        near = free[(sides * gap <= way) & ~passes]
        if not len(near):
            return
        exact = self._exact_nodes(step, end)
        paths = zip(*self._places(step.h, exact, near), strict=True)
        for k, flown in zip(near.tolist(), paths, strict=True):
            glimpse, feature = (
                self._contacts.scene_group.shapes.glimpse(k),
                self._contacts.all[k].feature,
            )
            yield k, Flight(glimpse, feature, flown, self._way(k))

    def _exact_nodes(self, step: Step, end: TreeState) -> Poses:
        """Poses at the nodes of a step, on its polynomial.

        The last round of the iteration moved the stages by a little more than a gap's rounding.
        """
        times = step.t + step.h * step.method.c[:-1]
        return self._at_nodes(self.model.states(times, *step.at(times)), end)

    def _places(
        self, h: float, nodes: Poses, which: IndexArray
    ) -> tuple[ComplexArray, ComplexArray]:
        """Places (c, n) of contacts at the nodes of a step of h (s), m, and rates, m per step."""
        place, rate = self._contacts.scene_group.path(nodes)
        return place.T[which], h * rate.T[which]

    def _restless(self, step: Step, path: Seen, watched: IndexArray, held: list[int]) -> list[int]:
        """Which of the contacts `held`, which press or have let go, may change within the step."""
        if not held:
            return []
        pressed = self._sides.pressed[held]
        path = self._from_sides(path.of(np.searchsorted(watched, held)), held)
        still = calm(path, self._lengths[held], pressed, step.h)
        press = step.stages.kept.pushes[:, held, 0]
        lifts = pressed & (self._sides.rigid[held] | self._contacts.lets_go[held])
        steady = press.min(axis=0) >= LEAST_PRESS * press.max(axis=0)
        still &= ~lifts | steady
        return [k for k, stays in zip(held, still.tolist(), strict=True) if not stays]

    def _from_sides(self, path: Seen, which: list[int]) -> Seen:
        """Contacts at nodes as `calm` takes them: with gaps from the side on which their parts are.

        The gap of a rigid contact that presses counts as closed: its reaction tells when it opens.
        Round shapes have no ends, so that any place on them is inside.
        """
        endless = self._endless[which]
        place, slip = np.where(endless, 1.0, path.place), np.where(endless, 0.0, path.slip)
        way = np.array([self._way(k) for k in which])
        path = Seen(way * path.gap, place, way * path.gap_rate, slip)
        return path.closed((self._sides.pressed & self._sides.rigid)[which])

    def let_go(self, k: int) -> bool:
        """Tell whether a contact let go before its gap had opened, and has not been apart since."""
        closed = self.seen.gap[k] < -GAP_ROUNDING and self._sides.sides[k] is Side.APART
        return bool(self._contacts.lets_go[k] and closed)

    def _change(self, k: int, step: Step) -> float | None:
        """Instant (s) at which contact k, which presses or has let go, changes; None: it does not.

        The rate of a force shows where it vanishes and comes back between two looks.
        """
        rate = None
        if self.presses(k) and (k in self._contacts.rigid or self._contacts.lets_go[k]):
            forces = step.begin.kept.pushes[k, 0], step.stages.kept.pushes[:, k, 0]
            rate = step.slope(np.append(*forces))
        return first_fall(partial(self._margin, k, step), rate, (step.t, step.end))

    def _margin(self, k: int, step: Step, t: float) -> float:
        """Event function (m) of contact k, positive until it changes; of a reaction in N."""
        if self.presses(k) and k in self._contacts.rigid:
            q, v = step.at(np.array([t]))
            known = self.model.evaluate(t, q[0], v[0]).kept
            inside = self._contacts.touch(k, known.state.x, known.state.v, known.t).inside
            return min(float(known.pushes[k, 0]), inside)
        touch = self._touch(k, step, t)
        pressed = self._contacts.pressed_by(k, touch)
        # What has let go has no force until it is apart.
        return min(pressed, touch.inside) if self.presses(k) else -pressed

    def _touch(self, k: int, step: Step, t: float) -> Touch:
        state = self._state(step, t)
        return self._contacts.touch(k, state.x, state.v, state.t)

    def _way(self, k: int) -> float:
        """Sign of a gap: -1 of a point behind its face, whose gap is that to the back; else 1."""
        return -1.0 if self._sides.sides[k] is Side.BEHIND else 1.0


def _place_of(k: int, _: FloatArray, places: FloatArray) -> FloatArray:
    return places[:, k]

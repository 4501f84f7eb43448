"""What happens first within a step: a contact begins or ends, a piece of a slot ends."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from math import inf
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray, IndexArray
from exudyn_flexlink.engines.exudyn.faces import Touch
from exudyn_flexlink.engines.exudyn.minimal.contacts import RigidContact, TableFollower
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeState
from exudyn_flexlink.engines.exudyn.minimal.friction_events import FrictionWatch
from exudyn_flexlink.engines.exudyn.minimal.guided import TrackPoint
from exudyn_flexlink.engines.exudyn.minimal.kinematics import Moving
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.engines.exudyn.minimal.shapes import OnCurve, RelativeMotion
from exudyn_flexlink.engines.exudyn.minimal.state_formulas import KinkWatch
from exudyn_flexlink.engines.exudyn.minimal.walls import WallWatch
from exudyn_flexlink.engines.pair_events import POLYNOMIAL, Flight, Seen, calm, first_part
from exudyn_flexlink.engines.touching import Side
from exudyn_flexlink.integrate.collocation import C
from exudyn_flexlink.integrate.events import GAP_ROUNDING, Event, fall, first_fall
from exudyn_flexlink.integrate.radau import Step

Goal = Callable[[FloatArray], float]
"""Angle still to turn at all coordinates of the tree."""
Left = Callable[[FloatArray, FloatArray], tuple[float, float]]
"""How far a point is from the end of its piece, and from its start, at coordinates and places."""

Followed = TrackPoint | OnCurve | TableFollower
Following = tuple[Followed, float, Left]
"""What is followed along pieces, how little beyond one is still on it, and what is left of it."""

LEAST_PRESS = 0.5  # of the largest reaction in a step: one above it did not vanish in between
MOST_LATE = 1e-6  # of the step: rounding does not make an event later than that
SEAM = 1e-12  # of a slot's parameter: this little beyond a piece is on it


class ContactChange(NamedTuple):
    """A contact, of this number, begins or ends; pairs of link and guide follow the scene's."""

    contact: int


class PieceEnd(NamedTuple):
    """What is followed on a curve comes to the end of its piece (way 1), or to its start (-1)."""

    point: Followed
    way: int


class TurnsMade(NamedTuple):
    """The turns that end the run are made."""


class EventFinder:
    """Looks at steps; `touches` are those of the contacts at the end of the last one accepted."""

    def __init__(
        self, model: MinimalModel, goal: Goal | None, x: FloatArray, v: FloatArray
    ) -> None:
        self.model, self.goal = model, goal
        self._sides = model.touches
        self.touches = [contact.touch(x, v) for contact in model.contacts]
        self._endless = np.array([touch.inside == inf for touch in self.touches], dtype=bool)
        own = np.array([contact.length for contact in model.contacts])
        self._lengths = np.where(self._endless, inf, own)
        shapes = [contact.shape for contact in model.contacts]
        self._motion = RelativeMotion(model.layout, shapes)
        self._straight = np.array([shape.straight for shape in shapes], dtype=bool)
        self._let_go = np.array([contact.lets_go for contact in model.contacts], dtype=bool)
        self.x, self._v = x, v
        self._move = model.kinematics.moving
        self.walls = WallWatch(model.walls, model.kinematics, self._move(x, v))
        self.kinks = KinkWatch(model)
        self.frictions = FrictionWatch(model)
        self._looks: dict[float, TreeState] = {}  # within the present step
        self._ahead: tuple[TreeState, list[Touch]] | None = None  # where the last step ends

    def accept(self, end: TreeState) -> None:
        """Take the coordinates at the end of a step."""
        self.walls.accept(end)
        self.x, self._v, self.touches = end.x, end.v, self._touches_at(end)
        for k, touch in enumerate(self.touches):
            if touch.inside < 0:
                self._sides.beside(k, touch.gap)
            self.model.contacts[k].follow(end.x, presses=self.presses(k))

    def presses(self, k: int) -> bool:
        """Tell whether contact k does."""
        return bool(self._sides.pressed[k])

    def first(self, step: Step, end: TreeState) -> Event | None:
        """What happens first within the step, which ends at these coordinates."""
        self._looks = {step.end: end}
        found = self._ends_of_pieces(step, end)
        if len(self._sides.sides):
            nodes = self._at_nodes(step.stages.kept.state.pick(slice(-1)), end)
            found += self._changes_of_contacts(step, nodes, end)
            if (touched := self.walls.first(step, nodes, end)) is not None:
                what = ContactChange(len(self.touches) + touched[1])
                found.append(Event(touched[0], what, bends=True))
        if (kink := self.kinks.first(step)) is not None:
            found.append(kink)
        found += self.frictions.events(step)
        if self.goal is not None and self.goal(end.x) < 0:
            time = fall(lambda t: self._to_turn(step, t), step.t, step.end)
            found.append(Event(time, TurnsMade()))
        return min(found, key=lambda event: event.time, default=None)

    def look_again(self, end: TreeState) -> None:
        """Take the present state, whose speeds have jumped."""
        self._v, self.touches = end.v, self._touches_at(end)
        self.walls.accept(end)

    def _at_nodes(self, within: TreeState, end: TreeState) -> Moving:
        """How the links move at a step's nodes, of which those `within` and the end are known."""
        x, v = np.vstack([self.x, within.x, end.x]), np.vstack([self._v, within.v, end.v])
        return self._move(x, v)

    def _touches_at(self, end: TreeState) -> list[Touch]:
        """Touches at the end of a step, which are asked for again as it is accepted."""
        if self._ahead is None or self._ahead[0] is not end:
            self._ahead = end, [contact.touch(end.x, end.v) for contact in self.model.contacts]
        return self._ahead[1]

    def _at(self, step: Step, t: float) -> TreeState:
        """All coordinates at a time within the step."""
        state = self._looks.get(t)
        if state is None:
            q, v = step.at(np.array([t]))
            state = self._looks[t] = self.model.state(t, q[0], v[0])
        return state

    def _to_turn(self, step: Step, t: float) -> float:
        assert self.goal is not None
        return float(self.goal(self._at(step, t).x))

    def _ends_of_pieces(self, step: Step, end: TreeState) -> list[Event]:
        """Where slots' points, and what presses on curves, come to ends of pieces.

        What passes one may be back before the step ends, so that the stages are looked at, too.
        """
        stages, points = step.stages.kept.state, self.model.coordinates.points
        passed = np.vstack([stages.places[:-1], end.places])
        lowest, highest = passed.min(0).tolist(), passed.max(0).tolist()
        leaving = [
            k
            for k, (point, low, high) in enumerate(zip(points, lowest, highest, strict=True))
            if point.left(high)[0] < -SEAM or point.left(low)[1] < -SEAM
        ]
        pressed = [self.model.contacts[k] for k in self.model.pressed_of_scene]
        followed: list[Following] = [
            *((points[k], SEAM, partial(_left_of_slot, points[k], k)) for k in leaving),
            *((own, own.seam, own.left) for contact in pressed for own in contact.followed),
        ]
        if not followed:
            return []
        nodes = [*zip(stages.x[:-1], stages.places[:-1], strict=True), (end.x, end.places)]
        times = (step.t + step.h * C).tolist()
        found = [self._end_of_piece(step, one, zip(times, nodes, strict=True)) for one in followed]
        return [event for event in found if event is not None]

    def _end_of_piece(
        self,
        step: Step,
        one: Following,
        nodes: Iterable[tuple[float, tuple[FloatArray, FloatArray]]],
    ) -> Event | None:
        """Where one of them does, by the times (s) of nodes, with coordinates and places there."""
        point, seam, left = one
        for time, node in nodes:
            ahead, behind = left(*node)
            if min(ahead, behind) >= -seam:
                continue
            side, way = (0, 1) if ahead < behind else (1, -1)
            on_piece = partial(self._on_piece, step, left, side)
            passed = first_fall(on_piece, None, (step.t, time))
            if passed is not None:
                return Event(passed, PieceEnd(point, way))
        return None

    def _on_piece(self, step: Step, left: Left, side: int, t: float) -> float:
        at = self._at(step, t)
        return left(at.x, at.places)[side]

    # --- contacts -----------------------------------------------------------------------------

    def _changes_of_contacts(self, step: Step, nodes: Moving, end: TreeState) -> list[Event]:
        every = range(len(self.model.contacts))
        free = [not self.presses(k) and not self.let_go(k) for k in every]
        held = [k for k in every if not free[k]]
        times = [(self._change(k, step), k) for k in self._restless(step, end, held)]
        for k, search in self._flights(step, nodes, end, np.flatnonzero(free)):
            times.append((self._closing(k, first_part(search), step), k))
        return [Event(time, ContactChange(k)) for time, k in times if time is not None]

    def _closing(self, k: int, part: float | None, step: Step) -> float | None:
        """Instant (s) of an event of contact k after a part of the step, by the state there.

        A place in a long step is rounded by more than a small bounce is high.
        """
        if not part:
            return None if part is None else step.t
        time = step.t + part * step.h
        touch = self._touch(k, step, time)
        late = touch.gap / touch.gap_rate if touch.gap_rate else 0.0
        return time - late if abs(late) < MOST_LATE * step.h else time

    def _flights(
        self, step: Step, nodes: Moving, end: TreeState, free: IndexArray
    ) -> Iterator[tuple[int, Flight]]:
        """Contacts `free` that may close within a step, since the way in it is long enough.

        What surely stays beside its face is left out; what does not may pass the face's line.
        """
        if not len(free):
            return
        place, rate = self._places(step.h, nodes, free)
        moved = POLYNOMIAL.coefficients(place, rate, 1)
        along, across = (np.abs(part).sum(axis=1) for part in (moved.real, moved.imag))
        straight = self._straight[free]
        way = np.where(straight, across, np.abs(moved).sum(axis=1))
        ends = zip(self.touches, self._touches_at(end), strict=True)
        both = [(old.gap + new.gap, old.inside + new.inside) for old, new in ends]
        gap, inside = np.array(both)[free].T
        sides = np.array([self._way(k) for k in free.tolist()])
        near = free[(sides * gap <= way) & ~(straight & (inside < -along))]
        if not len(near):
            return
        # The last round of the iteration moved the stages a little, by more than a gap is rounded.
        times = step.t + step.h * C[:-1]
        within = self.model.states(times, *step.at(times))
        exact = self._at_nodes(within, end)
        paths = zip(*self._places(step.h, exact, near), strict=True)
        for k, path in zip(near.tolist(), paths, strict=True):
            shape = self.model.contacts[k].shape
            yield k, Flight(shape.glance, shape.feature, path, self._way(k))

    def _places(
        self, h: float, nodes: Moving, which: IndexArray
    ) -> tuple[ComplexArray, ComplexArray]:
        """Places (c, n) of contacts at the nodes of a step of h (s), m, and rates, m per step."""
        place, rate = self._motion.look(nodes)
        return place.T[which], h * rate.T[which]

    def _restless(self, step: Step, end: TreeState, held: list[int]) -> list[int]:
        """Contacts that press, or have let go, of which it is not sure that nothing happens."""
        if not held:
            return []
        pressed = self._sides.pressed[held]
        inner = zip(*(own[:-1] for own in step.stages.kept.state[:2]), strict=True)
        at_stages = [[self.model.contacts[k].touch(*at) for k in held] for at in inner]
        before, after = ([own[k] for k in held] for own in (self.touches, self._touches_at(end)))
        path = self._path(held, [before, *at_stages, after])
        still = calm(path, self._lengths[held], pressed, step.h)
        press = step.stages.kept.pushes[:, held, 0]
        lifts = pressed & (self._sides.rigid[held] | self._let_go[held])
        still &= ~lifts | (press.min(axis=0) >= LEAST_PRESS * press.max(axis=0))
        return [k for k, calmly in zip(held, still.tolist(), strict=True) if not calmly]

    def _path(self, which: Sequence[int], nodes: Sequence[Sequence[Touch]]) -> Seen:
        """Contacts at nodes, seen from the side where they are.

        A rigid one that presses is as if behind a face that never opens; round ones have no ends.
        """
        found = [[(own.gap, own.place, own.gap_rate, own.slip) for own in node] for node in nodes]
        gap, place, gap_rate, slip = np.array(found).transpose(2, 0, 1)
        endless = self._endless[list(which)]  # they may be anywhere
        place, slip = np.where(endless, 1.0, place), np.where(endless, 0.0, slip)
        way = np.array([self._way(k) for k in which])
        path = Seen(way * gap, place, way * gap_rate, slip)
        return path.closed((self._sides.pressed & self._sides.rigid)[list(which)])

    def let_go(self, k: int) -> bool:
        """Tell whether a contact let go before its gap had opened, and has not been apart since."""
        closed = self.touches[k].gap < -GAP_ROUNDING and self._sides.sides[k] is Side.APART
        return bool(self._let_go[k]) and closed

    def _change(self, k: int, step: Step) -> float | None:
        """When within the step a contact's state changes that presses, or has let go."""
        return first_fall(partial(self._left, k, step), None, (step.t, step.end))

    def _left(self, k: int, step: Step, t: float) -> float:
        """Value (m) that is positive until contact k's state changes; of a reaction, N."""
        contact = self.model.contacts[k]
        if self.presses(k) and isinstance(contact, RigidContact):
            q, v = step.at(np.array([t]))
            at = self.model.evaluate(t, q[0], v[0]).kept
            return min(float(at.pushes[k, 0]), contact.touch(at.state.x, at.state.v).inside)
        touch = self._touch(k, step, t)
        if self.presses(k):
            return min(contact.pressed_by(touch), touch.inside)
        return -contact.pressed_by(touch)  # what has let go has no force until it is apart

    def _touch(self, k: int, step: Step, t: float) -> Touch:
        at = self._at(step, t)
        return self.model.contacts[k].touch(at.x, at.v)

    def _way(self, k: int) -> float:
        """Behind a face the gap is that to its back."""
        return -1.0 if self._sides.sides[k] is Side.BEHIND else 1.0


def _left_of_slot(
    point: TrackPoint, k: int, _: FloatArray, places: FloatArray
) -> tuple[float, float]:
    return point.left(float(places[k]))

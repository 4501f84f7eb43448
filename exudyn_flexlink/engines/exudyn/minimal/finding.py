"""What happens first within a step: a contact begins, turns or ends, a piece of a slot ends."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from exudyn_flexlink.engines.exudyn.faces import Touch
from exudyn_flexlink.engines.exudyn.minimal.collocation import C
from exudyn_flexlink.engines.exudyn.minimal.contacts import MinimalContact, Side
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.engines.exudyn.minimal.radau import Step
from exudyn_flexlink.engines.exudyn.minimal.wall_events import WallWatch

FloatArray = NDArray[np.float64]
Goal = Callable[[FloatArray], float]
"""Angle still to turn at all coordinates of the tree."""

EVENT_TIME = 1e-13  # s: to which events are found, where the clock tells that apart
LOOKS = 8  # within a step in which a contact may have begun or ended
NOTHING = 1e-14  # m: a gap this small is closed
SEAM = 1e-12  # of a curve's parameter: this little beyond a piece is on it


@dataclass(frozen=True)
class Found:
    """What happened first within a step: when (s), and to which contact, wall or slot guide.

    At a `turn` a point that presses comes to rest and goes back, and its force leaps.
    """

    time: float
    contact: int = -1
    guide: int = -1
    way: int = 0
    goal: bool = False
    turn: bool = False
    wall: int = -1  # pair of link and guide


class Finder:
    """Looks at steps; `touches` are those of the contacts at the end of the last one accepted."""

    def __init__(
        self, model: MinimalModel, goal: Goal | None, x: FloatArray, v: FloatArray
    ) -> None:
        self.model, self.goal = model, goal
        self.touches = [contact.touch(x, v) for contact in model.contacts]
        self.walls = WallWatch(model, x, v) if model.walls.contacts else None

    def contacts(self) -> Iterator[tuple[MinimalContact, Touch]]:
        """Every contact with where it is."""
        return zip(self.model.contacts, self.touches, strict=True)

    def look(self, step: Step, x: FloatArray, v: FloatArray) -> None:
        """Take the coordinates (links,) and speeds at the end of a step."""
        if self.walls is not None:
            self.walls.accept(step.end, x, v)
        before, h = self.touches, step.h
        self.touches = [contact.touch(x, v) for contact in self.model.contacts]
        for touch, old in zip(self.touches, before, strict=True):
            touch.gap_bend = (touch.gap_rate - old.gap_rate) / h
        for contact, touch in self.contacts():
            if not contact.acts and contact.beside(touch):
                contact.side = Side.BEHIND if touch.gap < -NOTHING else Side.APART

    def first(self, step: Step) -> Found | None:
        """What happened first within the step."""
        found = [*self._ends_of_pieces(step), *self._changes_of_contacts(step)]
        if self.walls is not None:
            touched = self.walls.first(step)
            found += [] if touched is None else [Found(touched[0], wall=touched[1])]
        if self.goal is not None and self.goal(step.stages[-1].kept.x) < 0:
            found.append(Found(self._fall(lambda t: self._to_turn(step, t), step), goal=True))
        return min(found, key=lambda event: event.time, default=None)

    def _coordinates(self, step: Step, t: float) -> tuple[FloatArray, FloatArray]:
        q, v = step.at(np.array([t]))
        held = self.model.whole(t, q[0], v[0])
        return held.x, held.v

    def _to_turn(self, step: Step, t: float) -> float:
        assert self.goal is not None
        return float(self.goal(self._coordinates(step, t)[0]))

    def _fall(self, value: Callable[[float], float], step: Step) -> float:
        """Instant within the step at which a value falls to zero."""
        if value(step.t) <= 0:
            return step.t
        return float(brentq(value, step.t, step.end, xtol=EVENT_TIME, rtol=1e-15))

    def _ends_of_pieces(self, step: Step) -> list[Found]:
        found = []
        for k, guide in enumerate(self.model.coordinates.points):
            ahead, behind = guide.left(step.stages[-1].kept.places[k])
            if min(ahead, behind) < -SEAM:
                way = 1 if ahead < behind else -1
                time = self._fall(partial(self._on_piece, step, k, way), step)
                found.append(Found(time, guide=k, way=way))
        return found

    def _on_piece(self, step: Step, k: int, way: int, t: float) -> float:
        """How far a slot's point is from the end of its piece (way 1) or from its start (-1)."""
        q, v = step.at(np.array([t]))
        left = self.model.coordinates.points[k].left(self.model.whole(t, q[0], v[0]).places[k])
        return left[0] if way == 1 else left[1]

    def _changes_of_contacts(self, step: Step) -> list[Found]:
        found = []
        for k, contact in enumerate(self.model.contacts):
            time = self._change(contact, k, step)
            if time is not None:
                found.append(Found(time, contact=k))
            elif contact.acts:
                turn = self._turn(contact, step)
                if turn is not None:
                    found.append(Found(turn, contact=k, turn=True))
        return found

    def _turn(self, contact: MinimalContact, step: Step) -> float | None:
        """When within the step the force of a contact leaps, as its point turns; None if never."""

        def rate(t: float) -> float:
            return contact.touch(*self._coordinates(step, t)).gap_rate

        if not contact.turns(rate(step.t), rate(step.end)):
            return None
        return float(brentq(rate, step.t, step.end, xtol=EVENT_TIME))

    def _change(self, contact: MinimalContact, k: int, step: Step) -> float | None:
        """When within the step a contact's state changes; None if it does not."""
        if self._surely_unchanged(contact, k, step):
            return None
        t = step.t
        for end in np.linspace(step.t, step.end, LOOKS + 1)[1:].tolist():
            if self._guard(contact, step, end) < -NOTHING:
                if self._guard(contact, step, t) > NOTHING:
                    return float(
                        brentq(lambda at: self._guard(contact, step, at), t, end, xtol=EVENT_TIME)
                    )
                if not self._still_closes(contact, step, end):
                    return self._after_touching(contact, step, t, end)
            elif contact.side is not Side.PRESSED:
                grazed = self._grazed(contact, step, t, end)
                if grazed is not None:
                    return grazed
            t = end
        return None

    def _grazed(self, contact: MinimalContact, step: Step, t: float, end: float) -> float | None:
        """When the gap closes, if it closes and opens again between two looks; None if not."""
        way = 1.0 if contact.side is Side.APART else -1.0

        def rate(at: float) -> float:
            return way * contact.touch(*self._coordinates(step, at)).gap_rate

        if not rate(t) < 0 < rate(end):
            return None
        lowest = float(brentq(rate, t, end, xtol=EVENT_TIME))
        if self._guard(contact, step, lowest) >= -NOTHING:
            return None
        if self._guard(contact, step, t) <= 0:
            return t
        return float(brentq(lambda at: self._guard(contact, step, at), t, lowest, xtol=EVENT_TIME))

    def _surely_unchanged(self, contact: MinimalContact, k: int, step: Step) -> bool:
        """Tell from both ends, or from the stages, that nothing can have changed in between."""
        last = step.stages[-1].kept
        ends = (self.touches[k], contact.touch(last.x, last.v))
        apart = contact.side is not Side.PRESSED
        if apart and (_beside(contact, *ends, 2 * step.h) or _apart(*ends, 2 * step.h)):
            return True
        inner = [contact.touch(at.kept.x, at.kept.v) for at in step.stages[:-1]]
        touches, parts = [ends[0], *inner, ends[1]], step.h * np.diff([0.0, *C])
        unchanged = _apart if apart else partial(_pressed, contact)
        between = zip(touches[:-1], touches[1:], parts.tolist(), strict=True)
        return all(unchanged(before, after, h) for before, after, h in between)

    def _still_closes(self, contact: MinimalContact, step: Step, t: float) -> bool:
        """Tell that a contact which has begun a hair before it touches goes on to touch."""
        touch = contact.touch(*self._coordinates(step, t))
        return contact.acts and not contact.beside(touch) and touch.gap_rate < 0

    def _after_touching(self, contact: MinimalContact, step: Step, t: float, end: float) -> float:
        """A guard that starts at zero rises first, or the contact changes at once."""
        places = [t + (end - t) * 0.5**k for k in range(1, 40)]
        top = max(places, key=lambda at: self._guard(contact, step, at))
        if self._guard(contact, step, top) <= 0:
            return t
        return float(brentq(lambda at: self._guard(contact, step, at), top, end, xtol=EVENT_TIME))

    def _guard(self, contact: MinimalContact, step: Step, t: float) -> float:
        """Value (m) that is positive as long as the contact stays as it is."""
        touch = contact.touch(*self._coordinates(step, t))
        if contact.side is Side.APART:
            return touch.gap
        if contact.side is Side.BEHIND:
            return -touch.gap
        return min(-touch.gap, touch.place, contact.length - touch.place)


def _apart(before: Touch, after: Touch, h: float) -> bool:
    """Tell that a gap did not close, nor open, in a time h (s).

    Gap and place stay within a cubic's reach of both ends; twice its largest way is allowed.
    """
    way = 0.5 * h * max(abs(before.gap_rate), abs(after.gap_rate))
    return before.gap * after.gap > 0 and min(abs(before.gap), abs(after.gap)) > way


def _beside(contact: MinimalContact, before: Touch, after: Touch, h: float) -> bool:
    """Tell, likewise, that a point stayed beside a face, where it may pass the face's line."""
    slid = 0.5 * h * max(abs(before.place_rate), abs(after.place_rate))
    places = (before.place, after.place)
    return max(places) < -slid or min(places) > contact.length + slid


def _pressed(contact: MinimalContact, before: Touch, after: Touch, h: float) -> bool:
    """Tell, likewise, that a contact lasted on its face."""
    way = 0.5 * h * max(abs(before.gap_rate), abs(after.gap_rate))
    slid = 0.5 * h * max(abs(before.place_rate), abs(after.place_rate))
    places = (before.place, after.place)
    on_face = min(places) > slid and max(places) < contact.length - slid
    return on_face and max(before.gap, after.gap) < -way

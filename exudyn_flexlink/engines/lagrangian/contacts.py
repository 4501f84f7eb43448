"""A contact's state, apart, pressed or behind, and the event functions at whose zero it changes.

As in the Exudyn engine a contact remembers on which side the point came: one that passed beside the
face and is behind it is not in contact until it is back on the free side.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import inf

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.diagnostics.bouncing import Bounces
from exudyn_flexlink.engines.lagrangian.equations import LASTING, NOT_ACTING, PENALTY
from exudyn_flexlink.engines.lagrangian.event_functions import Side
from exudyn_flexlink.engines.lagrangian.impact_events import Impact
from exudyn_flexlink.intervals import Interval
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.mechanism import FaceContact
from exudyn_flexlink.result import Event


@dataclass
class Contact:
    """State of one contact; `touch` is a row of `faces.touches`."""

    face: FaceContact
    events: list[Event]  # of all contacts: what happened when
    side: Side = Side.APART
    peak: float = 0.0  # N: largest force of an impulse law while the contact lasts
    intervals: list[Interval] = field(default_factory=list)  # those that ended, and impacts
    _before: tuple[float, float] | None = None  # gap and its rate at the last look
    _open: Interval | None = None  # with impulse and loss when it began

    def __post_init__(self) -> None:
        self.length = self.face.length
        self.rigid = isinstance(self.face.law, Impulse)
        self.bounces = Bounces(self.face.name, self.face.law.restitution)

    @property
    def acting(self) -> int:
        """How the contact acts in the equations."""
        if self.side is not Side.PRESSED:
            return NOT_ACTING
        return LASTING if self.rigid else PENALTY

    def event_functions(self, touch: FloatArray, force: float) -> list[float]:
        """Values at whose fall below zero the state changes."""
        gap, place = float(touch[0]), float(touch[1])
        if self.side is Side.APART:
            return [gap, 1.0, 1.0]
        if self.side is Side.BEHIND:
            return [-gap, 1.0, 1.0]
        return [force if self.rigid else -gap, place, self.length - place]

    def quiet(self, touch: FloatArray, done: float) -> bool:
        """Tell whether the gap can't have passed zero within the last step, of length `done`.

        The cubic through gaps and rates at both ends strays from them by less than a sixth of the
        way that the larger speed covers; the margin is sixfold.
        """
        gap, rate = float(touch[0]), float(touch[2])
        before, self._before = self._before, (gap, rate)
        if self.side is Side.PRESSED or before is None or before[0] * gap <= 0:
            return False
        return min(abs(gap), abs(before[0])) > done * max(abs(rate), abs(before[1]))

    def over_face(self, touch: FloatArray) -> bool:
        """Tell whether the point is beside neither end of the face."""
        return bool(0 <= touch[1] <= self.length)

    def begin(self, t: float, touch: FloatArray, impulse: float, loss: float) -> None:
        """The point begins to press on the face."""
        self.side, self.peak = Side.PRESSED, 0.0
        place, speed = float(touch[1]), -float(touch[2])
        self._open = Interval(
            t, place=place, approach_speed=speed, impulse=impulse, energy_lost=loss
        )
        self._tell(t, "contact begins")

    def end(self, t: float, touch: FloatArray, side: Side, impulse: float, loss: float) -> None:
        """The point leaves the face: to the free side, or off one of its ends."""
        self.side = side
        last = self.lasting(float(touch[1]), impulse, loss)
        assert last is not None  # only what has begun ends
        off = side is not Side.APART
        ended = replace(last, end=t, separation_speed=float(touch[2]), slides_off=off)
        self.intervals.append(ended)
        self._open = None
        self._tell(t, "leaves the face" if off else "contact ends")

    def lasting(self, place: float, impulse: float, loss: float) -> Interval | None:
        """Return the contact that lasts, up to now; None if there is none.

        The point is at a `place` (m), totals of impulse and loss are those since time 0.
        """
        if self._open is None:
            return None
        return replace(
            self._open,
            end_place=place,
            impulse=impulse - self._open.impulse,
            energy_lost=loss - self._open.energy_lost,
            peak_force=self.peak,
        )

    def hit(self, t: float, place: float, impact: Impact, motor_work: float) -> None:
        """The point strikes the face and bounces."""
        self.intervals.append(
            Interval(
                t,
                t,
                place,
                place,
                impact.approach_speed,
                impact.separation_speed,
                impact.impulse,
                impact.energy_lost,
                peak_force=inf,
                motor_work=motor_work,
            )
        )
        self._tell(t, "impact")

    def _tell(self, t: float, kind: str) -> None:
        self._before = None
        self.events.append(Event(t, kind, self.face.name))

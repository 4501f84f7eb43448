"""The mechanism as a hybrid system: equations of motion between events, and what events change."""

from __future__ import annotations

from math import hypot, inf

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.addresses import equation_functions_for, kind_of
from exudyn_flexlink.engines.lagrangian.contacts import Contact
from exudyn_flexlink.engines.lagrangian.equations import LASTING
from exudyn_flexlink.engines.lagrangian.event_functions import SEEN, EventData, Side
from exudyn_flexlink.engines.lagrangian.faces import touches
from exudyn_flexlink.engines.lagrangian.impact_events import meet_face
from exudyn_flexlink.engines.lagrangian.mode import (
    Instant,
    Mode,
    coordinates_at,
    drive_numbers,
    mode_made,
    motor_numbers,
    state_rate,
)
from exudyn_flexlink.engines.lagrangian.model import Model, turning_row
from exudyn_flexlink.engines.lagrangian.sampling import Motions, motions_at
from exudyn_flexlink.engines.lagrangian.touching import Walls
from exudyn_flexlink.engines.lagrangian.track import TROUBLES, Track
from exudyn_flexlink.engines.lagrangian.track_point import FINE, TrackPoint, place_on
from exudyn_flexlink.intervals import Interval
from exudyn_flexlink.mechanism import GROUND, TOUCHING, TurnGoal, approach
from exudyn_flexlink.result import Event

EXPLICIT_TURN = 0.05  # rad per explicit step of the guide: Newton's method for P stays local


class System:
    """Equations, event functions and events of a model; the state is that of `mode.fill_rate`."""

    def __init__(self, model: Model, goal: TurnGoal | None) -> None:
        self.model = model
        self.goal = goal
        self.events: list[Event] = []
        self.stop_reason = ""
        self.stop_advice = ""
        self.reached = False
        self.together: list[tuple[float, tuple[str, str]]] = []  # s, contacts with one impact
        mechanism, state = model.mechanism, model.assembly.state
        self.kind = kind_of(mechanism)
        slot = mechanism.slots[0]
        self.track = Track(slot, float(state.places[0]), state.laps[0], self.events)
        self.contacts = [Contact(face, self.events) for face in model.layout.faces]
        for contact in self.contacts:
            if approach(contact.face, state.q, state.v).gap < -TOUCHING:
                contact.side = Side.BEHIND
        self.acting = np.zeros(len(self.contacts), dtype=np.int64)
        self.trouble = ""
        self.first = model.first
        self.free = model.layout.count - model.first
        self._turning = 0.0
        self._track_coordinate = model.layout.track_coordinate
        self.constants = model.machine_constants
        self.walls = [Walls(channel, self.constants, model.poses) for channel in mechanism.channels]
        self._touching = self.walls[0].touching if self.walls else np.zeros(0, dtype=np.int64)
        self._modes: dict[int, Mode] = {}  # by the piece of the track
        layout = model.layout
        motors = [
            (ramp, turning_row(layout, motor.first, motor.second)) for motor, ramp in layout.torques
        ]
        # A mode borrows its arrays.
        self._centre = np.array(layout.guide.at, dtype=float)
        self._drive = drive_numbers(layout.ramp, layout.way, float(model.start[0][0]), layout.play)
        self._motor_numbers = motor_numbers(motors, layout.count)

    @property
    def start(self) -> FloatArray:
        """State at time 0."""
        q, v = self.model.start
        rest = np.zeros(2 + 2 * len(self.contacts))
        return np.concatenate([q[self.first :], v[self.first :], rest])

    def begin(self) -> None:
        """Take in what touches at time 0."""
        for walls in self.walls:
            walls.settle(0.0, self.coordinates(0.0, self.start))

    @property
    def over(self) -> bool:
        """Whether the run ends: by the track, or the turns to make."""
        return bool(self.stop_reason) or self.reached

    def stop(self, reason: str, advice: str) -> None:
        """End the run after the step that is under way, for a reason."""
        self.stop_reason, self.stop_advice = reason, advice

    # --- equations ----------------------------------------------------------------------------

    def mode(self) -> Mode:
        """The present equations, for machine code."""
        piece = self.track.piece
        if piece not in self._modes:
            self._modes[piece] = mode_made(
                self.constants,
                self.track.numbers,
                self._centre,
                self._drive,
                self._motor_numbers,
                self.acting,
                self._touching,
                *equation_functions_for(self.kind),
            )
        return self._modes[piece]

    def event_data(self) -> EventData:
        """What the event functions need now, for machine code."""
        coordinates = [-1.0, -1.0, 0.0, 0.0]
        if self.goal is not None:
            for i, part in enumerate((self.goal.first, self.goal.second)):
                if part != GROUND:
                    coordinates[i] = float(self.model.layout.coordinate(part))
            coordinates[2:] = self.goal.start, self.goal.turned
        return EventData(
            np.array([contact.side for contact in self.contacts], dtype=np.int64),
            np.zeros(len(self.contacts), dtype=np.int64),
            np.array([contact.length for contact in self.contacts], dtype=float),
            np.array(coordinates),
            np.full((2, SEEN + 4 * len(self.contacts)), np.nan),
        )

    def rate(self, t: float, y: FloatArray) -> FloatArray:
        """dy/dt."""
        rate, ended = state_rate(Instant(t, y, self.track.home), self.mode())
        if ended == FINE:
            return rate
        # A trial step too far; where no step is short enough, this is what is wrong.
        self.trouble = TROUBLES[ended]
        return np.full_like(y, np.nan)

    def coordinates(self, t: float, y: FloatArray) -> tuple[FloatArray, FloatArray, TrackPoint]:
        """All coordinates and speeds, and P.

        Raises:
            DeadCentreError: the guide's angle does not tell where P is.

        """
        q, v, point, u, ended = coordinates_at(Instant(t, y, self.track.home), self.mode())
        self.track.found(u, ended)
        return q, v, point

    def motion(self, t: float, y: FloatArray) -> Motions:
        """Everything about one instant, P's place by the parameter of the whole curve."""
        self.coordinates(t, y)  # finds P, also where it is far from its last place
        near = np.array([self.track.u])
        found = motions_at(np.array([t]), np.array([y]), near, self.mode(), True)
        return found._replace(place=found.place + self.track.shift)

    def totals(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Impulses of the contacts, and the works done on them: parts of the state."""
        at, count = 2 * self.free + 2, len(self.contacts)
        return y[at : at + count], y[at + count :]

    # --- event functions ----------------------------------------------------------------------

    def event_functions(self, t: float, y: FloatArray) -> list[float]:
        """Those of `point_event_functions`, and one of each pair of link and guide."""
        values = self.point_event_functions(t, y)
        for walls in self.walls:
            values += walls.event_functions(*self.coordinates(t, y))
        return values

    def way_event_functions(self, t: float, y: FloatArray) -> list[float]:
        """Track's two ends and turns to make."""
        return self._way_left(self.coordinates(t, y)[0])

    def point_event_functions(self, t: float, y: FloatArray) -> list[float]:
        """Those of `way_event_functions`, and three of each contact."""
        q, v, point = self.coordinates(t, y)
        values = self._way_left(q)
        if self.contacts:
            states, _, _ = touches(q, v, point, self.constants)
            lasting = any(contact.acting == LASTING for contact in self.contacts)
            forces = self.motion(t, y).forces[0] if lasting else self.acting
            for contact, touch, force in zip(self.contacts, states, forces, strict=True):
                values += contact.event_functions(touch, float(force))
                if contact.acting == LASTING:
                    contact.peak = max(contact.peak, float(force))
        return values

    def quiet(self, done: float, t: float, y: FloatArray) -> bool:
        """Tell whether nothing can have happened in the step that ended at t."""
        q, v, point = self.coordinates(t, y)
        self.track.settle()
        turned_back = self._turning * v[self._track_coordinate] < 0
        self._turning = float(v[self._track_coordinate])
        quiet = not turned_back and min(self._way_left(q)) >= 0
        if self.contacts:
            states, _, _ = touches(q, v, point, self.constants)
            looks = [c.quiet(s, done) for c, s in zip(self.contacts, states, strict=True)]
            quiet = all(looks) and quiet
        looks = [walls.quiet(done, q, v, point) for walls in self.walls]
        return all(looks) and quiet

    def longest_step(self, y: FloatArray) -> float:
        """Limit of the next step: the guide turns a little."""
        ramp = self.model.layout.ramp
        speed = abs(float(y[self.free]) if ramp is None else ramp.value)
        return EXPLICIT_TURN / speed if speed > 0 else inf

    def left(self, t: float, y: FloatArray) -> float | None:
        """Angle still to turn, rad; None where time ends the run."""
        if self.goal is None:
            return None
        return 0.0 if self.reached else self._turns_left(self.coordinates(t, y)[0])

    def _way_left(self, q: FloatArray) -> list[float]:
        return [*self.track.left(self.track.u), self._turns_left(q)]

    def _turns_left(self, q: FloatArray) -> float:
        """Angle that is still to turn; 1 without a goal."""
        if self.goal is None:
            return 1.0
        turned = turning_row(self.model.layout, self.goal.first, self.goal.second) @ q
        return float(self.goal.turned - abs(turned - self.goal.start))

    # --- events -------------------------------------------------------------------------------

    def cross(self, t: float, y: FloatArray, which: int) -> FloatArray:
        """Work off the event of one event function."""
        for walls in self.walls:
            walls.forget()
        if which < 2:
            y = self._end_of_piece(t, y, 1 if which == 0 else -1)
        elif which == 2:
            self.reached = True
        elif which < 3 + 3 * len(self.contacts):
            y = self._contact_event(t, y, *divmod(which - 3, 3))
        else:
            self.touch(t, y, which - 3 - 3 * len(self.contacts))
        self.acting[:] = [contact.acting for contact in self.contacts]
        return y

    def touch(self, t: float, y: FloatArray, k: int) -> None:
        """Pair k of link and guide begins or ceases to touch, and whichever do with it."""
        at = self.coordinates(t, y)
        for walls in self.walls:
            walls.change(t, k, at)
            walls.settle(t, at)

    def _end_of_piece(self, t: float, y: FloatArray, way: int) -> FloatArray:
        old = self.coordinates(t, y)[2]
        if not self.track.next_piece(way, t):
            reason = f"the point of slot '{self.track.slot.name}' reached the curve's end"
            self.stop(reason, "lengthen the curve, or end the run before")
            return y
        return self._on_new_piece(y, old) if self._track_coordinate else y

    def _on_new_piece(self, y: FloatArray, old: TrackPoint) -> FloatArray:
        """P's place and speed by the parameter of the next piece, which goes on the same way."""
        y, free = y.copy(), self.free
        y[free - 1] = self.track.u
        new = place_on(self.track.numbers, self.track.u)
        y[2 * free - 1] *= hypot(old[2], old[3]) / hypot(new[2], new[3])
        return y

    def _contact_event(self, t: float, y: FloatArray, k: int, which: int) -> FloatArray:
        contact = self.contacts[k]
        q, v, point = self.coordinates(t, y)
        touch = touches(q, v, point, self.constants)[0][k]
        if contact.side is Side.PRESSED:
            self.end_contact(t, y, k, touch, Side.APART if which == 0 else Side.BEHIND)
        elif contact.side is Side.BEHIND:
            contact.side = Side.APART
        elif not contact.over_face(touch):
            contact.side = Side.BEHIND
        elif contact.rigid:
            return meet_face(self, t, y, k)
        else:
            contact.begin(t, touch, *self.contact_totals(y, k))
        return y

    def settle_contacts(self, t: float, y: FloatArray) -> None:
        """Tell contacts, none of which is pressed, on which side of their faces' lines they are.

        A point beside its face may have crossed the line: that is no event.
        """
        if not self.contacts:
            return
        q, v, point = self.coordinates(t, y)
        for contact, touch in zip(
            self.contacts, touches(q, v, point, self.constants)[0], strict=True
        ):
            contact.side = Side.APART if touch[0] > 0.0 else Side.BEHIND

    def contact_totals(self, y: FloatArray, k: int) -> tuple[float, float]:
        """Impulse and energy that the contact has taken so far.

        As it begins and as it ends the contact stores nothing: what it stored when the point slid
        off the end of the face is lost.
        """
        impulses, works = self.totals(y)
        return float(impulses[k]), float(works[k])

    def intervals(self, t: float, y: FloatArray, k: int) -> list[Interval]:
        """Every interval of one contact, up to the state y at t (s) in which the run ends."""
        contact = self.contacts[k]
        q, v, point = self.coordinates(t, y)
        place = float(touches(q, v, point, self.constants)[0][k, 1])
        lasting = contact.lasting(place, *self.contact_totals(y, k))
        return [*contact.intervals, *([] if lasting is None else [lasting])]

    def end_contact(self, t: float, y: FloatArray, k: int, touch: FloatArray, side: Side) -> None:
        """Contact k ends at t (s), on a side, as it was last seen in `touches`."""
        self.contacts[k].end(t, touch, side, *self.contact_totals(y, k))

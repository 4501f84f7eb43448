"""The mechanism as a hybrid system: equations of motion between events, and what events change."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, inf

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.lagrangian.constants import Root
from exudyn_flexlink.engines.lagrangian.contacts import Contact, Side
from exudyn_flexlink.engines.lagrangian.course import Course, drive_numbers, motor_numbers
from exudyn_flexlink.engines.lagrangian.equations import (
    PENALTY,
    Drive,
    State,
    accelerations,
    chain_of,
    mass_matrix,
    state_rate,
)
from exudyn_flexlink.engines.lagrangian.faces import touches
from exudyn_flexlink.engines.lagrangian.impact import REST_SPEED, Impact, is_over, strike
from exudyn_flexlink.engines.lagrangian.rig import Rig, turning_row
from exudyn_flexlink.engines.lagrangian.touching import Walls
from exudyn_flexlink.engines.lagrangian.track import Track
from exudyn_flexlink.engines.lagrangian.watch import APART, BEHIND, PRESSED, Watched
from exudyn_flexlink.intervals import Interval
from exudyn_flexlink.laws import RestitutionPenalty
from exudyn_flexlink.mechanism import GROUND, TurnGoal, approach
from exudyn_flexlink.result import Event

FloatArray = NDArray[np.float64]

LARGEST_TURN = 0.05  # rad per step of the guide: Newton's method for P stays local
ROUNDING_OF_TURNS = 1e-9  # rad
LOSE_SPEED = "a smaller restitution, which ends the bounces, or a law with stiffness"
ROUNDS = 50  # of impacts that follow from one


@dataclass(frozen=True)
class Motion:
    """Coordinates, speeds, accelerations (N,), P, torque of the speed drive, contact forces."""

    q: FloatArray
    v: FloatArray
    a: FloatArray
    root: Root
    place: float
    motor: float
    forces: FloatArray


class System:
    """Equations, guards and events of one rig. The state is that of `equations.state_rate`."""

    def __init__(self, rig: Rig, goal: TurnGoal | None) -> None:
        self.rig = rig
        self.goal = goal
        self.events: list[Event] = []
        self.stop_reason = ""
        self.stop_advice = ""
        self.reached = False
        mechanism, state = rig.mechanism, rig.assembly.state
        self.track = Track(mechanism.slots[0].curve, float(state.places[0]), rig.layout.guide.at)
        self.contacts = [Contact(face, self.events) for face in mechanism.contacts]
        for contact in self.contacts:
            if approach(contact.face, state.q, state.v).gap < 0:
                contact.side = Side.BEHIND
        self._acting = np.zeros(len(self.contacts), dtype=np.int64)
        count = len(rig.constants.inertias)
        self._motors = [
            (motor.ramp, turning_row(rig.layout, motor.first, motor.second))
            for motor in mechanism.torque_motors
        ]
        self._still = np.zeros(count)
        self.trouble = ""
        self._first, self._data = rig.first, rig.data
        self._free = count - rig.first
        self._theta, self._way = float(rig.start[0][0]), 1.0
        motor = rig.layout.motor
        if motor is not None and motor.second == GROUND:
            self._way = -1.0
        self._ramp = None if motor is None else motor.ramp
        self._turning = 0.0
        self._root = rig.layout.root
        self._chain = chain_of(rig.constants)
        self.walls = [Walls(channel, self._chain, rig.poses) for channel in mechanism.channels]
        self._touching = self.walls[0].touching if self.walls else np.zeros(0, dtype=np.int64)

    @property
    def start(self) -> FloatArray:
        """State at time 0."""
        q, v = self.rig.start
        rest = np.zeros(2 + 2 * len(self.contacts))
        return np.concatenate([q[self._first :], v[self._first :], rest])

    def begin(self) -> None:
        """Take in what touches at time 0."""
        for walls in self.walls:
            walls.start(*self.coordinates(0.0, self.start))

    @property
    def over(self) -> bool:
        """Whether the run ends: by the track, or the turns to make."""
        return bool(self.stop_reason) or self.reached

    def stop(self, reason: str, advice: str) -> None:
        """End the run after the step that is under way, for a reason."""
        self.stop_reason, self.stop_advice = reason, advice

    # --- equations ----------------------------------------------------------------------------

    def _guide(self, t: float, y: FloatArray) -> tuple[float, float, float]:
        """Angle, speed and prescribed acceleration of the guide."""
        if self._ramp is None:
            return float(y[0]), float(y[self._free]), 0.0
        ramp, way = self._ramp, self._way
        return self._theta + way * ramp.integral(t), way * ramp.at(t), way * ramp.rate(t)

    def _torques(self, t: float) -> FloatArray:
        torques = self._still
        for ramp, row in self._motors:
            torques = torques + ramp.at(t) * row
        return torques

    def course(self) -> Course:
        """The present equations, for machine code."""
        layout = self.rig.layout
        return Course(
            self._data,
            self.track.numbers,
            np.array(layout.guide.at, dtype=float),
            drive_numbers(self._ramp, self._way, self._theta, layout.play),
            motor_numbers(self._motors, self._first + self._free),
            self._acting,
            self._touching,
        )

    def watched(self) -> Watched:
        """The present guards, for machine code."""
        coordinates = [-1.0, -1.0, 0.0, 0.0]
        if self.goal is not None:
            for i, part in enumerate((self.goal.first, self.goal.second)):
                if part != GROUND:
                    coordinates[i] = float(self.rig.layout.coordinate(part))
            coordinates[2:] = self.goal.start, self.goal.turned
        sides = {Side.APART: APART, Side.PRESSED: PRESSED, Side.BEHIND: BEHIND}
        return Watched(
            np.array([sides[contact.side] for contact in self.contacts], dtype=np.int64),
            np.array([contact.length for contact in self.contacts], dtype=float),
            np.array(coordinates),
            np.zeros(len(self.contacts)),
        )

    def rate(self, t: float, y: FloatArray) -> FloatArray:
        """dy/dt."""
        guide = self._guide(t, y)
        torques = self._torques(t) if self._motors else self._still
        try:
            root = self._root_at(guide[0], y)
            holding = (self._acting, self._touching)
            return state_rate(y, guide, root, torques, holding, self._data)
        except (ValueError, ArithmeticError) as error:
            # A trial step too far; where no step is short enough, this is what is wrong.
            self.trouble = str(error)
            return np.full_like(y, np.nan)

    def coordinates(self, t: float, y: FloatArray) -> tuple[FloatArray, FloatArray, Root]:
        """All coordinates and speeds, and P."""
        theta, omega, _ = self._guide(t, y)
        first, free = self._first, self._free
        q, v = np.empty(first + free), np.empty(first + free)
        q[0], v[0] = theta, omega
        q[first:], v[first:] = y[:free], y[free : 2 * free]
        return q, v, self._root_at(theta, y)

    def _root_at(self, theta: float, y: FloatArray) -> Root:
        """P: where the guide's angle puts it, or by its own coordinate, the last free one."""
        return self.track.at(float(y[self._free - 1])) if self._root else self.track.root(theta)

    def motion(self, t: float, y: FloatArray) -> Motion:
        """Everything about one instant."""
        q, v, root = self.coordinates(t, y)
        drive = Drive(self._first, self._guide(t, y)[2], self._torques(t))
        holding = (self._acting, self._touching)
        a, motor, forces, _, _ = accelerations(
            State(q, v, root), drive, holding, self.rig.constants
        )
        forces = np.where(self._acting == PENALTY, np.maximum(forces, 0.0), forces)
        return Motion(q, v, a, root, self.track.place, motor, forces)

    def totals(self, y: FloatArray) -> tuple[float, float, FloatArray, FloatArray]:
        """Energies dissipated in dampers and supplied, impulse of and work on each contact."""
        at, count = 2 * self._free, len(self.contacts)
        return float(y[at]), float(y[at + 1]), y[at + 2 : at + 2 + count], y[at + 2 + count :]

    # --- guards -------------------------------------------------------------------------------

    def guards(self, t: float, y: FloatArray) -> list[float]:
        """Those of `point_guards`, and one of each pair of link and guide."""
        values = self.point_guards(t, y)
        for walls in self.walls:
            values += walls.guards(*self.coordinates(t, y))
        return values

    def point_guards(self, t: float, y: FloatArray) -> list[float]:
        """Track's two ends, turns to make, three of each contact."""
        q, v, root = self.coordinates(t, y)
        values = [*self.track.left, self._turns_left(q)]
        if self.contacts:
            states, _, _ = touches(q, v, root, self.rig.constants)
            lasting = any(c.rigid and c.side is Side.PRESSED for c in self.contacts)
            forces = self.motion(t, y).forces if lasting else self._acting
            for contact, touch, force in zip(self.contacts, states, forces, strict=True):
                values += contact.guards(touch, float(force))
                if contact.side is Side.PRESSED:
                    contact.peak = max(contact.peak, self._press(contact, touch, float(force)))
        return values

    def _press(self, contact: Contact, touch: FloatArray, force: float) -> float:
        law = contact.face.law
        if isinstance(law, RestitutionPenalty):
            return float(law.force(-touch[0], -touch[2]))
        return force

    def quiet(self, done: float, t: float, y: FloatArray) -> bool:
        """Tell whether nothing can have happened in the step that ended at t."""
        q, v, root = self.coordinates(t, y)
        self.track.settle()
        turned_back = self._turning * v[self._root] < 0
        self._turning = float(v[self._root])
        quiet = not turned_back and min(self.track.left) >= 0 and self._turns_left(q) >= 0
        if self.contacts:
            states, _, _ = touches(q, v, root, self.rig.constants)
            looks = [c.quiet(s, done) for c, s in zip(self.contacts, states, strict=True)]
            quiet = all(looks) and quiet
        looks = [walls.quiet(done, q, v, root) for walls in self.walls]
        return all(looks) and quiet

    def longest_step(self, t: float, y: FloatArray) -> float:
        """Limit of the next step: the guide turns a little."""
        speed = abs(self._guide(t, y)[1])
        if self._ramp is not None:
            speed = abs(self._ramp.value)
        return LARGEST_TURN / speed if speed > 0 else inf

    def _turns_left(self, q: FloatArray) -> float:
        """Angle that is still to turn; 1 without a goal."""
        if self.goal is None:
            return 1.0
        parts = [0.0] * (3 * len(self.rig.mechanism.parts))
        for part in (self.goal.first, self.goal.second):
            if part != GROUND:
                parts[3 * part + 2] = float(q[self.rig.layout.coordinate(part)])
        return self.goal.left(parts)

    # --- events -------------------------------------------------------------------------------

    def cross(self, t: float, y: FloatArray, which: int) -> FloatArray:
        """Work off the event of one guard."""
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
        self._acting[:] = [contact.acting for contact in self.contacts]
        return y

    def touch(self, t: float, y: FloatArray, k: int) -> None:
        """Pair k of link and guide begins or ceases to touch, and whichever do with it."""
        q, v, root = self.coordinates(t, y)
        for walls in self.walls:
            walls.change(t, k, q, v, root)

    def _end_of_piece(self, t: float, y: FloatArray, way: int) -> FloatArray:
        slot = self.rig.mechanism.slots[0].name
        old = self.coordinates(t, y)[2]
        lap = self.track.next_piece(way)
        if lap is None:
            reason = f"the point of slot '{slot}' reached the curve's end"
            self.stop(reason, "lengthen the curve, or end the run before")
            return y
        if lap:
            self.events.append(Event(t, "lap", slot, {"lap": float(lap)}))
        return self._on_new_piece(y, old) if self._root else y

    def _on_new_piece(self, y: FloatArray, old: Root) -> FloatArray:
        """P's place and speed by the parameter of the next piece, which goes on the same way."""
        y, free = y.copy(), self._free
        y[free - 1] = self.track.u
        new = self.track.at(self.track.u)
        y[2 * free - 1] *= hypot(old[2], old[3]) / hypot(new[2], new[3])
        return y

    def _contact_event(self, t: float, y: FloatArray, k: int, guard: int) -> FloatArray:
        contact = self.contacts[k]
        q, v, root = self.coordinates(t, y)
        touch = touches(q, v, root, self.rig.constants)[0][k]
        if contact.side is Side.PRESSED:
            self._end_contact(t, y, k, touch, Side.APART if guard == 0 else Side.BEHIND)
        elif contact.side is Side.BEHIND:
            contact.side = Side.APART
        elif not contact.over_face(touch):
            contact.side = Side.BEHIND
        elif contact.rigid:
            return self._impact(t, y, k)
        else:
            contact.begin(t, touch, *self._contact_totals(y, k))
        return y

    def _contact_totals(self, y: FloatArray, k: int) -> tuple[float, float]:
        """Impulse and energy that the contact has taken so far.

        As it begins and as it ends the contact stores nothing: what it stored when the point slid
        off the end of the face is lost.
        """
        _, _, impulses, works = self.totals(y)
        return float(impulses[k]), float(works[k])

    def intervals(self, t: float, y: FloatArray, k: int) -> list[Interval]:
        """Every interval of one contact, up to the state y at t (s) in which the run ends."""
        contact = self.contacts[k]
        q, v, root = self.coordinates(t, y)
        place = float(touches(q, v, root, self.rig.constants)[0][k, 1])
        lasting = contact.lasting(place, *self._contact_totals(y, k))
        return [*contact.intervals, *([] if lasting is None else [lasting])]

    def _end_contact(self, t: float, y: FloatArray, k: int, touch: FloatArray, side: Side) -> None:
        self.contacts[k].end(t, touch, side, *self._contact_totals(y, k))

    # --- impacts ------------------------------------------------------------------------------

    def _impact(self, t: float, y: FloatArray, k: int) -> FloatArray:
        """The point of a rigid contact meets its face: it bounces, or begins to press."""
        contact, e = self.contacts[k], self.contacts[k].face.law.restitution
        q, v, root = self.coordinates(t, y)
        touch = touches(q, v, root, self.rig.constants)[0][k].copy()
        totals = self._contact_totals(y, k)
        over = is_over(-float(touch[2]), e, self._gap_acceleration(t, y, k))
        e = 0.0 if over else e
        y, hit, work = self._jump(t, y, k, e)
        if not over:
            contact.hit(t, float(touch[1]), hit, work)
            endless = contact.endless(t, hit.approach_speed, REST_SPEED)
            if endless:
                self.stop(endless, LOSE_SPEED)
            totals = self._contact_totals(y, k)
            touch[2] = hit.separation_speed
        y = self._settle(t, y, k)
        if e == 0 and self._gap_acceleration(t, y, k) < 0:
            contact.begin(t, touch, *totals)
        return y

    def _gap_acceleration(self, t: float, y: FloatArray, k: int) -> float:
        """G'' of a contact as long as it does not act."""
        now = self.motion(t, y)
        states, gradients, _ = touches(now.q, now.v, now.root, self.rig.constants)
        return float(gradients[k] @ now.a + states[k, 4])

    def _jump(self, t: float, y: FloatArray, k: int, e: float) -> tuple[FloatArray, Impact, float]:
        """State after the impulse of contact k, and the work that the speed drive did in it."""
        q, v, root = self.coordinates(t, y)
        states, gradients, _ = touches(q, v, root, self.rig.constants)
        mass, first, free = mass_matrix(q, root, self.rig.constants), self._first, self._free
        hit = strike(mass[first:, first:], gradients[k, first:], float(states[k, 2]), e)
        y = y.copy()
        y[free : 2 * free] += hit.jump
        work = 0.0
        if first:
            # The drive keeps the guide's speed: its impulse closes the guide's own row of eq. 2.
            own = float(mass[0, 1:] @ hit.jump - gradients[k, 0] * hit.impulse)
            work = own * float(v[0])
        _, _, impulses, works = self.totals(y)
        y[2 * free + 1] += work
        impulses[k] += hit.impulse
        works[k] += hit.energy_lost
        return y, hit, work

    def _settle(self, t: float, y: FloatArray, struck: int) -> FloatArray:
        """Let an impact pass through lasting contacts: they press on, without bounce, or end."""
        for _ in range(ROUNDS):
            q, v, root = self.coordinates(t, y)
            states, _, _ = touches(q, v, root, self.rig.constants)
            rates = {
                k: float(states[k, 2])
                for k, contact in enumerate(self.contacts)
                if k == struck or (contact.rigid and contact.side is Side.PRESSED)
            }
            k = min(rates, key=lambda i: rates[i])
            if rates[k] > -1e-12:
                break
            y, _, _ = self._jump(t, y, k, 0.0)
        for k, rate in rates.items():
            if k != struck and rate > 1e-6:
                self._end_contact(t, y, k, states[k], Side.APART)
                self._acting[k] = 0
        return y

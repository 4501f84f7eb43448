"""Guide, link and levers as a problem of the integration: steps, events, impacts, and the recorder.

Impacts follow the paper's eq. 2 to 4: ``-e v_a = v_s`` along the normal. The coordinates stay, and
the speeds jump by the generalised impulse ``P_k = G_k p``:

    M (v_s - v_a) = G p                         (eq. 2, M the mass matrix of the free coordinates)
    g'_a = G v_a + ..,  g'_s = -e g'_a          (eq. 3 and 4, g' the rate of the gap)
    p = -(1 + e) g'_a / (G M^-1 G^T)
    energy lost = (1 - e^2)/2 g'_a^2 / (G M^-1 G^T)

At the samples, forces of drives, joints and slot follow from the motion by Newton's law. Here m a
is the rate of the whole link's momentum, F n are the contact forces on the link, g is the
acceleration of gravity, e is the direction of the guide, and N is the force of the track along its
normal:

    along the guide:   m a.e = N (normal.e) + sum F n.e + m g.e    (the sleeve has no friction)
    across it:         S = m a - N normal - sum F n - m g          (force of the sleeve on the link)
    guide's pivot:     R = m_g a_g - m_g g + S
    a lever's pivot:   R = m_l a_l - m_l g + sum F n
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import inf, sqrt
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import BoolArray, ComplexArray, FloatArray
from exudyn_flexlink.engines.diagnostics import (
    BROKEN_WALL_ADVICE,
    LOSE_SPEED,
    REST_SPEED,
    Bounces,
    broken_wall,
    is_over,
)
from exudyn_flexlink.engines.finer import seeded
from exudyn_flexlink.engines.interrupts import TOO_DEEP_ADVICE, DepthBounds
from exudyn_flexlink.engines.lagrangian.contacts import PinOnTrack
from exudyn_flexlink.engines.lagrangian.model import (
    Frame,
    Model,
    Pivot,
    momentum_rate,
    moved_by,
    turning_row,
)
from exudyn_flexlink.engines.lagrangian.system import Motion, System, joined
from exudyn_flexlink.engines.pair_events import TurnsGuard, calm, changed, first_of, late_by
from exudyn_flexlink.engines.recording import (
    AT_ONCE,
    BlockRecorder,
    Kept,
    Steps,
    Totals,
    push_of,
)
from exudyn_flexlink.engines.touching import FIRST, SHORTEST_SWING, Change, ExtremeSeeker, Moment
from exudyn_flexlink.integrate.events import Crossing, Guard, fall, first_fall
from exudyn_flexlink.integrate.explicit import DenseStep
from exudyn_flexlink.integrate.problem import Evaluation, State
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.integrate.stepper import HybridProblem, slow_motions
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.mechanism import (
    Seen,
    TurnGoal,
    deepest_allowed,
    half_periods,
    pressed_among,
)
from exudyn_flexlink.result import Interval

Path = Step | DenseStep


class LinkKept(NamedTuple):
    """Quantities of the mechanism that are kept at instants (m,)."""

    poses: FloatArray  # (m, parts, 3)
    rates: FloatArray
    accelerations: FloatArray  # (m, N)
    momentum_rate: ComplexArray  # (m,) of the link, N
    motor: FloatArray  # (m,): torque of the speed drive, N m


class _Waiting(NamedTuple):
    t: float
    h: float
    motion: Motion  # at the nodes, then at samples


class Recorder(BlockRecorder):
    """Records the steps of a system."""

    def __init__(self, system: System, grid: FloatArray, seeker: ExtremeSeeker) -> None:
        super().__init__(system.model.mechanism, grid, seeker, system.touches)
        self.system = system
        self._waiting: list[_Waiting] = []

    def due(self, step: Path) -> FloatArray:
        """Times (n,), s, of the samples within a step."""
        return self._due(step.t + step.h)

    def begin(self, motion: Motion) -> None:
        """Record the state (1,) at time 0."""
        self._start(self._known(motion))

    def keep(self, motion: Motion) -> None:
        """Keep a state (1,) as it is after an event."""
        self.record_waiting()
        self._keep_now(self._known(motion))

    def take(self, step: Path, motion: Motion) -> None:
        """Record a step; `motion` is that at its nodes, then at the samples `due` in it."""
        self._pass(step.t + step.h)
        self._waiting.append(_Waiting(step.t, step.h, motion))
        if len(self._waiting) >= AT_ONCE:
            self.record_waiting()

    def record_waiting(self) -> None:
        """Record the steps that wait: the same contacts press in all of them."""
        if not self._waiting:
            return
        t, h, motions = (list(column) for column in zip(*self._waiting, strict=True))
        self._waiting.clear()
        counts = np.array([len(motion.t) for motion in motions])
        rows = np.arange(len(self.seeker.nodes))  # of nodes, which come first in a step
        nodes = (np.cumsum(counts) - counts)[:, None] + rows
        samples = np.delete(np.arange(counts.sum()), nodes.ravel())
        of = np.repeat(np.arange(len(counts)), counts - len(rows))
        whole = joined(motions)
        known = self._known(whole)
        steps = self._with_middles(Steps(np.array(t), np.array(h), nodes, samples, of), known)
        self._book(steps, known, self._rates(whole, known), known.pick(nodes[:, -1]))

    def _known(self, motion: Motion) -> Kept:
        """Kept quantities at instants, with totals still 0."""
        model, count = self.system.model, len(motion.t)
        a, held = self.system.accelerations(motion)
        press = np.zeros((count, len(self.contacts)))
        if motion.pushed is not None:
            press[:, motion.pushed.which] = motion.pushed.press
        press[:, self.system.held] = held
        motor = self.system.motor_torque(motion, a, held)
        pressed = np.broadcast_to(self.touches.pressed, press.shape)
        places = (motion.place + self.system.track.shift)[:, None]
        if model.layout.slides:
            places = places[:, :0]
        kept = LinkKept(
            *model.poses(motion.frame), a, momentum_rate(model.numbers, motion.frame, a), motor
        )
        return Kept(motion.t, places, press, pressed, np.zeros((count, 2)), kept)

    def _rates(self, motion: Motion, known: Kept) -> Totals:
        """Rates (m, ...) of the totals at instants."""
        rates, v = self._totals(len(motion.t)), motion.frame.v
        rates.damped[:] = ((v @ self.system.model.numbers.damping) * v).sum(axis=1)
        rates.supplied[:] = known.of_engine.motor * v[:, 0] + (motion.motors * v).sum(axis=1)
        rates.impulses[:] = known.press
        if motion.pushed is not None:
            rates.losses[:, motion.pushed.which] = motion.pushed.power
        return rates

    def motion(self, rows: Kept) -> tuple[FloatArray, FloatArray]:
        """Poses and rates (m, parts, 3) at kept instants."""
        return rows.of_engine.poses, rows.of_engine.rates


@dataclass(frozen=True)
class Forces:
    """Reactions (samples, 2), N, in global axes, at `kept` instants."""

    model: Model
    kept: Kept

    @property
    def _link(self) -> LinkKept:
        kept: LinkKept = self.kept.of_engine
        return kept

    def drive_torques(self) -> dict[str, FloatArray]:
        """Torque of each drive on its joint's second part, N m."""
        torques, layout = {}, self.model.layout
        if layout.motor is not None:
            torques[layout.motor.name] = layout.way * self._link.motor
        for torque, ramp in layout.torques:
            torques[torque.name] = ramp.values(self.kept.t)
        return torques

    @cached_property
    def _pushes(self) -> FloatArray:
        """Forces (contacts, samples, 2) on the link."""
        contacts, rods = self.model.contacts, self.model.layout.rods
        pushes = np.zeros((len(contacts), len(self.kept.t), 2))
        for k, contact in enumerate(contacts):
            rows = self.kept.press[:, k] != 0
            if not rows.any():
                continue
            pose_rate = self._link.poses[rows], self._link.rates[rows]
            push = push_of(contact, *pose_rate, self.kept.press[rows, k])
            pushes[k, rows] = push if contact.point.part in rods else -push
        return pushes

    @cached_property
    def _of_walls(self) -> FloatArray:
        return np.asarray(self._pushes[len(self.model.mechanism.touching) :].sum(axis=0))

    @cached_property
    def _on_link(self) -> FloatArray:
        """Contact forces and weight on the whole link."""
        numbers = self.model.numbers
        weight = np.array([numbers.gravity.real, numbers.gravity.imag])
        return np.asarray(numbers.masses.sum() * weight + self._pushes.sum(axis=0))

    @cached_property
    def slot(self) -> FloatArray:
        """Force of the track on P: the rest of Newton's law, or its part along the guide."""
        lacking = _plane(self._link.momentum_rate) - self._on_link
        if self.model.layout.slides:  # forces of walls are contact forces on the link
            return np.zeros_like(lacking)
        if self.model.layout.play:
            return np.asarray(lacking)
        normal = self.model.mechanism.slots[0].curve.normal(self.kept.places[:, 0])
        along = _plane(np.exp(1j * self._link.poses[:, self.model.layout.guide.part, 2]))
        left = np.sum(lacking * along, axis=1)
        return np.asarray((left / np.sum(normal * along, axis=1))[:, None] * normal)

    def joints(self) -> dict[str, FloatArray]:
        """Force of each pivot on its joint's second point."""
        layout = self.model.layout
        on_guide = _plane(self._link.momentum_rate) - self._on_link - self.slot + self._of_walls
        forces = {layout.guide.joint: self._pivot(layout.guide, on_guide)}
        for lever in layout.levers:
            pushes = np.zeros((len(self.kept.t), 2))
            for k, contact in enumerate(layout.faces):
                if contact.start.part == lever.part:
                    pushes += self._pushes[k]
            forces[lever.joint] = self._pivot(lever, pushes)
        return forces

    def _pivot(self, pivot: Pivot, given_on: FloatArray) -> FloatArray:
        """Force of a pivot whose part exerts the force `given_on` on other parts."""
        k, numbers = self.model.layout.coordinate(pivot.part), self.model.numbers
        a, mass = self._link.accelerations[:, k], self.model.mechanism.parts[pivot.part].mass
        angle, speed = (column[:, pivot.part, 2] for column in (self._link.poses, self._link.rates))
        swing = (1j * a - speed**2) * numbers.moments[k] * np.exp(1j * angle)
        force = _plane(swing - mass * numbers.gravity) + given_on
        return np.asarray(force if pivot.second else -force)


def _plane(vectors: ComplexArray) -> FloatArray:
    """Vectors x + i y (m,) as (m, 2)."""
    return np.stack([vectors.real, vectors.imag], axis=-1)


ROUNDS = 50  # impacts of other contacts that one impact may cause


class Impact(NamedTuple):
    """Jump of the free speeds, impulse (N s), speeds along the normal (m/s), energy lost (J).

    `work` (J) is that of the speed drive during the impact.
    """

    jump: FloatArray
    impulse: float
    approach_speed: float
    separation_speed: float
    energy_lost: float
    work: float = 0.0


def strike(mass: FloatArray, gradient: FloatArray, gap_rate: float, restitution: float) -> Impact:
    """Impact at a gap that closes with `gap_rate` (m/s, negative), gradient by free coordinates."""
    answer = np.asarray(np.linalg.solve(mass, gradient))
    mobility = float(gradient @ answer)
    impulse = -(1 + restitution) * gap_rate / mobility
    lost = 0.5 * (1 - restitution**2) * gap_rate**2 / mobility
    return Impact(answer * impulse, impulse, -gap_rate, -restitution * gap_rate, lost)


class Impacts:
    """Impacts of the contacts by impulse of a problem."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.together: list[tuple[float, tuple[str, str]]] = []  # s: contacts that strike together
        self.bounces = {
            k: Bounces(contact.name, contact.law.restitution)
            for k, contact in enumerate(problem.system.contacts.all)
            if isinstance(contact.law, Impulse)
        }

    def lifted(self, step: Path, nodes: Motion) -> list[tuple[float, int]]:
        """Times (s) within a step at which closed contacts begin to pull, and their numbers."""
        system, lifts = self.problem.system, []
        for i, k in enumerate(system.held.tolist()):
            low = np.flatnonzero(system.accelerations(nodes)[1][:, i] < 0)
            if not len(low):
                continue

            def force(t: float, i: int = i) -> float:
                times = np.array([t])
                return float(system.accelerations(system.motion(times, *step.at(times)))[1][0, i])

            end = float(nodes.t[low[0]])
            lifts.append((step.t if low[0] == 0 else fall(force, step.t, end), k))
        return lifts

    def meet(self, time: float, k: int) -> None:
        """Let the point of contact k bounce off its face, or begin to press."""
        problem, e = self.problem, self.bounces[k].restitution
        recorder, before = problem.recorder, problem.seen
        totals = recorder.totals_of(k)
        over = is_over(-float(before.gap_rate[k]), e, self._gap_acceleration(k))
        place = float(before.place[k])
        hit = self._jump(k, 0.0 if over else e)
        if not over:
            problem.touches.bounce(k, Interval(
                time, time, place, place, hit.approach_speed, hit.separation_speed,
                hit.impulse, hit.energy_lost, peak_force=inf, motor_work=hit.work,
            ))  # fmt: skip
            if endless := self.bounces[k].endless(time, hit.approach_speed):
                problem.stop(endless, LOSE_SPEED)
            before, totals = problem.seen, recorder.totals_of(k)
        self._settle(time, k)
        if (over or e == 0) and self._gap_acceleration(k) < 0:
            problem.change(time, k, Change.CLOSES, before, totals)

    def _gap_acceleration(self, k: int) -> float:
        """Second derivative of the gap of a contact that does not act."""
        motion = self.problem.begin_motion()
        system = self.problem.system
        a, _ = system.accelerations(motion)
        rows = system.contacts.push(motion.frame, np.array([k]), system.touches.approach).rows[0, 0]
        return float(rows @ a[0] + system.contacts.bend(motion.frame, np.array([k]))[0, 0])

    def _jump(self, k: int, e: float) -> Impact:
        """Let contact k strike: speeds jump."""
        problem = self.problem
        motion = problem.begin_motion()
        system, mass = problem.system, motion.mass[0]
        first = system.model.first
        row = system.contacts.push(motion.frame, np.array([k]), system.touches.approach).rows[0, 0]
        hit = strike(mass[first:, first:], row[first:], float(row @ motion.frame.v[0]), e)
        problem.v = problem.v + hit.jump
        if first:
            # The drive keeps the guide's speed: its impulse follows from the guide's row of eq. 2.
            torque = float(mass[0, 1:] @ hit.jump - row[0] * hit.impulse)
            hit = hit._replace(work=torque * float(motion.frame.v[0, 0]))
        problem.recorder.leap(k, hit.impulse, hit.energy_lost, hit.work)
        problem.look_now()
        return hit

    def _settle(self, time: float, struck: int) -> None:
        """Pass an impact on to closed contacts: they stay pressed, without bounce, or open."""
        problem = self.problem
        for _ in range(ROUNDS):
            closed = [struck, *problem.system.held.tolist()]
            rates = {k: float(problem.seen.gap_rate[k]) for k in closed}
            k = min(rates, key=lambda i: rates[i])
            if rates[k] > -1e-12:
                break
            if rates[k] < -REST_SPEED and rates[struck] > REST_SPEED:
                contacts = problem.system.contacts.all
                self.together.append((time, (contacts[struck].name, contacts[k].name)))
            self._jump(k, 0.0)
        for k, rate in rates.items():
            if k != struck and rate > REST_SPEED:
                problem.change(time, k, Change.OPENS, problem.seen)


TURN = 0.3  # rad of the guide in a step: P is searched from its place at the step's start


@dataclass(frozen=True)
class FaceGuard(Guard):
    """The scene's contact of this number begins or ends."""

    problem: Problem
    contact: int

    def late(self, step: Path) -> float:
        """Time (s) from the closing of the gap to a step's end; negative if the gap closes later.

        Contacts by impulse do not need it: if speeds jump, the explicit method is used.
        """
        return self.problem.late_gap(self.contact, step)

    def cross(self, time: float) -> None:
        """Let the contact begin, end, or bounce."""
        self.problem.change_face(time, self.contact)


class WallGuard(FaceGuard):
    """The pair of link and guide of this number begins or ceases to press."""

    bends = True

    def cross(self, time: float) -> None:
        """Let all pairs begin or cease to press that do so at this instant."""
        self.problem.settle_walls(time, self.contact)


@dataclass(frozen=True)
class PieceGuard(Guard):
    """P comes to the end of its piece (way 1), or to its start (-1)."""

    problem: Problem
    way: int

    def cross(self, time: float) -> None:  # noqa: ARG002
        """Go on along the next piece."""
        self.problem.next_piece(self.way)


class Problem(HybridProblem):
    """A model with its events; `q` and `v` are the free coordinates and speeds now."""

    def __init__(
        self,
        system: System,
        recorder: Recorder,
        goal: TurnGoal | None,
        end: float,
        *,
        goes_on: bool,
    ) -> None:
        """A run to `end` (s); one that `goes_on` from another begins where nothing presses."""
        self.system, self.recorder, self.goal = system, recorder, goal
        self.reached, self.stop_reason, self.stop_advice = False, "", ""
        self._halves, self._end = half_periods(system.model.assembly), end
        self._parts = recorder.seeker.nodes  # nodes, as parts of a step
        self._last = len(self._parts) - 1
        self._first = inf  # s: limit of the first step after a contact closes
        q, v = system.model.start
        self.q, self.v = q[system.model.first :], v[system.model.first :]
        self.time = 0.0
        contacts = system.contacts
        self.touches = system.touches
        self.bounds = DepthBounds(contacts.all)
        self.impacts = Impacts(self)
        self._ahead: tuple[Path, Motion, Seen] | None = None  # the last evaluated step
        self.seen = Seen(*np.zeros((4, len(contacts.all))))
        self.look_now()
        faces = contacts.all[: contacts.faces]
        idle = system.model.mechanism.idle_walls
        touching = [] if goes_on else pressed_among(faces, system.model.assembly.state.q)
        pressed = [k for k in touching if k not in idle]
        self.touches.start(
            np.where(np.isin(range(len(faces)), pressed), 0.0, self.seen.gap[: len(faces)])
        )
        for k in pressed:
            self.change(0.0, k, Change.CLOSES, self.seen)
        self.settle_walls(0.0)

    def start_off(self) -> None:
        """Change the start by a rounding error: see `finer`."""
        model = self.system.model
        frame = self.system.frame(np.zeros(1), self.q[None], self.v[None])[0]
        lengths = np.abs(moved_by(model.numbers, frame)).max(axis=0)[model.first :]
        self.q, self.v = seeded(model.assembly, (self.q, self.v), lengths)
        self.look_now()

    # --- the present state --------------------------------------------------------------------

    def look_now(self) -> None:
        """Evaluate all contacts at the present state; the next search for P begins there."""
        frame, u = self.system.frame(np.array([self.time]), self.q[None], self.v[None])
        self.system.track.u = float(u[0])
        self.all_q = frame.q[0]
        self.seen = self.system.contacts.look(frame).pick(0)

    @property
    def over(self) -> bool:
        """Whether the run ends here."""
        return bool(self.stop_reason) or self.reached

    @property
    def left(self) -> float | None:
        """Angle still to turn, rad; None if time ends the run."""
        if self.goal is None:
            return None
        return 0.0 if self.reached else self._to_turn(self.all_q)

    def stop(self, reason: str, advice: str) -> None:
        """End the run after the present step, for a reason."""
        self.stop_reason, self.stop_advice = reason, advice

    def _to_turn(self, q: FloatArray) -> float:
        assert self.goal is not None
        row = turning_row(self.system.model.layout, self.goal.first, self.goal.second)
        return float(self.goal.turned - abs(float(row @ q) - self.goal.start))

    def longest(self, evaluation: Evaluation | None = None) -> float:  # noqa: ARG002
        """Limit of the next step, s: the guide turns by at most `TURN`."""
        speed, gain = map(abs, self.system.guide_speed(self.time, self.v))
        faster = speed + sqrt(speed**2 + 2 * gain * TURN)  # twice the mean speed over this angle
        return min(self._first, 2 * TURN / faster if faster > 0 else inf)

    # --- within a step ------------------------------------------------------------------------

    def _nodes(self, step: Path) -> tuple[Motion, Seen]:
        """Motion at a step's nodes and at the samples within it; contacts at the nodes."""
        if self._ahead is None or self._ahead[0] is not step:
            times = np.concatenate([step.t + step.h * self._parts, self.recorder.due(step)])
            motion = self.system.motion(times, *step.at(times))
            self._ahead = (
                step,
                motion,
                self.system.contacts.look(motion.frame.pick(slice(self._last + 1))),
            )
        return self._ahead[1:]

    def begin_motion(self) -> Motion:
        """Motion (1,) at the present state."""
        return self.system.motion(np.array([self.time]), self.q[None], self.v[None])

    def first_event(self, step: Path) -> Crossing | None:
        """The first event within a step."""
        motion, path = self._nodes(step)
        events = [*self._end_of_piece(step, motion), *self._of_contacts(step, motion, path)]
        if self.goal is not None and self._to_turn(motion.frame.q[self._last]) < 0:

            def left(t: float) -> float:
                return self._to_turn(self._at(step, t)[0].q[0])

            events.append(Crossing(fall(left, step.t, step.t + step.h), TurnsGuard(self)))
        return min(events, key=lambda event: event.time, default=None)

    def _at(self, step: Path, t: float) -> tuple[Frame, FloatArray]:
        times = np.array([t])
        return self.system.frame(times, *step.at(times))

    def _end_of_piece(self, step: Path, motion: Motion) -> list[Crossing]:
        """Event of P at an end of its piece, even if P is back before the step ends."""
        track, places = self.system.track, motion.place[1 : self._last + 1]
        start, end = track.bounds
        if start <= places.min() and places.max() <= end:
            return []
        node = int(np.flatnonzero((places < start) | (places > end))[0])
        ahead, behind = track.left(float(places[node]))
        which, way = (0, 1) if ahead < behind else (1, -1)

        def left(t: float) -> float:
            return track.left(float(self._at(step, t)[1][0]))[which]

        beyond = step.t + step.h * float(self._parts[1 + node])
        # P may start at an end and come back to it within the step.
        end_of_piece = first_fall(left, None, (step.t, beyond))
        return [Crossing(beyond if end_of_piece is None else end_of_piece, PieceGuard(self, way))]

    def _of_contacts(self, step: Path, motion: Motion, path: Seen) -> list[Crossing]:
        contacts = self.system.contacts
        if not contacts.all:
            return []
        path, pressing = self.system.from_sides(path), self.touches.pressed
        events = []
        restless = np.flatnonzero(~calm(path, contacts.length, pressing, step.h))
        if len(restless):
            walls = np.flatnonzero(self._changed(step.t))
            if len(walls):
                return [Crossing(step.t, WallGuard(self, int(walls[0])))]
            path, lengths = self.system.without_ends(path)
            first = first_of(restless, path, lengths, pressing, step.h)
            if first is not None:
                part, k = first
                guard = (FaceGuard if k < contacts.faces else WallGuard)(self, k)
                events.append(Crossing(step.t + part * step.h, guard))
        if self.touches.rigid.any():
            lifted = self.impacts.lifted(step, motion.pick(slice(self._last + 1)))
            events += [Crossing(time, FaceGuard(self, k)) for time, k in lifted]
        return events

    def _changed(self, time: float, contact: int | None = None) -> BoolArray:
        """Whether pairs (c,) begin or cease to press at a time (s), or did so undetected before."""
        contacts = self.system.contacts
        seen = self.system.from_sides(self.seen)
        begun = changed(seen, contacts.length, self.touches.pressed, time, contact)
        begun[: contacts.faces] = False
        return begun

    def late_gap(self, k: int, step: Path) -> float:
        """Time (s) from the closing of a gap to a step's end; negative if it closes later."""
        path, lengths = self.system.without_ends(self.system.from_sides(self._nodes(step)[1]))
        return late_by(path.pick(-1), lengths, k, step.t + step.h)

    # --- from step to step --------------------------------------------------------------------

    def begin(self, evaluation: Evaluation | None = None) -> None:  # noqa: ARG002
        """Record the state at time 0."""
        self.recorder.begin(self.begin_motion())

    def restart(self, time: float) -> tuple[Evaluation, State]:
        """Evaluate the present state for the next step."""
        evaluation = self.system.evaluate(time, self.q, self.v)
        self.system.measure_moves(evaluation.kept.pick(None).frame)
        return evaluation, State(self.q, self.v, evaluation.accelerations)

    def accelerate(self, t: float, q: FloatArray, v: FloatArray) -> FloatArray:
        """Accelerations (n,) of the free coordinates; closed rigid contacts stay closed."""
        motion = self.system.motion(np.array([t]), q[None], v[None])
        return self.system.accelerations(motion)[0][0, self.system.model.first :]

    def position_per_speed_error(self, evaluation: Evaluation) -> FloatArray:
        """Matrix (n, n), s: errors of positions per error of speeds, by slow modes."""
        first = self.system.model.first
        stiffness = self.system.model.numbers.stiffness[first:, first:]
        return slow_motions(evaluation.mass, stiffness, self._end, SHORTEST_SWING)

    def slipped(self, step: Step) -> float:
        """Distance (m) between P by the guide's angle and P by the integral of its velocity."""
        begin, stages = step.begin.kept.frame, step.stages.kept.frame
        moved = step.h * (step.method.weights @ stages.going[:, 0])
        return float(abs(stages.points[-1, 0] - begin.points[0] - moved))

    def accept(self, step: Path) -> None:
        """Go to the end of a step, and record it."""
        motion, path = self._nodes(step)
        seen, self._first = path.pick(-1), inf
        self.time = step.t + step.h
        first, frame = self.system.model.first, motion.frame
        self.all_q, self.seen = frame.q[self._last], seen
        self.q, self.v = frame.q[self._last, first:], frame.v[self._last, first:]
        self.recorder.take(step, motion)
        self.system.track.u = float(motion.place[self._last])
        contacts = self.system.contacts
        inside = contacts.inside(seen)[: contacts.faces]
        for k in np.flatnonzero(inside < 0).tolist():
            self.touches.beside(k, float(seen.gap[k]))
        for channel in self.system.model.mechanism.channels:
            walls = self.touches.pressed & (np.arange(len(seen.gap)) >= contacts.faces)
            if seen.gap[walls].min(initial=0.0) < -deepest_allowed(channel):
                self.stop(broken_wall(channel), BROKEN_WALL_ADVICE)
        if self.bounds.any and (reason := self.bounds.passed(-seen.gap * self.touches.pressed)):
            self.stop(reason, TOO_DEEP_ADVICE)

    def cross(self, event: Crossing) -> None:
        """Record the steps that wait, then let the event's guard change the equations."""
        self.recorder.record_waiting()
        event.guard.cross(event.time)

    def next_piece(self, way: int) -> None:
        """Go on along the next piece of the track; without a next piece the run stops."""
        self.recorder.keep_last()
        track = self.system.track
        self.system.forget()
        if isinstance(track, PinOnTrack):
            self._next_piece_of_pin(track, way)
            return
        before = track.at(np.array([track.u]))[1][0]
        if not track.next_piece(way, self.time):
            name = track.slot.name
            self.stop(f"the point of slot '{name}' reached the curve's end",
                      "lengthen the curve, or end the run before")  # fmt: skip
        elif self.system.model.layout.play:
            after = track.at(np.array([track.u]))[1][0]
            self.q, self.v = self.q.copy(), self.v.copy()
            self.q[-1] = track.u
            self.v[-1] *= abs(before) / abs(after)

    def _next_piece_of_pin(self, track: PinOnTrack, way: int) -> None:
        """Replace the walls of a lap by those of the next, if one begins."""
        first = len(self.system.model.layout.faces)
        before = [first + k for k in track.groove.walls(track.lap)]
        track.next_piece(way, self.time)
        after = [first + k for k in track.groove.walls(track.lap)]
        seen = self.seen
        self.look_now()
        for old, new in zip(before, after, strict=True):
            if old != new and self.touches.pressed[old]:
                approach = float(self.touches.approach[old])
                self.change(self.time, old, Change.OPENS, seen)
                rates = self.seen.gap_rate.copy()
                rates[new] = -approach
                self.change(self.time, new, Change.CLOSES, self.seen._replace(gap_rate=rates))

    def settle_walls(self, time: float, contact: int | None = None) -> None:
        """Let all pairs begin or cease to press that do so at an event of this `contact`."""
        for k in np.flatnonzero(self._changed(time, contact)).tolist():
            self.change(time, k, self._change_of(k), self.seen)

    def _change_of(self, k: int) -> Change:
        gap, gap_rate = float(self.seen.gap[k]), float(self.seen.gap_rate[k])
        inside = float(self.system.contacts.inside(self.seen)[k])
        return self.touches.crossing(k, gap, gap_rate, inside)

    def change_face(self, time: float, k: int) -> None:
        """Let a contact of the scene begin, end, or bounce."""
        what, rigid = self._change_of(k), bool(self.touches.rigid[k])
        if what is Change.PASSES:
            self.change(time, k, what, self.seen)
            return
        begins = what is Change.CLOSES
        self.recorder.keep_last(before=what is Change.SLIDES_OFF or (begins and rigid))
        if begins and rigid:
            self.impacts.meet(time, k)
        else:
            self.change(time, k, what, self.seen)
        self.recorder.keep(self.begin_motion())

    def change(
        self,
        time: float,
        k: int,
        what: Change,
        seen: Seen,
        since: tuple[float, float] | None = None,
    ) -> None:
        """Let a contact begin or end as `seen`; its totals count from those in `since`."""
        if what is Change.CLOSES:
            self._first = min(self._first, FIRST * self._halves[k])
        totals = self.recorder.totals_of(k) if since is None else since
        now = Moment(time, float(seen.place[k]), float(seen.gap_rate[k]), totals)
        self.touches.change(k, what, now)

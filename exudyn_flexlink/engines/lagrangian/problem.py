"""Guide, link and levers as a problem of the integration: steps, events, impacts, and the recorder.

Impacts follow the paper's eq. 2 to 4: ``-e v_a = v_s`` along the normal. The configuration stays,
the speeds jump by the generalised impulse ``P_k = G_k p``:

    M (v_s - v_a) = G p                         (eq. 2, M the mass matrix of the free coordinates)
    g'_a = G v_a + ..,  g'_s = -e g'_a          (eq. 3 and 4, g' the rate of the gap)
    p = -(1 + e) g'_a / (G M^-1 G^T)
    energy lost = (1 - e^2)/2 g'_a^2 / (G M^-1 G^T)

Forces of drives, joints and slot at the samples follow from Newton's law once the motion is known.
With m a the momentum's rate of the whole link, F n the contact forces on it, g the weight's
acceleration, e along the guide and N the force of the track along its normal:

    along the guide:   m a.e = N (normal.e) + sum F n.e + m g.e    (the sleeve does not drag)
    across it:         S = m a - N normal - sum F n - m g          (of the sleeve, on the link)
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
from exudyn_flexlink.mechanism import Seen, TurnGoal, deepest_allowed, pressed_among
from exudyn_flexlink.result import Interval

Path = Step | DenseStep


class LinkKept(NamedTuple):
    """What is kept of the mechanism at instants (m,)."""

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
    """Takes the steps of a system."""

    def __init__(self, system: System, grid: FloatArray, seeker: ExtremeSeeker) -> None:
        super().__init__(system.model.mechanism, grid, seeker, system.touches)
        self.system = system
        self._waiting: list[_Waiting] = []

    def due(self, step: Path) -> FloatArray:
        """Samples (n,), s, within a step."""
        return self._due(step.t + step.h)

    def begin(self, at: Motion) -> None:
        """Take the state (1,) at time 0."""
        self._start(self._known(at))

    def keep(self, at: Motion) -> None:
        """Keep a state (1,) as it is now, after what happened there."""
        self.work_off()
        self._keep_now(self._known(at))

    def take(self, step: Path, motion: Motion) -> None:
        """Take a step, known at its nodes and then at the samples that are `due` in it."""
        self._pass(step.t + step.h)
        self._waiting.append(_Waiting(step.t, step.h, motion))
        if len(self._waiting) >= AT_ONCE:
            self.work_off()

    def work_off(self) -> None:
        """Work off the steps that wait: the same contacts press in all of them."""
        if not self._waiting:
            return
        t, h, motions = (list(column) for column in zip(*self._waiting, strict=True))
        self._waiting.clear()
        counts = np.array([len(motion.t) for motion in motions])
        rows = np.arange(len(self.seeker.nodes))  # of nodes, the first that is known of a step
        nodes = (np.cumsum(counts) - counts)[:, None] + rows
        samples = np.delete(np.arange(counts.sum()), nodes.ravel())
        of = np.repeat(np.arange(len(counts)), counts - len(rows))
        whole = joined(motions)
        known = self._known(whole)
        steps = Steps(np.array(t), np.array(h), nodes, samples, of)
        self._book(steps, known, self._rates(whole, known), known.pick(nodes[:, -1]))

    def _known(self, at: Motion) -> Kept:
        """What is known at instants, but for the totals."""
        model, count = self.system.model, len(at.t)
        a, held = self.system.accelerations(at)
        press = np.zeros((count, len(self.contacts)))
        if at.pushed is not None:
            press[:, at.pushed.which] = at.pushed.press
        press[:, self.system.held] = held
        motor = self.system.motor_torque(at, a, held)
        pressed = np.broadcast_to(self.touches.pressed, press.shape)
        places = (at.place + self.system.track.shift)[:, None]
        if model.layout.slides:
            places = places[:, :0]
        kept = LinkKept(*model.poses(at.frame), a, momentum_rate(model.numbers, at.frame, a), motor)
        return Kept(at.t, places, press, pressed, np.zeros((count, 2)), kept)

    def _rates(self, at: Motion, known: Kept) -> Totals:
        """Rates (m, ...) of the totals at instants."""
        rates, v = self._totals(len(at.t)), at.frame.v
        rates.damped[:] = ((v @ self.system.model.numbers.damping) * v).sum(axis=1)
        rates.supplied[:] = known.of_engine.motor * v[:, 0] + (at.motors * v).sum(axis=1)
        rates.impulses[:] = known.press
        if at.pushed is not None:
            rates.losses[:, at.pushed.which] = at.pushed.power
        return rates

    def motion(self, at: Kept) -> tuple[FloatArray, FloatArray]:
        """Poses and rates (m, parts, 3) at instants that are kept."""
        return at.of_engine.poses, at.of_engine.rates


@dataclass(frozen=True)
class Forces:
    """Reactions (samples, 2) in N, global axes, at instants that were `kept`."""

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
            at = self._link.poses[rows], self._link.rates[rows]
            push = push_of(contact, *at, self.kept.press[rows, k])
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
        """Force of the track on P: all that the link lacks, or what it lacks along the guide."""
        lacking = _plane(self._link.momentum_rate) - self._on_link
        if self.model.layout.slides:  # the walls are among what acts on the link
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
        """Force of a pivot whose part gives the force `given_on` on to others."""
        k, numbers = self.model.layout.coordinate(pivot.part), self.model.numbers
        a, mass = self._link.accelerations[:, k], self.model.mechanism.parts[pivot.part].mass
        angle, speed = (column[:, pivot.part, 2] for column in (self._link.poses, self._link.rates))
        swing = (1j * a - speed**2) * numbers.moments[k] * np.exp(1j * angle)
        force = _plane(swing - mass * numbers.gravity) + given_on
        return np.asarray(force if pivot.second else -force)


def _plane(vectors: ComplexArray) -> FloatArray:
    """Vectors x + i y (m,) as (m, 2)."""
    return np.stack([vectors.real, vectors.imag], axis=-1)


ROUNDS = 50  # of impacts that follow from one


class Impact(NamedTuple):
    """Jump of the free speeds, impulse (N s), speeds along the normal (m/s), energy lost (J).

    `work` (J) is what the speed drive does meanwhile.
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
        self.together: list[tuple[float, tuple[str, str]]] = []  # s, contacts with one impact
        self.bounces = {
            k: Bounces(contact.name, contact.law.restitution)
            for k, contact in enumerate(problem.system.contacts.all)
            if isinstance(contact.law, Impulse)
        }

    def lifted(self, step: Path, nodes: Motion) -> list[tuple[float, int]]:
        """When (s) contacts that are held closed would have to pull, within a step, and which."""
        system, lifts = self.problem.system, []
        for i, k in enumerate(system.held.tolist()):
            low = np.flatnonzero(system.accelerations(nodes)[1][:, i] < 0)
            if not len(low):
                continue

            def force(t: float, i: int = i) -> float:
                at = np.array([t])
                return float(system.accelerations(system.motion(at, *step.at(at)))[1][0, i])

            end = float(nodes.t[low[0]])
            lifts.append((step.t if low[0] == 0 else fall(force, step.t, end), k))
        return lifts

    def meet(self, time: float, k: int) -> None:
        """The point of contact k meets its face: it bounces, or begins to press."""
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
        """G'' of a contact as long as it does not act."""
        at = self.problem.begin_motion()
        system = self.problem.system
        a, _ = system.accelerations(at)
        rows = system.contacts.push(at.frame, np.array([k]), system.touches.approach).rows[0, 0]
        return float(rows @ a[0] + system.contacts.bend(at.frame, np.array([k]))[0, 0])

    def _jump(self, k: int, e: float) -> Impact:
        """Let contact k strike: speeds jump."""
        problem = self.problem
        at = problem.begin_motion()
        system, mass = problem.system, at.mass[0]
        first = system.model.first
        row = system.contacts.push(at.frame, np.array([k]), system.touches.approach).rows[0, 0]
        hit = strike(mass[first:, first:], row[first:], float(row @ at.frame.v[0]), e)
        problem.v = problem.v + hit.jump
        if first:
            # The drive keeps the guide's speed: its impulse closes the guide's own row of eq. 2.
            torque = float(mass[0, 1:] @ hit.jump - row[0] * hit.impulse)
            hit = hit._replace(work=torque * float(at.frame.v[0, 0]))
        problem.recorder.leap(k, hit.impulse, hit.energy_lost, hit.work)
        problem.look_now()
        return hit

    def _settle(self, time: float, struck: int) -> None:
        """Let an impact pass through closed contacts: they press on, without bounce, or end."""
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


TURN = 0.3  # rad of the guide in one step: P is searched from where the last one ended


@dataclass(frozen=True)
class FaceGuard(Guard):
    """A contact of the scene, of this number, begins or ends."""

    problem: Problem
    contact: int

    def late(self, step: Path) -> float:
        """How long (s) before a step's end its gap was closed; negative: after.

        Contacts by impulse do not ask: where speeds jump the method is the explicit one.
        """
        return self.problem.late_gap(self.contact, step)

    def cross(self, time: float) -> None:
        """Let it begin, end, or bounce."""
        self.problem.change_face(time, self.contact)


@dataclass(frozen=True)
class WallGuard(Guard):
    """A pair of link and guide, of this number, begins or ceases to press."""

    problem: Problem
    contact: int
    bends = True

    def late(self, step: Path) -> float:
        """How long (s) before a step's end its gap was closed; negative: after."""
        return self.problem.late_gap(self.contact, step)

    def cross(self, time: float) -> None:
        """Let all pairs that do so begin or cease to press."""
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
        halves: list[float],
        end: float,
    ) -> None:
        """`halves` (s) are half periods of contacts, `end` that of the run."""
        self.system, self.recorder, self.goal = system, recorder, goal
        self.reached, self.stop_reason, self.stop_advice = False, "", ""
        self._halves, self._end = halves, end
        self._parts = recorder.seeker.nodes  # of a step, where it is known
        self._last = len(self._parts) - 1
        self._first = inf  # s: limit of the first step after a contact has closed
        q, v = system.model.start
        self.q, self.v = q[system.model.first :], v[system.model.first :]
        self.time = 0.0
        contacts = system.contacts
        self.touches = system.touches
        self.bounds = DepthBounds(contacts.all)
        self.impacts = Impacts(self)
        self._ahead: tuple[Path, Motion, Seen] | None = None  # the last step looked at
        self.seen = Seen(*np.zeros((4, len(contacts.all))))
        self.look_now()
        faces = contacts.all[: contacts.faces]
        idle = system.model.mechanism.idle_walls
        touching = pressed_among(faces, system.model.assembly.state.q)
        pressed = [k for k in touching if k not in idle]
        self.touches.start(
            np.where(np.isin(range(len(faces)), pressed), 0.0, self.seen.gap[: len(faces)])
        )
        for k in pressed:
            self.change(0.0, k, Change.CLOSES, self.seen)
        self.settle_walls(0.0)

    def start_off(self) -> None:
        """Start off by what rounding may be: see `finer`."""
        model = self.system.model
        at = self.system.frame(np.zeros(1), self.q[None], self.v[None])[0]
        lengths = np.abs(moved_by(model.numbers, at)).max(axis=0)[model.first :]
        self.q, self.v = seeded(model.assembly, (self.q, self.v), lengths)
        self.look_now()

    # --- where it is --------------------------------------------------------------------------

    def look_now(self) -> None:
        """See all contacts where it is, and let the next search for P begin there."""
        at, u = self.system.frame(np.array([self.time]), self.q[None], self.v[None])
        self.system.track.u = float(u[0])
        self.all_q = at.q[0]
        self.seen = self.system.contacts.look(at).pick(0)

    @property
    def over(self) -> bool:
        """Whether the run ends here."""
        return bool(self.stop_reason) or self.reached

    @property
    def left(self) -> float | None:
        """Angle still to turn, rad; None where time ends the run."""
        if self.goal is None:
            return None
        return 0.0 if self.reached else self._to_turn(self.all_q)

    def stop(self, reason: str, advice: str) -> None:
        """End the run after the step that is under way, for a reason."""
        self.stop_reason, self.stop_advice = reason, advice

    def _to_turn(self, q: FloatArray) -> float:
        assert self.goal is not None
        row = turning_row(self.system.model.layout, self.goal.first, self.goal.second)
        return float(self.goal.turned - abs(float(row @ q) - self.goal.start))

    def longest(self, at: Evaluation | None = None) -> float:  # noqa: ARG002
        """Limit of the next step, s: the guide turns a little."""
        speed, gain = map(abs, self.system.guide_speed(self.time, self.v))
        faster = speed + sqrt(speed**2 + 2 * gain * TURN)  # twice its mean while it turns so far
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
        """Motion (1,) where it is."""
        return self.system.motion(np.array([self.time]), self.q[None], self.v[None])

    def first_event(self, step: Path) -> Crossing | None:
        """What happens first within a step."""
        motion, path = self._nodes(step)
        happening = [*self._end_of_piece(step, motion), *self._of_contacts(step, motion, path)]
        if self.goal is not None and self._to_turn(motion.frame.q[self._last]) < 0:

            def left(t: float) -> float:
                return self._to_turn(self._at(step, t)[0].q[0])

            happening.append(Crossing(fall(left, step.t, step.t + step.h), TurnsGuard(self)))
        return min(happening, key=lambda event: event.time, default=None)

    def _at(self, step: Path, t: float) -> tuple[Frame, FloatArray]:
        at = np.array([t])
        return self.system.frame(at, *step.at(at))

    def _end_of_piece(self, step: Path, motion: Motion) -> list[Crossing]:
        """Where P comes to an end of its piece, from which it may be back before the step ends."""
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
        # It may start at an end, and be back there within the step.
        end_of_piece = first_fall(left, None, (step.t, beyond))
        return [Crossing(beyond if end_of_piece is None else end_of_piece, PieceGuard(self, way))]

    def _of_contacts(self, step: Path, motion: Motion, path: Seen) -> list[Crossing]:
        contacts = self.system.contacts
        if not contacts.all:
            return []
        path, pressing = self.system.from_sides(path), self.touches.pressed
        happening = []
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
                happening.append(Crossing(step.t + part * step.h, guard))
        if self.touches.rigid.any():
            lifted = self.impacts.lifted(step, motion.pick(slice(self._last + 1)))
            happening += [Crossing(time, FaceGuard(self, k)) for time, k in lifted]
        return happening

    def _changed(self, time: float, contact: int | None = None) -> BoolArray:
        """Walls' pairs that now (s) begin or cease to press, or did so unseen, (c,)."""
        contacts = self.system.contacts
        seen = self.system.from_sides(self.seen)
        begun = changed(seen, contacts.length, self.touches.pressed, time, contact)
        begun[: contacts.faces] = False
        return begun

    def late_gap(self, k: int, step: Path) -> float:
        """How long (s) before a step's end the gap of a contact was closed; negative: after."""
        path, lengths = self.system.without_ends(self.system.from_sides(self._nodes(step)[1]))
        return late_by(path.pick(-1), lengths, k, step.t + step.h)

    # --- from step to step --------------------------------------------------------------------

    def begin(self, at: Evaluation | None = None) -> None:  # noqa: ARG002
        """Record the state at time 0."""
        self.recorder.begin(self.begin_motion())

    def restart(self, time: float) -> tuple[Evaluation, State]:
        """Take up the present state."""
        at = self.system.evaluate(time, self.q, self.v)
        self.system.measure_moves(at.kept.pick(None).frame)
        return at, State(self.q, self.v, at.accelerations)

    def accelerate(self, t: float, q: FloatArray, v: FloatArray) -> FloatArray:
        """Accelerations (n,) of the free coordinates, with what holds rigid contacts closed."""
        at = self.system.motion(np.array([t]), q[None], v[None])
        return self.system.accelerations(at)[0][0, self.system.model.first :]

    def position_per_speed_error(self, at: Evaluation) -> FloatArray:
        """Matrix (n, n), s: the position error that a speed error becomes through slow modes."""
        first = self.system.model.first
        stiffness = self.system.model.numbers.stiffness[first:, first:]
        return slow_motions(at.mass, stiffness, self._end, SHORTEST_SWING)

    def slipped(self, step: Step) -> float:
        """How far (m) P, which follows the guide's angle, ended from where its speed takes it."""
        begin, stages = step.begin.kept.frame, step.stages.kept.frame
        moved = step.h * (step.method.weights @ stages.going[:, 0])
        return float(abs(stages.points[-1, 0] - begin.points[0] - moved))

    def accept(self, step: Path) -> None:
        """Go to the end of a step, and record it."""
        motion, path = self._nodes(step)
        seen, self._first = path.pick(-1), inf
        self.time = step.t + step.h
        first, at = self.system.model.first, motion.frame
        self.all_q, self.seen = at.q[self._last], seen
        self.q, self.v = at.q[self._last, first:], at.v[self._last, first:]
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
        """Let the event's guard change the equations, once what waits for them is worked off."""
        self.recorder.work_off()
        event.guard.cross(event.time)

    def next_piece(self, way: int) -> None:
        """Go on along the next piece of the track; where there is none, the run stops."""
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
        """Let the walls of the next lap, if one begins, take over from those of the present one."""
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
        """Let all pairs that do so at an event of this `contact` begin or cease to press."""
        for k in np.flatnonzero(self._changed(time, contact)).tolist():
            self.change(time, k, self._happening(k), self.seen)

    def _happening(self, k: int) -> Change:
        gap, gap_rate = float(self.seen.gap[k]), float(self.seen.gap_rate[k])
        inside = float(self.system.contacts.inside(self.seen)[k])
        return self.touches.crossing(k, gap, gap_rate, inside)

    def change_face(self, time: float, k: int) -> None:
        """Let a contact of the scene begin, end, or bounce."""
        what, rigid = self._happening(k), bool(self.touches.rigid[k])
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
        """Let a contact begin or end, where it is `seen`; what it takes counts from `since` on."""
        if what is Change.CLOSES:
            self._first = min(self._first, FIRST * self._halves[k])
        totals = self.recorder.totals_of(k) if since is None else since
        now = Moment(time, float(seen.place[k]), float(seen.gap_rate[k]), totals)
        self.touches.change(k, what, now)

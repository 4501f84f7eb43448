"""Impact by impulse and momentum, the paper's eq. 2 to 4: ``-e v_a = v_s`` along the normal.

The configuration stays, the speeds jump by the generalised impulse ``P_k = G_k p``:

    M (v_s - v_a) = G p                         (eq. 2, M the mass matrix of the free coordinates)
    g'_a = G v_a + ..,  g'_s = -e g'_a          (eq. 3 and 4, g' the rate of the gap)
    p = -(1 + e) g'_a / (G M^-1 G^T)
    energy lost = (1 - e^2)/2 g'_a^2 / (G M^-1 G^T)

What that changes of the contact that is hit, and of those that are held closed, is here, too.
"""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.diagnostics.bouncing import LOSE_SPEED, REST_SPEED, Bounces, is_over
from exudyn_flexlink.engines.lagrangian.system import Motion
from exudyn_flexlink.engines.touching import Change
from exudyn_flexlink.integrate.events import fall
from exudyn_flexlink.intervals import Interval
from exudyn_flexlink.laws import Impulse

if TYPE_CHECKING:
    from exudyn_flexlink.engines.lagrangian.problem import Problem
    from exudyn_flexlink.engines.lagrangian.recording import Path

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
            k: Bounces(own.name, own.law.restitution)
            for k, own in enumerate(problem.system.contacts.all)
            if isinstance(own.law, Impulse)
        }

    def lifted(self, step: Path, nodes: Motion) -> list[tuple[float, int]]:
        """When (s) contacts that are held closed would have to pull, within a step, and which."""
        system, found = self.problem.system, []
        for i, k in enumerate(system.held.tolist()):
            low = np.flatnonzero(system.accelerations(nodes)[1][:, i] < 0)
            if not len(low):
                continue

            def force(t: float, i: int = i) -> float:
                at = np.array([t])
                return float(system.accelerations(system.motion(at, *step.at(at)))[1][0, i])

            end = float(nodes.t[low[0]])
            found.append((step.t if low[0] == 0 else fall(force, step.t, end), k))
        return found

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
            own = float(mass[0, 1:] @ hit.jump - row[0] * hit.impulse)
            hit = hit._replace(work=own * float(at.frame.v[0, 0]))
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

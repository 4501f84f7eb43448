"""Impact by impulse and momentum, the paper's eq. 2 to 4: ``-e v_a = v_s`` along the normal.

The configuration stays, the speeds jump by the generalised impulse ``P_k = G_k p``:

    M (v_s - v_a) = G p                         (eq. 2, M the mass matrix of the free coordinates)
    g'_a = G v_a + ..,  g'_s = -e g'_a          (eq. 3 and 4, g' the rate of the gap)
    p = -(1 + e) g'_a / (G M^-1 G^T)
    energy lost = (1 - e^2)/2 g'_a^2 / (G M^-1 G^T)

What that changes of the contact that is hit, and of those that last, is here, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.diagnostics.bouncing import LOSE_SPEED, REST_SPEED, is_over
from exudyn_flexlink.engines.lagrangian.equations import LASTING, NOT_ACTING
from exudyn_flexlink.engines.lagrangian.event_functions import Side
from exudyn_flexlink.engines.lagrangian.faces import touches
from exudyn_flexlink.engines.lagrangian.mass import mass_matrix

if TYPE_CHECKING:
    from exudyn_flexlink.engines.lagrangian.system import System


ROUNDS = 50  # of impacts that follow from one


@dataclass(frozen=True)
class Impact:
    """Jump of the free coordinates' speeds, impulse (N s), speeds along the normal, energy (J)."""

    jump: FloatArray
    impulse: float
    approach_speed: float
    separation_speed: float
    energy_lost: float


def strike(mass: FloatArray, gradient: FloatArray, gap_rate: float, restitution: float) -> Impact:
    """Impact at a gap that closes with `gap_rate` (m/s, negative), gradient by free coordinates."""
    answer: FloatArray = np.asarray(np.linalg.solve(mass, gradient), dtype=np.float64)
    mobility = float(gradient @ answer)
    impulse = -(1 + restitution) * gap_rate / mobility
    lost = 0.5 * (1 - restitution**2) * gap_rate**2 / mobility
    return Impact(answer * impulse, impulse, -gap_rate, -restitution * gap_rate, lost)


def meet_face(system: System, t: float, y: FloatArray, k: int) -> FloatArray:
    """The point of a rigid contact meets its face: it bounces, or begins to press."""
    contact, e = system.contacts[k], system.contacts[k].face.law.restitution
    q, v, point = system.coordinates(t, y)
    touch = touches(q, v, point, system.constants)[0][k].copy()
    totals = system.contact_totals(y, k)
    over = is_over(-float(touch[2]), e, _gap_acceleration(system, t, y, k))
    e = 0.0 if over else e
    y, hit, work = _jump(system, t, y, k, e)
    if not over:
        contact.hit(t, float(touch[1]), hit, work)
        endless = contact.bounces.endless(t, hit.approach_speed)
        if endless:
            system.stop(endless, LOSE_SPEED)
        totals = system.contact_totals(y, k)
        touch[2] = hit.separation_speed
    y = _settle(system, t, y, k)
    if e == 0 and _gap_acceleration(system, t, y, k) < 0:
        contact.begin(t, touch, *totals)
    return y


def _gap_acceleration(system: System, t: float, y: FloatArray, k: int) -> float:
    """G'' of a contact as long as it does not act."""
    accelerations = system.motion(t, y).a[0]
    states, gradients, _ = touches(*system.coordinates(t, y), system.constants)
    return float(gradients[k] @ accelerations + states[k, 4])


def _jump(
    system: System, t: float, y: FloatArray, k: int, e: float
) -> tuple[FloatArray, Impact, float]:
    """State after the impulse of contact k, and the work that the speed drive did in it."""
    q, v, point = system.coordinates(t, y)
    states, gradients, _ = touches(q, v, point, system.constants)
    mass, first, free = mass_matrix(q, point, system.constants), system.first, system.free
    hit = strike(mass[first:, first:], gradients[k, first:], float(states[k, 2]), e)
    y = y.copy()
    y[free : 2 * free] += hit.jump
    work = 0.0
    if first:
        # The drive keeps the guide's speed: its impulse closes the guide's own row of eq. 2.
        own = float(mass[0, 1:] @ hit.jump - gradients[k, 0] * hit.impulse)
        work = own * float(v[0])
    impulses, works = system.totals(y)
    y[2 * free + 1] += work
    impulses[k] += hit.impulse
    works[k] += hit.energy_lost
    return y, hit, work


def _settle(system: System, t: float, y: FloatArray, struck: int) -> FloatArray:
    """Let an impact pass through lasting contacts: they press on, without bounce, or end."""
    for _ in range(ROUNDS):
        q, v, point = system.coordinates(t, y)
        states, _, _ = touches(q, v, point, system.constants)
        rates = {
            k: float(states[k, 2])
            for k, contact in enumerate(system.contacts)
            if k == struck or contact.acting == LASTING
        }
        k = min(rates, key=lambda i: rates[i])
        if rates[k] > -1e-12:
            break
        if rates[k] < -REST_SPEED and rates[struck] > REST_SPEED:
            names = system.contacts[struck].face.name, system.contacts[k].face.name
            system.together.append((t, names))
        y, _, _ = _jump(system, t, y, k, 0.0)
    for k, rate in rates.items():
        if k != struck and rate > REST_SPEED:
            system.end_contact(t, y, k, states[k], Side.APART)
            system.acting[k] = NOT_ACTING
    return y

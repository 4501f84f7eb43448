"""Short pulses of drives by formulas of time: found before a run, so that steps end within them.

A step knows a drive at its stages alone, and so does the estimate of its error. What a pulse does
is judged by the tolerance: its area times how a force moves things at the start, times the time
that is left; the area of a speed times a length.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from math import inf, isfinite

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.expressions import Addend, pulses, resolved
from exudyn_flexlink.mechanism.assembly import Assembly
from exudyn_flexlink.mechanism.dynamics import pushed
from exudyn_flexlink.mechanism.kinematics import anchor_jacobian
from exudyn_flexlink.mechanism.model import Motor, Size
from exudyn_flexlink.mechanism.parts import GROUND
from exudyn_flexlink.mechanism.prescribed import Formula, SpeedOf

SHARE = 0.1  # of the tolerance: what may be hidden of each term
WITHOUT_TOLERANCE = 1e-6  # of the mechanism's reach: a tolerance, where the scene gives a step


def with_pulses(assembly: Assembly, tolerance: float | None, end: float) -> Assembly:
    """Let the mechanism of an assembly know its pulses up to `end` (s); `tolerance` is in m."""
    mechanism = assembly.mechanism
    if not isfinite(end):
        return assembly
    length = max(part.reach for part in mechanism.parts) or 1.0
    allowed = SHARE * (tolerance or WITHOUT_TOLERANCE * length)
    knots, told, motors = list[FloatArray](), list[str](), list[Motor]()
    for motor in mechanism.speed_motors:
        formula = motor.speed.motion if isinstance(motor.speed, SpeedOf) else motor.speed
        if isinstance(formula, Formula):
            expression, clock = formula.expression, formula.clock
            terms = expression.addends if formula is motor.speed else expression.rate_addends
            cost = 1.0 if motor.slide else length
            edges, short, left = _parts(formula, terms, end, (cost, 0.0), allowed)
            knots.append(short)
            told += _told(motor.name, left)
            if formula is motor.speed:
                speed = Formula(expression, clock, (clock + edges).tolist())
                motors.append(replace(motor, speed=speed))
                continue
        motors.append(motor)
    for name, size, rows, alone in _loads(assembly):
        if isinstance(size.value, Formula):
            terms = [term for term in size.value.expression.addends if term.of_time]
            mobility = max(alone, *(_moved(assembly, row) for row in rows))
            _, short, left = _parts(size.value, terms, end, (mobility * end, -mobility), allowed)
            knots.append(short)
            told += _told(name, left)
    found = np.unique(np.concatenate([np.zeros(0), *knots]))
    within, unfound = tuple(found.tolist()), tuple(dict.fromkeys(told))
    return replace(
        assembly,
        mechanism=replace(mechanism, speed_motors=tuple(motors), pulses=within, unfound=unfound),
    )


def _parts(
    formula: Formula,
    terms: list[Addend],
    end: float,
    cost: tuple[float, float],
    allowed: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Edges (s) of the parts of all terms, those of pulses, and parts (n, 2) not looked into.

    `cost` (m) of an area that is hidden is at time 0, and how it changes with time.
    """
    clock = formula.clock
    bends = np.array([0.0, *formula.knots(end), end]) + clock
    edges, short, left = [bends], [np.zeros(0)], [np.zeros((0, 2))]
    for term in terms:
        found, rest = resolved(term, bends, lambda t: cost[0] + cost[1] * (t - clock), allowed)
        edges.append(found)
        at = np.searchsorted(found, bends).tolist()  # no step goes over a bend
        short += [pulses(found[i : j + 1]) for i, j in pairwise(at) if j > i + 1]
        left.append(rest)
    of_pulses = np.unique(np.concatenate(short)) - clock
    return np.unique(np.concatenate(edges)) - clock, of_pulses, np.concatenate(left) - clock


def _told(name: str, left: FloatArray) -> Iterator[str]:
    if len(left):
        shortest = float((left[:, 1] - left[:, 0]).min())
        yield (
            f"drive '{name}' varies too fast to look for pulses shorter than {shortest:.2g} s from "
            f"{left[:, 0].min():.4g} to {left[:, 1].max():.4g} s: step control may miss one there"
        )


def _loads(assembly: Assembly) -> Iterator[tuple[str, Size, list[FloatArray], float]]:
    """Sizes of torques and forces, their generalised forces by unit, and their mobility alone.

    That is how much (m/s^2) a unit accelerates its body without joints: at the start all may be in
    line with a force that moves much later.
    """
    mechanism, q = assembly.mechanism, assembly.state.q
    masses = {
        body: sum(mechanism.parts[part].mass for part in parts) or inf
        for body, parts in mechanism.bodies.items()
    }
    for motor in mechanism.torque_motors:
        row, alone = np.zeros(q.shape), 0.0
        for part, sign in ((motor.first, -1.0), (motor.second, 1.0)):
            if part != GROUND:
                row[part, 2] += sign
                own = mechanism.parts[part]
                alone = max(alone, 1.0 / (masses[own.body] * (own.reach or 1.0)))
        yield motor.name, motor.size, [row.ravel()], alone
    for force in mechanism.forces:
        rows = list(anchor_jacobian(force.point, q).reshape(2, -1))
        alone = 1.0 / masses[mechanism.parts[force.point.part].body]
        yield from ((force.name, size, rows, alone) for size in force.sizes)


def _moved(assembly: Assembly, force: FloatArray) -> float:
    """How much (m/s^2) a generalised force (3 parts,) accelerates anything at the start."""
    state, mechanism = assembly.state, assembly.mechanism
    found = pushed(mechanism, state.q, state.places, force)
    reach = np.array([part.reach or 1.0 for part in mechanism.parts])
    return float((np.hypot(found[:, 0], found[:, 1]) + reach * np.abs(found[:, 2])).max())

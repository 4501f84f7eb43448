"""How accurate steps are and how long they may be, and what is handed on from one to the next.

What is handed on are the eight numbers of `Means.memory` (8,), by their indices:

=========  ====  ===================================  =========================  ===================
index      unit  what                                 written by                 read by
=========  ====  ===================================  =========================  ===================
STEP       s     length wanted of the next step       advance, CompiledStepper   advance
OLD_STEP   s     length of the last step              advance                    step control, guess
OLD_ERROR  1     its error in parts of that allowed   advance                    step control
ITERATED   1     Newton's iterations of all steps     advance                    CompiledStepper
TROUBLE    code  how the search for P ended, FINE ..  advance                    CompiledStepper
MOVED      1     largest `moved_by_point` so far      knots                      knots
PAIR       code  pair that began or ceased to touch   advance, CompiledStepper   CompiledStepper
SLOWNESS   1/s   slowness of the iteration, see Aim   advance                    advance
=========  ====  ===================================  =========================  ===================

Errors are no less than a hundredth; codes are those of `track_point`, and the number of a pair or
`wall_events.NONE`. CompiledStepper sets STEP at the start and after events, PAIR before each block.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.compiled import inlined
from exudyn_flexlink.engines.lagrangian.mode import Mode, guide_at
from exudyn_flexlink.engines.lagrangian.radau import ITERATIONS
from exudyn_flexlink.integrate.clock import CLOCK
from exudyn_flexlink.integrate.control import SAFETY, growth

step_growth = inlined(growth)
SHORTEST = 1e-14  # s, where the clock tells that apart
STEP, OLD_STEP, OLD_ERROR, ITERATED, TROUBLE, MOVED, PAIR, SLOWNESS = range(8)


class Control(NamedTuple):
    """How accurate, and how far a step may go."""

    tolerance: float  # m: error of one step
    tau: float  # s: turns errors of speeds into lengths
    lasting: float  # s: the same for what the iteration leaves
    turn: float  # rad: that the guide may turn in a step
    reaches: FloatArray  # (N,) of guide and levers, m
    bend: float  # m/s^2: what knots of the track may cost in accelerations, over a step


class Buffer(NamedTuple):
    """Steps in a row, or room for them, m: states at their ends and changes at their stages."""

    times: FloatArray  # (m + 1,)
    states: FloatArray  # (m + 1, size)
    changes: FloatArray  # (m, s, size)
    places: FloatArray  # (m + 1,) of P on the piece


@inlined
def shortest_step(t: float) -> float:
    """Least step at t, s."""
    return max(SHORTEST, CLOCK * t)


@inlined
def longest_step(
    at: tuple[float, FloatArray, float], free: int, mode: Mode, control: Control
) -> float:
    """Limit of a step from t and the state y that shall be `wanted` long, s."""
    t, y, wanted = at
    speed = abs(guide_at(t, y, free, mode)[1])
    if mode.drive[0] != 0.0:  # fastest at the step's end, as a ramp only rises
        speed = abs(guide_at(t + wanted, y, free, mode)[1])
    return control.turn / speed if speed > 0.0 else np.inf


@inlined
def change_of_step(
    h: float, error: float, iterations: int, going_on: bool, memory: FloatArray
) -> float:
    """How much longer the next step may be, by the error in parts of the tolerance.

    `going_on` tells that the step before was of the same equations.
    """
    safety = SAFETY * (2 * ITERATIONS + 1) / (2 * ITERATIONS + iterations)
    before = memory[OLD_STEP] if going_on else 0.0
    return float(step_growth(error, safety, h, (before, memory[OLD_ERROR])))

"""Which functions compiled ones call by address, of a mechanism: without walls, none of walls.

What a scene does not have is then not compiled for it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from exudyn_flexlink.arrays import FloatArray, IntArray
from exudyn_flexlink.engines.lagrangian import absent, walls
from exudyn_flexlink.engines.lagrangian.compiled import by_address, compiling
from exudyn_flexlink.engines.lagrangian.equation_functions import (
    EquationFunctions,
    equation_functions,
)
from exudyn_flexlink.engines.lagrangian.equations import accelerations
from exudyn_flexlink.engines.lagrangian.event_functions import uneventful
from exudyn_flexlink.engines.lagrangian.force_jumps import force_jumps
from exudyn_flexlink.engines.lagrangian.knots import after_step, before_step
from exudyn_flexlink.engines.lagrangian.mode import rate_at
from exudyn_flexlink.engines.lagrangian.signatures import equation_signatures, step_signatures
from exudyn_flexlink.engines.lagrangian.step_functions import StepFunctions, step_functions
from exudyn_flexlink.engines.lagrangian.stiffness import slopes
from exudyn_flexlink.engines.lagrangian.track_point import TrackPoint, has_knots
from exudyn_flexlink.engines.lagrangian.wall_events import change_within
from exudyn_flexlink.mechanism import Mechanism

Placed = tuple[FloatArray, FloatArray, TrackPoint]


def own_functions(mechanism: Mechanism) -> list[Callable[..., Any]]:
    """Functions that not every mechanism has compiled: those of its walls, and of knots."""
    own: list[Callable[..., Any]] = []
    if mechanism.channels:
        own += [_add_wall_forces, change_within]
    if any(has_knots(slot.curve) for slot in mechanism.slots):
        own.append(before_step)
    return own


@cache
def equation_functions_for(walled: bool) -> EquationFunctions:
    """Functions of equations of motion with walls, or without."""
    functions = equations_with(walled)
    if not compiling():
        return functions
    signatures = equation_signatures()
    return equation_functions(*map(by_address, functions, signatures))


@cache
def step_functions_for(walled: bool, knots: bool) -> StepFunctions:
    """Functions that steps ask of a mechanism: with walls, with knots in its track, or without."""
    functions = steps_with(walled, knots)
    if not compiling():
        return functions
    return step_functions(*map(by_address, functions, step_signatures()))


def equations_with(walled: bool) -> EquationFunctions:
    """Python's functions of equations of motion."""
    if not walled:
        wall_slopes = absent.wall_slopes
        return EquationFunctions(
            accelerations, absent.forces, wall_slopes, wall_slopes, absent.depths
        )
    return EquationFunctions(
        accelerations,
        _add_wall_forces,
        walls.take_wall_slopes,
        walls.add_wall_slopes,
        _depths_squared,
    )


def steps_with(walled: bool, knots: bool) -> StepFunctions:
    """Python's functions that steps ask of a mechanism."""
    before, after = (before_step, after_step) if knots else (absent.before_step, absent.after_step)
    change = change_within if walled else absent.change_within
    return StepFunctions(rate_at, slopes, force_jumps, before, after, change, uneventful)


def _add_wall_forces(
    state: Placed, touching: IntArray, chain: walls.Chain, right: FloatArray
) -> float:
    return walls.add_wall_forces(state, touching, chain, right)


def _depths_squared(
    q: FloatArray, v: FloatArray, point: TrackPoint, touching: IntArray, chain: walls.Chain
) -> float:
    return walls.depths_squared(q, v, point, touching, chain)

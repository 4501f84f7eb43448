"""Which functions compiled ones call by address, of a mechanism: without walls, none of walls.

What a scene does not have is then not compiled for it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IntArray
from exudyn_flexlink.engines.lagrangian import absent, walls
from exudyn_flexlink.engines.lagrangian.compiled import (
    by_address,
    compiling,
    numba,
    type_of,
    type_returned,
)
from exudyn_flexlink.engines.lagrangian.constants import unpacked
from exudyn_flexlink.engines.lagrangian.equation_functions import (
    EquationFunctions,
    equation_functions,
)
from exudyn_flexlink.engines.lagrangian.equations import Drive, State, accelerations
from exudyn_flexlink.engines.lagrangian.event_functions import EventData, uneventful
from exudyn_flexlink.engines.lagrangian.force_jumps import force_jumps
from exudyn_flexlink.engines.lagrangian.knots import after_step, before_step
from exudyn_flexlink.engines.lagrangian.lengths import scale_at
from exudyn_flexlink.engines.lagrangian.mode import Instant, Mode, equations_of, rate_at
from exudyn_flexlink.engines.lagrangian.step_functions import StepFunctions, step_functions
from exudyn_flexlink.engines.lagrangian.stiffness import slopes
from exudyn_flexlink.engines.lagrangian.track_point import TrackPoint, has_knots
from exudyn_flexlink.engines.lagrangian.wall_events import Step, change_within
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
    forces, gives, presses, depths = (
        (_add_wall_forces, walls.take_wall_slopes, walls.add_wall_slopes, _depths_squared)
        if walled
        else (absent.forces, absent.wall_slopes, absent.wall_slopes, absent.depths)
    )
    if not compiling():
        return EquationFunctions(accelerations, forces, gives, presses, depths)
    number, line, square, numbers = _arrays()
    assert numba is not None
    types: Any = numba.types
    point = types.UniTuple(number, 6)
    placed, chain = types.Tuple((line, line, point)), types.Tuple((line, number, line, line))
    forces = by_address(forces, number, placed, numbers, chain, line)
    holding = types.Tuple((numbers, numbers, type_of(forces)))
    return equation_functions(
        by_address(
            accelerations,
            types.Tuple((line, number, line, line, number)),
            types.NamedTuple((line, line, point), State),
            types.NamedTuple((types.int64, number, line), Drive),
            holding,
            type_returned(unpacked, line),
        ),
        forces,
        by_address(gives, types.none, placed, numbers, chain, square),
        by_address(presses, types.none, placed, square, chain, types.UniTuple(square, 2)),
        by_address(depths, number, line, line, point, numbers, chain),
    )


def step_functions_for(mode: Mode, event_data: EventData, knots: bool) -> StepFunctions:
    """Functions that steps ask of a mechanism of this mode: with knots in its track, or without."""
    walled = len(mode.touching) > 0
    if not compiling():
        return _step_functions(None, walled, knots)
    return _step_functions((type_of(mode), type_of(event_data)), walled, knots)


@cache
def _step_functions(known: tuple[Any, Any] | None, walled: bool, knots: bool) -> StepFunctions:
    before, after = (before_step, after_step) if knots else (absent.before_step, absent.after_step)
    change = change_within if walled else absent.change_within
    if known is None:
        return StepFunctions(rate_at, slopes, force_jumps, before, after, change, uneventful)
    number, line, square, _ = _arrays()
    assert numba is not None
    types: Any = numba.types
    mode, event_data = known
    equations = type_returned(equations_of, mode)
    instant = types.NamedTuple((number, line, number), Instant)
    step = types.NamedTuple((instant, number, square, square), Step)
    changed = types.Tuple((number, types.int64))
    scale = type_returned(scale_at, instant, equations, line)
    given = types.Tuple((line, number, line))
    at_knots = (number, given, types.Tuple((equations, scale)), types.Tuple((line, square)))
    stages = types.Tuple((square, line, line, square, square))
    squares = types.UniTuple(square, 2)
    return step_functions(
        by_address(rate_at, changed, instant, equations, line, line),
        by_address(slopes, squares, instant, square, equations),
        by_address(
            force_jumps, types.Tuple((square, line)), instant, number, square, equations, stages
        ),
        by_address(before, number, instant, *at_knots),
        by_address(after, number, types.UniTuple(instant, 2), *at_knots),
        by_address(change, changed, types.int64, step, equations),
        by_address(uneventful, types.boolean, instant, instant, squares, equations, event_data),
    )


class _Arrays(NamedTuple):
    number: Any
    line: Any
    square: Any
    numbers: Any


def _arrays() -> _Arrays:
    """Types of a number, of arrays of them in one and two dimensions, and of integers in one."""
    line = type_of(np.zeros(1))
    return _Arrays(line.dtype, line, type_of(np.zeros((1, 1))), type_of(np.zeros(1, np.int64)))


def _add_wall_forces(
    state: Placed, touching: IntArray, chain: walls.Chain, right: FloatArray
) -> float:
    return walls.add_wall_forces(state, touching, chain, right)


def _depths_squared(
    q: FloatArray, v: FloatArray, point: TrackPoint, touching: IntArray, chain: walls.Chain
) -> float:
    return walls.depths_squared(q, v, point, touching, chain)

"""Which functions compiled ones call by address.

Those of a mechanism without walls are none of walls: what a scene does not have is then not
compiled for it. Those of the method are compiled by one process while another is at work on the
steps that call them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from exudyn_flexlink.engines.lagrangian import absent, walls
from exudyn_flexlink.engines.lagrangian.compiled import by_address, compiling
from exudyn_flexlink.engines.lagrangian.equations import accelerations
from exudyn_flexlink.engines.lagrangian.event_functions import uneventful
from exudyn_flexlink.engines.lagrangian.force_jumps import force_jumps
from exudyn_flexlink.engines.lagrangian.knots import after_step, before_step
from exudyn_flexlink.engines.lagrangian.mode import rate_at
from exudyn_flexlink.engines.lagrangian.radau import factor, iterate
from exudyn_flexlink.engines.lagrangian.signatures import equation_signatures, step_signatures
from exudyn_flexlink.engines.lagrangian.stiffness import slopes
from exudyn_flexlink.engines.lagrangian.track_point import has_knots
from exudyn_flexlink.engines.lagrangian.wall_events import change_within
from exudyn_flexlink.mechanism import Mechanism


def own_functions(mechanism: Mechanism) -> list[Callable[..., Any]]:
    """Functions that not every mechanism has compiled: those of its walls, and of knots."""
    own: list[Callable[..., Any]] = []
    if mechanism.channels:
        own += [walls.add_wall_forces, change_within]
    if any(has_knots(slot.curve) for slot in mechanism.slots):
        own.append(before_step)
    return own


@cache
def equation_functions_for(walled: bool) -> list[Callable[..., Any]]:
    """Functions of equations of motion with walls, or without: the last fields of a `Mode`."""
    functions = equations_with(walled)
    if not compiling():
        return functions
    return list(map(by_address, functions, equation_signatures()))


@cache
def step_functions_for(walled: bool, knots: bool) -> list[Callable[..., Any]]:
    """Functions that steps of a mechanism call: with walls, with knots in its track, or without.

    They are the last fields of `Means`.
    """
    functions = steps_with(walled, knots)
    if not compiling():
        return functions
    return list(map(by_address, functions, step_signatures()))


def equations_with(walled: bool) -> list[Callable[..., Any]]:
    """Python's functions of equations of motion."""
    if not walled:
        wall_slopes = absent.wall_slopes
        return [accelerations, absent.forces, wall_slopes, wall_slopes, absent.depths]
    return [
        accelerations,
        walls.add_wall_forces,
        walls.take_wall_slopes,
        walls.add_wall_slopes,
        walls.depths_squared,
    ]


def steps_with(walled: bool, knots: bool) -> list[Callable[..., Any]]:
    """Python's functions that steps of a mechanism call."""
    before, after = (before_step, after_step) if knots else (absent.before_step, absent.after_step)
    change = change_within if walled else absent.change_within
    return [change, factor, iterate, rate_at, slopes, force_jumps, before, after, uneventful]

"""Which functions compiled ones call by address.

Those of a mechanism without walls are none of walls, and where a link has play nothing looks where
the guide's axis crosses the track: what a scene does not have is then not compiled for it. Those of
the method are compiled by one process while another is at work on the steps that call them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

from exudyn_flexlink.engines.lagrangian import absent, walls
from exudyn_flexlink.engines.lagrangian.compiled import by_address, compiling
from exudyn_flexlink.engines.lagrangian.equations import accelerations
from exudyn_flexlink.engines.lagrangian.event_functions import uneventful
from exudyn_flexlink.engines.lagrangian.force_jumps import force_jumps
from exudyn_flexlink.engines.lagrangian.knots import after_step
from exudyn_flexlink.engines.lagrangian.mode import rate_at
from exudyn_flexlink.engines.lagrangian.radau import factor, iterate
from exudyn_flexlink.engines.lagrangian.signatures import equation_signatures, step_signatures
from exudyn_flexlink.engines.lagrangian.stiffness import slopes
from exudyn_flexlink.engines.lagrangian.track_point import cross, has_knots
from exudyn_flexlink.engines.lagrangian.wall_events import change_within
from exudyn_flexlink.mechanism import Mechanism


class Kind(NamedTuple):
    """What a mechanism may have: only then is it compiled."""

    walls: bool
    play: bool  # of the link in its guide: then P's place is a coordinate, and is not looked for
    knots: bool  # of the track


def kind_of(mechanism: Mechanism) -> Kind:
    """Tell what a mechanism has."""
    knots = any(has_knots(slot.curve) for slot in mechanism.slots)
    return Kind(bool(mechanism.channels), mechanism.has_play, knots)


@cache
def equation_functions_for(kind: Kind) -> list[Callable[..., Any]]:
    """Functions of equations of motion: the last fields of a `Mode`."""
    return _called(equations_with(kind), equation_signatures)


@cache
def step_functions_for(kind: Kind) -> list[Callable[..., Any]]:
    """Functions that steps of a mechanism call: the last fields of `Means`."""
    return _called(steps_with(kind), step_signatures)


def _called(
    functions: list[Callable[..., Any]], signatures: Callable[[], tuple[Any, ...]]
) -> list[Callable[..., Any]]:
    """Functions as compiled ones call them: by address, where anything is compiled."""
    return list(map(by_address, functions, signatures())) if compiling() else functions


def equations_with(kind: Kind) -> list[Callable[..., Any]]:
    """Python's functions of equations of motion."""
    found = absent.cross if kind.play else cross
    if not kind.walls:
        wall_slopes = absent.wall_slopes
        return [found, accelerations, absent.forces, wall_slopes, wall_slopes, absent.depths]
    return [
        found,
        accelerations,
        walls.add_wall_forces,
        walls.take_wall_slopes,
        walls.add_wall_slopes,
        walls.depths_squared,
    ]


def steps_with(kind: Kind) -> list[Callable[..., Any]]:
    """Python's functions that steps of a mechanism call."""
    after = after_step if kind.knots else absent.after_step
    change = change_within if kind.walls else absent.change_within
    return [change, factor, iterate, rate_at, slopes, force_jumps, after, uneventful]

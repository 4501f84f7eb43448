"""What functions that are called by address find where a mechanism has no walls, or no knots.

Where the link has play P's place is a coordinate: nobody asks where the axis crosses the track.

Arguments are those of the functions whose place they take, named in `addresses`.
"""

from __future__ import annotations

from math import nan
from typing import Any

from exudyn_flexlink.engines.lagrangian.track_point import MISSES, TrackPoint
from exudyn_flexlink.engines.lagrangian.wall_events import NONE


def cross(piece: Any, centre: Any, theta: float, near: float) -> tuple[float, TrackPoint, int]:  # noqa: ARG001
    """Nothing: no place, and a search that missed."""
    return near, (nan, nan, nan, nan, nan, nan), MISSES


def forces(state: Any, touching: Any, c: Any, right: Any) -> float:  # noqa: ARG001
    """Power that walls take, W."""
    return 0.0


def wall_slopes(state: Any, of: Any, c: Any, into: Any) -> None:
    """Add nothing."""


def depths(q: Any, v: Any, point: Any, touching: Any, c: Any) -> float:  # noqa: ARG001
    """Sum of the squares of depths, m^2."""
    return 0.0


def after_step(ends: Any, h: float, given: Any, known: Any, method: Any) -> float:  # noqa: ARG001
    """Part of a step that is good."""
    return 1.0


def change_within(pair: int, step: Any, equations: Any) -> tuple[float, int]:  # noqa: ARG001
    """Part of a step, and the pair that changes there."""
    return 1.0, NONE

"""What rounding leaves of positions: no run can be more accurate."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, floor, log10

import numpy as np

from exudyn_flexlink.mechanism.assembly import Assembly

# Roundings of a position at the mechanism's extent. Over two turns of the paper's mechanism with
# its strikes, tree and Lagrangian stay 1.5e-13 m apart however small the tolerance, 4000 of them
# (`scripts/rounding.py`); without a strike 4e-15 m, from where on steps are as short as can be.
ROUNDINGS = 5e3
NO_SMALL_PART = 0.1  # of what a mechanism reaches: an error that hides how it moves


def extent(assembly: Assembly) -> float:
    """Distance (m) from the origin of coordinates to the farthest point, at the start."""
    q = assembly.state.q
    reaches = [part.reach for part in assembly.mechanism.parts]
    return float((np.hypot(q[:, 0], q[:, 1]) + reaches).max())


def least_tolerance(assembly: Assembly) -> float:
    """Least error in positions (m) that a run can be asked for, rounded up to one digit."""
    least = ROUNDINGS * float(np.finfo(float).eps) * extent(assembly)
    power = floor(log10(least))
    return float(f"{ceil(least / 10.0**power)}e{power}")


def coarse_tolerance(assembly: Assembly, asked: float | None) -> Iterator[str]:
    """Say that a tolerance (m) that was asked for is no small part of the mechanism."""
    if asked is not None and asked > NO_SMALL_PART * extent(assembly):
        yield (
            f"the tolerance of {asked:.3g} m is no small part of the mechanism, which reaches "
            f"{extent(assembly):.3g} m; is a unit missing, as in '1 um'?"
        )

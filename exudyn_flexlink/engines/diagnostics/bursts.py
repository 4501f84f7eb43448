"""Bursts of strikes: whether two runs bounced alike, so that their distance tells an error."""

from __future__ import annotations

from math import inf

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.diagnostics.releases import releases
from exudyn_flexlink.measured_error import MeasuredError
from exudyn_flexlink.result import Result


def alike_by_chance(run: Result, neighbour: Result, error: MeasuredError) -> bool:
    """Tell whether both runs may be wrong although they are near each other.

    Errors of neighbours are in proportion only while they bounce alike. Once each strikes at other
    instants, both are wrong by about the size of the bounces. A lasting contact brings them near
    each other again, but a point that creeps off the face then multiplies what is left of the error
    of either (see `Release.growth`), of which their distance tells nothing.
    """
    if error.missing or error.exceeds_from is not None:
        return False
    grown, released = 1.0, releases(run)
    for name, contact in run.contacts.items():
        if name not in neighbour.contacts:
            continue
        parted = bounced_apart(contact.touches.begin, neighbour.contacts[name].touches.begin)
        after = [own.growth for own in released if own.contact == name and own.time > parted]
        grown = max(grown, *after, 1.0)
    return grown > 1 and grown * error.largest > error.limit


def bounced_apart(first: FloatArray, second: FloatArray) -> float:
    """Time (s) of the first strike of a run (K,) that another run (L,) has no counterpart of.

    Counterparts have one number, and are nearer than half the time to the strikes before and after.
    Infinite if each has its own, and none is left over.
    """
    both = min(len(first), len(second))
    between = np.diff(first, prepend=-inf, append=inf)
    nearest = np.minimum(between[:-1], between[1:])
    off = np.flatnonzero(np.abs(first[:both] - second[:both]) > nearest[:both] / 2)
    if len(off):
        return float(first[off[0]])
    left = first if len(first) > both else second
    return float(left[both]) if len(left) > both else inf

"""What two runs share, they can't tell: so the coarser one starts off by what rounding may be.

Where flights are exact, both runs make the same rounding, and find events equally late: their
distance is zero while the truth goes away from both, tenfold from one round pin to the next.
"""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import Assembly, extent

ROUNDING = 1e-15  # of the mechanism's extent: about what the sums of a run round a place by
SMALL = 1e-3  # of the largest length: what moves by less is no lever arm
LATE = 1e-14  # s: about how exactly an event is located; what happens there happens a little later


def seeded(
    assembly: Assembly, start: tuple[FloatArray, FloatArray], lengths: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Coordinates and speeds (n,) at time 0, off by rounding; signs and sizes differ.

    A unit of each coordinate moves a point by `lengths` (n,) m. What rests still rests.
    """
    q, v = start
    number = np.arange(len(q))
    ways = ROUNDING * (-1.0) ** number * (1 + number / (1 + len(q)))
    lengths = np.maximum(lengths, SMALL * lengths.max(initial=1.0))
    return q + extent(assembly) * ways / lengths, v * (1 + ways)

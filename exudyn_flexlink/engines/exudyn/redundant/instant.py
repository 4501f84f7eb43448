"""The state at the end of one step, as the loop hands it on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Instant:
    """Time (s), length of the step that ended there (s), coordinates and velocities.

    `q` and `v` are the solver's coordinates; the lists hold those of all parts, one after the
    other, for code that needs a few of them fast.
    """

    time: float
    done: float
    q: NDArray[np.float64]
    v: NDArray[np.float64]
    q_list: list[float]
    v_list: list[float]

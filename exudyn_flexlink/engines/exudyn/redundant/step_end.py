"""The state at the end of one step, as the solver's loop hands it on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class StepEnd:
    """Time (s), length of the step that ended there (s), coordinates and velocities.

    `q` and `v` are the solver's coordinates; `q_list` and `v_list` those of all parts, one after
    the other: plain lists are faster where a few numbers are needed.
    """

    time: float
    step: float
    q: NDArray[np.float64]
    v: NDArray[np.float64]
    q_list: list[float]
    v_list: list[float]

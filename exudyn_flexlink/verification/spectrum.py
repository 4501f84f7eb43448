"""Lines in the spectrum of a sampled motion."""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

FloatArray = NDArray[np.float64]

GRID = 8  # trial frequencies for each one over the length of the record: a peak is 4 / T wide


def strongest_line(time: FloatArray, signal: FloatArray, lowest: float, highest: float) -> float:
    """Angular frequency (rad/s) between two at which a record has its strongest line.

    `time` (N,) s is even. Hann's window keeps other lines away: at a distance of k / T, for a
    record of T seconds, they count by 1 / k^3.
    """
    shape = (signal - signal.mean()) * np.hanning(len(signal))
    length = float(time[-1] - time[0])

    def weakness(omega: float) -> float:
        return -float(np.abs(np.exp(-1j * omega * time) @ shape))

    trial = np.linspace(lowest, highest, 2 + int(GRID * (highest - lowest) * length / (2 * pi)))
    best = trial[int(np.argmin([weakness(omega) for omega in trial]))]
    near = 2 * pi / (GRID * length)
    bounds = max(lowest, best - near), min(highest, best + near)
    found = minimize_scalar(
        weakness, bounds=bounds, method="bounded", options={"xatol": 1e-9 * best}
    )
    return float(found.x)

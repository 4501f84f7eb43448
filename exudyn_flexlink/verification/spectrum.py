"""Lines in the spectrum of a sampled motion."""

from __future__ import annotations

from math import pi

import numpy as np

from exudyn_flexlink.arrays import FloatArray

GRID = 8  # trial frequencies for each one over the length of the record: a peak is 4 / T wide
NARROWER = 8  # points to each side of the best, in each of
ZOOMS = 8  # steps that narrow the search as many times: to a part 1e-7 of the grid


def strongest_line(time: FloatArray, signal: FloatArray, lowest: float, highest: float) -> float:
    """Angular frequency (rad/s) between two at which a record has its strongest line.

    `time` (N,) s is even. Hann's window keeps other lines away: at a distance of k / T, for a
    record of T seconds, they count by 1 / k^3.
    """
    shape = (signal - signal.mean()) * np.hanning(len(signal))

    def strength(omega: float) -> float:
        return float(np.abs(np.exp(-1j * omega * time) @ shape))

    length = float(time[-1] - time[0])
    trial = np.linspace(lowest, highest, 2 + int(GRID * (highest - lowest) * length / (2 * pi)))
    best, width = max(trial, key=strength), float(trial[1] - trial[0])
    for _ in range(ZOOMS):
        near = np.linspace(best - width, best + width, 2 * NARROWER + 1)
        best = max(np.clip(near, lowest, highest), key=strength)
        width /= NARROWER
    return float(best)

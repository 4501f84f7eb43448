"""Errors of speeds that last: what swings slowly, or moves freely, makes places of them."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from exudyn_flexlink.arrays import FloatArray

PART = 0.1  # of 1/omega: errors of steps fall on all phases of a swing
FREELY = 0.3  # of the run: what moves freely keeps an error of its speed for half of it on average


def slow_motions(mass: FloatArray, stiffness: FloatArray, end: float, least: float) -> FloatArray:
    """Matrix (n, n) from errors of speeds to those of places that slow motions make of them, s.

    A mode of angular frequency omega turns an error of its speed into one of place within 1/omega,
    a motion without springs until the end of the run (s). Of both a part counts, since errors of
    steps fall on all phases and all instants. Motions that do so in less than `least` (s) are none.
    """
    if not len(mass):
        return np.zeros((0, 0))
    squares, modes = eigh(stiffness, mass)
    free = squares <= end**-2
    times = np.where(free, FREELY * end, PART / np.sqrt(np.where(free, 1.0, squares)))
    return np.asarray((modes * np.where(times > least, times, 0.0)) @ modes.T @ mass)

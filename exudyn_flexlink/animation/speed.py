"""How fast a film plays: seconds of the run in a second of the film."""

from __future__ import annotations

from math import log10

import numpy as np

from exudyn_flexlink.animation.film import Film
from exudyn_flexlink.observables import crank_angle, turns

SECONDS = 9.0  # of a film
OF_A_TURN = 3.0  # s: a crank that goes round faster can't be followed by the eye
SLOW_SECONDS = 4.0  # of a film, that a stretch of slow motion lasts
STEPS = (1.0, 2.0, 5.0, 10.0)  # of speeds, in each power of ten


def usual_speed(film: Film) -> float:
    """Return the speed at which a film is seen best, a round number.

    It lasts some seconds, and longer where a crank makes many turns.
    """
    result = film.takes[0].result
    seconds = SECONDS
    if turns(result):
        angle = np.interp([film.begin, film.end], result.time, crank_angle(result))
        seconds = max(seconds, OF_A_TURN * float(abs(angle[1] - angle[0])) / (2 * np.pi))
    return rounded((film.end - film.begin) / seconds)


def rounded(speed: float) -> float:
    """The speed of 1, 2 or 5 times a power of ten that is nearest."""
    power = 10.0 ** np.floor(log10(speed))
    nearest = min(STEPS, key=lambda step: abs(log10(step * power / speed)))
    return float(f"{nearest * power:.0e}")

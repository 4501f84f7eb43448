"""How long a run can be trusted instant by instant, and what holds of it afterwards.

Two neighbouring runs, of one scene and engine but other tolerances, part exponentially where
impacts are sensitive. Up to the horizon S is known pointwise; beyond it what both runs share is the
statistics: scatter, extremes, spectra, parts of the time in contact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import detrend, welch

from exudyn_flexlink.compare import common_times, horizon, parting_limit, separation
from exudyn_flexlink.observables import (
    State,
    between_samples,
    contact_states,
    lever_response,
    path,
    sleeves_with_play,
    struck_bodies,
    watched_point,
)
from exudyn_flexlink.result import Result

FloatArray = NDArray[np.float64]

FIT_DECADES = 4  # below the limit: where the parting is fitted
SEGMENTS = 4  # of the run, averaged for its spectrum


@dataclass(frozen=True)
class RunStatistics:
    """A run as a whole: what neighbouring runs must share.

    `rms` (2,) m is the scatter of S about a smooth path, `strongest` (2,) Hz the frequency at which
    its coordinates vibrate most; `levers` are the least and greatest angle of struck bodies, rad;
    `contact` the parts of the time in each state, by sleeve.
    """

    rms: FloatArray
    strongest: FloatArray
    levers: dict[str, tuple[float, float]]
    contact: dict[str, dict[State, float]]


@dataclass(frozen=True)
class Sensitivity:
    """Two neighbouring runs: `horizon` (s) is where S differs by more than `limit` (m) first.

    None if it never does. `growth` (1/s) is the rate of the exponential parting before it, None if
    there is nothing to fit; `largest` (m) the largest difference, `end` (s) the end of both.
    """

    point: str
    limit: float
    end: float
    horizon: float | None
    growth: float | None
    largest: float
    first: RunStatistics
    second: RunStatistics


def sensitivity(first: Result, second: Result, limit: float | None = None) -> Sensitivity:
    """Compare neighbouring runs; `limit` (m) left out: see `compare.parting_limit`."""
    limit = parting_limit(first) if limit is None else limit
    time = common_times(first, second)
    apart = separation(first, second, time)
    found = horizon(first, second, limit)
    return Sensitivity(
        watched_point(first.scene),
        limit,
        float(time[-1]),
        found,
        growth_rate(time, apart, limit),
        float(apart.max()),
        run_statistics(first),
        run_statistics(second),
    )


def growth_rate(time: FloatArray, apart: FloatArray, limit: float) -> float | None:
    """Rate (1/s) at which a separation (N,) m grows until it first exceeds the limit.

    A straight line through the logarithm of its running maximum over the last decades before; None
    if it does not grow by one decade there.
    """
    largest = np.maximum.accumulate(apart)
    inside = (largest > limit * 10.0**-FIT_DECADES) & (largest <= limit)
    if inside.sum() < 3 or largest[inside][-1] < 10 * largest[inside][0]:
        return None
    return float(np.polyfit(time[inside], np.log(largest[inside]), 1)[0])


def run_statistics(result: Result) -> RunStatistics:
    """Statistics of a whole run."""
    scene = result.scene
    time = common_times(result, result)
    seen = path(result, watched_point(scene))
    position = between_samples(seen.time, seen.position, seen.velocity, time)
    ripple = _ripple(position)
    levers = {body: lever_response(result, c) for body, c in struck_bodies(scene).items()}
    return RunStatistics(
        np.sqrt(np.mean(ripple**2, axis=0)),
        np.array([_strongest(time, column) for column in ripple.T]),
        {body: (seen.least[0], seen.greatest[0]) for body, seen in levers.items()},
        {joint: contact_states(result, joint).fractions() for joint in sleeves_with_play(result)},
    )


def _ripple(position: FloatArray) -> FloatArray:
    """What is left of a path (N, 2) without its slow parts: a mean over a fortieth of the run."""
    width = max(3, len(position) // 40 | 1)
    if len(position) < 2 * width:
        return np.asarray(detrend(position, axis=0))
    kernel = np.ones(width) / width
    slow = np.stack([np.convolve(c, kernel, mode="valid") for c in position.T], axis=1)
    edge = width // 2
    return np.asarray(position[edge : len(position) - edge] - slow)


def _strongest(time: FloatArray, values: FloatArray) -> float:
    """Frequency (Hz) of the highest line of a spectrum; 0 for a motion without any."""
    if len(values) < 16 or not np.ptp(values):
        return 0.0
    frequencies, power = welch(values, 1 / (time[1] - time[0]), nperseg=len(values) // SEGMENTS)
    return float(frequencies[int(np.argmax(power))])

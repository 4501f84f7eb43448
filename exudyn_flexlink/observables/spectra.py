"""The spectrum of a sampled motion, and the lines in it."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from exudyn_flexlink.arrays import FloatArray

SEGMENT = 0.5  # of the record: the spectrum's segments, which overlap by half
MOST_LINES = 3
WEAK = 0.01  # of the strongest line's power: weaker ones are not named
GRID = 8  # trial frequencies for each one over the length of the record: a peak is 4 / T wide
NARROWER = 8  # points to each side of the best, in each of
ZOOMS = 8  # steps that narrow the search as many times: to a part 1e-7 of the grid
FEWEST = 32  # samples of a spectrum


@dataclass(frozen=True)
class Spectrum:
    """Power by frequency: `frequency` (K,) Hz, `power` (K,) unit^2/Hz, by Welch's method.

    `lines` (Hz) are its highest peaks, strongest first, told to +- half of `resolution` (Hz). All
    is empty where the record is too short, or still.
    """

    frequency: FloatArray
    power: FloatArray
    lines: tuple[float, ...]
    resolution: float


def spectrum(time: FloatArray, values: FloatArray) -> Spectrum:
    """Spectrum of values (N,) at even instants (N,) s; the last, the run's end, may be uneven."""
    # scipy takes a second to import, which `check` should not wait for
    from scipy.signal import find_peaks, welch  # noqa: PLC0415

    resolution = resolution_of(time)
    values = values[:-1]
    if len(values) < FEWEST or not np.ptp(values):
        return Spectrum(np.zeros(0), np.zeros(0), (), resolution)
    count = int(SEGMENT * len(values))
    frequencies, power = welch(values, 1 / (time[1] - time[0]), nperseg=count)
    peaks, _ = find_peaks(power, height=WEAK * power.max())
    strongest = peaks[np.argsort(power[peaks])[::-1][:MOST_LINES]]
    return Spectrum(frequencies, power, tuple(frequencies[strongest].tolist()), resolution)


def resolution_of(time: FloatArray) -> float:
    """Distance (Hz) of the frequencies of a spectrum of even instants (N,) s."""
    count = max(1, int(SEGMENT * len(time)))
    return float(1 / (count * (time[1] - time[0]))) if len(time) > 1 else np.inf


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

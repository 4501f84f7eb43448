"""A run held against a measured series at the series' instants, with a shift of its clock.

Times in s, other numbers in SI; M is the number of rows of the series, N of those that lie within
the run.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray
from exudyn_flexlink.fitting.series import Series
from exudyn_flexlink.result import Result

MOST_SHIFTS = 4000  # that are tried before the best one is refined
NEAR = 1e-9  # of a run's length: rounding at its ends
FEWEST = 3  # rows within the run, of a series that has so many: fewer tell of a wrong unit or clock
_HINT = (
    "hint: the header of the time may name its unit, such as 't (ms)'; '--shift', in Python "
    "shift=, is added to times"
)


class NoOverlapError(ValueError):
    """The run and the series have no time, or too little of it, in common."""


@dataclass(frozen=True)
class Distance:
    """How far a run is from a series in one quantity: `largest`, at `at` (s of the run), and rms.

    `span` is the greatest less the least value that was measured.
    """

    signal: str
    unit: str
    largest: float
    at: float
    rms: float
    span: float


@dataclass(frozen=True)
class Against:
    """A run beside a series, whose rows are at `shift` (s) plus their own time in the run.

    `time` (N,) are instants of the run, `computed` and `measured` (N,) are by quantity; `outside`
    rows are not within the run.
    """

    result: Result
    series: Series
    shift: float
    time: FloatArray
    computed: Mapping[str, FloatArray]
    measured: Mapping[str, FloatArray]
    outside: int

    @property
    def differences(self) -> dict[str, FloatArray]:
        """Computed less measured values (N,) by quantity."""
        return {name: self.computed[name] - own for name, own in self.measured.items()}

    @property
    def distances(self) -> list[Distance]:
        """How far both are apart, by quantity.

        Up to the run's horizon, beyond which it is not known instant by instant; none before it.
        """
        judged = self.time < self.result.error.known_until
        found = []
        for name, apart in self.differences.items() if judged.any() else ():
            size, unit = np.abs(apart[judged]), self.series.signals[name].unit
            worst, rms = int(size.argmax()), float(np.sqrt(np.mean(size**2)))
            at, span = float(self.time[judged][worst]), float(np.ptp(self.measured[name]))
            found.append(Distance(name, unit, float(size[worst]), at, rms, span))
        return found


def against(result: Result, series: Series, shift: float | str = 0.0) -> Against:
    """Hold a run against a series, whose times are shifted (s); 'find' looks for the shift.

    That one is taken that makes the mean of the squared differences least, each quantity as a part
    of its own spread, of those that leave half the rows or more within the run.

    Raises:
        NoOverlapError: too few rows lie within the run.

    """
    shift = _best_shift(result, series) if isinstance(shift, str) else shift
    rows = _within(result, series.time + shift)
    count = int(rows.sum())
    if count < min(FEWEST, len(rows)):
        (begin, end), (first, last) = result.time[[0, -1]], series.time[[0, -1]] + shift
        few = f"only {count} of {len(rows)} rows of {series.source} lie"
        few = few if count else f"no row of {series.source} lies"
        raise NoOverlapError(
            f"{few} within the run: it goes from {begin:.6g} to {end:.6g} s, the rows from "
            f"{first:.6g} to {last:.6g} s\n{_HINT}"
        )
    time = series.time[rows] + shift
    computed = {name: signal.at(result, time) for name, signal in series.signals.items()}
    measured = {name: own[rows] for name, own in series.values.items()}
    return Against(result, series, shift, time, computed, measured, len(rows) - count)


def _within(result: Result, time: FloatArray) -> BoolArray:
    """Which instants lie within a run; both ends count."""
    begin, end = result.time[[0, -1]]
    near = NEAR * (end - begin)
    return np.asarray((time >= begin - near) & (time <= end + near))


def _best_shift(result: Result, series: Series) -> float:
    """Return the shift (s) that fits best; of those that fit alike the smallest."""
    from scipy.optimize import minimize_scalar  # noqa: PLC0415 - takes a second, which `check` saves

    time, (begin, end) = series.time, result.time[[0, -1]].tolist()
    needed = max(len(time) // 2, 2)
    if time[-1] <= time[0] or end <= begin:
        raise NoOverlapError("a shift needs a series and a run that last")

    def mean_square(shift: float) -> float:
        rows = _within(result, time + shift)
        if rows.sum() < needed:
            return np.inf
        return sum(
            float(np.mean((series.signals[name].at(result, time[rows] + shift) - own[rows]) ** 2))
            / (np.var(own) or 1.0)
            for name, own in series.values.items()
        )

    # Between these ends so many rows can be in the run: the last ones, or the first.
    low, high = begin - float(time[-needed]), end - float(time[needed - 1])
    step = max(float(np.median(np.diff(np.unique(time)))) / 2, (high - low) / MOST_SHIFTS)
    tried = np.arange(np.floor(low / step), np.ceil(high / step) + 1) * step  # 0 among them
    best = float(min(sorted(tried.tolist(), key=abs), key=mean_square))
    if not np.isfinite(mean_square(best)):
        raise NoOverlapError(f"no shift leaves half the rows within the run\n{_HINT}")
    around = (best - step, best + step)
    found = minimize_scalar(
        mean_square, bounds=around, method="bounded", options={"xatol": 1e-9 * step}
    )
    return float(found.x) if found.fun <= mean_square(best) else best

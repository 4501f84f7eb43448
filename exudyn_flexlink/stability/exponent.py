"""The largest Lyapunov exponent, by neighbours that are renormalised: any flow, any engine.

A neighbour starts a small distance away. Stretch by stretch it moves, the logarithm of what the
distance has grown by is kept, and it is put back, in the direction it has, at the first distance:
G. Benettin, L. Galgani and J.-M. Strelcyn, Kolmogorov entropy and numerical experiments, Physical
Review A 14 (1976) 2338. The mean rate of growth tends to the largest exponent. Of a system that
is driven by time, time is no direction in which neighbours differ.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, log, sqrt

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray

Flow = Callable[[FloatArray, float, float], FloatArray]
"""State (n,) at a time, from a state (n,) at an earlier time (s)."""

SETTLE = 0.25  # of the time: until the neighbour lies in the direction that grows most
FEWEST = 4  # batches: by fewer their scatter is hardly known,
ENOUGH = 8  # and if there are more than twice as many, they may as well be longer
SURE = 0.95  # of the cases the exponent is within its uncertainty
SEED = 0  # of the first neighbour's direction, which is the same in every run
MOST_CORRELATED = 0.95  # batches that follow one another: the mean of more tells nothing


class TooShortError(ValueError):
    """There is too little time to tell an exponent and its uncertainty."""


@dataclass(frozen=True)
class Trajectory:
    """States (K + 1, n) of a motion at instants (K + 1,) s, between which it is followed."""

    times: FloatArray
    states: FloatArray


@dataclass(frozen=True)
class Exponent:
    """The largest Lyapunov exponent `value` (1/s), 95 % sure to `uncertainty` (1/s).

    `times` (K + 1,) s bound the stretches and `rates` (K,) 1/s are the growth in each, the first
    `settled` of which do not count. `means` (batches,) 1/s are those of the batches by whose
    scatter the uncertainty is told. `distance` is that to which neighbours are put back, in the
    unit of the scales. `noise` (1/s) is how far the solver's own error may move the value: the
    error of each stretch over the distance of the neighbours at its end. The uncertainty tells how
    far the mean over other stretches of the same motion would be off; that the motion is a typical
    one, and that neighbours so far apart behave as those infinitely near, it takes for granted.
    """

    value: float
    uncertainty: float
    times: FloatArray
    rates: FloatArray
    settled: int
    means: FloatArray
    distance: float
    noise: float

    @property
    def sign(self) -> int:
        """1: neighbours part; -1: they approach; 0: it can't be told."""
        sure = self.uncertainty + self.noise
        return 0 if abs(self.value) <= sure else (1 if self.value > 0 else -1)

    @property
    def by_solver(self) -> bool:
        """Whether the solver's error counts as much as the scatter, so that tolerance matters."""
        return self.noise > self.uncertainty

    @property
    def running(self) -> FloatArray:
        """Mean rate (1/s) of the stretches that count, up to the end of each (K - settled,)."""
        spans = np.diff(self.times)[self.settled :]
        return np.asarray(np.cumsum(spans * self.rates[self.settled :]) / np.cumsum(spans))

    def horizon(self, error: float, limit: float) -> float:
        """Time (s) in which an error grows to a limit in the mean; inf where neighbours approach.

        From then on a motion is not known instant by instant, whatever solved it.
        """
        if self.value <= 0 or error >= limit:
            return inf if error < limit else 0.0
        return log(limit / error) / self.value


def trajectory(flow: Flow, start: FloatArray, times: FloatArray) -> Trajectory:
    """Follow a flow from a state (n,) through instants (K + 1,) s."""
    states = [np.asarray(start, dtype=float)]
    for begin, end in zip(times[:-1].tolist(), times[1:].tolist(), strict=True):
        states.append(flow(states[-1], begin, end))
    return Trajectory(np.asarray(times, dtype=float), np.array(states))


@dataclass(frozen=True)
class Neighbours:
    """How neighbours are made, and how far they are apart.

    They are put back to `distance`, which is Euclidean in states divided by `scales` (n,), ones if
    None. The first is in a random direction. The uncertainty is told by means over a time
    `batch` (s), whole periods of what is periodic; see `half_width`.
    """

    distance: float
    batch: float
    scales: FloatArray | None = None


def largest_exponent(
    flow: Flow,
    motion: Trajectory,
    neighbours: Neighbours,
    progress: Callable[[float], None] | None = None,
) -> Exponent:
    """Measure the largest exponent along a motion.

    Every stretch is made twice: by the neighbour, and from the motion itself, so that the errors of
    restarts do not look like growth, and are measured.

    Raises:
        TooShortError: there are fewer than `FEWEST` batches, or a stretch is so long that nothing
            is left of the neighbours' distance.

    """
    count = len(motion.times) - 1
    settled, edges = batches(motion.times, neighbours.batch)
    distance, scales = neighbours.distance, neighbours.scales
    unit = np.ones(motion.states.shape[1]) if scales is None else scales
    way = np.random.default_rng(SEED).standard_normal(len(unit))
    near = motion.states[0] + distance * unit * way / np.linalg.norm(way)
    rates, errors = np.zeros(count), np.zeros(count)
    for k in range(count):
        begin, end = float(motion.times[k]), float(motion.times[k + 1])
        before = float(np.linalg.norm((near - motion.states[k]) / unit))
        base = flow(motion.states[k], begin, end)
        apart = (flow(near, begin, end) - base) / unit
        away = float(np.linalg.norm(apart))
        if not 0 < away < inf:
            raise TooShortError(f"a stretch of {end - begin:.3g} s wipes neighbours' distance out")
        rates[k] = log(away / before) / (end - begin)
        missed = float(np.linalg.norm((base - motion.states[k + 1]) / unit))
        errors[k] = missed / away / (end - begin)
        near = motion.states[k + 1] + distance * unit * apart / away
        if progress is not None:
            progress((k + 1) / count)
    spans = np.diff(motion.times)
    value, noise = (
        float(spans[settled:] @ x[settled:] / spans[settled:].sum()) for x in (rates, errors)
    )
    grown = np.append(0.0, np.cumsum(spans * rates))
    means = np.diff(grown[edges]) / np.diff(motion.times[edges])
    return Exponent(value, half_width(means), motion.times, rates, settled, means, distance, noise)


def batches(times: FloatArray, batch: float) -> tuple[int, IndexArray]:
    """First stretch that counts, and the instants (batches + 1,) between which batches lie.

    The last end of batches is that of the times; from there they are counted back, so that what
    is left over belongs to what does not count. Each is a multiple of `batch` (s).
    """
    whole = float(times[-1] - times[0])
    count = int((1 - SETTLE) * whole / batch * (1 + 1e-9))
    if count < FEWEST:
        raise TooShortError(
            f"{whole:.4g} s tell no exponent with its uncertainty: it needs {FEWEST} batches of "
            f"{batch:.4g} s, and a third of that before, {FEWEST * batch / (1 - SETTLE):.4g} s"
        )
    longer = max(1, count // ENOUGH)
    wanted = times[-1] - longer * batch * np.arange(count // longer, -1, -1)
    edges = np.abs(times[:, None] - wanted).argmin(axis=0)
    return int(edges[0]), edges


def half_width(means: FloatArray) -> float:
    """Half width of the interval that holds the mean of batches with probability `SURE`.

    Batches that follow one another may still correlate, by r from one to the next. The correlation
    of n means, taken about their own mean, is too small by (1 + 4 r)/n: F. H. C. Marriott and J. A.
    Pope, Bias in the estimation of autocorrelations, Biometrika 41 (1954) 390. If it falls as r^k
    over k batches, n of them tell no more than n (1 - r)/(1 + r) that are independent.

    Of eight batches the interval holds the mean in 97 % of the cases if r = 0, 87 % if r = 0.6: so
    few do not tell how much they correlate.
    """
    from scipy.special import stdtrit  # noqa: PLC0415 - takes a second, which `check` saves

    count = len(means)
    off = means - means.mean()
    whole = float(off @ off)
    if whole == 0:
        return 0.0
    found = float(off[1:] @ off[:-1]) / whole
    correlation = min(max(found + (1 + 4 * found) / count, 0.0), MOST_CORRELATED)
    independent = max(count * (1 - correlation) / (1 + correlation), 2.0)
    student = float(stdtrit(independent - 1, (1 + SURE) / 2))
    return student * sqrt(whole / (count - 1) / independent)

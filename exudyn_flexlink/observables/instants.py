"""Values between samples, by interpolation; N is the number of samples."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from exudyn_flexlink.arguments import instants, takes
from exudyn_flexlink.arrays import FloatArray, members
from exudyn_flexlink.rounding import KNOT_TIME, LAST_PLACES, ROUNDING

HARMLESS = 1e-3  # of the largest rate: with a smaller jump a cubic does not overshoot visibly

Record = TypeVar("Record")


class OverTime:
    """A dataclass of arrays at samples `time` (N,) s; it has values at other instants, too."""

    if TYPE_CHECKING:
        time: FloatArray

    def at(self: Record, time: ArrayLike) -> Record:
        """Return the same at instants (M,) s, or at one, between samples too: see `Result.at`.

        Raises:
            ValueError: one of them is not in the run.

        """
        return at_instants(self, time)


@takes(time=instants)
def at_instants(record: Record, time: ArrayLike) -> Record:
    """Return a dataclass of samples at `time` (N,) s, interpolated at instants (M,) s, or at one.

    An array with known rates is interpolated by `between_samples`, others by `straight_between`.
    For a bound, the larger value of the samples on both sides is taken. Arrays without a time axis
    stay.

    Raises:
        ValueError: one of them is not in the run.

    """
    known: Any = record
    times = np.asarray(time, dtype=float)
    require_inside(known.time, times)
    arrays: dict[str, FloatArray] = {}
    for name, _, variable in members(type(record)):
        values = getattr(known, name)
        if variable is None or values is None or variable.dimensions.partition(" ")[0] != "time":
            continue
        if variable.rate:
            rates = getattr(known, variable.rate)
            arrays[name] = between_samples(known.time, values, rates, times)
        else:
            arrays[name] = straight_between(known.time, values, times, bound=variable.bound)
    made: Record = replace(known, **(arrays | {"time": times}))
    return made


def even_instants(time: FloatArray, every: float) -> FloatArray:
    """Instants (M,) s evenly `every` (s) apart, from the first of samples (N,) s on."""
    count = int((time[-1] - time[0]) / every * (1 + ROUNDING))
    return np.asarray(time[0] + every * np.arange(count + 1))


def require_inside(time: FloatArray, instants: FloatArray) -> None:
    """Refuse `instants` (s) outside the samples `time` (N,) s of a run.

    Raises:
        ValueError: one of them is outside, or no number.

    """
    begin, end = float(time[0]), float(time[-1])
    if not np.all((instants >= begin - KNOT_TIME) & (instants <= end + KNOT_TIME)):
        raise ValueError(f"time: the run goes from {begin:.9g} to {end:.9g} s, no further")


def straight_between(
    time: FloatArray, values: FloatArray, instants: FloatArray, *, bound: bool = False
) -> FloatArray:
    """Values at `instants` (M,) s on straight lines between samples (N, ...) at `time` (N,) s.

    At a jump, which has a sample on both sides, the later one counts. Before the first sample and
    after the last one the value stays constant. For a `bound` it is the larger of both samples.
    """
    latest = instants + LAST_PLACES * np.spacing(np.abs(instants))
    before = np.clip(np.searchsorted(time, latest, side="right") - 1, 0, len(time) - 1)
    after = np.minimum(before + 1, len(time) - 1)
    span = time[after] - time[before]
    since = np.maximum(instants - time[before], 0.0)
    part = np.divide(since, span, out=np.zeros_like(since), where=span > 0)
    part = part.reshape((*part.shape, *(1,) * (values.ndim - 1)))
    first, second = values[before], values[after]
    if bound:
        return np.asarray(np.where(part > 0, np.maximum(first, second), first))
    return np.asarray(first + part * (second - first))


def between_samples(
    time: FloatArray, values: FloatArray, rates: FloatArray, instants: FloatArray
) -> FloatArray:
    """Values at `instants` (M,) s: the cubic through values and rates of the samples around.

    `time` (N,) s, `values` (N, ...) and their time derivatives `rates` (N, ...). Exact at samples.
    Straight where the rates jump between two samples (an impulse): a cubic would overshoot.
    Instants outside the samples continue the outermost cubic.
    """
    if len(time) < 2:
        return np.asarray(
            np.broadcast_to(values[0], (*np.shape(instants), *values.shape[1:])).copy()
        )
    i = np.clip(np.searchsorted(time, instants, side="right") - 1, 0, len(time) - 2)
    shape = (*np.shape(instants), *(1,) * (values.ndim - 1))
    span = (time[i + 1] - time[i]).reshape(shape)
    span = np.where(span > 0, span, 1.0)  # two samples of one instant: any span gives their value
    slope = (values[i + 1] - values[i]) / span
    v0, v1 = rates[i], rates[i + 1]
    off = np.abs(slope - 0.5 * (v0 + v1))
    smooth = (off < 0.4 * np.abs(v1 - v0)) | (off < HARMLESS * np.max(np.abs(rates)))
    v0 = np.where(smooth, v0, slope)
    v1 = np.where(smooth, v1, slope)
    x = (np.asarray(instants) - time[i]).reshape(shape) / span
    b = 3 * slope - 2 * v0 - v1
    c = v0 + v1 - 2 * slope
    return np.asarray(values[i] + span * x * (v0 + x * (b + x * c)))


def derivative(time: FloatArray, values: FloatArray) -> FloatArray:
    """Time derivative (N, ...) of values (N, ...) at samples (N,) s, by cubic splines.

    A jump has a sample on both sides; a spline goes from each jump to the next. The result is nan
    if a single sample is between two jumps.
    """
    # scipy takes long to import, and few ask for accelerations
    from scipy.interpolate import CubicSpline  # noqa: PLC0415

    jumps = np.flatnonzero(np.diff(time) <= LAST_PLACES * np.spacing(time[1:])) + 1
    slopes = np.full(values.shape, np.nan)
    for part in np.split(np.arange(len(time)), jumps):
        if len(part) > 1:  # one sample has no slope
            slopes[part] = CubicSpline(time[part], values[part])(time[part], 1)
    return slopes

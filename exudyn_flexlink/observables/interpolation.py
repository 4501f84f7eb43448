"""Values between samples."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray

HARMLESS = 1e-3  # of the largest rate: a smaller jump makes no cubic overshoot visibly


def straight_between(time: FloatArray, values: FloatArray, at: FloatArray) -> FloatArray:
    """Values at instants `at` (M,) s on straight lines between samples (N,) or (N, k) at `time`."""
    if values.ndim == 1:
        return np.interp(at, time, values)
    return np.stack([np.interp(at, time, column) for column in values.T], axis=-1)


def between_samples(
    time: FloatArray, values: FloatArray, rates: FloatArray, at: FloatArray
) -> FloatArray:
    """Values at instants `at` (M,) s: the cubic through values and rates of the samples around.

    `time` (N,) s, `values` (N, ...) and their time derivatives `rates` (N, ...). Exact at samples.
    Straight where the rates jump between two samples (an impulse): a cubic would overshoot.
    Instants outside the samples continue the outermost cubic.
    """
    if len(time) < 2:
        return np.asarray(np.broadcast_to(values[0], (*np.shape(at), *values.shape[1:])).copy())
    i = np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(time) - 2)
    shape = (*np.shape(at), *(1,) * (values.ndim - 1))
    span = (time[i + 1] - time[i]).reshape(shape)
    span = np.where(span > 0, span, 1.0)  # two samples of one instant: any span gives their value
    slope = (values[i + 1] - values[i]) / span
    v0, v1 = rates[i], rates[i + 1]
    off = np.abs(slope - 0.5 * (v0 + v1))
    smooth = (off < 0.4 * np.abs(v1 - v0)) | (off < HARMLESS * np.max(np.abs(rates)))
    v0, v1 = np.where(smooth, v0, slope), np.where(smooth, v1, slope)
    x = (np.asarray(at) - time[i]).reshape(shape) / span
    b, c = 3 * slope - 2 * v0 - v1, v0 + v1 - 2 * slope
    return np.asarray(values[i] + span * x * (v0 + x * (b + x * c)))

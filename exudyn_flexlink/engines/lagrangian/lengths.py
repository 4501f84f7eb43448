"""Lengths that changes of the coordinates mean: how far the mechanism's points go."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IntArray
from exudyn_flexlink.engines.lagrangian.compiled import by_reference, inner
from exudyn_flexlink.engines.lagrangian.mass import turned
from exudyn_flexlink.engines.lagrangian.mode import Instant, Mode, coordinates_at


class Scale(NamedTuple):
    """What turns changes of coordinates into lengths."""

    cosines: FloatArray  # (n,) of the rods' angles
    sines: FloatArray
    lengths: FloatArray  # (n,) of the rods
    tangent: FloatArray  # (2,): gamma'
    places: IntArray  # first free coordinate, that of P, that of the first rod
    reaches: FloatArray  # (N,): of guide and levers, m


ScaleByReference, scale_of = by_reference(Scale, "ScaleByReference", __name__)


@inner
def scale_at(at: Instant, mode: Mode, reaches: FloatArray) -> Scale:
    """Lengths that changes at the state y mean."""
    c = mode.constants
    q, _, point, _, _ = coordinates_at(at, mode)
    n, begin = len(c.rods), int(c.rods[0])
    cosines, sines = turned(q[begin : begin + n])
    places, gamma = np.empty(3, dtype=np.int64), np.empty(2)
    places[0], places[1], places[2] = int(mode.drive[0]), int(c.track_coordinate), begin
    gamma[0], gamma[1] = point[2], point[3]
    return scale_of(cosines, sines, c.lengths, gamma, places, reaches)


@inner
def length_of(change: FloatArray, scale: Scale) -> float:
    """Largest way that a point of the mechanism goes in a change (f,) of the free coordinates."""
    first, point, begin = scale.places[0], scale.places[1], scale.places[2]
    cosines, sines, lengths, reaches = scale.cosines, scale.sines, scale.lengths, scale.reaches
    x, y = 0.0, 0.0
    if point >= first:
        x, y = scale.tangent[0] * change[point - first], scale.tangent[1] * change[point - first]
    largest = x * x + y * y
    for i in range(len(lengths)):
        if begin + i >= first:
            way = lengths[i] * change[begin + i - first]
            x, y = x - way * sines[i], y + way * cosines[i]
            square = x * x + y * y
            if not square <= largest:
                largest = square
    for j in range(first, len(reaches)):
        way = reaches[j] * change[j - first]
        if not way * way <= largest:
            largest = way * way
    return float(np.sqrt(largest))

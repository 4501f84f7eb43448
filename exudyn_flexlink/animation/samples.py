"""The instants that a player keeps: between them straight lines will do."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.animation.film import Film, Take
from exudyn_flexlink.animation.zooms import zooms_of
from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.plots.outline import walled

PRECISE = 1 / 4000  # of the picture: nothing is drawn finer than a pixel of a large screen
OF_CLEARANCE = 1 / 40  # of a clearance, which is drawn larger
MOST = 1_000_000  # numbers of all poses: a page of some 6 megabytes
LOOSER = 1.6  # times the error that is allowed, until they are no more


def kept_instants(film: Film, take: Take) -> tuple[FloatArray, float]:
    """Instants (K,) s of a take, and how far (m) straight lines between them are off at most.

    In a strike that a zoom shows they are off by less, as much as it is larger.
    """
    own = take.result.time
    inside = own[(own > film.begin) & (own < film.end)]
    times = np.concatenate([[film.begin], inside, [film.end]])
    poses = take.poses(times)
    reach = np.array([part.reach for part in take.model.parts])
    # An angle counts as what it moves at the end of its part.
    values = (poses * np.stack([np.ones_like(reach), np.ones_like(reach), reach], axis=1)).reshape(
        len(times), -1
    )
    plays = [channel.clearance for channel in walled(take.model)]
    plays += [bearing.distance for bearing in take.model.bearings]
    allowed = min([PRECISE * film.size, *(OF_CLEARANCE * play for play in plays)])
    parts = _parts_allowed(film, take, times)
    most = max(2, MOST // max(values.shape[1], 1) // len(film.takes))
    while True:
        kept = straightened(times, values, allowed * parts)
        if len(kept) <= most:
            return times[kept], allowed
        allowed *= LOOSER


def _parts_allowed(film: Film, take: Take, times: FloatArray) -> FloatArray:
    """Parts (N,) of the error allowed elsewhere that are allowed at instants."""
    faces = [zoom.length for zoom in zooms_of(film, take) if zoom.channel is None]
    part = min(faces, default=film.size) / film.size
    striking = np.zeros(len(times), dtype=bool)
    for own in film.strikes:
        striking |= (times >= own.begin) & (times <= own.end)
    return np.where(striking, part, 1.0)


def straightened(times: FloatArray, values: FloatArray, allowed: FloatArray) -> IndexArray:
    """Indices of samples (N,) between which `values` (N, k) are straight to `allowed` (N,).

    The farthest sample from a line is kept, and both parts are looked at again (Ramer, Douglas and
    Peucker).
    """
    kept = {0, len(times) - 1}
    left = [(0, len(times) - 1)]
    while left:
        first, last = left.pop()
        if last - first < 2:
            continue
        part = (times[first + 1 : last] - times[first]) / (times[last] - times[first])
        line = values[first] + part[:, None] * (values[last] - values[first])
        off = np.max(np.abs(values[first + 1 : last] - line), axis=1) / allowed[first + 1 : last]
        worst = int(np.argmax(off))
        if off[worst] > 1:
            middle = first + 1 + worst
            kept.add(middle)
            left += [(first, middle), (middle, last)]
    return np.array(sorted(kept), dtype=np.intp)

"""The log of a sleeve's pairs as the Result shows it: every touch from its beginning to its end."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.exudyn.intervals import Written
from exudyn_flexlink.intervals import Intervals
from exudyn_flexlink.mechanism import pair_sides, pairs
from exudyn_flexlink.result import SleeveHistory

if TYPE_CHECKING:
    from exudyn_flexlink.engines.exudyn.redundant.run import Prepared

FloatArray = NDArray[np.float64]


def sleeve_histories(prepared: Prepared, forces: FloatArray) -> dict[str, SleeveHistory]:
    """Forces (samples, pairs) and touches of every channel, by the name of its joint."""
    histories, told = {}, written(prepared)
    first = len(prepared.assembly.mechanism.contacts)
    depths = wall_penetrations(prepared)
    for channel, deepest in zip(prepared.assembly.mechanism.channels, depths, strict=True):
        names = tuple(contact.name for contact in pairs(channel))
        count = len(names)
        touches = told.intervals(first, count) if channel.clearance > 0 else Intervals.of()
        histories[channel.name] = SleeveHistory(
            names, pair_sides(channel), forces[:, first : first + count], touches, deepest
        )
        first += count
    return histories


def wall_penetrations(prepared: Prepared) -> list[float]:
    """Largest penetration of each channel's pairs, m."""
    found = []
    first = len(prepared.assembly.mechanism.contacts)
    for channel in prepared.assembly.mechanism.channels:
        count = len(pairs(channel))
        found.append(float(prepared.recorder.seeker.deepest[first : first + count].max()))
        first += count
    return found


def written(prepared: Prepared) -> Written:
    """Return what the run wrote down of its contacts and of its channels' pairs."""
    recorder, loop = prepared.recorder, prepared.loop
    channels = (contact for channel in loop.channels for contact in channel.contacts)
    items = {contact.index: contact for contact in (*loop.contacts, *channels)}
    return Written(
        loop.log.entries,
        recorder.totals,
        recorder.totals_of,
        lambda k: items[k].peak,
        recorder.seeker,
    )

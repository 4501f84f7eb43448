"""The log of a sleeve's pairs as the Result shows it: every touch from its beginning to its end."""

from __future__ import annotations

from collections.abc import Sequence

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.extremes import ExtremeSeeker
from exudyn_flexlink.engines.exudyn.intervals import Written
from exudyn_flexlink.intervals import Intervals
from exudyn_flexlink.mechanism import Channel, Mechanism, pair_sides, pairs
from exudyn_flexlink.result import SleeveHistory


def sleeve_histories(
    mechanism: Mechanism, written: Written, forces: FloatArray
) -> dict[str, SleeveHistory]:
    """Forces (samples, contacts) and touches of every channel, by the name of its joint."""
    histories = {}
    first = len(mechanism.touching)
    depths = wall_penetrations(mechanism.channels, written.seeker, first)
    for channel, deepest in zip(mechanism.channels, depths, strict=True):
        names = tuple(contact.name for contact in pairs(channel))
        count = len(names)
        touches = written.intervals(first, count) if channel.clearance > 0 else Intervals.of()
        histories[channel.name] = SleeveHistory(
            names, pair_sides(channel), forces[:, first : first + count], touches, deepest
        )
        first += count
    return histories


def wall_penetrations(
    channels: Sequence[Channel], seeker: ExtremeSeeker, first: int
) -> list[float]:
    """Largest penetration of each channel's pairs, m; the first pair is contact number `first`."""
    found = []
    for channel in channels:
        count = len(pairs(channel))
        found.append(float(seeker.deepest[first : first + count].max()))
        first += count
    return found

"""The log of a sleeve's pairs as the Result shows it: every touch from its beginning to its end."""

from __future__ import annotations

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.intervals import Written
from exudyn_flexlink.intervals import Intervals
from exudyn_flexlink.mechanism import Mechanism, pair_sides, pairs
from exudyn_flexlink.result import SleeveHistory


def sleeve_histories(
    mechanism: Mechanism, written: Written, forces: FloatArray
) -> dict[str, SleeveHistory]:
    """Forces (samples, contacts) and touches of every channel, by the name of its joint."""
    histories = {}
    first = len(mechanism.touching)
    for channel in mechanism.channels:
        names = tuple(contact.name for contact in pairs(channel))
        count = len(names)
        deepest = float(written.seeker.deepest[first : first + count].max())
        touches = written.intervals(first, count) if channel.clearance > 0 else Intervals.of()
        histories[channel.name] = SleeveHistory(
            names, pair_sides(channel), forces[:, first : first + count], touches, deepest
        )
        first += count
    return histories

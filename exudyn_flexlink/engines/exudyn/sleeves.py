"""The log of a sleeve's pairs as the Result shows it: every touch from its beginning to its end."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.extremes import ExtremeSeeker
from exudyn_flexlink.engines.exudyn.contact_log import Entry
from exudyn_flexlink.mechanism import Channel, Mechanism, pair_sides, pairs
from exudyn_flexlink.result import SleeveHistory, Touches

FloatArray = NDArray[np.float64]
Row = tuple[int, float, float, float, float, float, float]


class WallLog(NamedTuple):
    """What pairs of sleeves did in a run; contacts are the scene's, then the pairs.

    `totals` are impulse (N s) and loss (J) of its contact at every entry, `at_end` (contacts, 2)
    those of all, at `end` (s), where what still presses ends.
    """

    entries: Sequence[Entry]
    totals: Sequence[tuple[float, float]]
    at_end: FloatArray
    end: float
    seeker: ExtremeSeeker


def sleeve_histories(
    mechanism: Mechanism, log: WallLog, forces: FloatArray
) -> dict[str, SleeveHistory]:
    """Forces (samples, contacts) and touches of every channel, by the name of its joint."""
    histories = {}
    first = len(mechanism.contacts)
    depths = wall_penetrations(mechanism.channels, log.seeker, first)
    for channel, deepest in zip(mechanism.channels, depths, strict=True):
        names = tuple(contact.name for contact in pairs(channel))
        count = len(names)
        rows = _touches(log, first, count) if channel.clearance > 0 else []
        histories[channel.name] = SleeveHistory(
            names, pair_sides(channel), forces[:, first : first + count], _columns(rows), deepest
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


def _touches(log: WallLog, first: int, count: int) -> list[Row]:
    """Touches of the contacts from `first` on; what still presses ends with the run."""
    peak_force = log.seeker.peak_force
    begun: dict[int, tuple[float, float, float, float]] = {}
    rows: list[Row] = []
    for entry, (impulse, lost) in zip(log.entries, log.totals, strict=True):
        k = entry.index
        if not first <= k < first + count:
            continue
        if entry.kind == "contact begins":
            begun[k] = (entry.time, entry.approach_speed, impulse, lost)
            continue
        since, speed, before, spent = begun.pop(k)
        totals = (impulse - before, lost - spent)
        peak = max(entry.peak_force, peak_force(k, since, entry.time))
        rows.append((k - first, since, entry.time, *totals, peak, speed))
    for k, (since, speed, before, spent) in begun.items():
        impulse, lost = log.at_end[k].tolist()
        totals = (impulse - before, lost - spent)
        rows.append((k - first, since, log.end, *totals, peak_force(k, since, log.end), speed))
    return sorted(rows, key=lambda row: (row[1], row[0]))


def _columns(rows: list[Row]) -> Touches:
    columns = [np.array(column) for column in zip(*rows, strict=True)] or [np.zeros(0)] * 7
    pair, begin, end, impulse, lost, peak, speed = (column.astype(float) for column in columns)
    return Touches(pair.astype(np.int64), begin, end, impulse, lost, peak, speed)

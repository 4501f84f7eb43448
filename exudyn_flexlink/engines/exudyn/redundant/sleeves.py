"""The log of a sleeve's pairs as the Result shows it: every touch from its beginning to its end."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.mechanism import pair_sides, pairs
from exudyn_flexlink.result import SleeveHistory, Touches

if TYPE_CHECKING:
    from exudyn_flexlink.engines.exudyn.redundant.run import Prepared

FloatArray = NDArray[np.float64]
Row = tuple[int, float, float, float, float, float, float]


def sleeve_histories(prepared: Prepared, forces: FloatArray) -> dict[str, SleeveHistory]:
    """Forces (samples, pairs) and touches of every channel, by the name of its joint."""
    histories = {}
    first = len(prepared.assembly.mechanism.contacts)
    depths = wall_penetrations(prepared)
    for channel, deepest in zip(prepared.assembly.mechanism.channels, depths, strict=True):
        names = tuple(contact.name for contact in pairs(channel))
        count = len(names)
        rows = _touches(prepared, first, count) if channel.clearance > 0 else []
        histories[channel.name] = SleeveHistory(
            names, pair_sides(channel), forces[:, first : first + count], _columns(rows), deepest
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


def _touches(prepared: Prepared, first: int, count: int) -> list[Row]:
    """Touches of the contacts from `first` on; what still presses ends with the run."""
    recorder, loop = prepared.recorder, prepared.loop
    peak_force = recorder.seeker.peak_force
    begun: dict[int, tuple[float, float, float, float]] = {}
    rows: list[Row] = []
    for entry, (impulse, lost) in zip(loop.log.entries, recorder.totals, strict=True):
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
    items = [contact for channel in loop.channels for contact in channel.contacts]
    peaks = {contact.index: contact.peak for contact in items}
    for k, (since, speed, before, spent) in begun.items():
        impulse, lost = recorder.totals_of(k)
        totals = (impulse - before, lost - spent)
        peak = max(peaks[k], peak_force(k, since, loop.time))
        rows.append((k - first, since, loop.time, *totals, peak, speed))
    return sorted(rows, key=lambda row: (row[1], row[0]))


def _columns(rows: list[Row]) -> Touches:
    columns = [np.array(column) for column in zip(*rows, strict=True)] or [np.zeros(0)] * 7
    pair, begin, end, impulse, lost, peak, speed = (column.astype(float) for column in columns)
    return Touches(pair.astype(np.int64), begin, end, impulse, lost, peak, speed)

"""What contacts did: the log that the steps write, and the intervals that a Result shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

from exudyn_flexlink.engines.extremes import ExtremeSeeker
from exudyn_flexlink.engines.exudyn.faces import Touch
from exudyn_flexlink.intervals import ContactEvent, Interval, Intervals

Totals = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Entry:
    """One beginning or end of the contact `index` at `time` (s).

    `peak_force` (N) is the largest that was noted, of what `engines.extremes` does not look at.
    """

    time: float
    index: int
    kind: ContactEvent
    touch: Touch
    approach_speed: float
    peak_force: float = 0.0


@dataclass(frozen=True)
class Written:
    """What a run wrote down of its contacts.

    `totals` are impulse (N s) and energy lost (J) of its contact since time 0 at every entry,
    `at_end` those of every contact at the run's end, `peaks` the largest force (N) that the steps
    of its last interval showed. `seeker` knows the peaks within steps.
    """

    entries: Sequence[Entry]
    totals: Sequence[Totals]
    at_end: Sequence[Totals]
    peaks: Sequence[float]
    seeker: ExtremeSeeker

    def intervals(self, first: int = 0, count: int = 1) -> Intervals:
        """Return the intervals of the contacts from number `first` on; those are its pairs."""
        found = list[Interval]()
        begun: dict[int, tuple[Entry, Totals]] = {}
        for entry, total in zip(self.entries, self.totals, strict=True):
            if not first <= entry.index < first + count:
                continue
            if entry.kind == "contact begins":
                begun[entry.index] = (entry, total)
            else:
                found.append(self._interval(first, begun.pop(entry.index), entry, total))
        for k, begin in begun.items():
            found.append(self._interval(first, begin, None, self.at_end[k]))
        return Intervals.of(found)

    def _interval(
        self, first: int, begin: tuple[Entry, Totals], last: Entry | None, total: Totals
    ) -> Interval:
        entry, before = begin
        end = inf if last is None else last.time
        peak = self.peaks[entry.index] if last is None else last.peak_force
        force, depth = self.seeker.peaks(entry.index, entry.time, end)
        return Interval(
            begin=entry.time,
            end=end,
            place=entry.touch.place,
            end_place=(last or entry).touch.place,
            approach_speed=entry.approach_speed,
            separation_speed=0.0 if last is None else last.touch.gap_rate,
            impulse=total[0] - before[0],
            energy_lost=total[1] - before[1],
            peak_force=max(peak, force),
            penetration=depth,
            slides_off=last is not None and last.kind == "leaves the face",
            pair=entry.index - first,
        )

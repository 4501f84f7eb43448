"""What contacts did, written down by the step loop, and which of them press now."""

from __future__ import annotations

from dataclasses import dataclass, field

from exudyn_flexlink.arrays import BoolArray
from exudyn_flexlink.engines.exudyn.faces import Touch


@dataclass(frozen=True, slots=True)
class Entry:
    """One beginning or end of the contact `index` at `time` (s).

    `peak_force` (N) is the largest that was noted, of what `engines.extremes` does not look at.
    """

    time: float
    index: int
    kind: str
    touch: Touch
    approach_speed: float
    peak_force: float = 0.0


@dataclass
class ContactLog:
    """Entries in order of time; `pressed` (contacts,) tells of each contact whether it acts."""

    pressed: BoolArray
    entries: list[Entry] = field(default_factory=list)
    _known: int = 0

    def tell(self, time: float, index: int, kind: str, touch: Touch, approach: float) -> None:
        """Write down that a contact began or ended at a time (s), with its approach speed (m/s)."""
        self.pressed[index] = kind == "contact begins"
        self.entries.append(Entry(time, index, kind, touch, approach))

    def fresh(self) -> list[Entry]:
        """Return the entries since the last call."""
        known, self._known = self._known, len(self.entries)
        return self.entries[known:]

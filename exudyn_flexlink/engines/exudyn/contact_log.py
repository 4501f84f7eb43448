"""What contacts did, as the step loop writes it down."""

from __future__ import annotations

from dataclasses import dataclass

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

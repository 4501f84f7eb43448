"""Progress of a run, told now and then."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import monotonic

SECONDS_BETWEEN_REPORTS = 0.1


@dataclass
class ProgressMeter:
    """Reports which part of a run is done, if somebody listens, up to ten times a second."""

    report: Callable[[float], None] | None
    end: float  # s
    _told: float | None = None

    def tell(self, time: float) -> None:
        """Report that the run is at a time (s); the first call begins to count."""
        if self.report is None:
            return
        now = monotonic()
        if self._told is None:
            self._told = now
        if now - self._told > SECONDS_BETWEEN_REPORTS:
            self._told = now
            self.report(min(time / self.end, 1.0))

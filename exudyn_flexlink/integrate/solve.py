"""The loop of every run: from step to step, over stops and events, until the end or a reason."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from logging import getLogger
from math import inf
from time import monotonic
from typing import TYPE_CHECKING, Protocol

from exudyn_flexlink.integrate.events import EVENT_TIME, Crossing
from exudyn_flexlink.integrate.problem import NoConvergenceError, instant

if TYPE_CHECKING:
    from exudyn_flexlink.integrate.explicit import ExplicitStepper
    from exudyn_flexlink.integrate.stepper import ImplicitStepper

SECONDS_BETWEEN_REPORTS = 0.1
MOST_AT_ONCE = 200  # events at one instant before the loop gives up
WATCHED = 500  # steps in a row that tell whether a run makes progress
CREEPING = 1e-3  # of the mean progress of a step: a slower run would not reach its end


class Events(Protocol):
    """The state that events change."""

    @property
    def over(self) -> bool:
        """Whether the run ends here."""

    def cross(self, event: Crossing) -> None:
        """Record the steps that wait, then let the event's guard change the equations."""


@dataclass
class ProgressMeter:
    """Reports the done part of a run to `report`, if any, up to ten times a second."""

    report: Callable[[float], None] | None
    end: float  # s
    _last_report: float | None = None

    def update(self, time: float) -> None:
        """Report that the run has reached a time (s); the clock starts with the first call."""
        if self.report is None:
            return
        now = monotonic()
        if self._last_report is None:
            self._last_report = now
        if now - self._last_report > SECONDS_BETWEEN_REPORTS:
            self._last_report = now
            self.report(min(time / self.end, 1.0))


@dataclass
class Solution:
    """One run up to the last of its `stops` (s); the equations have a kink at each of them.

    `go_on`, if any, is called before each further stretch, with the stops at its ends: forces may
    leap at a stop. `creeps` says from which instant on the run is much slower than before, with the
    `reason` if it is known.
    """

    stepper: ImplicitStepper | ExplicitStepper
    events: Events
    stops: Sequence[float]
    progress: Callable[[float], None] | None = None
    go_on: Callable[[float, float], None] | None = None
    reason: Callable[[], str] = str
    interrupted: bool = False
    creeps: tuple[str, ...] = ()
    _at_once: int = 0
    _watched: tuple[int, float] = (0, 0.0)  # steps and time (s) of the last check

    def __post_init__(self) -> None:
        self._meter = ProgressMeter(self.progress, self.end)

    @property
    def time(self) -> float:
        """Time that the run has reached, s."""
        return self.stepper.time

    @property
    def end(self) -> float:
        """Time at which the run shall end, s."""
        return self.stops[-1]

    def interrupt(self) -> None:
        """End the run after the step that is under way."""
        self.interrupted = True

    def run(self) -> None:
        """Integrate to the end, or until the run is over or is asked to stop.

        Raises:
            NoConvergenceError: no step is short enough, or too many events follow at one instant.

        """
        self.stepper.begin()
        before = 0.0
        for stop in self.stops:
            if before > 0.0 and self.go_on is not None and not self._over():
                self.go_on(before, stop if stop < self.end else inf)
                self.stepper.restart()
            before = stop
            while stop - self.time > instant(stop, EVENT_TIME) and not self._over():
                began = self.time
                event = self.stepper.advance(stop)
                self._count(began, event)
                self._watch()
                if event is not None:
                    self._cross(event)
                self._meter.update(self.time)

    def _watch(self) -> None:
        """Warn at once, and only once, if the run creeps: it might take days."""
        steps, (before, since) = self.stepper.steps, self._watched
        if steps >= before + WATCHED:
            self._watched = steps, self.time
            made, usual = self.time - since, (steps - before) * self.time / steps
            if made < CREEPING * usual and not self.creeps:
                about = (
                    f"from t = {since:.4g} s on the run creeps: {steps - before} steps took it on "
                    f"by {made:.2g} s, less than a thousandth of the mean"
                )
                parts = filter(None, [about, self.reason()])
                self.creeps = (": ".join(parts),)
                getLogger(__name__).warning("warning: %s", *self.creeps)

    def _over(self) -> bool:
        return self.events.over or self.interrupted

    def _cross(self, event: Crossing) -> None:
        self.events.cross(event)
        if not self.events.over:
            self.stepper.restart(event)

    def _count(self, began: float, event: Crossing | None) -> None:
        """Count events in a row without a step between them."""
        if self.time - began >= instant(self.time, EVENT_TIME):
            self._at_once = 0
        elif event is not None:
            self._at_once += 1
            if self._at_once > MOST_AT_ONCE:
                raise NoConvergenceError("events follow one another at one instant")

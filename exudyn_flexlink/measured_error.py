"""What a second run tells of a run's errors: of its points, and of its forces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import inf


@dataclass(frozen=True)
class ForceSpread:
    """How far a force is from what it is held against, at some instants; N, or N m of a torque.

    `largest`, at the instant `at` (s); `rms`, the root of the mean square; `size`, the largest of
    the force itself.
    """

    largest: float
    at: float
    rms: float
    size: float

    @property
    def relative(self) -> float:
        """The largest, as a part of the force's size; 0 if both are zero."""
        return self.largest / self.size if self.size > 0 else 0.0

    def times(self, factor: float, least: float = 0.0) -> ForceSpread:
        """Return it `factor` times as large, and no less than a part `least` of the size."""
        largest, rms = (max(factor * x, least * self.size) for x in (self.largest, self.rms))
        return ForceSpread(largest, self.at, rms, self.size)


@dataclass(frozen=True)
class ForceDeviation:
    """How far a force in `unit`, N or N m, is from another run's, or from the truth.

    `free`: while nothing touches; `touching`: while something does, in both runs. None where there
    is no such instant. The force of a contact is a steep function of time: of it each touch is
    compared as if it began at one instant in both runs, and `instants` (s) is how far begins and
    ends of touches are off.
    """

    unit: str
    free: ForceSpread | None
    touching: ForceSpread | None
    instants: float | None = None

    def times(self, factor: float, least: float = 0.0) -> ForceDeviation:
        """Return it `factor` times as large, and no less than a part `least` of the force."""
        free, touching = (own and own.times(factor, least) for own in (self.free, self.touching))
        instants = None if self.instants is None else factor * self.instants
        return ForceDeviation(self.unit, free, touching, instants)


@dataclass(frozen=True)
class MeasuredError:
    """How far a run is off, as the distance from a second run of the scene tells.

    `largest` (m) is the largest error of any of the `points`, that of the point `worst`, up to
    `known_until`; `limit` (m) is the tolerance that was asked for. `exceeds_from` (s) is the
    instant from which on an error may be larger than that, `horizon` (s) the one at which both runs
    part for good, so that only statistics hold after it; None if there is none. `stopped` (s) is
    the end of a second run that did not come to the end of the first, None if it did; `other` (m)
    is its tolerance. `forces` are by what they are called, see `observables.forces`, and go as far.
    `missing` says why nothing was measured; it is empty where something was.
    """

    points: tuple[str, ...] = ()
    worst: str = ""
    limit: float = inf
    largest: float = inf
    exceeds_from: float | None = None
    horizon: float | None = None
    stopped: float | None = None
    other: float = inf
    forces: Mapping[str, ForceDeviation] = field(default_factory=dict)
    missing: str = ""

    @property
    def known_until(self) -> float:
        """Instant (s) up to which errors are known: the horizon, or where a run stopped; inf."""
        return min(inf if end is None else end for end in (self.horizon, self.stopped))

    def later(self, by: float) -> MeasuredError:
        """Return it with its instants `by` (s) later."""
        instants = (self.exceeds_from, self.horizon, self.stopped)
        exceeds, horizon, stopped = (t if t is None else t + by for t in instants)
        return replace(self, exceeds_from=exceeds, horizon=horizon, stopped=stopped)


NOT_ASKED = MeasuredError(missing="no second run was made")
"""Of one run alone, which a second one may still measure."""

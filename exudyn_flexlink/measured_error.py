"""What a neighbouring run tells of a run's errors: of its points, and of its forces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf

NOT_MEASURED = "no neighbouring run was made"
"""Why an error is not known that only such a run can tell."""


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
    is no such instant.
    """

    unit: str
    free: ForceSpread | None
    touching: ForceSpread | None

    def times(self, factor: float, least: float = 0.0) -> ForceDeviation:
        """Return it `factor` times as large, and no less than a part `least` of the force."""
        parts = (own and own.times(factor, least) for own in (self.free, self.touching))
        return ForceDeviation(self.unit, *parts)


@dataclass(frozen=True)
class MeasuredError:
    """How far a run's `points` are off, as a neighbouring run tells.

    `largest` (m) is the largest error of any, that of the point `worst`; `limit` (m) is what they
    may be off: the scene's tolerance, or without one a thousandth of the room that they take.
    `exceeds_from` (s) is the instant from which on an error is larger, None if none ever is;
    `stopped` (s) is the end of a neighbour that did not come to the run's end, None if it did.
    `neighbour` holds its settings.
    `forces` are by what they are called, see `observables.forces`, up to `forces_until` (s), where
    both runs have parted visibly; None if they never do.
    `missing` says why nothing was measured; it is empty where something was.
    """

    points: tuple[str, ...] = ()
    worst: str = ""
    limit: float = inf
    largest: float = inf
    exceeds_from: float | None = None
    stopped: float | None = None
    neighbour: Mapping[str, float | str] = field(default_factory=dict)
    forces: Mapping[str, ForceDeviation] = field(default_factory=dict)
    forces_until: float | None = None
    missing: str = ""

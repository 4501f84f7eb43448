"""How far one run is from another, in all points by which runs are judged."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from exudyn_flexlink.observables import (
    common_points,
    common_times,
    farthest,
    first_beyond,
    force_deviations,
    lever_response,
    parting_limit,
    separation,
    separations,
    struck_bodies,
    worst_force,
)
from exudyn_flexlink.result import Result

SURE = 0.03  # of the limit at which runs have parted: up to there errors are judged


@dataclass(frozen=True)
class Errors:
    """Distance (m) of points from where they should be, of the one that is farthest off.

    `largest` is that of the point `worst`; `rms` is over time, at every instant of the point that
    is farthest off then; `levers` are differences of the largest absolute angle (rad) or
    displacement (m) of struck bodies. `force` is the largest error of a force, as a part of that
    force's largest, and `worst_force` what that is called: see `observables.worst_force`.
    """

    rms: float
    largest: float
    worst: str
    levers: dict[str, float]
    force: float
    worst_force: str

    def times(self, factor: float) -> Errors:
        """Return these errors times a factor."""
        levers = {body: factor * x for body, x in self.levers.items()}
        scaled = {name: factor * getattr(self, name) for name in ("rms", "largest", "force")}
        return replace(self, levers=levers, **scaled)


@dataclass(frozen=True)
class Horizon:
    """Instants up to which two runs agree, s.

    `parted`: where they differ by more than `limit` (m), so that instants can't be compared;
    `sure`: up to where errors are judged, since near the other a parting is all one would see.
    """

    parted: float
    sure: float
    limit: float


def errors(result: Result, reference: Result, until: float) -> Errors:
    """Errors of a run up to `until` (s)."""
    time = common_times(reference, result)
    time = time[time <= until]
    points = common_points(reference, result)
    each = separations(result, reference, time, points)
    apart = each.max(axis=1)
    worst, force = worst_force(force_deviations(reference, result, np.nextafter(until, np.inf)))
    return Errors(
        float(np.sqrt(np.mean(apart**2))),
        float(apart.max()),
        farthest(points, each.max(axis=0)),
        {
            body: abs(_peak(result, contact, until) - _peak(reference, contact, until))
            for body, contact in struck_bodies(reference.scene).items()
        },
        force,
        worst,
    )


def _peak(result: Result, contact: str, until: float) -> float:
    return lever_response(result, contact).between(-np.inf, np.nextafter(until, np.inf)).farthest


def agreement(reference: Result, check: Result) -> Horizon | None:
    """Find where two tight runs part; None if they never do."""
    limit = parting_limit(reference)
    time = common_times(reference, check)
    apart = separation(reference, check, time)
    parted, sure = (first_beyond(time, apart, part * limit) for part in (1.0, SURE))
    return None if parted is None or sure is None else Horizon(parted, sure, limit)

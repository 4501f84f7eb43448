"""How far one run is from another: the watched point S, and the tips of what it strikes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.comparison import common_times, horizon, parting_limit, separation
from exudyn_flexlink.observables import lever_response, struck_bodies
from exudyn_flexlink.result import Result

FloatArray = NDArray[np.float64]

SURE = 0.03  # of the limit at which runs have parted: up to there errors are judged


@dataclass(frozen=True)
class Error:
    """Distance of a point from where it should be, m."""

    rms: float
    largest: float


@dataclass(frozen=True)
class Errors:
    """Errors of the watched point and of the tips (None: nothing is struck); `levers` by body.

    `levers` are differences of the largest absolute angle of struck bodies, rad.
    """

    point: Error
    tip: Error | None
    levers: dict[str, float]

    @property
    def worst(self) -> float:
        """The larger of the largest errors, m: what a tolerance promises."""
        return max(self.point.largest, self.tip.largest if self.tip else 0.0)

    def times(self, factor: float) -> Errors:
        """Return these errors times a factor."""
        tip = self.tip and Error(factor * self.tip.rms, factor * self.tip.largest)
        point = Error(factor * self.point.rms, factor * self.point.largest)
        return Errors(point, tip, {body: factor * x for body, x in self.levers.items()})


@dataclass(frozen=True)
class Horizon:
    """Instants up to which two runs agree, s.

    `parted`: where they differ by more than `limit` (m), so that instants can't be compared;
    `sure`: up to where errors are judged, since near the other a parting is all one would see.
    """

    parted: float
    sure: float
    limit: float


def errors(result: Result, reference: Result, until: float, struck: Sequence[str]) -> Errors:
    """Errors of a run up to `until` (s); `struck` are the tips to look at: see `struck_tips`."""
    time = common_times(reference, result)
    time = time[time <= until]
    off = separation(result, reference, time)
    tip = [separation(result, reference, time, point) for point in struck]
    return Errors(
        _error(off), _error(np.max(tip, axis=0)) if tip else None, _peaks(result, reference, until)
    )


def _error(apart: FloatArray) -> Error:
    return Error(float(np.sqrt(np.mean(apart**2))), float(apart.max()))


def _peaks(result: Result, reference: Result, until: float) -> dict[str, float]:
    return {
        body: abs(_peak(result, contact, until) - _peak(reference, contact, until))
        for body, contact in struck_bodies(reference.scene).items()
    }


def _peak(result: Result, contact: str, until: float) -> float:
    return lever_response(result, contact).between(-np.inf, np.nextafter(until, np.inf)).farthest


def agreement(reference: Result, check: Result) -> Horizon | None:
    """Find where two tight runs part; None if they never do."""
    limit = parting_limit(reference)
    parted = horizon(reference, check, limit)
    if parted is None:
        return None
    sure = horizon(reference, check, SURE * limit)
    return Horizon(parted, parted if sure is None else sure, limit)

"""What a study advises: the cheapest setting for a target, the cause of error that dominates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

from exudyn_flexlink.accuracy.judging import Point, Source, Study
from exudyn_flexlink.accuracy.methods import Method


@dataclass(frozen=True)
class Advice:
    """`choice`: the cheapest point within the target, None if there is none; `best`: the nearest.

    `limit`: what keeps the model as such from the target whatever the steps, None if nothing does.
    `below_floor`: the target is smaller than what the references agree to.
    """

    choice: Point | None
    best: Point | None
    limit: Source | None
    below_floor: bool


def advise(study: Study) -> Advice:
    """Choose a setting for the study's target."""
    rods = [point for point in study.points if point.method.of_rods]
    loosest = [_loosest(rods, method, study.target) for method in {p.method for p in rods}]
    fit = [point for point in loosest if point is not None]
    return Advice(
        min(fit, key=lambda p: p.processor, default=None),
        min(rods, key=lambda p: (p.claimed, p.processor), default=None),
        _limit(study.sources, study.target),
        study.target < study.floor,
    )


def _loosest(points: Sequence[Point], method: Method, target: float) -> Point | None:
    """Return the loosest setting of a method that keeps the target, as all finer ones do.

    Not the fastest: where settings hardly differ in cost, the noise of timing would choose.
    """
    found = None
    for point in sorted((p for p in points if p.method == method), key=lambda p: p.value):
        if point.claimed > target:
            break
        found = point
    return found


def _limit(sources: Sequence[Source], target: float) -> Source | None:
    model = [s for s in sources if s.kind != "time" and s.errors.largest > target and not s.at_most]
    return max(model, key=lambda s: s.errors.largest, default=None)


def dominating(sources: Sequence[Source]) -> Source | None:
    """Return the largest source of error; None if there are not two to compare, or all are 0."""
    if len(sources) < 2:
        return None
    largest = max(sources, key=lambda s: s.errors.largest)
    return largest if largest.errors.largest > 0 else None


def needed(value: float, source: Source, target: float) -> float:
    """Return the number of rods, or the stiffness, at which a source falls to the target."""
    return float(value * (source.errors.largest / target) ** (1 / source.order))


def rods_needed(rods: int, source: Source, target: float) -> int:
    """Return the whole number of rods with which the beam is met to the target (m)."""
    return ceil(needed(rods, source, target) * (1 - 1e-9))

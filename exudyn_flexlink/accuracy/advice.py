"""What a study advises: the cheapest setting for a target, the cause of error that dominates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import takewhile
from math import ceil

from exudyn_flexlink.accuracy.judging import Point, Source, Study

MARGIN = 1 / 3  # of the target: what is advised is measured to be off by no more


@dataclass(frozen=True)
class Advice:
    """`choice`: the cheapest point well within the target, or None; `best`: the nearest.

    Error control at the target, or below, comes first: what is coarser keeps it by luck.
    `limit`: what keeps the model as such from the target whatever the steps, None if nothing does.
    `below_floor`: the references do not agree well enough to tell what is well within the target.
    """

    choice: Point | None
    best: Point | None
    limit: Source | None
    below_floor: bool


def advise(study: Study) -> Advice:
    """Choose a setting for the study's target."""
    rods = [point for point in study.points if point.method.of_rods]
    asked, well = study.target * (1 + 1e-9), MARGIN * study.target  # rungs are rounded
    controlled = [p for p in rods if p.method.knob == "tolerance" and p.value <= asked]
    return Advice(
        _cheapest(controlled, well) or _cheapest(rods, well),
        min(rods, key=lambda p: (p.claimed, p.processor), default=None),
        _limit(study.sources, study.target),
        well < study.floor,
    )


def _cheapest(points: Sequence[Point], most: float) -> Point | None:
    """Return the cheapest of the methods' loosest settings off by at most `most` (m), as all finer.

    Not the fastest of all: where settings hardly differ, the noise of timing would choose.
    """
    fit = []
    for method in {p.method for p in points}:
        rungs = sorted((p for p in points if p.method == method), key=lambda p: p.value)
        fit += list(takewhile(lambda p: p.claimed <= most, rungs))[-1:]
    return min(fit, key=lambda p: p.processor, default=None)


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

"""Our engines against the script one would write by hand, at the same error of S."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from benchmarks import strike
from benchmarks.measuring import (
    LONG,
    Measured,
    Table,
    climb,
    cost_at,
    interleaved,
    ladder,
    loosest,
)
from benchmarks.naive_exudyn import simulate_by_hand
from benchmarks.variants import VARIANTS, Variant

STEPS = (1e-4, 4e-5, 1e-5)  # s, of the script
ERRORS = (1e-4, 1e-5, 1e-6, 1e-7)  # m


@dataclass(frozen=True)
class Match:
    """Costs (s) at one error: of the script (`beyond` what was measured) and of one variant."""

    error: float
    naive: float
    beyond: bool
    variant: Variant
    ours: Measured | None

    @property
    def ratio(self) -> float:
        """How many times cheaper ours is; nan if it does not reach the error."""
        return self.naive / self.ours.cost if self.ours else float("nan")


def by_hand(step: float) -> tuple[float, int]:
    """Error of the script (m) at a step (s), and its number of steps."""
    motion = simulate_by_hand(step)
    _, position, _ = strike.series()
    off = np.linalg.norm(motion.position - position[: len(motion.time)], axis=1)
    return float(off.max()), motion.steps


def ours(variant: Variant, finest: float, rung: float) -> tuple[float, int]:
    """Error of a variant (m) at a rung, and its number of steps."""
    result = strike.run(variant, rung)
    made = strike.error(result)
    if made < 2 * strike.SERIES_KNOWS and finest < strike.SERIES_KNOWS:
        made = strike.error(result, finer=True)
    return made, result.checks.steps


def measure(
    steps: Sequence[float] = STEPS,
    errors: Sequence[float] = ERRORS,
    repeat: int = 3,
    budget: float = 60.0,
) -> tuple[list[Measured], list[Match]]:
    """Points of the script, and for each error what every variant costs against it.

    `budget` (s of processor time) ends a variant's ladder.
    """
    if min(errors) < strike.SERIES_KNOWS:
        strike.tight()  # not on anyone's bill
    naive = [m for step in steps for m in climb(by_hand, [step], 0.0, budget)]
    found: dict[tuple[str, float], Measured | None] = {}
    for variant in VARIANTS:
        strike.warm_up(variant)
        run = partial(ours, variant, min(errors))
        points = climb(run, ladder(variant.first), min(errors), budget)
        found |= {(variant.name, error): loosest(points, error) for error in errors}
    naive, found = _again(naive, found, repeat - 1)
    matches = []
    for error in errors:
        cost, beyond = cost_at(naive, error)
        for variant in VARIANTS:
            at = found[variant.name, error]
            matches.append(Match(error, cost, beyond, variant, at))
    return naive, matches


def _again(
    naive: list[Measured], found: dict[tuple[str, float], Measured | None], repeat: int
) -> tuple[list[Measured], dict[tuple[str, float], Measured | None]]:
    """Measure what was chosen again, in turn."""
    variants = {variant.name: variant for variant in VARIANTS}
    known = {f"{point.setting}": point.cost for point in naive}
    runs: dict[str, Callable[[], object]] = {
        f"{point.setting}": partial(simulate_by_hand, point.setting) for point in naive
    }
    for key, point in found.items():
        if point is not None:
            name, _ = key
            runs[f"{name} {point.setting}"] = partial(strike.run, variants[name], point.setting)
            known[f"{name} {point.setting}"] = point.cost
    best = interleaved(runs, repeat, known)
    return (
        [replace(point, cost=best[f"{point.setting}"]) for point in naive],
        {
            key: point and replace(point, cost=best[f"{key[0]} {point.setting}"])
            for key, point in found.items()
        },
    )


def tables(quick: bool = False, repeat: int = 3) -> list[Table]:
    """Measure, and tell it."""
    if quick:
        naive, matches = measure(STEPS[:2], ERRORS[:2], repeat, LONG)
    else:
        naive, matches = measure(repeat=repeat)
    script = tuple(
        (
            f"{m.setting:.0e} s",
            f"{m.error:.1e} m",
            f"{m.cost:.2f} s",
            f"{1e6 * m.cost / m.steps:.0f}",
        )
        for m in naive
    )
    best = {
        error: max(
            (m for m in matches if m.error == error and m.ours),
            key=lambda m: m.ratio,
            default=None,
        )
        for error in dict.fromkeys(m.error for m in matches)
    }
    told = [
        f"{match.ratio:.2g} times as fast ({match.variant.name}) at {error:.0e} m"
        for error, match in best.items()
        if match
    ]
    return [
        Table(
            "The strike, two turns, n = 10: the script by hand (exudyn, Python callbacks)",
            ("step", "error of S", "processor time", "us per step"),
            script,
            "",
        ),
        Table(
            "The same scene here, at the same error ('~': the script's cost is extrapolated)",
            ("error", "script", "variant", "setting", "its error", "steps", "its time", "ratio"),
            tuple(map(_row, matches)),
            "Against the script by hand: " + ", ".join(told) + ".",
        ),
    ]


def _row(match: Match) -> tuple[str, ...]:
    start = (f"{match.error:.0e} m", f"{'~' * match.beyond}{match.naive:.2f} s", match.variant.name)
    at = match.ours
    if at is None:
        return (*start, "not reached", "", "", "", "")
    return (
        *start,
        f"{at.setting:.0e}",
        f"{at.error:.1e} m",
        f"{at.steps}",
        f"{at.cost:.2f} s",
        f"{match.ratio:.1f}",
    )

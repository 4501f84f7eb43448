"""Our engines against the script one would write by hand, at the same error of S."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from benchmarks import strike
from benchmarks.measuring import (
    LONG,
    Measured,
    Table,
    cheapest,
    climb,
    cost_at,
    ladder,
    repeated,
)
from benchmarks.naive_exudyn import simulate_by_hand
from benchmarks.variants import VARIANTS, Variant

SCRIPT = "by hand"
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
    for variant in VARIANTS:
        strike.warm_up(variant)
    found = cheapest(
        {variant.name: partial(ours, variant, min(errors)) for variant in VARIANTS},
        {variant.name: ladder(variant.first) for variant in VARIANTS},
        errors,
        budget,
    )
    timed: dict[str, Callable[[float], object]] = {
        SCRIPT: simulate_by_hand,
        **{variant.name: partial(strike.run, variant) for variant in VARIANTS},
    }
    points = {(SCRIPT, point.setting): point for point in naive} | found
    found = repeated(timed, points, repeat - 1)
    naive = [found[SCRIPT, point.setting] for point in naive]
    matches = []
    for error in errors:
        cost, beyond = cost_at(naive, error)
        for variant in VARIANTS:
            at = found.get((variant.name, error))
            matches.append(Match(error, cost, beyond, variant, at))
    return naive, matches


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

"""Our engines against SciPy's DOP853 on a Lagrangian in numpy, at 1e-7 m."""

from __future__ import annotations

from functools import partial

import numpy as np

from benchmarks import numpy_lagrangian, strike
from benchmarks.measuring import Measured, Table, cheapest, ladder, repeated
from benchmarks.variants import VARIANTS, Variant

ERROR = 1e-7  # m
PART, BEFORE = 0.414, 0.05  # s: 0.1 s after the first contact; before it
BUDGET = 40.0  # s
FIRST = 1e-4  # tolerance


def by_scipy(until: float | None, tolerance: float) -> tuple[float, int]:
    """Error of SciPy (m) at a tolerance, and how often the right-hand side was evaluated."""
    time, position, _ = strike.tight(until)
    motion = numpy_lagrangian.strike(time, tolerance)
    off = np.linalg.norm(motion.position - position, axis=1)
    return float(off.max()), motion.evaluations


def ours(variant: Variant, until: float | None, rung: float) -> tuple[float, int]:
    """Error of a variant (m) at a rung, and its number of steps."""
    result = strike.run(variant, rung, until=until)
    return strike.error(result, finer=True, until=until), result.checks.steps


def measure(until: float | None, repeat: int) -> dict[str, Measured | None]:
    """The cheapest run at `ERROR` by name, SciPy's first."""
    strike.tight(until)  # not on anyone's bill
    runs = {"scipy": partial(by_scipy, until)}
    rungs = {"scipy": ladder(FIRST)}
    for variant in VARIANTS:
        strike.warm_up(variant)
        runs[variant.name] = partial(ours, variant, until)
        rungs[variant.name] = ladder(variant.first)
    found = repeated(runs, cheapest(runs, rungs, [ERROR], BUDGET), repeat - 1)
    return {name: found.get((name, ERROR)) for name in runs}


def tables(quick: bool = False, repeat: int = 3, full: bool = False) -> list[Table]:
    """Measure, and tell it."""
    until = None if full else (BEFORE if quick else PART)
    found = measure(until, repeat)
    scipy = found["scipy"]
    costs = {name: point.cost for name, point in found.items() if point and name != "scipy"}
    what = f"the first {until} s of the strike" if until else "the strike, two turns"
    told = f"SciPy does not reach {ERROR:.0e} m."
    if scipy and costs:
        best = min(costs, key=lambda name: costs[name])
        told = (
            f"At {ERROR:.0e} m, over {what}, '{best}' is {scipy.cost / costs[best]:.2g} times as "
            "fast as SciPy on numpy."
        )
    rows = tuple(_row(name, point, scipy) for name, point in found.items())
    return [
        Table(
            f"DOP853 on a numpy Lagrangian, and ours, at {ERROR:.0e} m: {what}",
            ("by", "setting", "its error", "steps (scipy: evaluations)", "processor time", "ratio"),
            rows,
            told,
        )
    ]


def _row(name: str, point: Measured | None, scipy: Measured | None) -> tuple[str, ...]:
    if point is None:
        return (name, "not reached", "", "", "", "")
    ratio = f"{scipy.cost / point.cost:.2f}" if scipy else ""
    told = (f"{point.setting:.0e}", f"{point.error:.1e} m", f"{point.steps}")
    return (name, *told, f"{point.cost:.2f} s", ratio)

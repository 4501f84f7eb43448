"""A run whose own numbers say that it is wrong is made again, more accurately, and says so."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import nan, sqrt

from exudyn_flexlink.engines.guards import doubts, limits, refusal
from exudyn_flexlink.result import INTERRUPTED, Result
from exudyn_flexlink.scene import Scene

TIGHTER = (0.1, 0.01)  # times the tolerance that the scene asks for
LONG = 50_000  # steps: to make a longer run again takes minutes; it is told only
DEAR = 3.0  # times the steps: a method for which a tenth costs more is not asked twice


def guarded(result: Result, again: Callable[[Scene], Result]) -> tuple[Result, bool]:
    """Return a run, or a more accurate one in its place, with all that is to be said of it.

    Also tell whether the user interrupted one that was made `again`. Runs at local tolerances, or
    with a step of the user's own, are not made again; nor are long ones, and those that stopped.
    """
    scene, told, interrupted = result.scene, list[str](), False
    made_at = float(result.settings.get("tolerance", nan))
    for factor in TIGHTER:
        wrong = doubts(result)
        if not wrong or not _mendable(result):
            break
        finer = again(tightened(scene, factor, made_at))
        if not finer.outcome.completed:
            interrupted = finer.outcome.reason == INTERRUPTED
            break
        told.append(_made_again(result, finer, wrong[0]))
        dear = finer.checks.steps > DEAR * result.checks.steps
        spent = {name: s + result.timings.get(name, 0.0) for name, s in finer.timings.items()}
        result = replace(finer, scene=scene, timings=spent)
        if dear:
            break
    warnings = (*told, *result.warnings, *doubts(result), *limits(result))
    end = refusal(result) if result.outcome.completed else None
    return replace(result, warnings=warnings, outcome=end or result.outcome), interrupted


def tightened(scene: Scene, factor: float, tolerance: float | None = None) -> Scene:
    """Return a scene with a tolerance, and steps per contact, that are more accurate.

    Without a `tolerance` (m) the scene's own is made smaller.
    """
    accuracy, solver = scene.accuracy, scene.solver
    tolerance = tolerance or accuracy.tolerance
    assert tolerance is not None
    steps = round(solver.steps_per_contact / sqrt(factor))
    return scene.changed(
        accuracy=accuracy.model_copy(update={"tolerance": factor * tolerance}),
        solver=solver.model_copy(update={"steps_per_contact": steps}),
    )


def _mendable(result: Result) -> bool:
    short = result.checks.steps <= LONG
    return short and result.outcome.completed and "tolerance" in result.settings


def _made_again(before: Result, after: Result, wrong: str) -> str:
    first, then = (float(result.settings["tolerance"]) for result in (before, after))
    what = wrong.split(": ", maxsplit=1)[0]
    return f"at a tolerance of {first:.3g} m {what}; made again at {then:.3g} m"

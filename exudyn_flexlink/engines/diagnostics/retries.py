"""A run whose numbers are doubtful may be made again, with steps that err less."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from exudyn_flexlink.engines.diagnostics.consistency import doubts
from exudyn_flexlink.engines.diagnostics.neighbour import retuned
from exudyn_flexlink.result import INTERRUPTED, Result
from exudyn_flexlink.scene import Scene

TIGHTER = 0.1  # errors of the steps of a run that is made again, over those before
_UNITS = {"tolerance": "m", "step": "s"}


def retried(result: Result, solve: Callable[[Scene], Result], retries: int) -> tuple[Result, bool]:
    """Return a run, or a more accurate one made by `solve` in its place, which says so.

    A run without doubts, or that stopped, is left. Also tell whether the user interrupted one that
    was made again: the one before is then returned.
    """
    scene, told = result.scene, list[str]()
    asked = scene
    for _ in range(retries):
        wrong = doubts(result)
        if not wrong or not result.outcome.completed:
            break
        before, asked = asked, retuned(scene, result, TIGHTER)
        if asked == before:  # no tolerance is less
            break
        finer = solve(asked)
        if not finer.outcome.completed:
            return _told(result, told), finer.outcome.reason == INTERRUPTED
        told.append(_made_again(result, finer, wrong[0]))
        spent = {name: s + result.timings.get(name, 0.0) for name, s in finer.timings.items()}
        result = replace(finer, scene=scene, timings=spent)
    return _told(result, told), False


def _told(result: Result, told: list[str]) -> Result:
    return replace(result, warnings=(*told, *result.warnings))


def _made_again(before: Result, after: Result, wrong: str) -> str:
    key, unit = next((key, unit) for key, unit in _UNITS.items() if key in before.settings)
    first, then = (float(result.settings[key]) for result in (before, after))
    what = wrong.split(": ", maxsplit=1)[0]
    return f"at a {key} of {first:.3g} {unit} {what}; made again at {then:.3g} {unit}"

"""How a run is made and how it ended, of every engine; and no mechanics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import inf, pi
from time import perf_counter
from typing import TypeVar

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.mechanism import Contact, Mechanism, cut_off
from exudyn_flexlink.result import Integrator, Outcome, Result
from exudyn_flexlink.scene import Scene

RADAU = Integrator("Radau IIA", 9)
TOO_DEEP_ADVICE = "take a law without such a bound: 'formula: sphere', or one with a stiffness"


class DepthBounds:
    """Penetrations (m) of contacts (c,) beyond which their laws have no force."""

    def __init__(self, contacts: Sequence[Contact]) -> None:
        self._names = [contact.name for contact in contacts]
        laws = [contact.law for contact in contacts]
        bounds = [inf if isinstance(law, Impulse) else law.deepest for law in laws]
        self._bounds = np.array(bounds, dtype=np.float64)
        self.any = bool(np.isfinite(self._bounds).any())

    def passed(self, depths: FloatArray) -> str:
        """Say which contact is too deep, of depths (c,), m; empty if none is."""
        beyond = np.flatnonzero(depths > self._bounds)
        if not len(beyond):
            return ""
        k = int(beyond[0])
        bound = f"beyond {self._bounds[k]:.4g} m its law has no force"
        return f"'{self._names[k]}' was pressed {depths[k]:.4g} m deep: {bound}"


def outcome_of(
    scene: Scene,
    mechanism: Mechanism,
    time: float,
    left: float | None,
    reasons: Sequence[tuple[str, str]],
) -> Outcome:
    """Outcome of a run that came to `time` (s): failed, if turns are still to be made.

    `left` is the angle still to turn (rad); None where the end was known beforehand. It failed for
    the first of `reasons` that is not empty; each has an advice.
    """
    for reason, advice in reasons:
        if reason:
            return Outcome(False, time, reason, advice)
    missing = cut_off(scene, mechanism) if left is None else left
    if missing <= 0:
        return Outcome(True, time)
    run = scene.run
    turns = run.turns or 0.0
    return Outcome(
        False,
        time,
        f"'at_most' was reached when joint '{run.of}' had made {turns - missing / (2 * pi):.3g} "
        f"turns of {turns:g}",
        "raise 'at_most', or a drive's value" if scene.drives else "raise 'at_most'",
    )


Prepared = TypeVar("Prepared")
Complaint = TypeVar("Complaint")


def timed(
    prepare: Callable[[], Prepared],
    solve: Callable[[Prepared], Complaint],
    finish: Callable[[Prepared, Complaint], Result],
) -> Result:
    """Make a run, and take the time of its three parts."""
    began = perf_counter()
    prepared = prepare()
    ready = perf_counter()
    complaint = solve(prepared)
    solved = perf_counter()
    result = finish(prepared, complaint)
    done = perf_counter()
    timings = {"prepare": ready - began, "solve": solved - ready, "process": done - solved}
    return replace(result, timings=timings)

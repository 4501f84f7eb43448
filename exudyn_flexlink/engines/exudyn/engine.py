"""The only import of Exudyn: its console, types of items, and advice if it finds no solution."""

from __future__ import annotations

import sys
from contextlib import redirect_stdout
from io import StringIO
from typing import Any

from exudyn_flexlink.engines.diagnostics import TINY_STEP
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.mechanism import Assembly, least_tolerance

# The range-checked build is meant for writing models by hand; ours are checked before they get
# here. Whoever has loaded Exudyn already keeps the build they chose.
if "exudyn" not in sys.modules:
    sys.exudynFast = True  # type: ignore[attr-defined]

with redirect_stdout(StringIO()):  # it announces that build on standard output
    import exudyn
    from exudyn import advancedUtilities, itemInterface

exudyn.config.printToConsole = False

Engine: Any = exudyn
items: Any = itemInterface
utilities: Any = advancedUtilities


NO_SOLUTION = "the solver found no solution even with its smallest step"
NEAR_ROUNDING = 1e3  # times the least tolerance: from there on it is no help to tighten one
LOCKED_ADVICE = "look at the mechanism there; start elsewhere, or change lengths so that it passes"


def no_solution_advice(
    assembly: Assembly, tolerance: float | None, shortest: float = 0.0, time: float = 0.0
) -> str:
    """Say what to try where no step was short enough.

    `tolerance` (m) is that of the run, None with steps of the user's own. `shortest` (s) is the
    shortest step that is made at the `time` (s) that the run has come to.
    """
    if shortest > TINY_STEP:
        return (
            f"shorten the run: at {time:.3g} s no step below {shortest:.2g} s is made, which may "
            "be too long for what happens there"
        )
    if tolerance is None:
        knob = "shorten the step, "
    elif tolerance < NEAR_ROUNDING * least_tolerance(assembly):
        knob = f"loosen the tolerance: {tolerance:g} m is near what rounding allows; else "
    else:
        knob = "tighten the tolerance, "
    contacts = assembly.mechanism.contacts
    if contacts and all(isinstance(contact.law, Impulse) for contact in contacts):
        soften = "give the contact a law with stiffness"
    else:
        soften = "soften the contact (less stiffness or friction, or a larger transition_speed)"
    return f"{knob}{soften}, or look at the mechanism there: it may be about to lock"

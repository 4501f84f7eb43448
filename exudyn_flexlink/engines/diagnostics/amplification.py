"""Where the error of a run may be larger than its steps foresee, so that it has to be measured."""

from __future__ import annotations

from collections.abc import Iterator
from math import log

import numpy as np

from exudyn_flexlink.engines.diagnostics.contacts import struck
from exudyn_flexlink.engines.diagnostics.releases import Release, releases
from exudyn_flexlink.observables import joints_with_play
from exudyn_flexlink.result import Result, laps_begun

FEW_BOUNCES = 3  # in a row: one strike of a flexible link may be a burst of so many
# Errors after a release, over those before: steps leave a tenth of the tolerance before a release
# (scripts/random_scenes.py, seed 7), so that less growth keeps it. Likewise of unstable motion.
LARGE_GROWTH = 10.0
# Steps that fast vibrations last over. Those of the paper's link, which is damped, last over far
# fewer; without damping a link may be off by 1.4 tolerances after so many (tests/test_instability).
MANY_STEPS = 500


def beyond_steps(result: Result) -> str:
    """Say why a run may be off by more than its steps foresee; empty if nothing speaks for it."""
    if reason := multiplying(result):
        return reason
    if reason := aiming(result):
        return f"its steps only aim at the tolerance ({reason})"
    return ""


def multiplying(result: Result) -> str:
    """Say what may have multiplied errors beyond what steps foresee; empty if nothing did."""
    found = [
        *_rattling(result),
        *_bouncing(result),
        *_sliding_off(result),
        *_unstable(result),
        *_ringing(result),
    ]
    return "; ".join(found)


def aiming(result: Result) -> str:
    """Say why a run only aims at its tolerance; empty if it controls its error.

    Steps of order 2, whose number in a contact is fixed.
    """
    steps = result.settings.get("steps_per_contact")
    if result.scene.accuracy.tolerance is None or steps is None:
        return ""
    return f"{float(steps):g} steps for a strike" if struck(result) else "steps of order 2"


def rattled(result: Result) -> bool:
    """Tell whether anything touched a wall, or a journal its bearing."""
    return any(len(result.intervals[name]) for name in joints_with_play(result))


def _rattling(result: Result) -> Iterator[str]:
    """Joints with play: touches of walls multiply errors, and so do swings free of them."""
    for name in joints_with_play(result):
        count = len(result.intervals[name])
        what = "bearing" if name in result.bearings else "walls"
        if count:
            yield f"errors grow with every touch ({count} of the {what} of '{name}')"
        else:
            yield f"errors grow where there is play ('{name}', without a touch)"


def _bouncing(result: Result) -> Iterator[str]:
    """Strikes in a row: each adds the last one's error of time and speed, more so off a lever."""
    laps = [-np.inf, *laps_begun(result.laps), np.inf]
    for name, contact in result.contacts.items():
        count = int(np.histogram(contact.touches.begin, laps)[0].max())
        if count > FEW_BOUNCES:
            yield f"errors grow with every strike ({count} of '{name}' in a row)"


def _unstable(result: Result) -> Iterator[str]:
    """Motion that its neighbours leave: of a double pendulum by itself, of a pinball by strikes."""
    if result.checks.e_folds > log(LARGE_GROWTH):
        digits, why = result.checks.e_folds / log(10), "the motion is unstable"
        why += ", or strikes scatter" if result.contacts else ""
        yield f"{why}: errors may grow by up to {digits:.2g} powers of ten"


def _ringing(result: Result) -> Iterator[str]:
    """Vibrations that hardly decay: they keep the errors of steps, and of strikes."""
    if (steps := result.checks.ringing) > MANY_STEPS:
        yield f"vibrations are hardly damped, and errors last as long as they: {steps:.0f} steps"


def _sliding_off(result: Result) -> Iterator[str]:
    """Of each contact, the release that multiplies errors most."""
    worst: dict[str, Release] = {}
    for release in releases(result):
        known = worst.get(release.contact)
        if release.growth > LARGE_GROWTH and (known is None or release.growth > known.growth):
            worst[release.contact] = release
    for name, release in worst.items():
        yield (
            f"the point of '{name}' crept off the end of its face at {release.time:.6g} s, at "
            f"{release.creep:.2g} m/s, and set free what it had pressed: errors are "
            f"{release.growth:.2g} times as large from then on"
        )

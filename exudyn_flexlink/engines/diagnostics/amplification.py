"""Where the error of a run may be larger than its steps foresee, so that it has to be measured."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from exudyn_flexlink.engines.diagnostics.consistency import kinetic
from exudyn_flexlink.engines.diagnostics.contacts import struck
from exudyn_flexlink.mechanism import build_mechanism
from exudyn_flexlink.observables import sleeves_with_play
from exudyn_flexlink.result import Result

FEW_BOUNCES = 3  # in a row: one strike of a flexible link may be a burst of so many
SLOW_SLIDE = 1e-3  # of the fastest motion: slower, errors of a place grow a thousand times (below)


def multiplying(result: Result) -> str:
    """Say what may have multiplied errors beyond what steps foresee; empty if nothing did."""
    return "; ".join([*_rattling(result), *_bouncing(result), *_sliding_off(result)])


def aiming(result: Result) -> str:
    """Say why a run only aims at its tolerance; empty if it controls its error.

    Steps of order 2, whose number in a contact is fixed.
    """
    steps = result.settings.get("steps_per_contact")
    if result.scene.accuracy.tolerance is None or steps is None:
        return ""
    return f"{float(steps):g} steps for a strike" if struck(result) else "steps of order 2"


def _rattling(result: Result) -> Iterator[str]:
    """Links with play: touches of walls multiply errors, and so do swings free of them."""
    for name in sleeves_with_play(result):
        count = len(result.sleeves[name].touches)
        yield f"{count} touches of the walls of '{name}'" if count else f"play in '{name}'"


def _bouncing(result: Result) -> Iterator[str]:
    """Strikes in a row: each adds the last one's error of time and speed, more so off a lever."""
    laps = [-np.inf, *(lap.time for lap in result.laps), np.inf]
    for name, contact in result.contacts.items():
        count = int(np.histogram(contact.touches.begin, laps)[0].max())
        if count > FEW_BOUNCES:
            yield f"{count} strikes of '{name}' in a row"


def _sliding_off(result: Result) -> Iterator[str]:
    """Points that crept off the end of a face, where what was bent springs back at once.

    An error of the place (m) is one of the instant, place / speed of creeping; what springs back
    is then off by that times its own speed.
    """
    parts = build_mechanism(result.scene).parts
    fastest = float(np.sqrt(2 * kinetic(result) / sum(part.mass for part in parts)))
    for name, contact in result.contacts.items():
        off = contact.touches.where(contact.touches.slides_off)
        speeds = np.abs(off.end_place - off.place) / np.maximum(off.end - off.begin, 1e-300)
        if speeds.min(initial=np.inf) < SLOW_SLIDE * fastest:
            k = int(np.argmin(speeds))
            yield (
                f"the point of '{name}' crept off its face's end at {off.end[k]:.6g} s, at about "
                f"{speeds[k]:.2g} m/s, and what was bent sprang back at {fastest:.2g} m/s or more"
            )

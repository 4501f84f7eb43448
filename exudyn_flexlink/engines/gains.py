"""What both engines say of impacts that give more energy than they took: none may."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from exudyn_flexlink.intervals import Intervals
from exudyn_flexlink.result import Result

GAIN = 1e-4  # of the largest kinetic energy, in one impact: more is no rounding
GAIN_ADVICE = "tighten the tolerance, raise 'steps_per_contact', or shorten the step"


def gaining_impacts(result: Result, kinetic: float) -> list[str]:
    """Warn of impacts that gain energy; `kinetic` is the largest kinetic energy, J."""
    last = float(result.time[-1])
    gaining = [
        (float(gain), float(end), name)
        for name, touches in (*_of_contacts(result), *_of_sleeves(result))
        for gain, end in zip(-touches.energy_lost, touches.until(last), strict=True)
        if gain > GAIN * kinetic
    ]
    if not gaining:
        return []
    gain, at, name = max(gaining)
    return [
        f"{_told(len(gaining))}, that of '{name}' at {at:.6g} s "
        f"{gain:.3g} J, {gain / kinetic:.2g} of the largest kinetic energy: {GAIN_ADVICE}"
    ]


def _told(count: int) -> str:
    if count == 1:
        return "an impact gives more energy than it takes"
    return f"{count} impacts give more energy than they take"


def _of_contacts(result: Result) -> Iterator[tuple[str, Intervals]]:
    """Name and intervals of every contact; of one that lasts it is not known yet."""
    for name, contact in result.contacts.items():
        yield name, contact.touches.where(np.isfinite(contact.touches.end))


def _of_sleeves(result: Result) -> Iterator[tuple[str, Intervals]]:
    """Name of every sleeve, and the touch that gained most."""
    for name, sleeve in result.sleeves.items():
        if len(sleeve.touches):
            yield name, sleeve.touches.where(np.argmin(sleeve.touches.energy_lost, keepdims=True))

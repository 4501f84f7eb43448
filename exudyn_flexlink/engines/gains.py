"""What both engines say of impacts that give more energy than they took: none may."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from exudyn_flexlink.result import Event, SleeveHistory

GAIN = 1e-4  # of the largest kinetic energy, in one impact: more is no rounding
GAIN_ADVICE = "tighten the tolerance, raise 'steps_per_contact', or shorten the step"


def gaining_impacts(
    events: Sequence[Event], sleeves: Mapping[str, SleeveHistory], kinetic: float
) -> list[str]:
    """Warn of impacts that gain energy; `kinetic` is the largest kinetic energy, J."""
    found = [
        *((gain, at, name) for gain, at, name in _of_contacts(events)),
        *((gain, at, name) for gain, at, name in _of_sleeves(sleeves)),
    ]
    gaining = [one for one in found if one[0] > GAIN * kinetic]
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


def _of_contacts(events: Sequence[Event]) -> Iterator[tuple[float, float, str]]:
    """Energy gained (J), end (s) and name of every contact that ended."""
    for event in events:
        if "energy_lost" in event.details:
            yield -event.details["energy_lost"], event.time, event.name


def _of_sleeves(sleeves: Mapping[str, SleeveHistory]) -> Iterator[tuple[float, float, str]]:
    """Likewise of the touch of each sleeve that gained most."""
    for name, sleeve in sleeves.items():
        lost = sleeve.touches.energy_lost
        if len(lost):
            k = int(np.argmin(lost))
            yield -float(lost[k]), float(sleeve.touches.end[k]), name

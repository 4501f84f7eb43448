"""Slow motion: stretches of time around strikes, and touches in joints with clearance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.observables import joints_with_play, strikes
from exudyn_flexlink.result import Result
from exudyn_flexlink.source import did_you_mean

ANY = "strike"
"""What stands for the strikes of all contacts, unless a contact has that name."""

BEFORE, AFTER = 0.3, 1.0  # of its duration: how long before and after a strike is seen, too
BRIEFEST, LONGEST = 0.004, 0.03  # of the run: a strike is seen no shorter, as an impact would be,
# and no longer: of what then lies on the other, the begin


@dataclass(frozen=True)
class Slow:
    """Asks for slow motion: a contact, or joint with clearance, by its name; which of its strikes.

    `number` counts from 1; None: all of them.
    """

    name: str = ANY
    number: int | None = None

    @classmethod
    def of(cls, text: str) -> Slow:
        """Read 'NAME', or 'NAME:2' for the second strike.

        Raises:
            ValueError: what follows the colon is no number from 1.

        """
        name, colon, number = text.partition(":")
        if not colon:
            return cls(name.strip())
        if not number.strip().isdecimal() or int(number) < 1:
            raise ValueError(f"'{text}' is no name, nor a name and a number, such as 'strike:2'")
        return cls(name.strip(), int(number))

    @property
    def told(self) -> str:
        """What is asked for, in words."""
        return f"'{self.name}'" if self.number is None else f"'{self.name}' number {self.number}"


class Stretch(NamedTuple):
    """From `begin` to `end`, s."""

    begin: float
    end: float


def around_strikes(result: Result) -> tuple[Stretch, ...]:
    """Stretches of time around the strikes of all contacts."""
    return _joined(result, _strikes(result, *result.scene.all_contacts))


def around(result: Result, asked: Slow) -> tuple[Stretch, ...]:
    """Stretches of time that slow motion is asked for.

    Raises:
        ValueError: there are none.

    """
    known = {name: _strikes(result, name) for name in result.scene.all_contacts}
    for joint in joints_with_play(result):
        own = result.intervals[joint]
        known[joint] = list(zip(own.begin.tolist(), own.until(result.time[-1]), strict=True))
    found = known.get(asked.name)
    if found is None and asked.name == ANY and result.scene.all_contacts:
        found = _strikes(result, *result.scene.all_contacts)
    if found is None:
        listed = ", ".join(f"'{name}'" for name in known) or "none"
        hint = did_you_mean(asked.name, known) or f"; there is: {listed}"
        raise ValueError(f"no contact or joint with clearance '{asked.name}'{hint}")
    if not found:
        raise ValueError(f"nothing touched in '{asked.name}': no slow motion")
    if asked.number is None:
        return _joined(result, found)
    if not 1 <= asked.number <= len(found):
        many = f"it struck {len(found)} times" if len(found) > 1 else "it struck once"
        raise ValueError(f"no strike number {asked.number} of '{asked.name}': {many}")
    return _joined(result, [found[asked.number - 1]])


def _strikes(result: Result, *contacts: str) -> list[tuple[float, float]]:
    """Begins and ends (s) of the strikes of some contacts, in order."""
    found = [strike for name in contacts for strike in strikes(result, name)]
    return sorted((strike.begin, strike.end) for strike in found)


def _joined(result: Result, strikes_: list[tuple[float, float]]) -> tuple[Stretch, ...]:
    """Stretches around strikes in order; those that meet are one."""
    least, most = np.array([BRIEFEST, LONGEST]) * float(result.time[-1] - result.time[0])
    found: list[Stretch] = []
    for begin, end in strikes_:
        length = float(np.clip(end - begin, least, most))
        own = Stretch(begin - BEFORE * length, begin + (1 + AFTER) * length)
        if found and own.begin <= found[-1].end:
            found[-1] = Stretch(found[-1].begin, max(found[-1].end, own.end))
        else:
            found.append(own)
    return tuple(found)

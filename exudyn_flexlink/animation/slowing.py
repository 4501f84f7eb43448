"""Slow motion: stretches of time around strikes, and touches in joints with clearance."""

from __future__ import annotations

from dataclasses import dataclass

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


@dataclass(frozen=True)
class Stretch:
    """From `begin` to `end`, s."""

    begin: float
    end: float

    def meets(self, begin: float, end: float) -> bool:
        """Whether any of it is between two instants."""
        return self.begin < end and self.end > begin

    def within(self, begin: float, end: float) -> Stretch:
        """The part of it that is between two instants."""
        return Stretch(max(self.begin, begin), min(self.end, end))


@dataclass(frozen=True)
class Slowed:
    """Stretches that were asked for, those of all strikes, and what was asked for in vain."""

    asked: tuple[Stretch, ...]
    all: tuple[Stretch, ...]
    mistakes: list[str]


def slowed(result: Result, asked: Slow | None) -> Slowed:
    """Find the stretches of time that slow motion is for."""
    scene = result.scene
    every = [stretch for name in scene.contacts for stretch in _of_contact(result, name)]
    whole = _joined(result, sorted(every))
    if asked is None:
        return Slowed((), whole, [])
    if asked.name in scene.contacts:
        found = _of_contact(result, asked.name)
    elif asked.name in joints_with_play(result):
        touches = result.intervals[asked.name]
        found = list(zip(touches.begin.tolist(), touches.until(result.time[-1]), strict=True))
    elif asked.name == ANY and scene.contacts:
        found = sorted(every)
    else:
        known = [*scene.contacts, *joints_with_play(result)]
        hint = did_you_mean(asked.name, known)
        listed = ", ".join(f"'{name}'" for name in known) or "none"
        told = f"no contact or joint with clearance '{asked.name}'{hint or f'; there is: {listed}'}"
        return Slowed((), whole, [told])
    if not found:
        return Slowed((), whole, [f"nothing touched in '{asked.name}': no slow motion"])
    if asked.number is not None and not 1 <= asked.number <= len(found):
        many = f"it struck {len(found)} times" if len(found) > 1 else "it struck once"
        return Slowed((), whole, [f"no strike number {asked.number} of '{asked.name}': {many}"])
    chosen = found if asked.number is None else [found[asked.number - 1]]
    return Slowed(_joined(result, chosen), whole, [])


def _of_contact(result: Result, name: str) -> list[tuple[float, float]]:
    return [(strike.begin, strike.end) for strike in strikes(result, name)]


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

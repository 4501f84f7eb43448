"""Bounces of rigid contacts: when they are over or won't end, and what one passes on to others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log

REST_SPEED = 1e-6  # m/s: an approach slower than this is no impact any more
LEAST_FLIGHT = 1e-9  # s: a bounce that would be over sooner is none either
SUNK = 1e-2  # of the fastest approach of a contact: what slower ones do is no motion to be seen
MOST_SUNK = 1000  # sunk impacts in a row: some seconds of work
MOST_LEFT = 100_000  # that restitution may still need to end them: some minutes
LOSE_SPEED = "a smaller restitution, which ends the bounces, or a law with stiffness"


@dataclass
class Bounces:
    """Impacts of the contact `name`; `fastest` (m/s) is the approach of the fastest so far."""

    name: str
    restitution: float
    fastest: float = 0.0
    _sunk: int = 0  # impacts in a row far slower than that
    _since: float = 0.0  # time of the first of them

    def endless(self, time: float, approach_speed: float) -> str:
        """Take an impact; say so if the contact has bounced on the spot for long, without an end.

        The bounces of an elastic contact that is pressed get ever shorter but never end, since no
        speed is lost; those of restitution e end after ``ln(v / REST_SPEED) / ln(1 / e)`` more.
        """
        if approach_speed >= SUNK * self.fastest:
            self.fastest, self._sunk = max(self.fastest, approach_speed), 0
            return ""
        self._since = time if self._sunk == 0 else self._since
        self._sunk += 1
        left = log(max(approach_speed / REST_SPEED, 1.0))
        if self._sunk < MOST_SUNK or self.restitution == 0:
            return ""
        if left < -MOST_LEFT * log(self.restitution):
            return ""
        return (
            f"contact '{self.name}' bounces on the spot: {self._sunk} impacts within "
            f"{time - self._since:.2g} s, at {approach_speed:.2g} m/s, and a restitution of "
            f"{self.restitution:g} won't end them"
        )


def passed_on(together: Sequence[tuple[float, Sequence[str]]], law: str) -> list[str]:
    """Say that impacts went through several contacts, at instants (s), and how they are solved."""
    return [
        f"contacts {', '.join(map(repr, names))} took up one impact at {time:.4g} s, the first of "
        f"{len(together)} such: Newton's law of impact holds for {law}, and those that only touch "
        "do not bounce; in which order bodies that touch strike one another is not modelled, and "
        "changes their speeds: leave a little play, or give a law with stiffness, and compare"
        for time, names in together[:1]
    ]


def is_over(approach_speed: float, restitution: float, gap_acceleration: float) -> bool:
    """Tell whether the next bounce is so small that the contact lasts instead.

    `gap_acceleration` (m/s^2) is that without contact force: where it presses (negative), a bounce
    takes ``2 e v_a/|g''|``, and an endless sequence of them only a finite time.
    """
    if approach_speed < REST_SPEED:
        return True
    flight = 2 * restitution * approach_speed
    return 0 < flight < LEAST_FLIGHT * -gap_acceleration

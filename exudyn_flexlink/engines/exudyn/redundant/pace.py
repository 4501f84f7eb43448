"""How short steps are in contact: by the scene's steps per contact, or the user's own."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from exudyn_flexlink.laws import RestitutionPenalty

FEWEST_STEPS = 5  # per contact: with fewer an impact is wrong, whatever the law says
NEARLY_LOSSLESS, LOSSLESS_STEPS = 0.99, 2.0  # restitution, and times the steps
ENOUGH_STEPS = 30  # per contact: restitution is then right to 1 %


@dataclass(frozen=True)
class Pace:
    """Half the period of a contact's stiffness with the least mass on it, and its step, s.

    An infinite step is that of the user, who gave one.
    """

    half_period: float
    step: float


def steps_of(law: RestitutionPenalty, asked: int) -> float:
    """Return the steps of a strike, of those asked for.

    An impact that loses nothing shall not lose by the steps: with 60 it would be 1e-5 of the
    kinetic energy each, with twice as many an eighth of that.
    """
    return asked * (LOSSLESS_STEPS if law.restitution > NEARLY_LOSSLESS else 1.0)


def pace_of(half_period: float, steps: float, given: float | None) -> Pace:
    """Return the pace that takes so many steps for a contact (s), or the `given` step (s).

    A given step that leaves too few for an impact is not taken there.
    """
    if given is not None and not too_long(given, half_period):
        return Pace(half_period, inf)
    return Pace(half_period, half_period / steps)


def too_long(given: float, half_period: float) -> bool:
    """Tell whether a given step (s) is too long for a contact of half a period (s)."""
    return half_period < FEWEST_STEPS * given


def shortened(given: float, half_period: float, step: float) -> str:
    """Warn that contacts were resolved by steps (s) of their own."""
    return (
        f"steps of {given:.3g} s would leave {half_period / given:.2g} for a contact, where an "
        f"impact takes {FEWEST_STEPS} at least: in contact they were {step:.3g} s"
    )


def few_steps(steps: float) -> str:
    """Warn of few steps per contact."""
    return (
        f"{steps:.3g} steps per contact: below {ENOUGH_STEPS} the restitution is off by more than "
        "1 %; take smaller steps, or give a tolerance instead of a step"
    )

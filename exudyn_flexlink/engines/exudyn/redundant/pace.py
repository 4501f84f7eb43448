"""How short steps are in contact: by the scene's steps per contact, or the user's own."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from exudyn_flexlink.engines.diagnostics.contacts import too_long
from exudyn_flexlink.laws import RestitutionPenalty

NEARLY_LOSSLESS, LOSSLESS_STEPS = 0.99, 2.0  # restitution, and times the steps


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

"""How short steps are in a contact: by the scene's steps per contact, or the step that it gives."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from exudyn_flexlink.engines.diagnostics.contacts import too_long
from exudyn_flexlink.laws import RestitutionPenalty

ELASTIC = 0.99  # restitution of an impact that must not lose energy by its steps either
ELASTIC_STEPS = 2  # times the steps there: 60 lose 1e-5 of the energy in an impact, 120 an eighth


@dataclass(frozen=True)
class Resolution:
    """Half the period of a contact's stiffness with the least mass on it, and its step, s.

    The step is infinite where the one that the scene gives is short enough.
    """

    half_period: float
    step: float


def steps_of(law: RestitutionPenalty, asked: int) -> int:
    """Return the steps of a strike, of those asked for."""
    return asked * (ELASTIC_STEPS if law.restitution > ELASTIC else 1)


def resolution_of(half_period: float, steps: float, given: float | None) -> Resolution:
    """Return the resolution by so many steps for a contact, or by the `given` step (s).

    A given step that is too long for the contact is not taken there.
    """
    if given is not None and not too_long(given, half_period):
        return Resolution(half_period, inf)
    return Resolution(half_period, half_period / steps)

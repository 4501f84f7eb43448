"""Contact laws of a scene as the functions that engines evaluate."""

from __future__ import annotations

from exudyn_flexlink.laws import Friction, Impulse, RestitutionPenalty
from exudyn_flexlink.scene import ContactLaw, ImpulseLaw


def law_of(law: ContactLaw | ImpulseLaw) -> RestitutionPenalty | Impulse:
    """Return the law of a contact."""
    return Impulse(law.restitution) if isinstance(law, ImpulseLaw) else penalty_of(law)


def penalty_of(law: ContactLaw) -> RestitutionPenalty:
    """Return the pressing force of a penalty law."""
    return RestitutionPenalty(law.stiffness, law.restitution, law.transition_speed)


def friction_of(law: ContactLaw | ImpulseLaw) -> Friction | None:
    """Return the friction of a law, None where it is smooth."""
    if isinstance(law, ImpulseLaw) or law.friction == 0:
        return None
    return Friction(law.friction, law.slip_speed)

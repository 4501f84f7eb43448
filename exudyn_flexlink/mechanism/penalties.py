"""Pressing forces and impulses of the laws that a scene gives, also by materials and radii."""

from __future__ import annotations

from math import e, exp, pi, sqrt

from exudyn_flexlink.laws import (
    Impulse,
    LineContact,
    Penalty,
    PowerPenalty,
    PressingLaw,
    RestitutionPenalty,
    SpringDamper,
)
from exudyn_flexlink.scene import (
    ContactLaw,
    DampedLaw,
    HertzLaw,
    ImpulseLaw,
    PenaltyLaw,
    RubbingImpulse,
    Scene,
    StopLaw,
)


def pressing_law(
    scene: Scene, law: PenaltyLaw | StopLaw, radii: tuple[float, float] | None = None
) -> PressingLaw:
    """As `penalty_of`, also of stops of joints, and of impulses."""
    if isinstance(law, ImpulseLaw):
        slip = law.tangential_restitution if isinstance(law, RubbingImpulse) else 0.0
        return Impulse(law.restitution, slip)
    if isinstance(law, PenaltyLaw):
        return penalty_of(scene, law, radii)
    if law.restitution is None:
        return SpringDamper(law.stiffness, law.damping or 0.0)
    slow = law.transition_speed or RestitutionPenalty.transition_speed
    return RestitutionPenalty(law.stiffness, law.restitution, slow)


def penalty_of(scene: Scene, law: PenaltyLaw, radii: tuple[float, float] | None = None) -> Penalty:
    """Return the pressing force of a law; `radii` (m) are those that the contact itself has.

    That of a hollow is negative.
    """
    if isinstance(law, ContactLaw):
        return RestitutionPenalty(law.stiffness, law.restitution, law.transition_speed)
    if isinstance(law, DampedLaw):
        return PowerPenalty(law.stiffness, law.exponent, law.factor, law.transition_speed)
    if law.stiffness is not None:
        return PowerPenalty(law.stiffness, law.exponent or 1.5)
    return _by_materials(scene, law, law.radii or radii or ())


def _by_materials(scene: Scene, law: HertzLaw, radii: tuple[float, ...]) -> Penalty:
    """Force of elastic bodies: ``4/3 E sqrt(R) d^1.5``, or that of parallel cylinders.

    Spheres by H. Hertz (1882), which H. M. Lankarani and P. E. Nikravesh use for a pin in a bore,
    too. Cylinders by K. L. Johnson (1985), ``d = q/(pi E) [ln(4 pi E D/q) - 1]``, and by
    E. I. Radzimovsky (1953), ``d = q/(pi E) [2/3 + ln(16 R1 R2/b^2)]`` with the width
    ``b = 1.6 sqrt(2 q R1 R2/(D E))``; D is the sum of the radii, in a hollow their difference.
    """
    assert law.materials is not None  # the scene checks that there is one of both
    modulus = 1 / sum(_compliance(scene, name) for name in law.materials)
    if law.formula not in ("johnson", "radzimovsky"):
        return PowerPenalty(4 / 3 * modulus / sqrt(sum(1 / radius for radius in radii)))
    assert law.length is not None  # the scene checks it
    apart = abs(sum(radii))
    johnson = law.formula == "johnson"
    bound = modulus * apart * (4 * pi / e if johnson else 8 / 1.6**2 * exp(2 / 3))
    return LineContact(modulus, law.length, bound)


def _compliance(scene: Scene, name: str) -> float:
    """(1 - nu^2)/E of a material, 1/Pa."""
    material = scene.materials[name]
    assert material.poissons_ratio is not None  # the scene checks it
    return (1 - material.poissons_ratio**2) / material.youngs_modulus

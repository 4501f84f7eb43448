"""Laws of contacts in words."""

from __future__ import annotations

from exudyn_flexlink.laws import LineContact, PowerPenalty, PressingLaw, RestitutionPenalty
from exudyn_flexlink.report.text import number
from exudyn_flexlink.scene import DampedLaw, ImpulseLaw, Law, SlidePenalty, StopLaw, TurnPenalty


def law_told(law: Law | StopLaw, force: PressingLaw) -> list[str]:
    """Return what a law is, its restitution and its friction."""
    if isinstance(law, SlidePenalty | TurnPenalty):
        unit = ("N/m", "N s/m") if isinstance(law, SlidePenalty) else ("N m/rad", "N m s/rad")
        damped = f"c {number(law.damping or 0.0)} {unit[1]}"
        lossy = damped if law.restitution is None else f"restitution {number(law.restitution)}"
        return [f"k {number(law.stiffness)} {unit[0]}", lossy, ""]
    restitution = f"restitution {restitution_told(law)}"
    rub = getattr(law, "friction", 0.0)
    friction = f"friction {number(rub)}" if rub > 0 else ""
    if isinstance(law, ImpulseLaw):
        return ["rigid, by impulse", restitution, friction]
    name = getattr(law, "formula", None) or law.type
    if isinstance(force, LineContact):
        told = f"{name}, no force beyond {number(force.deepest)} m"
    elif isinstance(force, PowerPenalty):
        told = f"{name}, K {number(force.stiffness)} N/m^{number(force.exponent)}"
    else:
        told = f"k {number(force.stiffness)} N/m" if isinstance(force, RestitutionPenalty) else ""
    return [told, restitution, friction]


def restitution_told(law: Law | ImpulseLaw) -> str:
    """Return the restitution of a law, and which one it really gives if that is another."""
    asked = number(law.restitution)
    given = asked if not isinstance(law, DampedLaw) else number(law.returned)
    return asked if given == asked else f"{asked} asked, gives {given}"

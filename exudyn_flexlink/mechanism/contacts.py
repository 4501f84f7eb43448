"""Geometry of a contact, and the numbers of its law.

The geometry is gap and place, their rates, and the directions of forces. Pressing forces and
impulses follow from the laws of the scene, also by materials and radii.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import e, exp, inf, pi, sqrt
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.laws import (
    Impulse,
    LineContact,
    Penalty,
    PowerPenalty,
    PressingLaw,
    RestitutionPenalty,
    SpringDamper,
)
from exudyn_flexlink.mechanism.constraints import inertia_with_welded, length_along, welded_to
from exudyn_flexlink.mechanism.joints import GROUND, Anchor, Contact, FaceContact, Slide
from exudyn_flexlink.mechanism.model import Mechanism
from exudyn_flexlink.mechanism.shapes import ContactShapes, poses_of, vectors
from exudyn_flexlink.rounding import PLACE_ROUNDING
from exudyn_flexlink.scene import (
    ContactLaw,
    DampedLaw,
    HertzLaw,
    ImpulseLaw,
    PenaltyLaw,
    RubbingImpulse,
    Scene,
    SleeveJoint,
    StopLaw,
)


def pressing_law(
    scene: Scene, law: PenaltyLaw | StopLaw, radii: tuple[float, float] | None = None
) -> PressingLaw:
    """As `penalty_of`, also for stops of joints and for impulses."""
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
    """Return the pressing force of a law; `radii` (m) are those of the contact.

    The radius of a hollow is negative.
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

    For spheres the law of H. Hertz (1882), which H. M. Lankarani and P. E. Nikravesh also use for a
    pin in a bore. For cylinders K. L. Johnson (1985), ``d = q/(pi E) [ln(4 pi E D/q) - 1]``, and E.
    I. Radzimovsky (1953), ``d = q/(pi E) [2/3 + ln(16 R1 R2/b^2)]`` with the width ``b = 1.6 sqrt(2
    q R1 R2/(D E))``; D is the sum of the radii, or their difference in a hollow.
    """
    assert law.materials is not None  # the scene checks that one of both is given
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


HEAVY = 1e3  # times all other masses: a strike hardly moves a lever so heavy


class Approach(NamedTuple):
    """Gap and place of a contact, (...), as in `shapes.Look`; directions are vectors (..., 2)."""

    gap: FloatArray
    place: FloatArray
    gap_rate: FloatArray
    slip: FloatArray
    normal: FloatArray
    along: FloatArray
    grip: FloatArray


def on_the_contact(contact: Contact, place: float) -> bool:
    """Tell whether a place is between the ends of the contact; closed curves have no ends."""
    length = contact.length
    return length == inf or 0 <= place <= length


def far_behind(contact: Contact, look: Approach) -> bool:
    """Tell whether a point is behind a face or a curve by more than its length.

    Such a point counts as one that came round an end: the contact does not act.
    """
    if isinstance(contact, FaceContact) and contact.across:
        return False
    opposite = on_the_contact(contact, float(look.place))
    return opposite and float(look.gap) <= -contact.length


def pressed_at(contact: Contact, look: Approach) -> bool:
    """Tell whether a contact presses: the point is opposite the face, with penetration."""
    pressed = look.gap < -PLACE_ROUNDING and on_the_contact(contact, float(look.place))
    return bool(pressed) and not far_behind(contact, look)


def pressed_among(contacts: Sequence[Contact], q: FloatArray) -> list[int]:
    """Numbers of the contacts that press at coordinates (parts, 3), at time 0, without motion."""
    still = np.zeros_like(q)
    return [
        k
        for k, contact in enumerate(contacts)
        if pressed_at(contact, approach(contact, q, still, 0.0))
    ]


def pressing_at_start(scene: Scene, mechanism: Mechanism) -> dict[int, float]:
    """Speeds (m/s) at which the contacts touched that press at the start, by number."""
    numbers = mechanism.numbers
    return {
        numbers[name] + pair: speed
        for name, pairs in scene.initial.pressing.items()
        for pair, speed in pairs
    }


def idle_at_start(
    mechanism: Mechanism, q: FloatArray, v: FloatArray
) -> Iterator[tuple[Contact, str]]:
    """Yield contacts that do not act at time 0 although the point is opposite the face.

    A sentence goes with each. Coordinates and velocities are (parts, 3).
    """
    for contact in mechanism.contacts:
        look = approach(contact, q, v, 0.0)
        if far_behind(contact, look):
            what = "line" if isinstance(contact, FaceContact) else "curve"
            yield (
                contact,
                f"'{contact.name}' starts {-float(look.gap):.3g} m behind its {what}, which is "
                f"{contact.length:.3g} m long: it does not act until the point has come "
                "round an end; if that side is the free one, choose the other 'side'",
            )


def in_guides(
    scene: Scene, mechanism: Mechanism, q: FloatArray
) -> Iterator[tuple[str, FloatArray, FloatArray]]:
    """Yield every sleeve's name, and the first and last place (...) of its link along the guide.

    Places are in lengths of the guide: 0 and 1 are its mouths. `q` has shape (..., parts, 3).
    """
    points = mechanism.points
    for name, sleeve in scene.joints.items():
        if isinstance(sleeve, SleeveJoint):
            start, end = points[f"{sleeve.guide}.start"], points[f"{sleeve.guide}.end"]
            nodes = [Anchor(part, 0.0, 0.0) for part in mechanism.bodies[sleeve.link]]
            nodes.append(points[f"{sleeve.link}.end"])
            along = np.stack([length_along(Slide(name, start, node), q) for node in nodes])
            yield (
                name,
                *(extreme(along, axis=0) / (end.x - start.x) for extreme in (np.min, np.max)),
            )


def swings(mechanism: Mechanism) -> list[float]:
    """Times (s) by which struck levers turn an error of speed into an error of angle.

    It is 1/omega of the lever, with all parts welded to it, on its springs; infinite without a
    spring. Bodies without a pivot, or too heavy to be moved by a strike, have no time.
    """
    times, all_mass = [], sum(part.mass for part in mechanism.parts)
    for contact in mechanism.contacts:
        lever = contact.parts[1]
        pivot = _pivot(mechanism, lever)
        if pivot is None:
            continue
        inertia = inertia_with_welded(pivot, mechanism.parts, mechanism.welds)
        welded = welded_to(lever, mechanism.welds)
        mass = sum(mechanism.parts[part].mass for part in welded if part != GROUND)
        if inertia > HEAVY * (all_mass - mass) * mechanism.parts[lever].reach ** 2:
            continue
        held = {lever, GROUND}
        stiffness = sum(s.stiffness for s in mechanism.springs if {s.first, s.second} == held)
        times.append(float(np.sqrt(inertia / stiffness)) if stiffness > 0 else inf)
    return times


def _pivot(mechanism: Mechanism, part: int) -> Anchor | None:
    """Point of a part that is pinned to the ground."""
    for pin in mechanism.pins:
        for mine, other in ((pin.first, pin.second), (pin.second, pin.first)):
            if part == mine.part != GROUND == other.part:
                return mine
    return None


def approach(contact: Contact, q: FloatArray, v: FloatArray, t: FloatArray | float) -> Approach:
    """Gap, place, rates and directions at coordinates and velocities (..., parts, 3), at t (s)."""
    look = ContactShapes((contact,)).look(poses_of(q, v, t)).of(0)
    return Approach(*look.seen, vectors(look.normal), vectors(look.along), look.grip)


def gradient(contact: Contact, q: FloatArray) -> FloatArray:
    """Gradient (3 parts,) of a contact's gap: its rates at unit speeds."""
    units = np.eye(q.size).reshape(-1, *q.shape)
    return approach(contact, q, units, 0.0).gap_rate

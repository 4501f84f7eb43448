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


HEAVY = 1e3  # times all the rest: a lever that stands still as it is struck


class Approach(NamedTuple):
    """How near a contact is, (...): see `shapes.Look`; directions are vectors (..., 2)."""

    gap: FloatArray
    place: FloatArray
    gap_rate: FloatArray
    slip: FloatArray
    normal: FloatArray
    along: FloatArray
    grip: FloatArray


def on_the_contact(contact: Contact, place: float) -> bool:
    """Tell whether a place is one where the contact can act: what is closed has no ends."""
    length = contact.length
    return length == inf or 0 <= place <= length


def far_behind(contact: Contact, look: Approach) -> bool:
    """Tell whether a point is behind a face or a curve, and farther from it than that is long.

    There it counts as one that came beside the face, if it can: the contact lets it pass.
    """
    if isinstance(contact, FaceContact) and contact.across:
        return False
    opposite = on_the_contact(contact, float(look.place))
    return opposite and float(look.gap) <= -contact.length


def pressed_at(contact: Contact, look: Approach) -> bool:
    """Tell whether a contact that looks so is pressed: with penetration, opposite its face."""
    pressed = look.gap < -PLACE_ROUNDING and on_the_contact(contact, float(look.place))
    return bool(pressed) and not far_behind(contact, look)


def pressed_among(contacts: Sequence[Contact], q: FloatArray) -> list[int]:
    """Numbers of the contacts that are pressed at coordinates (parts, 3), as at a rest."""
    still = np.zeros_like(q)
    return [
        k for k, contact in enumerate(contacts) if pressed_at(contact, approach(contact, q, still))
    ]


def pressing_at_start(scene: Scene, mechanism: Mechanism) -> dict[int, float]:
    """Speeds (m/s) at which contacts touched that press as a run is gone on from, by numbers."""
    numbers = mechanism.numbers
    return {
        numbers[name] + pair: speed
        for name, pairs in scene.initial.pressing.items()
        for pair, speed in pairs
    }


def idle_at_start(
    mechanism: Mechanism, q: FloatArray, v: FloatArray
) -> Iterator[tuple[Contact, str]]:
    """Give the contacts that do not act at first, though the point is opposite their face.

    At coordinates and velocities (parts, 3) of time 0; with a sentence for each.
    """
    for contact in mechanism.contacts:
        look = approach(contact, q, v)
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
    """Give the name of every sleeve, and from where to where (...) its link is along its guide.

    In lengths of the guide: 0 and 1 are its mouths. `q` has shape (..., parts, 3).
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
    """How long struck levers, with all that is welded to them, turn an error of speed into angles.

    That is 1/omega (s) on their springs, infinite without a spring. A contact with what has no
    pivot of its own, or is so heavy that a strike hardly moves it, has none.
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


def approach(
    contact: Contact, q: FloatArray, v: FloatArray, t: FloatArray | float = 0.0
) -> Approach:
    """Gap, place, rates and directions at coordinates and velocities (..., parts, 3), at t (s)."""
    look = ContactShapes((contact,)).look(poses_of(q, v, t)).of(0)
    return Approach(*look.seen, vectors(look.normal), vectors(look.along), look.grip)


def gradient(contact: Contact, q: FloatArray) -> FloatArray:
    """Gradient (3 parts,) of a contact's gap: its rates at unit speeds."""
    units = np.eye(q.size).reshape(-1, *q.shape)
    return approach(contact, q, units).gap_rate

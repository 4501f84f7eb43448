"""Springs and contacts of a scene, between parts, and contact laws as engines evaluate them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import pi

from exudyn_flexlink import scene
from exudyn_flexlink.curves import Curve
from exudyn_flexlink.laws import Friction, Impulse, RestitutionPenalty
from exudyn_flexlink.mechanism.bodies import Bodies
from exudyn_flexlink.mechanism.contact_pairs import (
    CircleContact,
    Contact,
    CurveContact,
    FaceContact,
)
from exudyn_flexlink.mechanism.model import LinearSpring, RotarySpring, Weld
from exudyn_flexlink.mechanism.parts import GROUND, Anchor
from exudyn_flexlink.mechanism.weld_groups import inertia_with_welded
from exudyn_flexlink.scene import (
    CircleOnCircle,
    ContactLaw,
    ImpulseLaw,
    PointOnCurve,
    PointOnLine,
    RevoluteJoint,
    TorsionalSpring,
)
from exudyn_flexlink.source import Mistake


def spring_of(
    bodies: Bodies, name: str, spring: TorsionalSpring, welds: Sequence[Weld]
) -> RotarySpring:
    """Return a spring and damper at a revolute joint.

    A frequency, or a damping ratio, is that of the body at the joint with all that is welded to it.
    """
    first, second = bodies.joint_parts(spring.joint)
    stiffness, damping = spring.stiffness or 0.0, spring.damping or 0.0
    if spring.frequency is not None or spring.damping_ratio is not None:
        inertia = inertia_with_welded(_moving_end(bodies, spring.joint), bodies.parts, welds)
        if spring.frequency is not None:
            stiffness = inertia * (2 * pi * spring.frequency) ** 2
        if spring.damping_ratio is not None:
            damping = 2 * spring.damping_ratio * (stiffness * inertia) ** 0.5
    return RotarySpring(name, first, second, stiffness, damping, spring.rest_angle)


def linear_spring_of(bodies: Bodies, name: str, spec: scene.LinearSpring) -> LinearSpring:
    """Return a spring and damper between two points, or along a prismatic joint."""
    stiffness, damping, length = spec.stiffness, spec.damping, spec.length
    if spec.joint is None:
        assert spec.points is not None  # the scene checks that there is one of both
        first, second = (bodies.anchor(point, spec.at) for point in spec.points)
        return LinearSpring(name, first, second, stiffness, damping, length)
    slide = bodies.slide(spec.joint)
    return LinearSpring(name, slide.first, slide.second, stiffness, damping, length, slide)


def contact_of(
    bodies: Bodies, name: str, contact: scene.Contact, curves: Mapping[str, Curve]
) -> Contact:
    """Return a point and a face or a curve, or two circles, that may strike each other."""
    law = contact.law
    pressing = Impulse(law.restitution) if isinstance(law, ImpulseLaw) else penalty_of(law)
    laws = pressing, friction_of(law)
    if isinstance(contact, CircleOnCircle):
        first, second = contact.inner_and_outer
        return CircleContact(
            name,
            bodies.anchor(first.at, first.place),
            bodies.anchor(second.at, second.place),
            (first.radius, second.radius),
            second.inside,
            *laws,
        )
    point, side = bodies.anchor(contact.point), 1.0 if contact.side == "left" else -1.0
    if isinstance(contact, PointOnCurve):
        curve, carrier = curves[contact.curve], bodies.carrier(contact.curve)
        return CurveContact(name, point, curve, carrier, side, contact.radius, *laws)
    return FaceContact(name, point, *_ends(bodies, contact), side, *laws)


def penalty_of(law: ContactLaw) -> RestitutionPenalty:
    """Return the pressing force of a penalty law."""
    return RestitutionPenalty(law.stiffness, law.restitution, law.transition_speed)


def friction_of(law: ContactLaw | ImpulseLaw) -> Friction | None:
    """Return the friction of a law, None where it is smooth."""
    if isinstance(law, ImpulseLaw) or law.friction == 0:
        return None
    return Friction(law.friction, law.slip_speed)


def line_mistakes(bodies: Bodies) -> Iterator[Mistake]:
    """Refuse lines of contacts that are no straight faces: that bend, or have no length."""
    for name, contact in bodies.scene.contacts.items():
        if not isinstance(contact, PointOnLine):
            continue
        path = ("contacts", name, "line")
        start, end = _ends(bodies, contact)
        if start.part != end.part:
            own = range(bodies.first_part(contact.struck), min(start.part, end.part) + 1)
            place = sum(bodies.parts[part].reach for part in own)
            message = f"'{contact.struck}' gives way at {place:g} m, between the two points"
            yield Mistake(path, message, "a face is straight: take both on one side of that place")
        elif (start.x, start.y) == (end.x, end.y):
            yield Mistake(path, "both points are at one place: a line needs a length")


def _ends(bodies: Bodies, contact: PointOnLine) -> tuple[Anchor, Anchor]:
    start, end = (bodies.anchor(point) for point in contact.line)
    return bodies.on_one_rod(start, end)


def _moving_end(bodies: Bodies, joint: str) -> Anchor:
    """Point by which a joint of the scene holds a body on the ground."""
    found = bodies.scene.joints[joint]
    assert isinstance(found, RevoluteJoint)
    return next(anchor for anchor in bodies.ends(found) if anchor.part != GROUND)

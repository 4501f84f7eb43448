"""Point masses: bodies without inertia, and whether anything turns them."""

from __future__ import annotations

from collections.abc import Iterator

from exudyn_flexlink.scene.base import split_point
from exudyn_flexlink.scene.bodies import RigidBody
from exudyn_flexlink.scene.contacts import CircleOnCircle, PointOnCurve
from exudyn_flexlink.scene.forces import TorqueDrive, TorsionalSpring
from exudyn_flexlink.scene.joints import RevoluteJoint, SlotJoint
from exudyn_flexlink.scene.lookup import Parts
from exudyn_flexlink.source import Mistake


def stays_a_point(parts: Parts, name: str, body: RigidBody) -> bool:
    """Tell whether all that acts on a body acts at its centre, but perhaps friction.

    Then its angle is nobody's business. A joint, a spring, a drive or a curve that it carries can
    turn it, and so can forces at its other points.
    """
    if any(place != body.centre_of_mass for place in body.points.values()):
        return False
    if any(curve.on == name for _, curve in parts.valid("curves")):
        return False
    acting = (*parts.valid("springs"), *parts.valid("drives"))
    turned = {getattr(part, "joint", None) for _, part in acting}
    turned.update(*(getattr(joint, "joints", ()) for _, joint in parts.valid("joints")))
    return not any(
        name in joint.bodies and (own in turned or not isinstance(joint, RevoluteJoint | SlotJoint))
        for own, joint in parts.valid("joints")
    )


def point_masses(parts: Parts) -> Iterator[Mistake]:
    """Refuse friction around a point mass, and that it turns at the start.

    What turns has an inertia, and here none is known.
    """
    rough = list(_rough(parts))
    for name, body in parts.valid("bodies"):
        if not isinstance(body, RigidBody) or body.inertia > 0:
            continue
        found = next((what for what, bodies in rough if name in bodies), None)
        if found is not None and stays_a_point(parts, name, body):
            yield Mistake(
                ("bodies", name, "inertia"),
                f"friction in '{found}' turns '{name}', which has no inertia",
                "give its moment of inertia, m r^2/2 of a disc; or take the friction away",
            )
        if (what := _turned_alone(parts, name, body)) is not None:
            yield Mistake(
                ("bodies", name, "inertia"),
                f"'{what}' turns '{name}' about its own centre, where it has no inertia",
                "give its moment of inertia, m r^2/2 of a disc",
            )
        speed = getattr(parts.sections.get("initial"), "speeds", {}).get(name)
        if speed and stays_a_point(parts, name, body):
            yield Mistake(
                ("initial", "speeds", name),
                f"'{name}' is a point mass, which has no angular speed",
                "give its speed under 'velocities', or the body an 'inertia'",
            )


def _turned_alone(parts: Parts, name: str, body: RigidBody) -> str | None:
    """Name of what turns a body about its centre, where only one pin to the ground holds it."""
    holding = [(own, joint) for own, joint in parts.valid("joints") if name in joint.bodies]
    if len(holding) != 1 or holding[0][1].bodies != (name,):
        return None
    own, joint = holding[0]
    points = joint.points if isinstance(joint, RevoluteJoint) else ()
    pinned = [split_point(point)[1] for point in points if split_point(point)[0] == name]
    if not pinned or body.points.get(pinned[0], body.centre_of_mass) != body.centre_of_mass:
        return None
    acting = (*parts.valid("springs"), *parts.valid("drives"))
    turns = (TorsionalSpring, TorqueDrive)
    return next((k for k, part in acting if isinstance(part, turns) and part.joint == own), None)


def _rough(parts: Parts) -> Iterator[tuple[str, set[str]]]:
    """Names of contacts and bearings whose friction acts around points, and of their bodies."""
    for name, contact in parts.valid("contacts"):
        if getattr(contact.law, "friction", 0.0) > 0:
            if isinstance(contact, CircleOnCircle):
                yield name, {split_point(circle.at)[0] for circle in contact.circles}
            elif isinstance(contact, PointOnCurve) and contact.radius > 0:
                yield name, {split_point(contact.point)[0]}
    for name, joint in parts.valid("joints"):
        law = joint.acting if isinstance(joint, RevoluteJoint) else None
        dry = joint.friction if isinstance(joint, RevoluteJoint) else None
        if (law is not None and law.friction > 0) or (dry is not None and dry.acts):
            yield name, set(joint.bodies)

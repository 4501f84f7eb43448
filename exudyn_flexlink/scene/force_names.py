"""Whether the names in springs and contacts lead to parts of the kind needed there."""

from __future__ import annotations

from collections.abc import Iterator

from exudyn_flexlink.scene.base import GROUND, split_point
from exudyn_flexlink.scene.bodies import FlexibleBody
from exudyn_flexlink.scene.contacts import PointOnCurve
from exudyn_flexlink.scene.curve_specs import LapsSpec
from exudyn_flexlink.scene.forces import LinearSpring
from exudyn_flexlink.scene.joints import PrismaticJoint, RevoluteJoint
from exudyn_flexlink.scene.lookup import Lookup, valid
from exudyn_flexlink.source import KeyPath, Mistake


def springs(look: Lookup) -> Iterator[Mistake]:
    """Refuse joints in springs that are none, or of the wrong kind."""
    for name, spring in valid(look.parts.springs):
        path = ("springs", name)
        if isinstance(spring, LinearSpring):
            yield from _linear(look, path, spring)
            continue
        yield from look.revolute((*path, "joint"), spring.joint)
        joint = look.get("joints", spring.joint)
        if not isinstance(joint, RevoluteJoint):
            continue
        for key in ("frequency", "damping_ratio"):
            if getattr(spring, key) is not None and not _swings(look, joint):
                hint = "of a rod or a rigid body hinged to the ground; else give "
                hint += "'stiffness'" if key == "frequency" else "'damping'"
                yield Mistake((*path, key), f"'{spring.joint}' has no {key} of its own", hint)


def _linear(look: Lookup, path: KeyPath, spring: LinearSpring) -> Iterator[Mistake]:
    if spring.joint is not None:
        yield from look.joint((*path, "joint"), spring.joint, PrismaticJoint)
    points = spring.points or ()
    for i, text in enumerate(points):
        yield from look.point((*path, "points", i), text)
    bodies = {split_point(text)[0] for text in points}
    if len(bodies) == 1 and not isinstance(look.get("bodies", *bodies), FlexibleBody):
        yield Mistake((*path, "points"), "both points are of one body, which can't change")


def _swings(look: Lookup, joint: RevoluteJoint) -> bool:
    """Whether the joint hinges one body, not a flexible one, to the ground."""
    if GROUND not in joint.points:
        return False
    moving = next(text for text in joint.points if text != GROUND)
    return not isinstance(look.get("bodies", split_point(moving)[0]), FlexibleBody)


def contacts(look: Lookup) -> Iterator[Mistake]:
    """Refuse points in contacts that are none, and names that a joint's own contact has."""
    for name, contact in valid(look.parts.contacts):
        if getattr(look.get("joints", name), "law", None) is not None:
            message = f"'{name}' is a joint with contacts of its own"
            yield Mistake(("contacts", name), message, "give it another name", on_key=True)
        for keys, text in contact.points:
            yield from look.point(("contacts", name, *keys), text)
        if isinstance(contact, PointOnCurve):
            yield from _on_curve(look, ("contacts", name), contact)


def _on_curve(look: Lookup, path: KeyPath, contact: PointOnCurve) -> Iterator[Mistake]:
    """Refuse a curve that is none, or one that nothing can strike."""
    yield from look.missing((*path, "curve"), "curves", contact.curve)
    curve = look.get("curves", contact.curve)
    if isinstance(curve, LapsSpec):
        hint = "name one of them"
        yield Mistake((*path, "curve"), f"'{contact.curve}' is another curve in each lap", hint)
    if curve is not None and curve.on == split_point(contact.point)[0]:
        yield Mistake((*path, "point"), f"is on '{curve.on}', which carries the curve")

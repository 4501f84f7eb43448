"""Stops of joints, ropes and buffers of a scene as contacts; tables and formulas as spring laws."""

from __future__ import annotations

from math import cos, sin

from exudyn_flexlink import scene as specs
from exudyn_flexlink.expressions import Expression
from exudyn_flexlink.laws import PressingLaw, SpringDamper, SpringTable
from exudyn_flexlink.mechanism.bodies import Bodies
from exudyn_flexlink.mechanism.contact_pairs import CircleContact, Contact, FaceContact, TurnStop
from exudyn_flexlink.mechanism.model import Slide
from exudyn_flexlink.mechanism.parts import Anchor
from exudyn_flexlink.mechanism.penalties import pressing_law
from exudyn_flexlink.mechanism.prescribed import Formula
from exudyn_flexlink.mechanism.spring_laws import PlaceTable, SpringLaw
from exudyn_flexlink.scene import ForceTable, RevoluteJoint

FACE = 0.2  # of the longest part: how wide the face across a slide is drawn


def stop(bodies: Bodies, name: str, spec: specs.Stop) -> Contact:
    """Return a hinge's stop, or a face across a slide at a length of it."""
    way, law = 1.0 if spec.end == "from" else -1.0, pressing_law(bodies.scene, spec.law)
    joint = bodies.scene.joints[spec.joint]
    if isinstance(joint, RevoluteJoint):
        return TurnStop(name, *bodies.ends(joint), spec.at, way, law)
    face = _face_across(bodies, bodies.slide(spec.joint), spec.at)
    return FaceContact(name, *face, -way, law, across=True)


def rope(bodies: Bodies, name: str, spec: specs.LinearSpring) -> Contact:
    """Return a rope or a buffer: a point in or outside a circle, or a face across a slide."""
    pulls, length = spec.acts == "tension", spec.length or 0.0
    law: PressingLaw = SpringDamper(spec.stiffness, spec.damping, spec.preload)
    if isinstance(spec.force, ForceTable):
        rows = sorted((abs(place - length), abs(force)) for place, force in spec.force.points or ())
        depths, forces = zip(*rows, strict=True)
        law = SpringTable(depths, forces, spec.damping)
    if spec.joint is not None:
        face = _face_across(bodies, bodies.slide(spec.joint), length)
        return FaceContact(name, *face, 1.0 if pulls else -1.0, law, across=True)
    assert spec.points is not None  # the scene checks that there is one of both
    first, second = (bodies.anchor(point, spec.at) for point in spec.points)
    return CircleContact(name, first, second, (0.0, length), pulls, law)


def _face_across(bodies: Bodies, slide: Slide, at: float) -> tuple[Anchor, Anchor, Anchor]:
    """Return what slides, and a face across its line at a length (m); right of it is longer."""
    half = FACE / 2 * max(part.reach for part in bodies.parts) or FACE
    along_x, along_y = cos(slide.direction), sin(slide.direction)
    x, y = slide.first.x + at * along_x, slide.first.y + at * along_y
    start, end = (
        Anchor(slide.first.part, x - side * along_y, y + side * along_x) for side in (-half, half)
    )
    return slide.second, start, end


def spring_law(name: str, given: specs.ForceLaw | specs.TorqueLaw | None) -> SpringLaw | None:
    """Return the force of a spring by a table or a formula."""
    if given is None:
        return None
    if isinstance(given, Expression):
        return SpringLaw(Formula(given))
    return SpringLaw(PlaceTable(name, given.points or (), given.rule))

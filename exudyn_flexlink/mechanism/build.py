"""Scene to mechanism: bodies become rigid parts, names become indices."""

from __future__ import annotations

from exudyn_flexlink.mechanism.bodies import Bodies
from exudyn_flexlink.mechanism.build_drives import force_of, motor_of, torque_of
from exudyn_flexlink.mechanism.build_forces import (
    contact_of,
    friction_of,
    line_mistakes,
    linear_spring_of,
    penalty_of,
    spring_of,
)
from exudyn_flexlink.mechanism.contact_pairs import Channel, CircleContact
from exudyn_flexlink.mechanism.model import Mechanism, Pin, Slot, Weld
from exudyn_flexlink.mechanism.tracks import build_curves
from exudyn_flexlink.once import once_for_each
from exudyn_flexlink.scene import (
    ContactLaw,
    ForceDrive,
    LinearSpring,
    MotionDrive,
    PrismaticJoint,
    RevoluteJoint,
    Scene,
    SleeveJoint,
    SlotJoint,
    SpeedDrive,
    TorqueDrive,
    TorsionalSpring,
    WeldJoint,
)
from exudyn_flexlink.source import SceneError


@once_for_each
def build_mechanism(scene: Scene) -> Mechanism:
    """Turn a scene into rigid parts, joints, springs, drives and contacts.

    Once for each scene: both are frozen, and whoever looks at a result asks for it again.

    Raises:
        SceneError: a curve of the scene, or the line of a contact, can't be.

    """
    bodies = Bodies(scene)
    curves, mistakes = build_curves(scene.curves)
    mistakes += [*bodies.mistakes, *line_mistakes(bodies)]
    if mistakes:
        raise SceneError(scene.document, mistakes)
    joints = scene.joints.items()
    springs, drives = scene.springs.items(), scene.drives.items()
    welds = tuple(Weld(n, *bodies.ends(j), j.angle) for n, j in joints if isinstance(j, WeldJoint))
    return Mechanism(
        parts=tuple(bodies.parts),
        points=bodies.points,
        pins=(
            *(
                Pin(n, *bodies.ends(j))
                for n, j in joints
                if isinstance(j, RevoluteJoint) and j.clearance == 0
            ),
            *bodies.pins,
        ),
        welds=welds,
        slides=(
            *(
                bodies.slide(n)
                for n, j in joints
                if isinstance(j, PrismaticJoint)
                or (isinstance(j, SleeveJoint) and j.clearance == 0)
            ),
            *bodies.slides,
        ),
        slots=tuple(
            Slot(n, bodies.anchor(j.point), curves[j.curve], bodies.carrier(j.curve))
            for n, j in joints
            if isinstance(j, SlotJoint)
        ),
        springs=(
            *(spring_of(bodies, n, s, welds) for n, s in springs if isinstance(s, TorsionalSpring)),
            *bodies.springs,
        ),
        linear_springs=(
            *(linear_spring_of(bodies, n, s) for n, s in springs if isinstance(s, LinearSpring)),
            *bodies.linear_springs,
        ),
        speed_motors=tuple(
            motor_of(bodies, n, d) for n, d in drives if isinstance(d, (SpeedDrive, MotionDrive))
        ),
        torque_motors=tuple(
            torque_of(bodies, n, d) for n, d in drives if isinstance(d, TorqueDrive)
        ),
        forces=tuple(force_of(bodies, n, d) for n, d in drives if isinstance(d, ForceDrive)),
        contacts=tuple(contact_of(bodies, n, c, curves) for n, c in scene.contacts.items()),
        bearings=tuple(
            _bearing(bodies, n, j, j.acting)
            for n, j in joints
            if isinstance(j, RevoluteJoint) and j.acting is not None
        ),
        channels=tuple(
            _channel(bodies, n, j, j.acting)
            for n, j in joints
            if isinstance(j, SleeveJoint) and j.acting is not None
        ),
        gravity=scene.gravity,
    )


def _bearing(bodies: Bodies, name: str, joint: RevoluteJoint, law: ContactLaw) -> CircleContact:
    """Return a journal in its bearing; without a radius the journal is a point."""
    radius = joint.radius or 0.0
    return CircleContact(
        name,
        *bodies.ends(joint),
        (radius, radius + joint.clearance),
        inside=True,
        law=penalty_of(law),
        friction=friction_of(law),
    )


def _channel(bodies: Bodies, name: str, joint: SleeveJoint, law: ContactLaw) -> Channel:
    start, end = bodies.anchor(f"{joint.guide}.start"), bodies.anchor(f"{joint.guide}.end")
    first, last = bodies.first_part(joint.link), bodies.anchor(f"{joint.link}.end")
    rods = tuple(range(first, last.part + 1))
    lengths = (*(bodies.parts[rod].reach for rod in rods[:-1]), last.x)
    return Channel(
        name,
        start,
        end.x - start.x,
        joint.clearance,
        rods,
        lengths,
        penalty_of(law),
        friction_of(law),
    )

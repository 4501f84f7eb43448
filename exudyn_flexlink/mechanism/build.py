"""Scene to mechanism: bodies become rigid parts, names become indices."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import pi
from typing import TypeVar

from exudyn_flexlink import scene as specs
from exudyn_flexlink.curves import Curve
from exudyn_flexlink.expressions import Expression, Sensed, parse_expression
from exudyn_flexlink.laws import Friction
from exudyn_flexlink.mechanism.bodies import Bodies
from exudyn_flexlink.mechanism.contact_pairs import (
    Channel,
    CircleContact,
    Contact,
    CurveContact,
    FaceContact,
    FlatContact,
)
from exudyn_flexlink.mechanism.gears import build_gears
from exudyn_flexlink.mechanism.model import (
    JointFriction,
    LinearSpring,
    Mechanism,
    Motor,
    Pin,
    Placed,
    PointForce,
    RotarySpring,
    Sense,
    Size,
    Sliding,
    Slot,
    TorqueMotor,
    Turning,
    Weld,
)
from exudyn_flexlink.mechanism.parts import GROUND, Anchor
from exudyn_flexlink.mechanism.penalties import penalty_of, pressing_law
from exudyn_flexlink.mechanism.prescribed import Formula, Ramp, SpeedOf, Tabled
from exudyn_flexlink.mechanism.stops_and_ropes import rope, spring_law, stop
from exudyn_flexlink.mechanism.tracks import build_curves, hollow_mistakes
from exudyn_flexlink.mechanism.weld_groups import inertia_with_welded
from exudyn_flexlink.once import once_for_each
from exudyn_flexlink.source import SceneError

Spec = TypeVar("Spec")


@once_for_each
def build_mechanism(scene: specs.Scene) -> Mechanism:
    """Turn a scene into rigid parts, joints, springs, drives and contacts.

    Once for each scene: both are frozen, and whoever looks at a result asks for it again.

    Raises:
        SceneError: a curve of the scene, or the line of a contact, can't be.

    """
    bodies = Bodies(scene)
    curves, mistakes = build_curves(scene.curves)
    mistakes += [*bodies.mistakes, *bodies.bent_faces(), *hollow_mistakes(scene, curves)]
    if mistakes:
        raise SceneError(scene.document, mistakes)
    joints, springs, drives = scene.joints, scene.springs, scene.drives
    pinned, sleeves = _of(joints, specs.RevoluteJoint), _of(joints, specs.SleeveJoint)
    pins = [Pin(n, *bodies.ends(j)) for n, j in pinned.items() if j.clearance == 0]
    sliding = {n for n, j in sleeves.items() if j.clearance == 0}
    sliding |= set(_of(joints, specs.PrismaticJoint))
    welds = tuple(
        Weld(n, *bodies.ends(j), j.angle) for n, j in _of(joints, specs.WeldJoint).items()
    )
    torsional, linear = _of(springs, specs.TorsionalSpring), _of(springs, specs.LinearSpring)
    return Mechanism(
        parts=tuple(bodies.parts),
        points=bodies.points,
        pins=(*pins, *bodies.pins),
        welds=welds,
        slides=(*(bodies.slide(n) for n in joints if n in sliding), *bodies.slides),
        slots=tuple(
            Slot(n, bodies.anchor(j.point), curves[j.curve], bodies.carrier(j.curve))
            for n, j in _of(joints, specs.SlotJoint).items()
        ),
        springs=(
            *(_rotary_spring(bodies, n, s, welds) for n, s in torsional.items()),
            *bodies.springs,
        ),
        linear_springs=(
            *(_linear_spring(bodies, n, s) for n, s in linear.items() if n not in scene.ropes),
            *bodies.linear_springs,
        ),
        speed_motors=tuple(
            _motor(bodies, n, d)
            for n, d in drives.items()
            if isinstance(d, (specs.SpeedDrive, specs.MotionDrive))
        ),
        torque_motors=tuple(
            TorqueMotor(n, *bodies.joint_parts(d.joint), _size(bodies, d.value, d.ramp))
            for n, d in _of(drives, specs.TorqueDrive).items()
        ),
        forces=tuple(_force(bodies, n, d) for n, d in _of(drives, specs.ForceDrive).items()),
        contacts=(
            *(_contact(bodies, n, c, curves) for n, c in scene.contacts.items()),
            *(stop(bodies, n, own) for n, own in scene.stops.items()),
            *(rope(bodies, n, own) for n, own in scene.ropes.items()),
        ),
        bearings=tuple(_bearing(bodies, n, j, j.acting) for n, j in pinned.items() if j.acting),
        channels=tuple(_channel(bodies, n, j, j.acting) for n, j in sleeves.items() if j.acting),
        gravity=scene.gravity,
        frictions=tuple(_joint_frictions(bodies)),
        gears=tuple(build_gears(bodies)),
    )


def _of(named: Mapping[str, object], kind: type[Spec]) -> dict[str, Spec]:
    """Those of one kind, by their names, in order."""
    return {name: one for name, one in named.items() if isinstance(one, kind)}


def _bearing(
    bodies: Bodies, name: str, joint: specs.RevoluteJoint, law: specs.PenaltyLaw
) -> CircleContact:
    """Return a journal in its bearing; without a radius the journal is a point."""
    radius = joint.radius or 0.0
    return CircleContact(
        name,
        *bodies.ends(joint),
        (radius, radius + joint.clearance),
        inside=True,
        law=penalty_of(bodies.scene, law, (radius, -radius - joint.clearance)),
        friction=_friction(law),
    )


def _channel(bodies: Bodies, name: str, joint: specs.SleeveJoint, law: specs.PenaltyLaw) -> Channel:
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
        penalty_of(bodies.scene, law),
        _friction(law),
    )


def _joint_frictions(bodies: Bodies) -> Iterator[JointFriction]:
    """Return the friction of pins and slides that have some."""
    for name, joint in bodies.scene.joints.items():
        if isinstance(joint, specs.RevoluteJoint) and joint.friction and joint.friction.acts:
            own = joint.friction
            share = own.coefficient * (own.radius or 0.0)
            pin = Pin(name, *bodies.ends(joint))
            yield JointFriction(name, pin, own.torque, share, own.slip_speed)
        elif isinstance(joint, specs.PrismaticJoint) and joint.friction and joint.friction.acts:
            along = joint.friction
            sizes = along.force, along.coefficient, along.slip_speed
            yield JointFriction(name, bodies.slide(name), *sizes)


# --- springs and contacts ------------------------------------------------------------


def _rotary_spring(
    bodies: Bodies, name: str, spring: specs.TorsionalSpring, welds: Sequence[Weld]
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
    law = spring_law(name, spring.torque)
    return RotarySpring(name, first, second, stiffness, damping, spring.rest_angle, law)


def _linear_spring(bodies: Bodies, name: str, spec: specs.LinearSpring) -> LinearSpring:
    """Return a spring and damper between two points, or along a prismatic joint."""
    stiffness, damping, length = spec.stiffness, spec.damping, spec.length
    law = spring_law(name, spec.force)
    if spec.joint is None:
        assert spec.points is not None  # the scene checks that there is one of both
        first, second = (bodies.anchor(point, spec.at) for point in spec.points)
        return LinearSpring(name, first, second, stiffness, damping, length, law=law)
    slide = bodies.slide(spec.joint)
    return LinearSpring(name, slide.first, slide.second, stiffness, damping, length, slide, law)


def _contact(
    bodies: Bodies, name: str, contact: specs.Contact, curves: Mapping[str, Curve]
) -> Contact:
    """Return a point and a face or a curve, or two circles, that may strike each other."""
    radii = contact.radii if isinstance(contact, specs.CircleOnCircle) else None
    laws = pressing_law(bodies.scene, contact.law, radii), _friction(contact.law)
    if isinstance(contact, specs.CircleOnCircle):
        first, second = contact.inner_and_outer
        return CircleContact(
            name,
            bodies.anchor(first.at, first.place),
            bodies.anchor(second.at, second.place),
            (first.radius, second.radius),
            second.inside,
            *laws,
        )
    side = 1.0 if contact.side == "left" else -1.0
    if isinstance(contact, specs.LineOnCurve):
        curve, carrier = curves[contact.curve], bodies.carrier(contact.curve)
        return FlatContact(name, *bodies.face(contact), side, curve, carrier, *laws)
    point = bodies.anchor(contact.point)
    if isinstance(contact, specs.PointOnCurve):
        curve, carrier = curves[contact.curve], bodies.carrier(contact.curve)
        return CurveContact(name, point, curve, carrier, side, contact.radius, *laws)
    return FaceContact(name, point, *bodies.face(contact), side, *laws)


def _friction(law: specs.PenaltyLaw | specs.RubbingImpulse) -> Friction | None:
    """Return the friction of a law, None where it is smooth."""
    if law.friction == 0:
        return None
    return Friction(law.friction, law.slip_speed)


def _moving_end(bodies: Bodies, joint: str) -> Anchor:
    """Point by which a joint of the scene holds a body on the ground."""
    found = bodies.scene.joints[joint]
    assert isinstance(found, specs.RevoluteJoint)
    return next(anchor for anchor in bodies.ends(found) if anchor.part != GROUND)


# --- drives ------------------------------------------------------------

TimeFunction = Formula | Tabled


def _motor(bodies: Bodies, name: str, drive: specs.SpeedDrive | specs.MotionDrive) -> Motor:
    """Return a drive that prescribes how a joint turns or slides."""
    slide, clock = None, bodies.scene.initial.clock
    if isinstance(bodies.scene.joints[drive.joint], specs.RevoluteJoint):
        first, second = bodies.joint_parts(drive.joint)
    else:
        slide = bodies.slide(drive.joint)
        first, second = slide.first.part, slide.second.part
    if isinstance(drive, specs.SpeedDrive):
        function = _ramp_or_function(drive.value, drive.ramp, clock)
        return Motor(name, first, second, function, slide=slide)
    motion = _function(_as_expression(drive.value), clock)
    return Motor(name, first, second, SpeedOf(motion), motion.at(0.0), slide)


def _force(bodies: Bodies, name: str, drive: specs.ForceDrive) -> PointForce:
    """Return a force at a point."""
    point = bodies.anchor(drive.point)
    axes = GROUND
    if drive.axes == specs.split_point(drive.point)[0]:
        axes = point.part
    elif drive.axes in bodies.scene.bodies:
        axes = bodies.first_part(drive.axes)
    x, y = (_size(bodies, value) for value in drive.value)
    return PointForce(name, point, axes, (x, y))


def _size(bodies: Bodies, value: specs.Value, ramp: float = 0.0) -> Size:
    sensed = value.sensed if isinstance(value, Expression) else ()
    function = _ramp_or_function(value, ramp, bodies.scene.initial.clock)
    return Size(function, tuple(_sense(bodies, one) for one in sensed))


def _ramp_or_function(value: specs.Value, ramp: float, clock: float) -> Ramp | TimeFunction:
    """What a drive does in time; a run that goes on begins after its ramp."""
    if isinstance(value, float):
        return Ramp(value, 0.0 if clock > 0 else ramp)
    return _function(value, clock)


def _function(value: Expression | specs.Table, clock: float) -> TimeFunction:
    """Function of a drive whose t is `clock` (s) as the run begins."""
    if isinstance(value, Expression):
        return Formula(value, clock)
    assert value.points is not None  # its file was read
    return Tabled(value.points, value.rule, clock)


def _as_expression(value: specs.Value) -> Expression | specs.Table:
    return parse_expression(repr(value)) if isinstance(value, float) else value


def _sense(bodies: Bodies, sensed: Sensed) -> Sense:
    if sensed.axis:
        return Placed(bodies.anchor(sensed.of), "xy".index(sensed.axis))
    if not isinstance(bodies.scene.joints[sensed.of], specs.RevoluteJoint):
        return Sliding(bodies.slide(sensed.of), sensed.kind == "speed")
    return Turning(*bodies.joint_parts(sensed.of), sensed.kind == "speed")

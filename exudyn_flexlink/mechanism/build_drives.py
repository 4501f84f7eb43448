"""Drives of a scene, between parts."""

from __future__ import annotations

from exudyn_flexlink.expressions import Expression, Sensed, parse_expression
from exudyn_flexlink.mechanism.bodies import Bodies
from exudyn_flexlink.mechanism.model import (
    Mechanism,
    Motor,
    Placed,
    PointForce,
    Sense,
    Size,
    Sliding,
    TorqueMotor,
    Turning,
)
from exudyn_flexlink.mechanism.parts import GROUND
from exudyn_flexlink.mechanism.prescribed import Formula, Ramp, SpeedOf, Tabled
from exudyn_flexlink.scene import (
    ForceDrive,
    MotionDrive,
    RevoluteJoint,
    Scene,
    SpeedDrive,
    Table,
    TorqueDrive,
    Value,
    split_point,
)

TimeFunction = Formula | Tabled


def motor_of(bodies: Bodies, name: str, drive: SpeedDrive | MotionDrive) -> Motor:
    """Return a drive that prescribes how a joint turns or slides."""
    slide, clock = None, bodies.scene.initial.clock
    if isinstance(bodies.scene.joints[drive.joint], RevoluteJoint):
        first, second = bodies.joint_parts(drive.joint)
    else:
        slide = bodies.slide(drive.joint)
        first, second = slide.first.part, slide.second.part
    if isinstance(drive, SpeedDrive):
        function = _ramp_or_function(drive.value, drive.ramp, clock)
        return Motor(name, first, second, function, slide=slide)
    motion = _function(_as_expression(drive.value), clock)
    return Motor(name, first, second, SpeedOf(motion), motion.at(0.0), slide)


def steady_drive(scene: Scene, mechanism: Mechanism) -> Ramp | None:
    """What brings the joint whose turns end a run to one speed: they end at a time known before.

    None if nothing does: any other drive may never make them.
    """
    for motor in mechanism.speed_motors:
        drive = scene.drives[motor.name]
        if isinstance(drive, SpeedDrive) and drive.joint == scene.run.of:
            return motor.speed if isinstance(motor.speed, Ramp) else None
    return None


def torque_of(bodies: Bodies, name: str, drive: TorqueDrive) -> TorqueMotor:
    """Return a torque at a revolute joint."""
    return TorqueMotor(
        name, *bodies.joint_parts(drive.joint), _size(bodies, drive.value, drive.ramp)
    )


def force_of(bodies: Bodies, name: str, drive: ForceDrive) -> PointForce:
    """Return a force at a point."""
    point = bodies.anchor(drive.point)
    axes = GROUND
    if drive.axes == split_point(drive.point)[0]:
        axes = point.part
    elif drive.axes in bodies.scene.bodies:
        axes = bodies.first_part(drive.axes)
    x, y = (_size(bodies, value) for value in drive.value)
    return PointForce(name, point, axes, (x, y))


def _size(bodies: Bodies, value: Value, ramp: float = 0.0) -> Size:
    sensed = value.sensed if isinstance(value, Expression) else ()
    function = _ramp_or_function(value, ramp, bodies.scene.initial.clock)
    return Size(function, tuple(_sense(bodies, one) for one in sensed))


def _ramp_or_function(value: Value, ramp: float, clock: float) -> Ramp | TimeFunction:
    """What a drive does in time; a run that goes on begins after its ramp."""
    if isinstance(value, float):
        return Ramp(value, 0.0 if clock > 0 else ramp)
    return _function(value, clock)


def _function(value: Expression | Table, clock: float) -> TimeFunction:
    """Function of a drive whose t is `clock` (s) as the run begins."""
    if isinstance(value, Expression):
        return Formula(value, clock)
    assert value.points is not None  # its file was read
    return Tabled(value.points, value.rule, clock)


def _as_expression(value: Value) -> Expression | Table:
    return parse_expression(repr(value)) if isinstance(value, float) else value


def _sense(bodies: Bodies, sensed: Sensed) -> Sense:
    if sensed.axis:
        return Placed(bodies.anchor(sensed.of), "xy".index(sensed.axis))
    if not isinstance(bodies.scene.joints[sensed.of], RevoluteJoint):
        return Sliding(bodies.slide(sensed.of), sensed.kind == "speed")
    return Turning(*bodies.joint_parts(sensed.of), sensed.kind == "speed")

"""What acts on joints and bodies: springs and drives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from exudyn_flexlink import quantities as si
from exudyn_flexlink.expressions import Expression
from exudyn_flexlink.quantities import Dimension
from exudyn_flexlink.scene.base import (
    DRIVEN,
    GROUND,
    REVOLUTE,
    XY,
    ByType,
    MovingPointName,
    Name,
    Part,
    Point,
    Refers,
    TwoPoints,
    refuse,
    refuse_place,
)
from exudyn_flexlink.scene.varying import (
    OF_DRIVES,
    ByOwn,
    ForceLaw,
    ForceTable,
    Table,
    TorqueLaw,
    TorqueTable,
    Value,
    Varying,
)


def _as_vector(value: Any) -> Any:
    """Let a value point down, along -y."""
    return value if isinstance(value, (list, tuple, Mapping)) else (0.0, -float(_DOWN.read(value)))


_DOWN = si.Quantity(Dimension.ACCELERATION)
_Vector = tuple[si.Acceleration, si.Acceleration]
Gravity = Annotated[
    _Vector, XY, BeforeValidator(_as_vector, json_schema_input_type=si.Acceleration | _Vector)
]
"""Acceleration of weight, [x, y] in m/s^2."""


class TorsionalSpring(Part):
    """A spring, a damper or both, that act on the angle of a revolute joint."""

    one_or_none = (("stiffness", "frequency", "torque"), ("damping", "damping_ratio"))
    type: Literal["torsional"] = "torsional"
    joint: Annotated[Name, REVOLUTE] = Field(description="name of a revolute joint")
    stiffness: si.NonNegativeTorsionalStiffness | None = Field(
        None, description="torque per angle; or 'frequency'; neither: a damper alone"
    )
    frequency: si.PositiveFrequency | None = Field(
        None,
        description="undamped frequency of the body about its grounded joint, with what is welded "
        "to it; or 'stiffness'",
    )
    torque: Annotated[TorqueLaw, ByOwn("angle", TorqueTable, Dimension.TORQUE)] | None = Field(
        None,
        description="in place of a stiffness: a table of torques by angle, or a formula of "
        "'angle'; positive: it turns the second body back, clockwise",
    )
    damping: si.NonNegativeTorsionalDamping | None = Field(
        None, description="torque per angular speed; or 'damping_ratio'"
    )
    damping_ratio: Annotated[float, si.Number(at_least=0.0)] | None = Field(
        None, description="part of critical damping; or 'damping'"
    )
    rest_angle: si.Angle | None = Field(
        None, description="angle of the joint without torque; left out: as assembled"
    )

    @model_validator(mode="after")
    def _has_a_spring_or_a_damper(self) -> TorsionalSpring:
        stiff = self.stiffness, self.frequency, self.torque
        if all(value is None for value in (*stiff, self.damping)):
            refuse("needs 'stiffness', 'frequency', 'torque' or 'damping'")
        if self.torque is not None and self.damping_ratio is not None:
            refuse("needs a spring of one stiffness", "give 'damping'", at="damping_ratio")
        if self.torque is not None and self.rest_angle is not None:
            refuse("a table or a formula tells where it has none", "leave it out", at="rest_angle")
        if self.damping_ratio is not None and self.stiffness == 0:
            refuse("needs a spring: the stiffness is 0", "give 'damping'", at="damping_ratio")
        return self


class LinearSpring(Part):
    """A spring, a damper or both, between two points, or along a prismatic joint."""

    one_of = (("points", "joint"),)
    type: Literal["linear"] = "linear"
    points: TwoPoints | None = Field(
        None, description="two points 'body.point', of which one may be 'ground'; or 'joint'"
    )
    at: Point | None = Field(
        None, description="where the spring is held on the ground, [x, y], metres"
    )
    joint: Annotated[Name, Refers("joints", "a prismatic joint", ("prismatic",))] | None = Field(
        None, description="name of a prismatic joint; or 'points'"
    )
    stiffness: si.NonNegativeStiffness = Field(
        0.0, description="force per change of length; left out: a damper alone"
    )
    damping: si.NonNegativeDamping = Field(0.0, description="force per rate of that change")
    acts: Literal["both", "tension", "compression"] = Field(
        "both",
        description="tension: only where it is longer than 'length', as a rope; compression: only "
        "where it is shorter, as a buffer; its damper neither pushes in a rope nor pulls in a "
        "buffer",
    )
    preload: si.NonNegativeForce = Field(
        0.0, description="with 'acts': force with which it begins; left out: 0"
    )
    force: Annotated[ForceLaw, ByOwn("length", ForceTable, Dimension.FORCE)] | None = Field(
        None,
        description="in place of a stiffness: a table of forces by length, or a formula of "
        "'length'; positive: it pulls both ends together",
    )
    length: si.Coordinate | None = Field(
        None,
        description="without force; along a joint how far its second point is from its first, with "
        "a sign; left out: as assembled. One of length 0 between points draws them together, its "
        "damper in every direction too",
    )

    @model_validator(mode="after")
    def _acts_on_one_side(self) -> LinearSpring:
        if self.acts == "both":
            if self.preload:
                refuse("needs 'acts': tension or compression", at="preload")
            return self
        what = "a rope" if self.acts == "tension" else "a buffer"
        if isinstance(self.force, Expression):
            refuse("acts on both sides", "take a table of 'force', or min and max", at="acts")
        if self.force is None and not self.stiffness:
            refuse(f"{what} needs a 'stiffness'")
        if self.length is None:
            refuse("missing 'length'", f"at which {what} begins to act")
        if isinstance(self.force, ForceTable) and self.length is not None:
            self._fits(self.force, self.length)
        if self.points is not None and self.length == 0:
            refuse(f"must be greater than 0 of {what} between points", at="length")
        return self

    def _fits(self, table: ForceTable, length: float) -> None:
        """Refuse a table that does not begin at the length, or goes on to the wrong side."""
        rope = self.acts == "tension"
        if table.points is None:  # its file has a mistake
            return
        edge = table.points[0 if rope else -1][0]
        if edge != length:
            key = "first" if rope else "last"
            refuse(f"its {key} row must be at 'length', {length:g} m", at=("force", "points"))
        if table.rule != "linear":
            refuse("a force of one side is 'linear' between rows", at=("force", "rule"))
        way = 1.0 if rope else -1.0
        for i, (_, force) in enumerate(table.points):
            if way * force < 0:
                what = "a rope can't push" if rope else "a buffer can't pull: its forces are < 0"
                refuse(what, at=("force", "points", i, 1))
        if not any(force for _, force in table.points):
            refuse("has no force at all", at=("force", "points"))
        if self.preload:
            refuse("a table says itself with which force it begins", at="preload")

    @model_validator(mode="after")
    def _has_a_force_and_a_place(self) -> LinearSpring:
        if self.force is not None and self.stiffness:
            refuse("'stiffness' and 'force' exclude each other; give one of them", at="force")
        if self.force is not None and self.acts == "both" and self.length is not None:
            refuse("a table or a formula tells where it has no force", "leave it out", at="length")
        if not {"stiffness", "damping", "force"} & self.model_fields_set:
            refuse("needs 'stiffness', 'damping' or 'force'")
        if self.points is None and self.at is not None:
            refuse("only a spring with the ground has a fixed place", at="at")
        if self.points is not None:
            refuse_place("spring", self.points, self.at)
            if self.points[0] == self.points[1]:
                refuse("needs two different points", at="points")
            if self.length is not None and self.length < 0:
                refuse("must be 0 or greater between two points", at="length")
        return self


class _Ramped(Part):
    """A drive whose value, a number, may be reached along a ramp."""

    @model_validator(mode="after")
    def _ramp_of_a_number(self) -> _Ramped:
        if getattr(self, "ramp", 0.0) and not isinstance(getattr(self, "value", 0.0), float):
            why = "an expression or a table says itself how it rises"
            refuse(f"a ramp belongs to a number: {why}", "leave the ramp out", at="ramp")
        return self


OF_A_DRIVE = "name of a revolute or prismatic joint, or of a sleeve without clearance"


class SpeedDrive(_Ramped):
    """Prescribes the speed at which a joint turns or slides: its second body against its first."""

    type: Literal["speed"] = "speed"
    joint: Annotated[Name, DRIVEN] = Field(description=OF_A_DRIVE)
    value: Annotated[Value, Varying(*OF_DRIVES["speed"])] = Field(
        description="counter-clockwise speed of the second body, or its speed along the line; of "
        "time alone"
    )
    ramp: si.NonNegativeDuration = Field(0.0, description="time from rest to the full speed")

    @model_validator(mode="after")
    def _of_time_alone(self) -> SpeedDrive:
        _refuse_state(self.value, "speed")
        if isinstance(self.value, Table) and self.value.rule == "step":
            refuse("a speed can't jump", "rule: linear or cubic", at=("value", "rule"))
        return self


class MotionDrive(Part):
    """Prescribes the angle of a joint, or its length: its second body against its first."""

    type: Literal["motion"] = "motion"
    joint: Annotated[Name, DRIVEN] = Field(description=OF_A_DRIVE)
    value: Annotated[Value, Varying(*OF_DRIVES["motion"])] = Field(
        description="angle of the second body, counter-clockwise, or how far its point is along "
        "the line from the first; of time alone"
    )

    @model_validator(mode="after")
    def _of_time_alone(self) -> MotionDrive:
        _refuse_state(self.value, "motion")
        if isinstance(self.value, Table) and self.value.rule != "cubic":
            refuse("a motion's speed can't jump", "rule: cubic", at=("value", "rule"))
        return self


class TorqueDrive(_Ramped):
    """Applies a torque at a revolute joint: on its second body, back on its first. Several add."""

    type: Literal["torque"] = "torque"
    joint: Annotated[
        Name, replace(REVOLUTE, to_slides="along it pushes a drive of type force, at a point")
    ] = Field(description="name of a revolute joint")
    value: Annotated[Value, Varying(*OF_DRIVES["torque"])] = Field(
        description="counter-clockwise torque on the second body; of time and state"
    )
    ramp: si.NonNegativeDuration = Field(0.0, description="time from zero to the full torque")


ForceValue = Annotated[Value, Varying(*OF_DRIVES["force"])]


class ForceDrive(Part):
    """Applies a force at a point of a body."""

    type: Literal["force"] = "force"
    point: MovingPointName = Field(description="point 'body.point' at which the force acts")
    value: Annotated[tuple[ForceValue, ForceValue], XY] = Field(
        description="[x, y] along the axes, each of time and state"
    )
    axes: Annotated[Name, Refers("frames")] = Field(
        GROUND,
        description="'ground', or the body with whose axes the force turns; of a flexible body's "
        "own point, those of the rod there",
    )


def _refuse_state(value: Value, what: str) -> None:
    if isinstance(value, Expression) and value.sensed:
        sensed = value.sensed[0]
        message = f"a {what} is of t alone; '{sensed.kind}({sensed.of})' belongs to the state"
        refuse(message, "a drive of type torque or force may depend on the state", at="value")


Spring = Annotated[TorsionalSpring | LinearSpring, ByType()]
Drive = Annotated[SpeedDrive | MotionDrive | TorqueDrive | ForceDrive, ByType()]

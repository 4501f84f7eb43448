"""Joints between bodies."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from exudyn_flexlink.quantities import Angle, NonNegativeLength
from exudyn_flexlink.scene.base import (
    GROUND,
    ByType,
    MovingPointName,
    Name,
    Part,
    Point,
    PointName,
    refuse,
)


class _AtPoints(Part):
    """A joint of two points, which says where it sits if one of them is the ground."""

    points: tuple[PointName, PointName] = Field(
        description="two points 'body.point'; one may be 'ground'"
    )
    at: Point | None = Field(None, description="where the joint sits on the ground, [x, y], metres")

    @model_validator(mode="after")
    def _sits_on_ground(self) -> _AtPoints:
        if self.points == (GROUND, GROUND):
            refuse("joins the ground to itself", at="points")
        if GROUND in self.points and self.at is None:
            refuse("missing 'at'", "where the joint sits on the ground, e.g. at: [0.02, 0]")
        if GROUND not in self.points and self.at is not None:
            refuse("only a joint with the ground has a fixed place", at="at")
        return self


class RevoluteJoint(_AtPoints):
    """Two points coincide, the bodies turn; positive: the second turns counter-clockwise."""

    type: Literal["revolute"] = "revolute"


class WeldJoint(_AtPoints):
    """Two points coincide and the angle between the bodies is fixed."""

    type: Literal["weld"] = "weld"
    angle: Angle = Field(0.0, description="of the second body relative to the first")


class SlotJoint(Part):
    """A point of a body stays on a curve fixed to the ground."""

    type: Literal["slot"] = "slot"
    point: MovingPointName = Field(description="point 'body.point' that stays on the curve")
    curve: Name = Field(description="name of a curve")


class SleeveJoint(Part):
    """A link slides along the axis of a guide and turns with it."""

    type: Literal["sleeve"] = "sleeve"
    guide: Name = Field(description="name of the body slid along, from its start to its end")
    link: Name = Field(description="name of the body that slides: rod or flexible")
    clearance: NonNegativeLength = Field(0.0, description="on each side, between guide and link")

    @model_validator(mode="after")
    def _no_clearance_yet(self) -> SleeveJoint:
        if self.clearance != 0:
            refuse("a sleeve with clearance can't be simulated yet; only 0", at="clearance")
        return self


Joint = Annotated[RevoluteJoint | SlotJoint | SleeveJoint | WeldJoint, ByType()]

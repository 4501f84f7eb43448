"""Pairs that may strike each other."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from exudyn_flexlink.quantities import NonNegativeLength, PositiveLength
from exudyn_flexlink.scene.base import (
    GROUND,
    ByType,
    CurveName,
    Flag,
    MovingPointName,
    Part,
    Point,
    PointName,
    listed,
    refuse,
    split_point,
)
from exudyn_flexlink.scene.contact_laws import Law, refuse_misfit

Line = Annotated[tuple[MovingPointName, MovingPointName], listed("body.point", "body.point")]


def _require_line(line: tuple[str, str]) -> str:
    """Return the body of a line, which has two points of it."""
    first, second = (split_point(point)[0] for point in line)
    if first != second:
        refuse("the two points must be of one body", at="line")
    if line[0] == line[1]:
        refuse("a line needs two different points", at="line")
    return first


class PointOnLine(Part):
    """A point of a body can't cross the segment between two points of another body."""

    type: Literal["point_on_line"] = "point_on_line"
    point: MovingPointName = Field(description="point 'body.point' that strikes")
    line: Line = Field(description="two points of the struck body")
    side: Literal["left", "right"] = Field(
        "left", description="which side of the line, from its first to its second point, is free"
    )
    law: Law = Field(description="force of the contact, or its impulse")

    @property
    def striking(self) -> str:
        """Point that strikes, 'body.point'."""
        return self.point

    @property
    def struck(self) -> str:
        """Body that is struck."""
        return split_point(self.line[0])[0]

    def __str__(self) -> str:
        """Say what meets what, in the words of a report."""
        return f"{self.point} on the line from {self.line[0]} to {self.line[1]}"

    @model_validator(mode="after")
    def _two_bodies(self) -> PointOnLine:
        if split_point(self.point)[0] == _require_line(self.line):
            refuse("the point is on the same body as the line", at="point")
        refuse_misfit(self.law)
        return self


class Circle(Part):
    """A circle around a point of a body, or around a place on the ground."""

    at: PointName = Field(description="its centre: a point 'body.point', or 'ground'")
    place: Point | None = Field(None, description="of the centre on the ground, [x, y], metres")
    radius: PositiveLength = Field(description="radius of the circle")
    inside: Flag = Field(False, description="true: the other circle is inside this one")

    @model_validator(mode="after")
    def _sits_on_ground(self) -> Circle:
        if self.at == GROUND and self.place is None:
            refuse("missing 'place'", "where its centre is on the ground, e.g. place: [0.02, 0]")
        if self.at != GROUND and self.place is not None:
            refuse("only a circle on the ground has a fixed place", at="place")
        return self


class CircleOnCircle(Part):
    """Two circles of two bodies can't cross: outside each other, or one inside the other."""

    type: Literal["circle_on_circle"] = "circle_on_circle"
    circles: Annotated[tuple[Circle, Circle], listed("circle", "circle")] = Field(
        description="two circles of different bodies"
    )
    law: Law = Field(description="force of the contact, or its impulse")

    @property
    def inner_and_outer(self) -> tuple[Circle, Circle]:
        """The circles, the hollow one last if there is one."""
        first, second = self.circles
        return (second, first) if first.inside else (first, second)

    @property
    def striking(self) -> str:
        """Centre that strikes, 'body.point': the first, the second if that is on the ground."""
        first, second = self.inner_and_outer
        return second.at if first.at == GROUND else first.at

    @property
    def struck(self) -> str | None:
        """Body that is struck; None for the ground."""
        first, second = self.inner_and_outer
        return None if GROUND in (first.at, second.at) else split_point(second.at)[0]

    def __str__(self) -> str:
        """Say what meets what, in the words of a report."""
        first, second = self.inner_and_outer
        way = "in" if second.inside else "on"
        return f"circle around {first.at} {way} that around {second.at}"

    @model_validator(mode="after")
    def _two_bodies(self) -> CircleOnCircle:
        first, second = self.inner_and_outer
        one, other = (split_point(circle.at)[0] for circle in (first, second))
        if one == other:
            where = "on the ground" if one == GROUND else f"of the body '{one}'"
            refuse(f"both circles are {where}", "give circles of different bodies", at="circles")
        if first.inside and second.inside:
            refuse("each circle can't be inside the other", "leave one 'inside' out", at="circles")
        if second.inside and not first.radius < second.radius:
            hint, at = f"a radius below {second.radius:g} m", self.circles.index(first)
            message = "the circle inside must be the smaller one"
            refuse(message, hint, at=("circles", at, "radius"))
        refuse_misfit(self.law, self.radii)
        return self

    @property
    def radii(self) -> tuple[float, float]:
        """Radii (m) of both, that of a hollow negative."""
        first, second = self.inner_and_outer
        return first.radius, -second.radius if second.inside else second.radius


class PointOnCurve(Part):
    """A point of a body, or a roller around it, can't cross a curve."""

    struck: ClassVar[str | None] = None  # what carries a curve is no lever to be struck
    type: Literal["point_on_curve"] = "point_on_curve"
    point: MovingPointName = Field(description="point 'body.point' that strikes")
    curve: CurveName = Field(description="name of the curve; 'on' a body it moves with that")
    side: Literal["left", "right"] = Field(
        "left",
        description="which side of the curve is free, seen along it; left of an arc is inside",
    )
    radius: NonNegativeLength = Field(0.0, description="of a roller around the point; 0: none")
    law: Law = Field(description="force of the contact, or its impulse")

    @property
    def striking(self) -> str:
        """Point that strikes, 'body.point'."""
        return self.point

    def __str__(self) -> str:
        """Say what meets what, in the words of a report."""
        what = f"roller around {self.point}" if self.radius > 0 else self.point
        return f"{what} on the curve {self.curve}"

    @model_validator(mode="after")
    def _law_fits(self) -> PointOnCurve:
        refuse_misfit(self.law)
        return self


class LineOnCurve(Part):
    """A straight face of a body can't cross a closed convex curve, such as a cam."""

    struck: ClassVar[str | None] = None  # what carries a curve is no lever to be struck
    type: Literal["line_on_curve"] = "line_on_curve"
    line: Line = Field(description="two points of the face, which goes on straight beyond them")
    side: Literal["left", "right"] = Field(
        "left", description="which side of the line, seen along it, the curve is on"
    )
    curve: CurveName = Field(description="name of the curve; 'on' a body it moves with that")
    law: Law = Field(description="force of the contact, or its impulse")

    @property
    def striking(self) -> str:
        """First point of the face, 'body.point'."""
        return self.line[0]

    def __str__(self) -> str:
        """Say what meets what, in the words of a report."""
        return f"face from {self.line[0]} to {self.line[1]} on the curve {self.curve}"

    @model_validator(mode="after")
    def _one_body(self) -> LineOnCurve:
        _require_line(self.line)
        refuse_misfit(self.law)
        return self


Contact = Annotated[PointOnLine | CircleOnCircle | PointOnCurve | LineOnCurve, ByType()]

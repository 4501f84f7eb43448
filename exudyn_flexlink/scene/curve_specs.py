"""Curves as a model file describes them; their geometry is in `exudyn_flexlink.curves`."""

from __future__ import annotations

from math import pi
from typing import Annotated, Literal

from pydantic import Field, model_validator

from exudyn_flexlink.quantities import Angle, PositiveLength
from exudyn_flexlink.scene.base import (
    BodyName,
    ByType,
    CurveName,
    Flag,
    Part,
    Point,
    Text,
    listed,
    refuse,
)

FULL_TURN = 2 * pi * (1 + 1e-12)  # 360 deg, however it was rounded


class _Carried(Part):
    """A curve that may move with a body."""

    on: BodyName | None = Field(
        None, description="name of the body, rod or rigid, that carries it in its own axes"
    )


class _Arc(_Carried):
    """A closed curve, or the part of it between two angles."""

    from_: Angle | None = Field(
        None, alias="from", description="start of an arc, parameter angle; with 'to'"
    )
    to: Angle | None = Field(None, description="end of an arc, greater than 'from'")

    @model_validator(mode="after")
    def _from_and_to_belong_together(self) -> _Arc:
        if (self.from_ is None) != (self.to is None):
            given, other = ("to", "from") if self.from_ is None else ("from", "to")
            refuse(f"'{given}' needs '{other}'", at=given)
        if self.from_ is not None and self.to is not None:
            if self.to <= self.from_:
                refuse("must be greater than 'from'", "arcs run counter-clockwise", at="to")
            if self.to - self.from_ > FULL_TURN:
                refuse("an arc can't be longer than a full turn", at="to")
        return self


class EllipseSpec(_Arc):
    """An ellipse, or an arc of it: centre + (a cos u, b sin u), turned by `rotation`."""

    type: Literal["ellipse"] = "ellipse"
    centre: Point = Field(description="[x, y], metres")
    semi_axes: Annotated[tuple[PositiveLength, PositiveLength], listed("a", "b")] = Field(
        description="[a, b], metres"
    )
    rotation: Angle = Field(0.0, description="of the first axis from +x, counter-clockwise")


class CircleSpec(_Arc):
    """A circle, or an arc of it."""

    type: Literal["circle"] = "circle"
    centre: Point = Field(description="[x, y], metres")
    radius: PositiveLength = Field(description="radius")


class LineSpec(_Carried):
    """A straight segment."""

    type: Literal["line"] = "line"
    from_: Point = Field(alias="from", description="first point [x, y], metres")
    to: Point = Field(description="last point [x, y], metres")

    @model_validator(mode="after")
    def _points_differ(self) -> LineSpec:
        if self.from_ == self.to:
            refuse("'from' and 'to' are the same point", at="to")
        return self


class SplineSpec(_Carried):
    """A smooth curve through points, given here or in a CSV file."""

    one_of = (("points", "file"),)
    type: Literal["spline"] = "spline"
    points: tuple[Point, ...] | None = Field(None, description="[[x, y], ...], metres")
    file: Text | None = Field(
        None,
        description="CSV file of x, y, relative to the model's folder; a header may name units",
    )
    closed: Flag | None = Field(
        None,
        description="true: the last point is joined to the first; left out: as true, if that chord "
        "is like those beside it",
    )


Piece = EllipseSpec | CircleSpec | LineSpec | SplineSpec


class JoinedSpec(_Carried):
    """Pieces one after the other, each starting where the last one ended."""

    type: Literal["joined"] = "joined"
    pieces: tuple[Annotated[CurveName | Piece, ByType()], ...] = Field(
        min_length=1, description="curves written here, or names of curves, in order"
    )


class LapsSpec(_Carried):
    """Closed curves run one per lap, in turn; they share a point and its tangent."""

    type: Literal["laps"] = "laps"
    curves: tuple[
        Annotated[CurveName | Piece | JoinedSpec, ByType()],
        ...,
    ] = Field(
        min_length=1,
        description="names of curves, or curves written here, in order: of lap 1, lap 2, .., or "
        "backwards from the start of lap 1 of lap -1, lap -2, ..",
    )
    meet: Point | None = Field(None, description="where a lap ends, [x, y], metres")


CurveSpec = Annotated[Piece | JoinedSpec | LapsSpec, ByType()]

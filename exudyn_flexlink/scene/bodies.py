"""Materials, cross-sections, bodies and curves, as a model file describes them.

The geometry of curves is in `exudyn_flexlink.curves`.
"""

from __future__ import annotations

from math import pi
from typing import Annotated, Literal

from pydantic import Field, Strict, model_validator

from exudyn_flexlink import quantities as si
from exudyn_flexlink.quantities import Angle, Dimension, PositiveLength
from exudyn_flexlink.scene.base import (
    BodyName,
    ByType,
    CurveName,
    Flag,
    MaterialName,
    Named,
    Part,
    Point,
    Text,
    by_name,
    listed,
    refuse,
)

FULL_TURN = 2 * pi * (1 + 1e-12)  # 360 deg, with room for rounding


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


class SuperellipseSpec(_Arc):
    """A superellipse |x/a|^n + |y/b|^n = 1 about its centre, turned by `rotation`, or an arc."""

    type: Literal["superellipse"] = "superellipse"
    centre: Point = Field(description="[x, y], metres")
    semi_axes: Annotated[tuple[PositiveLength, PositiveLength], listed("a", "b")] = Field(
        description="[a, b], metres"
    )
    exponent: Annotated[float, si.Number(above=3.0)] = Field(
        description="n, above 3; 4 is a 'squircle', 2 would be an ellipse"
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


class PolygonSpec(_Carried):
    """Straight sides from point to point, with an arc in place of every corner."""

    type: Literal["polygon"] = "polygon"
    points: tuple[Point, ...] = Field(min_length=3, description="corners [[x, y], ...], metres")
    closed: Flag = Field(False, description="true: a side goes from the last point to the first")
    round: PositiveLength = Field(description="radius of the arcs at all corners")


Piece = EllipseSpec | SuperellipseSpec | CircleSpec | LineSpec | SplineSpec | PolygonSpec


class JoinedSpec(_Carried):
    """Pieces one after the other, each starting where the last one ended."""

    type: Literal["joined"] = "joined"
    pieces: tuple[Annotated[CurveName | Piece, ByType()], ...] = Field(
        min_length=1, description="curves written here, or names of curves, in order"
    )
    round: PositiveLength | None = Field(
        None,
        description="radius of arcs at all corners, between lines and arcs of circles; left out: "
        "pieces must meet without corners",
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


class Material(Part):
    """A homogeneous, isotropic, linearly elastic material."""

    density: si.PositiveDensity = Field(description="mass per volume")
    youngs_modulus: si.PositivePressure = Field(description="modulus of elasticity E")
    poissons_ratio: Annotated[float, si.Number(above=-1.0, at_most=0.5)] | None = Field(
        None, description="lateral contraction ratio; not needed by rods and hinges"
    )


class RectangleSection(Part):
    """A rectangle that bends about the middle of its thickness."""

    type: Literal["rectangle"] = "rectangle"
    width: si.PositiveLength = Field(description="across the plane of motion")
    thickness: si.PositiveLength = Field(
        description="in the plane of motion, the bending direction"
    )

    @property
    def area(self) -> float:
        """Area (m^2)."""
        return self.width * self.thickness

    @property
    def second_moment(self) -> float:
        """Second moment of area about the bending axis (m^4)."""
        return self.width * self.thickness**3 / 12

    @property
    def half_height(self) -> float:
        """Distance of the outermost fibre from the bending axis (m)."""
        return self.thickness / 2


class RoundSection(Part):
    """A full circle."""

    type: Literal["round"] = "round"
    diameter: si.PositiveLength = Field(description="diameter of the circle")

    @property
    def area(self) -> float:
        """Area (m^2)."""
        return pi * self.diameter**2 / 4

    @property
    def second_moment(self) -> float:
        """Second moment of area about the bending axis (m^4)."""
        return pi * self.diameter**4 / 64

    @property
    def half_height(self) -> float:
        """Distance of the outermost fibre from the bending axis (m)."""
        return self.diameter / 2


class GeneralSection(Part):
    """Any section, given by its two numbers."""

    type: Literal["general"] = "general"
    area: si.PositiveArea = Field(description="area")
    second_moment: si.PositiveSecondMoment = Field(
        description="second moment of area about the bending axis"
    )

    @property
    def half_height(self) -> None:
        """Distance of the outermost fibre from the bending axis: not known."""


Section = Annotated[
    RectangleSection | RoundSection | GeneralSection,
    ByType(default="rectangle"),
]


class _Straight(Part):
    """A straight, uniform body from `start` to `end`."""

    length: si.PositiveLength = Field(description="from start to end, unbent")
    material: MaterialName = Field(description="name of a material")
    section: Section = Field(description="cross-section")
    slender: Flag = Field(
        True,
        description="true: inertia m l^2/12 about the centre, of each rod of a flexible body; "
        "false: adds that of the section",
    )
    points: Named[si.PositiveLength] = by_name(
        "named points by their distance from the start; on a hinge: of the rod before"
    )

    @model_validator(mode="after")
    def _stations_are_on_it(self) -> _Straight:
        for name, place in self.points.items():
            if place > self.length:
                refuse(f"is beyond the end, at {self.length:g} m", at=("points", name))
        return self


class RodBody(_Straight):
    """A straight, uniform, rigid rod from `start` to `end`."""

    type: Literal["rod"] = "rod"

    @property
    def point_names(self) -> tuple[str, ...]:
        """Names of the points that joints and contacts may refer to."""
        return ("start", "end", "centre", *self.points)


class RigidBody(Part):
    """A rigid body given by its mass, its inertia and named points in its own axes."""

    type: Literal["rigid"] = "rigid"
    mass: si.PositiveMass = Field(description="mass")
    inertia: si.NonNegativeInertia = Field(
        description="moment of inertia about the centre of mass; 0: a point mass"
    )
    points: Named[Point] = by_name(
        "named points [x, y] in the body's axes, metres, beside 'centre', that of mass"
    )
    centre_of_mass: Point = Field((0.0, 0.0), description="[x, y] in the body's axes, metres")

    @property
    def point_names(self) -> tuple[str, ...]:
        """Names of the points that joints and contacts may refer to; `centre` is that of mass."""
        return (*self.points, "centre")


HingeStiffness = Annotated[
    float | Literal["paper", "beam"],
    si.Quantity(Dimension.TORSIONAL_STIFFNESS, above=0.0, words=("paper", "beam")),
]


class Hinges(Part):
    """The torsional springs between the rods of a flexible body."""

    stiffness: HingeStiffness = Field(
        description="paper: E I / length of the link; beam: E I / length of a rod; or a number"
    )
    damping: si.NonNegativeTorsionalDamping = Field(
        0.0, description="viscous damping of each hinge"
    )


class FlexibleBody(_Straight):
    """A straight flexible link: rigid rods joined by hinges with torsional springs."""

    type: Literal["flexible"] = "flexible"
    rods: Annotated[int, Strict()] = Field(
        ge=1,
        le=1000,
        description="number of rods; with layout half_ends of hinges, and one rod more",
    )
    layout: Literal["equal", "half_ends"] = Field(
        "equal", description="half_ends: the first and the last rod are half as long as the others"
    )
    hinges: Hinges = Field(description="springs between the rods")
    stretch: Flag = Field(
        False,
        description="true: every rod is two halves that slide on each other, with an axial spring "
        "E A / length of the rod",
    )

    @property
    def point_names(self) -> tuple[str, ...]:
        """Names of the points that joints and contacts may refer to."""
        return ("start", "end", *self.points)

    @model_validator(mode="after")
    def _half_ends_are_two(self) -> FlexibleBody:
        if self.layout == "half_ends" and self.rods < 2:
            refuse("half_ends needs at least 2 rods", at="rods")
        return self


Body = Annotated[RodBody | RigidBody | FlexibleBody, ByType()]

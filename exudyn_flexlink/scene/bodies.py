"""Materials, cross-sections and bodies."""

from __future__ import annotations

from math import pi
from typing import Annotated, Literal

from pydantic import Field, Strict, model_validator

from exudyn_flexlink import quantities as si
from exudyn_flexlink.scene.base import (
    ByType,
    Flag,
    MaterialName,
    Named,
    Part,
    Point,
    by_name,
    refuse,
)
from exudyn_flexlink.units import Dimension


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


class GeneralSection(Part):
    """Any section, given by its two numbers."""

    type: Literal["general"] = "general"
    area: si.PositiveArea = Field(description="area")
    second_moment: si.PositiveSecondMoment = Field(
        description="second moment of area about the bending axis"
    )


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

"""Laws of contacts as a model file gives them; their forces are in `exudyn_flexlink.laws`."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from exudyn_flexlink import quantities as si
from exudyn_flexlink.restitution import FACTORS, restitution_of
from exudyn_flexlink.scene.base import ByType, MaterialName, Part, listed, refuse

Restitution = Annotated[
    float,
    si.Number(at_least=0.0, at_most=1.0),
    Field(description="speed after an impact over speed before, 0 to 1"),
]
Coefficient = Annotated[
    float,
    si.Number(at_least=0.0),
    Field(description="Coulomb's coefficient; left out: smooth"),
]
SlipSpeed = Annotated[
    si.PositiveSpeed,
    Field(description="above it the friction acts in full; below, the contact creeps"),
]
Power = Annotated[float, si.Number(at_least=1.0, at_most=10.0)]


class ContactLaw(Part):
    """Penalty contact with restitution; see `exudyn_flexlink.laws`."""

    type: Literal["penalty"] = "penalty"
    stiffness: si.PositiveStiffness = Field(
        description="force per penetration at speed; at rest (1 + restitution^2)/2 of it"
    )
    restitution: Restitution
    transition_speed: si.PositiveSpeed = Field(
        5e-3, description="above it the restitution acts in full"
    )
    friction: Coefficient = 0.0
    slip_speed: SlipSpeed = 1e-3


class DampedLaw(Part):
    """Penalty contact F = K d^n (1 + (a/v) d'), v the approach speed; `type` gives the factor a.

    See `exudyn_flexlink.laws`. Only `exact` returns the restitution asked; `check` tells what the
    others return.
    """

    type: Literal["hunt_crossley", "lankarani_nikravesh", "flores", "gonthier", "exact"]
    exponent: Power = Field(si.HERTZ, description="n, of the penetration; 1.5: Hertz")
    stiffness: si.PowerStiffness = Field(
        description="K, in units that fit the exponent n: force at a penetration of 1 m"
    )
    restitution: Restitution
    transition_speed: si.PositiveSpeed = Field(
        1e-3, description="least approach speed that counts: slower touches are damped less"
    )
    friction: Coefficient = 0.0
    slip_speed: SlipSpeed = 1e-3

    @model_validator(mode="after")
    def _has_a_factor(self) -> DampedLaw:
        if self.restitution == 0 and self.type in ("flores", "gonthier", "exact"):
            hint = "a small one, or 'hunt_crossley', which returns more than is asked"
            refuse(f"must be greater than 0: '{self.type}' divides by it", hint, at="restitution")
        return self

    @property
    def factor(self) -> float:
        """Factor a of the law."""
        return FACTORS[self.type](self.restitution)

    @property
    def returned(self) -> float:
        """Restitution that it really gives."""
        return restitution_of(self.factor)


class HertzLaw(Part):
    """Penalty contact of elastic bodies without losses, by its stiffness or by their materials."""

    restitution: ClassVar[float] = 1.0  # nothing is lost
    type: Literal["hertz"] = "hertz"
    one_of = (("stiffness", "materials"),)
    belonging: ClassVar = {
        "stiffness": ("exponent",),
        "materials": ("formula", "radii", "length"),
    }
    exponent: Power | None = Field(
        None, description="n, of the penetration; left out: 1.5, that of spheres"
    )
    stiffness: si.PowerStiffness | None = Field(
        None, description="K, in units that fit the exponent n: force at a penetration of 1 m"
    )
    materials: (
        Annotated[tuple[MaterialName, MaterialName], listed("material", "material")] | None
    ) = Field(None, description="names of the materials of both bodies")
    formula: Literal["sphere", "lankarani_nikravesh", "johnson", "radzimovsky"] | None = Field(
        None,
        description="left out: sphere, which is lankarani_nikravesh of a pin in a bore; johnson "
        "and radzimovsky: parallel cylinders",
    )
    radii: Annotated[tuple[si.Coordinate, ...], Field(min_length=1, max_length=2)] | None = Field(
        None,
        description="of both bodies where they touch, metres, that of a hollow negative; one: the "
        "other is flat; not for circles and bearings, which have radii",
    )
    length: si.PositiveLength | None = Field(None, description="of both cylinders along their axes")
    friction: Coefficient = 0.0
    slip_speed: SlipSpeed = 1e-3

    @model_validator(mode="after")
    def _fits_its_formula(self) -> HertzLaw:
        lines = self.formula in ("johnson", "radzimovsky")
        if lines and self.length is None:
            refuse("missing 'length', that of the cylinders", at="formula")
        if not lines and self.length is not None:
            refuse("no length enters", "'formula: johnson' or 'radzimovsky' has one", at="length")
        return self


class ImpulseLaw(Part):
    """Rigid contact with restitution: speeds jump. Not for redundant coordinates."""

    type: Literal["impulse"] = "impulse"
    restitution: Restitution


class RubbingImpulse(ImpulseLaw):
    """Rigid contact with restitution and friction: speeds jump. Not for redundant coordinates."""

    friction: Coefficient = 0.0
    tangential_restitution: Annotated[float, si.Number(at_least=0.0, at_most=1.0)] = Field(
        0.0,
        description="slip after an impact over slip before, the other way, 0 to 1, as far as "
        "friction is enough; of what is round",
    )
    slip_speed: si.PositiveSpeed = Field(
        1e-3,
        description="of what lasts: above it the friction acts in full; below, the contact creeps",
    )

    @model_validator(mode="after")
    def _turns_back_by_friction(self) -> RubbingImpulse:
        if self.tangential_restitution > 0 and self.friction == 0:
            message = "needs 'friction', which turns the slip back"
            refuse(message, "e.g. friction: 0.5", at="tangential_restitution")
        return self


PenaltyLaw = ContactLaw | DampedLaw | HertzLaw
"""Laws that give way."""
GivingLaw = Annotated[PenaltyLaw, ByType(default="penalty")]
Law = Annotated[ContactLaw | DampedLaw | HertzLaw | RubbingImpulse, ByType(default="penalty")]


def refuse_misfit(law: PenaltyLaw | ImpulseLaw, radii: tuple[float, float] | None = None) -> None:
    """Refuse Hertz's law by materials where its radii do not fit it, or are missing.

    `radii` (m) are those that the contact itself has, if any; that of a hollow is negative.
    """
    if not isinstance(law, HertzLaw) or law.materials is None:
        return
    if radii is not None and law.radii is not None:
        refuse("the circles give the radii", "leave these out", at=("law", "radii"))
    found, at = (radii, ("law",)) if radii else (law.radii, ("law", "radii"))
    if found is None:
        refuse("missing 'radii' of both bodies where they touch", "e.g. [10 mm, -12 mm]", at="law")
    lines = law.formula in ("johnson", "radzimovsky")
    if len(found) == 1 and lines:
        refuse(f"'{law.formula}' needs two radii: on a flat its depth has no bound", at=at)
    if 0 in found or not 0 < sum(1 / radius for radius in found) < math.inf:
        hint = "that of a hollow is negative, and the larger one"
        refuse("bodies of these radii do not touch at one place", hint, at=at)
    if law.formula == "lankarani_nikravesh" and min(found) > 0:
        hint = "'formula: sphere', with the same exponent"
        refuse("'lankarani_nikravesh' is for a pin in a bore: nothing is hollow", hint, at=at)

"""Laws of contact, as a model file gives them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from exudyn_flexlink.quantities import Number, PositiveSpeed, PositiveStiffness
from exudyn_flexlink.scene.base import ByType, Part


class ContactLaw(Part):
    """Penalty contact with restitution; see `exudyn_flexlink.laws`."""

    type: Literal["penalty"] = "penalty"
    stiffness: PositiveStiffness = Field(
        description="force per penetration at speed; at rest (1 + restitution^2)/2 of it"
    )
    restitution: Annotated[float, Number(at_least=0.0, at_most=1.0)] = Field(
        description="speed after an impact over speed before, 0 to 1"
    )
    transition_speed: PositiveSpeed = Field(
        5e-3, description="above it the restitution acts in full"
    )
    friction: Annotated[float, Number(at_least=0.0)] = Field(
        0.0, description="Coulomb's coefficient; left out: smooth"
    )
    slip_speed: PositiveSpeed = Field(
        1e-3, description="above it the friction acts in full; below, the contact creeps"
    )


class ImpulseLaw(Part):
    """Rigid contact with restitution: speeds jump. Not for redundant coordinates."""

    type: Literal["impulse"] = "impulse"
    restitution: Annotated[float, Number(at_least=0.0, at_most=1.0)] = Field(
        description="speed after an impact over speed before, 0 to 1"
    )


Law = Annotated[ContactLaw | ImpulseLaw, ByType(default="penalty")]

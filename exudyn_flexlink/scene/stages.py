"""Stages of a run: when a formula rises through 0, joints open or close, and values change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, TypeVar

from pydantic import BeforeValidator, Field, WithJsonSchema

from exudyn_flexlink.expressions import Expression
from exudyn_flexlink.scene.base import Condition, FrozenMapping, Named, Part, by_name
from exudyn_flexlink.scene.contacts import Contact
from exudyn_flexlink.scene.forces import Drive, Spring
from exudyn_flexlink.scene.joints import Joint

Value = TypeVar("Value")
CHANGING = ("joints", "springs", "drives", "contacts")
"""Sections of which a stage may add and remove parts."""


def _frozen(value: Any) -> Any:
    """Return plain data as read-only mappings and tuples."""
    if isinstance(value, Mapping):
        return FrozenMapping({key: _frozen(item) for key, item in value.items()})
    return tuple(_frozen(item) for item in value) if isinstance(value, (list, tuple)) else value


ANY = {"type": ["number", "string", "boolean", "array", "object"]}
Plain = Annotated[Any, BeforeValidator(_frozen), WithJsonSchema(ANY)]


class Added(Part):
    """Parts that exist from a stage on."""

    joints: Named[Joint] = by_name("joints, which close where their points are at that instant")
    springs: Named[Spring] = by_name(
        "springs; without a rest length or angle they rest as they are at that instant"
    )
    drives: Named[Drive] = by_name("motors and forces")
    contacts: Named[Contact] = by_name("pairs that may strike each other")


class Stage(Part):
    """A change of the mechanism as a formula rises through 0; the run goes on with it."""

    until: Annotated[Expression, Condition()] = Field(
        description="formula as of 'run: until': the stage begins as it rises through 0. The first "
        "stage's must be below 0 at the start; later ones count after they have been below 0"
    )
    remove: tuple[str, ...] = Field(
        (), description="parts to remove, such as joints.latch: joints, springs, drives, contacts"
    )
    set: Named[Plain] = by_name(
        "new values of parts that stay, by their keys, such as drives.motor.value: 0; also gravity"
    )
    add: Added = Field(
        default_factory=Added,
        description="new parts; a weld or a slide without an angle takes that of its bodies then",
    )


def at_first(section: str, parts: Mapping[str, Value], stages: Sequence[Stage]) -> dict[str, Value]:
    """Parts of a section, without the parts that a later stage adds.

    A result's scene has all parts of all stages: see `whole_scene`.
    """
    return {n: part for n, part in parts.items() if not _comes_later(section, n, part, stages)}


def _comes_later(section: str, name: str, part: object, stages: Sequence[Stage]) -> bool:
    """Tell whether a stage adds exactly this part, and no earlier stage removes one of its name."""
    for stage in stages:
        if f"{section}.{name}" in stage.remove:
            return False
        if name in getattr(stage.add, section):
            return bool(getattr(stage.add, section)[name] == part)
    return False

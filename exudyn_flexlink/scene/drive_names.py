"""Whether the names in drives lead to parts of the kind needed there."""

from __future__ import annotations

from collections.abc import Iterator

from exudyn_flexlink.expressions import Expression, Sensed, in_words
from exudyn_flexlink.scene.base import GROUND, split_point
from exudyn_flexlink.scene.bodies import FlexibleBody
from exudyn_flexlink.scene.forces import (
    Drive,
    ForceDrive,
    MotionDrive,
    SpeedDrive,
    TorqueDrive,
)
from exudyn_flexlink.scene.joints import PrismaticJoint, RevoluteJoint, SleeveJoint
from exudyn_flexlink.scene.lookup import Lookup, valid
from exudyn_flexlink.scene.varying import Measured, Value
from exudyn_flexlink.source import KeyPath, Mistake
from exudyn_flexlink.units import Dimension, Powers

_DIMENSIONS = {
    "speed": (Dimension.ANGULAR_SPEED, Dimension.SPEED),
    "motion": (Dimension.ANGLE, Dimension.LENGTH),
}
"""What drives prescribe of joints that turn, and of those that slide."""


def drives(look: Lookup) -> Iterator[Mistake]:
    """Refuse joints and points in drives that are none, and a motion prescribed twice.

    Torques at one joint add up, also where a drive prescribes its motion: that gives the rest.
    """
    prescribed: dict[str, str] = {}
    for name, drive in valid(look.parts.drives):
        path: KeyPath = ("drives", name)
        yield from _expressions(look, path, drive)
        if isinstance(drive, ForceDrive):
            yield from look.point((*path, "point"), drive.point)
            yield from _axes(look, path, drive)
            continue
        yield from _joint(look, path, drive)
        if isinstance(drive, TorqueDrive):
            continue
        first = prescribed.setdefault(drive.joint, name)
        if first != name:
            message = f"the motion of '{drive.joint}' is already prescribed by '{first}'"
            yield Mistake((*path, "joint"), message, "one drive of type speed or motion a joint")


def _joint(
    look: Lookup, path: KeyPath, drive: SpeedDrive | MotionDrive | TorqueDrive
) -> Iterator[Mistake]:
    """Refuse a joint that does not move so, and a value that is not of the kind it needs."""
    at = (*path, "joint")
    joint = look.get("joints", drive.joint)
    slides = isinstance(joint, PrismaticJoint | SleeveJoint)
    if isinstance(drive, TorqueDrive):
        for found in look.revolute(at, drive.joint):
            hint = "along it pushes a drive of type force, at a point" if slides else found.hint
            yield Mistake(at, found.message, hint)
        return
    yield from look.turning_or_sliding(at, drive.joint)
    if not slides and not isinstance(joint, RevoluteJoint):
        return
    wanted = _DIMENSIONS[drive.type][slides]
    given = _powers(drive.value)
    if given is not None and given != wanted.powers._replace(rad=0):
        message = f"expected {wanted.words}, since '{drive.joint}' is of type {joint.type}"
        yield Mistake((*path, "value"), f"{message}; got {in_words(given)}", wanted.hint)


def _powers(value: Value) -> Powers | None:
    """Dimension of a value as far as its units tell, angles counting as numbers."""
    if isinstance(value, Measured):
        return value.dimension.powers._replace(rad=0)
    return value.powers if isinstance(value, Expression) else None


def _axes(look: Lookup, path: KeyPath, drive: ForceDrive) -> Iterator[Mistake]:
    if drive.axes == GROUND:
        return
    yield from look.missing((*path, "axes"), "bodies", drive.axes)
    own = drive.axes == split_point(drive.point)[0]
    if isinstance(look.get("bodies", drive.axes), FlexibleBody) and not own:
        hint = "a force at the body's own point turns with it there"
        yield Mistake((*path, "axes"), f"'{drive.axes}' is flexible: its axes differ", hint)


def _expressions(look: Lookup, path: KeyPath, drive: Drive) -> Iterator[Mistake]:
    """Refuse joints and points in expressions that are none."""
    values = drive.value if isinstance(drive.value, tuple) else (drive.value,)
    for i, value in enumerate(values):
        if isinstance(value, Expression):
            here = (*path, "value", i) if isinstance(drive.value, tuple) else (*path, "value")
            for sensed in value.sensed:
                yield from _sensed(look, here, sensed)


def _sensed(look: Lookup, path: KeyPath, sensed: Sensed) -> Iterator[Mistake]:
    if sensed.kind == "speed":
        yield from look.turning_or_sliding(path, sensed.of)
    elif sensed.kind == "place" and not sensed.axis:
        yield from look.sliding(path, sensed.of)
    elif sensed.axis:
        try:
            yield from look.point(path, sensed.of)
        except ValueError as error:
            yield Mistake(path, str(error))
    else:
        yield from look.revolute(path, sensed.of)

"""Whether the names in drives lead to parts of the kind needed there."""

from __future__ import annotations

from collections.abc import Iterator

from exudyn_flexlink.expressions import Expression, Sensed
from exudyn_flexlink.scene.base import GROUND, split_point
from exudyn_flexlink.scene.bodies import FlexibleBody
from exudyn_flexlink.scene.forces import Drive, ForceDrive
from exudyn_flexlink.scene.lookup import Lookup, valid
from exudyn_flexlink.source import KeyPath, Mistake


def drives(look: Lookup) -> Iterator[Mistake]:
    """Refuse joints and points in drives that are none, and joints that are driven twice."""
    driven: dict[str, str] = {}
    for name, drive in valid(look.parts.drives):
        path: KeyPath = ("drives", name)
        yield from _expressions(look, path, drive)
        if isinstance(drive, ForceDrive):
            yield from look.point((*path, "point"), drive.point)
            yield from _axes(look, path, drive)
            continue
        yield from look.revolute((*path, "joint"), drive.joint)
        if drive.joint in driven:
            message = f"the joint '{drive.joint}' is already driven by '{driven[drive.joint]}'"
            yield Mistake((*path, "joint"), message)
        driven.setdefault(drive.joint, name)


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
    if sensed.axis:
        try:
            yield from look.point(path, sensed.of)
        except ValueError as error:
            yield Mistake(path, str(error))
    else:
        yield from look.revolute(path, sensed.of)

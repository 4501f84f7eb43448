"""Whether every name in a scene leads to a part of the kind that is needed there."""

from __future__ import annotations

import re
from collections.abc import Iterator

from exudyn_flexlink.scene.base import GROUND
from exudyn_flexlink.scene.bodies import RigidBody
from exudyn_flexlink.scene.drive_names import drives
from exudyn_flexlink.scene.force_names import contacts, springs
from exudyn_flexlink.scene.joint_names import curves, joints
from exudyn_flexlink.scene.lookup import Lookup, Parts, valid
from exudyn_flexlink.scene.point_masses import point_masses
from exudyn_flexlink.scene.state_names import initial, outputs, run
from exudyn_flexlink.source import KeyPath, Mistake

_NAME = re.compile(r"[^\W\d](?:[\w -]*[\w-])?")


def find_mistakes(parts: Parts) -> list[Mistake]:
    """Return every name that leads nowhere, or to the wrong kind of part."""
    look = Lookup(parts)
    checks = (_materials, curves, joints, springs, drives, contacts, initial, run, outputs)
    found = [mistake for check in (*checks, point_masses) for mistake in check(look)]
    return [*_odd_names(parts), *found]


def _odd_names(parts: Parts) -> Iterator[Mistake]:
    sections = ("materials", "curves", "bodies", "joints", "springs", "drives", "contacts")
    for section in sections:
        for name in getattr(parts, section) or {}:
            yield from _odd_name((section, name))
    for body, part in valid(parts.bodies):
        for name in part.points:
            path: KeyPath = ("bodies", body, "points", name)
            yield from _odd_name(path)
            if not isinstance(part, RigidBody) and name in ("start", "end"):
                yield Mistake(path, f"'{name}' is already a point", on_key=True)
    if parts.bodies is not None and not parts.bodies:
        yield Mistake(("bodies",), "a scene needs at least one body")


def _odd_name(path: KeyPath) -> Iterator[Mistake]:
    name = str(path[-1])
    if not _NAME.fullmatch(name):
        hint = "a letter first, then letters, digits, '_', '-' or spaces"
        yield Mistake(path, f"'{name}' can't be a name", hint, on_key=True)
    if path[0] == "bodies" and len(path) == 2 and name == GROUND:
        yield Mistake(path, "'ground' is the fixed frame, no body", on_key=True)
    if len(path) > 2 and name == "centre":
        hint = "every rigid body has the point 'centre' at its centre_of_mass"
        yield Mistake(path, "'centre' is already a point", hint, on_key=True)


def _materials(look: Lookup) -> Iterator[Mistake]:
    for name, body in valid(look.parts.bodies):
        if not isinstance(body, RigidBody):
            yield from look.missing(("bodies", name, "material"), "materials", body.material)

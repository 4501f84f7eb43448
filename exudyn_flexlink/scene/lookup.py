"""Looks up what names in a scene refer to, and says which lead nowhere."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any

from exudyn_flexlink.scene.base import GROUND, split_point, type_of
from exudyn_flexlink.scene.bodies import Body, Material
from exudyn_flexlink.scene.contacts import Contact
from exudyn_flexlink.scene.curve_specs import CurveSpec
from exudyn_flexlink.scene.forces import Drive, Spring
from exudyn_flexlink.scene.joints import Joint, PrismaticJoint, RevoluteJoint, SleeveJoint
from exudyn_flexlink.scene.outputs import Outputs
from exudyn_flexlink.scene.run import Initial, Run
from exudyn_flexlink.source import MOST_SHOWN, KeyPath, Mistake, did_you_mean

_NOUNS = {"materials": "material", "curves": "curve", "bodies": "body", "joints": "joint"}


@dataclass(frozen=True)
class Parts:
    """The parts of a scene as far as they are valid.

    A part that is not is `None`: its name is known, its contents are not. A section that can't be
    read at all is `None`: no reference into it is a mistake.
    """

    materials: Mapping[str, Material | None] | None
    curves: Mapping[str, CurveSpec | None] | None
    bodies: Mapping[str, Body | None] | None
    joints: Mapping[str, Joint | None] | None
    springs: Mapping[str, Spring | None] | None
    drives: Mapping[str, Drive | None] | None
    contacts: Mapping[str, Contact | None] | None
    initial: Initial | None
    run: Run | None
    outputs: Outputs | None

    @classmethod
    def of(cls, sections: Mapping[str, Any]) -> Parts:
        """Take the sections that can hold names from a scene's."""
        return cls(**{key: sections.get(key) for key in cls.__dataclass_fields__})


def valid(section: Mapping[str, Any] | None) -> list[tuple[str, Any]]:
    """Return the parts of a section that are valid, by name."""
    return [(name, part) for name, part in (section or {}).items() if part is not None]


class Lookup:
    """The parts of a scene by name."""

    def __init__(self, parts: Parts) -> None:
        self.parts = parts
        self._unknown = 0

    def missing(self, path: KeyPath, section: str, name: str) -> Iterator[Mistake]:
        """Refuse a name that no part of the section has."""
        known = getattr(self.parts, section)
        if known is None or name in known:
            return
        # Every unknown name compared with every known one: more are reported than are shown.
        self._unknown += 1
        near = did_you_mean(name, known) if self._unknown <= MOST_SHOWN else ""
        names = [*islice(known, MOST_SHOWN), *(["..."] if len(known) > MOST_SHOWN else [])]
        hint = f"{section}: {', '.join(names)}" if known else f"no {section} given"
        yield Mistake(path, f"unknown {_NOUNS[section]} '{name}'{near}", hint)

    def get(self, section: str, name: str) -> Any:
        """Return the part of that name, None if there is none or it is not valid."""
        return (getattr(self.parts, section) or {}).get(name)

    def point(self, path: KeyPath, text: str) -> Iterator[Mistake]:
        """Refuse a point 'body.point' whose body, or point, is unknown."""
        body, point = split_point(text)
        if body == GROUND:
            return
        yield from self.missing(path, "bodies", body)
        part = self.get("bodies", body)
        if part is not None and point not in part.point_names:
            message = f"body '{body}' has no point '{point}'"
            message += did_you_mean(point, part.point_names)
            yield Mistake(path, message, "its points: " + ", ".join(part.point_names))

    def joint(self, path: KeyPath, name: str, kind: type[Joint]) -> Iterator[Mistake]:
        """Refuse a name that is not that of a joint of a kind."""
        yield from self.missing(path, "joints", name)
        joint = self.get("joints", name)
        if joint is not None and not isinstance(joint, kind):
            message = f"needs a {type_of(kind)} joint; '{name}' is of type {joint.type}"
            yield Mistake(path, message)

    def turning_or_sliding(self, path: KeyPath, name: str) -> Iterator[Mistake]:
        """Refuse a name that is not that of a revolute joint, or of one that only slides."""
        if not isinstance(self.get("joints", name), RevoluteJoint):
            yield from self.sliding(path, name, "a revolute or prismatic joint")

    def sliding(
        self, path: KeyPath, name: str, wanted: str = "a prismatic joint", play: bool = False
    ) -> Iterator[Mistake]:
        """Refuse a name that is not that of a prismatic joint or a sleeve; with `play` any."""
        yield from self.missing(path, "joints", name)
        joint = self.get("joints", name)
        sleeve = isinstance(joint, SleeveJoint)
        if joint is None or isinstance(joint, PrismaticJoint):
            return
        if not sleeve:
            message = f"needs {wanted}, or a sleeve; '{name}' is of type {joint.type}"
            yield Mistake(path, message)
        elif joint.clearance > 0 and not play:
            hint = "the link may lie askew there; it does not just slide"
            yield Mistake(path, f"needs a sleeve without clearance; '{name}' has one", hint)

    def revolute(self, path: KeyPath, name: str) -> Iterator[Mistake]:
        """Refuse a name that is not that of a revolute joint."""
        yield from self.joint(path, name, RevoluteJoint)

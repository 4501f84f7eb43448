"""Whether every name in a scene leads to a part of the kind that is needed there."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any

from exudyn_flexlink.scene.base import GROUND, split_point
from exudyn_flexlink.scene.bodies import Body, FlexibleBody, Material, RigidBody
from exudyn_flexlink.scene.curve_specs import CurveSpec, JoinedSpec, LapsSpec
from exudyn_flexlink.scene.forces import Contact, Drive, SpeedDrive, Spring
from exudyn_flexlink.scene.joints import Joint, RevoluteJoint, SleeveJoint, SlotJoint, WeldJoint
from exudyn_flexlink.scene.outputs import Outputs
from exudyn_flexlink.scene.run import Initial, Run
from exudyn_flexlink.source import MOST_SHOWN, KeyPath, Mistake, did_you_mean

_NAME = re.compile(r"[^\W\d](?:[\w -]*[\w-])?")
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


def find_mistakes(parts: Parts) -> list[Mistake]:
    """Return every name that leads nowhere, or to the wrong kind of part."""
    check = _Check(parts)
    return [
        *_odd_names(parts),
        *check.materials(),
        *check.curves(),
        *check.joints(),
        *check.springs(),
        *check.drives(),
        *check.contacts(),
        *check.initial(),
        *check.run(),
        *check.outputs(),
        *check.connections(),
    ]


def _valid(section: Mapping[str, Any] | None) -> list[tuple[str, Any]]:
    return [(name, part) for name, part in (section or {}).items() if part is not None]


def _odd_names(parts: Parts) -> Iterator[Mistake]:
    sections = ("materials", "curves", "bodies", "joints", "springs", "drives", "contacts")
    for section in sections:
        for name in getattr(parts, section) or {}:
            yield from _odd_name((section, name))
    for body, part in _valid(parts.bodies):
        if isinstance(part, RigidBody):
            for name in part.points:
                yield from _odd_name(("bodies", body, "points", name))
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


class _Check:
    """The references of each section."""

    def __init__(self, parts: Parts) -> None:
        self.parts = parts
        self._unknown = 0

    def missing(self, path: KeyPath, section: str, name: str) -> Iterator[Mistake]:
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
        return (getattr(self.parts, section) or {}).get(name)

    def point(self, path: KeyPath, text: str) -> Iterator[Mistake]:
        body, point = split_point(text)
        if body == GROUND:
            return
        yield from self.missing(path, "bodies", body)
        part = self.get("bodies", body)
        if part is not None and point not in part.point_names:
            message = f"body '{body}' has no point '{point}'"
            message += did_you_mean(point, part.point_names)
            yield Mistake(path, message, "its points: " + ", ".join(part.point_names))

    def revolute(self, path: KeyPath, name: str) -> Iterator[Mistake]:
        yield from self.missing(path, "joints", name)
        joint = self.get("joints", name)
        if joint is not None and not isinstance(joint, RevoluteJoint):
            yield Mistake(path, f"needs a revolute joint; '{name}' is of type {joint.type}")

    def materials(self) -> Iterator[Mistake]:
        for name, body in _valid(self.parts.bodies):
            if not isinstance(body, RigidBody):
                yield from self.missing(("bodies", name, "material"), "materials", body.material)

    def curves(self) -> Iterator[Mistake]:
        for name, curve in _valid(self.parts.curves):
            path = ("curves", name)
            for where, inner in _references(path, curve):
                yield from self.missing(where, "curves", inner)
                laps = isinstance(self.get("curves", inner), LapsSpec)
                if laps and inner != name:
                    yield Mistake(where, f"'{inner}' is of type laps, no part of a curve")
            for where, inner in _references(path, curve):
                if name in self._reachable(inner):
                    yield Mistake(where, f"'{name}' would contain itself")

    def _reachable(self, name: str) -> set[str]:
        found: set[str] = set()
        queue = [name]
        while queue:
            here = queue.pop()
            if here not in found:
                found.add(here)
                queue += [inner for _, inner in _references((), self.get("curves", here))]
        return found

    def joints(self) -> Iterator[Mistake]:
        for name, joint in _valid(self.parts.joints):
            path = ("joints", name)
            if isinstance(joint, (RevoluteJoint, WeldJoint)):
                for i, text in enumerate(joint.points):
                    yield from self.point((*path, "points", i), text)
                one, other = (split_point(text)[0] for text in joint.points)
                if one == other:
                    yield Mistake((*path, "points"), f"joins the body '{one}' to itself")
            elif isinstance(joint, SlotJoint):
                yield from self.point((*path, "point"), joint.point)
                yield from self.missing((*path, "curve"), "curves", joint.curve)
            elif isinstance(joint, SleeveJoint):
                yield from self._sleeve(path, joint)

    def _sleeve(self, path: KeyPath, joint: SleeveJoint) -> Iterator[Mistake]:
        yield from self.missing((*path, "guide"), "bodies", joint.guide)
        yield from self.missing((*path, "link"), "bodies", joint.link)
        guide, link = self.get("bodies", joint.guide), self.get("bodies", joint.link)
        if joint.guide == joint.link:
            yield Mistake((*path, "link"), "the link must be another body than the guide")
        elif isinstance(link, RigidBody):
            yield Mistake((*path, "link"), f"'{joint.link}' must be of type rod or flexible")
        if guide is not None and not {"start", "end"} <= set(guide.point_names):
            hint = "the link slides along the line from start to end"
            yield Mistake((*path, "guide"), f"'{joint.guide}' needs points start and end", hint)
        elif isinstance(guide, RigidBody):
            (x0, y0), (x1, y1) = guide.points["start"], guide.points["end"]
            if x1 <= x0 or abs(y1 - y0) > 1e-12:
                message = f"the line from start to end of '{joint.guide}' must run along its x-axis"
                hint = "give both points the same y, and the end the larger x"
                yield Mistake((*path, "guide"), message, hint)

    def springs(self) -> Iterator[Mistake]:
        for name, spring in _valid(self.parts.springs):
            path = ("springs", name)
            yield from self.revolute((*path, "joint"), spring.joint)
            joint = self.get("joints", spring.joint)
            if not isinstance(joint, RevoluteJoint):
                continue
            for key in ("frequency", "damping_ratio"):
                if getattr(spring, key) is not None and not self._swings(joint):
                    hint = "of a rod or a rigid body hinged to the ground; else give "
                    hint += "'stiffness'" if key == "frequency" else "'damping'"
                    yield Mistake((*path, key), f"'{spring.joint}' has no {key} of its own", hint)

    def _swings(self, joint: RevoluteJoint) -> bool:
        """Whether the joint hinges one body, not a flexible one, to the ground."""
        if GROUND not in joint.points:
            return False
        moving = next(text for text in joint.points if text != GROUND)
        return not isinstance(self.get("bodies", split_point(moving)[0]), FlexibleBody)

    def drives(self) -> Iterator[Mistake]:
        driven: dict[str, str] = {}
        for name, drive in _valid(self.parts.drives):
            path = ("drives", name, "joint")
            yield from self.revolute(path, drive.joint)
            if drive.joint in driven:
                message = f"the joint '{drive.joint}' is already driven by '{driven[drive.joint]}'"
                yield Mistake(path, message)
            driven.setdefault(drive.joint, name)

    def contacts(self) -> Iterator[Mistake]:
        for name, contact in _valid(self.parts.contacts):
            yield from self.point(("contacts", name, "point"), contact.point)
            for i, text in enumerate(contact.line):
                yield from self.point(("contacts", name, "line", i), text)

    def initial(self) -> Iterator[Mistake]:
        for key in ("angles", "guesses", "speeds", "velocities"):
            for body in getattr(self.parts.initial, key, ()):
                for found in self.missing(("initial", key, body), "bodies", body):
                    yield Mistake(found.path, found.message, found.hint, on_key=True)

    def run(self) -> Iterator[Mistake]:
        run = self.parts.run
        if run is None or run.of is None:
            return
        yield from self.revolute(("run", "of"), run.of)
        drives = self.parts.drives
        if run.at_most or drives is None or None in drives.values():
            return
        speeds = {
            drive.joint: (name, drive.value)
            for name, drive in _valid(drives)
            if isinstance(drive, SpeedDrive)
        }
        driver, speed = speeds.get(run.of, (None, 0.0))
        if driver is not None and speed == 0:
            hint = f"another speed, or 'run: at_most' to end without the turns of '{run.of}'"
            yield Mistake(("drives", driver, "value"), "a joint at rest makes no turns", hint)
        if driver is None and isinstance(self.get("joints", run.of), RevoluteJoint):
            hint = f"no drive sets the speed of '{run.of}', so the turns may never be reached"
            yield Mistake(("run",), "missing 'at_most'", hint, on_key=True)

    def outputs(self) -> Iterator[Mistake]:
        point = self.parts.outputs.watch if self.parts.outputs else None
        if point is None:
            return
        path = ("outputs", "watch")
        yield from self.point(path, point)
        for name, joint in _valid(self.parts.joints):
            if isinstance(joint, (RevoluteJoint, WeldJoint)) and {point, GROUND} == {*joint.points}:
                message = f"'{point}' never moves: the joint '{name}' holds it on the ground"
                yield Mistake(path, message, "errors are judged by this point; watch another one")

    def connections(self) -> Iterator[Mistake]:
        joints = self.parts.joints
        if joints is None or None in joints.values():
            return
        joined = {body for joint in joints.values() for body in _bodies(joint)}
        bodies = self.parts.bodies or {}
        if not joined <= {GROUND, *bodies}:
            return  # an unknown body is reported; it is likely the one that seems unconnected
        for body in bodies:
            if body not in joined:
                yield Mistake(
                    ("bodies", body), f"body '{body}' is connected to nothing", on_key=True
                )


def _references(path: KeyPath, curve: CurveSpec | None) -> list[tuple[KeyPath, str]]:
    """Return the names of curves that a curve is made of, with their paths."""
    found: list[tuple[KeyPath, str]] = []
    if isinstance(curve, (JoinedSpec, LapsSpec)):
        key = "pieces" if isinstance(curve, JoinedSpec) else "curves"
        for i, inner in enumerate(getattr(curve, key)):
            here = (*path, key, i)
            found += [(here, inner)] if isinstance(inner, str) else _references(here, inner)
    return found


def _bodies(joint: Joint | None) -> list[str]:
    """Return the bodies that a joint connects."""
    if isinstance(joint, SlotJoint):
        return [split_point(joint.point)[0]]
    if isinstance(joint, SleeveJoint):
        return [joint.guide, joint.link]
    return [split_point(text)[0] for text in joint.points] if joint else []

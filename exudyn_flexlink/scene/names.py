"""Whether parts fit the parts that they name: what one part alone can't tell."""

from __future__ import annotations

import re
from collections.abc import Iterator

from exudyn_flexlink.expressions import Expression, in_words
from exudyn_flexlink.scene.base import GROUND, split_point
from exudyn_flexlink.scene.bodies import FlexibleBody, RigidBody
from exudyn_flexlink.scene.contact_laws import HertzLaw
from exudyn_flexlink.scene.contacts import LineOnCurve, PointOnCurve
from exudyn_flexlink.scene.curve_specs import CurveSpec, JoinedSpec, LapsSpec
from exudyn_flexlink.scene.forces import ForceDrive, LinearSpring, SpeedDrive, TorqueDrive
from exudyn_flexlink.scene.gear_checks import gear_mistakes
from exudyn_flexlink.scene.joints import (
    PointsJoint,
    RevoluteJoint,
    SleeveJoint,
    SlotJoint,
    WeldJoint,
)
from exudyn_flexlink.scene.lookup import Parts
from exudyn_flexlink.scene.point_masses import point_masses
from exudyn_flexlink.scene.varying import OF_DRIVES, Measured, Value
from exudyn_flexlink.source import KeyPath, Mistake
from exudyn_flexlink.units import Powers

_NAME = re.compile(r"[^\W\d](?:[\w -]*[\w-])?")


def find_mistakes(parts: Parts) -> list[Mistake]:
    """Return every name that leads nowhere, or to the wrong kind of part."""
    checks = (_odd_names, Parts.lost_names, _curves, _joints, _springs, _drives, _contacts)
    others = (_materials_of_laws, gear_mistakes, _initial, _run, _outputs, point_masses)
    return [mistake for check in (*checks, *others) for mistake in check(parts)]


def _odd_names(parts: Parts) -> Iterator[Mistake]:
    sections = ("materials", "curves", "bodies", "joints", "springs", "drives", "contacts")
    for section in sections:
        for name in parts.sections.get(section) or ():
            yield from _odd_name((section, name))
    for body, part in parts.valid("bodies"):
        for name in part.points:
            path: KeyPath = ("bodies", body, "points", name)
            yield from _odd_name(path)
            if not isinstance(part, RigidBody) and name in ("start", "end"):
                yield Mistake(path, f"'{name}' is already a point", on_key=True)
    if parts.sections.get("bodies") == {}:
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


def _curves(parts: Parts) -> Iterator[Mistake]:
    """Refuse curves that can't be made of those they name, and what can't carry a curve."""
    for name, curve in parts.valid("curves"):
        path: KeyPath = ("curves", name)
        if isinstance(parts.get("bodies", curve.on), FlexibleBody):
            yield Mistake((*path, "on"), f"'{curve.on}' is flexible: it can't carry a curve")
        for where, inner in _pieces(path, curve):
            found = parts.get("curves", inner) if isinstance(inner, str) else inner
            outer = where[:-2] == path  # a piece of a piece is told by that, if it has a name
            if outer and found is not None and found.on is not None:
                hint = "say 'on' of the whole curve"
                yield Mistake(where, "a piece of a curve can't be carried by itself", hint)
            if isinstance(inner, str) and isinstance(found, LapsSpec) and inner != name:
                yield Mistake(where, f"'{inner}' is of type laps, no part of a curve")
            if isinstance(inner, str) and name in _reachable(parts, inner):
                yield Mistake(where, f"'{name}' would contain itself")


def _reachable(parts: Parts, name: str) -> set[str]:
    found: set[str] = set()
    queue = [name]
    while queue:
        here = queue.pop()
        if here not in found:
            found.add(here)
            pieces = _pieces((), parts.get("curves", here))
            queue += [inner for _, inner in pieces if isinstance(inner, str)]
    return found


def _pieces(path: KeyPath, curve: CurveSpec | None) -> Iterator[tuple[KeyPath, CurveSpec | str]]:
    """Curves of which another is made, written there or named, and those of which they are made."""
    if isinstance(curve, (JoinedSpec, LapsSpec)):
        key = "pieces" if isinstance(curve, JoinedSpec) else "curves"
        for i, inner in enumerate(getattr(curve, key)):
            yield (*path, key, i), inner
            if not isinstance(inner, str):
                yield from _pieces((*path, key, i), inner)


def _joints(parts: Parts) -> Iterator[Mistake]:
    """Refuse joints of a part with itself, and guides in which nothing can slide."""
    for name, joint in parts.valid("joints"):
        path = ("joints", name)
        if isinstance(joint, PointsJoint):
            one, other = (split_point(text)[0] for text in joint.points)
            if one == other:
                yield Mistake((*path, "points"), f"joins the body '{one}' to itself")
        elif isinstance(joint, SlotJoint):
            yield from _carried_along(parts, path, joint)
        elif isinstance(joint, SleeveJoint):
            yield from _sleeve(parts, path, joint)


def _carried_along(
    parts: Parts, path: KeyPath, joint: SlotJoint | PointOnCurve | LineOnCurve
) -> Iterator[Mistake]:
    curve = parts.get("curves", joint.curve)
    point, key = (
        (joint.line[0], "line") if isinstance(joint, LineOnCurve) else (joint.point, "point")
    )
    if curve is not None and curve.on == split_point(point)[0]:
        yield Mistake((*path, key), f"is on '{curve.on}', which carries the curve")


def _sleeve(parts: Parts, path: KeyPath, joint: SleeveJoint) -> Iterator[Mistake]:
    guide, link = parts.get("bodies", joint.guide), parts.get("bodies", joint.link)
    if joint.guide == joint.link:
        yield Mistake((*path, "link"), "the link must be another body than the guide")
    elif isinstance(link, RigidBody):
        yield Mistake((*path, "link"), f"'{joint.link}' must be of type rod or flexible")
    message = hint = ""
    if isinstance(guide, FlexibleBody):
        hint = "a guide is straight; a link that bends slides in one"
        message = f"'{joint.guide}' must be of type rod or rigid"
    elif guide is not None and not {"start", "end"} <= set(guide.point_names):
        hint = "the link slides along the line from start to end"
        message = f"'{joint.guide}' needs points start and end"
    elif isinstance(guide, RigidBody):
        (x0, y0), (x1, y1) = guide.points["start"], guide.points["end"]
        if x1 <= x0 or abs(y1 - y0) > 1e-12:
            message = f"the line from start to end of '{joint.guide}' must run along its x-axis"
            hint = "give both points the same y, and the end the larger x"
    if message:
        yield Mistake((*path, "guide"), message, hint)


def _springs(parts: Parts) -> Iterator[Mistake]:
    """Refuse springs that nothing can bend, and frequencies of what has none."""
    for name, spring in parts.valid("springs"):
        path = ("springs", name)
        if isinstance(spring, LinearSpring):
            bodies = {split_point(text)[0] for text in spring.points or ()}
            if len(bodies) == 1 and not isinstance(parts.get("bodies", *bodies), FlexibleBody):
                yield Mistake((*path, "points"), "both points are of one body, which can't change")
            continue
        joint = parts.get("joints", spring.joint)
        if not isinstance(joint, RevoluteJoint) or _swings(parts, joint):
            continue
        for key in ("frequency", "damping_ratio"):
            if getattr(spring, key) is not None:
                hint = "of a rod or a rigid body hinged to the ground; else give "
                hint += "'stiffness'" if key == "frequency" else "'damping'"
                yield Mistake((*path, key), f"'{spring.joint}' has no {key} of its own", hint)


def _swings(parts: Parts, joint: RevoluteJoint) -> bool:
    """Whether the joint hinges one body, not a flexible one, to the ground."""
    bodies = [parts.get("bodies", name) for name in joint.bodies]
    return len(bodies) == 1 and not isinstance(bodies[0], FlexibleBody)


def _drives(parts: Parts) -> Iterator[Mistake]:
    """Refuse values that do not suit the joint, and a motion prescribed twice.

    Torques at one joint add up, also where a drive prescribes its motion: that gives the rest.
    """
    prescribed: dict[str, str] = {}
    for name, drive in parts.valid("drives"):
        path: KeyPath = ("drives", name)
        if isinstance(drive, ForceDrive):
            yield from _axes(parts, path, drive)
        if isinstance(drive, (ForceDrive, TorqueDrive)):
            continue
        joint = parts.get("joints", drive.joint)
        if joint is not None and joint.type in ("revolute", "prismatic", "sleeve"):
            wanted = OF_DRIVES[drive.type][joint.type != "revolute"]
            given = _powers(drive.value)
            if given is not None and given != wanted.powers._replace(rad=0):
                message = f"expected {wanted.words}, since '{drive.joint}' is of type {joint.type}"
                message += f"; got {in_words(given)}"
                yield Mistake((*path, "value"), message, wanted.hint)
        first = prescribed.setdefault(drive.joint, name)
        if first != name:
            message = f"the motion of '{drive.joint}' is already prescribed by '{first}'"
            yield Mistake((*path, "joint"), message, "one drive of type speed or motion a joint")


def _powers(value: Value) -> Powers | None:
    """Dimension of a value as far as its units tell, angles counting as numbers."""
    if isinstance(value, Measured):
        return value.dimension.powers._replace(rad=0)
    return value.powers if isinstance(value, Expression) else None


def _axes(parts: Parts, path: KeyPath, drive: ForceDrive) -> Iterator[Mistake]:
    own = drive.axes == split_point(drive.point)[0]
    if isinstance(parts.get("bodies", drive.axes), FlexibleBody) and not own:
        hint = "a force at the body's own point turns with it there"
        yield Mistake((*path, "axes"), f"'{drive.axes}' is flexible: its axes differ", hint)


def _contacts(parts: Parts) -> Iterator[Mistake]:
    """Refuse names that a joint's own contact has, and curves that nothing can strike."""
    for name, contact in parts.valid("contacts"):
        path = ("contacts", name)
        if getattr(parts.get("joints", name), "law", None) is not None:
            message = f"'{name}' is a joint with contacts of its own"
            yield Mistake(path, message, "give it another name", on_key=True)
        if getattr(parts.get("springs", name), "acts", "both") != "both":
            message = f"'{name}' is a spring that acts on one side, a contact of its own"
            yield Mistake(path, message, "give it another name", on_key=True)
        if isinstance(contact, (PointOnCurve, LineOnCurve)):
            if isinstance(parts.get("curves", contact.curve), LapsSpec):
                message = f"'{contact.curve}' is another curve in each lap"
                yield Mistake((*path, "curve"), message, "name one of them")
            yield from _carried_along(parts, path, contact)


def _materials_of_laws(parts: Parts) -> Iterator[Mistake]:
    """Refuse materials of Hertz's law without lateral contraction."""
    found = [
        ((section, name, *within, "law"), getattr(one, "law", None))
        for section in ("joints", "contacts")
        for name, part in parts.valid(section)
        for within, one in (((), part), (("limits",), getattr(part, "limits", None)))
    ]
    for path, law in found:
        for i, own in enumerate((isinstance(law, HertzLaw) and law.materials) or ()):
            material = parts.get("materials", own)
            if material is not None and material.poissons_ratio is None:
                message = f"material '{own}' has no poissons_ratio, which Hertz's law needs"
                yield Mistake((*path, "materials", i), message)


def _initial(parts: Parts) -> Iterator[Mistake]:
    """Refuse laps that a slot does not have, states of some bodies, and a start within a ramp."""
    given = parts.sections.get("initial")
    if given is None:
        return
    for joint, lap in given.laps.items():
        slot, path = parts.get("joints", joint), ("initial", "laps", joint)
        curve = parts.get("curves", getattr(slot, "curve", None))
        if slot is not None and not isinstance(slot, SlotJoint):
            yield Mistake(path, f"'{joint}' is no slot", on_key=True)
        elif slot is not None and lap == 0:
            yield Mistake(path, "there is no lap 0", "before lap 1 is lap -1")
        elif slot is not None and lap != 1 and not isinstance(curve, LapsSpec | None):
            yield Mistake(path, f"the curve '{slot.curve}' has no laps", "leave it out")
    for body in parts.sections.get("bodies") or ():
        if given.states and body not in given.states:
            yield Mistake(("initial", "states"), f"missing '{body}'", "states are of all bodies")
    for name, drive in parts.valid("drives"):
        ramp = getattr(drive, "ramp", 0.0)
        if 0 < given.clock < ramp:
            message = f"the drive '{name}' comes up to its value until {ramp:g} s"
            yield Mistake(("initial", "clock"), message, f"0, or at least {ramp:g} s")


def _run(parts: Parts) -> Iterator[Mistake]:
    """Refuse a joint whose turns can never end the run."""
    run, drives = parts.sections.get("run"), parts.sections.get("drives")
    if run is None or run.of is None or run.at_most or drives is None or None in drives.values():
        return
    speeds = {
        drive.joint: (name, drive.value)
        for name, drive in parts.valid("drives")
        if isinstance(drive, SpeedDrive) and isinstance(drive.value, float)
    }
    driver, speed = speeds.get(run.of, (None, 0.0))
    if driver is not None and speed == 0:
        hint = f"another speed, or 'run: at_most' to end without the turns of '{run.of}'"
        yield Mistake(("drives", driver, "value"), "a joint at rest makes no turns", hint)
    if driver is None and isinstance(parts.get("joints", run.of), RevoluteJoint):
        hint = f"no drive gives '{run.of}' a constant speed, so the turns may never be reached"
        yield Mistake(("run",), "missing 'at_most'", hint, on_key=True)


def _outputs(parts: Parts) -> Iterator[Mistake]:
    """Refuse a watched point that never moves."""
    point = getattr(parts.sections.get("outputs"), "watch", None)
    for name, joint in parts.valid("joints"):
        played = isinstance(joint, RevoluteJoint) and joint.clearance > 0
        pinned = isinstance(joint, (RevoluteJoint, WeldJoint)) and not played
        if pinned and {point, GROUND} == {*joint.points}:
            message = f"'{point}' never moves: the joint '{name}' holds it on the ground"
            hint = "errors are judged by this point; watch another one"
            yield Mistake(("outputs", "watch"), message, hint)

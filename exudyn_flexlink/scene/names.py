"""Checks of a scene that need more than one part.

Names must refer to parts of the right kind, and a part must fit the parts that it names. Gears must
be able to mesh: one arm carries their joints, and no train locks itself. Nothing may turn a point
mass: it has no inertia.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache
from inspect import isclass
from itertools import islice
from typing import Any, NamedTuple, get_args

from exudyn_flexlink.expressions import Expression, Sensed, in_words
from exudyn_flexlink.quantities import OF_RACK, Measured, Powers
from exudyn_flexlink.rounding import NEGLIGIBLE
from exudyn_flexlink.scene.base import (
    DRIVEN,
    GROUND,
    HOLDING,
    REVOLUTE,
    SLIDING,
    Part,
    Refers,
    split_point,
)
from exudyn_flexlink.scene.bodies import CurveSpec, FlexibleBody, JoinedSpec, LapsSpec, RigidBody
from exudyn_flexlink.scene.contacts import CircleOnCircle, HertzLaw, LineOnCurve, PointOnCurve
from exudyn_flexlink.scene.forces import (
    DRIVE_DIMENSIONS,
    ForceDrive,
    LinearSpring,
    RopeSpring,
    SpeedDrive,
    TorqueDrive,
    TorsionalSpring,
    Value,
)
from exudyn_flexlink.scene.joints import (
    GEARED,
    BeltJoint,
    Gear,
    GearJoint,
    Joints,
    PointsJoint,
    RevoluteJoint,
    SleeveJoint,
    SlotJoint,
    WeldJoint,
    arms_of,
    concentric,
    ends_of,
    meshes_of,
)
from exudyn_flexlink.scene.stages import CHANGING, at_first
from exudyn_flexlink.source import MOST_SHOWN, KeyPath, Mistake, did_you_mean

_NOUNS = {"materials": "material", "curves": "curve", "bodies": "body", "joints": "joint"}


class Parts:
    """The valid parts of a scene's sections, and checks of the names in them.

    A part that is not valid is `None`: its name is known, its contents are not. A section that
    can't be read at all is missing, or `None`; then references into it are not checked.
    """

    def __init__(self, sections: Mapping[str, Any]) -> None:
        self.sections = sections
        self._unknown = 0  # number of unknown names so far

    def valid(self, section: str) -> list[tuple[str, Any]]:
        """Return the parts of a section that are valid, by name."""
        parts = self.sections.get(section) or {}
        return [(name, part) for name, part in parts.items() if part is not None]

    def get(self, section: str, name: str | None) -> Any:
        """Return the part of this name; None if it is missing or not valid."""
        return (self.sections.get(section) or {}).get(name)

    def lost_names(self) -> Iterator[Mistake]:
        """Refuse names that belong to no part, or to the wrong kind of part."""
        sections = dict(self.sections)
        stages = sections.pop("stages", None) or ()
        for section, section_parts in sections.items():
            for name in references(section_parts, (section,)):
                yield from self._mistakes(name)
        # An earlier stage may add the parts that a later one names. So each stage is checked as it
        # begins.
        if stages:
            for name in references(stages[0].until, ("stages", 0, "until")):
                yield from self._mistakes(name)

    def missing(
        self, path: KeyPath, section: str, name: str, on_key: bool = False
    ) -> Iterator[Mistake]:
        """Refuse a name that no part of the section has."""
        known = self.sections.get(section)
        if known is None or name in known:
            return
        # To compare an unknown name with all known ones takes time. It is done only for names that
        # are shown.
        self._unknown += 1
        near = did_you_mean(name, known) if self._unknown <= MOST_SHOWN else ""
        names = [*islice(known, MOST_SHOWN), *(["..."] if len(known) > MOST_SHOWN else [])]
        hint = f"{section}: {', '.join(names)}" if known else f"no {section} given"
        yield Mistake(path, f"unknown {_NOUNS[section]} '{name}'{near}", hint, on_key)

    def _mistakes(self, name: Reference) -> Iterator[Mistake]:
        """Refuse a name if its part is missing, or of the wrong kind."""
        refers, path = name.refers, name.path
        if refers.section == "points":
            yield from self._point(path, name.text)
        elif refers.section != "frames":
            yield from self.missing(path, refers.section, name.text, name.on_key)
        elif name.text != GROUND:
            yield from self.missing(path, "bodies", name.text)
        joint = self.get("joints", name.text) if refers.kinds else None
        if joint is None:
            return
        if joint.type not in refers.kinds:
            message = f"needs {refers.words}; '{name.text}' is of type {joint.type}"
            slides = joint.type in SLIDING.kinds
            yield Mistake(path, message, refers.to_slides if slides else "", name.on_key)
        elif isinstance(joint, SleeveJoint) and joint.clearance > 0 and not refers.play:
            hint = "the link may lie askew there; it does not just slide"
            yield Mistake(path, f"needs a sleeve without clearance; '{name.text}' has one", hint)

    def _point(self, path: KeyPath, text: str) -> Iterator[Mistake]:
        """Refuse a point 'body.point' whose body, or point, is unknown."""
        try:
            body, point = split_point(text)
        except ValueError as error:  # only a point in an expression can fail here
            yield Mistake(path, str(error))
            return
        if body == GROUND:
            return
        yield from self.missing(path, "bodies", body)
        part = self.get("bodies", body)
        if part is not None and point not in part.point_names:
            message = f"body '{body}' has no point '{point}'"
            message += did_you_mean(point, part.point_names)
            yield Mistake(path, message, "its points: " + ", ".join(part.point_names))


class Reference(NamedTuple):
    """A name in a scene: its place, as a key or as a value, and what it must refer to."""

    path: KeyPath
    refers: Refers
    text: str
    on_key: bool = False

    @property
    def body(self) -> str:
        """The body that is named, or whose point is named; empty for names of other parts."""
        if self.refers.section == "points":
            return split_point(self.text)[0]
        return self.text if self.refers.section in ("bodies", "frames") else ""


def references(value: Any, path: KeyPath = (), refers: Refers | None = None) -> Iterator[Reference]:
    """Find all names in a part, or in the value of a key whose names `refers` describes."""
    if isinstance(value, Part):
        for key, alias, inner in _referring(type(value)):
            yield from references(getattr(value, key), (*path, alias), inner)
    elif isinstance(value, Mapping):
        if refers is not None:
            yield from (Reference((*path, name), refers, name, on_key=True) for name in value)
        for name, item in value.items():
            yield from references(item, (*path, name))
    elif isinstance(value, tuple):
        for i, item in enumerate(value):
            yield from references(item, (*path, i), refers)
    elif isinstance(value, Expression):
        yield from (
            Reference(path, _wanted(sensed), sensed.of) for sensed in value.sensed if sensed.of
        )
    elif isinstance(value, str) and refers is not None:
        yield Reference(path, refers, value)


@cache
def _referring(part: type[Part]) -> list[tuple[str, str, Refers | None]]:
    """Fields of a part that may hold names: field, key, and what the names refer to."""
    fields = []
    for key, info in part.model_fields.items():
        hints = list(_naming_hints((info.annotation, *info.metadata)))
        if hints:
            refers = next((hint for hint in hints if isinstance(hint, Refers)), None)
            fields.append((key, info.alias or key, refers))
    return fields


def _naming_hints(hint: Any) -> Iterator[Any]:
    """Pieces of a type hint that matter for names: parts, expressions and `Refers`."""
    if isinstance(hint, Refers) or (isclass(hint) and issubclass(hint, (Part, Expression))):
        yield hint
    inner = hint if isinstance(hint, tuple) else get_args(hint)
    for item in (*inner, *getattr(hint, "__metadata__", ())):
        yield from _naming_hints(item)


def _wanted(sensed: Sensed) -> Refers:
    """The kind of part that an expression must name for the quantity it senses."""
    if sensed.axis:
        return Refers("points")
    twisted = replace(REVOLUTE, words="a revolute joint or a weld", kinds=("revolute", "weld"))
    kinds = {"speed": DRIVEN, "place": SLIDING, "force": HOLDING, "torque": twisted}
    return kinds.get(sensed.kind, REVOLUTE)


def gear_mistakes(parts: Parts) -> Iterator[Mistake]:
    """Refuse gears whose joints can't mesh, and gears that contradict other gears."""
    joints = dict(parts.valid("joints"))
    ties: dict[str, tuple[str, float]] = {}  # train and speed of each gear on its arm
    for name, gear in joints.items():
        if not isinstance(gear, Gear):
            continue
        kinds = [getattr(joints.get(joint), "type", "") for joint in gear.joints]
        if not all(kind in GEARED.kinds for kind in kinds):
            continue  # `lost_names` refuses it
        path = ("joints", name)
        mistakes = [*_of_wrong_kinds(path, gear, kinds), *_unheld(path, gear, joints)]
        mistakes += _in_wrong_units(path, gear, kinds[1])
        # A scene that continues a run may start with pressing teeth, a little beyond their flanks.
        goes_on = bool(getattr(parts.sections.get("initial"), "states", None))
        if not goes_on and isinstance(gear, GearJoint) and gear.beyond:
            message = "is beyond the flanks: at most half the 'backlash', either way"
            mistakes.append(Mistake((*path, "start"), message))
        yield from mistakes
        if not mistakes and not getattr(gear, "backlash", 0.0):  # play lets gears turn a little
            yield from _contradicting(path, gear, joints, ties)


def _of_wrong_kinds(path: KeyPath, gear: Gear, kinds: list[str]) -> Iterator[Mistake]:
    if isinstance(gear, BeltJoint):
        if "prismatic" in kinds:
            hint = "a rack, 'type: gear' with a radius, moves so"
            yield Mistake((*path, "joints"), "a belt needs two revolute joints", hint)
    elif kinds[0] != kinds[1] and gear.radius is None:
        given = "teeth" if gear.teeth else "ratio"
        message = "a rack and its pinion need a radius, that of the pinion's pitch circle"
        yield Mistake((*path, given), message, "e.g. radius: 40 mm")
    elif kinds[0] == kinds[1] and gear.radius is not None:
        message = "a radius is for a rack: one joint revolute, the other prismatic"
        yield Mistake((*path, "radius"), message, "give 'teeth' or 'ratio'")


def _in_wrong_units(path: KeyPath, gear: Gear, kind: str) -> Iterator[Mistake]:
    """Refuse a rack's play as an angle, and a wheel's as a length: the second joint decides."""
    law = gear.law if isinstance(gear, GearJoint) else None
    law_path, turns = (*path, "law"), kind == "revolute"
    for path_of_value, key, value in (
        *((path, *item) for item in gear),
        *((law_path, *x) for x in law or ()),
    ):
        if isinstance(value, Measured) and (value.dimension in OF_RACK) != turns:
            wanted = (OF_RACK | {slid: turned for turned, slid in OF_RACK.items()})[value.dimension]
            message = f"expected {wanted.words}, since '{gear.joints[1]}' is of type {kind}"
            yield Mistake((*path_of_value, key), message, wanted.hint)


def _unheld(path: KeyPath, gear: Gear, joints: Joints) -> Iterator[Mistake]:
    """Refuse joints without a common arm, with clearance, or with load-dependent friction."""
    (first, second), arms = gear.joints, arms_of(joints, gear)
    if first == second:
        yield Mistake((*path, "joints"), f"'{first}' can't mesh with itself")
    elif len(arms) != 1:
        message = f"no one body carries '{first}' and '{second}'"
        hint = "both hang on one arm, or the ground; a sun turns where its planets' arm is hinged"
        yield Mistake((*path, "joints"), message, hint)
    for joint in gear.joints:
        if getattr(joints[joint], "clearance", 0.0) > 0:
            yield Mistake((*path, "joints"), f"'{joint}' has clearance: its gear would come apart")
        for held in concentric(joints, joint):
            friction = joints[held].friction
            if friction is not None and friction.coefficient > 0:
                message = "the force in this joint is not known: it lacks that of teeth and belts"
                hint = f"of '{path[-1]}'; give a torque, along a slide a force"
                yield Mistake(("joints", held, "friction", "coefficient"), message, hint)


def _contradicting(
    path: KeyPath, gear: Gear, joints: Joints, ties: dict[str, tuple[str, float]]
) -> Iterator[Mistake]:
    """Refuse a gear if other gears impose another ratio; else join the trains of both wheels.

    A train ties the speeds of bodies on their arms.
    """
    arm, meshes = meshes_of(joints, gear)
    sides = [_side(joints[mesh.joint], mesh.body, arm) for mesh in meshes]
    first_body, second_body = (f"{mesh.body} on {arm}" for mesh in meshes)
    weights = gear.weights((joints[gear.joints[0]], joints[gear.joints[1]]))
    by_weight = [weight * side for weight, side in zip(weights, sides, strict=True)]
    (train, speed), (second, behind) = (
        ties.setdefault(body, (body, 1.0)) for body in (first_body, second_body)
    )
    wanted = -by_weight[0] / by_weight[1] * speed  # of the second, per speed of the train's start
    if train == second:
        if abs(wanted - behind) > NEGLIGIBLE * abs(wanted):
            message = f"contradicts other gears of {first_body} and {second_body}: none could turn"
            turned = f"{behind / speed:.6g} by the gears above, {wanted / speed:.6g} by this one"
            yield Mistake(path, message, f"turns of the second for one: {turned}", on_key=True)
        return
    for body, (start, ratio) in list(ties.items()):
        if start == second:
            ties[body] = train, ratio * wanted / behind


def _side(joint: Any, body: str, arm: str) -> float:
    """-1 if a slide counts the arm's place from its gear, else 1; angles count from the arm."""
    return -1.0 if joint.type == "prismatic" and ends_of(joint) == (body, arm) else 1.0


def stays_a_point(parts: Parts, name: str, body: RigidBody) -> bool:
    """Tell whether everything acts on a body at its centre, except perhaps friction.

    Then its angle does not matter. Joints, springs, drives, curves on the body, and forces at other
    points can turn it.
    """
    if any(place != body.centre_of_mass for place in body.points.values()):
        return False
    if any(curve.on == name for _, curve in parts.valid("curves")):
        return False
    acting = (*parts.valid("springs"), *parts.valid("drives"))
    turned = {getattr(part, "joint", None) for _, part in acting}
    turned.update(*(getattr(joint, "joints", ()) for _, joint in parts.valid("joints")))
    return not any(
        name in joint.bodies
        and (turned_joint in turned or not isinstance(joint, RevoluteJoint | SlotJoint))
        for turned_joint, joint in parts.valid("joints")
    )


def point_masses(parts: Parts) -> Iterator[Mistake]:
    """Refuse what turns a point mass: friction around it, drives and springs, a speed at the start.

    Only a body with inertia can be turned.
    """
    rough = list(_rough(parts))
    for name, body in parts.valid("bodies"):
        if not isinstance(body, RigidBody) or body.inertia > 0:
            continue
        why = next((what for what, bodies in rough if name in bodies), None)
        if why is not None and stays_a_point(parts, name, body):
            yield Mistake(
                ("bodies", name, "inertia"),
                f"friction in '{why}' turns '{name}', which has no inertia",
                "give its moment of inertia, m r^2/2 of a disc; or take the friction away",
            )
        if (what := _turned_alone(parts, name, body)) is not None:
            yield Mistake(
                ("bodies", name, "inertia"),
                f"'{what}' turns '{name}' about its own centre, where it has no inertia",
                "give its moment of inertia, m r^2/2 of a disc",
            )
        speed = getattr(parts.sections.get("initial"), "speeds", {}).get(name)
        if speed and stays_a_point(parts, name, body):
            yield Mistake(
                ("initial", "speeds", name),
                f"'{name}' is a point mass, which has no angular speed",
                "give its speed under 'velocities', or the body an 'inertia'",
            )


def _turned_alone(parts: Parts, name: str, body: RigidBody) -> str | None:
    """Name of a spring or drive that turns a body about its centre, where a single pin holds it."""
    holding = [(other, joint) for other, joint in parts.valid("joints") if name in joint.bodies]
    if len(holding) != 1 or holding[0][1].bodies != (name,):
        return None
    turned, joint = holding[0]
    points = joint.points if isinstance(joint, RevoluteJoint) else ()
    pinned = [split_point(point)[1] for point in points if split_point(point)[0] == name]
    if not pinned or body.points.get(pinned[0], body.centre_of_mass) != body.centre_of_mass:
        return None
    acting = (*parts.valid("springs"), *parts.valid("drives"))
    turns = (TorsionalSpring, TorqueDrive)
    return next((k for k, part in acting if isinstance(part, turns) and part.joint == turned), None)


def _rough(parts: Parts) -> Iterator[tuple[str, set[str]]]:
    """Contacts and bearings whose friction acts around points: each name, with its bodies."""
    for name, contact in parts.valid("contacts"):
        if getattr(contact.law, "friction", 0.0) > 0:
            if isinstance(contact, CircleOnCircle):
                yield name, {split_point(circle.at)[0] for circle in contact.circles}
            elif isinstance(contact, PointOnCurve) and contact.radius > 0:
                yield name, {split_point(contact.point)[0]}
    for name, joint in parts.valid("joints"):
        around = isinstance(joint, SlotJoint) and joint.radius > 0
        law = joint.acting if isinstance(joint, RevoluteJoint) or around else None
        dry = joint.friction if isinstance(joint, RevoluteJoint) else None
        one_way = isinstance(joint, RevoluteJoint) and joint.freewheel is not None
        if (law is not None and law.friction > 0) or (dry is not None and dry.acts) or one_way:
            yield name, set(joint.bodies)


_NAME = re.compile(r"[^\W\d](?:[\w -]*[\w-])?")


def find_mistakes(parts: Parts) -> list[Mistake]:
    """Return the mistakes of all checks in this file; they look at the scene before any stage."""
    stages = parts.sections.get("stages") or ()
    present = {
        key: at_first(key, parts.sections[key], stages)
        for key in CHANGING
        if stages and parts.sections.get(key)
    }
    parts = Parts({**parts.sections, **present})
    checks = (_odd_names, Parts.lost_names, _curves, _joints, _springs, _drives, _contacts)
    others = (_materials_of_laws, gear_mistakes, _initial, _run, _until, _outputs, point_masses)
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
    """Refuse curves made of curves that can't be pieces, and bodies that can't carry a curve."""
    for name, curve in parts.valid("curves"):
        path: KeyPath = ("curves", name)
        if isinstance(parts.get("bodies", curve.on), FlexibleBody):
            yield Mistake((*path, "on"), f"'{curve.on}' is flexible: it can't carry a curve")
        for where, inner in _pieces(path, curve):
            curve_spec = parts.get("curves", inner) if isinstance(inner, str) else inner
            outer = where[:-2] == path  # a named curve's own pieces are refused at that curve
            if outer and curve_spec is not None and curve_spec.on is not None:
                hint = "say 'on' of the whole curve"
                yield Mistake(where, "a piece of a curve can't be carried by itself", hint)
            if isinstance(inner, str) and isinstance(curve_spec, LapsSpec) and inner != name:
                yield Mistake(where, f"'{inner}' is of type laps, no part of a curve")
            if isinstance(inner, str) and name in _reachable(parts, inner):
                yield Mistake(where, f"'{name}' would contain itself")


def _reachable(parts: Parts, name: str) -> set[str]:
    reached: set[str] = set()
    queue = [name]
    while queue:
        current = queue.pop()
        if current not in reached:
            reached.add(current)
            pieces = _pieces((), parts.get("curves", current))
            queue += [inner for _, inner in pieces if isinstance(inner, str)]
    return reached


def _pieces(path: KeyPath, curve: CurveSpec | None) -> Iterator[tuple[KeyPath, CurveSpec | str]]:
    """Pieces of a curve, written inside it or named, and the pieces of those written inside."""
    if isinstance(curve, (JoinedSpec, LapsSpec)):
        key = "pieces" if isinstance(curve, JoinedSpec) else "curves"
        for i, inner in enumerate(getattr(curve, key)):
            yield (*path, key, i), inner
            if not isinstance(inner, str):
                yield from _pieces((*path, key, i), inner)


def _joints(parts: Parts) -> Iterator[Mistake]:
    """Refuse joints between a part and itself, and guides in which nothing can slide."""
    for name, joint in parts.valid("joints"):
        path = ("joints", name)
        if isinstance(joint, PointsJoint):
            first, second = (split_point(text)[0] for text in joint.points)
            if first == second:
                yield Mistake((*path, "points"), f"joins the body '{first}' to itself")
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
    """Refuse springs that nothing can strain, and frequencies that do not exist."""
    for name, spring in parts.valid("springs"):
        path = ("springs", name)
        if isinstance(spring, RopeSpring):
            yield from _on_one_body(parts, (*path, "over"), spring)
            continue
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


def _on_one_body(parts: Parts, path: KeyPath, rope: RopeSpring) -> Iterator[Mistake]:
    bodies = {split_point(entry)[0] if isinstance(entry, str) else GROUND for entry in rope.over}
    if len(bodies) == 1 and not isinstance(parts.get("bodies", *bodies), FlexibleBody):
        yield Mistake(path, "all points are of one body, whose distances can't change")


def _swings(parts: Parts, joint: RevoluteJoint) -> bool:
    """Whether the joint hinges one body, not a flexible one, to the ground."""
    bodies = [parts.get("bodies", name) for name in joint.bodies]
    return len(bodies) == 1 and not isinstance(bodies[0], FlexibleBody)


def _drives(parts: Parts) -> Iterator[Mistake]:
    """Refuse values that do not suit the joint, and a motion prescribed twice.

    Torques at one joint add up, even if a drive prescribes its motion: that drive supplies the
    rest.
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
            wanted = DRIVE_DIMENSIONS[drive.type][joint.type != "revolute"]
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
    """Dimension of a value, as far as its units tell; angles count as numbers."""
    if isinstance(value, Measured):
        return value.dimension.powers._replace(rad=0)
    return value.powers if isinstance(value, Expression) else None


def _axes(parts: Parts, path: KeyPath, drive: ForceDrive) -> Iterator[Mistake]:
    turns_along = drive.axes == split_point(drive.point)[0]
    if isinstance(parts.get("bodies", drive.axes), FlexibleBody) and not turns_along:
        hint = "a force at the body's own point turns with it there"
        yield Mistake((*path, "axes"), f"'{drive.axes}' is flexible: its axes differ", hint)


def _contacts(parts: Parts) -> Iterator[Mistake]:
    """Refuse contacts with the name of a joint or spring, and curves that can't be struck."""
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
    laws = [
        ((section, name, *within, "law"), getattr(owner, "law", None))
        for section in ("joints", "contacts")
        for name, part in parts.valid(section)
        for within, owner in (((), part), (("limits",), getattr(part, "limits", None)))
    ]
    for path, law in laws:
        for i, name_of_material in enumerate((isinstance(law, HertzLaw) and law.materials) or ()):
            material = parts.get("materials", name_of_material)
            if material is not None and material.poissons_ratio is None:
                message = (
                    f"material '{name_of_material}' has no poissons_ratio, which Hertz's law needs"
                )
                yield Mistake((*path, "materials", i), message)


def _initial(parts: Parts) -> Iterator[Mistake]:
    """Refuse laps that a slot does not have, states of some bodies only, a start within a ramp."""
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
    """Refuse a joint whose turns can never end the run; refuse `turns` in a scene with stages."""
    run, drives = parts.sections.get("run"), parts.sections.get("drives")
    if run is not None and run.turns is not None and parts.sections.get("stages"):
        hint = "say 'duration', and 'until: angle(...) - ...', which counts whole turns"
        yield Mistake(("run", "turns"), "a run of stages has no turns", hint)
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


def _until(parts: Parts) -> Iterator[Mistake]:
    """Refuse torques of joints that have no drive and no friction."""
    run, drives = parts.sections.get("run"), parts.sections.get("drives")
    path: KeyPath = ("run", "until")
    formula = getattr(run, "until", None)
    for stage in (parts.sections.get("stages") or ())[:1]:
        formula, path = stage.until, ("stages", 0, "until")
    if formula is None or drives is None or None in drives.values():
        return
    driven = {getattr(drive, "joint", None) for drive in drives.values()}
    for sensed in formula.sensed:
        joint = parts.get("joints", sensed.of)
        if sensed.kind != "torque" or not isinstance(joint, RevoluteJoint):
            continue
        rubs = joint.freewheel is not None or (joint.friction is not None and joint.friction.acts)
        if sensed.of not in driven and not rubs:
            message = f"no torque acts in '{sensed.of}': it has no drive and no friction"
            hint = f"force({sensed.of}) is the force in it; torques of springs follow from angles"
            yield Mistake(path, message, hint)


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

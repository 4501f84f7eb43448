"""Gears, racks and belts: joints whose angles or lengths tie each other, and whether they fit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, Strict, model_validator

from exudyn_flexlink.quantities import Number, PositiveLength
from exudyn_flexlink.scene.base import GROUND, Flag, Part, Refers, listed, refuse, split_point
from exudyn_flexlink.source import KeyPath, Mistake

if TYPE_CHECKING:
    from exudyn_flexlink.scene.lookup import Parts

SAME = 1e-9  # of a ratio: two ways from one gear to another that differ by more lock each other

Teeth = Annotated[int, Strict(), Field(ge=1)]
GEARED = Refers("joints", "a revolute or prismatic joint", ("revolute", "prismatic"))
GearedName = Annotated[str, Strict(), GEARED]
Two = Annotated[tuple[GearedName, GearedName], listed("joint", "joint")]


class GearJoint(Part):
    """Two gears in mesh, or a pinion and a rack: the joints that hold them tie each other.

    Angles and lengths count from the arm that carries both, a body or the ground: the one that both
    joints share, or that is hinged at the places of both. Gears turn against each other, with
    `internal` alike. A rack goes along its axis as the pinion turns counter-clockwise.
    """

    one_of = (("ratio", "teeth", "radius"),)
    type: Literal["gear"] = "gear"
    joints: Two = Field(description="the joints that hold both, [first, second], on one arm")
    ratio: Annotated[float, Number(above=0.0)] | None = Field(
        None, description="turns of the first for one of the second; or 'teeth'"
    )
    teeth: Annotated[tuple[Teeth, Teeth], listed("number", "number")] | None = Field(
        None, description="of the first and the second; or 'ratio'"
    )
    radius: PositiveLength | None = Field(
        None, description="of the pinion's pitch circle, where one joint is a rack's slide"
    )
    internal: Flag = Field(
        False, description="one gear is a ring around the other: they turn alike"
    )

    @property
    def bodies(self) -> tuple[str, ...]:
        """It holds no body: its joints do."""
        return ()

    @model_validator(mode="after")
    def _a_rack_lies_on_one_side(self) -> GearJoint:
        if self.radius is not None and self.internal:
            refuse("a rack has no inside", "turn its 'axis' round to reverse it", at="internal")
        return self

    @property
    def turns(self) -> float:
        """Turns of the first for one of the second; 1 of a rack."""
        return self.teeth[1] / self.teeth[0] if self.teeth else self.ratio or 1.0

    def weights(self, geared: tuple[Any, Any]) -> tuple[float, float]:
        """Return w of the joints, seen from the arm: ``w_1 c_1 + w_2 c_2`` stays as it starts."""
        if self.radius is not None:
            first, second = (-self.radius if j.type == "revolute" else 1.0 for j in geared)
            return first, second
        return 1.0, -self.turns if self.internal else self.turns


class BeltJoint(Part):
    """A belt or a chain around two wheels, which turn alike; it neither slips nor stretches."""

    type: Literal["belt"] = "belt"
    joints: Two = Field(description="the joints that hold both wheels, [first, second], on one arm")
    radii: Annotated[tuple[PositiveLength, PositiveLength], listed("length", "length")] = Field(
        description="of the first wheel and the second, to the middle of the belt"
    )

    @property
    def bodies(self) -> tuple[str, ...]:
        """It holds no body: its joints do."""
        return ()

    def weights(self, _geared: tuple[Any, Any]) -> tuple[float, float]:
        """Return w of the joints, seen from the arm: ``w_1 c_1 + w_2 c_2`` stays as it starts."""
        return self.radii[0], -self.radii[1]


Gear = GearJoint | BeltJoint
Joints = Mapping[str, Any]


@dataclass(frozen=True)
class Mesh:
    """How a joint holds a gear: the gear's body, and the hinges between it and the arm.

    `hinges` are names from the gear on; the gear's own joint is `joint`.
    """

    joint: str
    body: str
    hinges: tuple[str, ...]


def ends_of(joint: Any) -> tuple[str, str]:
    """Names of the two bodies of a joint of two points, the ground's among them."""
    first, second = (split_point(point)[0] for point in joint.points)
    return first, second


def meshes_of(joints: Joints, gear: Gear) -> tuple[str, tuple[Mesh, Mesh]]:
    """Return the arm of a gear of a scene that is checked, and how both joints hold theirs."""
    (arm,) = arms_of(joints, gear)
    first, second = (_mesh(joints, name, arm) for name in gear.joints)
    return arm, (first, second)


def arms_of(joints: Joints, gear: Gear) -> list[str]:
    """Bodies that could carry both gears: those that both joints share; else see `_concentric`."""
    own = [ends_of(joints[name]) for name in gear.joints]
    shared = [body for body in own[0] if body in own[1]]
    if shared:
        return shared
    near = [
        {body for hinge in _concentric(joints, name) for body in ends_of(joints[hinge])}
        for name in gear.joints
    ]
    return sorted(near[0] & near[1])


def _concentric(joints: Joints, name: str) -> list[str]:
    """Name of a joint, and of hinges without clearance at the same place as a hinge."""
    at = _places(joints[name])
    return [
        name,
        *(
            other
            for other, own in joints.items()
            if other != name and own is not None and at & _places(own) and own.clearance == 0
        ),
    ]


def _places(joint: Any) -> set[Any]:
    """Points of bodies, or places of the ground, at which a hinge sits."""
    if joint.type != "revolute":
        return set()
    return {joint.at if point == GROUND else point for point in joint.points}


def _mesh(joints: Joints, name: str, arm: str) -> Mesh:
    ends = ends_of(joints[name])
    if arm in ends:
        return Mesh(name, ends[1] if ends[0] == arm else ends[0], (name,))
    body = ends[0] if ends[1] == GROUND else ends[1]
    hinge = next(other for other in _concentric(joints, name) if arm in ends_of(joints[other]))
    return Mesh(name, body, (hinge,) if body in ends_of(joints[hinge]) else (name, hinge))


# --- what can't be meant ------------------------------------------------------------------------


def gear_mistakes(parts: Parts) -> Iterator[Mistake]:
    """Refuse gears whose joints can't mesh, and those that contradict others."""
    joints = dict(parts.valid("joints"))
    ties: dict[str, tuple[str, float]] = {}  # of each gear on its arm: its train, and its speed
    for name, gear in joints.items():
        if not isinstance(gear, Gear):
            continue
        kinds = [getattr(joints.get(joint), "type", "") for joint in gear.joints]
        if not all(kind in GEARED.kinds for kind in kinds):
            continue  # told as a name that leads nowhere, or to another kind
        path = ("joints", name)
        mistakes = [*_of_wrong_kinds(path, gear, kinds), *_unheld(path, gear, joints)]
        yield from mistakes
        if not mistakes:
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


def _unheld(path: KeyPath, gear: Gear, joints: Joints) -> Iterator[Mistake]:
    """Refuse joints that no one arm carries, with clearance, or that rub by their force."""
    (one, other), arms = gear.joints, arms_of(joints, gear)
    if one == other:
        yield Mistake((*path, "joints"), f"'{one}' can't mesh with itself")
    elif len(arms) != 1:
        message = f"no one body carries '{one}' and '{other}'"
        hint = "both hang on one arm, or the ground; a sun turns where its planets' arm is hinged"
        yield Mistake((*path, "joints"), message, hint)
    for joint in gear.joints:
        if getattr(joints[joint], "clearance", 0.0) > 0:
            yield Mistake((*path, "joints"), f"'{joint}' has clearance: its gear would come apart")
        for held in _concentric(joints, joint):
            friction = joints[held].friction
            if friction is not None and friction.coefficient > 0:
                message = "the force in this joint is not known: it lacks that of teeth and belts"
                hint = f"of '{path[-1]}'; give a torque, along a slide a force"
                yield Mistake(("joints", held, "friction", "coefficient"), message, hint)


def _contradicting(
    path: KeyPath, gear: Gear, joints: Joints, ties: dict[str, tuple[str, float]]
) -> Iterator[Mistake]:
    """Refuse a gear that others let turn at another ratio; else join the trains of both gears.

    What is tied are speeds of bodies on an arm; of one joint as its other side sees it, the same.
    """
    arm, meshes = meshes_of(joints, gear)
    sides = [_side(joints[mesh.joint], mesh.body, arm) for mesh in meshes]
    one, other = (f"{mesh.body} on {arm}" for mesh in meshes)
    weights = gear.weights((joints[gear.joints[0]], joints[gear.joints[1]]))
    by_weight = [weight * side for weight, side in zip(weights, sides, strict=True)]
    (train, speed), (second, behind) = (ties.setdefault(body, (body, 1.0)) for body in (one, other))
    wanted = -by_weight[0] / by_weight[1] * speed  # of the other, by that of the train's first
    if train == second:
        if abs(wanted - behind) > SAME * abs(wanted):
            message = f"contradicts other gears of {one} and {other}: none could turn"
            turned = f"{behind / speed:.6g} by the gears above, {wanted / speed:.6g} by this one"
            yield Mistake(path, message, f"turns of the second for one: {turned}", on_key=True)
        return
    for body, (start, own) in list(ties.items()):
        if start == second:
            ties[body] = train, own * wanted / behind


def _side(joint: Any, body: str, arm: str) -> float:
    """-1 where a slide counts its arm from its gear; angles count from the arm anyway."""
    return -1.0 if joint.type == "prismatic" and ends_of(joint) == (body, arm) else 1.0

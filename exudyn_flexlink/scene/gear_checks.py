"""Whether gears can mesh: joints that one arm carries, and no train that locks itself."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from exudyn_flexlink.scene.gears import (
    GEARED,
    BeltJoint,
    Gear,
    Joints,
    arms_of,
    concentric,
    ends_of,
    meshes_of,
)
from exudyn_flexlink.scene.lookup import Parts
from exudyn_flexlink.source import KeyPath, Mistake

SAME = 1e-9  # of a ratio: two ways from one gear to another that differ by more lock each other


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
        for held in concentric(joints, joint):
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

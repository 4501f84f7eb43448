"""Gears, racks and belts of a scene in numbers: pitch circles, and what teeth push."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from math import hypot

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism.bodies import Bodies
from exudyn_flexlink.mechanism.kinematics import anchor_position, left_of, line_of
from exudyn_flexlink.mechanism.model import Gear, Geared
from exudyn_flexlink.mechanism.parts import Anchor
from exudyn_flexlink.scene import (
    BeltJoint,
    GearJoint,
    Mesh,
    PointsJoint,
    PrismaticJoint,
    ends_of,
    meshes_of,
)

COAXIAL = 1e-9  # of how far two axes are from the arm's origin: nearer ones are one


def build_gears(bodies: Bodies) -> Iterator[Gear]:
    """Return the gears, racks and belts of a scene, in its order."""
    joints = bodies.scene.joints
    for name, spec in joints.items():
        if not isinstance(spec, GearJoint | BeltJoint):
            continue
        arm, meshes = meshes_of(joints, spec)
        one, other = (_geared(bodies, arm, mesh) for mesh in meshes)
        first, second = spec.weights((joints[spec.joints[0]], joints[spec.joints[1]]))
        first, second = first * one.side, second * other.side
        if isinstance(spec, BeltJoint):
            yield Gear(name, (one, other), (first, second), spec.radii, meshes=False)
            continue
        radii, beyond = _radii(spec, one, other), 1.0
        if spec.radius is None and radii[0]:
            first, second = radii[0] * first, radii[0] * second
            beyond = -1.0 if spec.internal and spec.turns > 1 else 1.0
        yield Gear(name, (one, other), (first, second), radii, beyond=beyond)


def _geared(bodies: Bodies, arm: str, mesh: Mesh) -> Geared:
    joints = bodies.scene.joints
    near, far = _end(bodies, mesh.hinges[-1], arm), _end(bodies, mesh.joint, mesh.body)
    if isinstance(joints[mesh.joint], PrismaticJoint):
        return Geared(near, far, bodies.slide(mesh.joint), ())
    hinges = tuple((name, _on_second(joints[name], arm, mesh)) for name in mesh.hinges)
    return Geared(near, far, None, hinges)


def _on_second(joint: object, arm: str, mesh: Mesh) -> bool:
    """Whether the second part of a hinge is on the gear's side of it."""
    assert isinstance(joint, PointsJoint)  # the scene's names are checked
    first, second = ends_of(joint)
    return first == arm if arm in (first, second) else second == mesh.body


def _end(bodies: Bodies, joint: str, body: str) -> Anchor:
    """Anchor by which a joint holds a body, or the ground."""
    spec = bodies.scene.joints[joint]
    assert isinstance(spec, PointsJoint)  # the scene's names are checked
    return bodies.ends(spec)[ends_of(spec).index(body)]


def _radii(spec: GearJoint, one: Geared, other: Geared) -> tuple[float | None, float | None]:
    """Radii (m) of pitch circles: of a pinion as given, of gears by how far apart their axes are.

    There are none where both turn about one axis, or on an arm that bends, and none of racks.
    """
    if one.slide is not None or other.slide is not None:
        return None if one.slide else spec.radius, None if other.slide else spec.radius
    near, beside = one.near, other.near
    apart = hypot(beside.x - near.x, beside.y - near.y)
    both = abs(1.0 - spec.turns) if spec.internal else 1.0 + spec.turns
    size = max(hypot(near.x, near.y), hypot(beside.x, beside.y))
    if near.part != beside.part or apart <= COAXIAL * size or both == 0:
        return None, None
    return apart / both, apart / both * spec.turns


@dataclass(frozen=True)
class ToothPush:
    """Force (n, 2) of teeth on a part, N, and the hinges that lead from that to the arm."""

    force: FloatArray
    part: int
    hinges: tuple[tuple[str, bool], ...]


def tooth_pushes(
    gears: Iterable[Gear], forces: Mapping[str, FloatArray], q: FloatArray
) -> list[ToothPush]:
    """What teeth push on their gears, by tangential forces (n,), N, at coordinates (n, parts, 3).

    Nothing is told of a belt, whose pull on a wheel depends on how tight it is, nor of gears
    without a pitch circle.
    """
    found = []
    for gear in gears:
        if not (gear.meshes and gear.in_newtons):
            continue
        force = forces[gear.name][:, None]
        first, second = (
            None if tie.slide is None else weight * tie.side * force * line_of(tie.slide, q)
            for tie, weight in zip(gear.ties, gear.weights, strict=True)
        )
        if first is None:
            first = gear.beyond * force * _across(gear, q) if second is None else -second
        pushes = first, -first if second is None else second
        found += [
            ToothPush(push, tie.far.part, tie.hinges)
            for push, tie in zip(pushes, gear.ties, strict=True)
        ]
    return found


def _across(gear: Gear, q: FloatArray) -> FloatArray:
    """Directions (n, 2) left of the line from the first gear's axis to the second's."""
    one, other = (anchor_position(tie.far, q) for tie in gear.ties)
    return left_of((other - one) / np.linalg.norm(other - one, axis=-1, keepdims=True))


def without_teeth(joint: str, force: FloatArray, teeth: Iterable[ToothPush]) -> FloatArray:
    """Force (n, 2) of a joint on its second point, N, where teeth push what it holds.

    `force` is what it would be were gears pairs of torques.
    """
    for push in teeth:
        for name, on_second in push.hinges:
            if name == joint:
                force = force - push.force if on_second else force + push.force
    return force

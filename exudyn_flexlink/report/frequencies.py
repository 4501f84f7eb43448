"""Natural frequencies of flexible links and of sprung bodies, each by itself."""

from __future__ import annotations

from math import pi, sqrt

from exudyn_flexlink.chain import euler_bernoulli_cantilever
from exudyn_flexlink.mechanism import (
    GROUND,
    Anchor,
    LinearSpring,
    Mechanism,
    RigidPart,
    RotarySpring,
    beam_of,
    chain_of,
)
from exudyn_flexlink.report.text import number, table
from exudyn_flexlink.scene import FlexibleBody, Scene

MODES = 4


def link_frequencies(scene: Scene, name: str, body: FlexibleBody) -> list[str]:
    """Natural frequencies of a flexible body with its first rod clamped, against a beam's."""
    chain = chain_of(scene, body)
    count = min(MODES, len(chain.hinges))
    if count == 0:
        return [f"Natural frequencies of {name}: none, one rod has no hinges"]
    rods = chain.cantilever_frequencies(count) / (2 * pi)
    beam = euler_bernoulli_cantilever(beam_of(scene, body), count) / (2 * pi)
    rows = [["mode", "rods", "beam", "deviation"]]
    for i in range(count):
        deviation = f"{100 * (rods[i] / beam[i] - 1):+.2f} %"
        rows.append([str(i + 1), f"{rods[i]:.2f} Hz", f"{beam[i]:.2f} Hz", deviation])
    return [
        f"Natural frequencies of {name}, first rod clamped, against an Euler-Bernoulli beam",
        *table(rows),
        *_rule(name, body),
    ]


def _rule(name: str, body: FlexibleBody) -> list[str]:
    rule = body.hinges.stiffness
    if rule == "paper":
        return [
            f"  hinge stiffness by the rule 'paper': E I / length of {name}",
            "  The link gets softer with every rod; 'beam' tends to the Euler-Bernoulli beam",
        ]
    if rule == "beam":
        better = [] if body.layout == "half_ends" else ["  'layout: half_ends' comes closer"]
        return ["  hinge stiffness by the rule 'beam': E I / length of a rod", *better]
    return [f"  hinge stiffness given as a number, {number(float(rule))} N m/rad"]


def sprung_frequencies(scene: Scene, mechanism: Mechanism) -> list[str]:
    """Undamped frequencies of bodies that only a sprung joint holds to the ground."""
    rows = []
    for joint, springs in _springs_of_joints(scene, mechanism).items():
        stiffness = sum(spring.stiffness for spring in springs)
        part = _held_by(joint, mechanism)
        if part is None or stiffness <= 0:
            continue
        turns = isinstance(springs[0], RotarySpring)
        mass = mechanism.parts[part].mass
        inertia = _inertia_about(joint, part, mechanism) if turns else mass
        frequency = sqrt(stiffness / inertia) / (2 * pi)
        ratio = sum(spring.damping for spring in springs) / (2 * sqrt(stiffness * inertia))
        way = f"{'about' if turns else 'along'} {joint}"
        told = [f"{frequency:.2f} Hz", f"damping ratio {number(ratio)}"]
        rows.append([mechanism.parts[part].body, way, *told])
    return ["Natural frequencies of sprung bodies, by themselves", *table(rows)] if rows else []


def _springs_of_joints(
    scene: Scene, mechanism: Mechanism
) -> dict[str, list[RotarySpring | LinearSpring]]:
    """Springs of the scene that act at a revolute joint, or along a prismatic one, by joint."""
    found: dict[str, list[RotarySpring | LinearSpring]] = {}
    for spring in mechanism.all_springs:
        spec = scene.springs.get(spring.name)  # hinges of flexible bodies have springs, too
        if spec is not None and spec.joint is not None:
            found.setdefault(spec.joint, []).append(spring)
    return found


def _held_by(joint: str, mechanism: Mechanism) -> int | None:
    """Part that this joint alone holds, on the ground, if there is one."""
    held = {anchor.part for name, anchor in _anchors(mechanism) if name == joint}
    if GROUND not in held or len(held) != 2:
        return None
    (part,) = held - {GROUND}
    return (
        part if [name for name, at in _anchors(mechanism) if at.part == part] == [joint] else None
    )


def _anchors(mechanism: Mechanism) -> list[tuple[str, Anchor]]:
    """Both anchors of every joint, with its name; of a slot that on the part."""
    joints = (*mechanism.hinges, *mechanism.welds, *mechanism.slides)
    return [
        *((joint.name, anchor) for joint in joints for anchor in (joint.first, joint.second)),
        *((slot.name, slot.anchor) for slot in mechanism.slots),
    ]


def _inertia_about(joint: str, index: int, mechanism: Mechanism) -> float:
    """Moment of inertia (kg m^2) of a part about the point that a joint holds."""
    part: RigidPart = mechanism.parts[index]
    anchor = next(a for name, a in _anchors(mechanism) if name == joint and a.part == index)
    x, y = anchor.x - part.centre[0], anchor.y - part.centre[1]
    return part.inertia + part.mass * (x * x + y * y)

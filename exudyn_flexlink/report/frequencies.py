"""Natural frequencies of flexible links and of sprung bodies, each by itself."""

from __future__ import annotations

from math import pi, sqrt

from exudyn_flexlink.chain import euler_bernoulli_cantilever
from exudyn_flexlink.mechanism import (
    GROUND,
    Anchor,
    LinearSpring,
    Mechanism,
    RotarySpring,
    beam_of,
    chain_of,
    inertia_with_welded,
    welded_to,
)
from exudyn_flexlink.report.text import listed, number, table
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
    """Undamped frequencies of bodies, with what is welded to them, that only a sprung joint holds.

    It holds them on the ground.
    """
    rows = []
    for joint, springs in _springs_of_joints(scene, mechanism).items():
        stiffness = sum(spring.stiffness for spring in springs)
        held = _held_by(joint, mechanism)
        if held is None or stiffness <= 0:
            continue
        turns = isinstance(springs[0], RotarySpring)
        parts, welds = mechanism.parts, mechanism.welds
        welded = sorted(welded_to(held.part, welds))
        mass = sum(parts[part].mass for part in welded)
        inertia = inertia_with_welded(held, parts, welds) if turns else mass
        frequency = sqrt(stiffness / inertia) / (2 * pi)
        ratio = sum(spring.damping for spring in springs) / (2 * sqrt(stiffness * inertia))
        way = f"{'about' if turns else 'along'} {joint}"
        told = [f"{frequency:.2f} Hz", f"damping ratio {number(ratio)}"]
        rows.append([listed([parts[part].body for part in welded]), way, *told])
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


def _held_by(joint: str, mechanism: Mechanism) -> Anchor | None:
    """Point of a part that this joint alone holds, and on the ground, if there is one."""
    ends = [anchor for name, anchor in _anchors(mechanism) if name == joint]
    held = [anchor for anchor in ends if anchor.part != GROUND]
    if len(ends) != 2 or len(held) != 1:
        return None
    welded, inner = welded_to(held[0].part, mechanism.welds), {w.name for w in mechanism.welds}
    joints = {name for name, at in _anchors(mechanism) if at.part in welded} - inner
    return held[0] if joints == {joint} and GROUND not in welded else None


def _anchors(mechanism: Mechanism) -> list[tuple[str, Anchor]]:
    """Both anchors of every joint, with its name; of a slot that on the part."""
    joints = (*mechanism.hinges, *mechanism.welds, *mechanism.slides)
    return [
        *((joint.name, anchor) for joint in joints for anchor in (joint.first, joint.second)),
        *((slot.name, slot.anchor) for slot in mechanism.slots),
    ]

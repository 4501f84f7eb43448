"""Natural frequencies of flexible links and of sprung bodies, each by itself."""

from __future__ import annotations

from collections.abc import Iterable
from math import pi, sqrt

from exudyn_flexlink.chain import euler_bernoulli_cantilever
from exudyn_flexlink.mechanism import (
    GROUND,
    Anchor,
    Mechanism,
    RigidPart,
    RotarySpring,
    beam_of,
    chain_of,
)
from exudyn_flexlink.report.text import number, table
from exudyn_flexlink.scene import FlexibleBody, Scene, TorsionalSpring

MODES = 4


def link_frequencies(scene: Scene, name: str) -> list[str]:
    """Natural frequencies of a flexible link with its first rod clamped, against a beam's."""
    chain = chain_of(scene, name)
    count = min(MODES, len(chain.hinges))
    if count == 0:
        return [f"Natural frequencies of {name}: none, one rod has no hinges"]
    rods = chain.cantilever_frequencies(count) / (2 * pi)
    beam = euler_bernoulli_cantilever(beam_of(scene, name), count) / (2 * pi)
    rows = [["mode", "rods", "beam", "deviation"]]
    for i in range(count):
        deviation = f"{100 * (rods[i] / beam[i] - 1):+.2f} %"
        rows.append([str(i + 1), f"{rods[i]:.2f} Hz", f"{beam[i]:.2f} Hz", deviation])
    return [
        f"Natural frequencies of {name}, first rod clamped, against an Euler-Bernoulli beam",
        *table(rows),
        *_rule(scene, name),
    ]


def _rule(scene: Scene, name: str) -> list[str]:
    body = scene.bodies[name]
    assert isinstance(body, FlexibleBody)  # its only caller has made a chain of it
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


def pivot_frequencies(scene: Scene, mechanism: Mechanism) -> list[str]:
    """Undamped frequencies of bodies that only a sprung joint holds to the ground."""
    rows = []
    for spring in mechanism.springs:
        part = _held_by(spring, scene, mechanism)
        if part is not None and spring.stiffness > 0:
            pivot = _pivot(spring, scene)
            inertia = _inertia_about(pivot, part, mechanism)
            frequency = sqrt(spring.stiffness / inertia) / (2 * pi)
            ratio = spring.damping / (2 * sqrt(spring.stiffness * inertia))
            name = mechanism.parts[part].body
            rows.append(
                [name, f"about {pivot}", f"{frequency:.2f} Hz", f"damping ratio {number(ratio)}"]
            )
    return ["Natural frequencies of sprung bodies, by themselves", *table(rows)] if rows else []


def _held_by(spring: RotarySpring, scene: Scene, mechanism: Mechanism) -> int | None:
    """Part that swings on the ground by this spring's joint alone, if there is one."""
    if spring.name not in scene.springs or GROUND not in (spring.first, spring.second):
        return None
    part = spring.second if spring.first == GROUND else spring.first
    held = [name for name, _ in _anchors_of(part, mechanism)]
    return part if held == [_pivot(spring, scene)] else None


def _pivot(spring: RotarySpring, scene: Scene) -> str:
    """Joint of a spring of the scene."""
    spec = scene.springs[spring.name]
    assert isinstance(spec, TorsionalSpring)  # which rotary springs are made of
    return spec.joint


def _anchors_of(part: int, mechanism: Mechanism) -> list[tuple[str, Anchor]]:
    """Joints of a part, with the anchor of each on it."""
    pairs: Iterable[tuple[str, Anchor]] = [
        *((j.name, a) for j in mechanism.hinges for a in (j.first, j.second)),
        *((j.name, a) for j in mechanism.welds for a in (j.first, j.second)),
        *((j.name, a) for j in mechanism.slides for a in (j.first, j.second)),
        *((j.name, j.anchor) for j in mechanism.slots),
    ]
    return [(name, anchor) for name, anchor in pairs if anchor.part == part]


def _inertia_about(joint: str, index: int, mechanism: Mechanism) -> float:
    part: RigidPart = mechanism.parts[index]
    anchor = next(a for name, a in _anchors_of(index, mechanism) if name == joint)
    x, y = anchor.x - part.centre[0], anchor.y - part.centre[1]
    return part.inertia + part.mass * (x * x + y * y)

"""What is told of a mechanism at rest: where it stands, what holds it, small motions about it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from math import degrees, hypot

import numpy as np

from exudyn_flexlink.mechanism import Rest
from exudyn_flexlink.report.text import in_blocks, listed, number, section
from exudyn_flexlink.scene import Scene

DECIMALS = 9  # of degrees, metres and newtons: what is smaller is rounding


def equilibrium_text(scene: Scene, rest: Rest) -> str:
    """Return all of it, for people."""
    places = [
        [
            name,
            f"{_told_balance(degrees(pose[2]))} deg",
            f"at ({_told_balance(pose[0])}, {_told_balance(pose[1])}) m",
        ]
        for name, pose in ((name, np.atleast_2d(poses)[0]) for name, poses in rest.poses.items())
    ]
    torques = {name: f"{torque:.5g} N m" for name, torque in rest.torques.items()}
    forces = [
        [
            name,
            f"({_told_balance(x)}, {_told_balance(y)}) N",
            f"{hypot(x, y):.5g} N",
            torques.get(name, ""),
        ]
        for name, (x, y) in ((name, force.tolist()) for name, force in rest.forces.items())
    ]
    slides = {own.name for own in rest.assembly.mechanism.speed_motors if own.slide}
    meshing = {own.name for own in rest.assembly.mechanism.gears if own.in_newtons}
    presses = [
        [name, f"{press:.5g} {scene.unit_of(name, 'N')}"] for name, press in rest.presses.items()
    ]
    blocks = [
        [f"At rest: {rest_told(rest)}"],
        section("Places", places),
        section("Forces in joints, on the body of the second point", forces),
        section("What drives hold", _held(rest.drives, slides)),
        section("What gears and belts hold", _held(rest.gears, meshing)),
        section("Contacts that press", presses),
        section("Small motions about it, undamped", [["", _modes(rest)]]),
        section("To know", [["", note] for note in rest.notes]),
    ]
    return in_blocks(blocks)


def rest_told(rest: Rest) -> str:
    """Whether a rest is stable, in a few words."""
    if not rest.stable:
        return f"unstable, small motions grow by exp({rest.growth:.4g} t/s)"
    free = int((rest.frequencies == 0).sum())
    if not len(rest.frequencies):
        return "nothing can move"
    if free == len(rest.frequencies):
        return "nothing resists a motion"
    return "stable" + (f", but nothing resists {free} of the motions" if free else "")


def _held(found: Mapping[str, float], forces: Collection[str]) -> list[list[str]]:
    """Rows of what holds: `forces` are in N, the others in N m."""
    return [[name, f"{x:.5g} {'N' if name in forces else 'N m'}"] for name, x in found.items()]


def _modes(rest: Rest) -> str:
    return listed([f"{number(own)} Hz" for own in rest.frequencies.tolist()]) or "none"


def _told_balance(value: float) -> str:
    return f"{round(value, DECIMALS) + 0.0:.6g}"  # no -0

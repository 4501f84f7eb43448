"""What a clearance asks of an engine's accuracy; links out of guides, and walls that give way."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from exudyn_flexlink.mechanism import Channel, build_mechanism, in_guides
from exudyn_flexlink.observables import deepest
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import RevoluteJoint, SleeveJoint

SOFT = 0.1  # of the clearance: walls that give way more decide by their stiffness
OUTSIDE = 1e-9  # of a guide's length: less is rounding
HARDLY_USED = 1 / 300  # of it: of lengths in metres for millimetres a thousandth is usual
RESOLVED = 0.1  # of the clearance: an error that still lets the link touch where it does
BROKEN_WALL_ADVICE = "raise the stiffness of the sleeve's law, or run slower"
COARSE_WALL_ADVICE = f"shorten the step; else {BROKEN_WALL_ADVICE}"


def coarse_for_clearance(result: Result) -> Iterator[str]:
    """Say that a tolerance is large beside a clearance: touches may be missed."""
    asked = result.scene.accuracy.tolerance
    clearances = {name: gap for name, gap in _clearances(result).items() if gap > 0}
    if asked is None or not clearances:
        return
    name = min(clearances, key=clearances.__getitem__)
    if asked > RESOLVED * clearances[name]:
        yield (
            f"the tolerance of {asked:.3g} m is more than {RESOLVED:.0%} of the clearance of "
            f"'{name}', {clearances[name]:.3g} m: touches of its walls may be missed; ask for "
            f"{RESOLVED * clearances[name]:.1g} m or less"
        )


def soft_walls(result: Result) -> Iterator[str]:
    """Warn of walls and bearings into which something sinks deep beside their clearance."""
    for name, clearance in _clearances(result).items():
        depth = deepest(result, name)
        if depth <= SOFT * clearance or clearance == 0:
            continue
        deep = f"by {depth:.3g} m, {depth / clearance:.2g} of the clearance"
        if name in result.bearings:
            yield (
                f"the bearing of '{name}' gives way {deep}: where the journal runs depends on its "
                "stiffness there; raise the stiffness of the joint's law"
            )
        else:
            yield (
                f"the walls of '{name}' give way {deep}: how far the link tilts depends on their "
                "stiffness there; raise the stiffness of the sleeve's law"
            )


def out_of_guides(result: Result) -> Iterator[str]:
    """Say which links leave their guides, and which are inside a small part of them only."""
    for name, low, high in in_guides(result.scene, build_mechanism(result.scene), result.poses):
        away = np.maximum(low - 1, -high)
        if (out := away > OUTSIDE).any():
            yield (
                f"the link of '{name}' leaves its guide at t = {result.time[np.argmax(out)]:.4g} s "
                f"and is up to {away.max():.2g} of its length away: nothing holds a link there"
            )
        elif len(away) and (used := high.max() - low.min()) < HARDLY_USED:
            yield (
                f"the link of '{name}' is inside only {used:.2g} of its guide's length: check units"
            )


def broken_wall(channel: Channel) -> str:
    """Why a run stopped."""
    return f"the link broke through a wall of '{channel.name}'"


def _clearances(result: Result) -> dict[str, float]:
    """Clearance (m) of every joint of the scene that may have one."""
    joints = result.scene.joints.items()
    kinds = (SleeveJoint, RevoluteJoint)
    return {name: joint.clearance for name, joint in joints if isinstance(joint, kinds)}

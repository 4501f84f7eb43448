"""What `check` says of the start: where the bodies stand, and other ways in which joints close."""

from __future__ import annotations

from math import degrees

import numpy as np

from exudyn_flexlink.loading import other_ways
from exudyn_flexlink.mechanism import Assembly, idle_at_start
from exudyn_flexlink.report.text import listed, table
from exudyn_flexlink.scene import Scene

NOTICEABLE = 1e-6  # rad: by more than this a body stands otherwise


def start_lines(scene: Scene, assembly: Assembly) -> list[str]:
    """Return the angle of every body at time 0, and a line for each other way to close the joints.

    A flexible body has the angle of its first rod. Contacts that do not act at first are told, too.
    """
    bodies = assembly.mechanism.bodies.items()
    here = {body: float(assembly.state.q[parts[0], 2]) for body, parts in bodies}
    ways = [
        {b: a for b, a in way.items() if abs(_wrapped(a - here[b])) > NOTICEABLE}
        for way in other_ways(scene, assembly)
    ]
    others = [
        ["The joints close in other ways, too; 'initial: guesses' picks one:"],
        *(["", _angles(way)] for way in ways),
    ]
    state = assembly.state
    idle = [["", told] for _, told in idle_at_start(assembly.mechanism, state.q, state.v)]
    return ["Start", *table([["", _angles(here)], *(others if ways else []), *idle])]


def _angles(angles: dict[str, float]) -> str:
    return listed([f"{body} {degrees(_wrapped(a)):.4g} deg" for body, a in angles.items()])


def _wrapped(angle: float) -> float:
    """Angle between -pi and pi, and no -0."""
    return float(np.angle(np.exp(1j * angle))) + 0.0

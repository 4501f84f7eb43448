"""What `check` says of other ways in which a mechanism's joints close."""

from __future__ import annotations

from math import degrees

import numpy as np

from exudyn_flexlink.loading import other_ways
from exudyn_flexlink.mechanism import Assembly
from exudyn_flexlink.scene import Scene

NOTICEABLE = 1e-6  # rad: by more than this a body stands otherwise


def branch_lines(scene: Scene, assembly: Assembly) -> list[str]:
    """Return a line for each other way to close the joints, none if there is one way only."""
    here = {body: float(assembly.state.q[parts[0], 2]) for body, parts in _bodies(assembly)}
    ways = [
        {b: a for b, a in way.items() if abs(_wrapped(a - here[b])) > NOTICEABLE}
        for way in other_ways(scene, assembly)
    ]
    if not ways:
        return []
    now = {body: here[body] for body in here if any(body in way for way in ways)}
    return [
        f"Start: {_listed(now)}",
        "  The joints close in other ways, too; 'initial: guesses' picks one:",
        *(f"  {_listed(way)}" for way in ways),
    ]


def _listed(angles: dict[str, float]) -> str:
    return ", ".join(f"{body} {degrees(_wrapped(a)):.4g} deg" for body, a in angles.items())


def _bodies(assembly: Assembly) -> list[tuple[str, tuple[int, ...]]]:
    return list(assembly.mechanism.bodies.items())


def _wrapped(angle: float) -> float:
    """Angle between -pi and pi."""
    return float(np.angle(np.exp(1j * angle)))

"""What drawn scenes are made of, and how far off their runs are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from drawing.parts import Model, number, spread

from exudyn_flexlink.api.results import Result
from exudyn_flexlink.arrays import FloatArray

Rng = np.random.Generator


@dataclass(frozen=True)
class Case:
    """A model with a CSV file beside it; how far off (m) a run of it is; whether it is flawed."""

    model: Model
    off: Callable[[Result], float]
    rows: str = ""
    flawed: bool = False


def asked(rng: Rng, point: str, end: float, least: float = 1e-8) -> Model:
    """What is watched, for how long (s), and how accurately: from `least` to 1e-5 m."""
    accuracy = {"tolerance": spread(rng, least, 1e-5)}
    return {"outputs": {"watch": point}, "run": {"duration": number(end)}, "accuracy": accuracy}


def apart(result: Result, x: FloatArray, y: FloatArray) -> float:
    """By how much (m) the watched point is off its right places (n,), at most."""
    found = result.path(str(result.scene.outputs.watch)).position
    return float(np.hypot(found[:, 0] - x, found[:, 1] - y).max())


def rigid(mass: float, inertia: float, **points: float) -> Model:
    """A body with a hub, and points on its own x-axis (m)."""
    places = {name: [x, 0] for name, x in {"hub": 0, **points}.items()}
    return {"type": "rigid", "mass": mass, "inertia": inertia, "points": places}


def joint(one: str, other: str, *axis: float) -> Model:
    """A slide along an axis, or a hinge if there is none, between points; on the ground at O."""
    kind = {"type": "prismatic", "axis": [*axis]} if axis else {"type": "revolute"}
    return {**kind, "points": [one, other], **({"at": [0, 0]} if one == "ground" else {})}

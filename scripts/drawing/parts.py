"""What random mechanisms are drawn of: bodies, drives, laws of contacts, springs, walls, curves.

Lengths are of centimetres to decimetres, masses of 50 g to 3 kg, speeds of 1 to 30 rad/s.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

Model = dict[str, Any]
"""A model file, as YAML reads it."""


@dataclass
class Drawn:
    """A model, and the points to which springs and walls may be added.

    `crank` is the joint that a drive may turn, empty if none; it is the first of a `loop`, whose
    speed may be given. What is `complete` gets no more springs and walls.
    """

    model: Model
    points: list[str]
    crank: str = ""
    complete: bool = False
    loop: bool = False


def number(value: float) -> float:
    """Six digits: a model file that can be read."""
    return float(f"{value:.6g}")


def spread(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a number evenly by its logarithm."""
    return number(np.exp(rng.uniform(np.log(low), np.log(high))))


def within(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a number evenly."""
    return number(rng.uniform(low, high))


def angle(rng: np.random.Generator) -> float:
    """Draw any angle, rad."""
    return within(rng, -3, 3)


def body(rng: np.random.Generator, points: Mapping[str, tuple[float, float]]) -> Model:
    """Draw a rigid body with points (m) in its axes."""
    places = np.array(list(points.values()))
    mass, span = spread(rng, 0.05, 3), max(float(np.ptp(places, axis=0).max()), 0.05)
    middle = places.mean(axis=0) + rng.normal(0, 0.02, 2)
    return {
        "type": "rigid",
        "mass": mass,
        "inertia": number(mass * span**2 * rng.uniform(0.05, 0.3)),
        "centre_of_mass": [number(x) for x in middle],
        "points": {name: [number(x) for x in place] for name, place in points.items()},
    }


def law(rng: np.random.Generator, rigid: bool = True) -> Model:
    """Draw a law of contact; by impulse in a third of all, where `rigid` ones may be."""
    returned = number(rng.choice([0, 1, rng.uniform(0, 1)], p=[0.15, 0.15, 0.7]))
    if rigid and rng.random() < 1 / 3:
        return {"type": "impulse", "restitution": returned}
    found = {"stiffness": spread(rng, 1e4, 1e7), "restitution": returned}
    if rng.random() < 0.3:
        found["friction"] = within(rng, 0.05, 0.5)
    return found


def add_drive(rng: np.random.Generator, drawn: Drawn) -> None:
    """Let a motor turn the crank, or throw it: by speed, motion, torque, or not at all."""
    initial, joint = drawn.model["initial"], drawn.crank
    part = drawn.model["joints"][joint]["points"][1].split(".")[0]
    kind = str(rng.choice(["speed", "motion", "torque", "none"], p=[0.35, 0.2, 0.3, 0.15]))
    speed = spread(rng, 1, 30)
    values = {
        "speed": f"{speed * rng.choice([-1, 1])} rad/s",
        "motion": f"{within(rng, 0.1, 0.8)} * sin({speed} rad/s * t)",
        "torque": f"{spread(rng, 0.01, 2)} N m * sin({speed} rad/s * t) "
        f"- {spread(rng, 1e-3, 0.1)} N m s * speed({joint})",
    }
    if kind in values:
        drawn.model["drives"] = {"motor": {"type": kind, "joint": joint, "value": values[kind]}}
    if kind in {"speed", "motion"}:
        initial.get("speeds", {}).pop(part, None)
    elif drawn.loop:
        initial.setdefault("speeds", {})[part] = number(rng.normal(0, 8))
    if kind == "motion":
        initial["angles"].pop(part, None)


def add_springs(rng: np.random.Generator, drawn: Drawn) -> None:
    """Put up to two springs between points of different bodies."""
    for k in range(int(rng.integers(0, 3))):
        one, other = (str(point) for point in rng.choice(drawn.points, 2, replace=False))
        if one.split(".")[0] != other.split(".")[0]:
            drawn.model.setdefault("springs", {})[f"between_{k}"] = {
                "type": "linear",
                "points": [one, other],
                "stiffness": spread(rng, 10, 1e4),
                "damping": number(rng.choice([0, rng.uniform(0.1, 10)])),
                "length": within(rng, 0.02, 0.4),
            }


def add_walls(rng: np.random.Generator, drawn: Drawn) -> None:
    """Put one or two walls in the way of points: lines beside the origin, circles around it."""
    for k in range(int(rng.integers(1, 3))):
        away, far = rng.uniform(-np.pi, np.pi), rng.uniform(0.2, 0.5)
        middle = far * np.array([np.cos(away), np.sin(away)])
        half = rng.uniform(0.1, 0.6) * np.array([-np.sin(away), np.cos(away)])
        ends = [[number(x) for x in end] for end in (middle - half, middle + half)]
        curves: list[Model] = [
            {"type": "line", "from": ends[0], "to": ends[1]},
            {"type": "circle", "centre": [0.0, 0.0], "radius": within(rng, 0.25, 0.7)},
        ]
        drawn.model.setdefault("curves", {})[f"wall_{k}"] = curves[int(rng.integers(2))]
        contact = {
            "type": "point_on_curve",
            "point": str(rng.choice(drawn.points)),
            "curve": f"wall_{k}",
            "side": "left",
            "law": law(rng),
        }
        if rng.random() < 0.3:
            contact["radius"] = within(rng, 0.005, 0.02)
        drawn.model.setdefault("contacts", {})[f"hit_{k}"] = contact


def closed_spline(rng: np.random.Generator) -> Model:
    """Draw a spline around the origin, some 0.15 m away, through 6 to 13 points."""
    count = int(rng.integers(6, 14))
    around = np.linspace(0, 2 * np.pi, count, endpoint=False)
    far = 0.15 * (1 + 0.25 * rng.random() * rng.uniform(-1, 1, count))
    points = np.column_stack([far * np.cos(around), far * np.sin(around)]).tolist()
    return {"type": "spline", "points": [[number(x), number(y)] for x, y in points], "closed": True}


def closed_curve(rng: np.random.Generator) -> tuple[Model, list[float]]:
    """Draw a closed curve around the origin, some 0.15 m away, and a place on it.

    A spline, an ellipse, or two half ellipses that meet on the y-axis with one tangent and two
    curvatures.
    """
    kind = str(rng.choice(["spline", "ellipse", "halves"], p=[0.4, 0.2, 0.4]))
    if kind == "spline":
        curve = closed_spline(rng)
        return curve, curve["points"][0]
    right, left, height = (within(rng, 0.08, 0.2) for _ in range(3))
    if kind == "ellipse":
        curve = {"type": "ellipse", "centre": [0, 0], "semi_axes": [right, height]}
        return curve, [right, 0.0]
    pieces = [
        {
            "type": "ellipse",
            "centre": [0, 0],
            "semi_axes": [width, height],
            "from": f"{begin} deg",
            "to": f"{begin + 180} deg",
        }
        for width, begin in ((right, -90), (left, 90))
    ]
    return {"type": "joined", "pieces": pieces}, [right, 0.0]

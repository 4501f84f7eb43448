"""Points of bodies, and where they go."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.mechanism import (
    GROUND,
    Anchor,
    Mechanism,
    anchor_position,
    anchor_velocity,
    build_mechanism,
)
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import FlexibleBody, RigidBody, RodBody, Scene, split_point

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class PointPath:
    """Motion of a point: time (N,), position (N, 2) in m, velocity (N, 2) in m/s, ground axes."""

    point: str
    time: FloatArray
    position: FloatArray
    velocity: FloatArray


def watched_point(scene: Scene) -> str:
    """Name of the point a reader wants to see: 'body.point'.

    The one that strikes in the first contact; else the end of the first flexible body; else the
    end, or the first named point, of the last body.
    """
    for contact in scene.contacts.values():
        return contact.point
    for name, body in scene.bodies.items():
        if isinstance(body, FlexibleBody):
            return f"{name}.end"
    name, last = list(scene.bodies.items())[-1]
    return f"{name}.end" if "end" in last.point_names else f"{name}.{last.point_names[0]}"


def path(result: Result, point: str) -> PointPath:
    """Motion of the point 'body.point'.

    Raises:
        ValueError: the scene has no such point.

    """
    anchor = point_anchor(result.scene, build_mechanism(result.scene), point)
    position = np.asarray(anchor_position(anchor, result.poses))
    velocity = np.asarray(anchor_velocity(anchor, result.poses, result.rates))
    return PointPath(point, result.time, position, velocity)


def point_anchor(scene: Scene, mechanism: Mechanism, point: str) -> Anchor:
    """Find the point 'body.point' on its part.

    Raises:
        ValueError: the scene has no such point.

    """
    name, inner = split_point(point)
    body = scene.bodies.get(name)
    if body is None or inner not in body.point_names:
        raise ValueError(f"the scene has no point '{point}'")
    own = mechanism.parts_of(name)
    if isinstance(body, RigidBody):
        return Anchor(own[0], *(body.points.get(inner) or body.centre_of_mass))
    if inner == "start":
        return Anchor(own[0], 0.0, 0.0)
    length = body.length if isinstance(body, RodBody) else mechanism.parts[own[-1]].reach
    return Anchor(own[-1], length / 2 if inner == "centre" else length, 0.0)


def part_of_point(scene: Scene, mechanism: Mechanism, point: str) -> int:
    """Part that the point 'body.point', or 'ground', belongs to."""
    if split_point(point)[0] == "ground":
        return GROUND
    return point_anchor(scene, mechanism, point).part

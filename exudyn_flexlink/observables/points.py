"""Points and bodies, and where they go: at samples, and between them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from exudyn_flexlink.arguments import instants, takes
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import (
    GROUND,
    Anchor,
    Mechanism,
    anchor_position,
    anchor_velocity,
    build_mechanism,
)
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import GROUND as GROUND_NAME
from exudyn_flexlink.scene import (
    FlexibleBody,
    PointsJoint,
    RevoluteJoint,
    Scene,
    SlotJoint,
    WeldJoint,
    split_point,
)
from exudyn_flexlink.source import did_you_mean

NOTHING = 1e-12  # s: an end typed or rounded by so little is in the run
HARMLESS = 1e-3  # of the largest rate: a smaller jump makes no cubic overshoot visibly


@dataclass(frozen=True)
class PointPath:
    """Motion of a point: time (N,), position (N, 2) in m, velocity (N, 2) in m/s, ground axes."""

    point: str
    time: FloatArray
    position: FloatArray
    velocity: FloatArray

    def __repr__(self) -> str:
        return _told(self, self.point)

    @takes(time=instants)
    def at(self, time: ArrayLike) -> FloatArray:
        """Positions (M, 2) m at instants (M,) s, or (2,) at one: see `between_samples`.

        Raises:
            ValueError: one of them is not in the run.

        """
        own = np.asarray(time, dtype=float)
        require_inside(self.time, own)
        return between_samples(self.time, self.position, self.velocity, own)


@dataclass(frozen=True)
class BodyMotion:
    """Motion of a body at samples `time` (N,) s, in the ground's axes.

    `position` (N, 2) m is that of a rod's or flexible body's start, or of a rigid body's own
    origin; `velocity` (N, 2) m/s. `angle` (N,) rad counts from +x, counter-clockwise, and goes on
    beyond a turn; `rate` (N,) rad/s is the angular speed. Of a flexible body they are those of its
    first rod.
    """

    body: str
    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    angle: FloatArray
    rate: FloatArray

    def __repr__(self) -> str:
        return _told(self, self.body)


def _told(motion: PointPath | BodyMotion, name: str) -> str:
    until = f"{motion.time[-1]:.5g} s, " if len(motion.time) else ""
    return f"<{type(motion).__name__} of {name}: to {until}{len(motion.time)} samples>"


def body_motion(result: Result, body: str) -> BodyMotion:
    """Motion of a body of the scene."""
    part = build_mechanism(result.scene).bodies[body][0]
    pose, rate = result.poses[:, part], result.rates[:, part]
    return BodyMotion(body, result.time, pose[:, :2], rate[:, :2], pose[:, 2], rate[:, 2])


def watched_point(scene: Scene) -> str:
    """Name of the point a reader wants to see: 'body.point'.

    The one that the scene names; else the one that strikes in the first contact; else of the first
    flexible body the end, or where that is held on the ground its start or a station; else a point
    of the last body: its end, or the first that no joint holds, or the first that is not held on
    the ground.
    """
    if scene.outputs.watch is not None:
        return scene.outputs.watch
    for contact in scene.contacts.values():
        return contact.striking
    for name, body in scene.bodies.items():
        if isinstance(body, FlexibleBody):
            named = [f"{name}.{point}" for point in ("end", "start", *body.points)]
            return next((p for p in named if p not in _grounded(scene)), named[0])
    return _free_point(scene)


def _grounded(scene: Scene) -> set[str]:
    """Points that a joint holds at a place of the ground."""
    return {
        point
        for joint in scene.joints.values()
        if isinstance(joint, (RevoluteJoint, WeldJoint)) and GROUND_NAME in joint.points
        for point in joint.points
    }


def _free_point(scene: Scene) -> str:
    """Point of the last body that moves most freely."""
    name, last = list(scene.bodies.items())[-1]
    named = [f"{name}.{point}" for point in last.point_names]
    held, grounded = set(), _grounded(scene)
    for joint in scene.joints.values():
        if isinstance(joint, SlotJoint):
            held.add(joint.point)
        elif isinstance(joint, PointsJoint):
            held |= set(joint.points)
    own = [point for point in named if point != f"{name}.centre"] or named
    free = [point for point in own if point not in held]
    moving = [point for point in named if point not in grounded]
    ends = [point for point in moving if point == f"{name}.end"]
    return [*ends, *free, *moving, *named][0]


def judged_points(scene: Scene) -> tuple[str, ...]:
    """Names of the points by which errors are judged: the one that the scene names, or all.

    The watched one comes first.
    """
    if scene.outputs.watch is not None:
        return (scene.outputs.watch,)
    return tuple(dict.fromkeys([watched_point(scene), *point_names(scene)]))


def name_of(points: Sequence[str]) -> str:
    """Points by which errors are judged in words: 'link.end', or 'all 9 named points'."""
    if len(points) == 1:
        return points[0]
    return "both named points" if len(points) == 2 else f"all {len(points)} named points"


def still_text(points: Sequence[str]) -> str:
    """Say that these points, of which errors are told, do not move."""
    return f"{name_of(points)} stand{'s' * (len(points) == 1)} still"


def path(result: Result, point: str) -> PointPath:
    """Motion of the point 'body.point'."""
    return paths(result, [point])[0]


def paths(result: Result, points: Iterable[str]) -> list[PointPath]:
    """Motions of points 'body.point'."""
    mechanism, found = build_mechanism(result.scene), []
    for point in points:
        anchor = point_anchor(result.scene, mechanism, point)
        position = np.asarray(anchor_position(anchor, result.poses))
        velocity = np.asarray(anchor_velocity(anchor, result.poses, result.rates))
        found.append(PointPath(point, result.time, position, velocity))
    return found


def room(result: Result, points: Iterable[str]) -> float:
    """Diagonal (m) of the largest box that one of the points moves in; 0 if none moves."""
    boxes = [np.ptp(path.position, axis=0) for path in paths(result, points)]
    return max((float(np.linalg.norm(box)) for box in boxes), default=0.0)


def point_names(scene: Scene) -> list[str]:
    """Return the names of all points of a scene, as 'body.point'."""
    return [f"{own}.{each}" for own, spec in scene.bodies.items() for each in spec.point_names]


def point_anchor(scene: Scene, mechanism: Mechanism, point: str) -> Anchor:
    """Find the point 'body.point' on its part."""
    split_point(point)  # refuses what is no name of a point at all
    if point not in mechanism.points:
        known = point_names(scene)
        hint = did_you_mean(point, known) or f"; there are: {', '.join(known)}"
        raise ValueError(f"the scene has no point '{point}'{hint}")
    return mechanism.points[point]


def part_of_point(scene: Scene, mechanism: Mechanism, point: str) -> int:
    """Part that the point 'body.point', or 'ground', belongs to."""
    if split_point(point)[0] == GROUND_NAME:
        return GROUND
    return point_anchor(scene, mechanism, point).part


def straight_between(time: FloatArray, values: FloatArray, at: FloatArray) -> FloatArray:
    """Values at instants `at` (M,) s on straight lines between samples (N,) or (N, k) at `time`."""
    if values.ndim == 1:
        return np.interp(at, time, values)
    return np.stack([np.interp(at, time, column) for column in values.T], axis=-1)


def require_inside(time: FloatArray, at: FloatArray) -> None:
    """Refuse instants `at` (s) outside the samples `time` (N,) s of a run.

    Raises:
        ValueError: one of them is outside, or no number.

    """
    begin, end = float(time[0]), float(time[-1])
    if not np.all((at >= begin - NOTHING) & (at <= end + NOTHING)):
        raise ValueError(f"time: the run goes from {begin:.9g} to {end:.9g} s, no further")


def between_samples(
    time: FloatArray, values: FloatArray, rates: FloatArray, at: FloatArray
) -> FloatArray:
    """Values at instants `at` (M,) s: the cubic through values and rates of the samples around.

    `time` (N,) s, `values` (N, ...) and their time derivatives `rates` (N, ...). Exact at samples.
    Straight where the rates jump between two samples (an impulse): a cubic would overshoot.
    Instants outside the samples continue the outermost cubic.
    """
    if len(time) < 2:
        return np.asarray(np.broadcast_to(values[0], (*np.shape(at), *values.shape[1:])).copy())
    i = np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(time) - 2)
    shape = (*np.shape(at), *(1,) * (values.ndim - 1))
    span = (time[i + 1] - time[i]).reshape(shape)
    span = np.where(span > 0, span, 1.0)  # two samples of one instant: any span gives their value
    slope = (values[i + 1] - values[i]) / span
    v0, v1 = rates[i], rates[i + 1]
    off = np.abs(slope - 0.5 * (v0 + v1))
    smooth = (off < 0.4 * np.abs(v1 - v0)) | (off < HARMLESS * np.max(np.abs(rates)))
    v0, v1 = np.where(smooth, v0, slope), np.where(smooth, v1, slope)
    x = (np.asarray(at) - time[i]).reshape(shape) / span
    b, c = 3 * slope - 2 * v0 - v1, v0 + v1 - 2 * slope
    return np.asarray(values[i] + span * x * (v0 + x * (b + x * c)))

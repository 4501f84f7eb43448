"""Motion of points and bodies, at and between samples; the crank's angle, and laps of a run."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import ceil, pi
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from exudyn_flexlink.arguments import instants, takes
from exudyn_flexlink.arrays import FloatArray, IndexArray, Variable
from exudyn_flexlink.mechanism import (
    GROUND,
    Anchor,
    Mechanism,
    anchor_position,
    anchor_velocity,
    build_mechanism,
    turning,
)
from exudyn_flexlink.observables.instants import (
    OverTime,
    at_instants,
    derivative,
    straight_between,
)
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import GROUND as GROUND_NAME
from exudyn_flexlink.scene import (
    FlexibleBody,
    ForceDrive,
    PointsJoint,
    RevoluteJoint,
    Scene,
    SlotJoint,
    SpeedDrive,
    WeldJoint,
    split_point,
)
from exudyn_flexlink.source import did_you_mean

PLACE = Variable("time", None, "place", components={"x": "m", "y": "m"}, rate="velocity")
VELOCITY = Variable("time", None, "velocity", components={"vx": "m/s", "vy": "m/s"})
TURNED = Variable("time", "rad", "angle", rate="rate")
RATE = Variable("time", "rad/s", "angular speed")


@dataclass(frozen=True)
class PointPath:
    """Motion of a point: time (N,), position (N, 2) in m, velocity (N, 2) in m/s, ground axes.

    `samples` is the path at the samples of its run, if this one is at other instants.
    """

    point: str
    time: FloatArray
    position: Annotated[FloatArray, PLACE]
    velocity: Annotated[FloatArray, VELOCITY]
    samples: PointPath | None = field(default=None, repr=False)

    def __repr__(self) -> str:
        return f"<PointPath of {self.point}: {samples_text(self.time)}>"

    @takes(time=instants)
    def at(self, time: ArrayLike) -> FloatArray:
        """Positions (M, 2) m at instants (M,) s, or (2,) at one: see `between_samples`.

        Raises:
            ValueError: one of them is not in the run.

        """
        return at_instants(self, time).position

    def seen_at(self, time: FloatArray) -> PointPath:
        """Return the path at instants (M,) s; ValueError: one of them is not in the run."""
        return replace(at_instants(self, time), samples=self)

    @cached_property
    def acceleration(self) -> FloatArray:
        """Acceleration (N, 2) m/s^2: the slope of splines through the velocities at samples.

        One spline goes from each jump to the next, so that what an impulse does is not in it.
        """
        if self.samples is not None:
            return straight_between(self.samples.time, self.samples.acceleration, self.time)
        return derivative(self.time, self.velocity)


@dataclass(frozen=True)
class BodyMotion(OverTime):
    """Motion of a body at samples `time` (N,) s, in the ground's axes.

    `position` (N, 2) m is that of a rod's or flexible body's start, or of a rigid body's own
    origin; `velocity` (N, 2) m/s. `angle` (N,) rad counts from +x, counter-clockwise, and goes on
    beyond a turn; `rate` (N,) rad/s is the angular speed. Of a flexible body they are those of its
    first rod.
    """

    body: str
    time: FloatArray
    position: Annotated[FloatArray, PLACE]
    velocity: Annotated[FloatArray, VELOCITY]
    angle: Annotated[FloatArray, TURNED]
    rate: Annotated[FloatArray, RATE]

    def __repr__(self) -> str:
        return f"<BodyMotion of {self.body}: {samples_text(self.time)}>"


def samples_text(time: FloatArray) -> str:
    """End and number of samples in words; `time` may be one instant."""
    if not np.ndim(time):
        return f"at {time:.5g} s"
    until = f"to {time[-1]:.5g} s, " if len(time) else ""
    return f"{until}{len(time)} samples"


def body_motion(result: Result, body: str) -> BodyMotion:
    """Motion of a body of the scene, or of a part, such as a rod of a flexible link, by name."""
    bodies, parts = build_mechanism(result.scene).bodies, result.part_names
    part = bodies[body][0] if body in bodies else parts.index(body)
    pose, rate = result.poses[:, part], result.rates[:, part]
    return BodyMotion(body, result.time, pose[:, :2], rate[:, :2], pose[:, 2], rate[:, 2])


def watched_point(scene: Scene) -> str:
    """Name of the point of most interest: 'body.point'.

    It is the point that the scene names; else the striking point of the first contact; else the end
    of the first flexible body, or its start or a station if the end is held on the ground; else a
    point of the last body: its end, or the first point without a joint, or the first point that is
    not held on the ground.
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
    """Points that a joint holds on the ground."""
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
    others = [point for point in named if point != f"{name}.centre"] or named
    free = [point for point in others if point not in held]
    moving = [point for point in named if point not in grounded]
    ends = [point for point in moving if point == f"{name}.end"]
    return [*ends, *free, *moving, *named][0]


def judged_points(scene: Scene) -> tuple[str, ...]:
    """Names of the points whose errors count: the one that the scene names, or all.

    The watched one comes first.
    """
    if scene.outputs.watch is not None:
        return (scene.outputs.watch,)
    return tuple(dict.fromkeys([watched_point(scene), *point_names(scene)]))


def name_of(points: Sequence[str]) -> str:
    """Text for the points whose errors count: 'link.end', or 'all 9 named points'."""
    if len(points) == 1:
        return points[0]
    return "both named points" if len(points) == 2 else f"all {len(points)} named points"


def still_text(points: Sequence[str]) -> str:
    """Message that says: the points whose errors count do not move."""
    return f"{name_of(points)} stand{'s' * (len(points) == 1)} still"


def path(result: Result, point: str) -> PointPath:
    """Motion of the point 'body.point'."""
    return paths(result, [point])[0]


def paths(result: Result, points: Iterable[str]) -> list[PointPath]:
    """Motions of points 'body.point'."""
    mechanism, motions = build_mechanism(result.scene), []
    for point in points:
        anchor = point_anchor(result.scene, mechanism, point)
        position = np.asarray(anchor_position(anchor, result.poses))
        velocity = np.asarray(anchor_velocity(anchor, result.poses, result.rates))
        motions.append(PointPath(point, result.time, position, velocity))
    return motions


def room(result: Result, points: Iterable[str]) -> float:
    """Diagonal (m) of the largest box that one of the points moves in; 0 if none moves."""
    boxes = [np.ptp(path.position, axis=0) for path in paths(result, points)]
    return max((float(np.linalg.norm(box)) for box in boxes), default=0.0)


def point_names(scene: Scene) -> list[str]:
    """Return the names of all points of a scene, as 'body.point'."""
    return [f"{body}.{point}" for body, spec in scene.bodies.items() for point in spec.point_names]


def point_anchor(scene: Scene, mechanism: Mechanism, point: str) -> Anchor:
    """Find the point 'body.point' on its part."""
    split_point(point)  # refuses a text that is no name of a point
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


def crank_joint(scene: Scene) -> str | None:
    """Name of the crank joint.

    It is ``run.of``, else the first driven revolute joint, else the first one; None without any.
    """
    if scene.run.of is not None:
        return scene.run.of
    for drive in scene.drives.values():
        if not isinstance(drive, ForceDrive) and isinstance(
            scene.joints[drive.joint], RevoluteJoint
        ):
            return drive.joint
    for name, joint in scene.joints.items():
        if isinstance(joint, RevoluteJoint):
            return name
    return None


def crank_column(scene: Scene) -> str | None:
    """Name of the crank joint's angle in files; None without a joint.

    It is 'crank_angle' if the joint is driven or its turns end the run; otherwise it contains the
    joint's name.
    """
    name = crank_joint(scene)
    driven = any(getattr(drive, "joint", None) == name for drive in scene.drives.values())
    if name is None or driven or name == scene.run.of:
        return name and "crank_angle"
    return f"angle_of_{name.replace(' ', '_')}"


def crank_angle(result: Result) -> FloatArray:
    """Angle of the crank joint (N,), rad: second body relative to the first, continuous."""
    name = crank_joint(result.scene)
    if name is None:
        raise ValueError("the scene has no revolute joint, hence no crank angle")
    return joint_angle(result, name)


def turned_since_start(result: Result) -> FloatArray:
    """Angle (N,), rad, that the crank has turned since the first sample, without sign."""
    angle = crank_angle(result)
    return np.asarray(np.abs(angle - angle[0]))


def joint_angle(result: Result, name: str) -> FloatArray:
    """Angle of the revolute joint `name` (N,), rad: second body relative to the first."""
    return joint_turning(result, name)[0]


def joint_turning(result: Result, name: str) -> tuple[FloatArray, FloatArray]:
    """Angle of the revolute joint `name` (N,), rad, and its rate (N,), rad/s: see `joint_angle`.

    Raises:
        ValueError: there is no such joint.

    """
    joint = result.scene.joints.get(name)
    if not isinstance(joint, RevoluteJoint):
        raise ValueError(f"'{name}' is no revolute joint of the scene")
    mechanism = build_mechanism(result.scene)
    first, second = (part_of_point(result.scene, mechanism, text) for text in joint.points)
    return turning(first, second, result.poses), turning(first, second, result.rates)


def turns(result: Result) -> bool:
    """Whether the crank rotates: its turns end the run, its speed is set, or it made a turn."""
    name = crank_joint(result.scene)
    if name is None:
        return False
    if name == result.scene.run.of or name in steady_speeds(result.scene):
        return True
    return float(np.ptp(crank_angle(result))) >= 2 * pi


def steady_speeds(scene: Scene) -> dict[str, float]:
    """Speeds (rad/s) of the revolute joints that a drive turns at constant speed, by name."""
    return {
        drive.joint: drive.value
        for drive in scene.drives.values()
        if isinstance(drive, SpeedDrive)
        and isinstance(scene.joints[drive.joint], RevoluteJoint)
        and isinstance(drive.value, float)
        and drive.value
    }


def laps(result: Result) -> IndexArray:
    """Lap of each sample (N,), from 1: the turn of the crank counted from its start angle.

    A sample at the very end of the last whole lap belongs to that lap.
    """
    return lap_of(crank_angle(result))


def lap_of(angle: FloatArray) -> IndexArray:
    """Lap, from 1, at every crank angle (N,) of a run, rad."""
    made = np.abs(angle - angle[0]) / (2 * pi)
    last = max(1, ceil(float(np.max(made)) - 1e-6))
    return np.asarray(np.minimum(np.floor(made + 1e-9) + 1, last), dtype=np.intp)


def first_passes(time: FloatArray, angle: FloatArray, wanted: FloatArray) -> FloatArray:
    """First instants (s) at which an angle (N,) passes each wanted value in its own sense."""
    way = np.sign(angle[-1] - angle[0]) or 1.0
    ahead = np.maximum.accumulate(way * angle)
    passes = []
    for value in (way * wanted).tolist():
        k = int(np.searchsorted(ahead, value, side="left"))
        if k == 0 or k == len(ahead):
            passes.append(float(time[min(k, len(time) - 1)]))
            continue
        part = (value - ahead[k - 1]) / (ahead[k] - ahead[k - 1])
        passes.append(float(time[k - 1] + part * (time[k] - time[k - 1])))
    return np.array(passes)

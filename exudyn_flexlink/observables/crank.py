"""The joint whose turns count: its angle, and the laps of a run."""

from __future__ import annotations

from math import ceil, pi

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.mechanism import build_mechanism, turning
from exudyn_flexlink.observables.points import part_of_point
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import ForceDrive, RevoluteJoint, Scene, SpeedDrive


def crank_joint(scene: Scene) -> str | None:
    """Name of the joint whose angle counts.

    That of ``run.of``, else the first driven revolute joint, else the first; None without one.
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
    """What files call the angle of that joint: of a crank, or by its own name; None without one.

    A crank is driven, or its turns end the run.
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
    """How far the crank has turned since the first sample (N,), rad, without sign."""
    angle = crank_angle(result)
    return np.asarray(np.abs(angle - angle[0]))


def joint_angle(result: Result, name: str) -> FloatArray:
    """Angle of the revolute joint `name` (N,), rad: second body relative to the first."""
    joint = result.scene.joints.get(name)
    if not isinstance(joint, RevoluteJoint):
        raise ValueError(f"'{name}' is no revolute joint of the scene")
    mechanism = build_mechanism(result.scene)
    first, second = (part_of_point(result.scene, mechanism, text) for text in joint.points)
    return turning(first, second, result.poses)


def turns(result: Result) -> bool:
    """Whether the crank goes round: its turns are counted, its speed is set, or it made a turn."""
    name = crank_joint(result.scene)
    if name is None:
        return False
    if name == result.scene.run.of or name in steady_speeds(result.scene):
        return True
    return float(np.ptp(crank_angle(result))) >= 2 * pi


def steady_speeds(scene: Scene) -> dict[str, float]:
    """Speeds (rad/s) of the revolute joints that a drive turns at one speed, by name."""
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
    """First instants (s) at which an angle (N,) passes each of those wanted, in its own way."""
    way = np.sign(angle[-1] - angle[0]) or 1.0
    ahead = np.maximum.accumulate(way * angle)
    found = []
    for value in (way * wanted).tolist():
        k = int(np.searchsorted(ahead, value, side="left"))
        if k == 0 or k == len(ahead):
            found.append(float(time[min(k, len(time) - 1)]))
            continue
        part = (value - ahead[k - 1]) / (ahead[k] - ahead[k - 1])
        found.append(float(time[k - 1] + part * (time[k] - time[k - 1])))
    return np.array(found)

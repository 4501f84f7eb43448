"""How bodies move: place, angle and their rates at the samples of a run."""

from __future__ import annotations

from dataclasses import dataclass

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import build_mechanism
from exudyn_flexlink.result import Result
from exudyn_flexlink.source import unknown


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
        until = f"{self.time[-1]:.5g} s, " if len(self.time) else ""
        return f"<BodyMotion of {self.body}: to {until}{len(self.time)} samples>"


def body_motion(result: Result, body: str) -> BodyMotion:
    """Motion of a body.

    Raises:
        ValueError: the scene has no such body.

    """
    bodies = build_mechanism(result.scene).bodies
    if body not in bodies:
        raise ValueError(unknown("body", body, bodies))
    pose, rate = (of[:, bodies[body][0]] for of in (result.poses, result.rates))
    return BodyMotion(body, result.time, pose[:, :2], rate[:, :2], pose[:, 2], rate[:, 2])

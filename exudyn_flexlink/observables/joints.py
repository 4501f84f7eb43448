"""Forces in joints, and how far forces are off at each of N samples."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, nan

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables.parting import touching
from exudyn_flexlink.result import Result


@dataclass(frozen=True)
class JointForce:
    """What acts in a joint at samples `time` (N,) s, in the ground's axes.

    `force` (N, 2) N acts on the body of the joint's second point, in a slot on the point that runs
    in it. `torque` (N,) N m is what drives put on that body at the joint; None where no drive
    does. `error` (N,) N and `torque_error` (N,) N m bound how far these are off, see
    `force_error`.
    """

    joint: str
    time: FloatArray
    force: FloatArray
    error: FloatArray
    torque: FloatArray | None
    torque_error: FloatArray | None

    def __repr__(self) -> str:
        largest = float(np.linalg.norm(self.force, axis=1).max(initial=0.0))
        turned = "" if self.torque is None else f", torque to {np.abs(self.torque).max():.5g} N m"
        return f"<JointForce of {self.joint}: to {largest:.5g} N{turned}, {len(self.time)} samples>"


def joint_force(result: Result, joint: str) -> JointForce:
    """Force in a joint (of any kind), the torque of its drives, and how far they are off.

    Raises:
        ValueError: no force of such a joint is kept.

    """
    forces = {**result.joint_forces, **result.slot_forces}
    known = [name for name in result.scene.joints if name in forces]
    if joint not in known:
        others = ("sleeves", "gear_forces", "gear_torques")
        own = "".join(f", but {key}['{joint}']" for key in others if joint in getattr(result, key))
        raise ValueError(f"no force of '{joint}' is kept{own}; of: {', '.join(known) or 'none'}")
    kind = "joint" if joint in result.joint_forces else "slot"
    scene, torque = result.scene, result.drive_torques
    drives = [name for name in torque if getattr(scene.drives[name], "joint", None) == joint]
    torques = [torque[name] for name in drives]
    errors = [force_error(result, f"drive torque of {name}") for name in drives]
    return JointForce(
        joint,
        result.time,
        forces[joint],
        force_error(result, f"{kind} force of {joint}"),
        np.sum(torques, axis=0) if drives else None,
        np.sum(errors, axis=0) if drives else None,
    )


def force_error(result: Result, name: str) -> FloatArray:
    """How far a force may be off at each sample (N,), by what `forces_of` calls it; N or N m.

    The largest error that a second run found while nothing touches, or while something does.
    Inf beyond the instant up to which errors are known; nan where nothing was measured. Where a
    touch begins or ends, a force jumps as much later or earlier as the instant is off, too.
    """
    found = result.error.forces.get(name)
    if found is None:
        return np.full(len(result.time), np.nan)
    free, touched = (nan if part is None else part.largest for part in (found.free, found.touching))
    error = np.where(touching(result, result.time), touched, free)
    return np.where(result.time < result.error.known_until, error, inf)

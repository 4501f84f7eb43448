"""The state at time 0: where the parts stand, how fast they move, what the springs rest at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.mechanism.channels import node_anchor
from exudyn_flexlink.mechanism.closing import (
    CannotAssembleError,
    Start,
    positions,
    scales,
    spread,
)
from exudyn_flexlink.mechanism.dynamics import accelerations, constraint_jacobian
from exudyn_flexlink.mechanism.kinematics import angle_of, constraint_rows
from exudyn_flexlink.mechanism.model import Mechanism, Slide

FloatArray = NDArray[np.float64]

__all__ = [
    "Assembly",
    "CannotAssembleError",
    "CannotMoveError",
    "Start",
    "State",
    "assemble",
]


@dataclass(frozen=True)
class State:
    """Coordinates (parts, 3), velocities, accelerations; the slots' curve parameters."""

    q: FloatArray
    v: FloatArray
    a: FloatArray
    places: FloatArray


@dataclass(frozen=True)
class Assembly:
    """A mechanism put together: its state at time 0, degrees of freedom, redundant constraints.

    `surplus` names the joints and drives that add less constraints than they have to those before
    them, in the mechanism's order, with the number that each has too many.
    """

    mechanism: Mechanism
    state: State
    degrees_of_freedom: int
    surplus: Mapping[str, int]

    @property
    def redundant(self) -> int:
        """Number of constraints that others imply already."""
        return sum(self.surplus.values())


class CannotMoveError(ValueError):
    """A drive, or the initial speed of a part, contradicts the joints and those before it.

    `drive` is its name, or None; else `part` is the part, and `axis` 0 or 1 for its velocity along
    x or y and 2 for its angular speed.
    """

    def __init__(self, drive: str | None, part: int | None = None, axis: int | None = None) -> None:
        super().__init__(f"the mechanism can't follow {drive or part}")
        self.drive = drive
        self.part = part
        self.axis = axis


def assemble(mechanism: Mechanism, start: Start) -> Assembly:
    """Put the mechanism together at time 0.

    A link with clearance starts on its guide's axis, unless its angle is given, and moves with the
    guide, as if there were none, unless its motion is given. Angles in `start.angles` and those of
    motor-driven parts are held; everything else starts from `start.guesses` (0 where nothing is
    given) and moves as little as the joints demand. A flexible body starts straight and at one
    angular speed, unless the joints can't have that.

    Raises:
        CannotAssembleError: a joint can't close.
        CannotMoveError: a drive or a speed given contradicts the joints.

    """
    q, places = positions(_without_play(mechanism, set(start.angles)), start)
    mechanism = mechanism.with_springs(
        tuple(
            spring
            if spring.rest_angle is not None
            else replace(
                spring, rest_angle=float(angle_of(spring.second, q) - angle_of(spring.first, q))
            )
            for spring in mechanism.springs
        )
    )
    moved = {*start.speeds, *start.velocities}
    v = _velocities(_without_play(mechanism, moved), q, places, start)
    a = accelerations(mechanism, q, v, places, 0.0)
    surplus = _surplus(mechanism, q, places)
    rank = len(constraint_jacobian(mechanism, q, places)) - sum(surplus.values())
    return Assembly(mechanism, State(q, v, a, places), q.size - rank, surplus)


def _without_play(mechanism: Mechanism, given: set[int]) -> Mechanism:
    """Put links with clearance on the axes of their guides, but for those of the parts given."""
    slides = tuple(
        Slide(channel.name, channel.guide, node_anchor(channel, 0))
        for channel in mechanism.channels
        if channel.clearance > 0 and not given & set(channel.rods)
    )
    return replace(mechanism, slides=mechanism.slides + slides)


# --- velocities -----------------------------------------------------------------------------


def _velocities(
    mechanism: Mechanism, q: FloatArray, places: FloatArray, start: Start
) -> FloatArray:
    """Velocities of least size that satisfy joints, motors and the speeds given.

    A flexible body moves as if it were rigid, unless the joints can't have that.
    """
    jacobian = constraint_jacobian(mechanism, q, places)
    motors = mechanism.speed_motors
    wanted = _given(start)
    given = np.zeros((len(wanted), q.size))
    for row, (part, axis, _) in enumerate(wanted):
        given[row, 3 * part + axis] = 1.0
    rows = np.vstack([jacobian, given])
    right = np.zeros(len(rows))
    driven = len(jacobian) - len(motors)
    right[driven : len(jacobian)] = [motor.ramp.at(0.0) for motor in motors]
    right[len(jacobian) :] = [value for _, _, value in wanted]
    for moved in (spread(mechanism, q), np.eye(q.size)):
        least, follows = _least(rows @ moved, right)
        if follows:
            return np.asarray((moved @ least).reshape(q.shape))
    reach = range(driven + 1, len(rows))
    first = next((i for i in reach if not _least(rows[:i], right[:i])[1]), len(rows))
    if first <= len(jacobian):
        raise CannotMoveError(motors[first - driven - 1].name)
    part, axis, _ = wanted[first - len(jacobian) - 1]
    raise CannotMoveError(None, part, axis)


def _given(start: Start) -> list[tuple[int, int, float]]:
    """Part, axis (0, 1, 2: x, y, angle) and value of every velocity that is given."""
    return [
        *((part, 2, speed) for part, speed in start.speeds.items()),
        *((part, axis, v[axis]) for part, v in start.velocities.items() for axis in (0, 1)),
    ]


def _least(rows: FloatArray, right: FloatArray) -> tuple[FloatArray, bool]:
    """Least velocities with ``rows @ v = right`` as far as possible, and whether it is."""
    least = np.asarray(np.linalg.lstsq(rows, right, rcond=1e-11)[0])
    violated = np.abs(rows @ least - right).max(initial=0.0)
    return least, bool(violated <= 1e-9 * max(1.0, float(np.abs(right).max(initial=0.0))))


# --- redundant constraints --------------------------------------------------------------------


def _surplus(mechanism: Mechanism, q: FloatArray, places: FloatArray) -> dict[str, int]:
    """Constraints of each joint and drive that those before it imply already, where there are."""
    motors = np.zeros(len(mechanism.speed_motors))
    joints = list(constraint_rows(mechanism, q, places, motors))
    scaled = [joint.jacobian * scales(mechanism) for joint in joints]
    missing = sum(map(len, scaled)) - _rank(scaled)
    found: dict[str, int] = {}
    known = 0
    for i, joint in enumerate(joints):
        if sum(found.values()) == missing:
            break
        rank = _rank(scaled[: i + 1])
        if rank < known + len(scaled[i]):
            found[joint.name] = known + len(scaled[i]) - rank
        known = rank
    return found


def _rank(scaled: list[FloatArray]) -> int:
    """Number of independent constraints, counted on rows of length 1 by scaled coordinates."""
    if not scaled:
        return 0
    rows = np.vstack(scaled)
    rows = rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)
    return int(np.linalg.matrix_rank(rows, tol=1e-9))

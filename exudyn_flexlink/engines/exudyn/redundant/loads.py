"""Torques and forces of drives as Exudyn's loads; what varies is asked of Python in every round."""

from __future__ import annotations

from collections.abc import Callable
from math import nan
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.engine import items
from exudyn_flexlink.engines.exudyn.redundant.system import System
from exudyn_flexlink.mechanism import GROUND, PointForce, Ramp, Size, TorqueMotor, force_at, size_at


def add_loads(system: System) -> None:
    """Add all torques and forces."""
    for motor in system.mechanism.torque_motors:
        _add_torque(system, motor)
    for force in system.mechanism.forces:
        _add_force(system, force)


def sense(system: System) -> bool:
    """Tell whether a load depends on the state, so that Newton's matrix needs its slopes."""
    turned = any(force.axes != GROUND for force in system.mechanism.forces)
    return turned or any(size.senses for _, size in system.mechanism.sizes)


def _constant(size: Size) -> float | None:
    """Return a number that stays; None if it varies."""
    ramp = size.value
    return ramp.value if isinstance(ramp, Ramp) and ramp.duration == 0 else None


def _add_torque(system: System, motor: TorqueMotor) -> None:
    constant = _constant(motor.size)
    for part, sign in ((motor.second, 1.0), (motor.first, -1.0)):
        if part == GROUND:
            continue

        def torque(time: float, q: FloatArray, v: FloatArray, sign: float = sign) -> float:
            return sign * size_at(motor.size, time, q, v)

        load = {"load": sign * constant} if constant is not None else {
            "loadUserFunction": _asked(system, torque, nan)
        }  # fmt: skip
        marker = system.angle_marker(part)
        number = system.mbs.AddLoad(items.LoadCoordinate(markerNumber=marker, **load))
        system.loads.setdefault(motor.name, []).append(int(number))


def _add_force(system: System, force: PointForce) -> None:
    def push(time: float, q: FloatArray, v: FloatArray) -> list[float]:
        return [*force_at(force, np.array([time]), q[None], v[None])[0].tolist(), 0.0]

    x, y = (_constant(size) for size in force.sizes)
    load: dict[str, Any] = {"loadVectorUserFunction": _asked(system, push, [nan] * 3)}
    if force.axes == GROUND and x is not None and y is not None:
        load = {"loadVector": [x, y, 0.0]}
    marker = system.point_marker(force.point)
    number = system.mbs.AddLoad(items.LoadForceVector(markerNumber=marker, **load))
    system.loads[force.name] = [int(number)]


def _asked(system: System, load: Callable[..., Any], nothing: Any) -> Callable[..., Any]:
    """Let Exudyn ask for a load at the state (parts, 3) of now; `nothing` where it has no value."""

    def asked(mbs: Any, time: float, _load: Any) -> Any:
        data = mbs.systemData
        q, v = data.GetODE2Coordinates().tolist(), data.GetODE2Coordinates_t().tolist()
        state = (np.reshape(x, (-1, 3)) for x in system.coordinates.plain(q, v))
        try:
            return load(system.window.inside(time), *state)
        except ArithmeticError as error:
            system.errors.append(error)
            return nothing

    return asked

"""The controller of the four-bar with clearance, against the torques that its authors print."""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import fsolve

from exudyn_flexlink import load_scene
from exudyn_flexlink.expressions import Expression

MODEL = Path(__file__).parents[1] / "models" / "benchmarks" / "four_bar_clearance.yaml"
# s, rad, rad/s and N m: rows of FourBarClearance.ref
PRINTED = (
    (0.05, 1.667922274684632, 4.395041918929630, 189.8003911975021),
    (0.5, 5.545613246113826, 5.285016011367314, -46.56678298735044),
    (1.0, 4.2384556379108, -9.98530696792281, 6.436938632165562),
)
PI_OFF = 4e-9  # of their 3.14159265
STEEPNESS = 1e4  # N m, by which the torque changes with pi: 2000 * 6 * 0.75 and smaller parts


def ideal(crank, speed):
    """Angles and speeds of the coupler (4 m) and the rocker (2.5 m) without clearance.

    The crank has 1 m, the pivots are 3 m apart.
    """

    def gap(angles):
        loop = np.exp(1j * crank) + 4 * np.exp(1j * angles[0]) - 3 - 2.5 * np.exp(1j * angles[1])
        return loop.real, loop.imag

    angles = fsolve(gap, (0.7, 1.6), xtol=1e-13)
    arms = np.array([4, -2.5]) * 1j * np.exp(1j * angles)
    turn = 1j * np.exp(1j * crank) * speed
    return angles, np.linalg.solve([arms.real, arms.imag], [-turn.real, -turn.imag])


@pytest.mark.parametrize("row", PRINTED, ids=lambda row: f"{row[0]:g} s")
def test_the_controller_gives_the_printed_torque(row):
    time, crank, speed, torque = row
    (coupler, rocker), (coupler_speed, rocker_speed) = ideal(crank, speed)
    state = {
        ("angle", "o"): crank,
        ("angle", "p"): coupler - crank,
        ("angle", "q"): rocker - coupler,
        ("angle", "r"): rocker,
        ("speed", "o"): speed,
        ("speed", "p"): coupler_speed - speed,
        ("speed", "q"): rocker_speed - coupler_speed,
    }
    pushes = []
    for drive in load_scene(MODEL).drives.values():
        value = drive.value if isinstance(drive.value, Expression) else drive.value[1]
        pushes.append(value.at(time, [state[one.kind, one.of] for one in value.sensed]))
    assert len(pushes) == 4
    # A push across the crank, 1 m from its pivot, is a torque of as many N m.
    assert sum(pushes) == pytest.approx(torque, abs=PI_OFF * STEEPNESS)

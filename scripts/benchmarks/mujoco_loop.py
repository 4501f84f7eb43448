"""The slider-crank of `free_slider_crank.yaml` in MuJoCo: a tree of bodies, its loop closed softly.

MuJoCo has no rigid constraints: what closes a loop is a damped spring in the constraint's own
coordinate, of any stiffness. It is told by w h here: its natural frequency times the step. Steps of
RK4 burst above about 2.5. It is damped critically, and its impedance is the highest that there is.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import asin, cos, pi, sin
from typing import Any

import numpy as np

from benchmarks.mujoco_chain import mujoco
from exudyn_flexlink.arrays import FloatArray

CRANK, ROD = 0.1, 0.3  # m
ANGLE, SPEED = pi / 3, 10.0  # rad, rad/s of the crank at the start
SAMPLE = 5e-3  # s: in it are whole steps, and 1e-4 m allows long ones
IMPEDANCE = 0.9999  # the highest that MuJoCo takes
TIGHT = 1e-12  # its solver then makes one iteration: all constraints are linear
HINGE = 'type="hinge" axis="0 0 1"'


@dataclass(frozen=True)
class Closing:
    """Where the loop is cut and closed again, and how stiff.

    `rod_on`: the body that carries the rod, 'crank' or 'slider'; the rod's other end is held to the
    other one.
    """

    rod_on: str
    stiffness: float  # w h

    def __str__(self) -> str:
        return f"rod on {self.rod_on}, wh = {self.stiffness:g}"


def _inertial(mass: float, inertia: float, centre: float) -> str:
    same = f"{inertia} {inertia} {inertia}"
    return f'<inertial pos="{centre} 0 0" mass="{mass}" diaginertia="{same}"/>'


def model(closing: Closing) -> Any:
    """The model in MuJoCo; coordinates are in the order of the tree."""
    on_crank = closing.rod_on == "crank"
    far = ROD if on_crank else -ROD  # the rod's free end, from its joint
    place = f'pos="{CRANK} 0 0"' if on_crank else ""
    rod = (
        f'<body {place}><joint {HINGE}/>{_inertial(1, 1e-2, far / 2)}<site name="free" '
        f'pos="{far} 0 0"/></body>'
    )
    crank = (
        f'<body><joint {HINGE}/>{_inertial(0.5, 1e-3, CRANK / 2)}<site name="crank" '
        f'pos="{CRANK} 0 0"/>{rod if on_crank else ""}</body>'
    )
    slider = (
        f'<body><joint type="slide" axis="1 0 0"/>{_inertial(2, 1e-3, 0)}<site name="slider"/>'
        f"{'' if on_crank else rod}</body>"
    )
    held = "slider" if on_crank else "crank"
    text = (
        f'<mujoco><option gravity="0 -9.81 0" tolerance="{TIGHT}">'
        '<flag contact="disable" autoreset="disable"/></option>'
        f"<worldbody>{crank + slider if on_crank else slider + crank}</worldbody>"
        f'<equality><connect site1="free" site2="{held}" '
        f'solimp="{IMPEDANCE} {IMPEDANCE} 1 0.5 1"/></equality></mujoco>'
    )
    made = mujoco.MjModel.from_xml_string(text)
    # Later versions can take the exact inertia at the constraint, which may halve the error.
    made.opt.enableflags |= int(getattr(mujoco.mjtEnableBit, "mjENBL_DIAGEXACT", 0))
    return made


def start(closing: Closing) -> tuple[FloatArray, FloatArray]:
    """Coordinates and speeds at the start, at which the loop is closed."""
    lean = -asin(CRANK * sin(ANGLE) / ROD)
    turning = -CRANK * cos(ANGLE) * SPEED / (ROD * cos(lean))  # of the rod
    place = CRANK * cos(ANGLE) + ROD * cos(lean)
    sliding = -CRANK * sin(ANGLE) * SPEED - ROD * sin(lean) * turning
    if closing.rod_on == "crank":
        return np.array([ANGLE, lean - ANGLE, place]), np.array([SPEED, turning - SPEED, sliding])
    return np.array([place, lean, ANGLE]), np.array([sliding, turning, SPEED])


def turn(made: Any, closing: Closing, count: int, every: int, integrator: Any) -> FloatArray:
    """Crank pin and slider (count + 1, 2, 2), m, at all samples, with `every` steps in each."""
    step = SAMPLE / every
    made.opt.timestep = step
    made.opt.integrator = integrator
    frequency = closing.stiffness / step  # rad/s
    made.eq_solref[0] = (-(frequency**2), -2 * frequency)  # negative: stiffness and damping
    data = mujoco.MjData(made)
    data.qpos[:], data.qvel[:] = start(closing)
    states = np.zeros((count + 1, 3))
    states[0] = data.qpos
    for i in range(count):
        mujoco.mj_step(made, data, every)
        states[i + 1] = data.qpos
    angle, place = (0, 2) if closing.rod_on == "crank" else (2, 0)
    pin = CRANK * np.column_stack([np.cos(states[:, angle]), np.sin(states[:, angle])])
    return np.stack([pin, np.column_stack([states[:, place], np.zeros(count + 1)])], axis=1)

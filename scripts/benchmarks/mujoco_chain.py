"""The ringing chain of `ringing_chain.yaml` in MuJoCo: a tree of rods with sprung hinges."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from benchmarks.numpy_lagrangian import Link
from exudyn_flexlink.arrays import FloatArray

try:
    import mujoco
except ImportError:  # the extra 'peers'
    mujoco = None


# What has burst is to stay so, and to be seen by its error: no reset, no warnings, no log file.
FLAGS = '<flag contact="disable" constraint="disable" autoreset="disable"/>'
if mujoco is not None:
    mujoco.set_mju_user_warning(lambda _text: None)


def integrators() -> dict[str, Any]:
    """MuJoCo's integrators by name, as far as this version has them."""
    found = mujoco.mjtIntegrator
    names = ("EULER", "IMPLICIT", "IMPLICITFAST", "RK4", "DISCRETE")
    return {
        name: getattr(found, f"mjINT_{name}") for name in names if hasattr(found, f"mjINT_{name}")
    }


def model(weight: float, link: Link) -> Any:
    """Rod 1 is fixed, so that the tree begins with rod 2; `weight` (m/s^2) acts along y."""
    spring = f'stiffness="{link.stiffness!r}" springref="0" damping="0" armature="0"'
    half, mass, inertia = link.length / 2, link.mass, link.inertia
    rods = "".join(
        f'<body pos="{link.length!r} 0 0"><joint type="hinge" axis="0 0 1" {spring}/>'
        f'<inertial pos="{half!r} 0 0" mass="{mass!r}" diaginertia="{inertia!r} {inertia!r} '
        f'{inertia!r}"/>'
        for _ in range(link.rods - 1)
    )
    text = (
        '<mujoco><compiler angle="radian"/>'
        f'<option gravity="0 {weight!r} 0">{FLAGS}</option>'
        f"<worldbody>{rods}{'</body>' * (link.rods - 1)}</worldbody></mujoco>"
    )
    return mujoco.MjModel.from_xml_string(text)


def end(link: Link, joints: FloatArray) -> FloatArray:
    """S from P (N, 2), m, of joint angles (N, n - 1)."""
    angles = np.cumsum(joints, axis=1)
    return link.end(np.column_stack([np.zeros(len(joints)), angles]))


def ring(weight: float, count: int, every: int, integrator: Any) -> FloatArray:
    """S (count + 1, 2) from P, m, every millisecond, with `every` steps in each."""
    link, chain = _made_once(weight)
    chain.opt.timestep = 1e-3 / every
    chain.opt.integrator = integrator
    data = mujoco.MjData(chain)
    joints = np.zeros((count + 1, link.rods - 1))
    for i in range(count):
        mujoco.mj_step(chain, data, every)
        joints[i + 1] = data.qpos
    return end(link, joints)


@cache
def _made_once(weight: float) -> tuple[Link, Any]:
    """Chain and its model, made once as our scene is loaded once: what is repeated is the run."""
    link = Link()
    return link, model(weight, link)


def mass_matrix(link: Link) -> FloatArray:
    """Of the straight chain, by joint angles, kg m^2."""
    chain = model(0.0, link)
    data = mujoco.MjData(chain)
    mujoco.mj_forward(chain, data)
    columns = []
    for unit in np.eye(chain.nv):
        column = np.zeros(chain.nv)
        mujoco.mj_mulM(chain, data, column, unit)
        columns.append(column)
    return np.column_stack(columns)

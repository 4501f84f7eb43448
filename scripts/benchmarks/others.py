"""The free slider-crank beside other programs: time for an error, by each at its best setting.

MuJoCo is no dependency: `pip install mujoco` adds its column. Its loops are closed by springs and
dampers, here as fast as its manual allows, two steps. DOP853 solves the equation of motion of the
crank's angle, written by hand, which has no loop.
"""

from __future__ import annotations

from functools import cache, partial
from importlib import import_module
from importlib.util import find_spec
from math import asin, cos, pi, sin, sqrt
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.measuring import Measured, Run, Table, cheapest, ladder, repeated
from benchmarks.strike import ROOT
from exudyn_flexlink import load_scene, simulate
from exudyn_flexlink.arrays import FloatArray

MODEL = ROOT / "models" / "textbook" / "free_slider_crank.yaml"
CRANK, ROD = 0.1, 0.3  # m
CRANK_CENTRE, ROD_CENTRE = 0.05, 0.15  # m, from the hub, and from the crank's pin
CRANK_MASS, ROD_MASS, SLIDER_MASS = 0.5, 1.0, 2.0  # kg
CRANK_INERTIA, ROD_INERTIA = 1e-3, 1e-2  # kg m^2
GRAVITY = 9.81  # m/s^2
START, SPEED = pi / 3, 10.0  # rad, rad/s, of the crank
DURATION, SAMPLE = 3.0, 1e-3  # s
ERRORS = (1e-4, 1e-6, 1e-8)  # m
EXACT = 1e-13  # relative tolerance of the reference
STIFFEST = 0.9999  # what MuJoCo's manual has as the largest impedance
BUDGET = 20.0  # s, of the longest run


def motion(_: float, state: FloatArray) -> list[float]:
    """Rates of the crank's angle and speed: Lagrange's equation of one coordinate."""
    angle, speed = state
    s, c = sin(angle), cos(angle)
    rod_s = -CRANK * s / ROD
    rod_c = sqrt(1 - rod_s**2)
    turn = -CRANK * c / (ROD * rod_c)  # of the rod, per angle of the crank; and its slope
    bend = (CRANK * s + ROD * rod_s * turn**2) / (ROD * rod_c)
    x = -CRANK * s - ROD_CENTRE * rod_s * turn  # of the rod's centre, likewise
    y = CRANK * c + ROD_CENTRE * rod_c * turn
    x_bend = -CRANK * c - ROD_CENTRE * (rod_c * turn**2 + rod_s * bend)
    y_bend = -CRANK * s - ROD_CENTRE * (rod_s * turn**2 - rod_c * bend)
    slide = -CRANK * s - ROD * rod_s * turn
    slide_bend = -CRANK * c - ROD * (rod_c * turn**2 + rod_s * bend)
    inertia = CRANK_INERTIA + CRANK_MASS * CRANK_CENTRE**2 + ROD_INERTIA * turn**2
    inertia += ROD_MASS * (x * x + y * y) + SLIDER_MASS * slide**2
    half_slope = ROD_INERTIA * turn * bend + ROD_MASS * (x * x_bend + y * y_bend)
    half_slope += SLIDER_MASS * slide * slide_bend
    weight = GRAVITY * (CRANK_MASS * CRANK_CENTRE * c + ROD_MASS * y)
    return [speed, -(half_slope * speed**2 + weight) / inertia]


def slider(angle: FloatArray) -> FloatArray:
    """Place of the slider (m) at angles of the crank."""
    return CRANK * np.cos(angle) + ROD * np.sqrt(1 - (CRANK * np.sin(angle) / ROD) ** 2)


@cache
def instants() -> FloatArray:
    """Instants (s) at which all are compared."""
    return np.arange(0.0, DURATION + SAMPLE / 2, SAMPLE)


@cache
def exact() -> FloatArray:
    """Places of the slider (m) at all instants."""
    return slider(_solved(EXACT)[0])


def _solved(tolerance: float) -> tuple[FloatArray, int]:
    given = {"rtol": tolerance, "atol": tolerance, "t_eval": instants()}
    made = solve_ivp(motion, (0.0, DURATION), [START, SPEED], method="DOP853", **given)
    return made.y[0], made.nfev


def by_equation(tolerance: float) -> tuple[float, int]:
    """Error (m) and evaluations of DOP853 at a relative tolerance."""
    angle, evaluations = _solved(tolerance)
    return float(np.abs(slider(angle) - exact()).max()), evaluations


def here(tolerance: float, formulation: str, *, measure: bool) -> tuple[float, int]:
    """Error (m) and steps of a run of this program; to `measure` its error takes a second one."""
    asked = (f"accuracy.tolerance={tolerance}", f"solver.formulation={formulation}")
    result = simulate(load_scene(MODEL, asked), measure=measure)
    place = result.path("slider.pin").at(instants())[:, 0]
    return float(np.abs(place - exact()).max()), result.checks.steps


def by_mujoco(step: float) -> tuple[float, int]:
    """Error (m) and steps of MuJoCo's RK4 with a step (s)."""
    mujoco: Any = import_module("mujoco")  # which users may not have
    model = mujoco.MjModel.from_xml_string(_MJCF.format(
        step=step, fastest=2 * step, stiffest=STIFFEST, g=GRAVITY, r=CRANK, l=ROD,
        a=CRANK_CENTRE, b=ROD_CENTRE, mc=CRANK_MASS, mr=ROD_MASS, ms=SLIDER_MASS,
        jc=CRANK_INERTIA, jr=ROD_INERTIA, x=slider(np.zeros(1))[0],
    ))  # fmt: skip
    data = mujoco.MjData(model)
    rod = -asin(CRANK * sin(START) / ROD)
    turn = -CRANK * cos(START) / (ROD * cos(rod))
    slide = -CRANK * sin(START) - ROD * sin(rod) * turn
    data.qpos[:] = [START, rod - START, slider(np.array([START]))[0] - slider(np.zeros(1))[0]]
    data.qvel[:] = [SPEED, SPEED * (turn - 1), SPEED * slide]
    each, angles = round(SAMPLE / step), [START]
    for _ in instants()[1:]:
        mujoco.mj_step(model, data, each)
        angles.append(float(data.qpos[0]))
    return float(np.abs(slider(np.array(angles)) - exact()).max()), each * (len(angles) - 1)


_MJCF = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{step}" integrator="RK4" gravity="0 -{g} 0" tolerance="1e-14"/>
  <worldbody>
    <body>
      <joint type="hinge" axis="0 0 1"/>
      <inertial pos="{a} 0 0" mass="{mc}" diaginertia="{jc} {jc} {jc}"/>
      <body name="rod" pos="{r} 0 0">
        <joint type="hinge" axis="0 0 1"/>
        <inertial pos="{b} 0 0" mass="{mr}" diaginertia="{jr} {jr} {jr}"/>
      </body>
    </body>
    <body name="slider" pos="{x} 0 0">
      <joint type="slide" axis="1 0 0"/>
      <inertial pos="0 0 0" mass="{ms}" diaginertia="1e-3 1e-3 1e-3"/>
    </body>
  </worldbody>
  <equality>
    <connect body1="rod" body2="slider" anchor="{l} 0 0" solref="{fastest} 1"
             solimp="{stiffest} {stiffest} 0.001"/>
  </equality>
</mujoco>
"""


def tables(quick: bool = False, repeat: int = 3) -> list[Table]:
    """Measure, and tell it."""
    errors = ERRORS[:2] if quick else ERRORS
    minimal = partial(here, formulation="minimal")
    redundant = partial(here, formulation="redundant", measure=False)
    runs: dict[str, Run] = {
        "here, one run": partial(minimal, measure=False),
        "here, with the run that tells its error": partial(minimal, measure=True),
        "Exudyn's own solver": redundant,
        "DOP853, one coordinate": by_equation,
    }
    rungs: dict[str, list[float]] = {name: list(ladder(1e-3)) for name in runs}
    if find_spec("mujoco"):
        runs["MuJoCo, RK4"] = by_mujoco
        rungs["MuJoCo, RK4"] = [SAMPLE / each for each in (1, 2, 4, 8, 16, 32, 64)]
    for run, first in ((run, rungs[name][0]) for name, run in runs.items()):
        run(first)  # else imports count
    found = repeated(runs, cheapest(runs, rungs, errors, BUDGET), repeat)
    rows = tuple((name, *(_cell(found.get((name, e))) for e in errors)) for name in runs)
    title = "Slider-crank that turns by itself, 3 s: processor time at an error of its slider"
    return [Table(title, ("solved by", *(f"{e:.0e} m" for e in errors)), rows, _said(found))]


def _cell(point: Measured | None) -> str:
    return "not reached" if point is None else f"{point.cost:.3g} s ({point.error:.1e} m)"


def _said(found: dict[tuple[str, float], Measured]) -> str:
    """Say how the program stands beside the others."""
    others = {name for name, _ in found if not name.startswith("here")}
    texts = []
    for error in sorted({error for _, error in found}, reverse=True):
        mine = found.get(("here, one run", error))
        beside = [(n, found[n, error].cost / mine.cost) for n in sorted(others)
                  if mine and (n, error) in found]  # fmt: skip
        told = ", ".join(f"{name} {ratio:.2g}" for name, ratio in beside)
        texts.append(f"{error:.0e} m: {told}")
    return f"Times of others over that of one run here: {'; '.join(texts)}."

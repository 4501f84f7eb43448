"""Measure largest Lyapunov exponents that others published, or that have a closed form.

  .venv/bin/python scripts/published_exponents.py
  .venv/bin/python scripts/published_exponents.py --part 0.1

Prints a Markdown table. Lorenz' and Ueda's equations are solved by SciPy; Ueda's oscillator is also
a mechanism, a mass on a rail that a force pushes, and so is a ball that bounces on a shaken table,
both by Exudyn, restarted from states. All go through the one estimator. Exponents of chaotic
motions scatter as one over the root of time: a tenth of it (`--part`) tells them three times worse.
Takes a quarter of an hour, most of it for Ueda's mechanism.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from math import acos, log, pi, sin

import numpy as np
from scipy.integrate import solve_ivp

from exudyn_flexlink import engines
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.loading import scene_of
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.source import parse_document
from exudyn_flexlink.stability import (
    Asked,
    Exponent,
    Flow,
    Neighbours,
    largest_exponent,
    study,
    trajectory,
)

LORENZ = 0.9056
"""J. C. Sprott, Chaos and Time-Series Analysis, Oxford University Press 2003, appendix A."""
UEDA = 0.0999
"""Spectrum of x'' + 0.05 x' + x^3 = 7.5 cos t: sites.google.com/view/lyapunov-spectrum, after
Y. Ueda, Journal of Statistical Physics 20 (1979) 181."""
E, OMEGA, GAMMA, G = 0.5, 30.0, 1.1, 9.81  # restitution, rad/s and acceleration over g of a table
UEDA_SCENE = """
bodies: {mass: {type: rigid, mass: 1, inertia: 1, points: {p: [0, 0]}}}
joints: {rail: {type: prismatic, points: [ground, mass.p], at: [0, 0], axis: [1, 0]}}
springs: {damper: {type: linear, joint: rail, damping: 0.05}}
drives: {push: {type: force, point: mass.p, value: [7.5*cos(t) - place(rail)**3, 0]}}
initial: {along: {rail: 1}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-8}
"""


def ball_scene(clock: float, height: float, speed: float) -> str:
    """A ball over a table that shakes as ``sin(OMEGA t)``: in SI, at t = clock."""
    return f"""
bodies:
  ball: {{type: rigid, mass: 1, inertia: 0.1, points: {{p: [0, 0]}}}}
  table: {{type: rigid, mass: 1, inertia: 0.1, points: {{o: [0, 0], a: [-1, 0], b: [1, 0]}}}}
joints:
  fall: {{type: prismatic, points: [ground, ball.p], at: [0, 0], axis: [0, 1]}}
  rail: {{type: prismatic, points: [ground, table.o], at: [0, 0], axis: [0, 1]}}
drives: {{shake: {{type: motion, joint: rail, value: {GAMMA * G / OMEGA**2}*sin({OMEGA}*t)}}}}
contacts:
  bounce:
    type: point_on_line
    point: ball.p
    line: [table.a, table.b]
    law: {{type: impulse, restitution: {E}}}
gravity: 9.81
initial: {{clock: {clock}, along: {{fall: {height}}}, velocities: {{ball: [0, {speed}]}}}}
run: {{duration: 1}}
accuracy: {{tolerance: 1.0e-9}}
"""


def by_scipy(rate: Callable[[float, FloatArray], list[float]]) -> Flow:
    """Flow of equations, by an explicit method of order 8."""

    def flow(x: FloatArray, begin: float, end: float) -> FloatArray:
        solved = solve_ivp(rate, (begin, end), x, method="DOP853", rtol=1e-9, atol=1e-9)
        return np.asarray(solved.y[:, -1])

    return flow


def lorenz(part: float) -> Exponent:
    """Sigma 10, rho 28, beta 8/3."""

    def rate(_: float, x: FloatArray) -> list[float]:
        return [10 * (x[1] - x[0]), x[0] * (28 - x[2]) - x[1], x[0] * x[1] - 8 / 3 * x[2]]

    flow = by_scipy(rate)
    begin = flow(np.array([1.0, 1.0, 20.0]), 0.0, 50.0)
    motion = trajectory(flow, begin, np.arange(0.0, 2000 * part, 0.5))
    return largest_exponent(flow, motion, Neighbours(1e-6, 20.0 * part))


def ueda(part: float) -> Exponent:
    """Period 2 pi, by SciPy."""

    def rate(t: float, x: FloatArray) -> list[float]:
        return [x[1], -0.05 * x[1] - x[0] ** 3 + 7.5 * np.cos(t)]

    flow = by_scipy(rate)
    begin = flow(np.array([1.0, 0.0]), 0.0, 60 * pi)
    motion = trajectory(flow, begin, 60 * pi + np.arange(0.0, 4000 * part * pi, pi))
    return largest_exponent(flow, motion, Neighbours(1e-6, 40 * pi * part))


def exponent_of(scene: Scene, lap: float, laps: int) -> Exponent:
    """Exponent of a mechanism, by Exudyn."""
    asked = Asked(laps, 3, lap, tolerance=1e-9)
    found = study(scene, lambda each: engines.simulate(each, "exudyn", measure=False), asked)
    return found.exponent


def ueda_mechanism(part: float) -> Exponent:
    """The same as a mechanism: four periods of its force are a lap, for fewer restarts."""
    scene = scene_of(parse_document(f"title: a mass on a rail\n{UEDA_SCENE}", "ueda.yaml"))
    return exponent_of(scene, 8 * pi, round(250 * part))


def bouncing_ball(_: float) -> Exponent:
    """A ball that bounces once a period: neighbours approach by the restitution in each."""
    period = 2 * pi / OMEGA
    first, start = acos((1 - E) / (1 + E) * pi / GAMMA) / OMEGA, 0.4 * period
    flown, up, high = start - first, G * period / 2, GAMMA * G / OMEGA**2
    height = high * sin(OMEGA * first) + up * flown - G * flown**2 / 2
    text = f"title: a ball on a table\n{ball_scene(start, height, up - G * flown)}"
    return exponent_of(scene_of(parse_document(text, "ball.yaml")), period, 60)


CASES = {
    "Lorenz, SciPy": (lorenz, LORENZ, "published"),
    "Ueda's oscillator, SciPy": (ueda, UEDA, "published"),
    "Ueda's oscillator as a mechanism, Exudyn": (ueda_mechanism, UEDA, "published"),
    "ball on a shaken table, Exudyn": (bouncing_ball, log(E) * OMEGA / (2 * pi), "closed form"),
}


def main() -> None:
    """Measure and print all."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--part", type=float, default=1.0, help="of the time, 0.05 to 1")
    options = parser.parse_args()
    print("| system | known (1/s) | from | measured (1/s), 95 % | off |\n|---|---|---|---|---|")
    for name, (measure, known, source) in CASES.items():
        found = measure(options.part)
        value = f"{found.value:.4f} +- {found.uncertainty:.4f}"
        off = f"{100 * (found.value / known - 1):+.1f} %"
        print(f"| {name} | {known:.4f} | {source} | {value} | {off} |", flush=True)


if __name__ == "__main__":
    main()

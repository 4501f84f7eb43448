"""A law of nature: on a spline a coasting link keeps its energy, which tells when it is where.

Without drive, friction and weight the kinetic energy E stays. With the place u of P on the track as
the only coordinate, a guide about C at the angle theta(u) and a rigid link with P at its start, at
the distance r(u) from C and its centre of mass c behind,

    2 E = g(u) u'^2,   g = (I_C + I_link + m (r + c)^2) theta_u^2 + m r_u^2,

I_C the guide's inertia about C. So the time at u is an integral of sqrt(g / 2 E), which is smooth
between two knots: Gauss's quadrature span by span gives it to rounding.
"""

from functools import cache
from itertools import product

import numpy as np
import pytest
from physics_tools import scene, where
from scipy.optimize import brentq

from exudyn_flexlink.curves import Spline
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.mechanism import build_mechanism

PIVOT, LINK, SPEED = np.array([0.02, 0.0]), 0.07, 10.0

COASTING = """
materials: {{steel: {{density: 7850, youngs_modulus: 200 GPa}}}}
curves: {{track: {{type: spline, closed: true, points: {points}}}}}
bodies:
  guide: {{type: rod, length: 0.09, material: steel, section: {{width: 20 mm, thickness: 2 mm}}}}
  link: {{type: rod, length: 0.07, material: steel, section: {{width: 10 mm, thickness: 5 mm}}}}
joints:
  crank: {{type: revolute, points: [ground, guide.start], at: [0.02, 0]}}
  sleeve: {{type: sleeve, guide: guide, link: link, clearance: 0}}
  pin: {{type: slot, point: link.start, curve: track}}
initial: {{speeds: {{guide: 10}}}}
run: {{duration: 0.6, sample: 20 ms}}
"""

NODES, WEIGHTS = np.polynomial.legendre.leggauss(20)


def cam(count, digits):
    """Points of r = 0.04 + 0.004 cos 3 a about C, rounded as in a file."""
    a = 2 * np.pi * np.arange(count) / count
    r = 0.04 + 0.004 * np.cos(3 * a)
    return np.round(PIVOT + (r * np.array([np.cos(a), np.sin(a)])).T, digits)


class Truth:
    """Where S is on the way round, by the integral of energy."""

    def __init__(self, points, mechanism):
        self.curve = Spline(points, closed=True)
        guide, link = mechanism.parts
        self.masses = guide.inertia + guide.mass * guide.centre[0] ** 2, link
        self.knots = np.array(self.curve.cubics()[0])
        first, rate, _ = self.curve.derivatives(0.0)
        w = first - PIVOT
        start = SPEED * (w @ w) / (w[0] * rate[1] - w[1] * rate[0])  # u' at time 0
        self.scale = self.slowness(np.array([0.0]))[0] * start
        parts = [self.between(a, b) for a, b in zip(self.knots[:-1], self.knots[1:], strict=True)]
        self.times = np.concatenate([[0.0], np.cumsum(parts)]) / self.scale

    def slowness(self, u):
        """Root of g at places (k,)."""
        place, rate, _ = self.curve.derivatives(u)
        w, (about, link) = place - PIVOT, self.masses
        r = np.hypot(*w.T)
        turn = (w[:, 0] * rate[:, 1] - w[:, 1] * rate[:, 0]) / r**2
        slide = np.sum(w * rate, axis=1) / r
        inertia = about + link.inertia + link.mass * (r + link.centre[0]) ** 2
        return np.sqrt(inertia * turn**2 + link.mass * slide**2)

    def between(self, a, b):
        """Integral of the slowness between two places of one span."""
        half = (b - a) / 2
        return half * WEIGHTS @ self.slowness(np.clip(a + half * (1 + NODES), 0.0, self.knots[-1]))

    @cache  # noqa: B019 - one truth per test
    def place(self, t):
        """S at a time."""
        t %= self.times[-1]
        k = min(int(np.searchsorted(self.times, t, side="right")) - 1, len(self.knots) - 2)
        a, left = self.knots[k], (t - self.times[k]) * self.scale
        u = brentq(lambda u: self.between(a, u) - left, a, self.knots[k + 1] + 1e-12, xtol=1e-15)
        place = self.curve.point(u)
        w = place - PIVOT
        return place + LINK * w / np.hypot(*w)


@pytest.mark.parametrize(("count", "duration"), [(24, 0.6), (1000, 0.06)])
def test_a_link_coasts_along_a_spline_within_its_tolerance(count, duration):
    """Of 1000 points rounded to 1e-6 m nearly each knot ends a step."""
    points = cam(count, 6)
    text = COASTING.format(points=points.tolist())
    truth = Truth(points, build_mechanism(scene(text, "accuracy.tolerance=1e-6")))
    for engine, tolerance in product(("exudyn", "lagrangian"), (1e-3, 1e-6)):
        asked = f"accuracy.tolerance={tolerance}", f"run={{duration: {duration}, sample: 5 ms}}"
        result = simulate(scene(text, *asked), engine)
        assert result.outcome.completed, result.outcome
        some = slice(None, None, 17)  # the truth of a sample takes as long as the run's step
        exact = np.array([truth.place(float(t)) for t in result.time[some]])
        error = np.hypot(*(where(result, "link.end")[some] - exact).T).max()
        assert error < tolerance, (engine, tolerance, result.checks.steps)


def test_a_smooth_curve_through_many_points_costs_no_step_for_each():
    """Knots whose jumps cancel each other count for little."""
    text = COASTING.format(points=cam(1000, 16).tolist())
    for engine in ("exudyn", "lagrangian"):
        assert simulate(scene(text, "accuracy.tolerance=1e-4"), engine).checks.steps < 50

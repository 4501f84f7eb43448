"""Physical truths of hard cases: closed forms, and integrations that no engine takes part in.

A truth is a function of a Result that returns the largest deviation (m) of its watched point.
"""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables import path, watched_point
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene

EXACT = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-15, "dense_output": True}
FREE_STEP = 2e-4  # s: a free flight is looked at so often
MOST_PHASES = 5000


def pressed_back(law: Any, depth: float, rate: float) -> float:
    """Force (N) of a penetration (m) that grows at a rate (m/s): docs/modelling.md."""
    e2 = law.restitution**2
    share = (1 + e2) / 2 + (1 - e2) / 2 * np.tanh(rate / law.transition_speed)
    return float(law.stiffness * max(depth, 0.0) * share)


class Hammer:
    """A point mass on a light arm about O, and an anvil along +x, as one equation of motion.

    A point that is beside the anvil as it passes y = 0 is behind it, and strikes nothing.

    J phi'' = -k_t (phi - phi_0) + m g_y r cos(phi) + sum F_i r_i cos(phi), with the penetration
    -r_i sin(phi) of every point that is over the anvil.
    """

    def __init__(self, scene: Scene) -> None:
        body, anvil = scene.bodies["hammer"], scene.bodies["anvil"]
        arm = body.centre_of_mass[0]
        self.inertia = body.inertia + body.mass * arm**2
        self.weight = body.mass * arm * scene.gravity[1]
        spring = scene.springs.get("return")
        self.spring = (spring.stiffness, spring.rest_angle) if spring else (0.0, 0.0)
        start = scene.joints["base"].at[0]
        self.face = (start, start + anvil.points["end"][0])
        self.points = [
            (body.points[c.point.split(".")[1]][0], c.law) for c in scene.contacts.values()
        ]
        initial = scene.initial
        self.start = (initial.angles["hammer"], dict(initial.speeds).get("hammer", 0.0))
        self.damping = dict(scene.springs)["return"].damping or 0.0 if spring else 0.0

    def over_face(self, phi: float) -> list[bool]:
        """Which points are over the anvil."""
        return [self.face[0] <= r * np.cos(phi) <= self.face[1] for r, _ in self.points]

    def torque(self, phi: float, rate: float, pressed: list[bool]) -> float:
        """All torques about O, N m."""
        stiffness, rest = self.spring
        total = self.weight * np.cos(phi) - stiffness * (phi - rest) - self.damping * rate
        for (r, law), acts in zip(self.points, pressed, strict=True):
            if acts:
                depth, going_in = -r * np.sin(phi), -r * np.cos(phi) * rate
                total += pressed_back(law, depth, going_in) * r * np.cos(phi)
        return float(total)

    def angles(self, time: FloatArray) -> FloatArray:
        """Angle phi (N,) at instants (N,) s."""
        found = np.empty_like(time)
        t, y, end = 0.0, np.array(self.start), float(time[-1])
        for _ in range(MOST_PHASES):
            inside = self._goes_in(y)
            pressed = [inside and over for over in self.over_face(y[0])]
            solved = self._phase(t, y, end, (inside, pressed))
            there = (time >= t) & (time <= solved.t[-1])
            if there.any():
                found[there] = solved.sol(time[there])[0]
            t, y = float(solved.t[-1]), solved.y[:, -1].copy()
            if t >= end:
                return found
            y[0] = 0.0
        raise RuntimeError("the truth of this case chatters without end")

    def _goes_in(self, y: FloatArray) -> bool:
        if y[0] != 0.0:
            return bool(y[0] < 0)
        return bool(
            y[1] < 0 or (y[1] == 0 and self.torque(0.0, 0.0, [False] * len(self.points)) < 0)
        )

    def _phase(self, t: float, y: FloatArray, end: float, state: tuple[bool, list[bool]]):
        inside, pressed = state

        def crosses(_t: float, y: FloatArray) -> float:
            return float(y[0])

        crosses.terminal, crosses.direction = True, 1 if inside else -1

        def rate(_t: float, y: FloatArray) -> tuple[float, float]:
            return y[1], self.torque(y[0], y[1], pressed) / self.inertia

        stiffest = max(law.stiffness * r**2 for r, law in self.points)
        longest = pi * np.sqrt(self.inertia / stiffest) / 8 if any(pressed) else FREE_STEP
        return solve_ivp(rate, (t, end), y, events=crosses, max_step=longest, **EXACT)


def hammer(result: Result) -> float:
    """Largest deviation of the hammer's tip from the one equation of motion, m."""
    model = Hammer(result.scene)
    phi = model.angles(result.time)
    seen = path(result, "hammer.tip").position
    return float(np.abs(seen - np.stack([np.cos(phi), np.sin(phi)], axis=1)).max())


def rigid(result: Result) -> float:
    """Largest deviation of S from C + (r(theta) + l) e(theta), up to the first contact, m."""
    scene = result.scene
    centre = np.array(scene.joints["crank"].at)
    speed = scene.drives["motor"].value
    until = min((e.time for e in result.events if e.kind == "contact begins"), default=np.inf)
    kept = result.time <= until
    theta = dict(scene.initial.angles).get("guide", 0.0) + speed * result.time[kept]
    along = np.stack([np.cos(theta), np.sin(theta)], axis=1)
    seen = path(result, watched_point(scene)).position[kept]
    length = scene.bodies["link"].length
    first = float(np.linalg.norm(seen[0] - centre)) - length
    reach = _reaches(scene, centre, theta, first) + length
    return float(np.abs(seen - centre - reach[:, None] * along).max())


def _reaches(scene: Scene, centre: FloatArray, theta: FloatArray, first: float) -> FloatArray:
    """Distance from C to the track along e(theta), by formula or by search; (N,) m.

    `first` (m) tells on which branch of a track that crosses itself the run begins.
    """
    track = scene.curves["track"]
    if track.type == "ellipse":
        return _to_ellipse(centre, theta, track.semi_axes)
    if track.type == "joined":
        (_, b), radius = track.pieces[0].semi_axes, track.pieces[1].radius
        right = _to_ellipse(centre, theta, (track.pieces[0].semi_axes[0], b))
        left = _to_ellipse(centre, theta, (radius, radius))
        return np.where(centre[0] + right * np.cos(theta) >= 0, right, left)
    return _to_spline(np.array(track.points), centre, theta, first)


def _to_ellipse(centre: FloatArray, theta: FloatArray, axes: tuple[float, float]) -> FloatArray:
    along = np.stack([np.cos(theta), np.sin(theta)], axis=1) / axes
    at = centre / axes
    a, b, c = (along**2).sum(axis=1), along @ at, at @ at - 1
    return (-b + np.sqrt(b**2 - a * c)) / a


def _to_spline(
    points: FloatArray, centre: FloatArray, theta: FloatArray, first: float
) -> FloatArray:
    """Follow the periodic cubic spline by chord length, from the guide's first angle on."""
    closed = np.vstack([points, points[:1]])
    chord = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    spline, period = CubicSpline(chord, closed, bc_type="periodic"), chord[-1]

    def across(u: float, angle: float) -> float:
        x, y = spline(u % period) - centre
        return float(np.cos(angle) * y - np.sin(angle) * x)

    start = centre + first * np.array([np.cos(theta[0]), np.sin(theta[0])])
    grid = np.linspace(0, period, 20_001)
    u = float(grid[np.linalg.norm(spline(grid) - start, axis=1).argmin()])
    found, window = [], 0.02 * period
    for angle in theta:
        u = float(brentq(across, u - window, u + window, args=(angle,), xtol=1e-16))
        found.append(np.linalg.norm(spline(u % period) - centre))
    return np.array(found)


def ellipse_points(count: int, folder: Path) -> Path:
    """Write a CSV file of points, even in the ellipse's parameter, of the paper's ellipse."""
    u = 2 * pi * np.arange(count) / count
    target = folder / f"ellipse_{count}.csv"
    np.savetxt(
        target, np.stack([0.04 * np.cos(u), 0.03 * np.sin(u)], axis=1), "%.17g", ",",
        header="x,y", comments="",
    )  # fmt: skip
    return target

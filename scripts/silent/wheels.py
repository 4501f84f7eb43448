"""Wheels that fall on one another, slip, and roll at last."""

from __future__ import annotations

import numpy as np
from drawing.parts import number, spread, within

from exudyn_flexlink.api.results import Result
from silent.scenes import Case, Rng, asked, joint, rigid


def wheels(rng: Rng) -> list[Case]:
    """A wheel falls on another or into a ring, in either order, or on a floor; at last it rolls."""
    mass, radius, spin = within(rng, 0.3, 3), within(rng, 0.03, 0.15), within(rng, -25, 25)
    floor, side = rng.random() < 0.2, int(rng.choice([-1, 1]))  # 1: it touches from outside
    motor = not floor and rng.random() < 0.5
    wheel = rigid(mass, number(rng.uniform(0.4, 1) * mass * radius**2), rim=radius)
    law = {"stiffness": spread(rng, 1e4, 1e6), "restitution": within(rng, 0, 0.4), "friction": 0.4}
    if floor:  # which counts as a rim of 1 m that has the wheel's mass and speed
        side, rim, speed, under = 1, 1.0, within(rng, -1, 1), mass
    else:
        rim = number(radius * (rng.uniform(0.4, 3) if side > 0 else rng.uniform(1.3, 3)))
        driver = rigid(2, number(rng.uniform(0.8, 2) * rim**2), rim=rim)
        speed = within(rng, -25, 25)
        under = driver["inertia"] / rim
    over = wheel["inertia"] / radius
    # Friction is one force on both rims, so that over w - side under w' is kept; then they roll.
    rolls = speed if motor else (under * speed - side * over * spin) / (under + over * rim / radius)
    ends = -side * rolls * rim / radius, rolls
    slips = abs(ends[0] - spin) * over / (law["friction"] * mass * 9.81)  # s
    high = number(radius + (0 if floor else side * rim) + within(rng, 0, 3e-3))
    model = {
        "bodies": {"wheel": wheel},
        "gravity": [0, -9.81],
        "initial": {"positions": {"wheel": [0, high]}, "speeds": {"wheel": spin}},
        **asked(rng, "wheel.rim", 2 * slips + 0.5, 1e-7),
    }

    def off(result: Result) -> float:
        """Slip and rolling, the latter over the last fifth, of which both ends may be off."""
        of = {name: result.poses[:, k] for k, name in enumerate(result.part_names)}
        turned = of["wheel"][:, 2], of["wheel"][:, 0] if floor else of["driver"][:, 2]
        time, late = result.time, result.time >= 0.8 * result.time[-1]
        kept = over * (turned[0] - spin * time) - side * under * (turned[1] - speed * time)
        found = [0.0 if motor else np.abs(kept).max() / (over / radius + under / rim)]
        for angle, end, r in zip(turned, ends, (radius, rim), strict=True):
            goes = (angle - end * time)[late]
            found.append(r * np.abs(goes - goes[0]).max() / 2)
        return float(max(found))

    if floor:
        model["initial"]["velocities"] = {"wheel": [speed, 0]}
        model["curves"] = {"floor": {"type": "line", "from": [-20, 0], "to": [20, 0]}}
        tread = {"type": "point_on_curve", "point": "wheel.hub", "curve": "floor", "side": "left"}
        tread |= {"radius": radius, "law": law}
        return [Case({**model, "contacts": {"tread": tread}}, off)]
    model["bodies"] |= {"driver": driver, "fork": rigid(1e-3, 1e-3)}
    model["joints"] = {
        "axle": joint("ground", "driver.hub"),
        "up": joint("ground", "fork.hub", 0, 1),
        "head": joint("fork.hub", "wheel.hub"),
    }
    if motor:
        model["drives"] = {"motor": {"type": "speed", "joint": "axle", "value": speed}}
    else:
        model["initial"]["speeds"]["driver"] = speed
    inside = {"inside": True} if side < 0 else {}
    pair = [{"at": "wheel.hub", "radius": radius}, {"at": "driver.hub", "radius": rim, **inside}]
    rims = {"type": "circle_on_circle", "law": law}
    return [
        Case({**model, "contacts": {"rims": {**rims, "circles": both}}}, off)
        for both in (pair, pair[::-1])
    ]

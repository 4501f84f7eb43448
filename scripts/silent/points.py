"""Points and rows as files bring them: repeated, open, in any units, separators and orders."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from drawing.parts import Model, number, spread, within

from exudyn_flexlink.api.results import Result
from exudyn_flexlink.arrays import FloatArray
from silent.closed_forms import Term, open_spline, radius_at
from silent.drives import Body
from silent.scenes import Case, Rng, apart, asked, joint, rigid

FLAWED = 0.8  # share of the scenes of kinds 4 to 6


def cam(rng: Rng, points: FloatArray, given: Model, *more: Any, slack: float = 0.0) -> Case:
    """A cam whose groove, a closed spline through points, lifts a follower in one turn."""
    speed = within(rng, 2, 10)
    model = {
        "curves": {"groove": {"type": "spline", "on": "cam", **given}},
        "bodies": {"cam": rigid(1, 1e-3), "follower": rigid(0.1, 1e-4)},
        "joints": {
            "shaft": joint("ground", "cam.hub"),
            "way": joint("ground", "follower.hub", 0, 1),
            "pin": {"type": "slot", "point": "follower.hub", "curve": "groove"},
        },
        "drives": {"motor": {"type": "speed", "joint": "shaft", "value": speed}},
        "initial": {"positions": {"follower": points[len(points) // 2].tolist()}},
        **asked(rng, "follower.hub", 2 * np.pi / speed, 1e-7),
    }

    def off(result: Result) -> float:
        high = radius_at(points, np.pi / 2 - speed * result.time)
        return max(apart(result, 0.0 * high, high) - slack, 0.0)

    return Case(model, off, *more)


def lobe(rng: Rng) -> FloatArray:
    """Points (n, 2) of a cam with a lobe; the middle one is straight above the hub."""
    count, radius = int(rng.integers(10, 40)), within(rng, 0.02, 0.1)
    around = 2 * np.pi * (np.arange(count) - count // 2) / count
    far = radius * (1 + 0.15 * np.cos(around + rng.uniform(0, 6)))
    return np.column_stack([-far * np.sin(around), far * np.cos(around)])


def repeats(rng: Rng) -> list[Case]:
    """A cam through points of which one stands there a second time, nearly: the last, or any."""
    points, flawed = lobe(rng), bool(rng.random() < FLAWED)
    if not flawed:
        return [cam(rng, points, {"points": points.tolist()})]
    k, away = int(rng.integers(len(points)) * rng.integers(2)), rng.uniform(-np.pi, np.pi)
    gap = np.linalg.norm(points[k] - points[k - 1]) * 10 ** rng.uniform(-7, -2)
    near = points[k] + gap * np.array([np.cos(away), np.sin(away)])
    given = np.insert(points, k or len(points), near, axis=0).tolist()
    return [cam(rng, points, {"points": given}, "", flawed, slack=float(gap))]


def arcs(rng: Rng) -> list[Case]:
    """A bead on points of an arc, whose ends are four chords apart, without `closed`."""
    count, radius, start = int(rng.integers(6, 40)), within(rng, 0.03, 0.2), rng.uniform(0, 6)
    half, chords = rng.uniform(0.3, np.pi * (1 - 4 / (count + 3))), rng.uniform(0.7, 1.3, count - 1)
    around = half * (2 * np.append(0, np.cumsum(chords)) / chords.sum() - 1)
    points = radius * np.column_stack([np.cos(start + around), np.sin(start + around)])
    slack = np.abs(np.linalg.norm(open_spline(points), axis=1) - radius).max()
    flawed, speed, first = bool(rng.random() < FLAWED), within(rng, 0.1, 1), count // 2
    end = (half - around[first]) * radius / speed * rng.uniform(0.4, 1.6 if flawed else 0.9)
    track = {"type": "spline", "points": points.tolist()}
    model = {
        "curves": {"track": track if flawed else {**track, "closed": False}},
        "bodies": {"bead": rigid(1, 1)},
        "joints": {"pin": {"type": "slot", "point": "bead.hub", "curve": "track"}},
        "initial": {
            "positions": {"bead": points[first].tolist()},
            "speeds_along": {"pin": speed},
        },
        **asked(rng, "bead.hub", end, 1e-7),
    }

    def off(result: Result) -> float:
        x, y = result.path("bead.hub").position.T
        angle = np.mod(np.arctan2(y, x) - start + np.pi, 2 * np.pi) - np.pi
        beside = np.abs(np.hypot(x, y) - radius).max() - slack
        return max(beside, radius * (np.abs(angle).max() - half), 0.0)

    return [Case(model, off, flawed=flawed)]


RPM, DEG, INCH, POUND = np.pi / 30, np.pi / 180, 0.0254, 4.4482216152605  # in SI; POUND a force
TIMES = {"t [s]": 1, "time": 1, "t (ms)": 1e-3, "t (msec)": 1e-3, "time_ms": 1e-3, "t [min]": 60}
TURNS = ("n [rpm]", "n [RPM]", "n (rev/min)", "n [U/min]", "n [min-1]", "n_rpm")
SPEEDS = dict.fromkeys(TURNS, RPM) | {
    "w (deg/s)": DEG,
    "w [degrees/s]": DEG,
    "w [rad/s]": 1,
    "w": 1,
}
TORQUES = {"M [N mm]": 1e-3, "M (kN m)": 1e3, "M [lb-ft]": POUND * 12 * INCH, "M_Nmm": 1e-3, "M": 1}
ANGLES = {"phi [deg]": DEG, "phi [degrees]": DEG, "angle_deg": DEG, "phi [°]": DEG, "phi": 1}
LENGTHS = {"{}_mm": 1e-3, "{} (mm)": 1e-3, "{} [mm]": 1e-3, "{} [in]": INCH, "{}": 1, "{} [m]": 1}


def tables(rng: Rng) -> list[Case]:
    """A table of a drive, or points of a cam, in a file of any units, separators and orders."""
    flawed = bool(rng.random() < FLAWED)
    kind = str(rng.choice(["speed", "torque", "motion", "points"]))

    def unit(units: dict[str, float]) -> tuple[str, float]:
        names = [name for name, factor in units.items() if flawed or factor == 1]
        return (name := str(rng.choice(names))), units[name]

    if kind == "points":
        points, (name, factor) = lobe(rng), unit(LENGTHS)
        names, given = [name.format("x"), name.format("y")], np.round(points / factor, 7)
        points = given * factor
        if flawed and rng.random() < 0.25:
            (x, y), turn = points.T, 1 if name == "{}" else DEG
            names = ["theta" if name == "{}" else "theta [deg]", name.format("r")]
            given = np.column_stack([np.arctan2(y, x) / turn, np.hypot(x, y) / factor])
        return [cam(rng, points, {"file": "rows.csv"}, _file(rng, names, given, flawed), flawed)]
    units = {"speed": SPEEDS, "torque": TORQUES, "motion": ANGLES}[kind]
    (of_time, second), (name, factor) = unit(TIMES), unit(units)
    body, count = Body(True, spread(rng, 0.1, 10), within(rng, 0.05, 0.5)), int(rng.integers(4, 9))
    step, values = number(rng.uniform(0.1, 0.4) / second), rng.uniform(-20, 20, count)
    if kind != "speed":
        values = values * 0.1 * body.size if kind == "torque" else 0.3 * np.arange(count)
    given = np.column_stack([step * np.arange(count), values / factor])
    terms = [Term("hat", t, step * second, value) for t, value in given * (second, factor)]

    def motion(time: FloatArray) -> FloatArray:
        if kind == "motion":  # a cubic spline through points of a line is that line
            return np.interp(time, given[:, 0] * second, values)
        moved = sum(one.integral(time, 1 if kind == "speed" else 2) for one in terms)
        return np.asarray(moved if kind == "speed" else moved / body.size)

    rule = "cubic" if kind == "motion" else "linear"
    model = body.driven(kind, {"file": "rows.csv", "rule": rule})
    model |= asked(rng, "body.tip", 0.98 * given[-1, 0] * second, 1e-7)
    rows = _file(rng, [of_time, name], given, flawed)
    return [Case(model, partial(body.off, motion), rows, flawed)]


def _file(rng: Rng, names: list[str], given: FloatArray, flawed: bool) -> str:
    """Write rows under a header; flawed ones by any separators, commas and orders of columns."""
    between, order = ",", [0, 1]
    if flawed:
        between = str(rng.choice([",", ",", ";", "\t", " "]))
        order = order[:: rng.choice([1, 1, -1])]
    head = [names[k].replace(" ", "" if between == " " else " ") for k in order]
    lines = [between.join(repr(float(row[k])) for k in order) for row in given]
    if between in ";\t" and rng.random() < 0.5:
        lines = [line.replace(".", ",") for line in lines]
    return "\n".join([rng.choice(["", "# "]) + between.join(head), *lines, ""])

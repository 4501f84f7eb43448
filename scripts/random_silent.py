"""Random scenes of six kinds that once went wrong without a word, against closed forms.

Usage: .venv/bin/python scripts/random_silent.py --kinds 1 2 --count 50 --seed 7
Kinds: short pulses in drives by time (1); drives that bend with the state, over three lengths of
run (2); wheels on and in each other, in either order (3); tracks through points of which two nearly
repeat (4); open rows of points without `closed` (5); files of any units, separators and order (6).
A fifth of kinds 4 to 6 has no such flaw, and may not be refused. A scene's number is 10000 times
its kind, and a count. Silent is what is off by more than its tolerance and neither warns nor stops.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from string import Template
from typing import Any, NamedTuple

import numpy as np
from benchmarks.side_by_side import add_numbers, judged
from benchmarks.verdicts import CRASHED, LATE, REFUSED, RIGHT, SILENT, TOLD, Verdict, of_file, table
from drawing.parts import number, spread, within
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from exudyn_flexlink import load_scene, simulate

Rng = np.random.Generator
DOUBTED, NEEDLESS = "right, and warned", "refused, no flaw"
VERDICTS = (RIGHT, DOUBTED, TOLD, REFUSED, LATE, NEEDLESS, SILENT, CRASHED)  # the worst is last
EXACTLY = {"rtol": 1e-13, "atol": 1e-16, "dense_output": True}
HEAD = "title: a\noutputs: {watch: $at}\nrun: {duration: $end}\naccuracy: {tolerance: $tolerance}\n"
BODY = """
bodies: {body: {type: rigid, mass: $size, inertia: $size, points: {hub: [0, 0], tip: [0.3, 0]}}}
joints: {way: {type: $joint, points: [ground, body.hub], at: [0, 0]}}
drives: {drive: {type: $drive}}
initial: {$initial}
solver: {formulation: $formulation}
"""
WHEELS = """bodies:
  wheel: {type: rigid, mass: 1, inertia: $inertia, points: {hub: [0, 0]}}
  driver: {type: rigid, mass: 1, inertia: $other, points: {hub: [0, 0]}}
  fork: {type: rigid, mass: 1e-3, inertia: 1e-3, points: {hub: [0, 0]}}
joints:
  axle: {type: revolute, points: [ground, driver.hub], at: [0, 0]}
  up: {type: prismatic, axis: [0, 1], points: [ground, fork.hub], at: [0, 0]}
  head: {type: revolute, points: [fork.hub, wheel.hub]}
contacts: {rims: {type: circle_on_circle, circles: [$pair], law: {$law}}}
gravity: [0, -9.81]
initial: {positions: {wheel: [0, $high]}, speeds: {wheel: $spin, driver: $speed}}
"""
BEAD = """curves: {track: {type: spline, $given}}
bodies: {bead: {type: rigid, mass: 1, inertia: 1, points: {hub: [0, 0]}}}
joints: {pin: {type: slot, point: bead.hub, curve: track}}
initial: {positions: {bead: $first}, speeds_along: {pin: $speed}}
"""
PULSES = (
    "max(0, 1-abs((t-{a})/{b}))",
    "exp(-((t-{a})/{b})**2)",
    "where(t-{a} < -{b}, 0, where(t-{a} < {b}, 1, 0))",
)
LARGE = ("sin(t/{b})", "exp(-t/{b})", "1")
NAMES = {"exp": np.exp, "sin": np.sin, "where": lambda c, a, b: a if c else b}
BENDS = (  # k, s: stiffnesses; c: damper; g, n: gaps; x, v: how far out, how fast
    "{k}*min(0, {g}-{x})-{s}*min(0, {x}+{n})",
    "-{k}*({x}-max(-{g}, min({g}, {x})))",
    "-{k}*{x}-{s}*abs({x}-{g})",
    "-{s}*max(0, {x}-{n})-{k}*max(0, {x}-{g})+{k}*max(0, -{n}-{x})+{s}*max(0, -{g}-{x})",
    "-{k}*{x}-{c}*({v}+abs({v}))/2-{k}*max(0, {x}-{g})",
)
TURNS = ("n [rpm]", "n [RPM]", "n (rev/min)", "n [U/min]", "n [min-1]", "n_rpm")
UNITS = {
    "time": {"t [s]": 1, "time": 1, "t (ms)": 1e-3, "t (msec)": 1e-3, "time_ms": 1e-3, "t": 1},
    "speed": dict.fromkeys(TURNS, np.pi / 30) | {"w [degrees/s]": np.pi / 180, "w": 1},
    "torque": {"M [N mm]": 1e-3, "M (kN m)": 1e3, "M [lb-ft]": 4.4482216152605 * 0.3048, "M": 1},
    "points": {"_mm": 1e-3, " (mm)": 1e-3, " [mm]": 1e-3, " [in]": 0.0254, "": 1},
}


class Case(NamedTuple):
    """A model file, with a CSV file beside it; how far off a result is; whether it has a flaw."""

    model: str
    off: Callable[[Any], float]  # m
    flaw: bool = False
    rows: str = ""


def written(template: str, at: str, right: Any, slack: float = 0.0, **names: Any) -> Case:
    """Write a model file; `right` gives complex places (n,), m, of a point `at` times (n,), s."""
    away = lambda result: np.abs(result.path(at).position @ (1, 1j) - right(result.time)).max()  # noqa: E731
    model = Template(HEAD + template).substitute(names, at=at)
    return Case(model, lambda result: max(float(away(result)) - slack, 0.0))


def exact(rates: Callable, start: Sequence[float], end: float, knots: Sequence[float]) -> Callable:
    """Return y[0] by times (n,) of y' = rates(t, *y), which may jump or bend at knots (s)."""
    pieces, y, inner = [], np.array(start), sorted({knot for knot in knots if 0 < knot < end})
    for begin, stop in pairwise([0.0, *inner, end]):
        ends = np.nextafter((begin, stop), (stop, begin))  # between jumps
        run = solve_ivp(lambda t, y: rates(t, *y), ends, y, "DOP853", **EXACTLY)
        pieces, y = [*pieces, run.sol], run.y[:, -1]
    return np.vectorize(lambda t: pieces[np.searchsorted(inner, t)](t)[0])


def body(kind: str, text: str, knots: Any = (), value: Any = None, **names: Any) -> Case:
    """Drive a body that turns about O or slides along the x-axis, by a formula without `value`."""
    if value is None:
        code, text = compile(text.replace("(way)", ""), text, "eval"), f'"{text}"'
        value = lambda t, x, v: eval(code, NAMES, {"t": t, "place": x, "angle": x, "speed": v})  # noqa: E731
    names = {"x": 0.0, "size": 1.0, "formulation": "minimal", **names}
    x, size, rated, turns = names["x"], names["size"], kind == "speed", kind != "force"
    names |= {"joint": "prismatic, axis: [1, 0]", "initial": f"along: {{way: {x}}}"}
    drive = f"force, point: body.hub, value: [{text}, 0]"
    if turns:
        names |= {"joint": "revolute", "initial": f"angles: {{body: {x}}}"}
        drive = f"{kind}, joint: way, value: {text}"
    rates = lambda t, x, v=0.0: [value(t, x, v)] if rated else [v, value(t, x, v) / size]  # noqa: E731
    moved = exact(rates, [x] if rated else [x, 0.0], names["end"], knots)
    tip = lambda t: 0.3 * np.exp(1j * moved(t)) if turns else 0.3 + moved(t)  # noqa: E731
    return written(BODY, "body.tip", tip, drive=drive, **names)


def pulses(rng: Rng) -> list[Case]:
    """One to four pulses of 1 us to 10 ms beside what moves much more, in a value of time."""
    kind = str(rng.choice(["force", "torque", "speed", "spring"]))
    pushes, tabled = kind in ("force", "torque"), kind != "spring" and rng.random() < 0.2
    least, formulation = (1e-6, "redundant") if rng.random() < 0.15 else (1e-8, "minimal")
    size, end, tolerance = spread(rng, 0.1, 10), within(rng, 0.2, 3), spread(rng, least, 1e-5)
    names = {"size": size, "end": end, "formulation": formulation, "tolerance": tolerance}
    moves = {"spring": (1000 * size) ** -0.5, "speed": 0.3}.get(kind, end / 2 / size)  # m
    terms = [(10 ** rng.uniform(-1, 1.5), 0.0, within(rng, 0.05 * end, end))]
    for _ in range(rng.choice([1, 1, 2, 4])):
        by = rng.choice([-1, 1]) * tolerance * 10 ** rng.uniform(-0.5, 3)
        terms.append((by, within(rng, 0.02 * end, 0.98 * end), spread(rng, 1e-6, 1e-2)))
    terms = [(number(by / moves / b), a, b) for by, a, b in terms]
    knots = [a + s * b for _, a, b in terms for s in (-20, -6, -1, 0, 1, 6, 20)] + [terms[0][2]]
    if tabled:
        knots = np.unique([0.0, end, *(a + side * b for _, a, b in terms for side in (-1, 0, 1))])
        high = sum(c * np.maximum(0, 1 - np.abs(knots - a) / b) for c, a, b in terms)
        text = f"{{points: {np.column_stack([knots, high]).tolist()}, rule: linear}}"
        return [body(kind, text, knots, lambda t, *_: np.interp(t, knots, high), **names)]
    shapes = [rng.choice(LARGE), *rng.choice(PULSES[: 2 + pushes], len(terms) - 1)]
    each = [f"{c:+}*" + shapes[k].format(a=a, b=b) for k, (c, a, b) in enumerate(terms)]
    large, few, (high, _, part) = each[0], "".join(each[1:]), terms[0]
    forms = f"{few}{large}", f"{large}*(1+({few})/{high})", f"where(t < {part}, {large}, {few})"
    text = forms[rng.integers(2 + pushes)] + ("-1000*place(way)" if kind == "spring" else "")
    return [body(kind.replace("spring", "force"), text, knots, **names)]


def kinks(rng: Rng) -> list[Case]:
    """A force or a torque that bends with the state some 10 to 300 times, over three runs."""
    kind, out = [("force", "place(way)"), ("torque", "angle(way)")][rng.integers(2)]
    size, w, g = spread(rng, 0.1, 5), spread(rng, 20, 600), spread(rng, 1e-3, 0.1)
    k, n = number(size * w**2), number(g * rng.uniform(0.3, 3))
    of = {"s": number(k * rng.uniform(0.05, 0.9)), "c": number(size * w * 0.05), "v": "speed(way)"}
    text = str(rng.choice(BENDS)).format(k=k, g=g, n=n, x=out, **of)
    names = {"x": number((g + n) * rng.uniform(1.1, 2)), "size": size}
    names["tolerance"], end = spread(rng, 1e-8, 1e-5), min(3.0, spread(rng, 10, 300) * 2 / w)
    return [body(kind, text, end=number(end * part), **names) for part in (1.0, 0.83, 0.61)]


def circles(rng: Rng) -> list[Case]:
    """A wheel falls on another or into a ring, in either order; it slips, and rolls at last."""
    radius, (spin, speed) = within(rng, 0.03, 0.15), rng.uniform(-25, 25, 2).tolist()
    side = int(rng.choice([-1, 1]))  # -1: in a ring
    rim = number(radius * (rng.uniform(0.4, 3) if side > 0 else rng.uniform(1.3, 3)))
    # Friction is one force on both rims, so that radius spin - side rim speed is kept.
    rolls = (rim * speed - side * radius * spin) / (2 * rim)
    ends = -side * rolls * rim / radius, rolls
    slips = abs(ends[0] - spin) * radius / (2 * 0.4 * 9.81)  # s

    def off(result: Any) -> float:  # over the last fifth, of which both ends may be off
        late, names = result.time >= 0.8 * result.time[-1], list(result.part_names)
        turned = result.poses[late][:, [names.index("wheel"), names.index("driver")], 2]
        return float(max((radius, rim) * np.ptp(turned - np.outer(result.time[late], ends), 0)) / 2)

    law = f"stiffness: {spread(rng, 1e4, 1e6)}, restitution: {within(rng, 0, 0.4)}, friction: 0.4"
    names = {"spin": spin, "speed": speed, "high": number(radius + side * rim + 0.002), "law": law}
    names |= {"inertia": radius**2 / 2, "other": rim**2 / 2, "tolerance": spread(rng, 1e-7, 1e-5)}
    one = f"{{at: wheel.hub, radius: {radius}}}"
    other = f"{{at: driver.hub, radius: {rim}{', inside: true' if side < 0 else ''}}}"
    pairs, names["end"] = (f"{one}, {other}", f"{other}, {one}"), 2 * slips + 0.5
    cases = (written(WHEELS, "wheel.hub", None, pair=pair, **names) for pair in pairs)
    return [case._replace(off=off) for case in cases]


def bead(rng: Rng, points: np.ndarray, given: str, closed: bool = True, slack: float = 0.0) -> Case:
    """A bead at one speed on the spline through points (n, 2), from the middle one on."""
    through, first = np.vstack([points, points[: int(closed)]]), len(points) // 2
    along = np.append(0, np.cumsum(np.linalg.norm(np.diff(through, axis=0), axis=1)))
    spline = CubicSpline(along, through @ (1, 1j), bc_type="periodic" if closed else "not-a-knot")
    slope, speed = spline.derivative(), within(rng, 0.1, 1)
    end = number((along[-1] - along[first]) / speed * rng.uniform(0.4, 0.9))
    moved = exact(lambda _, u: [speed / abs(slope(u))], [along[first]], end, ())
    names = {"first": points[first].tolist(), "speed": speed, "tolerance": spread(rng, 1e-7, 1e-5)}
    names |= {"given": given, "end": end}
    return written(BEAD, "bead.hub", lambda t: spline(moved(t)), slack, **names)


def lobe(rng: Rng, turn: float = 2 * np.pi) -> np.ndarray:
    """Points (n, 2) of a track with a lobe, of a whole turn or less."""
    count, radius = int(rng.integers(10, 40)), within(rng, 0.02, 0.2)
    around = turn * np.arange(count) / count
    radii = radius * (1 + 0.15 * np.cos(around + rng.uniform(0, 6)))
    return np.column_stack([radii * np.cos(around), radii * np.sin(around)])


def repeats(rng: Rng) -> list[Case]:
    """A track through points of which one stands there a second time, nearly: the last, or any."""
    points, flaw = lobe(rng), bool(rng.random() < 0.8)
    k, gap = int(rng.integers(len(points)) * rng.integers(2)), rng.normal(0, 1, 2)
    gap *= flaw * np.linalg.norm(points[k] - points[k - 1]) * 10 ** rng.uniform(-7, -2)
    given = np.insert(points, k or len(points), points[k] + gap, axis=0) if flaw else points
    case = bead(rng, points, f"points: {given.tolist()}", slack=4 * float(np.hypot(*gap)))
    return [case._replace(flaw=flaw)]


def arcs(rng: Rng) -> list[Case]:
    """An open row of points, whose ends are four chords apart or more, without `closed`."""
    points, flaw = lobe(rng, rng.uniform(0.6, 4.5)), bool(rng.random() < 0.8)
    given = f"points: {points.tolist()}" + ("" if flaw else ", closed: false")
    return [bead(rng, points, given, closed=False)._replace(flaw=flaw)]


def tables(rng: Rng) -> list[Case]:
    """A table of a drive, or points of a track, in a file of any units, separators and orders."""
    kind, flaw = str(rng.choice(["speed", "torque", "points"])), bool(rng.random() < 0.8)
    named = [list(UNITS[of].items()) for of in ("time", kind)]
    (clock, second), (head, unit) = (of[rng.integers(len(of)) if flaw else -1] for of in named)
    if kind == "points":
        heads, given = ["x" + head, "y" + head], lobe(rng) / unit
        case = bead(rng, given * unit, "file: rows.csv")
    else:
        heads, count = [clock, head], int(rng.integers(4, 9))
        knots, values = rng.uniform(0.1, 0.4) * np.arange(count), rng.uniform(-20, 20, count)
        given = np.column_stack([knots / second, values / unit])
        names = {"end": number(0.98 * knots[-1]), "tolerance": spread(rng, 1e-7, 1e-5)}
        value = lambda t, *_: np.interp(t, knots, values)  # noqa: E731
        case = body(kind, "{file: rows.csv, rule: linear}", knots, value, **names)
    between = str(rng.choice([",", ";", "\t"])) if flaw else ","
    order = [1, 0] if flaw and rng.random() < 0.3 else [0, 1]
    lines = [[heads[k] for k in order], *([repr(float(row[k])) for k in order] for row in given)]
    rows = "\n".join([*map(between.join, lines), ""])
    return [case._replace(flaw=flaw, rows=rows if between == "," else rows.replace(".", ","))]


KINDS = (pulses, kinks, circles, repeats, arcs, tables)


def drawn(scene: int, seed: int) -> list[Case]:
    """Draw the runs of a scene by its number."""
    return KINDS[scene // 10_000 - 1](np.random.default_rng([seed, scene]))


def judge(case: Case, family: str = "", measure: bool = True) -> Verdict:
    """Run a case, and hold it against its closed form."""

    def verdict(path: Any) -> Verdict:
        result = simulate(load_scene(path), measure=measure)
        off, ended = case.off(result) / result.scene.accuracy.tolerance, result.outcome
        said = [one for one in result.warnings if not one.startswith("samples are")]  # of figures
        told = "; ".join(said if ended.completed else [ended.ending, *said])
        return Verdict(family, ((DOUBTED, TOLD) if told else (RIGHT, SILENT))[off > 1], off, told)

    one = of_file(case.model, family, 60.0, verdict, case.rows)
    return replace(one, kind=NEEDLESS) if one.kind == REFUSED and not case.flaw else one


def worst(scene: int, seed: int, measure: bool = True) -> Verdict:
    """Judge a scene by its number: the worst of its runs counts."""
    each = (judge(own, KINDS[scene // 10_000 - 1].__name__, measure) for own in drawn(scene, seed))
    return max(each, key=lambda one: (VERDICTS.index(one.kind), one.off))


def main() -> int:
    """Print the scenes that are wrong, and a table of all verdicts."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    add_numbers(parser, 200)
    parser.add_argument("--kinds", type=int, nargs="+", default=range(1, len(KINDS) + 1))
    options = parser.parse_args()
    counts = {kind: round(options.count * (1.0 if kind < 3 else 0.3)) for kind in options.kinds}
    numbers = [10_000 * kind + k for kind, count in counts.items() for k in range(count)]
    if options.only is not None:
        numbers = [options.only]
        print(*(case.model + case.rows for case in drawn(options.only, options.seed)), sep="\n")
    judged_one = partial(worst, seed=options.seed, measure=options.measure)
    found = dict(judged(judged_one, numbers, options.jobs))
    for scene, one in found.items():
        if VERDICTS.index(one.kind) >= VERDICTS.index(LATE):
            print(f"{scene} of seed {options.seed}, {one.kind}: {one.off:.2g}; {one.told}")
    families, largest = [draw.__name__ for draw in KINDS], "largest of those not told"
    print(*table(list(found.values()), families, VERDICTS, (RIGHT, SILENT), largest), sep="\n")
    return int(any(one.kind in (NEEDLESS, SILENT, CRASHED) for one in found.values()))


if __name__ == "__main__":
    raise SystemExit(main())

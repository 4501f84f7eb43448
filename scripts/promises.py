"""Measure the claims of docs/accuracy_measured.md against independent answers, print its table.

Usage:
  .venv/bin/python scripts/promises.py               everything, some five minutes
  .venv/bin/python scripts/promises.py --quick       without the parts that take long
  .venv/bin/python scripts/promises.py --only peaks  one part, or some

Where a series of tests/data judges, its own uncertainty is part of what is promised. Times are of
the processor, for a whole run.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from time import process_time

import numpy as np
from benchmarks.lever_tip import tip_apart
from benchmarks.series import FromSeries, deviation, read_series

from exudyn_flexlink.chain import euler_bernoulli_cantilever
from exudyn_flexlink.comparison import compare
from exudyn_flexlink.curves import ray_crossings
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene, scene_of
from exudyn_flexlink.mechanism import beam_of, build_mechanism
from exudyn_flexlink.observables import (
    State,
    contact_states,
    crank_angle,
    lever_response,
    path,
    strikes,
    strongest_line,
)
from exudyn_flexlink.result import Result
from exudyn_flexlink.source import parse_document

ROOT = Path(__file__).parent.parent
MODELS, DATA = ROOT / "models", ROOT / "tests" / "data"
BEAM = "bodies.link.hinges.stiffness=beam"
LEVER = 0.03  # m, its length
TIGHT = 1e-8  # m: tolerance of the tight runs
JUDGE = 1e-11  # m: of the Lagrangian that judges them
REDUNDANT = ("solver.formulation=redundant", "accuracy.tolerance=4e-5")
TIGHT_WALLS = 1e-6  # m

Row = tuple[str, str, str]
"""What was measured, what was promised, what it is."""

CASES = {
    "smooth_n10_beam": ("smooth.yaml", ()),
    "strike_n5_beam": ("no_clearance.yaml", (BEAM, "bodies.link.rods=5")),
    "strike_n10_beam": ("no_clearance.yaml", (BEAM,)),
    "strike_n10_paper": ("no_clearance.yaml", ()),
}
WITH_CLEARANCE = {
    "clearance_n5_beam": ("clearance.yaml", (BEAM, "bodies.link.rods=5"), 0.15),
    "clearance_n10_paper": ("clearance.yaml", (), 0.42),
}
PEAKS = {
    "strike_n5_beam": (-0.35792, 0.26101),
    "strike_n10_beam": (-0.34439, 0.25115),
    "strike_n10_paper": (-0.16300, 0.11887),
}
LIMITS = {  # twice the uncertainty in the header of each series, and not below 1e-9 m
    "smooth_n10_beam": 1e-9,
    "strike_n5_beam": 2.4e-7,
    "strike_n10_beam": 1.7e-7,
    "strike_n10_paper": 2.6e-7,
}
CANTILEVER = {  # deviation of the first frequency from Euler-Bernoulli, computed from the rods
    ("equal", 4): 0.331,
    ("equal", 8): 0.142,
    ("half_ends", 4): 0.0145,
    ("half_ends", 8): 0.0036,
}
RING_DOWN = """
title: A flexible link welded to the ground, released under its weight
materials: {{steel: {{density: 7850, youngs_modulus: 200 GPa}}}}
bodies:
  link:
    type: flexible
    length: 0.07
    material: steel
    section: {{width: 10 mm, thickness: 0.5 mm}}
    rods: {rods}
    layout: {layout}
    hinges: {{stiffness: beam}}
joints:
  clamp: {{type: weld, points: [ground, link.start], at: [0, 0]}}
gravity: [0, -9.81]
run: {{duration: 0.1, sample: 0.1 ms}}
accuracy: {{tolerance: 1.0e-7}}
"""


@cache
def warm(model: str, engine: str) -> None:
    """Run a moment of a model: what has to be imported costs nothing afterwards."""
    simulate(load_scene(MODELS / model, ["run.turns=0.01"]), engine)


@cache
def run(model: str, *settings: str, engine: str = "exudyn") -> Result:
    """Simulate a shipped model with settings, and note the processor time of all of it."""
    scene = load_scene(MODELS / model, settings)
    warm(model, engine)
    began = process_time()
    result = simulate(scene, engine)
    return replace(result, timings={**result.timings, "processor": process_time() - began})


def case(name: str, *settings: str, engine: str = "exudyn") -> Result:
    """Simulate two turns of a scene that there is a series of."""
    model, own = CASES[name]
    return run(model, "run.turns=2", "run.sample=1 ms", *own, *settings, engine=engine)


def within(tolerance: float) -> str:
    """Return the setting of a tolerance, m."""
    return f"accuracy.tolerance={tolerance}"


def off(point: float, tip: float, result: Result) -> str:
    """Say how far (m) S and, where there is one, the lever's tip are off, and what that took."""
    told = f", tip {tip:.1e} m" if result.scene.contacts else ""
    return f"{point:.1e} m{told} ({cost(result)})"


def off_series(name: str, result: Result) -> str:
    """Say how far a run is off the independent series."""
    found = against_series(name, result)
    return off(found.largest, LEVER * found.largest_angle, result)


def off_run(result: Result, judge: Result) -> str:
    """Say how far a run is off another."""
    found = compare(result, judge)
    return off(found.deviation.largest, tip_apart(found), result)


def cost(result: Result) -> str:
    """Say how many steps a run took, and how long."""
    return f"{result.checks.steps} steps, {result.timings['processor']:.1f} s"


def against_series(name: str, result: Result) -> FromSeries:
    """Hold a run against the independent series."""
    series = read_series(DATA / f"{name}.csv")
    return deviation(result, series.time, series.position, series.lever_angle)


def reference(*settings: str) -> Iterator[Row]:
    """Deviation of S and the lever from the independent series, over two turns."""
    for name in CASES:
        result = case(name, *settings)
        tolerance = result.settings.integrator.tolerance
        what = f"S of `{name}`, {result.settings.formulation}, tolerance {tolerance:.0e} m"
        limit = f"{tolerance + LIMITS[name]:.1e} m"
        yield what, limit, off_series(name, result)


def peaks() -> Iterator[Row]:
    """Extremes of the lever's angle over two turns."""
    for name, (least, greatest) in PEAKS.items():
        model, own = CASES[name]
        result = run(model, "run.turns=2", "run.sample=0.1 ms", *own)
        seen = lever_response(result, "strike")
        measured = f"{seen.least[0]:.5f}, {seen.greatest[0]:.5f} rad"
        yield f"lever's extremes, `{name}`", f"{least:.5f}, {greatest:.5f} rad", measured


def laps() -> Iterator[Row]:
    """Which laps strike, and whether the lever rests again before the next strike."""
    result = run("no_clearance.yaml")
    found = strikes(result, "strike")
    yield "laps with a strike, of four", "1, 3", ", ".join(str(s.lap) for s in found)
    (begin, end), lever = (s.begin for s in found), lever_response(result, "strike")
    last = lever.between(end - 0.05 * (end - begin), end)
    rest = abs(last.farthest / lever.between(begin, end).farthest)
    yield "lever before the next strike, of its peak", "at rest", f"{rest:.1e}"


def rigid_link() -> Iterator[Row]:
    """S of the rigid link against its closed form, over 20 turns."""
    text = (MODELS / "rigid.yaml").read_text(encoding="utf-8")
    smooth = text[: text.index("contacts:")] + text[text.index("run:") :]
    scene = scene_of(parse_document(smooth, "rigid.yaml"), ["run.turns=20", "run.sample=5 ms"])
    result = simulate(scene)
    slot = build_mechanism(scene).slots[0]
    crank = np.array([0.02, 0.0])
    theta, u, expected = crank_angle(result), 0.0, []
    for angle in theta:
        along = np.array([np.cos(angle), np.sin(angle)])
        crossings = ray_crossings(slot.curve, crank, along)
        crossings += slot.curve.period * np.round((u - crossings) / slot.curve.period)
        u = crossings[np.argmin(np.abs(crossings - u))]
        expected.append(slot.curve.point(u) + 0.07 * along)
    away = np.linalg.norm(path(result, "link.end").position - np.array(expected), axis=1).max()
    at = f"tolerance {result.settings.integrator.tolerance:.0e} m"
    yield f"S of the rigid link, 20 turns, {at}, against the closed form", "1e-9 m", f"{away:.1e} m"
    held = run("smooth.yaml", "run.turns=20", *REDUNDANT).checks.constraint_error
    what = "redundant, 20 turns: P off its track, rod 1 off the guide's axis"
    yield what, "1e-9 m", f"{held:.1e} m"


def long_runs() -> Iterator[Row]:
    """Deviation of S and the lever from the Lagrangian at shipped tolerances, over 20 turns."""
    for model in ("smooth.yaml", "no_clearance.yaml"):
        settings = (model, "run.turns=20", "run.sample=1 ms")
        judge = run(*settings, within(JUDGE), engine="lagrangian")
        result = run(*settings)
        limit = f"{result.settings.integrator.tolerance:.0e} m"
        at = f"{result.settings.formulation}, tolerance {limit}"
        what = f"S of `{model}`, 20 turns, {at}, against the Lagrangian"
        yield what, limit, off_run(result, judge)


def order() -> Iterator[Row]:
    """Error of S in the smooth scene at a step and at half of it, by `redundant`."""
    name = "smooth_n10_beam"
    runs = [case(name, f"accuracy.step={step}") for step in (4e-4, 2e-4, 1e-4)]
    errors = [against_series(name, result).rms for result in runs]
    ratios = ", ".join(f"{a / b:.2f}" for a, b in pairwise(errors))
    yield "redundant: error of S (rms, smooth) over that at half the step", "about 4", ratios


def energy() -> Iterator[Row]:
    """Energy balance of the undamped smooth scene."""
    for tolerance in (1e-6, TIGHT):
        checks = run("smooth.yaml", "bodies.link.hinges.damping=0", within(tolerance)).checks
        part = checks.energy_residual / checks.largest_kinetic_energy
        name = f"energy residual, undamped smooth scene, tolerance {tolerance:.0e} m"
        yield name, "1e-6 of the kinetic energy", f"{part:.1e}"


def frequencies() -> Iterator[Row]:
    """First cantilever frequency from a simulated ring-down against Euler-Bernoulli."""
    for (layout, rods), expected in CANTILEVER.items():
        text = RING_DOWN.format(rods=rods, layout=layout)
        scene = scene_of(parse_document(text, "ring-down"))
        result = simulate(scene)
        beam = euler_bernoulli_cantilever(beam_of(scene, scene.bodies["link"]), 1)[0]  # rad/s
        swings = path(result, "link.end").position[:, 1]
        measured = strongest_line(result.time, swings, beam / 2, 2 * beam)
        name = f"first frequency over a beam's, {layout}, n = {rods}"
        yield name, f"{expected:+.2%}", f"{measured / beam - 1:+.2%}"


def engines() -> Iterator[Row]:
    """The Lagrangian against the independent series, and Exudyn against the Lagrangian."""
    for name, limit in LIMITS.items():
        judge = case(name, within(JUDGE), engine="lagrangian")
        what = f"Lagrangian, S of `{name}`, tolerance {JUDGE:.0e} m"
        yield what, f"{limit:.1e} m", off_series(name, judge)
        tight = case(name, within(TIGHT))
        what = f"Exudyn against it, `{name}`, tolerance {TIGHT:.0e} m"
        yield what, f"{TIGHT:.0e} m", off_run(tight, judge)


def clearance() -> Iterator[Row]:
    """The link with clearance: series, lever, parts of the time in contact, both engines."""
    for name, (model, own, end) in WITH_CLEARANCE.items():
        settings = (*own, f"run={{duration: {end}, sample: 1 ms}}")
        tight = (within(TIGHT_WALLS),)
        for engine, accuracy in (("exudyn", ()), ("exudyn", tight), ("lagrangian", tight)):
            result = run(model, *settings, *accuracy, engine=engine)
            found = against_series(name, result)
            early = found.until(0.3).largest
            at = f", tolerance {result.settings.integrator.tolerance:.0e} m"
            limit = "1e-6 m to 0.3 s, 2e-5 m to the end" if accuracy else "none"
            told = f"{early:.1e} m to 0.3 s, {found.largest:.1e} m to {end} s ({cost(result)})"
            yield f"S of `{name}`, {engine}{at}", limit, told
    parts = contact_states(result, "sleeve").fractions()
    two = parts[State.SAME_SIDE] + parts[State.OPPOSITE_SIDES]
    shares = [parts[State.FREE], parts[State.ONE_POINT], two]
    told = " / ".join(f"{100 * share:.2f}" for share in shares)
    yield "free / one / two points, first 0.42 s, n = 10", "65.8 / 28.2 / 6.0 %", f"{told} %"
    for name, limit, own in (
        ("n = 10, `paper`", "-0.14155, 0.10322 rad", ()),
        ("n = 5, `beam`", "-0.166 +- 0.003 rad", WITH_CLEARANCE["clearance_n5_beam"][1]),
    ):
        seen = lever_response(run("clearance.yaml", "run.turns=2", *own), "strike")
        measured = f"{seen.least[0]:.5f}, {seen.greatest[0]:.5f} rad"
        yield f"lever's extremes with clearance, {name}", limit, measured


PARTS: dict[str, Callable[[], Iterator[Row]]] = {
    "reference": reference,
    "redundant": lambda: reference(*REDUNDANT),
    "peaks": peaks,
    "laps": laps,
    "order": order,
    "energy": energy,
    "frequencies": frequencies,
    "rigid_link": rigid_link,
    "long_runs": long_runs,
    "tight": lambda: reference(within(TIGHT)),
    "engines": engines,
    "clearance": clearance,
}
LONG = ("rigid_link", "long_runs", "tight", "engines", "clearance")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--quick", action="store_true", help="leave out the long runs")
    parser.add_argument("--only", nargs="+", choices=list(PARTS), help="these parts alone")
    options = parser.parse_args()
    names = options.only or [name for name in PARTS if not (options.quick and name in LONG)]
    print("| what | promised | measured |\n|---|---|---|")
    for name in names:
        for row in PARTS[name]():
            print(f"| {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    main()

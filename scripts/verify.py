"""Measure every number that the README claims, and print them as its table.

Usage:
    python scripts/verify.py            everything, about ten minutes
    python scripts/verify.py --quick    without the tightest settings, 20 turns and Lagrangian
    python scripts/verify.py --clearance    the link with clearance alone, about two minutes
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from itertools import pairwise
from math import pi
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.chain import euler_bernoulli_cantilever
from exudyn_flexlink.compare import compare
from exudyn_flexlink.curves import intersect_ray
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene, scene_of
from exudyn_flexlink.mechanism import beam_of, build_mechanism
from exudyn_flexlink.observables import (
    State,
    contact_states,
    crank_angle,
    deviation,
    lever_response,
    path,
    settled,
    strikes,
)
from exudyn_flexlink.result import Result
from exudyn_flexlink.source import parse_document
from exudyn_flexlink.storage import read_series

ROOT = Path(__file__).parent.parent
MODELS, DATA = ROOT / "models", ROOT / "tests" / "data"
BEAM = "bodies.link.hinges.stiffness=beam"
JUDGE = "accuracy.tolerance=1e-10"
TIGHT = ("accuracy.tolerance=1e-6", "accuracy.steps_per_contact=100")

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


def run(model: str, *settings: str) -> Result:
    """Simulate a shipped model with settings."""
    return simulate(load_scene(MODELS / model, settings))


def reference(*settings: str) -> Iterator[Row]:
    """Deviation of S and the lever from the independent series, over two turns."""
    limits = {"smooth_n10_beam": "1e-7 m"} if settings else {}
    for name, (model, own) in CASES.items():
        result = run(model, "run.turns=2", "run.sample=1 ms", *own, *settings)
        series = read_series(DATA / f"{name}.csv")
        found = deviation(result, series.time, series.position, series.lever_angle)
        limit = limits.get(name, "3e-6 m" if settings else "5e-5 m")
        at = f"tolerance {result.settings['tolerance']:.0e} m"
        angle = "" if name.startswith("smooth") else f", lever {found.largest_angle:.1e} rad"
        cost = f"{result.checks.steps} steps, {result.timings['solve']:.1f} s"
        yield f"S of `{name}`, {at}", limit, f"{found.largest:.1e} m{angle} ({cost})"


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
    rest = settled(result, "strike", found[1].begin)
    yield "lever before the next strike, of its peak", "at rest", f"{rest:.1e}"


def rigid_link() -> Iterator[Row]:
    """S of the rigid link against its closed form, over 20 turns."""
    text = (MODELS / "rigid.yaml").read_text(encoding="utf-8")
    smooth = text[: text.index("contacts:")] + text[text.index("run:") :]
    # Between steps positions lie on a cubic: the steps must be short enough for that, too.
    settings = ["run.turns=20", "run.sample=5 ms", "accuracy.step=3e-4"]
    scene = scene_of(parse_document(smooth, "rigid.yaml"), settings)
    result = simulate(scene)
    slot = build_mechanism(scene).slots[0]
    crank = np.array([0.02, 0.0])
    theta, u, expected = crank_angle(result), 0.0, []
    for angle in theta:
        along = np.array([np.cos(angle), np.sin(angle)])
        u = intersect_ray(slot.curve, crank, along, u)
        expected.append(slot.curve.point(u) + 0.07 * along)
    off = np.linalg.norm(path(result, "link.end").position - np.array(expected), axis=1).max()
    name = "S of the rigid link, 20 turns of 3e-4 s steps, against the closed form"
    yield name, "1e-9 m", f"{off:.1e} m"
    flexible = run("smooth.yaml", "run.turns=20")
    error = f"{max(result.checks.constraint_error, flexible.checks.constraint_error):.1e}"
    yield "joints, 20 turns: P on its track, rod 1 on the guide's axis", "1e-9 m", f"{error} m"


def order() -> Iterator[Row]:
    """Error of S in the smooth scene at a step and at half of it."""
    series = read_series(DATA / "smooth_n10_beam.csv")
    errors = []
    for step in (4e-4, 2e-4, 1e-4):
        result = run("smooth.yaml", "run.turns=2", "run.sample=1 ms", f"accuracy.step={step}")
        found = deviation(result, series.time, series.position, series.lever_angle)
        errors.append(found.rms)
    ratios = ", ".join(f"{a / b:.2f}" for a, b in pairwise(errors))
    yield "error of S (rms, smooth) over that at half the step", "about 4", ratios


def energy() -> Iterator[Row]:
    """Energy balance of the undamped smooth scene."""
    for tolerance in ("4e-5", "1e-6"):
        settings = ("bodies.link.hinges.damping=0", f"accuracy.tolerance={tolerance}")
        checks = run("smooth.yaml", *settings).checks
        part = checks.energy_residual / checks.largest_kinetic_energy
        name = f"energy residual, undamped smooth scene, tolerance {tolerance} m"
        yield name, "1e-6 of the kinetic energy", f"{part:.1e}"


def frequencies() -> Iterator[Row]:
    """First cantilever frequency from a simulated ring-down against Euler-Bernoulli."""
    for (layout, rods), expected in CANTILEVER.items():
        text = RING_DOWN.format(rods=rods, layout=layout)
        scene = scene_of(parse_document(text, "ring-down"))
        result = simulate(scene)
        measured = _frequency(result.time, path(result, "link.end").position[:, 1])
        beam = euler_bernoulli_cantilever(beam_of(scene, "link"), 1)[0] / (2 * pi)
        name = f"first frequency over a beam's, {layout}, n = {rods}"
        yield name, f"{expected:+.2%}", f"{measured / beam - 1:+.2%}"


def engines() -> Iterator[Row]:
    """The Lagrangian against the independent series, and Exudyn against the Lagrangian."""
    close = ("accuracy.tolerance=1e-7",)
    for name, (model, own) in CASES.items():
        settings = ("run.turns=2", "run.sample=1 ms", *own)
        judge = simulate(load_scene(MODELS / model, (*settings, JUDGE)), "lagrangian")
        series = read_series(DATA / f"{name}.csv")
        found = deviation(judge, series.time, series.position, series.lever_angle)
        limit = LIMITS[name]
        cost = f"{judge.checks.steps} steps, {judge.timings['solve']:.0f} s"
        off = f"{found.largest:.1e} m, lever {found.largest_angle:.1e} rad ({cost})"
        yield f"Lagrangian, S of `{name}`", f"{limit:.1e} m", off
        tight = close if name.startswith("smooth") else TIGHT
        both = compare(run(model, *settings, *tight), judge).deviation
        limit = 1e-8 if name.startswith("smooth") else 2e-6
        off = f"{both.largest:.1e} m, lever {both.largest_angle:.1e} rad"
        yield f"Exudyn against Lagrangian, `{name}`, {tight[0][9:]}", f"{limit:.0e} m", off


def clearance() -> Iterator[Row]:
    """The link with clearance: series, lever, parts of the time in contact, both engines."""
    for name, (model, own, end) in WITH_CLEARANCE.items():
        settings = (*own, f"run={{duration: {end}, sample: 1 ms}}")
        series = read_series(DATA / f"{name}.csv")
        for engine, accuracy in (("exudyn", ()), ("exudyn", TIGHT[:1]), ("lagrangian", ())):
            result = simulate(load_scene(MODELS / model, (*settings, *accuracy)), engine)
            found = deviation(result, series.time, series.position, series.lever_angle)
            early = found.until(0.3).largest
            at = f", tolerance {result.settings['tolerance']:.0e} m" if engine == "exudyn" else ""
            limit = "1e-6 m to 0.3 s, 2e-5 m to the end" if accuracy or not at else "none"
            cost = f"{result.checks.steps} steps, {result.timings['solve']:.1f} s"
            off = f"{early:.1e} m to 0.3 s, {found.largest:.1e} m to {end} s ({cost})"
            yield f"S of `{name}`, {engine}{at}", limit, off
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


def _frequency(time: NDArray[np.float64], signal: NDArray[np.float64]) -> float:
    """Frequency (Hz) of the strongest line: the peak of a windowed spectrum, refined."""
    signal = (signal - signal.mean()) * np.hanning(len(signal))
    step = time[1] - time[0]
    trial = np.fft.rfftfreq(len(signal), step)[np.argmax(np.abs(np.fft.rfft(signal)))]
    near = np.linspace(0.8, 1.2, 4001) * trial
    lines = np.abs(np.exp(-2j * pi * np.outer(near, time)) @ signal)
    return float(near[np.argmax(lines)])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--quick", action="store_true", help="leave out the long runs")
    parser.add_argument("--clearance", action="store_true", help="the clearance alone")
    options = parser.parse_args()
    parts: list[Callable[[], Iterator[Row]]] = [reference, peaks, laps, order, energy, frequencies]
    if not options.quick:
        parts += [rigid_link, lambda: reference(*TIGHT), engines, clearance]
    if options.clearance:
        parts = [clearance]
    print("| what | promised | measured |\n|---|---|---|")
    for part in parts:
        for row in part():
            print(f"| {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    main()

"""Random scenes through both engines: none may crash, none may silently be wrong.

Usage:
  .venv/bin/python scripts/random_scenes.py             200 scenes, on all cores, five minutes
  .venv/bin/python scripts/random_scenes.py --count 20 --seed 7
  .venv/bin/python scripts/random_scenes.py --only 137  one of them, told in full
  .venv/bin/python scripts/random_scenes.py --play --count 100   with play in the slot

Every parameter of the paper's mechanism is drawn within ten times its value (angles, restitution
and the shape of the mechanism within their own bounds; 2 to 10 rods where they touch walls), with
and without clearance, friction, weight and damping. Exudyn is held against the Lagrangian with a
hundredth of the tolerance. Every impact multiplies what errors there are: the two are held against
each other up to the horizon only, where two runs of Exudyn part for good. Runs that are refused,
stop or warn say so, and are counted; silent is what does none of that. The lever's tip
is told of at the end, where it is off by more than the tolerance. A run whose balance of energy
misses more than a thousandth is silent, too, where no warning says so. The exit code is 1 if there
is a crash, or a silent disagreement by more than the stated tolerance before the horizon.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from dataclasses import dataclass
from functools import partial

import numpy as np
from benchmarks.lever_tip import tip_apart
from benchmarks.side_by_side import add_numbers, judged, numbers_of

from exudyn_flexlink import load_scene
from exudyn_flexlink.comparison import compare
from exudyn_flexlink.engines import NotRepresentableError, simulate
from exudyn_flexlink.engines.diagnostics import kinetic
from exudyn_flexlink.result import Result
from exudyn_flexlink.source import SceneError

DECADE = 10.0
SIZE = 3.0  # the whole mechanism is up to so much larger or smaller
SHAPE = 1.3  # lengths, to one another
WITH_CLEARANCE, WITH_FRICTION, WITH_WEIGHT = 0.25, 0.5, 0.5
TOLERANCE, WALLS = 1e-6, 1e-5  # m
TURNS, TURNS_WALLS, TURNS_PLAY = 0.8, 0.3, 0.2
TIGHTER = 100.0
SPEED = 10.0  # rad/s: the paper's
BALANCE = 1e-3  # of the largest kinetic energy, that a balance may miss

REFUSED, STOPPED, CRASHED = "refused", "stopped and said why", "crashed"
AGREES, PARTED = "agrees to the end", "agrees to the horizon"
WARNED, SILENT = "disagrees and warns", "disagrees silently"
KINDS = (AGREES, PARTED, WARNED, SILENT, STOPPED, REFUSED, CRASHED)
CLEAR, PLAY = "clearance", "slot_play"


@dataclass(frozen=True)
class Verdict:
    """What became of a scene.

    `ratio` is the deviation of named points over the tolerance, to the horizon; `tip` that of the
    lever's tip, to the end.
    """

    kind: str
    told: str = ""
    ratio: float = 0.0
    tip: float = 0.0


def draw(rng: np.random.Generator, play: bool = False) -> tuple[str, list[str]]:
    """A model and settings that change it; with play in its slot, if asked for."""

    def factor(most: float = DECADE) -> float:
        return float(most ** rng.uniform(-1, 1))

    size = factor(SIZE)
    a, b, pivot, link, guide, lever, width = (
        size * x * factor(SHAPE) for x in (0.04, 0.03, 0.02, 0.07, 0.09, 0.03, 0.01)
    )
    radius = b  # the egg's half circle joins its half ellipse
    # S is farthest to the left in odd laps, the lever's face ends a random part of it before.
    reach = -(a + link)
    clear = rng.random() < WITH_CLEARANCE
    walls = clear or play
    rods = rng.integers(2, 11) if walls else rng.integers(1, 21)
    settings = {
        "curves.ellipse.semi_axes": f"[{a}, {b}]",
        "curves.egg": (
            "{type: joined, pieces: ["
            f"{{type: ellipse, centre: [0, 0], semi_axes: [{a}, {b}], from: -90 deg, to: 90 deg}}, "
            f"{{type: circle, centre: [0, 0], radius: {radius}, from: 90 deg, to: 270 deg}}]}}"
        ),
        "joints.crank.at": f"[{pivot}, 0]",
        "joints.pivot.at": f"[{reach - lever + rng.uniform(0, 0.3) * lever}, 0]",
        "bodies.guide.length": f"{guide}",
        "bodies.link.length": f"{link}",
        "bodies.link.section": f"{{width: {width}, thickness: {5e-4 * size * factor()}}}",
        "bodies.link.rods": f"{rods}",
        "bodies.link.layout": str(rng.choice(["equal", "half_ends"])) if rods > 1 else "equal",
        "bodies.link.hinges.stiffness": str(rng.choice(["paper", "beam"])),
        "bodies.link.hinges.damping": f"{2e-5 * size**3 * factor()}",
        "bodies.lever.length": f"{lever}",
        "bodies.lever.section": f"{{width: {width}, thickness: {1e-3 * size * factor()}}}",
        "materials.steel.density": f"{7850 * factor()}",
        "materials.steel.youngs_modulus": f"{2e11 * factor()}",
        "springs.lever_return.frequency": f"{40 * factor()}",
        "springs.lever_return.damping_ratio": f"{0.1 * factor()}",
        "drives.motor.value": f"{SPEED * factor()}",
        "contacts.strike.law.stiffness": f"{2e4 * factor()}",
        "contacts.strike.law.restitution": f"{rng.uniform(0, 1)}",
        "accuracy.tolerance": f"{(WALLS if walls else TOLERANCE)}",
        "run.turns": f"{TURNS_WALLS if walls else TURNS}",
    }
    if rng.random() < WITH_WEIGHT:
        settings["gravity"] = "[0, -9.81]"
    if rng.random() < WITH_FRICTION:
        settings["contacts.strike.law.friction"] = f"{rng.uniform(0, 0.5)}"
    if clear:
        settings["joints.sleeve.clearance"] = f"{5e-3 * size * DECADE ** rng.uniform(-1, 0)}"
        settings["joints.sleeve.law.stiffness"] = f"{1e5 * factor()}"
        settings["joints.sleeve.law.restitution"] = f"{rng.uniform(0, 1)}"
    model = CLEAR if clear else "no_clearance"
    if play:
        model = PLAY
        settings["run.turns"] = f"{TURNS_PLAY}"
        settings["joints.pin.clearance"] = f"{2e-4 * size * factor()}"
        settings["joints.pin.radius"] = f"{2e-3 * size * DECADE ** rng.uniform(-1, 0)}"
        settings["joints.pin.law.stiffness"] = f"{1e6 * factor()}"
        settings["joints.pin.law.restitution"] = f"{rng.uniform(0, 1)}"
        if rng.random() < WITH_FRICTION:
            settings["joints.pin.law.friction"] = f"{rng.uniform(0, 0.5)}"
    return model, [f"{key}={value}" for key, value in settings.items()]


def judge(model: str, settings: list[str], measure: bool = True) -> Verdict:
    """Run a scene by both engines, and compare."""
    try:
        scene = load_scene(model, settings)
    except SceneError as error:
        return Verdict(REFUSED, str(error).strip().splitlines()[0])
    tolerance = scene.accuracy.tolerance
    assert tolerance is not None
    tight = load_scene(model, [*settings, f"accuracy.tolerance={tolerance / TIGHTER}"])
    try:
        found, exact = simulate(scene, "exudyn", measure=measure), simulate(tight, "lagrangian")
    except (NotRepresentableError, SceneError) as error:
        return Verdict(REFUSED, str(error))
    except Exception as error:  # what a user would see as a traceback is what is looked for here
        return Verdict(CRASHED, f"{type(error).__name__}: {error}")
    for result in (found, exact):
        if not result.outcome.completed:
            return Verdict(STOPPED, f"{result.engine}: {result.outcome.reason}")
    return _compared(found, exact, tolerance)


def _compared(found: Result, exact: Result, tolerance: float) -> Verdict:
    comparison = compare(exact, found)
    judged = comparison.judged
    if not len(judged.time):
        return Verdict(WARNED, "the horizon lies at the start")
    ratio = judged.largest / tolerance
    missed = found.checks.energy_residual / kinetic(found)
    tip = tip_apart(comparison) / tolerance
    told = f"{judged.largest:.1e} m, {ratio:.2g} of the tolerance"
    if comparison.horizon is not None:
        after = comparison.deviation.largest / tolerance
        told += f", to the horizon {comparison.horizon:.3g} s; {after:.2g} after it"
    told = "; ".join([told, *found.warnings[:1]])
    if missed > BALANCE and not found.warnings:
        return Verdict(SILENT, f"the energy balance misses {missed:.2g}; {told}", ratio, tip)
    if ratio <= 1:
        return Verdict(AGREES if comparison.horizon is None else PARTED, told, ratio, tip)
    return Verdict(WARNED if found.warnings else SILENT, told, ratio, tip)


def drawn(number: int, seed: int, play: bool) -> tuple[str, list[str]]:
    """Draw a scene by its number; return its model and its settings."""
    return draw(np.random.default_rng([seed, number]), play)


def verdict_of(number: int, seed: int, measure: bool, play: bool) -> Verdict:
    """Draw a scene by its number, and judge it."""
    return judge(*drawn(number, seed, play), measure)


def main() -> int:
    """Print the verdicts that are not agreement to the end, and the numbers of all."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    add_numbers(parser, 200)
    parser.add_argument("--play", action="store_true", help="play between the pin and its slot")
    options = parser.parse_args()
    if options.only is not None:
        model, settings = drawn(options.only, options.seed, options.play)
        print(model, *(f"     --set '{setting}'" for setting in settings), sep="\n")
    judge_by_number = partial(
        verdict_of, seed=options.seed, measure=options.measure, play=options.play
    )
    counts: Counter[tuple[str, bool]] = Counter()
    ratios, tips = [], {}
    for number, verdict in judged(judge_by_number, numbers_of(options), options.jobs):
        settings = drawn(number, options.seed, options.play)[1]
        clear = any(setting.startswith("joints.sleeve.clearance") for setting in settings)
        counts[verdict.kind, clear] += 1
        ratios += [verdict.ratio] if verdict.kind in {AGREES, PARTED} else []
        if verdict.tip > 1:
            tips[number] = verdict.tip
        if verdict.kind != AGREES or options.only is not None:
            print(f"{number:4d} {verdict.kind}: {verdict.told}", flush=True)
    print("| | without clearance | with clearance |\n|---|---|---|")
    for kind in KINDS:
        print(f"| {kind} | {counts[kind, False]} | {counts[kind, True]} |")
    print()
    over = ", ".join(f"{number}: {tip:.2g}" for number, tip in tips.items())
    print(f"lever's tip, to the end, in tolerances where more than one: {over or 'nowhere'}")
    if ratios:
        print(f"where they agree: at most {max(ratios):.2g} of the tolerance")
    wrong = sum(counts[kind, clear] for kind in (CRASHED, SILENT) for clear in (False, True))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

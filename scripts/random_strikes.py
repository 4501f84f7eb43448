"""Random strikes through both engines: none may silently be off by more than the tolerance.

Usage:
  .venv/bin/python scripts/random_strikes.py             250 scenes, on all cores, ten minutes or so
  .venv/bin/python scripts/random_strikes.py --count 20 --seed 7
  .venv/bin/python scripts/random_strikes.py --only 137  one of them, with its settings
  .venv/bin/python scripts/random_strikes.py --undamped  links that nothing damps

The paper's mechanism without clearance, of 1 to 12 rods, strikes a lever at 2 to 60 rad/s, with
contacts of 1e3 to 1e6 N/m that return anything from nothing to all. S and the lever's tip of each
engine's run are held, to the end, against the Lagrangian's at a hundredth of the tolerance. Where a
run of Exudyn at a hundredth of the tolerance does not confirm that within half the tolerance, there
is nothing to judge by. Off by more than the tolerance is told if a warning speaks of errors, of the
tolerance or of energy; else it is silent. The exit code is 1 if an engine is silently wrong, or a
run crashes.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from functools import partial

import numpy as np
from benchmarks.lever_tip import tip_apart
from benchmarks.side_by_side import add_numbers, judged, numbers_of
from benchmarks.verdicts import (
    CRASHED,
    OF_ACCURACY,
    OPEN,
    RIGHT,
    SILENT,
    STOPPED,
    TOLD,
    Verdict,
    table,
)  # fmt: skip
from drawing.added import DEPTH, LAWS
from drawing.parts import spread
from scipy.interpolate import PchipInterpolator

from exudyn_flexlink import load_scene
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.comparison import compare
from exudyn_flexlink.engines import NotRepresentableError, simulate
from exudyn_flexlink.result import Interval, Result
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.source import SceneError

ENGINES = ("exudyn", "lagrangian")
MODEL = "no_clearance"
TOLERANCE, TIGHTER, FAR = 1e-6, 100.0, 1e4  # m, times; times where forces are compared
CONFIRMED = 0.5  # of the tolerance: what the two runs to judge by may differ by
REACH = -0.11  # m: where S is farthest to the left in odd laps
PLASTIC, ELASTIC = 0.15, 0.1  # shares of strikes that return nothing, and all
KINDS = (RIGHT, TOLD, SILENT, STOPPED, OPEN, CRASHED)


def draw(rng: np.random.Generator, undamped: bool = False) -> list[str]:
    """Settings that change the model; `undamped`: nothing damps the link."""

    def spread(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    lever = spread(0.02, 0.04)
    returned = rng.uniform(0, 1)
    exact = rng.random()
    if exact < PLASTIC:
        returned = 0.0
    elif exact > 1 - ELASTIC:
        returned = 1.0
    settings = {
        "curves.track.curves": str(rng.choice(["[ellipse]", "[ellipse, egg]"])),
        "joints.crank.at": f"[{rng.uniform(0.005, 0.028):.6g}, 0]",
        "joints.pivot.at": f"[{REACH - lever * (1 - rng.uniform(0.02, 0.4)):.6g}, 0]",
        "bodies.link.section": f"{{width: 10 mm, thickness: {spread(2e-4, 1e-3):.6g}}}",
        "bodies.link.rods": f"{rng.integers(1, 13)}",
        "bodies.link.hinges.stiffness": str(rng.choice(["paper", "beam"])),
        "bodies.link.hinges.damping": f"{spread(2e-6, 2e-4):.6g}",
        "bodies.lever.length": f"{lever:.6g}",
        "bodies.lever.section": f"{{width: 10 mm, thickness: {spread(5e-4, 3e-3):.6g}}}",
        "springs.lever_return.frequency": f"{spread(5, 200):.6g}",
        "springs.lever_return.damping_ratio": f"{spread(0.01, 1):.6g}",
        "drives.motor.value": f"{spread(2, 60):.6g}",
        "contacts.strike.law.stiffness": f"{spread(1e3, 1e6):.6g}",
        "contacts.strike.law.restitution": f"{returned:.6g}",
        "run.turns": f"{rng.uniform(0.8, 2):.3g}",
    }
    if undamped:
        settings["bodies.link.hinges.damping"] = "0"
    return [f"{key}={value}" for key, value in settings.items()]


def judge(settings: list[str], measure: bool = True) -> list[Verdict]:
    """Run a scene by both engines, and compare."""
    runs = {}
    try:
        for part in (1.0, 1 / TIGHTER):
            asked = f"accuracy.tolerance={part * TOLERANCE}"
            scene = load_scene(MODEL, [*settings, asked])
            for engine in ENGINES:
                runs[engine, part] = _run(scene, engine, measure=measure and part == 1.0)
    except (NotRepresentableError, SceneError) as error:
        return [Verdict(engine, STOPPED, told=str(error).splitlines()[0]) for engine in ENGINES]
    except Exception as error:  # what a user would see as a traceback is what is looked for here
        told = f"{type(error).__name__}: {error}"
        return [Verdict(engine, CRASHED, told=told) for engine in ENGINES]
    exact, second = runs["lagrangian", 1 / TIGHTER], runs["exudyn", 1 / TIGHTER]
    sure = max(_off(exact, second), default=np.inf) <= CONFIRMED
    return [_verdict(engine, runs[engine, 1.0], exact, sure) for engine in ENGINES]


def _run(scene: Scene, engine: str, *, measure: bool) -> Result:
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)  # NumPy's may reach no user
        return simulate(scene, engine, measure=measure)


def _verdict(engine: str, found: Result, exact: Result, sure: bool) -> Verdict:
    if not found.outcome.completed:
        return Verdict(engine, STOPPED, told=found.outcome.reason)
    told = [line for line in found.warnings if any(word in line for word in OF_ACCURACY)]
    if not exact.outcome.completed:
        return Verdict(engine, OPEN, told=exact.outcome.reason)
    off = max(_off(exact, found))
    kind = RIGHT if off <= 1 else TOLD if told else SILENT if sure else OPEN
    return Verdict(engine, kind, off, told[0] if told else "")


def _off(exact: Result, found: Result) -> tuple[float, ...]:
    """Parts of the tolerance by which S and the lever's tip differ; nothing if one is not there."""
    if not (exact.outcome.completed and found.outcome.completed):
        return ()
    seen = compare(exact, found)
    return seen.deviation.largest / TOLERANCE, tip_apart(seen) / TOLERANCE


def forces(rng: np.random.Generator, family: str) -> Verdict:
    """Draw a strike with any law, and hold its force within touches against a far tighter run.

    Each touch is aligned at its begin. Right: 99 % of the samples in touches are off by no more
    than is told (N), begins and ends of touches too (s); `off` is the worse of both, as parts.
    """
    law = str(rng.choice(("penalty", *LAWS)))
    stiffness = spread(rng, 1e3, 1e6) / (1 if law == "penalty" else DEPTH**0.5)
    law = f"{{type: {law}, stiffness: {stiffness}, restitution: {rng.uniform(0.1, 1)}}}"
    settings = [own for own in draw(rng) if ".law." not in own] + [f"contacts.strike.law={law}"]
    parts = TOLERANCE, TOLERANCE / FAR
    scenes = [load_scene(MODEL, [*settings, f"accuracy.tolerance={part}"]) for part in parts]
    run, exact = _run(scenes[0], "exudyn", measure=True), _run(scenes[1], "exudyn", measure=False)
    if not (run.outcome.completed and exact.outcome.completed):
        return Verdict(family, STOPPED, told=f"{run.outcome.ending}; {exact.outcome.ending}")
    apart, shifts, until = [np.zeros(1)], [0.0], run.error.known_until
    for touch in run.contacts["strike"].touches:
        same = min(exact.contacts["strike"].touches, key=lambda own: abs(own.begin - touch.begin))
        (time, force), (since, right) = _inside(run, touch, until), _inside(exact, same, until)
        if len(time) and len(since) > 1:
            time, force = time[time < since[-1]], force[time < since[-1]]
            apart.append(abs(PchipInterpolator(since, right)(time) - force))
            shifts.append(abs(touch.begin - same.begin))
            shifts.append(abs(touch.end - same.end) if max(touch.end, same.end) < until else 0.0)
    told = run.error.forces["contact force of strike"]
    if told.touching is None or told.instants is None:
        return forces(rng, family)  # nothing is struck
    off = float(np.quantile(np.concatenate(apart), 0.99)) / told.touching.largest
    late = max(shifts) / told.instants
    said = f"force off by {off:.2g} of what is told, instants by {late:.2g}"
    return Verdict(family, RIGHT if max(off, late) <= 1 else SILENT, max(off, late), said)


def _inside(run: Result, touch: Interval, until: float) -> tuple[FloatArray, FloatArray]:
    """Samples inside a touch: times (n,) since it begins, and forces (n,)."""
    inside = (run.time > touch.begin) & (run.time < min(touch.end, until))
    inside &= np.append(np.diff(run.time) > 0, True)  # of two at one event the last
    return run.time[inside] - touch.begin, run.contacts["strike"].force[inside]


def verdicts_of(number: int, seed: int, undamped: bool, measure: bool) -> list[Verdict]:
    """Draw a scene by its number, and judge it."""
    return judge(draw(np.random.default_rng([seed, number]), undamped), measure)


def main() -> int:
    """Print the verdicts that are not right, and a table of all."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    add_numbers(parser, 250)
    parser.add_argument("--undamped", action="store_true", help="nothing damps the link")
    options = parser.parse_args()
    if options.only is not None:
        settings = draw(np.random.default_rng([options.seed, options.only]), options.undamped)
        print(*(f"--set '{setting}'" for setting in settings), sep="\n")
    found: list[Verdict] = []
    judge_by_number = partial(
        verdicts_of, seed=options.seed, undamped=options.undamped, measure=options.measure
    )
    for number, pair in judged(judge_by_number, numbers_of(options), options.jobs):
        found += pair
        for one in pair:
            if one.kind != RIGHT or options.only is not None:
                print(
                    f"{number:4d} {one.family}, {one.kind}: {one.off:.2g}; {one.told}", flush=True
                )
    print(*table(found, ENGINES, KINDS, (RIGHT,), "largest of the right"), sep="\n")
    return 1 if any(one.kind in {SILENT, CRASHED} for one in found) else 0


if __name__ == "__main__":
    sys.exit(main())

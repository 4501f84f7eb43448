"""Random mechanisms of many kinds: none may crash, none may silently miss its tolerance.

Usage:
  .venv/bin/python scripts/random_mechanisms.py             150 mechanisms, on all cores
  .venv/bin/python scripts/random_mechanisms.py --count 20 --seed 7
  .venv/bin/python scripts/random_mechanisms.py --only 13   one of them, with its model file
  .venv/bin/python scripts/random_mechanisms.py --parts --count 300   with more parts drawn in

Draws linkages, chains, points in slots, falling bodies, cams, journals with play and flexible
links, with drives, springs, walls and friction (see `drawing`). With `--parts` joints rub and have
stops, slots have play, contacts have other laws, and ropes, tables and formulas of springs, rounded
corners, gears with backlash, freewheels, ends at a formula and stages are added. Each is run in
minimal coordinates at 1e-6 m and held, in all named points and at all common instants, against a
run at a thousandth of that. This one has other steps and events, and errors of its own: where it
differs from a third, at a hundredth, by more than half the tolerance, or ends sooner than the
first, there is nothing to judge by. The equations are the same: those are what the second engine
and closed forms of `verify` are for. Off by more than the tolerance is told if a warning speaks of
errors, of the tolerance or of energy; else it is silent. So it is where a stage begins in one of
two runs alone, where a balance of energy misses more than a thousandth, or where what closes in a
stage loses other than half the square of what speeds change by, by mass. Mechanisms that take more
processor time than `--patience` are left out. The exit code is 1 if one is silently wrong, or a run
crashes.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import yaml
from benchmarks.side_by_side import add_numbers, judged, numbers_of
from benchmarks.verdicts import (
    CRASHED,
    LATE,
    OF_ACCURACY,
    OPEN,
    REFUSED,
    RIGHT,
    SILENT,
    STOPPED,
    TOLD,
    Verdict,
    of_file,
    table,
)  # fmt: skip
from drawing.mechanisms import FAMILIES, TOLERANCE, draw

from exudyn_flexlink import load_scene
from exudyn_flexlink.continuing import continued
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.engines.diagnostics import kinetic
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.mechanism import mass_blocks
from exudyn_flexlink.observables import common_times, separation
from exudyn_flexlink.result import STAGE, Result
from exudyn_flexlink.scene.forces import MotionDrive, SpeedDrive

JUDGE, CHECK = 1e-3, 1e-2  # of the tolerance
BALANCE = 1e-3  # of the largest kinetic energy, that a balance may miss
INSTANT = 1e-4  # s, by which stages and ends may be off: points move by metres a second
UNSURE = 0.5  # of the tolerance: what the two runs to judge by may differ by
KINDS = (RIGHT, TOLD, SILENT, STOPPED, OPEN, REFUSED, LATE, CRASHED)


def judge(text: str, family: str, seconds: float, measure: bool = True) -> Verdict:
    """Run a model file, and compare it with itself at tighter tolerances."""
    return of_file(text, family, seconds, partial(_verdict, family=family, measure=measure))


def _verdict(path: Path, family: str, measure: bool) -> Verdict:
    found = simulate(load_scene(path), "exudyn", measure=measure)
    exact = _tighter(path, JUDGE)
    told = [line for line in found.warnings if any(word in line for word in OF_ACCURACY)]
    said = told[0] if told else ""
    off = _apart(exact, found)
    if off <= 1 and found.outcome.completed and exact.outcome.completed:
        wrong = "; ".join([*_ends_otherwise(found, exact), *_energies(found), *_energies(exact)])
        if wrong and not told:
            return Verdict(family, SILENT, off, wrong)
    if off <= 1:
        if not found.outcome.completed:
            return Verdict(family, STOPPED, off, found.outcome.ending)
        return Verdict(family, RIGHT if exact.outcome.completed else OPEN, off, said)
    if told:
        return Verdict(family, TOLD, off, said)
    sure = _apart(exact, _tighter(path, CHECK)) <= UNSURE
    return Verdict(family, SILENT if sure else OPEN, off)


def _tighter(path: Path, part: float) -> Result:
    scene = load_scene(path, [f"accuracy.tolerance={part * TOLERANCE}"])
    return simulate(scene, "exudyn", measure=False)


def _apart(one: Result, other: Result) -> float:
    """Largest distance of any named point, in tolerances, as long as both run."""
    time = common_times(one, other)
    return float(separation(one, other, time).max(initial=0.0)) / TOLERANCE


def _ends_otherwise(found: Result, exact: Result) -> Iterator[str]:
    """Say where one of two runs begins a stage, or ends, and the other does not, or not then."""
    ends = [[*_begins(run), run.outcome.time] for run in (found, exact)]
    alike = found.outcome.until == exact.outcome.until and len(ends[0]) == len(ends[1])
    if not alike or np.abs(np.subtract(*ends)).max() > INSTANT:
        yield f"stages and end at {ends[0]} s, of the finer run at {ends[1]} s"


def _begins(run: Result) -> list[float]:
    return [event.time for event in run.laps if event.kind == STAGE]


def _energies(run: Result) -> Iterator[str]:
    """Say what is wrong with a run's balance of energy, and with what its stages lose."""
    missing = run.checks.energy_residual / kinetic(run)
    if missing > BALANCE:
        yield f"the energy balance misses {missing:.2g} of the largest kinetic energy"
    if any(isinstance(drive, SpeedDrive | MotionDrive) for drive in run.scene.drives.values()):
        return  # does work, too, as speeds jump
    for event in (event for event in run.laps if event.kind == STAGE):
        after = assemble_scene(continued(run, at=event.time))
        # Speeds after what closes are the nearest by mass to those before.
        change = after.state.v - run.rates[run.sample_at(event.time)]
        masses = mass_blocks(after.mechanism, after.state.q)
        lost = event.details["energy_lost"]
        away = float(np.einsum("pi,pij,pj", change, masses, change)) / 2
        if abs(lost - away) > BALANCE * kinetic(run):
            yield f"{event.name} loses {lost:.3g} J, but by its jump of speeds {away:.3g} J"


def verdict_of(number: int, seed: int, seconds: float, measure: bool, added: bool) -> Verdict:
    """Draw a mechanism by its number, and judge it."""
    family, text = drawn(number, seed, added)
    return judge(text, family, seconds, measure)


def drawn(number: int, seed: int, added: bool) -> tuple[str, str]:
    """Draw a mechanism by its number; return its family and its model file."""
    family, model = draw(np.random.default_rng([seed, number]), added)
    return family, yaml.safe_dump(model, sort_keys=False)


def main() -> int:
    """Print the verdicts that are not right, and a table of all."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    add_numbers(parser, 150)
    parser.add_argument("--patience", type=float, default=60.0, help="s of processor time, each")
    parser.add_argument("--parts", action="store_true", help="add friction, stops, gears ...")
    options = parser.parse_args()
    if options.only is not None:
        print(drawn(options.only, options.seed, options.parts)[1])
    found: list[Verdict] = []
    by_number = partial(
        verdict_of,
        seed=options.seed,
        seconds=options.patience,
        measure=options.measure,
        added=options.parts,
    )
    for number, one in judged(by_number, numbers_of(options), options.jobs):
        found.append(one)
        if one.kind != RIGHT or options.only is not None:
            print(f"{number:4d} {one.family}, {one.kind}: {one.off:.2g}; {one.told}", flush=True)
    print(*table(found, FAMILIES, KINDS, (RIGHT,), "largest of the right"), sep="\n")
    return 1 if any(one.kind in {SILENT, CRASHED} for one in found) else 0


if __name__ == "__main__":
    sys.exit(main())

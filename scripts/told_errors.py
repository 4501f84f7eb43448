"""Random scenes with clearance: which runs are off by more than their tolerance, which say so.

Usage:
  .venv/bin/python scripts/told_errors.py  40 scenes in both engines, half an hour
  .venv/bin/python scripts/told_errors.py --count 10 --seed 2
  .venv/bin/python scripts/told_errors.py --only 7

Scenes are drawn about the paper's mechanism with clearance: 2 to 6 rods, half a turn or so, walls
that give back much of a bounce. Each run is judged by the Lagrangian with its explicit method at
1e-9 m, in all named points. That judge may err itself by what it is away from one at 1e-8 m: a run
is wrong, or right, only where that does not matter, else it is undecided and not counted. Its
answers to the scenes of seed 1 are kept in `saved/told_errors.npz`, of another program for the same
equations; others take minutes each. A
second run tells what is known of the error (see `engines.finer`). Also told is how large errors
were over what was told of them. Scenes whose first run takes more processor
time than `--patience` are left out.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from fuzzing.limits import TooLongError, limited

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.observables import common_times, judged_points, separation
from exudyn_flexlink.observables.parting import positions
from exudyn_flexlink.result import Result

MODEL = Path(__file__).parent.parent / "models" / "clearance.yaml"
SAVED, SAVED_SEED = Path(__file__).parent / "saved" / "told_errors.npz", 1
# m, by name: what is run and judged.
WAYS = {
    "lagrangian, 1e-5 m": ("lagrangian", 1e-5),
    "minimal, 1e-5 m": ("exudyn", 1e-5),
    "minimal, 1e-4 m": ("exudyn", 1e-4),
}
JUDGE, CHECK = 1e-9, 1e-8  # m
HEAD = (
    "| run | right, silent | right, warned | wrong, warned | wrong, silent | error over that told: "
    "median, nine tenths, largest | second run's time over the first's, median |"
)


class Answer(NamedTuple):
    """Where named `points` are at times (n,), s: (n, points, 2), m; how much that may be off, m."""

    time: np.ndarray
    points: list[str]
    positions: np.ndarray
    unsure: np.ndarray


@dataclass(frozen=True)
class Row:
    """A run: its error (m), what is told of it (m), its touches, and seconds of both runs."""

    error: float
    told: float
    from_when: float | None
    wrong_from: float | None
    right: bool
    touches: int
    seconds: tuple[float, float]

    @property
    def wrong(self) -> bool:
        """Whether it is off by more than the tolerance."""
        return self.wrong_from is not None


def draw(rng: np.random.Generator) -> list[str]:
    """Settings that change the model."""

    def factor(most: float) -> float:
        return float(most ** rng.uniform(-1, 1))

    rods = int(rng.integers(2, 7))
    settings = {
        "bodies.link.rods": rods,
        "bodies.link.section": f"{{width: 10 mm, thickness: {8e-4 * factor(1.5)}}}",
        "bodies.link.hinges.stiffness": str(rng.choice(["paper", "beam"])),
        "bodies.link.hinges.damping": 1e-5 * factor(3),
        "joints.sleeve.clearance": 5e-3 * 10 ** rng.uniform(-0.7, 0),
        "joints.sleeve.law.stiffness": 1e5 * factor(2),
        "joints.sleeve.law.restitution": rng.uniform(0.5, 0.95),
        "joints.crank.at": f"[{0.02 * factor(1.1)}, 0]",
        "joints.pivot.at": f"[{-0.1 * rng.uniform(1.2, 1.45)}, 0]",
        "springs.lever_return.frequency": 40 * factor(1.5),
        "springs.lever_return.damping_ratio": 0.1 * factor(1.5),
        "drives.motor.value": 12 * factor(1.4),
        "contacts.strike.law.stiffness": 1e4 * factor(2),
        "contacts.strike.law.restitution": rng.uniform(0, 1),
        "run.turns": float(rng.choice([0.3, 0.5, 0.7])),
    }
    return [f"{key}={value}" for key, value in settings.items()]


def judge(settings: list[str], seconds: float, answer: Answer | None) -> dict[str, Row]:
    """Run a scene in both engines, and what judges them; nothing if the first takes too long."""
    try:
        with limited(seconds):
            first = simulate(load_scene(MODEL, settings), "lagrangian", measure=False)
    except TooLongError:
        return {}
    if not first.outcome.completed:
        return {}
    answer = answer or computed(settings)
    rows = {}
    for way, (engine, tolerance) in WAYS.items():
        scene = load_scene(MODEL, [*settings, f"accuracy.tolerance={tolerance}"])
        rows[way] = _row(simulate(scene, engine, measure=True), answer, tolerance)
    return rows


def saved(seed: int, number: int) -> Answer | None:
    """Return the answer to a scene that is kept, if there is one."""
    with np.load(SAVED) as kept:
        if seed != SAVED_SEED or f"{number}_time" not in kept:
            return None
        time, points, places, unsure = (
            kept[f"{number}_{name}"] for name in ("time", "points", "positions", "unsure")
        )
    return Answer(time, points.tolist(), places, unsure.astype(float))


def computed(settings: list[str]) -> Answer:
    """Answer by the explicit method, and by how much a looser run is away from it."""
    exact, check = (
        simulate(load_scene(MODEL, [*settings, *_explicit(tolerance)]), "lagrangian", measure=False)
        for tolerance in (JUDGE, CHECK)
    )
    time, points = common_times(exact, check), list(judged_points(exact.scene))
    unsure = np.maximum.accumulate(separation(check, exact, time))
    return Answer(time, points, positions(exact, points, time), unsure)


def _explicit(tolerance: float) -> list[str]:
    return ["solver.integrator=dop853", f"accuracy.tolerance={tolerance}"]


def _row(run: Result, answer: Answer, tolerance: float) -> Row:
    until = (answer.time <= run.time[-1]) & (answer.time < run.error.known_until)
    time, unsure = answer.time[until], answer.unsure[until]
    away = positions(run, answer.points, time) - answer.positions[until]
    off = np.maximum.accumulate(np.linalg.norm(away, axis=2).max(axis=1))
    wrong = np.flatnonzero(off > tolerance + unsure)
    return Row(
        float(off[-1]),
        run.error.largest,
        run.error.exceeds_from,
        float(time[wrong[0]]) if len(wrong) else None,
        bool(off[-1] + unsure[-1] <= tolerance),
        sum(len(sleeve.touches.end) for sleeve in run.sleeves.values()),
        (run.timings.get("second run", np.nan), run.timings["solve"]),
    )


def line_of(way: str, rows: list[Row]) -> str:
    """The table's line of one way: how many right and wrong runs were told."""
    rows = [row for row in rows if row.wrong or row.right]
    counts = Counter((row.wrong, row.from_when is not None) for row in rows)
    told = [counts[key] for key in ((False, False), (False, True), (True, True), (True, False))]
    over = cost = ""
    if rows:
        ratios = [row.error / row.told for row in rows]
        over = f"{np.median(ratios):.2f}, {np.quantile(ratios, 0.9):.2f}, {max(ratios):.2f}"
        cost = f"{np.median([row.seconds[1] / row.seconds[0] for row in rows]):.2g}"
    return f"| {way} | {' | '.join(map(str, told))} | {over} | {cost} |"


def main() -> int:
    """Print each run, and a table of all; the exit code is 1 if a wrong run is silent."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, help="number of one scene")
    parser.add_argument("--patience", type=float, default=10.0, help="s of the first run")
    options = parser.parse_args()
    numbers = range(options.count) if options.only is None else [options.only]
    rows: dict[str, list[Row]] = {way: [] for way in WAYS}
    for number in numbers:
        settings = draw(np.random.default_rng([options.seed, number]))
        found = judge(settings, options.patience, saved(options.seed, number))
        for way, row in found.items():
            rows[way].append(row)
            print(f"{number:3d} {way}: {_line(row)}", flush=True)
        if not found:
            print(f"{number:3d} not waited for", flush=True)
    print()
    print(HEAD)
    print("|---" * (HEAD.count("|") - 1) + "|")
    for way, of_way in rows.items():
        print(line_of(way, of_way))
    silent = [row for of in rows.values() for row in of if row.wrong and row.from_when is None]
    return 1 if silent else 0


def _line(row: Row) -> str:
    told = "silent" if row.from_when is None else f"told from {row.from_when:.3g} s on"
    right = "right" if row.right else "undecided"
    if row.wrong_from is not None:
        right = f"wrong from {row.wrong_from:.3g} s on"
    return (
        f"{right}, {told}; off by {row.error:.1e} m, told {row.told:.1e} m; {row.touches} touches"
    )


if __name__ == "__main__":
    sys.exit(main())

"""Sweeps: how many runs a second on one core and on two, and what rows cost by themselves.

  .venv/bin/python scripts/sweep_speed.py
  .venv/bin/python scripts/sweep_speed.py --runs 100 --rows 1000 --repeats 1

Prints the tables of docs/sweeps.md. Sweeps by one process and by two are made in turn; each number
is the median of the repetitions. What two cores are worth is the machine's: the same sweep of plain
loops, which share nothing but the cores, tells it. Runs that only wait need no core, and two
processes make twice as many, unless they wait for the sweep.
"""

from __future__ import annotations

import argparse
import os
import resource
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median

import exudyn_flexlink as fl
from exudyn_flexlink import engines
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.source import Document, Mistake
from exudyn_flexlink.storage import open_journal, save_table, staged_folder
from exudyn_flexlink.sweeps import (
    Observe,
    OneRun,
    Scalar,
    Simulate,
    Sweep,
    SweepTable,
    Work,
    carried_out,
    grid,
    local_processes,
    planned,
    work_of,
)

MODEL = "textbook/double_pendulum"
END = 2.0  # s, of a run
WAIT = 0.1  # s, of a run that only waits
TURNS = 1_000_000  # of a loop that stands for a run: about as long as one
NUMBERS = 20  # in a row of a run that is none
NAMES = ("wall", "here", "there")
START = "initial.angles.upper"


@dataclass(frozen=True)
class Cost:
    """Wall time and processor time (s) of this process and all it started, by kind."""

    wall: float
    here: float
    there: float

    @staticmethod
    def of(what: Callable[[], object]) -> Cost:
        """Measure a call."""
        before, began = _used(), time.perf_counter()
        what()
        after = _used()
        return Cost(time.perf_counter() - began, after[0] - before[0], after[1] - before[1])


def main() -> None:
    """Measure both."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--runs", type=int, default=500, help="of each sweep; default: 500")
    parser.add_argument("--rows", type=int, default=10_000, help="of no run; default: 10000")
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    print_runs(options.runs, options.repeats)
    print()
    print_rows(options.rows, options.repeats)


def print_runs(runs: int, repeats: int) -> None:
    """Print what one process and two make of the same sweep, and what a run costs."""
    plan = planned_over(fl.load_scene(MODEL, duration=END), f"-90:90 deg:{runs}")
    work = work_of(plan, engines.simulate, OneRun(fl.standard_row))
    found: dict[int, list[Cost]] = {1: [], 2: []}
    tables = {}
    for _ in range(repeats):
        for workers, costs in found.items():
            costs.append(Cost.of(lambda n=workers: tables.update({n: swept(plan, work, n)})))
    same = all(
        one.numbers == other.numbers
        for one, other in zip(tables[1].rows, tables[2].rows, strict=True)
    )
    wall = {n: median(cost.wall for cost in costs) for n, costs in found.items()}
    used = {n: median(cost.there for cost in costs) for n, costs in found.items()}
    busy = {n: sum(row.wall for row in tables[n].rows) / (n * wall[n]) for n in found}
    print(f"| sweep of {runs} runs of `{MODEL}` | one process | two | ratio |\n|---|---|---|---|")
    print(f"| runs a second | {runs / wall[1]:.1f} | {runs / wall[2]:.1f} "
          f"| {wall[1] / wall[2]:.2f} |")  # fmt: skip
    print(f"| processor time of a run | {1e3 * used[1] / runs:.0f} ms "
          f"| {1e3 * used[2] / runs:.0f} ms | {used[2] / used[1]:.2f} |")  # fmt: skip
    print(f"| part of the time in which processes run | {100 * busy[1]:.0f} % "
          f"| {100 * busy[2]:.0f} % | |")  # fmt: skip
    print(f"| the same numbers in each row | | {'yes' if same else 'NO'} | |")
    for words, observe in (("of a plain loop", turns), (f"that wait {1e3 * WAIT:.0f} ms", waits)):
        each = [[rate(plan, observe, n) for n in (1, 2)] for _ in range(repeats)]
        one, two = (median(rates) for rates in zip(*each, strict=True))
        print(f"| runs a second {words} | {one:.2f} | {two:.2f} | {two / one:.2f} |")
    print(f"\nPrograms that wanted a core meanwhile: {os.getloadavg()[0]:.0f}")


def swept(plan: Sweep, work: Work, workers: int) -> SweepTable:
    """Carry a sweep out by processes beside this one, one too, and write its files."""
    with tempfile.TemporaryDirectory() as parent:
        folder = Path(parent) / "swept"
        with open_journal(folder, plan) as journal:
            table = carried_out(
                plan, work, partial(local_processes, workers), {}, lambda row, _: journal.add(row)
            )
            with staged_folder(folder) as staged:
                save_table(plan, table, staged)
    return table


def rate(plan: Sweep, observe: Observe, workers: int) -> float:
    """Runs a second of what stands for one, from the first row on: processes are there then."""
    instants: list[float] = []
    work = work_of(plan, engines.simulate, observe)
    carried_out(
        plan,
        work,
        partial(local_processes, workers),
        {},
        lambda *_: instants.append(time.perf_counter()),
    )
    return (len(instants) - 1) / (instants[-1] - instants[0])


def waits(_: Scene, __: Simulate) -> dict[str, Scalar]:
    """Wait as long as a run."""
    time.sleep(WAIT)
    return {"wait_s": WAIT}


def turns(_: Scene, __: Simulate) -> dict[str, Scalar]:
    """Turn a loop: all that it needs is a core."""
    left = TURNS
    while left:
        left -= 1
    return {"turns": TURNS}


def planned_over(scene: Scene, values: str) -> Sweep:
    """Plan a sweep over starts."""
    mistakes: list[Mistake] = []
    design = grid({START: values}, (), mistakes)
    return planned(scene, design, Document("sweep_speed"), mistakes=mistakes)


def print_rows(rows: int, repeats: int) -> None:
    """Print what rows cost that no run is made for: scene, queue, journal and table."""
    plan = planned_over(fl.load_scene(MODEL), f"-90:90 deg:{rows}")
    work = work_of(plan, engines.simulate, numbers)
    costs = [Cost.of(lambda: swept(plan, work, 2)) for _ in range(repeats)]
    wall, here, there = (median(getattr(cost, name) for cost in costs) for name in NAMES)
    largest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    print(f"| {rows} rows of no run, two processes | |\n|---|---|")
    print(f"| time of a row | {1e3 * wall / rows:.1f} ms |")
    print(f"| processor time of a row, in the sweep's own process | {1e3 * here / rows:.2f} ms |")
    print(f"| in those that make the scenes | {1e3 * there / rows:.1f} ms |")
    print(f"| largest memory of the sweep's own process | {largest:.0f} MB |")


def numbers(scene: Scene, _: Simulate) -> dict[str, Scalar]:
    """Numbers of no run."""
    return {f"number_{k}": scene.initial.angles["upper"] * k for k in range(NUMBERS)}


def _used() -> tuple[float, float]:
    """Processor time (s) of this process and of those that it started and that have ended."""
    usage = (resource.getrusage(kind) for kind in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    here, there = (one.ru_utime + one.ru_stime for one in usage)
    return here, there


if __name__ == "__main__":
    main()

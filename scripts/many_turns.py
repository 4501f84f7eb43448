"""Many turns of both scenes of the paper: whether a run drifts or stops.

  .venv/bin/python scripts/many_turns.py
  .venv/bin/python scripts/many_turns.py --turns 50 --only no_clearance

Prints the table of docs/accuracy_measured.md, a line as soon as a run is done: strikes, touches of
the walls, the largest error of the energy balance, and that of the first and of the second half of
the run, as parts of the largest kinetic energy. 500 turns take some minutes without clearance; with
it, Exudyn takes an hour, the Lagrangian some minutes.
"""

from __future__ import annotations

import argparse

import numpy as np

from exudyn_flexlink import load_scene, simulate
from exudyn_flexlink.observables import strikes
from exudyn_flexlink.result import Result

RUNS = (
    ("no_clearance", "exudyn", ()),
    ("no_clearance", "lagrangian", ()),
    ("clearance", "exudyn", ("bodies.link.rods=4", "accuracy.tolerance=4e-4")),
    ("clearance", "lagrangian", ()),
)


def main() -> None:
    """Make the runs, one after the other."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--turns", type=float, default=500.0)
    parser.add_argument("--only", choices=("no_clearance", "clearance"))
    options = parser.parse_args()
    energy = "energy balance off by | in the first half, the second"
    print(f"| model | by | end | strikes | touches of walls | {energy} |")
    print("|---" * 7 + "|")
    for model, engine, settings in RUNS:
        if options.only in (None, model):
            scene = load_scene(model, [*settings, f"run.turns={options.turns}"])
            told = ", ".join([f"`{model}.yaml`", *settings])
            print(row(told, simulate(scene, engine, measure=False)), flush=True)


def row(told: str, result: Result) -> str:
    """One line; energies are parts of the largest kinetic energy."""
    ended = "completed" if result.outcome.completed else f"stopped: {result.outcome.reason}"
    by = result.settings.formulation or result.engine
    touches = sum(len(sleeve.touches.end) for sleeve in result.sleeves.values())
    missed = np.abs(result.energy.residual) / result.checks.largest_kinetic_energy
    halves = (missed[: len(missed) // 2].max(), missed[len(missed) // 2 :].max())
    return (
        f"| {told} | {by} | {ended} | {len(strikes(result, 'strike'))} | {touches or ''} "
        f"| {result.checks.relative_energy_residual:.1e} | {halves[0]:.1e}, {halves[1]:.1e} |"
    )


if __name__ == "__main__":
    main()

"""Find out whether the link stays in its guide, whatever clearance and speed, for many turns.

  .venv/bin/python scripts/clearance_limits.py
  .venv/bin/python scripts/clearance_limits.py --turns 5 --speeds 1 --engine lagrangian

Prints, for clearances from 0.1 to 5 mm and crank speeds from 1 to 100 rad/s, whether the run came
to its end, how deep a wall gave way, as a part of the clearance, and the error of the energy
balance, as a part of the largest kinetic energy. A run whose link can't be held stops and says so.
50 turns take about half an hour at 10 and 100 rad/s, and hours at 1 rad/s, where a turn lasts as
long as ten.
"""

from __future__ import annotations

import argparse

from exudyn_flexlink import load_scene, simulate

CLEARANCES = (1e-4, 5e-4, 1e-3, 5e-3)  # m
SPEEDS = (100.0, 10.0, 1.0)  # rad/s


def main() -> None:
    """Run every pair of clearance and speed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--turns", type=float, default=50.0)
    parser.add_argument("--clearances", type=float, nargs="+", default=CLEARANCES, metavar="M")
    parser.add_argument("--speeds", type=float, nargs="+", default=SPEEDS, metavar="RAD/S")
    parser.add_argument("--rods", type=int, default=4)
    parser.add_argument("--engine", default="exudyn", choices=("exudyn", "lagrangian"))
    options = parser.parse_args()
    print("| clearance | crank speed | end | deepest / clearance | energy balance off by |")
    print("|---|---|---|---|---|")
    for speed in options.speeds:
        for clearance in options.clearances:
            print(row(clearance, speed, options), flush=True)


def row(clearance: float, speed: float, options: argparse.Namespace) -> str:
    """Run one pair, and say how it went."""
    settings = [
        f"joints.sleeve.clearance={clearance}",
        f"drives.motor.value={speed}",
        f"run.turns={options.turns}",
        f"bodies.link.rods={options.rods}",
    ]
    result = simulate(load_scene("clearance", settings), options.engine, measure=False)
    ended = "completed" if result.outcome.completed else f"stopped: {result.outcome.reason}"
    deepest = result.sleeves["sleeve"].deepest / clearance
    missed = result.checks.energy_residual / result.checks.largest_kinetic_energy
    return f"| {1e3 * clearance:g} mm | {speed:g} rad/s | {ended} | {deepest:.2g} | {missed:.1e} |"


if __name__ == "__main__":
    main()

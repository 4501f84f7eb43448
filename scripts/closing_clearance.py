"""Let the clearance close: the link tends to the supported one, until the walls take over.

  .venv/bin/python scripts/closing_clearance.py
  .venv/bin/python scripts/closing_clearance.py --out docs --rods 4

Draws how far S is from that of rods held on the guide's axis (the same hinges, before the strike)
over the clearance, for three stiffnesses of the walls, and how deep the walls give way. Writes
closing_clearance.png. Takes about five minutes.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from exudyn_flexlink import load_scene, simulate
from exudyn_flexlink.observables import between_samples, path
from exudyn_flexlink.plots.frame import BLUE, GREEN, RED
from exudyn_flexlink.result import Result

FloatArray = NDArray[np.float64]

MODELS = Path(__file__).parent.parent / "models"
CLEARANCES = (5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5)  # m
STIFFNESSES = {1e4: GREEN, 1e5: BLUE, 1e6: RED}  # N/m, and colours
END = 0.3  # s: just before the strike


def main() -> None:
    """Run all clearances and stiffnesses, print a table and draw it."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--out", type=Path, default=MODELS.parent / "docs")
    parser.add_argument("--rods", type=int, default=4)
    options = parser.parse_args()
    common = [f"run={{duration: {END}, sample: 0.5 ms}}", f"bodies.link.rods={options.rods}"]
    figure = Figure(figsize=(7, 4.6), layout="constrained")
    axes = figure.subplots()
    print("stiffness      clearance   S from supported   deepest   part of the clearance")
    for stiffness, colour in STIFFNESSES.items():
        law = f"joints.sleeve.law.stiffness={stiffness}"
        held = end_of(
            simulate(load_scene(MODELS / "supported.yaml", [*common, law]), measure=False)
        )
        rows = []
        for clearance in CLEARANCES:
            settings = [*common, law, f"joints.sleeve.clearance={clearance}"]
            result = simulate(load_scene(MODELS / "clearance.yaml", settings), measure=False)
            away = float(np.linalg.norm(end_of(result) - held, axis=1).max())
            deepest = result.sleeves["sleeve"].deepest
            rows.append((away, deepest))
            print(
                f"{stiffness:8.0e} N/m  {clearance:8.0e} m  {away:14.2e} m  {deepest:.1e} m"
                f"  {deepest / clearance:8.3g}",
                flush=True,
            )
        away, deep = np.array(rows).T
        axes.loglog(CLEARANCES, away, "o-", color=colour, label=f"S, walls {stiffness:.0e} N/m")
        axes.loglog(CLEARANCES, deep, ":", color=colour, label="deepest in a wall, the same")
    axes.loglog(
        CLEARANCES, CLEARANCES, color="#999999", linewidth=0.8, label="the clearance itself"
    )
    axes.set_xlabel("clearance (m)")
    axes.set_ylabel("largest distance of S from the supported link (m)")
    axes.set_title(
        f"A closing clearance tends to the supported link (n = {options.rods})", loc="left"
    )
    axes.grid(color="#E3E3E3")
    axes.legend(fontsize=8)
    options.out.mkdir(parents=True, exist_ok=True)
    figure.savefig(options.out / "closing_clearance.png", dpi=130)
    print(f"written: {options.out / 'closing_clearance.png'}")


def end_of(result: Result) -> FloatArray:
    """Place of S (N, 2) at even instants, m."""
    seen = path(result, "link.end")
    return between_samples(seen.time, seen.position, seen.velocity, np.arange(0, END, 5e-4))


if __name__ == "__main__":
    main()

"""Let the clearance close: the link tends to the supported one, until the walls take over.

  .venv/bin/python scripts/closing_clearance.py
  .venv/bin/python scripts/closing_clearance.py --out docs --rods 4

Draws how far S is from that of rods held on the guide's axis (the same hinges, before the strike)
over the clearance, for three stiffnesses of the walls, and how deep the walls give way. Writes
closing_clearance in the formats asked for. Takes about five minutes.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from exudyn_flexlink import load_scene, simulate
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.cli.arguments import add_figures
from exudyn_flexlink.cli.figures import look_of
from exudyn_flexlink.observables import separation
from exudyn_flexlink.plots.frame import (
    BLACK,
    GREEN,
    GREY,
    PURPLE,
    SCREEN,
    ShownFigure,
    Style,
    styled,
)
from exudyn_flexlink.plots.panels import letter, sized

CLEARANCES = (5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5)  # m
STIFFNESSES = {1e4: GREEN, 1e5: PURPLE, 1e6: BLACK}  # N/m, and colours
END = 0.3  # s: just before the strike
TIMES = np.arange(0, END, 5e-4)  # s


def main() -> None:
    """Run all clearances and stiffnesses, print a table and draw it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--out", type=Path, default=Path("docs"))
    parser.add_argument("--rods", type=int, default=4)
    add_figures(parser)
    options = parser.parse_args()
    common = [f"run={{duration: {END}, sample: 0.5 ms}}", f"bodies.link.rods={options.rods}"]
    found = {}
    print("stiffness      clearance   S from supported   deepest   part of the clearance")
    for stiffness in STIFFNESSES:
        law = f"joints.sleeve.law.stiffness={stiffness}"
        held = simulate(load_scene("supported", [*common, law]), measure=False)
        rows = []
        for clearance in CLEARANCES:
            settings = [*common, law, f"joints.sleeve.clearance={clearance}"]
            result = simulate(load_scene("clearance", settings), measure=False)
            away = float(separation(result, held, TIMES, ["link.end"]).max())
            deepest = result.sleeves["sleeve"].deepest
            rows.append((away, deepest))
            print(
                f"{stiffness:8.0e} N/m  {clearance:8.0e} m  {away:14.2e} m  {deepest:.1e} m"
                f"  {deepest / clearance:8.3g}",
                flush=True,
            )
        found[stiffness] = np.array(rows).T
    options.out.mkdir(parents=True, exist_ok=True)
    look_of(options).save(draw, found, options.out, "closing_clearance")
    print(f"written: {options.out / 'closing_clearance'}")


@styled
def draw(found: dict[float, FloatArray], *, style: Style = SCREEN) -> Figure:
    """Draw distances of S and depths in the walls, (2, clearances) m, for every stiffness.

    Distances hardly depend on the stiffness: softer walls have broader lines, for all to be seen.
    """
    figure = ShownFigure(figsize=(style.width, 0.55 * style.width + 1), dpi=style.dpi,
                    layout="constrained")  # fmt: skip
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    for i, (stiffness, series) in enumerate(found.items()):
        rank = len(found) - 1 - i
        for axes, values in zip(panels, series, strict=True):
            axes.loglog(
                CLEARANCES, values, "o-", color=STIFFNESSES[stiffness],
                linewidth=sized(1.0 + 2.2 * rank), markersize=sized(3 + 4 * rank),
                alpha=0.45 if rank else 1.0, label=f"walls {stiffness:.0e} N/m",
            )  # fmt: skip
    for axes, what in zip(panels, ("S from the supported link", "deepest in a wall"), strict=True):
        axes.loglog(CLEARANCES, CLEARANCES, color=GREY, linestyle=":", label="the clearance itself")
        axes.set_xlabel("clearance (m)")
        axes.set_title(what, loc="left")
    panels[0].set_ylabel("length (m)")
    letter(panels)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2 if style.narrow else 4)
    return figure


if __name__ == "__main__":
    main()

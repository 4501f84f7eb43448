"""Show what play between pin and slot does to the paper's mechanism, beside play in the guide.

  .venv/bin/python scripts/slot_play.py
  .venv/bin/python scripts/slot_play.py --out docs --clearance 0.2e-3

Draws over one turn how far S is from where it is without play, for a rigid link: with play in the
slot, in the guide, and in both; and where the pin stands across its slot. Prints the largest
distances up to the strike. Writes slot_play in the formats asked for. Takes about two minutes.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from exudyn_flexlink import load_scene, simulate
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.cli.arguments import add_figures
from exudyn_flexlink.cli.figures import look_of
from exudyn_flexlink.mechanism import approach, build_mechanism
from exudyn_flexlink.observables import contact_totals, crank_angle, path
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
from exudyn_flexlink.result import Result

COLOURS = {"the slot": PURPLE, "the guide": GREEN, "both": BLACK}
LAW = "{stiffness: 1.0e6, restitution: 0.5}"
COMMON = ["bodies.link.rods=1", "run={turns: 1, of: crank, sample: 0.5 ms}"]
TIGHT = "accuracy={tolerance: 1.0e-7}"  # m: play is small


class Strayed(NamedTuple):
    """A run over one turn: the crank's angles (n,), rad, and how far (n,), m, S is off then.

    `across` (n,), m, is where the pin is in its slot, to the left; None without play there.
    """

    turned: FloatArray
    away: FloatArray
    across: FloatArray | None


def main() -> None:
    """Run all four mechanisms, print a table and draw them."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--out", type=Path, default=Path("docs"))
    parser.add_argument("--clearance", type=float, default=2e-4, metavar="M", help="on each side")
    add_figures(parser)
    options = parser.parse_args()
    played = {joint: _play(joint, options.clearance) for joint in ("pin", "sleeve")}
    settings = {
        "the slot": played["pin"],
        "the guide": played["sleeve"],
        "both": [*played["pin"], *played["sleeve"]],
    }
    ideal = simulate(load_scene("no_clearance", [*COMMON, TIGHT]), measure=False)
    struck = next(iter(ideal.intervals["strike"])).begin
    found = {}
    print("| play in | S off, up to the strike | touches | impacts | time free |")
    print("|---|---|---|---|---|")
    for name, play in settings.items():
        result = simulate(load_scene("no_clearance", [*COMMON, TIGHT, *play]), measure=False)
        found[name] = _strayed(result, ideal)
        largest = found[name].away[result.time < struck].max()
        joint = "sleeve" if name == "the guide" else "pin"
        totals = contact_totals(result, joint)
        free = next(iter(totals.fractions.values()))
        print(
            f"| {name} | {1e3 * largest:.2g} mm | {totals.touches} | {totals.impacts} | "
            f"{100 * free:.0f} % |",
            flush=True,
        )
    options.out.mkdir(parents=True, exist_ok=True)
    look_of(options).save(draw, found, options.out, "slot_play")


def _play(joint: str, clearance: float) -> list[str]:
    return [f"joints.{joint}.clearance={clearance}", f"joints.{joint}.law={LAW}"]


def _strayed(result: Result, ideal: Result) -> Strayed:
    point, straight = (path(run, "link.end").position for run in (result, ideal))
    there = [np.interp(result.time, ideal.time, column) for column in straight.T]
    away = np.hypot(*(point.T - there))
    mechanism, across = build_mechanism(result.scene), None
    for groove in mechanism.grooves:  # in the first lap, of which the left wall is the first
        gap = approach(groove.contacts[0], result.poses, result.rates, 0.0).gap
        across = groove.clearance - gap
    return Strayed(crank_angle(result), away, across)


@styled
def draw(found: dict[str, Strayed], *, style: Style = SCREEN) -> Figure:
    """Draw how far S strays, above, and where the pin is in its slot, below."""
    figure = ShownFigure(figsize=(style.width, 0.75 * style.width + 0.6), dpi=style.dpi,
                    layout="constrained")  # fmt: skip
    above, below = figure.subplots(2, 1, sharex=True)
    for name, run in found.items():
        degrees = np.degrees(run.turned)
        look = {"color": COLOURS[name], "linewidth": sized(1.0)}
        above.plot(degrees, 1e3 * run.away, label=f"play in {name}", **look)
        if run.across is not None:
            below.plot(degrees, 1e3 * run.across, **look)
    below.axhline(0, color=GREY, linewidth=sized(0.8))
    above.set_title("S from where it is without play", loc="left")
    below.set_title("the pin in its slot, to the left of the curve", loc="left")
    above.set_ylabel("distance (mm)")
    below.set_ylabel("across (mm)")
    below.set_xlabel("crank angle (deg)")
    letter([above, below])
    handles, labels = above.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


if __name__ == "__main__":
    main()

"""Penalty contact against the impulsive impact of the paper, in the first strike of its mechanism.

Usage:
  .venv/bin/python scripts/impact_models.py stiffness [--out docs]  penalty to impulse, stiffer
  .venv/bin/python scripts/impact_models.py rods [--out docs]       over the number of rods

The first prints and draws how the lever's answer to the first strike tends to that of the impulse
as the contact's stiffness k grows. The second prints and draws the answer for 2 to 40 rods under
both models. All runs are those of `models/no_clearance.yaml` from its own start, with nothing else
changed, and with their error measured: one that is not known to the digits that are printed stops
the script. Takes minutes.
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from exudyn_flexlink import load_scene
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.cli.arguments import add_figures
from exudyn_flexlink.cli.figures import Look, look_of
from exudyn_flexlink.effects import with_impact
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.observables import lever_response, strikes
from exudyn_flexlink.plots.frame import BLACK, GREEN, PURPLE, SCREEN, ShownFigure, Style, styled
from exudyn_flexlink.plots.panels import legend_outside, letter, sized

STIFFNESS = 2e4  # N/m, of the model
FACTORS = (1, 4, 16, 64, 256, 1024)
RODS = (2, 3, 4, 5, 7, 10, 14, 20, 28, 40)
WATCHED = {"least": "least angle (rad)", "rate": "rate after 0.2 ms (rad/s)"}  # of the lever
KNOWN = 1e-7  # m, of points: 3e-6 rad of the lever, 30 mm long
SOON = 2e-4  # s after the first touch: the first impact is over, the link has hardly moved
COLUMNS = (
    "lever, least angle",
    "greatest",
    "rate after 0.2 ms",
    "impulse",
    "energy lost",
)
COLOURS = {"penalty": GREEN, "impulse": PURPLE}  # none of an engine


@dataclass(frozen=True)
class Answer:
    """What the first strike does to the lever."""

    least: float  # angle, rad
    greatest: float  # angle, rad
    rate: float  # rad/s soon after the first touch
    impulse: float  # N s
    lost: float  # J
    seconds: float  # of both runs


def answer(rods: int, impact: str, factor: float = 1.0) -> Answer:
    """Simulate the first strike with a contact stiffened by `factor`.

    Raises:
        ValueError: the run is not known to the digits that are printed.

    """
    settings = [
        "run.turns=0.54",  # the strike is at half a turn, and the lever's first swing ends by then
        "run.sample=0.02 ms",  # between two, the rate is a straight line
        f"accuracy.tolerance={KNOWN / 10}",
        "bodies.link.hinges.stiffness=beam",
        f"bodies.link.rods={rods}",
        f"contacts.strike.law.stiffness={STIFFNESS * factor}",
    ]
    result = simulate(with_impact(load_scene("no_clearance", settings), impact), measure=True)
    if not result.error.largest <= KNOWN:
        raise ValueError(f"n = {rods}, {impact}, factor {factor:g}: {result.warnings}")
    response, first = lever_response(result, "strike"), strikes(result, "strike")[0]
    rate = np.interp(first.begin + SOON, response.time, response.rate)
    return Answer(
        response.least[0],
        response.greatest[0],
        float(rate),
        first.impulse,
        first.energy_lost,
        result.timings["solve"] + result.timings["second run"],
    )


def stiffness(out: Path, look: Look) -> None:
    """Print and draw how penalty tends to impulse."""
    rods = 5
    with ProcessPoolExecutor(2) as pool:
        target = pool.submit(answer, rods, "impulse")
        runs = [pool.submit(answer, rods, "penalty", factor) for factor in FACTORS]
        limit, found = target.result(), [run.result() for run in runs]
    rows = [
        [f"{STIFFNESS * factor:.3g} N/m", *_cells(one)]
        for factor, one in zip(FACTORS, found, strict=True)
    ]
    rows.append(["impulse", *_cells(limit)])
    tell(f"Stiffness of the contact, n = {rods}, `beam`", ["k"], rows)
    k = STIFFNESS * np.array(FACTORS)
    off = {
        name: np.array([getattr(one, name) - getattr(limit, name) for one in found])
        for name in WATCHED
    }
    look.save(draw_stiffness, (k, off), out, "penalty_to_impulse")


@styled
def draw_stiffness(
    found: tuple[FloatArray, dict[str, FloatArray]], *, style: Style = SCREEN
) -> Figure:
    """Draw penalty minus impulse over the stiffness; negative differences are hollow."""
    k, off = found
    size = style.width, style.scale * 5.5
    figure = ShownFigure(figsize=size, dpi=style.dpi, layout="constrained")
    panels = figure.subplots(len(off), 1, sharex=True)
    for axes, (name, values) in zip(panels, off.items(), strict=True):
        axes.loglog(k, np.abs(values), color=BLACK, linewidth=0.8)
        for some, face, label in ((values > 0, BLACK, "greater"), (values < 0, "white", "less")):
            axes.loglog(k[some], np.abs(values[some]), "o", color=BLACK, mfc=face,
                        label=f"penalty {label} than impulse" if some.any() else None)  # fmt: skip
        axes.set_ylabel(f"difference of\n{WATCHED[name]}")
        legend_outside(axes)
    panels[-1].set_xlabel("contact stiffness k (N/m)")
    letter(panels)
    return figure


def rods(out: Path, look: Look) -> None:
    """Print and draw the strike over the number of rods, under both models."""
    with ProcessPoolExecutor(2) as pool:
        runs = {(n, impact): pool.submit(answer, n, impact) for n in RODS for impact in COLOURS}
        found = {}
        for key, run in runs.items():
            found[key] = run.result()
            print(f"n = {key[0]}, {key[1]}: {found[key].seconds:.0f} s", file=sys.stderr)
    rows = [[str(n), impact, *_cells(one)] for (n, impact), one in found.items()]
    tell("Number of rods, `beam`", ["n", "impact"], rows)
    look.save(draw_rods, found, out, "rods_and_strike")


@styled
def draw_rods(found: dict[tuple[int, str], Answer], *, style: Style = SCREEN) -> Figure:
    """Draw the strike over the number of rods, under both models."""
    size = style.width, style.scale * 6.5
    figure = ShownFigure(figsize=size, dpi=style.dpi, layout="constrained")
    top, bottom = figure.subplots(2, sharex=True)
    for (impact, colour), broad in zip(COLOURS.items(), (2.5, 1.0), strict=True):
        ones = [found[n, impact] for n in RODS]
        top.plot(RODS, [abs(one.least) for one in ones], "o-", color=colour, label=impact,
                 linewidth=sized(broad), markersize=sized(3 + 2 * broad))  # fmt: skip
        bottom.plot(RODS, [one.lost * 1e3 for one in ones], "o-", color=colour, label=impact,
                 linewidth=sized(broad), markersize=sized(3 + 2 * broad))  # fmt: skip
    top.set(ylabel="largest angle of lever (rad)")
    bottom.set(xlabel="number of rods n", ylabel="energy lost in the strike (mJ)", xscale="log")
    bottom.set_xticks(RODS, [str(n) for n in RODS])
    bottom.minorticks_off()
    legend_outside(top)
    letter([top, bottom])
    return figure


def tell(title: str, first: list[str], rows: list[list[str]]) -> None:
    """Print a table under its title."""
    columns = [*first, *COLUMNS]
    print(f"**{title}**\n")
    for row in (columns, ["---"] * len(columns), *rows):
        print(f"| {' | '.join(row)} |")
    print()


def _cells(one: Answer) -> list[str]:
    angles = [f"{one.least:+.5f} rad", f"{one.greatest:+.5f} rad", f"{one.rate:+.2f} rad/s"]
    return [*angles, f"{1e3 * one.impulse:.3f} mN s", f"{1e3 * one.lost:.3f} mJ"]


def main() -> None:
    """Run one of the two studies."""
    studies = {"stiffness": stiffness, "rods": rods}
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("study", choices=studies)
    parser.add_argument("--out", type=Path, default=Path("docs"), help="folder of the figure")
    add_figures(parser)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    studies[options.study](options.out, look_of(options))


if __name__ == "__main__":
    main()

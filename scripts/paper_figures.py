"""Draw the paper's Fig. 3, 4 and 5 again: (a) without and (b) with clearance, side by side.

  .venv/bin/python scripts/paper_figures.py
  .venv/bin/python scripts/paper_figures.py --out docs --engine exudyn --tolerance 1e-6 --turns 2
  .venv/bin/python scripts/paper_figures.py --out paper --format pdf --style print

Writes paper_fig3 (coordinates of S), paper_fig4 (the "divergence" in both readings of the paper:
the struck lever's response, and how far runs part whose links start 1e-6 rad apart, or lap pairs
that follow each other) and paper_fig5 (S in polar form).

With clearance, differences multiply from touch to touch, those that the solver makes, too. A third
run, of the same start but ten times the tolerance, tells how far these may be: from where it is as
far away as the neighbouring start, the distance says nothing of the mechanism, and Fig. 4 is
shaded. At the models' own tolerances that is from the start on. Takes two minutes.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from exudyn_flexlink import load_scene, simulate
from exudyn_flexlink.cli.figures import add_figures, look_of
from exudyn_flexlink.continuing import continued, moved, state_at
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.observables import (
    LeverResponse,
    between_samples,
    crank_angle,
    lever_response,
    path,
)
from exudyn_flexlink.plots.laps import by_lap, lap_label, lap_style, shade_laps
from exudyn_flexlink.plots.motion import X_COLOURS, draw_radius, radial_scale
from exudyn_flexlink.plots.panels import BEYOND, columns_of
from exudyn_flexlink.plots.style import BLACK, GREEN, GREY, PURPLE, SCREEN, Style, styled
from exudyn_flexlink.result import Result

FloatArray = NDArray[np.float64]

MODELS = Path(__file__).parent.parent / "models"
SCENES = {"(a) without clearance": "no_clearance", "(b) clearance 5 mm": "clearance"}
START = 1e-6  # rad, of every rod of the link: a neighbouring start
LAPS = 2  # after which the mechanism does the same again
SAMPLE = "run.sample=0.2 ms"
TOLERANCE = 1e-12  # m: the solver's error stays below what two starts make, for most of four turns
LOOSER = 10.0  # times the tolerance: such a run is no less far away than the first one's error


@dataclass(frozen=True)
class Case:
    """A run, its neighbour, and S at even instants."""

    name: str
    result: Result
    time: FloatArray
    end: FloatArray  # (N, 2), m
    neighbour: FloatArray  # (N, 2), m
    unsure: FloatArray  # (N,), m: how far S is from that of a looser tolerance
    lever: LeverResponse

    @property
    def apart(self) -> FloatArray:
        """Distance (N,) of S in both runs, m."""
        return np.asarray(np.linalg.norm(self.end - self.neighbour, axis=1))

    @property
    def told_until(self) -> float | None:
        """Instant (s) from which on the solver's error is as large as what is shown, or None."""
        largest = np.maximum.accumulate(self.unsure)
        doubtful = np.flatnonzero(largest >= np.maximum.accumulate(self.apart))
        doubtful = doubtful[self.time[doubtful] > 0]
        return float(self.time[doubtful[0]]) if len(doubtful) else None

    @property
    def position(self) -> FloatArray:
        """S (samples, 2) at the run's own samples, mm."""
        return 1e3 * path(self.result, "link.end").position


def main() -> None:
    """Run both scenes three times, and draw."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--out", type=Path, default=MODELS.parent / "docs")
    parser.add_argument("--engine", choices=("exudyn", "lagrangian"), default="lagrangian")
    parser.add_argument("--tolerance", type=float, default=TOLERANCE, help="of all runs, m")
    parser.add_argument("--turns", type=float, default=4.0)
    add_figures(parser)
    options = parser.parse_args()
    cases = [case(name, model, options) for name, model in SCENES.items()]
    options.out.mkdir(parents=True, exist_ok=True)
    for number, draw in {3: coordinates, 4: divergence, 5: polar}.items():
        look_of(options).save(draw, cases, options.out, f"paper_fig{number}")
        print(f"written: {options.out / f'paper_fig{number}'}")


def case(name: str, model: str, options: argparse.Namespace) -> Case:
    """Run a model, once more from a neighbouring start, and once more at a looser tolerance."""
    scenes = [
        load_scene(
            MODELS / f"{model}.yaml",
            [f"run.turns={options.turns}", SAMPLE, f"accuracy.tolerance={x * options.tolerance}"],
        )
        for x in (1, LOOSER)
    ]
    result, check = (simulate(scene, options.engine, measure=False) for scene in scenes)
    # A crank that starts ahead would only be ahead of the same motion: the link has to be moved.
    state = state_at(result, 0.0)
    state[assemble_scene(result.scene).mechanism.parts_of("link"), 2] += START
    other = simulate(moved(continued(result, 0.0), state), options.engine, measure=False)
    time = np.arange(0.0, min(run.time[-1] for run in (result, other, check)), 2e-4)
    end = end_of(result, time)
    unsure = np.linalg.norm(end_of(check, time) - end, axis=1)
    lever = lever_response(result, "strike")
    seen = Case(name, result, time, end, end_of(other, time), unsure, lever)
    print(
        f"{name}: links start {START:.0e} rad apart, S at most {seen.apart.max():.1e} m apart; "
        f"told until {seen.told_until or seen.time[-1]:.3g} s of {seen.time[-1]:.3g} s"
    )
    return seen


def end_of(result: Result, time: FloatArray) -> FloatArray:
    """Place of S (N, 2) at instants, m."""
    seen = path(result, "link.end")
    return between_samples(seen.time, seen.position, seen.velocity, time)


def panels(
    cases: list[Case], rows: int, height: float, style: Style, **more: Any
) -> tuple[Figure, NDArray[Any]]:
    """Two columns of axes, one for each case, which they name."""
    size = style.width, (0.75 if style.narrow else 1.0) * height
    figure = Figure(figsize=size, dpi=style.dpi, layout="constrained")
    axes = figure.subplots(rows, len(cases), sharey="row", squeeze=False, **more)
    for column, seen in zip(axes.T, cases, strict=True):
        column[0].set_title(seen.name, loc="left")
    return figure, axes


def name_below(figure: Figure, axes: Axes) -> None:
    """Put one legend below all, where it covers nothing."""
    handles, labels = axes.get_legend_handles_labels()
    ncols = columns_of(labels, figure, part=0.9)
    figure.legend(handles, labels, loc="outside lower center", ncols=ncols)


@styled
def coordinates(cases: list[Case], *, style: Style = SCREEN) -> Figure:
    """Fig. 3: both coordinates of S over the crank angle, lap by lap."""
    figure, axes = panels(cases, 2, 5.6, style, sharex=True)
    for column, seen in zip(axes.T, cases, strict=True):
        every = list(by_lap(seen.result))
        places = [np.degrees(lap.turned) for lap in every]
        for row, one in enumerate(column):
            series = seen.position[:, row]
            shade_laps(one, seen.result, places, every, series[:, None])
            for x, lap in zip(places, every, strict=True):
                look = lap_style(lap.number, LAPS, every[-1].number, X_COLOURS)
                label = lap_label(lap.number, LAPS, every[-1].number)
                one.plot(x, series[lap.samples], label=label or None, **look)
        column[-1].set_xlabel("crank angle in the lap (degrees)")
        column[-1].set_xticks(range(0, 361, 90))
    for row, word in enumerate("xy"):
        axes[row, 0].set_ylabel(f"$S_{word}$ (mm)")
    name_below(figure, axes[0, -1])
    return figure


@styled
def divergence(cases: list[Case], *, style: Style = SCREEN) -> Figure:
    """Fig. 4: the lever's response; how far neighbouring runs, and lap pairs, are apart."""
    figure, axes = panels(cases, 2, 5.6, style, sharex=True)
    for (upper, lower), seen in zip(axes.T, cases, strict=True):
        upper.plot(seen.lever.time, seen.lever.angle, color=BLACK, linewidth=0.8)
        _separations(lower, seen)
        lower.set_xlabel("time (s)")
    axes[0, 0].set_ylabel("angle of the lever (rad)")
    axes[1, 0].set_ylabel("distance of S (mm)")
    axes[1, 0].set_ylim(1e-10, 1e2)
    name_below(figure, axes[1, -1])
    return figure


def _separations(axes: Axes, seen: Case) -> None:
    _distance(axes, seen.time, seen.apart, GREEN, f"links start {START:.0e} rad apart")
    label = f"same start, {LOOSER:.0f} times the tolerance"
    _distance(axes, seen.time, seen.unsure, GREY, label)
    if seen.told_until is not None:
        label = "the solver's error is as large"
        axes.axvspan(seen.told_until, seen.time[-1], label=label, zorder=0, **BEYOND)
    angle = np.interp(seen.time, seen.result.time, crank_angle(seen.result))
    pair = float(np.interp(2 * np.pi * LAPS, angle, seen.time))
    first = seen.time + pair <= seen.time[-1]
    there = np.stack(
        [np.interp(seen.time[first] + pair, seen.time, column) for column in seen.end.T], axis=1
    )
    away = np.linalg.norm(there - seen.end[first], axis=1)
    _distance(axes, seen.time[first], away, PURPLE, f"laps {LAPS + 1}, {LAPS + 2} from laps 1, 2")


def _distance(axes: Axes, time: FloatArray, away: FloatArray, colour: str, label: str) -> None:
    """Draw a distance (m) in mm on a log axis."""
    shown = np.where(away > 0, 1e3 * away, np.nan)
    axes.semilogy(time, shown, color=colour, linewidth=0.8, label=label)


@styled
def polar(cases: list[Case], *, style: Style = SCREEN) -> Figure:
    """Fig. 5: distance of S from O over the crank angle."""
    figure, axes = panels(cases, 1, 4.4, style, subplot_kw={"projection": "polar"})
    radii = [np.linalg.norm(seen.position, axis=1) for seen in cases]
    for one, seen, radius in zip(axes[0], cases, radii, strict=True):
        draw_radius(one, seen.result, radius)
        radial_scale(one, np.concatenate(radii), "OS (mm)")
    name_below(figure, axes[0, -1])
    return figure


if __name__ == "__main__":
    main()

"""Draw the paper's Fig. 3, 4 and 5 again: (a) without and (b) with clearance, side by side.

  .venv/bin/python scripts/paper_figures.py
  .venv/bin/python scripts/paper_figures.py --out docs --engine lagrangian --turns 4
  .venv/bin/python scripts/paper_figures.py --out paper --format pdf --style print

Writes paper_fig3 (coordinates of S), paper_fig4 (the "divergence" in both readings of the paper:
the struck lever's response, and how far runs part that start 1e-6 rad apart, or lap pairs that
follow each other) and paper_fig5 (S in polar form). Takes about three minutes.
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
from exudyn_flexlink.observables import (
    LeverResponse,
    between_samples,
    crank_angle,
    lever_response,
    path,
)
from exudyn_flexlink.plots.laps import by_lap, lap_label, lap_style, shade_laps
from exudyn_flexlink.plots.motion import X_COLOURS, draw_radius, radial_scale
from exudyn_flexlink.plots.panels import columns_of, shade_beyond
from exudyn_flexlink.plots.style import BLACK, GREEN, PURPLE, SCREEN, Style, styled
from exudyn_flexlink.result import Result

FloatArray = NDArray[np.float64]

MODELS = Path(__file__).parent.parent / "models"
SCENES = {"(a) without clearance": "no_clearance", "(b) clearance 5 mm": "clearance"}
START = 1e-6  # rad, of the crank: a neighbouring start
LAPS = 2  # after which the mechanism does the same again
SAMPLE = "run.sample=0.2 ms"


@dataclass(frozen=True)
class Case:
    """A run, its neighbour, and S at even instants."""

    name: str
    result: Result
    time: FloatArray
    end: FloatArray  # (N, 2), m
    neighbour: FloatArray  # (N, 2), m
    lever: LeverResponse

    @property
    def position(self) -> FloatArray:
        """S (samples, 2) at the run's own samples, mm."""
        return 1e3 * path(self.result, "link.end").position


def main() -> None:
    """Run both scenes twice, and draw."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--out", type=Path, default=MODELS.parent / "docs")
    parser.add_argument("--engine", choices=("exudyn", "lagrangian"), default="exudyn")
    parser.add_argument("--turns", type=float, default=4.0)
    add_figures(parser)
    options = parser.parse_args()
    cases = [case(name, model, options) for name, model in SCENES.items()]
    options.out.mkdir(parents=True, exist_ok=True)
    for number, draw in {3: coordinates, 4: divergence, 5: polar}.items():
        look_of(options).save(draw, cases, options.out, f"paper_fig{number}")
        print(f"written: {options.out / f'paper_fig{number}'}")


def case(name: str, model: str, options: argparse.Namespace) -> Case:
    """Run a model, and once more from a neighbouring start."""
    settings = [f"run.turns={options.turns}", SAMPLE]
    file = MODELS / f"{model}.yaml"
    result = simulate(load_scene(file, settings), options.engine)
    nearby = [*settings, f"initial={{angles: {{guide: {START}}}}}"]
    other = simulate(load_scene(file, nearby), options.engine, measure=False)
    time = np.arange(0.0, min(result.time[-1], other.time[-1]), 2e-4)
    return Case(
        name, result, time, end_of(result, time), end_of(other, time),
        lever_response(result, "strike"),
    )  # fmt: skip


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
        for one in (upper, lower):
            shade_beyond(one, seen.result, seen.result.time)
        upper.plot(seen.lever.time, seen.lever.angle, color=BLACK, linewidth=0.8)
        _separations(lower, seen)
        lower.set_xlabel("time (s)")
    axes[0, 0].set_ylabel("angle of the lever (rad)")
    axes[1, 0].set_ylabel("distance of S (mm)")
    axes[1, 0].set_ylim(1e-6, 1e2)
    name_below(figure, axes[1, -1])
    return figure


def _separations(axes: Axes, seen: Case) -> None:
    apart = 1e3 * np.linalg.norm(seen.end - seen.neighbour, axis=1)
    axes.semilogy(
        seen.time, np.where(apart > 0, apart, np.nan), color=GREEN, linewidth=0.8,
        label=f"start {START:.0e} rad apart",
    )  # fmt: skip
    angle = np.interp(seen.time, seen.result.time, crank_angle(seen.result))
    pair = float(np.interp(2 * np.pi * LAPS, angle, seen.time))
    first = seen.time + pair <= seen.time[-1]
    there = np.stack(
        [np.interp(seen.time[first] + pair, seen.time, column) for column in seen.end.T], axis=1
    )
    away = 1e3 * np.linalg.norm(there - seen.end[first], axis=1)
    axes.semilogy(
        seen.time[first], np.where(away > 0, away, np.nan), color=PURPLE, linewidth=0.8,
        label=f"laps {LAPS + 1}, {LAPS + 2} from laps 1, 2",
    )  # fmt: skip


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

"""Draw the paper's Fig. 3, 4 and 5 again: (a) without and (b) with clearance.

  .venv/bin/python scripts/paper_figures.py
  .venv/bin/python scripts/paper_figures.py --engine exudyn --tolerance 1e-6 --turns 2
  .venv/bin/python scripts/paper_figures.py --out paper --format pdf --style print

Writes paper_fig3 (coordinates of S), paper_fig4 (the "divergence" in both readings of the paper:
the struck lever's response, and how far runs part whose links start 1e-6 rad apart, or lap pairs
that follow each other) and paper_fig5 (S in polar form): (a) beside (b), and each panel in a file
of its own, paper_fig3a to paper_fig5b, on the same scales. With `--style print` there are only the
panels, each as wide as one column of a page, which has no room for two.

With clearance, differences multiply from touch to touch, those that the solver makes, too. A third
run, of the same start but ten times the tolerance, tells how far these may be: from where it is as
far away as the neighbouring start, the distance says nothing of the mechanism, and Fig. 4 is
shaded. At the models' own tolerances that is from the start on. Takes two minutes.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes

from exudyn_flexlink import load_scene, simulate
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.cli.arguments import add_figures
from exudyn_flexlink.cli.figures import Look, look_of
from exudyn_flexlink.continuing import continued, moved, state_at
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.observables import (
    LeverResponse,
    crank_angle,
    lever_response,
    path,
    positions,
    separation,
)
from exudyn_flexlink.plots.frame import BLACK, GREEN, GREY, PURPLE, SCREEN, STYLES, Style, styled
from exudyn_flexlink.plots.motion import by_lap, draw_radius, lap_look, radial_scale, shade_laps
from exudyn_flexlink.plots.panels import BEYOND, columns_of
from exudyn_flexlink.result import Result

S = "link.end"
SCENES = {"a": ("no_clearance", "without clearance"), "b": ("clearance", "clearance 5 mm")}
START = 1e-6  # rad, of every rod of the link: a neighbouring start
LAPS = 2  # after which the mechanism does the same again
SAMPLE = "run.sample=0.2 ms"
TOLERANCE = 1e-12  # m: the solver's error stays below what two starts make, for most of four turns
MARGIN = 0.05  # of what is shown, above and below it
LOOSER = 10.0  # times the tolerance: such a run is no less far away than the first one's error


@dataclass(frozen=True)
class Case:
    """A run, S at even instants, and its distance there in others; `letter` is of its panels."""

    letter: str
    name: str
    result: Result
    time: FloatArray
    end: FloatArray  # (N, 2), m
    apart: FloatArray  # (N,), m: how far S is from that of a neighbouring start
    unsure: FloatArray  # (N,), m: how far S is from that of a looser tolerance
    lever: LeverResponse

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
        return 1e3 * path(self.result, S).position

    @property
    def radius(self) -> FloatArray:
        """Distance (samples,) of S from O at the run's own samples, mm."""
        return np.asarray(np.linalg.norm(self.position, axis=1))


def main() -> None:
    """Run both scenes three times, and draw."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--out", type=Path, default=Path("runs/paper"))
    parser.add_argument("--engine", choices=("exudyn", "lagrangian"), default="lagrangian")
    parser.add_argument("--tolerance", type=float, default=TOLERANCE, help="of all runs, m")
    parser.add_argument("--turns", type=float, default=4.0)
    add_figures(parser)
    options = parser.parse_args()
    cases = [case(letter, *scene, options) for letter, scene in SCENES.items()]
    options.out.mkdir(parents=True, exist_ok=True)
    for name in save_all(cases, options.out, look_of(options)):
        print(f"written: {options.out / name}")


def case(letter: str, model: str, name: str, options: argparse.Namespace) -> Case:
    """Run a model, once more from a neighbouring start, and once more at a looser tolerance."""
    scenes = [
        load_scene(
            model,
            [f"run.turns={options.turns}", SAMPLE, f"accuracy.tolerance={x * options.tolerance}"],
        )
        for x in (1, LOOSER)
    ]
    result, check = (simulate(scene, options.engine, measure=False) for scene in scenes)
    # A crank that starts ahead would only be ahead of the same motion: the link has to be moved.
    state = state_at(result, 0.0)
    state[assemble_scene(result.scene).mechanism.bodies["link"], 2] += START
    other = simulate(moved(continued(result, 0.0), state), options.engine, measure=False)
    time = np.arange(0.0, min(run.time[-1] for run in (result, other, check)), 2e-4)
    end = positions(result, [S], time)[:, 0]
    apart, unsure = (separation(result, run, time, [S]) for run in (other, check))
    lever = lever_response(result, "strike")
    seen = Case(letter, name, result, time, end, apart, unsure, lever)
    print(
        f"({letter}) {name}: links start {START:.0e} rad apart, "
        f"S at most {seen.apart.max():.1e} m apart; "
        f"told until {seen.told_until or seen.time[-1]:.3g} s of {seen.time[-1]:.3g} s"
    )
    return seen


@dataclass(frozen=True)
class Drawing:
    """A figure of the paper: a column of axes for each case, with a label for each row.

    `draw` fills the column of a case, on scales that fit all cases, `height` is in inches on a
    screen.
    """

    draw: Callable[[Sequence[Axes], Case, Sequence[Case]], None]
    labels: Sequence[str]
    height: float
    projection: str | None = None

    @styled
    def figure(
        self, shown: Sequence[Case], *, every: Sequence[Case], style: Style = SCREEN
    ) -> Figure:
        """Draw one panel, or some side by side, on the scales of `every` case."""
        size = style.width, (0.75 if style.narrow else 1.0) * self.height
        figure = Figure(figsize=size, dpi=style.dpi, layout="constrained")
        axes = figure.subplots(
            len(self.labels), len(shown), sharex=True, sharey="row", squeeze=False,
            subplot_kw={"projection": self.projection},
        )  # fmt: skip
        for column, seen in zip(axes.T, shown, strict=True):
            column[0].set_title(f"({seen.letter}) {seen.name}", loc="left")
            self.draw(column, seen, every)
        for one, label in zip(axes[:, 0], self.labels, strict=True):
            one.set_ylabel(label)
        handles, labels = axes[-1, -1].get_legend_handles_labels()
        ncols = columns_of(labels, figure, part=0.9)
        figure.legend(handles, labels, loc="outside lower center", ncols=ncols)
        return figure


def coordinates(column: Sequence[Axes], seen: Case, every: Sequence[Case]) -> None:
    """Fig. 3: both coordinates of S over the crank angle, lap by lap."""
    laps = list(by_lap(seen.result))
    places = [np.degrees(lap.turned) for lap in laps]
    for row, one in enumerate(column):
        series = seen.position[:, row]
        shade_laps(one, seen.result, places, laps, series[:, None])
        for x, lap in zip(places, laps, strict=True):
            one.plot(x, series[lap.samples], **lap_look(lap.number, LAPS, laps[-1].number))
        _room_for(one, [other.position[:, row] for other in every])
    column[-1].set_xlabel("crank angle in the lap (degrees)")
    column[-1].set_xticks(range(0, 361, 90))


def divergence(column: Sequence[Axes], seen: Case, every: Sequence[Case]) -> None:
    """Fig. 4: the lever's response; how far neighbouring runs, and lap pairs, are apart."""
    upper, lower = column
    upper.plot(seen.lever.time, seen.lever.value, color=BLACK, linewidth=0.8)
    _room_for(upper, [other.lever.value for other in every])
    _separations(lower, seen)
    lower.set_xlabel("time (s)")
    lower.set_ylim(1e-10, 1e2)


def _room_for(axes: Axes, series: Sequence[FloatArray]) -> None:
    """Let the y-axis show all of some series, whichever of them is drawn."""
    low, high = min(map(np.min, series)), max(map(np.max, series))
    margin = MARGIN * (high - low)
    axes.set_ylim(low - margin, high + margin)


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


def polar(column: Sequence[Axes], seen: Case, every: Sequence[Case]) -> None:
    """Fig. 5: distance of S from O over the crank angle."""
    [axes] = column
    assert isinstance(axes, PolarAxes)
    draw_radius(axes, seen.result, seen.radius)
    radial_scale(axes, np.concatenate([other.radius for other in every]), "OS (mm)")


FIGURES = {
    "paper_fig3": Drawing(coordinates, ["$S_x$ (mm)", "$S_y$ (mm)"], 5.6),
    "paper_fig4": Drawing(divergence, ["angle of the lever (rad)", "distance of S (mm)"], 5.6),
    "paper_fig5": Drawing(polar, [""], 4.4, "polar"),
}


def save_all(cases: Sequence[Case], folder: Path, look: Look) -> list[str]:
    """Draw all figures into a folder, panel by panel and side by side; returns their names."""
    shown: dict[str, Sequence[Case]] = {seen.letter: [seen] for seen in cases}
    if not STYLES[look.style].narrow:  # a column of a page has no room for two panels
        shown[""] = cases
    names = []
    for name, drawing in FIGURES.items():
        for letter, some in shown.items():
            look.save(partial(drawing.figure, every=cases), some, folder, name + letter)
            names.append(name + letter)
    return names


if __name__ == "__main__":
    main()

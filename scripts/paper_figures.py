"""Draw the paper's Fig. 3, 4 and 5 again: (a) without and (b) with clearance, side by side.

  .venv/bin/python scripts/paper_figures.py
  .venv/bin/python scripts/paper_figures.py --out docs --engine exudyn --tolerance 1e-6 --turns 2

Writes paper_fig3.png (coordinates of S), paper_fig4.png (the "divergence" in both readings of the
paper: the struck lever's response, and how far runs part that start 1e-6 rad apart, or lap pairs
that follow each other) and paper_fig5.png (S in polar form).

With clearance, errors multiply from touch to touch: where two runs part may be the solver's doing.
A third run, of the same start but ten times the tolerance, tells how far that may be: from where it
is as far away as the neighbouring start, the distance says nothing of the mechanism, and Fig. 4 is
shaded. At the models' own tolerances that is from the first strike on. Takes some minutes.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from exudyn_flexlink import load_scene, simulate
from exudyn_flexlink.observables import (
    LeverResponse,
    between_samples,
    crank_angle,
    lever_response,
    path,
)
from exudyn_flexlink.plots.frame import BLACK, BLUE, GREEN, GREY, ORANGE, RED
from exudyn_flexlink.result import Result

FloatArray = NDArray[np.float64]

MODELS = Path(__file__).parent.parent / "models"
SCENES = {"(a) without clearance": "no_clearance", "(b) clearance 5 mm": "clearance"}
START = 1e-6  # rad, of the crank: a neighbouring start
LAPS = 2  # after which the mechanism does the same again
SAMPLE = "run.sample=0.2 ms"
TOLERANCE = 1e-10  # m: two starts stay apart for themselves over most of four turns
LOOSER = (
    10.0  # times the tolerance: how far this run is away is no less than the error of the first
)
COLOURS = (BLUE, GREEN, ORANGE, RED)


@dataclass(frozen=True)
class Case:
    """A run, its neighbour, and S at even instants.

    `unsure` (N,) m is how far S is from that of a run of the same start and a looser tolerance.
    """

    name: str
    result: Result
    time: FloatArray
    end: FloatArray  # (N, 2), m
    neighbour: FloatArray  # (N, 2), m
    unsure: FloatArray
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
        return float(self.time[doubtful[0]]) if len(doubtful) else None


def main() -> None:
    """Run both scenes three times, and draw."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--out", type=Path, default=MODELS.parent / "docs")
    parser.add_argument("--engine", choices=("exudyn", "lagrangian"), default="lagrangian")
    parser.add_argument("--tolerance", type=float, default=TOLERANCE, help="of all runs, m")
    parser.add_argument("--turns", type=float, default=4.0)
    options = parser.parse_args()
    mpl.rcParams.update({"font.size": 9, "axes.grid": True, "grid.color": "#E3E3E3"})
    cases = [case(name, model, options) for name, model in SCENES.items()]
    options.out.mkdir(parents=True, exist_ok=True)
    for number, figure in {3: coordinates(cases), 4: divergence(cases), 5: polar(cases)}.items():
        file = options.out / f"paper_fig{number}.png"
        figure.savefig(file, dpi=130)
        print(f"written: {file}")


def case(name: str, model: str, options: argparse.Namespace) -> Case:
    """Run a model, once more from a neighbouring start, and once more at a looser tolerance."""
    tight, loose = (f"accuracy.tolerance={x * options.tolerance}" for x in (1, LOOSER))
    nearby = f"initial={{angles: {{guide: {START}}}}}"
    result, other, check = (
        simulate(
            load_scene(MODELS / f"{model}.yaml", [f"run.turns={options.turns}", SAMPLE, *more]),
            options.engine,
            measure=False,
        )
        for more in ([tight], [tight, nearby], [loose])
    )
    time = np.arange(0.0, min(run.time[-1] for run in (result, other, check)), 2e-4)
    end = end_of(result, time)
    seen = Case(
        name, result, time, end, end_of(other, time),
        np.linalg.norm(end_of(check, time) - end, axis=1), lever_response(result, "strike"),
    )  # fmt: skip
    print(
        f"{name}: starts {START:.0e} rad apart, S at most {seen.apart.max():.1e} m apart; "
        f"told until {seen.told_until or seen.time[-1]:.3g} s of {seen.time[-1]:.3g} s"
    )
    return seen


def end_of(result: Result, time: FloatArray) -> FloatArray:
    """Place of S (N, 2) at instants, m."""
    seen = path(result, "link.end")
    return between_samples(seen.time, seen.position, seen.velocity, time)


def panels(rows: int, height: float, **more: Any) -> tuple[Figure, NDArray[Any]]:
    """Two columns of axes, one for each case."""
    figure = Figure(figsize=(10, height), layout="constrained")
    return figure, figure.subplots(rows, 2, sharey="row", squeeze=False, **more)


def coordinates(cases: list[Case]) -> Figure:
    """Fig. 3: both coordinates of S over the crank angle, lap by lap."""
    figure, axes = panels(2, 6.5, sharex=True)
    for column, seen in enumerate(cases):
        angle = np.interp(seen.time, seen.result.time, crank_angle(seen.result))
        for lap in range(int(np.ceil(angle[-1] / (2 * np.pi) - 1e-6))):
            inside = (angle >= 2 * np.pi * lap) & (angle < 2 * np.pi * (lap + 1))
            x = np.degrees(angle[inside]) - 360 * lap
            for row in range(2):
                style = {"color": COLOURS[lap % 4], "linewidth": 1.0, "label": f"lap {lap + 1}"}
                axes[row, column].plot(x, 1e3 * seen.end[inside, row], **style)
        axes[0, column].set_title(f"Fig. 3{seen.name}", loc="left")
        axes[1, column].set_xlabel("crank angle within the lap (degrees)")
        axes[1, column].set_xticks(range(0, 361, 45))
    for row, word in enumerate("xy"):
        axes[row, 0].set_ylabel(f"$S_{word}$ (mm)")
    axes[0, 1].legend(loc="lower right", ncols=2)
    return figure


def divergence(cases: list[Case]) -> Figure:
    """Fig. 4: the lever's response; how far neighbouring runs, and lap pairs, are apart."""
    figure, axes = panels(2, 6.5, sharex=True)
    for column, seen in enumerate(cases):
        axes[0, column].plot(seen.lever.time, seen.lever.angle, color=BLACK, linewidth=0.9)
        axes[0, column].set_title(f"Fig. 4{seen.name}", loc="left")
        _separations(axes[1, column], seen)
        axes[1, column].set_xlabel("time (s)")
    axes[0, 0].set_ylabel("angle of the struck lever (rad)")
    axes[1, 0].set_ylabel("distance of S (m)")
    axes[1, 1].legend(loc="upper left")
    axes[1, 0].set_ylim(1e-13, 1e2)
    return figure


def _separations(axes: Axes, seen: Case) -> None:
    axes.semilogy(
        seen.time, np.maximum(seen.apart, 1e-12), color=BLUE, linewidth=0.8,
        label=f"start {START:.0e} rad apart",
    )  # fmt: skip
    axes.semilogy(
        seen.time, np.maximum(seen.unsure, 1e-16), color=GREY, linewidth=0.8,
        label=f"same start, {LOOSER:.0f} times the tolerance",
    )  # fmt: skip
    if seen.told_until is not None:
        axes.axvspan(seen.told_until, seen.time[-1], color=GREY, alpha=0.15, linewidth=0,
                     label="the solver's error is as large")  # fmt: skip
    angle = np.interp(seen.time, seen.result.time, crank_angle(seen.result))
    pair = float(np.interp(2 * np.pi * LAPS, angle, seen.time))
    first = seen.time + pair <= seen.time[-1]
    there = np.stack(
        [np.interp(seen.time[first] + pair, seen.time, column) for column in seen.end.T], axis=1
    )
    away = np.linalg.norm(there - seen.end[first], axis=1)
    axes.semilogy(
        seen.time[first], np.maximum(away, 1e-12), color=RED, linewidth=0.8,
        label=f"laps {LAPS + 1} and {LAPS + 2} from laps 1 and 2",
    )  # fmt: skip


def polar(cases: list[Case]) -> Figure:
    """Fig. 5: distance of S from O over the crank angle."""
    figure, axes = panels(1, 5.2, subplot_kw={"projection": "polar"})
    for column, seen in enumerate(cases):
        angle = np.interp(seen.time, seen.result.time, crank_angle(seen.result))
        radius = 1e3 * np.linalg.norm(seen.end, axis=1)
        for lap in range(int(np.ceil(angle[-1] / (2 * np.pi) - 1e-6))):
            inside = (angle >= 2 * np.pi * lap) & (angle < 2 * np.pi * (lap + 1))
            axes[0, column].plot(
                angle[inside], radius[inside], color=COLOURS[lap % 4], linewidth=1.0,
                label=f"lap {lap + 1}",
            )  # fmt: skip
        axes[0, column].set_title(f"Fig. 5{seen.name}: |OS| (mm)", loc="left")
        axes[0, column].tick_params(labelcolor=GREY)
    for polar_axes in axes.flat:
        polar_axes.set_rlim(90, 113)
        polar_axes.set_rorigin(70)
    axes[0, 1].legend(loc="lower left", bbox_to_anchor=(0.95, 0.0))
    return figure


if __name__ == "__main__":
    main()

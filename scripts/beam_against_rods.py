"""The link as a beam against the link as rods: how far S is off, and what that costs.

Usage:
  .venv/bin/python scripts/beam_against_rods.py [--out docs]

Two scenes: models/smooth.yaml (one turn) and models/no_clearance.yaml (three quarters of a turn,
with the strike, hinges as a beam's). The link is a beam of 1 to 16 elements, or 5 to 80 rods, of
equal length or with half rods at its ends. Truth is a beam of 32 elements. All of them have the
same damping per length: a hinge's is in proportion to the number of rods. Prints tables, says how
many rods equal one, two, four elements, and draws beam_against_rods.png. Takes some three minutes.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator
from numpy.typing import NDArray

from exudyn_flexlink import load_scene
from exudyn_flexlink.cli.arguments import add_figures
from exudyn_flexlink.cli.figures import look_of
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.observables import path
from exudyn_flexlink.plots.frame import BLACK, GREEN, PURPLE, SCREEN, ShownFigure, Style, styled
from exudyn_flexlink.plots.panels import letter
from exudyn_flexlink.result import Result

SCENES = {
    "smooth": ("smooth", ["run.turns=1", "run.sample=1 ms"]),
    "strike": ("no_clearance", ["run.turns=0.75", "run.sample=0.1 ms"]),
}
# Without a strike the link hardly bends: steps must be fine to tell. Rods, in a tree, make an error
# near their tolerance; a beam, with joints, makes a tenth of it in a smooth motion.
TOLERANCES = {"smooth": {"beam": 1e-7, "rods": 1e-8}, "strike": {"beam": 4e-6, "rods": 4e-6}}  # m
ELEMENTS, FINEST = (1, 2, 4, 8, 16), 32
RODS = (5, 10, 20, 40, 80)
FARTHEST = 4 * RODS[-1]  # rods: beyond, powers are not to be trusted
LEVER = 0.03  # m, its length
DAMPING = 2.0e-6  # N m s/rad of a hinge, for each rod: with ten that of the models
KINDS = {"beam": BLACK, "half_ends": GREEN, "equal": PURPLE}  # no colour of an engine
LABELS = {"beam": "beam elements", "half_ends": "rods, half ends", "equal": "rods, equal"}
REPEATS = 2  # the cheaper run counts: the machine is never quite alone


@dataclass(frozen=True)
class Run:
    """Motion of S (samples, 2) and way of the lever's tip (samples,) in m, steps, time in s."""

    s: NDArray[np.float64]
    tip: NDArray[np.float64]
    steps: int
    seconds: float
    bent: float  # m, largest distance of S from the guide's axis


@dataclass(frozen=True)
class Answer:
    """Largest differences from the truth, in m, steps, and process time in s."""

    count: int
    s: float
    tip: float
    steps: int
    seconds: float


def settings_of(kind: str, count: int) -> list[str]:
    """Settings that make the link a beam of so many elements, or so many rods of a layout."""
    shared = ["bodies.link.hinges.stiffness=beam"]
    if kind == "beam":
        damping = ["bodies.link.rods=10", f"bodies.link.hinges.damping={DAMPING * 10!r}"]
        return [*shared, *damping, "solver.formulation=beam", f"solver.elements={count}"]
    return [
        *shared,
        f"bodies.link.rods={count}",
        f"bodies.link.layout={kind}",
        f"bodies.link.hinges.damping={DAMPING * count!r}",
    ]


def simulated(name: str, kind: str, count: int) -> Run:
    """Simulate a scene; the process time is the least of some runs."""
    model, settings = SCENES[name]
    tolerance = TOLERANCES[name]["beam" if kind == "beam" else "rods"]
    own = [*settings_of(kind, count), f"accuracy.tolerance={tolerance}"]
    scene = load_scene(model, [*settings, *own])
    seconds = []
    for _ in range(REPEATS):
        began = process_time()
        result = simulate(scene, measure=False)
        seconds.append(process_time() - began)
    if not result.outcome.completed:
        sys.exit(f"{name}, {kind}, {count}: {result.outcome.reason}")
    print(f"{name}, {kind} {count}: {min(seconds):.1f} s", file=sys.stderr)
    return _read(result, min(seconds))


def _read(result: Result, seconds: float) -> Run:
    interval = result.scene.run.sample or 0.0
    even = np.abs(result.time / interval - np.round(result.time / interval)) < 1e-6
    s = path(result, "link.end").position
    names = result.part_names
    guide, levers = names.index("guide"), [i for i, part in enumerate(names) if part == "lever"]
    tip = LEVER * result.poses[even, levers[0], 2] if levers else np.zeros(int(even.sum()))
    angle = result.poses[:, guide, 2]
    away = s - result.poses[:, guide, :2]
    bent = np.abs(np.cos(angle) * away[:, 1] - np.sin(angle) * away[:, 0]).max()
    return Run(s[even], tip, result.checks.steps, seconds, float(bent))


def study(name: str) -> dict[str, list[Answer]]:
    """Answers of every kind, with growing number of elements or rods."""
    truth = simulated(name, "beam", FINEST)
    print(f"{name}: S strays up to {truth.bent * 1e3:.2f} mm from the guide's axis")
    found: dict[str, list[Answer]] = {}
    for kind in KINDS:
        found[kind] = []
        for count in ELEMENTS if kind == "beam" else RODS:
            run = simulated(name, kind, count)
            off = float(np.linalg.norm(run.s - truth.s, axis=1).max())
            tip = float(np.abs(run.tip - truth.tip).max())
            found[kind].append(Answer(count, off, tip, run.steps, run.seconds))
    return found


def rods_that_equal(rods: list[Answer], beam: Answer, what: str) -> str:
    """Say how many rods err as much in `what` as a beam, and how much longer they take.

    Between and beyond the numbers simulated errors and times follow powers of the number.
    """
    n, off, seconds = (
        np.log([getattr(one, key) for one in rods]) for key in ("count", what, "seconds")
    )
    wanted = np.log(getattr(beam, what))
    k = next((k for k in range(len(n) - 2) if off[k + 1] <= wanted), len(n) - 2)
    if off[k + 1] >= off[k]:  # errors of time, which more rods don't lessen
        return f"more than {FARTHEST}"
    part = (wanted - off[k]) / (off[k + 1] - off[k])
    count = np.exp(n[k] + part * (n[k + 1] - n[k]))
    times = np.exp(seconds[k] + part * (seconds[k + 1] - seconds[k])) / beam.seconds
    if not count <= FARTHEST:
        return f"more than {FARTHEST}"
    beyond = ", extrapolated" if count > RODS[-1] else ""
    return f"{count:.0f} ({times:.1f} times the time{beyond})"


def tell(name: str, found: dict[str, list[Answer]]) -> None:
    """Print the table of a scene, and how many rods equal a few elements."""
    print(f"**`{SCENES[name][0]}.yaml`, against a beam of {FINEST} elements**\n")
    struck = any(one.tip for answers in found.values() for one in answers)
    tip = " lever's tip off by |" if struck else ""
    print(f"| link | number | S off by |{tip} steps | processor time |")
    print("|---" * (6 if struck else 5) + "|")
    for kind, answers in found.items():
        for one in answers:
            off = f"{1e3 * one.s:.2g} mm" + (f" | {1e3 * one.tip:.2g} mm" if struck else "")
            print(f"| {LABELS[kind]} | {one.count} | {off} | {one.steps} | {one.seconds:.2f} s |")
    print()
    for beam in found["beam"][:4]:
        for what, words in (("s", "S"), ("tip", "the lever's tip")):
            if getattr(beam, what) == 0:
                continue
            said = " or ".join(
                f"{rods_that_equal(found[kind], beam, what)} {LABELS[kind]}"
                for kind in ("half_ends", "equal")
            )
            number = "1 element equals" if beam.count == 1 else f"{beam.count} elements equal"
            print(f"{name}: in {words} {number} {said}")


# Where the numbers stand: over the highest curve, right of the one that falls most steeply, and
# under the one between them.
ASIDE = {
    "beam": ((7, 0), "left", "center"),
    "half_ends": ((-5, -4), "right", "top"),
    "equal": ((3, 5), "center", "bottom"),
}


@styled
def draw(studies: dict[str, dict[str, list[Answer]]], *, style: Style = SCREEN) -> Figure:
    """Draw the error of S over the number of elements or rods, and over the time they take."""
    size = style.width, (1.25 if style.narrow else 0.85) * style.width
    figure = ShownFigure(figsize=size, dpi=style.dpi, layout="constrained")
    panels = figure.subplots(2, 2)
    for row, (name, found) in zip(panels, studies.items(), strict=True):
        for kind, colour in KINDS.items():
            counts = [one.count for one in found[kind]]
            off = [one.s for one in found[kind]]
            row[0].loglog(counts, off, "o-", color=colour, label=LABELS[kind])
            row[1].loglog([one.seconds for one in found[kind]], off, "o-", color=colour)
            for one in found[kind]:
                at = (one.seconds, one.s)
                offset, across, along = ASIDE[kind]
                row[1].annotate(
                    str(one.count),
                    at,
                    offset,
                    ha=across,
                    va=along,
                    textcoords="offset points",
                    color=colour,
                    fontsize=style.small,
                )
        _label(row[0], name, "elements or rods")
        row[0].set_ylabel("largest error of S (m)")
        row[0].set_xticks([1, 2, 5, 10, 20, 40, 80], ["1", "2", "5", "10", "20", "40", "80"])
        row[0].minorticks_off()
        _label(row[1], name, "processor time (s)")
        row[1].xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        row[1].xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
        row[1].minorticks_off()
    letter(panels.flat)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return figure


def _label(axes: Axes, name: str, along: str) -> None:
    axes.set(xlabel=along)
    axes.set_title(name, loc="left")
    axes.margins(0.12)


def main() -> None:
    """Run both scenes, print their tables and draw the figure."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--out", type=Path, default=Path("docs"), help="folder of the figure")
    add_figures(parser)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    studies = {name: study(name) for name in SCENES}
    for name, found in studies.items():
        tell(name, found)
    look_of(options).save(draw, studies, options.out, "beam_against_rods")


if __name__ == "__main__":
    main()

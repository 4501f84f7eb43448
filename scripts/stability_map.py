"""Map how stable the paper's motion is over speed and clearance, for both rules of hinges.

  .venv/bin/python scripts/stability_map.py --out docs
  .venv/bin/python scripts/stability_map.py --speeds 5 10 20 --clearances 0 1 5 --hinges paper
  .venv/bin/python scripts/stability_map.py --resume --speeds 2 4 8 16 32 --work runs/fine

Every point is a study as of the command `stability`, by the Lagrangian: the largest Lyapunov
exponent with its uncertainty, and after how many laps the motion of S repeats itself. The points
are sweeps, whose folders are in `--work`: what was computed there is not computed again with
`--resume`. Writes stability_map, and prints a Markdown table. The usual grid takes two hours of one
core.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import exudyn_flexlink as fl
from exudyn_flexlink.cli.arguments import add_figures
from exudyn_flexlink.cli.figures import look_of
from exudyn_flexlink.plots.frame import BLACK, SCREEN, Style, styled
from exudyn_flexlink.report import doubted_text
from exudyn_flexlink.stability import Asked, study
from exudyn_flexlink.sweeps import DOUBTFUL

SPEEDS = (2.0, 5.0, 10.0, 20.0, 30.0, 40.0)  # rad/s
CLEARANCES = (0.0, 0.5, 1.0, 2.0, 3.5, 5.0)  # mm on each side
HINGES = ("paper", "beam")
LAPS, AFTER = 26, 4
DARK = 0.6  # of the largest exponent: a field as dark needs white letters
WORK = Path("runs/stability_map")

Row = dict[str, Any]


def observe(scene: fl.Scene, simulate: Any) -> Mapping[str, float | int | str | None]:
    """How stable the motion at one point is, as numbers of a sweep's table."""
    found = study(scene, simulate, Asked(LAPS, AFTER))
    laps = found.repeating
    return {
        "exponent_per_s": found.exponent.value,
        "uncertainty_per_s": found.exponent.uncertainty,
        "solver_per_s": found.exponent.noise,
        "sign": found.exponent.sign,
        "repeats_after_laps": laps and laps.laps,
        "settles_to_laps": laps.nearest if laps and laps.settles else None,
        "told": found.behaviour,
    }


def rows_of(hinges: str, options: argparse.Namespace) -> list[Row]:
    """All points of one rule."""
    scene = fl.load_scene("clearance", {"bodies.link.hinges.stiffness": hinges})
    gaps = [1e-3 * gap for gap in options.clearances]
    varied = {"drives.motor.value": options.speeds, "joints.sleeve.clearance": gaps}
    rows = swept(scene, varied, hinges, options)
    return [row | {"gap": 1e3 * row["joints.sleeve.clearance_m"]} for row in rows]


def swept(
    scene: fl.Scene, varied: Mapping[str, Any], name: str, options: argparse.Namespace
) -> list[Row]:
    """Rows of a sweep, by the names of its columns."""
    table = fl.sweep(
        scene,
        varied,
        "lagrangian",
        observe=observe,
        folder=options.work / name,
        resume=options.resume and (options.work / name).exists(),
        workers=options.workers,
        measure=False,
    )
    columns = table.columns()
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


KEY = """2: S repeats itself every 2 laps; to 2: it settles to that; never: neighbours part;
?: none of these is sure; *: a run of the study warned"""


def speed_of(row: Row) -> float:
    """Speed of the drive, rad/s."""
    return float(next(value for key, value in row.items() if key.startswith("drives.motor")))


def per_lap(row: Row) -> float:
    """Largest exponent, per lap; nan where the study failed."""
    value = row.get("exponent_per_s")
    return np.nan if value is None else float(value) * 2 * np.pi / speed_of(row)


def word(row: Row) -> str:
    """What S does, in a word or two; a star where a run warned."""
    if row.get("sign") is None:
        return "failed"
    return _told(row) + ("*" if row["status"] == DOUBTFUL else "")


def _told(row: Row) -> str:
    if row["sign"] > 0:
        return "never"
    if row["repeats_after_laps"]:
        return f"{row['repeats_after_laps']:.0f}"
    return f"to {row['settles_to_laps']:.0f}" if row["settles_to_laps"] else "?"


@styled
def mapped(maps: Mapping[str, list[Row]], *, style: Style = SCREEN) -> Figure:
    """Exponents in colour, and after how many laps S repeats itself, over speed and clearance."""
    size = style.width, style.scale * 3.8 * (len(maps) if style.narrow else 1)
    figure = Figure(figsize=size, dpi=style.dpi, layout="constrained")
    shape = (len(maps), 1) if style.narrow else (1, len(maps))
    panels = figure.subplots(*shape, squeeze=False, sharey=True).ravel()
    known = [abs(per_lap(row)) for rows in maps.values() for row in rows]
    most = max((value for value in known if np.isfinite(value)), default=1.0)
    for axes, (hinges, rows) in zip(panels, maps.items(), strict=True):
        image = _panel(axes, rows, most)
        axes.set_title(f"hinges '{hinges}'")
        axes.set_xlabel("crank speed (rad/s)")
    panels[0].set_ylabel("clearance on each side (mm)")
    figure.colorbar(image, ax=list(panels), label="largest Lyapunov exponent, per lap")
    figure.supxlabel(KEY, fontsize=style.small, color=BLACK)
    return figure


def _panel(axes: Axes, rows: list[Row], most: float) -> Any:
    """One rule: a field for each point, with a word in it; colours reach from -`most` to `most`."""
    speeds = sorted({speed_of(row) for row in rows})
    gaps = sorted({row["gap"] for row in rows})
    field = np.full((len(gaps), len(speeds)), np.nan)
    for row in rows:
        place = gaps.index(row["gap"]), speeds.index(speed_of(row))
        field[place] = per_lap(row)
    image = axes.imshow(field, cmap="RdBu_r", vmin=-most, vmax=most, origin="lower", aspect="auto")
    for row in rows:
        y, x = gaps.index(row["gap"]), speeds.index(speed_of(row))
        dark = abs(field[y, x]) > DARK * most
        axes.text(x, y, word(row), ha="center", va="center", color="white" if dark else BLACK)
    axes.set_xticks(range(len(speeds)), [f"{speed:g}" for speed in speeds])
    axes.set_yticks(range(len(gaps)), [f"{gap:g}" for gap in gaps])
    axes.grid(visible=False)
    return image


def main() -> None:
    """Study all points, draw the map and print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--speeds", type=float, nargs="+", default=SPEEDS, help="rad/s")
    parser.add_argument("--clearances", type=float, nargs="+", default=CLEARANCES, help="mm")
    parser.add_argument("--hinges", choices=HINGES, nargs="+", default=HINGES)
    parser.add_argument("--out", type=Path, default=Path("docs"), help="where the figure goes")
    parser.add_argument("--work", type=Path, default=WORK, help="folder of the sweeps")
    parser.add_argument("--workers", type=int, help="processes; default: one for every core")
    parser.add_argument("--resume", action="store_true", help="go on with what is in --work")
    add_figures(parser)
    options = parser.parse_args()
    maps = {hinges: rows_of(hinges, options) for hinges in options.hinges}
    options.out.mkdir(parents=True, exist_ok=True)
    look_of(options).save(mapped, maps, options.out, "stability_map")
    print("| hinges | speed (rad/s) | clearance (mm) | exponent (1/s), 95 % | repeats after laps |")
    print("|---|---|---|---|---|")
    for hinges, rows in maps.items():
        for row in sorted(rows, key=lambda row: (speed_of(row), row["gap"])):
            told = "-"
            if row.get("exponent_per_s") is not None:
                told = doubted_text(row["exponent_per_s"], row["uncertainty_per_s"])
            print(f"| {hinges} | {speed_of(row):g} | {row['gap']:g} | {told} | {word(row)} |")
    if any(row["status"] == DOUBTFUL for rows in maps.values() for row in rows):
        print("\n\\* a run of this study warned: `reason` in the sweep's table says of what")


if __name__ == "__main__":
    main()

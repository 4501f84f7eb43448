"""What a tolerance means: the error that is really made, by scene and tolerance.

Usage:
  .venv/bin/python scripts/tolerance.py                        the Lagrangian, all scenes
  .venv/bin/python scripts/tolerance.py --engine exudyn lagrangian --models smooth --tolerances 1e-4
  .venv/bin/python scripts/tolerance.py --integrator dop853 --models smooth strike_n5_paper
  .venv/bin/python scripts/tolerance.py --models spline_24 coast_24 spline_240 coast_240

`spline_N` is `spline_track` with a cam through N points, rounded to microns as in a file; on
`coast_N` the guide is pushed and no drive holds its speed. Errors are the largest of all named
points, and of the lever's tip by its angle, m, over the run, against the Lagrangian at 1e-11 m by
its implicit method. Scenes with clearance go on for less than half a turn. Flagged are errors above
the tolerance, with the run's first warning if it has one, and where both are more than a hundred
times below it. No second run is made here, so that warnings which need one are missing:
`told_errors.py` counts these. At the end the larger of both errors is printed as a table.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
from benchmarks.lever_tip import tip_apart

from exudyn_flexlink.comparison import compare
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene, scene_of
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.source import parse_document

MODELS = Path(__file__).parent.parent / "models"
BEAM, PAPER = "bodies.link.hinges.stiffness=beam", "bodies.link.hinges.stiffness=paper"
FIVE = "bodies.link.rods=5"
SCENES = {
    "smooth": ("smooth.yaml", ()),
    "smooth_paper": ("smooth.yaml", (PAPER,)),
    "smooth_n5": ("smooth.yaml", (FIVE,)),
    "spline_track": ("spline_track.yaml", ()),
    "rigid": ("rigid.yaml", ()),
    "strike_n10_beam": ("no_clearance.yaml", (BEAM,)),
    "strike_n10_paper": ("no_clearance.yaml", (PAPER,)),
    "strike_n5_beam": ("no_clearance.yaml", (BEAM, FIVE)),
    "strike_n5_paper": ("no_clearance.yaml", (PAPER, FIVE)),
    "supported": ("supported.yaml", ()),
    "clearance": ("clearance.yaml", ()),
    "friction": ("clearance_friction.yaml", ()),
    "clearance_n5": ("clearance.yaml", (BEAM, FIVE)),
}
SPLINES = {f"{kind}_{count}": count for count in (24, 240, 1000) for kind in ("spline", "coast")}
PUSHED = "initial: {speeds: {guide: 10}}"
# Touches multiply errors, until they decide the motion: these turns, 27 and 21 touches, are before.
TOUCHING = {"clearance": 0.477, "friction": 0.477, "clearance_n5": 0.38}
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
REFERENCE = 1e-11  # m
FARTHEST_BELOW = 100.0


@dataclass(frozen=True)
class Point:
    """One run: errors (m), steps, and the first warning."""

    error: float
    tip: float
    steps: int
    by: str
    told: str

    @property
    def largest(self) -> float:
        """The larger of both errors, m."""
        return max(self.error, self.tip)

    def flag(self, tolerance: float) -> str:
        """What is wrong with the errors, by the tolerance."""
        if self.largest > tolerance:
            return f"ABOVE; {self.told}" if self.told else "ABOVE"
        return "far below" if self.largest < tolerance / FARTHEST_BELOW else ""


def spline_text(name: str) -> str:
    """`models/spline_track.yaml` with points of r = 0.04 + 0.004 cos 3 a about the pivot."""
    a = 2 * np.pi * np.arange(SPLINES[name]) / SPLINES[name]
    r = 0.04 + 0.004 * np.cos(3 * a)
    points = np.round(np.stack([0.02 + r * np.cos(a), r * np.sin(a)], axis=1), 6)
    text = (MODELS / "spline_track.yaml").read_text()
    text = text.replace("file: track_points.csv", f"closed: true, points: {points.tolist()}")
    if name.startswith("coast"):
        text = text.replace(
            "drives:\n  motor: {type: speed, joint: crank, value: 10 rad/s}", PUSHED
        )
        text = text.replace("of: crank}", "of: crank, at_most: 10 s}")
    return text


@cache
def model(name: str, turns: float, tolerance: float, integrator: str) -> Scene:
    """One of the scenes, with a tolerance in m and a method of the Lagrangian."""
    turns = min(turns, TOUCHING.get(name, turns))
    run = (
        f"run.turns={turns}",
        "run.sample=1 ms",
        f"accuracy.tolerance={tolerance}",
        f"solver.integrator={integrator}",
    )
    if name in SPLINES:
        return scene_of(parse_document(spline_text(name), f"{name}.yaml"), run)
    file, settings = SCENES[name]
    return load_scene(MODELS / file, (*settings, *run))


@cache
def reference(name: str, turns: float) -> Result:
    """The tight Lagrangian."""
    return simulate(model(name, turns, REFERENCE, "radau"), "lagrangian", measure=False)


def measure(scene: Scene, engine: str, judge: Result) -> Point:
    """Run a scene in one engine, and hold it against the judge."""
    result = simulate(scene, engine, measure=False)
    found = compare(result, judge)
    by = result.settings.formulation or "Lagrangian"
    told = next(iter(result.warnings), "")
    return Point(found.deviation.largest, tip_apart(found), result.checks.steps, by, told)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    engines = ("exudyn", "lagrangian")
    parser.add_argument("--engine", nargs="+", choices=engines, default=["lagrangian"])
    parser.add_argument(
        "--integrator", choices=("radau", "dop853"), default="radau", help="of the Lagrangian"
    )
    parser.add_argument("--models", nargs="+", choices=[*SCENES, *SPLINES], default=list(SCENES))
    parser.add_argument("--tolerances", nargs="+", type=float, default=list(TOLERANCES))
    parser.add_argument("--turns", type=float, default=2.0)
    options = parser.parse_args()
    head = ("scene", "tolerance", "points, m", "tip, m", "of it", "steps", "")
    print("{:<17}{:>10}{:>10}{:>10}{:>9}{:>8}  {}".format(*head))
    rows = []
    for name, engine in product(options.models, options.engine):
        points = []
        for tolerance in options.tolerances:
            scene = model(name, options.turns, tolerance, options.integrator)
            point = measure(scene, engine, reference(name, options.turns))
            points.append(point)
            print(
                f"{name:<17}{tolerance:>10.0e}{point.error:>10.1e}{point.tip:>10.1e}"
                f"{point.largest / tolerance:>9.3f}{point.steps:>8}  {point.flag(tolerance)}",
                flush=True,
            )
        cells = " | ".join(f"{point.largest:.1e}" for point in points)
        rows.append(f"| `{name}` | {points[0].by} | {cells} |")
    columns = " | ".join(f"{tolerance:.0e} m" for tolerance in options.tolerances)
    print(f"\n| scene | by | {columns} |", "|---" * (len(options.tolerances) + 2) + "|", sep="\n")
    print(*rows, sep="\n")


if __name__ == "__main__":
    main()

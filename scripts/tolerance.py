"""What a tolerance means: the error that is really made, by scene and tolerance.

Usage:
  .venv/bin/python scripts/tolerance.py                        the Lagrangian, all scenes
  .venv/bin/python scripts/tolerance.py --engine exudyn lagrangian --models smooth --tolerances 1e-4
  .venv/bin/python scripts/tolerance.py --integrator dop853 --models smooth strike_n5_paper
  .venv/bin/python scripts/tolerance.py --mechanisms           mechanisms of all other parts
  .venv/bin/python scripts/tolerance.py --mechanisms --models textbook/pump --tolerances 1e-6

Errors are the largest of all named points, and of the lever's tip by its angle, m, over the run,
against the Lagrangian at 1e-11 m by its implicit method. Scenes with clearance go on for less than
half a turn. Flagged are errors above the tolerance, with the run's first warning if it has one, and
where both are more than a hundred times below it. No second run is made here, so that warnings
which need one are missing: `told_errors.py` counts these. At the end the larger of both errors is
printed as a table.

With `--mechanisms` the judge is the same formulation at 1e-10 m, which tests hold against closed
forms and published numbers. Seconds are of processor time, for a whole run. The exit code is 1 if
an error is above its tolerance.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path
from time import process_time

from benchmarks.lever_tip import tip_apart

from exudyn_flexlink.comparison import compare
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene

ROOT = Path(__file__).parent.parent
MODELS = ROOT / "models"
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
# Touches multiply errors, until they decide the motion: these turns, 27 and 21 touches, are before.
TOUCHING = {"clearance": 0.477, "friction": 0.477, "clearance_n5": 0.38}
MECHANISMS = (
    "textbook/slider_crank",
    "textbook/free_slider_crank",
    "textbook/whitworth",
    "textbook/double_pendulum",
    "textbook/flexible_four_bar",
    "textbook/welded_cantilever",
    "textbook/elliptic_trammel",
    "textbook/driven_trammel",
    "textbook/scotch_yoke",
    "textbook/toggle_press",
    "textbook/slider_crank_flexible",
    "textbook/pump",
    "textbook/geneva_wheel",
    "textbook/friction_wheels",
    "textbook/slider_crank_clearance",
    "textbook/slider_with_clearance",
    "textbook/cam_follower",
    "textbook/pendulum_on_stop",
    "textbook/rope_catch",
    "textbook/super_disc",
    "textbook/flat_faced_cam",
    "benchmarks/andrews_squeezer",
    "benchmarks/spin_up_beam",
    "benchmarks/bouncing_ball_impulse",
    "benchmarks/cam_jump",
    "hard/fast_spin",
    "hard/short_spring",
    "hard/sharp_groove",
    "hard/squircle",
    "hard/rounded_corners",
    "hard/micron_bearing",
    "hard/dome",
    "hard/kinked_drive",
    "hard/slow_train",
    "hard/rattle",
    "hard/sheared",
    "hard/pulley",
    "reference/four_bar",
    "reference/drives",
    "reference/circles",
    "reference/cam",
    "reference/going_on",
    "reference/stops",
)
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
REFERENCE = 1e-11  # m
TIGHT = 1e-10  # m, of mechanisms
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


def file_of(name: str) -> Path:
    """The file of a mechanism 'folder/name'; those of the reference show every part."""
    folder, stem = name.split("/")
    examples = ROOT / "docs" / "reference" / "examples"
    return (examples if folder == "reference" else MODELS / folder) / f"{stem}.yaml"


@cache
def mechanism(name: str, tolerance: float) -> Result:
    """Simulate one of the mechanisms."""
    return simulate(load_scene(file_of(name), [f"accuracy.tolerance={tolerance}"]), measure=False)


def mechanisms(names: list[str], tolerances: list[float]) -> int:
    """Print the table of mechanisms; the exit code is 1 if an error is above its tolerance."""
    print("| model | " + " | ".join(f"{t:.0e} m" for t in tolerances) + " |")
    print("|---" * (len(tolerances) + 1) + "|")
    above = False
    for name in names:
        cells = []
        for tolerance in tolerances:
            began = process_time()
            loose = mechanism(name, tolerance)
            seconds, tight = process_time() - began, mechanism(name, TIGHT)
            if not tight.outcome.completed:
                raise SystemExit(f"{name}: the reference ended: {tight.outcome.reason}")
            found = compare(loose, tight).deviation.largest
            above = above or found > tolerance
            cells.append(f"{found:.1e} ({loose.checks.steps}, {seconds:.2f} s)")
        print(f"| `{name}` | " + " | ".join(cells) + " |", flush=True)
    return int(above)


def scenes(options: argparse.Namespace) -> None:
    """Print the errors of the paper's scenes, and their table."""
    head = ("scene", "tolerance", "points, m", "tip, m", "of it", "steps", "")
    print("{:<17}{:>10}{:>10}{:>10}{:>9}{:>8}  {}".format(*head))
    rows = []
    for name, engine in product(options.models or SCENES, options.engine):
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


def main() -> int:
    """Print one of the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--mechanisms", action="store_true", help="of all other parts")
    engines = ("exudyn", "lagrangian")
    parser.add_argument("--engine", nargs="+", choices=engines, default=["lagrangian"])
    parser.add_argument(
        "--integrator", choices=("radau", "dop853"), default="radau", help="of the Lagrangian"
    )
    parser.add_argument("--models", nargs="+")
    parser.add_argument("--tolerances", nargs="+", type=float, default=list(TOLERANCES))
    parser.add_argument("--turns", type=float, default=2.0)
    options = parser.parse_args()
    known = MECHANISMS if options.mechanisms else SCENES
    if not {*(options.models or ())} <= {*known}:
        parser.error(f"--models: choose from {', '.join(known)}")
    if options.mechanisms:
        return mechanisms(options.models or list(MECHANISMS), options.tolerances)
    scenes(options)
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""What a tolerance means for mechanisms of all parts: the error that is really made.

Usage:
  .venv/bin/python scripts/loop_tolerance.py  all models of this kind, 1e-3 to 1e-8 m
  .venv/bin/python scripts/loop_tolerance.py --models textbook/slider_crank --tolerances 1e-6

Errors are the largest of any named point over the run, against the same formulation at 1e-10 m;
tests/test_loops.py and others hold that against closed forms and published numbers. Seconds are of
processor time, for a whole run. The exit code is 1 if an error is above its tolerance.
"""

from __future__ import annotations

import argparse
import sys
from functools import cache
from pathlib import Path
from time import process_time

from exudyn_flexlink.comparison import compare
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.result import Result

ROOT = Path(__file__).parent.parent
# Folders of models; those of the reference show every part of the language.
FOLDERS = {
    **{name: ROOT / "models" / name for name in ("textbook", "benchmarks", "hard")},
    "reference": ROOT / "docs" / "reference" / "examples",
}
NAMES = (
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
    "benchmarks/andrews_squeezer",
    "benchmarks/spin_up_beam",
    "benchmarks/bouncing_ball_impulse",
    "benchmarks/cam_jump",
    "hard/fast_spin",
    "hard/short_spring",
    "hard/sharp_groove",
    "hard/micron_bearing",
    "hard/dome",
    "hard/kinked_drive",
    "reference/four_bar",
    "reference/drives",
    "reference/circles",
    "reference/cam",
    "reference/going_on",
)
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
TIGHT = 1e-10  # m


def file_of(name: str) -> Path:
    """The file of a model 'folder/name'."""
    folder, stem = name.split("/")
    return FOLDERS[folder] / f"{stem}.yaml"


@cache
def run(name: str, tolerance: float) -> Result:
    """Simulate one of the models."""
    return simulate(load_scene(file_of(name), [f"accuracy.tolerance={tolerance}"]), measure=False)


def error(name: str, tolerance: float) -> float:
    """Largest distance (m) of any named point from where it is in the tight run."""
    loose, tight = run(name, tolerance), run(name, TIGHT)
    if not tight.outcome.completed:
        raise SystemExit(f"{name}: the reference ended: {tight.outcome.reason}")
    return compare(loose, tight).deviation.largest


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--models", nargs="+", choices=NAMES, default=list(NAMES))
    parser.add_argument("--tolerances", nargs="+", type=float, default=list(TOLERANCES))
    options = parser.parse_args()
    print("| model | " + " | ".join(f"{t:.0e} m" for t in options.tolerances) + " |")
    print("|---" * (len(options.tolerances) + 1) + "|")
    above = False
    for name in options.models:
        cells = []
        for tolerance in options.tolerances:
            began = process_time()
            steps = run(name, tolerance).checks.steps
            seconds = process_time() - began
            found = error(name, tolerance)
            above = above or found > tolerance
            cells.append(f"{found:.1e} ({steps}, {seconds:.2f} s)")
        print(f"| `{name}` | " + " | ".join(cells) + " |", flush=True)
    return int(above)


if __name__ == "__main__":
    sys.exit(main())

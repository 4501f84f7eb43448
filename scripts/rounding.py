"""What rounding leaves of a run: how near both engines come, however small the tolerance.

Usage:
  .venv/bin/python scripts/rounding.py
  .venv/bin/python scripts/rounding.py --models rigid --turns 1

Tree and Lagrangian round in different places. Told is the largest distance (m) of S in one from S
in the other, and in roundings of a position at the mechanism's extent; the least tolerance that a
model may ask for (`exudyn_flexlink.mechanism.resolution`) has to be above.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from tolerance import MODELS, SCENES

from exudyn_flexlink.comparison import compare
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import assemble_scene, load_scene
from exudyn_flexlink.mechanism import extent, least_tolerance
from exudyn_flexlink.scene import Scene

USUAL = ("smooth", "rigid", "strike_n5_paper", "strike_n10_beam")
TOLERANCES = (1e-11, 1e-12, 1e-13)  # m; at 1e-15 m the Lagrangian's steps have no end


def scene_of(name: str, turns: float, tolerance: float) -> Scene:
    """One of the scenes, with a tolerance in m that no model file may ask for."""
    model, settings = SCENES[name]
    run = (f"run.turns={turns}", "run.sample=2 ms", "accuracy.tolerance=1e-6")
    scene = load_scene(Path(MODELS / model), (*settings, *run))
    accuracy = scene.accuracy.model_copy(update={"tolerance": tolerance})
    return scene.changed(accuracy=accuracy)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--models", nargs="+", choices=list(SCENES), default=list(USUAL))
    parser.add_argument("--turns", type=float, default=2.0)
    options = parser.parse_args()
    print(f"{'scene':<17}{'tolerance':>10}{'apart, m':>10}{'roundings':>11}{'least':>8}")
    for name in options.models:
        for tolerance in TOLERANCES:
            scene = scene_of(name, options.turns, tolerance)
            assembly = assemble_scene(scene)
            tree, other = (
                simulate(scene, engine, measure=False) for engine in ("exudyn", "lagrangian")
            )
            apart = compare(tree, other).deviation.largest
            counted = apart / (np.finfo(float).eps * extent(assembly))
            print(
                f"{name:<17}{tolerance:>10.0e}{apart:>10.1e}{counted:>11.0f}"
                f"{least_tolerance(assembly):>8.0e}",
                flush=True,
            )


if __name__ == "__main__":
    main()

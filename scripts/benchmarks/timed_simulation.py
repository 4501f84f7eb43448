"""Time one simulation by the package of a checkout; `compare_commits.py` starts this as a process.

Arguments: the checkout, a model file, an engine, how often it is run, a file for time and poses,
and settings of the scene. What is printed is JSON: the processor time of every run, in s.
"""

from __future__ import annotations

import inspect
import json
import sys
from importlib import import_module
from pathlib import Path
from time import process_time

import numpy as np


def main(root: str, model: str, engine: str, runs: str, out: str, *settings: str) -> None:
    """Simulate, and print how long each run took."""
    sys.path[0] = root  # instead of this file's folder: this package, and not the one installed
    simulate = import_module("exudyn_flexlink.engines").simulate
    load_scene = import_module("exudyn_flexlink.loading").load_scene
    if not Path(inspect.getfile(simulate)).is_relative_to(root):
        raise SystemExit(f"{inspect.getfile(simulate)} is not of {root}")
    # Later versions measure errors by a second run, which is not to be on the bill.
    later = "measure" in inspect.signature(simulate).parameters
    options = {"measure": False} if later else {}
    scene = load_scene(Path(model), list(settings))
    seconds = []
    for _ in range(int(runs)):
        began = process_time()
        result = simulate(scene, engine, **options)
        seconds.append(process_time() - began)
        if not result.outcome.completed:
            raise SystemExit(f"stopped at {result.outcome.time} s: {result.outcome.reason}")
    np.savez(out, time=result.time, poses=result.poses)
    print(json.dumps(seconds))


if __name__ == "__main__":
    main(*sys.argv[1:])

"""How many times as fast machine code makes the Lagrangian.

Usage:
  .venv/bin/python scripts/machine_code.py

Runs parts of two models with numba, and without it in the same way as where it is not installed.
Prints processor times of the solve, each of a process of its own, without the time to compile, and
how many times as long Python takes.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

MODELS = Path(__file__).parent.parent / "models"
RUNS = (
    ("no_clearance.yaml", "run.turns=0.1"),
    ("clearance.yaml", "run.turns=0.02"),
)
SOLVED = """
import sys
from time import process_time
if sys.argv[1] == "python":
    sys.modules["numba"] = None
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene
scene = load_scene(sys.argv[2], sys.argv[3:])
if sys.argv[1] == "numba":
    simulate(scene, "lagrangian", measure=False)  # compiles, or loads what was compiled
began = process_time()
steps = simulate(scene, "lagrangian", measure=False).checks.steps
print(process_time() - began, steps)
"""


def solved(how: str, model: str, *settings: str) -> tuple[float, int]:
    """Processor time (s) of a run, with `numba` or in `python`, and its steps."""
    command = [sys.executable, "-c", SOLVED, how, str(MODELS / model), *settings]
    seconds, steps = subprocess.run(
        command, capture_output=True, text=True, check=True
    ).stdout.split()
    return float(seconds), int(steps)


def main() -> None:
    """Print a table."""
    argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0]).parse_args()
    print("| model | steps | with numba, s | without, s | times as long |")
    print("|---|---|---|---|---|")
    for model, *settings in RUNS:
        (quick, steps), (slow, _) = (solved(how, model, *settings) for how in ("numba", "python"))
        name = " ".join([model.removesuffix(".yaml"), *settings])
        print(f"| `{name}` | {steps} | {quick:.2f} | {slow:.2f} | {slow / quick:.0f} |", flush=True)


if __name__ == "__main__":
    main()

"""How tests run the program, and what they put in the place of its engines."""

import os
import subprocess
import sys
from pathlib import Path

from results import rigid_link

from exudyn_flexlink.cli import main

ROOT = Path(__file__).parents[1]
MODELS = ROOT / "models"
NO_CLEARANCE = str(MODELS / "no_clearance.yaml")
FRICTION = str(MODELS / "clearance_friction.yaml")
RIGID = str(MODELS / "rigid.yaml")
SPLINE = str(MODELS / "spline_track.yaml")
COMMANDS = (
    *("simulate", "compare", "fit", "accuracy", "stability", "sweep", "check"),
    *("plot", "animate", "report", "new", "schema", "completion"),
)
BARE = {**{key: os.environ.get(key, "") for key in ("PATH", "HOME")}, "PYTHONPATH": str(ROOT)}
"""An environment with nothing that hides a mistake, as PYTHONUNBUFFERED does."""
QUIET = ["--no-plots", "--quiet", "--out", "here"]


def python(*arguments, **options):
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
        **options,
    )


def code_of(*arguments):
    """Exit code of a command, also where argparse ends it."""
    try:
        return main([*arguments])
    except SystemExit as ended:
        return int(ended.code or 0)


def row(text, first):
    """Words of the first line of a text that begins with the word `first`."""
    return next(line.split() for line in text.splitlines() if line.split()[:1] == [first])


def keeper(seen):
    """Closed form in place of an engine; it keeps the scenes that it is asked for."""

    def fake(scene, engine="exudyn", progress=None):
        seen.append(scene)
        return rigid_link(scene=scene, samples=101)

    return fake

"""How tests run the program, and what they put in the place of its engines."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from results import rigid_link

from exudyn_flexlink.cli import main
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene

ROOT = Path(__file__).parents[1]
MODELS = ROOT / "models"
NO_CLEARANCE = str(MODELS / "no_clearance.yaml")
FRICTION = str(MODELS / "clearance_friction.yaml")
RIGID = str(MODELS / "rigid.yaml")
SPLINE = str(MODELS / "spline_track.yaml")
COMMANDS = (
    *("simulate", "compare", "accuracy", "stability", "sweep", "check"),
    *("plot", "animate", "report", "new", "schema", "completion"),
)
BARE = {**{key: os.environ.get(key, "") for key in ("PATH", "HOME")}, "PYTHONPATH": str(ROOT)}
"""An environment with nothing that hides a mistake, as PYTHONUNBUFFERED does."""
QUIET = ["--no-plots", "--quiet", "--out", "here"]

Capture = pytest.CaptureFixture[str]
Fake = Callable[..., Result]


def python(*arguments: str, **options: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
        **options,  # type: ignore[call-overload]
    )


def code_of(*arguments: str) -> int:
    """Exit code of a command, also where argparse ends it."""
    try:
        return main([*arguments])
    except SystemExit as ended:
        return int(ended.code or 0)


def row(text: str, first: str) -> list[str]:
    """Words of the first line of a text that begins with the word `first`."""
    return next(line.split() for line in text.splitlines() if line.split()[:1] == [first])


def keeper(seen: list[Scene]) -> Fake:
    """Closed form in place of an engine; it keeps the scenes that it is asked for."""

    def fake(scene: Scene, engine: str = "exudyn", progress: object = None) -> Result:
        seen.append(scene)
        return rigid_link(scene=scene, samples=101)

    return fake

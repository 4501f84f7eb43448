"""The progress bar of a long run."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from cli_runs import NO_CLEARANCE, ROOT, python

# --- progress -------------------------------------------------------------------------------

PROGRESS = """
import sys, time
from pathlib import Path
sys.path.insert(0, 'tests')
from results import rigid_link
import exudyn_flexlink.engines as engines
from exudyn_flexlink import cli

def fake(scene, engine, progress, **_):
    for i in range(11):
        time.sleep(float(sys.argv[1]))
        if progress:
            progress(i / 10)
    return rigid_link(scene=scene)

cli.terminal.SOON = 0.2
engines.simulate = fake
sys.exit(cli.main(['simulate', sys.argv[2], '--no-plots', '--out', *sys.argv[3:]]))
"""


def on_a_terminal(*arguments: str) -> str:
    """What the program writes to stderr if that is a terminal."""
    pty = pytest.importorskip("pty")
    ours, theirs = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-c", PROGRESS, *arguments],
        cwd=ROOT,
        stdout=subprocess.DEVNULL,
        stderr=theirs,
        env=os.environ | {"TERM": "xterm", "PYTHONPATH": str(ROOT)},
    ) as process:
        os.close(theirs)
        seen = b""
        while True:
            try:
                chunk = os.read(ours, 4096)
            except OSError:  # how Linux says that the other side is closed
                break
            if not chunk:
                break
            seen += chunk
    os.close(ours)
    assert process.returncode == 0, seen
    return seen.decode()


def test_a_long_run_shows_its_progress_and_the_time_left(tmp_path: Path) -> None:
    seen = on_a_terminal("0.1", NO_CLEARANCE, str(tmp_path / "out"))
    assert "simulating" in seen
    assert "%" in seen
    assert "left" in seen


@pytest.mark.parametrize(("pause", "quiet"), [("0", []), ("0.1", ["--quiet"])])
def test_a_short_or_quiet_run_shows_no_progress(
    pause: str, quiet: list[str], tmp_path: Path
) -> None:
    seen = on_a_terminal(pause, NO_CLEARANCE, str(tmp_path / "out"), *quiet)
    assert seen.strip() == "warning: made up"


def test_a_piped_run_shows_no_progress(tmp_path: Path) -> None:
    ran = python("-c", PROGRESS, "0.05", NO_CLEARANCE, str(tmp_path / "out"))
    assert ran.returncode == 0
    assert ran.stderr == "warning: made up\n"

"""The progress of a long run, and rows that fit a terminal."""

import io
import os
import subprocess
import sys

import pytest
from cli_runs import NO_CLEARANCE, ROOT, python

from exudyn_flexlink.cli.terminal import folded, tell

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


def prepared(more):
    """Return the program with some more lines before it is run."""
    return PROGRESS.replace("cli.terminal.SOON", more + "cli.terminal.SOON")


def on_a_terminal(*arguments, before=""):
    """What the program writes to stderr if that is a terminal."""
    pty = pytest.importorskip("pty")
    ours, theirs = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-c", prepared(before), *arguments],
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


def test_a_long_run_shows_its_progress_and_the_time_left(tmp_path):
    seen = on_a_terminal("0.1", NO_CLEARANCE, str(tmp_path / "out"))
    assert "simulating" in seen
    assert "%" in seen
    assert "left" in seen


@pytest.mark.parametrize(("pause", "quiet"), [("0", []), ("0.1", ["--quiet"])])
def test_a_short_or_quiet_run_shows_no_progress(pause, quiet, tmp_path):
    seen = on_a_terminal(pause, NO_CLEARANCE, str(tmp_path / "out"), *quiet)
    assert seen.strip() == "warning: made up"


def test_a_long_piped_run_tells_its_progress_in_lines(tmp_path):
    """After 10 s the first, then 5 s apart at least; by a clock that only pauses move on."""
    clock = """
now = [0.0]
time.monotonic = lambda: now[0]
time.sleep = lambda pause: now.append(now.pop() + pause)
"""
    arguments = ["4", NO_CLEARANCE, str(tmp_path / "out")]
    *lines, warning = python("-c", prepared(clock), *arguments).stderr.splitlines()
    assert warning == "warning: made up"
    told = [(20, 12, 32), (40, 20, 24), (60, 28, 16), (80, 36, 8), (100, 44, 0)]
    assert lines == [
        f"simulating: {done} % after {after} s, about {left} s left" for done, after, left in told
    ]
    quiet = python("-c", prepared(clock), *arguments, "--quiet")
    assert quiet.stderr == "warning: made up\n"


def test_rows_too_long_for_a_terminal_are_broken_between_words(monkeypatch):
    text = "A sentence with a/path that stays\n  one  1.0\n  two  2.0  a cell of words\n"
    told = "A sentence with a/path that stays\n  one  1.0\n  two  2.0  a cell\n      of words\n"
    assert folded(text, 20) == told
    assert folded(text, 80) == text
    for terminal in (True, False):
        stream = io.StringIO()
        monkeypatch.setattr(stream, "isatty", lambda seen=terminal: seen)
        monkeypatch.setattr("sys.stdout", stream)
        monkeypatch.setenv("COLUMNS", "20")
        tell(text)
        assert stream.getvalue() == (told if terminal else text) + "\n"

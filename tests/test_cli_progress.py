"""The progress of a long run, and rows that fit a terminal."""

import io
import os
import sys
import time

import pytest
from cli_runs import NO_CLEARANCE
from results import rigid_link

from exudyn_flexlink import engines
from exudyn_flexlink.cli import main, terminal
from exudyn_flexlink.cli.terminal import folded, tell

RUN = ["simulate", NO_CLEARANCE, "--no-plots", "--out=out"]

# --- progress -------------------------------------------------------------------------------


@pytest.fixture
def pausing(monkeypatch):
    """Put closed form in the engines' place, with pauses (s) between what it tells of itself."""

    def put(pause):
        def fake(scene, engine, progress, **_):
            for i in range(11):
                time.sleep(pause)
                if progress:
                    progress(i / 10)
            return rigid_link(scene=scene)

        monkeypatch.setattr(engines, "simulate", fake)

    return put


def on_a_terminal(monkeypatch, *more):
    """What the program writes to stderr if that is a terminal."""
    pty = pytest.importorskip("pty")
    monkeypatch.setattr(terminal, "SOON", 0.1)
    monkeypatch.setenv("TERM", "xterm")
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "w") as stderr, monkeypatch.context() as there:
        there.setattr(sys, "stderr", stderr)
        assert main([*RUN, *more]) == 0
        stderr.flush()
        seen = os.read(ours, 4096)
    os.close(ours)
    return seen.decode()


def test_a_long_run_shows_its_progress_and_the_time_left(pausing, monkeypatch):
    pausing(0.05)
    seen = on_a_terminal(monkeypatch)
    assert "simulating" in seen
    assert "%" in seen
    assert "left" in seen


@pytest.mark.parametrize(("pause", "quiet"), [(0, []), (0.05, ["--quiet"])])
def test_a_short_or_quiet_run_shows_no_progress(pause, quiet, pausing, monkeypatch):
    pausing(pause)
    assert on_a_terminal(monkeypatch, *quiet).strip() == "warning: made up"


def test_a_long_piped_run_tells_its_progress_in_lines(pausing, monkeypatch, capsys):
    """After 10 s the first, then 5 s apart at least; by a clock that only pauses move on."""
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    monkeypatch.setattr(time, "sleep", lambda pause: now.append(now.pop() + pause))
    pausing(4)
    assert main(RUN) == 0
    *lines, warning = capsys.readouterr().err.splitlines()
    assert warning == "warning: made up"
    told = [(20, 12, 32), (40, 20, 24), (60, 28, 16), (80, 36, 8), (100, 44, 0)]
    assert lines == [
        f"simulating: {done} % after {after} s, about {left} s left" for done, after, left in told
    ]
    assert main([*RUN, "--quiet"]) == 0
    assert capsys.readouterr().err == "warning: made up\n"


def test_rows_too_long_for_a_terminal_are_broken_between_words(monkeypatch):
    text = "A sentence with a/path that stays\n  one  1.0\n  two  2.0  a cell of words\n"
    told = "A sentence with a/path that stays\n  one  1.0\n  two  2.0  a cell\n      of words\n"
    assert folded(text, 20) == told
    assert folded(text, 80) == text
    for is_one in (True, False):
        stream = io.StringIO()
        monkeypatch.setattr(stream, "isatty", lambda seen=is_one: seen)
        monkeypatch.setattr("sys.stdout", stream)
        monkeypatch.setenv("COLUMNS", "20")
        tell(text)
        assert stream.getvalue() == (told if is_one else text) + "\n"

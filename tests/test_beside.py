"""The second run in a process of its own: the same numbers, from scripts too; it can be ended."""

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from cli_runs import BARE, ROOT
from folders import posix

from exudyn_flexlink.cli.keeping import ends_runs
from exudyn_flexlink.engines import LateInterruptError, interrupts, measured, simulate
from exudyn_flexlink.engines.interrupts import Beside
from exudyn_flexlink.loading import load_scene

SHORT = ["run.turns=0.1", "bodies.link.rods=3"]


@pytest.fixture
def started(monkeypatch):
    """Let every run be worth a process; tells those that were started."""
    found = []
    popen = subprocess.Popen

    def kept(*arguments, **options):
        found.append(popen(*arguments, **options))
        return found[-1]

    monkeypatch.setattr(interrupts.subprocess, "Popen", kept)
    monkeypatch.setattr(interrupts.os, "sched_getaffinity", lambda _: {0, 1}, raising=False)
    monkeypatch.setattr(interrupts, "SURE", 0.0)
    monkeypatch.setattr(interrupts, "WORTH", 0.0)
    monkeypatch.setattr("exudyn_flexlink.integrate.solve.SECONDS_BETWEEN_REPORTS", 0.0)
    return found


@pytest.fixture
def scene():
    return load_scene(ROOT / "models" / "no_clearance.yaml", SHORT)


def test_a_process_beside_gives_the_same_numbers(scene, started):
    told = []
    found = simulate(scene, progress=told.append, measure=True)
    assert len(started) == 1
    alone = measured(simulate(scene, first=True), first=True)
    assert len(started) == 1
    np.testing.assert_array_equal(found.poses, alone.poses)
    assert found.error == alone.error
    assert told == sorted(told)


@posix
def test_a_process_that_dies_costs_nothing(scene, started):
    with Beside(scene, "exudyn") as other:
        first = simulate(scene, progress=other.watch(None), first=True)
        started[0].kill()
        found = measured(first, beside=other, first=True)
    assert found.error == measured(first, first=True).error


@posix
def test_ctrl_c_ends_the_process_and_keeps_what_it_has_computed(started):
    scene = load_scene(ROOT / "models" / "clearance.yaml", ["run.turns=4"])
    pressed = []

    def press(done):
        if done > 0.02 and not pressed:
            pressed.append(done)
            signal.raise_signal(signal.SIGINT)

    with Beside(scene, "exudyn") as other:
        other.watch(None)(0.0)
        short = load_scene(ROOT / "models" / "clearance.yaml", ["run.turns=0.2"])
        first = simulate(short)
        with ends_runs(), pytest.raises(LateInterruptError) as caught:
            measured(first, press, other)
    kept = caught.value.result
    assert pressed
    assert kept.outcome.completed
    assert kept.error.stopped is not None or kept.error.missing
    assert started[0].returncode is not None


def test_a_process_ends_with_what_it_was_started_for(scene, started):
    with Beside(scene, "exudyn") as other:
        other.watch(None)(0.0)
        folder = Path(started[0].args[-1])
        assert folder.is_dir()
    assert started[0].returncode is not None
    assert not folder.exists()


SCRIPT = """
import exudyn_flexlink as fl
from exudyn_flexlink.engines import interrupts
interrupts.SURE = interrupts.WORTH = 0.0
print("once")
found = fl.simulate(fl.load_scene("no_clearance", ["bodies.link.rods=3"], turns=0.3))
print(found.error.largest, found.error.other)
"""


def test_a_script_needs_no_guard(tmp_path):
    """It is not run again by the process that is started."""
    (tmp_path / "script.py").write_text(SCRIPT)
    ran = subprocess.run(
        [sys.executable, "script.py"], cwd=tmp_path, env=BARE,
        capture_output=True, text=True, check=True, timeout=120,
    )  # fmt: skip
    once, told = ran.stdout.splitlines()
    assert once == "once"
    assert [float(word) for word in told.split()] == pytest.approx([1e-7, 1e-6], rel=0.5)

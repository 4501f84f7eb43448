"""Asked to end by a signal (kill, a batch system, a closed terminal), and killed without asking."""

import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import results
from cli_runs import BARE, NO_CLEARANCE, ROOT
from folders import posix
from results import rigid_link

from exudyn_flexlink import engines, storage
from exudyn_flexlink.cli import main
from exudyn_flexlink.cli.keeping import deferrable_interrupts
from exudyn_flexlink.storage import load

SMOOTH = str(ROOT / "models" / "smooth.yaml")
REQUESTS = [("SIGTERM", 143), ("SIGHUP", 129)]


@pytest.fixture(autouse=True)
def _as_from_a_terminal():
    """Under nohup the tests themselves inherit a SIGHUP that is ignored."""
    numbers = [getattr(signal, name) for name, _ in REQUESTS if hasattr(signal, name)]
    before = {number: signal.signal(number, signal.SIG_DFL) for number in numbers}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def ask(name="SIGTERM"):
    """Ask this process to end."""
    signal.raise_signal(getattr(signal, name))


def names(folder="."):
    return sorted(path.name for path in Path(folder).iterdir())


# --- asked to end: what was computed is kept ----------------------------------------------------


@posix
@pytest.mark.parametrize(("name", "code"), REQUESTS)
@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
def test_a_run_that_is_asked_to_end_keeps_what_was_computed(
    engine, name, code, monkeypatch, capsys
):
    simulate = engines.simulate

    def asked(scene, engine, progress=None, **more):
        return simulate(scene, engine, lambda done: ask(name) if done > 0.01 else None, **more)

    monkeypatch.setattr(engines, "simulate", asked)
    monkeypatch.setattr("exudyn_flexlink.integrate.solve.SECONDS_BETWEEN_REPORTS", 0.0)
    short = ["--set=run.turns=0.5", "--set=bodies.link.rods=2", "--quiet", "--out=o"]
    if engine == "lagrangian":
        short.append("--engine=lagrangian")
    assert main(["simulate", SMOOTH, *short]) == code
    said = capsys.readouterr().err
    assert f"interrupted by {name}: writing what was computed, without figures\n" in said
    assert said.endswith("what was computed until then is in o/, marked as incomplete\n")
    kept = load(Path("o"))
    assert kept.outcome.reason == "interrupted"
    assert 0 < kept.outcome.time == kept.time[-1]
    assert not list(Path("o").glob("*.png"))
    assert names() == ["o"]
    assert signal.getsignal(getattr(signal, name)) is signal.SIG_DFL


@posix
@pytest.mark.parametrize(("name", "code"), [*REQUESTS, ("SIGINT", 130)])
def test_asked_to_end_while_results_are_saved(name, code, monkeypatch, capsys):
    monkeypatch.setattr(
        engines, "simulate", lambda scene, *_, **__: rigid_link(scene=scene, samples=99)
    )
    whole = storage.save

    def save(result, folder, every=None):
        ask(name)
        whole(result, folder)

    monkeypatch.setattr(storage, "save", save)
    assert main(["simulate", NO_CLEARANCE, "--quiet", "--out=o"]) == code
    assert capsys.readouterr().err.endswith("interrupted: the run is whole, in o/\n")
    assert load(Path("o")).outcome.completed
    assert not list(Path("o").glob("*.png"))
    assert names() == ["o"]


@posix
def test_asked_to_end_before_anything_is_computed(monkeypatch, capsys):
    """Also where Ctrl-C is ignored, as in the background jobs of a shell."""

    def prepare(*_, **__):
        with deferrable_interrupts():
            ask()

    monkeypatch.setattr(engines, "simulate", prepare)
    for handler in (signal.default_int_handler, signal.SIG_IGN):
        before = signal.signal(signal.SIGINT, handler)
        try:
            assert main(["simulate", NO_CLEARANCE, "--quiet", "--out=o"]) == 143
        finally:
            signal.signal(signal.SIGINT, before)
        assert capsys.readouterr().err == "interrupted; nothing was written\n"
        assert names() == []


CLOSED = """
import fcntl, sys, termios, time
sys.path.insert(0, 'tests')
from dataclasses import replace
from results import rigid_link
from exudyn_flexlink import cli, engines
from exudyn_flexlink.engines.interrupts import interrupts
from exudyn_flexlink.result import Outcome

def fake(scene, engine, progress, **_):
    asked = []
    with interrupts(lambda: asked.append(True)):
        progress(0.5)
        print('ready', flush=True)
        while not asked:
            time.sleep(0.01)
        progress(0.6)
    return replace(rigid_link(scene=scene), outcome=Outcome(False, 0.5, 'interrupted'))

fcntl.ioctl(2, termios.TIOCSCTTY, 0)
cli.terminal.SOON = 0.0
engines.simulate = fake
sys.exit(cli.main(['simulate', *sys.argv[1:]]))
"""


@posix
@pytest.mark.parametrize("piped", [True, False])
def test_a_terminal_that_is_closed_costs_nothing(piped, tmp_path):
    """With a progress bar on it: from then on, whatever is written to it fails."""
    pty = pytest.importorskip("pty")
    ours, theirs = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-c", CLOSED, NO_CLEARANCE, "--out", str(tmp_path / "o")],
        cwd=ROOT, stdin=theirs, stdout=subprocess.PIPE if piped else theirs, stderr=theirs,
        env={**BARE, "TERM": "xterm"}, start_new_session=True,
    ) as process:  # fmt: skip
        os.close(theirs)
        seen = b""
        while b"ready" not in seen:  # the bar takes what is printed to its own terminal
            seen += os.read(ours, 4096)
        os.close(ours)
        if piped:
            process.stdout.read()
    assert process.returncode == 129
    assert load(tmp_path / "o").outcome.reason == "interrupted"
    assert names() == ["o"]


# --- a place that is lost while the run goes on -------------------------------------------------


def test_a_run_that_may_not_replace_another_users_is_kept_beside_it(monkeypatch, capsys):
    """Where a folder is sticky, only the owner may replace its files: known when it is tried."""
    results.put(results.pendulum(), "o")
    whole = replace(rigid_link(samples=99), warnings=())
    monkeypatch.setattr(engines, "simulate", lambda *_, **__: whole)
    move = os.replace

    def refuse(source, target):
        if Path(target) == Path("o/result.nc").resolve():
            raise PermissionError(1, "Operation not permitted")
        return move(source, target)

    monkeypatch.setattr(os, "replace", refuse)
    assert main(["simulate", NO_CLEARANCE, "--no-plots", "--out=o"]) == 2
    place = Path("o").resolve()
    assert capsys.readouterr().err == (
        f"can't write {place}: no permission to write there; choose another place. "
        f"What was computed is in {place}-2\n"
    )
    assert load(Path("o")).scene.title == "pendulum"
    assert load(Path("o-2")).outcome.completed
    assert names() == ["o", "o-2"]

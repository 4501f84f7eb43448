"""Ctrl-C, full disks, outputs that are gone, and two runs into one folder."""

import errno
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import results
from cli_runs import BARE, NO_CLEARANCE, RIGID, ROOT
from results import rigid_link

from exudyn_flexlink import engines, storage
from exudyn_flexlink.cli import main
from exudyn_flexlink.cli.keeping import deferrable_interrupts, ends_runs, interrupts
from exudyn_flexlink.engines.interrupts import LateInterruptError
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.result import NOT_ASKED
from exudyn_flexlink.storage import load, staged_folder

SMOOTH = str(ROOT / "models" / "smooth.yaml")


def press():
    """Press Ctrl-C."""
    signal.raise_signal(signal.SIGINT)


def files(folder):
    return sorted(path.name for path in Path(folder).iterdir())


# --- Ctrl-C: what was computed is kept --------------------------------------------------------


def test_ctrl_c_while_figures_are_drawn_keeps_the_numbers(monkeypatch, capsys):
    whole = replace(rigid_link(), error=NOT_ASKED, warnings=())
    monkeypatch.setattr(engines, "simulate", lambda *_, **__: whole)
    monkeypatch.setattr(engines, "measured", lambda run, *_, **__: run)

    def draw(result, folder, *_):
        (folder / "half.png").write_bytes(b"half")
        press()

    monkeypatch.setattr("exudyn_flexlink.plots.save_figures", draw)
    assert main(["simulate", NO_CLEARANCE, "--quiet", "--out=o"]) == 130
    assert capsys.readouterr().err == "interrupted: the run is whole, in o/\n"
    assert load(Path("o")).outcome.completed
    assert not list(Path("o").glob("*.png"))


@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
def test_ctrl_c_after_the_solve_gives_the_whole_result(engine, monkeypatch):
    """Recorders are flushed when all is solved: Ctrl-C then must not lose it."""
    from exudyn_flexlink.engines.exudyn.minimal.recording import TreeRecorder as Tree  # noqa: PLC0415
    from exudyn_flexlink.engines.lagrangian.problem import Recorder  # noqa: PLC0415

    recorder = Tree if engine == "exudyn" else Recorder
    flush = recorder.flush

    def pressed(self):
        press()
        return flush(self)

    monkeypatch.setattr(recorder, "flush", pressed)
    settings = ["run.turns=0.01", "bodies.link.rods=2"]
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(LateInterruptError) as late, ends_runs():
        engines.simulate(load_scene(SMOOTH, settings), engine)
    assert late.value.result.outcome.completed
    assert signal.getsignal(signal.SIGINT) is before


def test_ctrl_c_is_as_ever_before_the_solve_and_after():
    with pytest.raises(KeyboardInterrupt), deferrable_interrupts():
        press()
    ended = []
    with deferrable_interrupts() as ctrl_c:
        with interrupts(lambda: ended.append(True)):
            press()
        assert ended
        assert not ctrl_c.pending
        press()
    assert ctrl_c.pending
    with pytest.raises(KeyboardInterrupt):
        press()


# --- disks that are full, places that can't be written ------------------------------------------


def limited(kilobytes, *arguments):
    """Run the program where no file may be larger than so many kB, as on a disk that is full."""
    limit = (
        "import resource, sys; from exudyn_flexlink.cli import main;"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({kilobytes * 1024},) * 2);"
        "sys.exit(main(sys.argv[1:]))"
    )
    return subprocess.run(
        [sys.executable, "-c", limit, *arguments],
        capture_output=True, text=True, check=False, timeout=120,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip


def test_a_run_that_can_not_be_written_whole_is_not_there():
    pytest.importorskip("resource")
    short = ["--set=run.turns=0.01", "--set=bodies.link.rods=2", "--no-plots", "--quiet"]
    ran = limited(20, "simulate", SMOOTH, *short, "--out=deep/o")
    assert ran.returncode == 2
    place = Path("deep/o").resolve()
    assert ran.stderr == f"can't write {place}: File too large; choose another place\n"
    assert files(".") == []


def test_figures_drawn_again_appear_all_or_none(monkeypatch, capsys):
    storage.save(results.pendulum(), Path("o"))
    before = files("o")

    def draw(result, folder, *_):
        (folder / "polar.png").write_bytes(b"")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("exudyn_flexlink.plots.save_figures", draw)
    assert main(["plot", "o"]) == 2
    assert "o: the disk is full; make room, or choose another place" in capsys.readouterr().err
    assert files("o") == before
    assert main(["plot", "o", "--out", "new/figures"]) == 2
    assert files(".") == ["o"]


@pytest.mark.parametrize("place", ["file/o", "file/deep/o", "x" * 300, "/proc/o", "loop/o"])
def test_places_that_can_not_be(place, capsys, monkeypatch):
    monkeypatch.setattr(engines, "simulate", None)  # told before anything runs
    Path("file").write_text("mine", encoding="utf-8")
    Path("loop").symlink_to("loop")
    before = files(".")
    for command in ("simulate", "compare", "accuracy"):
        assert main([command, SMOOTH, "--out", place]) == 2
        said = capsys.readouterr().err
        assert said.startswith("can't write ")
        assert said.endswith("choose another place\n")
    assert files(".") == before


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no such device")
def test_an_output_that_is_full_or_closed():
    command = f"'{sys.executable}' -m exudyn_flexlink"
    for line, code, said in [
        (f"{command} check '{RIGID}' > /dev/full", 1, "can't write to the output: No space left"),
        (f"{command} check '{RIGID}' >&- 2>&-", 0, ""),
        (f"{command} check nowhere.yaml 2> /dev/full", 2, ""),
        (f"{command} dance 2> /dev/full", 2, ""),
        (f"{{ {command} check nowhere.yaml 3>&1 1>&2 2>&3 | true; }}", 2, ""),
    ]:
        ran = subprocess.run(
            ["bash", "-o", "pipefail", "-c", line],
            capture_output=True, text=True, check=False, timeout=120, env=BARE,
        )  # fmt: skip
        assert ran.returncode == code
        assert ran.stderr.startswith(said)
        assert "Traceback" not in ran.stderr


# --- two runs into one folder -------------------------------------------------------------------


def test_two_runs_into_one_folder_at_once_the_last_stays():
    with staged_folder(Path("o")) as first:
        storage.save(results.pendulum(), first)
        with staged_folder(Path("o")) as second:
            storage.save(rigid_link(), second)
        assert load(Path("o")).scene.title == rigid_link().scene.title
    assert load(Path("o")).scene.title == "pendulum"
    assert files(".") == ["o"]

"""Figures that can't be written, and folders without permission."""

import errno
from dataclasses import replace
from pathlib import Path

import pytest
import results
from cli_runs import MODELS, NO_CLEARANCE
from results import rigid_link, solved_to

from exudyn_flexlink import engines
from exudyn_flexlink.cli import main
from exudyn_flexlink.storage import load

SMOOTH = str(MODELS / "smooth.yaml")
FIT = ["fit", SMOOTH, "m.csv", "--column=x=link.end.x", "--vary=drives.motor.value"]


def names(folder="."):
    return sorted(path.name for path in Path(folder).iterdir())


# --- figures that can't be written cost no numbers ----------------------------------------------


def closed_form(scene, engine, progress=None, **_):
    settings = solved_to(scene.accuracy.tolerance)
    return replace(
        rigid_link(scene=scene, samples=201), engine=engine, settings=settings, warnings=()
    )


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), "can't be written: No space left on"),
        (MemoryError(), "not enough memory"),
        (ZeroDivisionError("by zero"), "no figures: ZeroDivisionError: by zero"),
    ],
)
@pytest.mark.parametrize("command", ["simulate", "compare"])
def test_figures_that_can_not_be_drawn_cost_no_numbers(command, error, said, monkeypatch, capsys):
    def draw(result, folder, *_):
        (folder / "half.png").write_bytes(b"half")
        raise error

    monkeypatch.setattr(engines, "simulate", closed_form)
    monkeypatch.setattr("exudyn_flexlink.plots.save_figures", draw)
    assert main([command, NO_CLEARANCE, "--quiet", "--out=o"]) == 1
    complaint = capsys.readouterr().err
    assert said in complaint
    assert complaint.endswith("; the numbers are kept\n")
    for folder in ["o"] if command == "simulate" else ["o/exudyn", "o/lagrangian"]:
        assert load(Path(folder)).outcome.completed
    assert not list(Path("o").rglob("*.png"))
    assert names() == ["o"]


# --- no permission ------------------------------------------------------------------------------


@pytest.fixture
def forbidden(monkeypatch):
    """Nobody may make a folder in 'locked', nor anything in that."""
    Path("locked").mkdir()
    results.put(results.pendulum(), "locked/run")
    Path("m.csv").write_text("t,x\n0,0\n0.1,0\n0.2,0\n", encoding="utf-8")
    make, place = Path.mkdir, Path("locked").resolve()

    def refuse(self, *args, **kwargs):
        if place in self.resolve().parents:
            raise PermissionError(errno.EACCES, "Permission denied")
        return make(self, *args, **kwargs)

    monkeypatch.setattr(Path, "mkdir", refuse)
    monkeypatch.setattr(engines, "simulate", None)  # told before anything runs


@pytest.mark.parametrize(
    ("arguments", "place"),
    [
        (["simulate", SMOOTH, "--out=locked/o"], "locked/o"),
        (["simulate", SMOOTH, "--out=locked/run"], "locked/run"),
        (["simulate", SMOOTH, "--out=locked/deep/o"], "locked/deep/o"),
        (["compare", SMOOTH, "--out=locked/o"], "locked/o"),
        (["accuracy", SMOOTH, "--out=locked/o"], "locked/o"),
        ([*FIT, "--out=locked/o"], "locked/o"),
        (["plot", "locked/run"], "locked/run"),
        (["plot", "locked/run", "--out=locked/figures"], "locked/figures"),
    ],
)
def test_no_permission_is_told_before_anything_runs(arguments, place, forbidden, capsys):
    assert main(arguments) == 2
    reason = "no permission to write there; choose another place"
    assert capsys.readouterr().err == f"can't write {Path(place).resolve()}: {reason}\n"
    assert names("locked") == ["run"]


@pytest.mark.parametrize("command", ["simulate", "compare", "accuracy"])
def test_a_file_in_the_way_is_told_before_anything_runs(command, monkeypatch, capsys):
    monkeypatch.setattr(engines, "simulate", None)
    Path("o").write_text("mine", encoding="utf-8")
    assert main([command, SMOOTH, "--out=o"]) == 2
    said = capsys.readouterr().err
    assert said == f"{Path('o').resolve()} is a file; give the name of a folder\n"
    assert Path("o").read_text(encoding="utf-8") == "mine"

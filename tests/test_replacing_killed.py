"""A run that takes the place of another is there whole or not at all, whatever comes in between."""

import os
import signal
from pathlib import Path
from threading import Thread

import pytest
import results
from folders import mine, posix, simulate, tree
from results import rigid_link

from exudyn_flexlink import storage
from exudyn_flexlink.storage import KeptBesideError, load, own_files, staged_folder


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


class KilledError(BaseException):
    """Nothing that follows is done."""


RENAMES = 10  # of the folder, of 5 old files, of 4 new ones


@pytest.mark.parametrize("move", range(RENAMES))
def test_what_a_killed_process_began_is_finished_by_whoever_opens_the_folder(move, monkeypatch):
    results.put(rigid_link(samples=201), "o")
    mine("o/data/measured.csv")
    before = tree("o")
    rename, made = os.rename, []

    def killed(source, target):
        if len(made) >= move:
            raise KilledError
        made.append(target)
        rename(source, target)

    def write(patch):
        with staged_folder(Path("o")) as folder:
            storage.save(results.pendulum(), folder)
            patch.setattr(os, "rename", killed)

    with monkeypatch.context() as patch, pytest.raises(KilledError):
        write(patch)
    title = load(Path("o")).scene.title
    if move == 0:
        assert title == rigid_link(samples=2).scene.title
        assert {k: v for k, v in tree("o").items() if not k.startswith(".")} == before
    else:
        assert title == "pendulum"
        assert set(tree("o")) == {
            "data/measured.csv", "manifest.json", "result.nc", "summary.json",
            "trajectory_rod.end.csv",
        }  # fmt: skip
    results.put(rigid_link(samples=201), "o")
    assert set(tree("o")) == set(before)


@pytest.mark.parametrize("move", range(RENAMES))
def test_a_move_that_fails_undoes_the_others(move, monkeypatch):
    results.put(rigid_link(samples=201), "o")
    mine("o/data/measured.csv")
    before = tree("o")
    rename, made = os.rename, []

    def refused(source, target):
        made.append(target)
        if len(made) == move + 1:
            raise PermissionError(1, "Operation not permitted")
        rename(source, target)

    def write():
        with staged_folder(Path("o")) as folder:
            storage.save(results.pendulum(), folder)
            monkeypatch.setattr(os, "rename", refused)

    with pytest.raises(KeptBesideError, match="What was computed is in"):
        write()
    assert tree("o") == before
    assert load(Path("o-2")).scene.title == "pendulum"


def test_ctrl_c_while_a_run_is_put_in_its_place_is_told_and_costs_nothing(
    ends, monkeypatch, capsys
):
    assert simulate() == 0
    rename = os.rename

    def pressed(source, target):
        signal.raise_signal(signal.SIGINT)
        rename(source, target)

    monkeypatch.setattr(os, "rename", pressed)
    assert simulate() == 130
    assert capsys.readouterr().err == "interrupted: the run is whole, in o/\n"
    assert load(Path("o")).outcome.completed


@posix
def test_many_runs_that_end_at_once_leave_one_whole():
    many = [results.pendulum(), rigid_link(samples=51)] * 4

    def write(result):
        for _ in range(5):
            results.put(result, "o")

    mine("o/data/measured.csv")
    with staged_folder(Path("o"), force=True) as folder:
        storage.save(results.pendulum(), folder)
    threads = [Thread(target=write, args=(result,)) for result in many]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert load(Path("o")).outcome.completed
    assert set(tree("o")) == set(own_files(Path("o"))) | {"data/measured.csv"}
    assert sorted(path.name for path in Path().iterdir()) == ["o"]

"""A run that takes the place of another and is killed: the folder holds the one or the other."""

import os
import shutil
import signal
from pathlib import Path

import pytest
import results
from folders import mine, posix, simulate, tree
from results import rigid_link

from exudyn_flexlink import storage
from exudyn_flexlink.storage import load, staged_folder

NEW = {"manifest.json", "result.nc", "summary.json", "trajectory_rod.end.csv"}
PRINTED = ("summary.json", "trajectory_link.end.csv", "lever_lever.csv")  # of the old run


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def replaced_but_killed(calls):
    """Replace the run in 'o' in a process that is killed as it makes the file system's next call.

    Returns whether it was killed: it may need fewer calls.
    """
    child = os.fork()
    if child == 0:
        made = []

        def counted(function):
            def call(*arguments, **more):
                if len(made) == calls:
                    os.kill(os.getpid(), signal.SIGKILL)
                made.append(function)
                return function(*arguments, **more)

            return call

        with staged_folder(Path("o")) as folder:
            storage.save(results.pendulum(), folder)
            os.replace, shutil.copyfile = counted(os.replace), counted(shutil.copyfile)
            Path.unlink, Path.rmdir = counted(Path.unlink), counted(Path.rmdir)
        os._exit(0)
    return os.waitpid(child, 0)[1] == signal.SIGKILL


@posix
def test_a_process_that_is_killed_leaves_the_old_run_or_the_new_one():
    """Killed before each of its calls in turn; tables of the one never stand beside the other."""
    results.put(rigid_link(samples=51), "old")
    mine("old/data/measured.csv", "old/notes.txt")
    old, titles = tree("old"), []
    for calls in range(100):
        shutil.copytree("old", "o")
        killed = replaced_but_killed(calls)
        run = load(Path("o"))
        titles.append(run.scene.title)
        assert run.outcome.completed
        there = {name: content for name, content in tree("o").items() if ".flexlink" not in name}
        if run.scene.title == "pendulum":
            assert not set(there) & set(PRINTED[1:])
            assert there.get("summary.json") != old["summary.json"]
        else:
            assert all(there[name] == old[name] for name in PRINTED if name in there)
            assert "trajectory_rod.end.csv" not in there
        assert there["data/measured.csv"] == there["notes.txt"] == b"mine"
        results.put(results.pendulum(), "o")  # the next run is not blocked
        assert set(tree("o")) == NEW | {"data/measured.csv", "notes.txt"}
        shutil.rmtree("o")
        if not killed:
            break
    assert 10 < calls < 99
    assert set(titles) == {"pendulum", rigid_link(samples=2).scene.title}


def test_ctrl_c_while_a_run_is_put_in_its_place_is_told_and_costs_nothing(
    ends, monkeypatch, capsys
):
    assert simulate() == 0
    replace = os.replace

    def pressed(source, target):
        signal.raise_signal(signal.SIGINT)
        replace(source, target)

    monkeypatch.setattr(os, "replace", pressed)
    assert simulate() == 130
    assert capsys.readouterr().err == "interrupted: the run is whole, in o/\n"
    assert load(Path("o")).outcome.completed

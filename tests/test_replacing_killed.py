"""A run that takes the place of another and is killed: the folder holds the one or the other."""

import json
import os
import shutil
import signal
from functools import cache
from pathlib import Path

import results
from folders import mine, posix, simulate, tree
from results import rigid_link

from exudyn_flexlink import storage
from exudyn_flexlink.storage import load, staged_folder, written_files

NEW = {
    "forces.csv",
    "happenings.csv",
    "manifest.json",
    "result.nc",
    "summary.json",
    "trajectory_rod.end.csv",
}
PRINTED = ("summary.json", "trajectory_link.end.csv", "lever_lever.csv")  # of the old run


@cache
def new_run():
    return results.pendulum()


def replaced_but_killed(calls, save=storage.save):
    """Replace the result in 'o' in a process that is killed at a call to the file system.

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
            save(new_run(), folder)
            os.replace = counted(os.replace)
            Path.unlink, Path.rmdir = counted(Path.unlink), counted(Path.rmdir)
        os._exit(0)
    return os.waitpid(child, 0)[1] == signal.SIGKILL


@posix
def test_a_process_that_is_killed_leaves_the_old_run_or_the_new_one():
    """Killed before each of its calls in turn; tables of the one never stand beside the other."""
    results.put(rigid_link(samples=51), "old")
    mine("old/data/measured.csv", "old/notes.txt")
    old, titles = tree("old"), []
    new_run()  # before processes are forked
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
        results.put(new_run(), "o")  # the next run is not blocked
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


def compared(result, folder):
    """Write what a comparison leaves: a document, and two runs in folders inside."""
    (folder / "comparison.json").write_text(
        f'{{"title": "{result.scene.title}", "completed": true}}'
    )
    for name in ("exudyn", "lagrangian"):
        storage.save(result, folder / name)


@posix
def test_a_comparison_that_is_killed_keeps_whole_runs():
    """No document is beside runs that it does not tell of, and each run is the old or the new."""
    old, new = rigid_link(samples=51), new_run()
    with staged_folder(Path("old")) as folder:
        compared(old, folder)
    mine("old/exudyn/notes.txt")
    for calls in range(0, 200, 5):
        shutil.copytree("old", "o")
        killed = replaced_but_killed(calls, compared)
        titles = {load(Path("o", name)).scene.title for name in ("exudyn", "lagrangian")}
        assert titles <= {old.scene.title, new.scene.title}
        if Path("o/comparison.json").exists():
            assert titles == {json.loads(Path("o/comparison.json").read_text())["title"]}
        with staged_folder(Path("o")) as folder:
            compared(new, folder)
        assert set(tree("o")) == set(written_files(Path("o"))) | {"exudyn/notes.txt"}
        shutil.rmtree("o")
        if not killed:
            break
    assert 20 < calls < 198

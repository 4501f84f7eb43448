"""Processes of a sweep that are killed: what they had made stays, nothing is made twice."""

import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest
from folders import posix
from results import pendulum
from small_scenes import PENDULUM, scene_from
from sweep_runs import LENGTH, Length, plan_of, work

import exudyn_flexlink as fl
from exudyn_flexlink.storage import SeriesKeeper, load, load_sweep, open_journal
from exudyn_flexlink.sweeps import carried_out, local_processes
from exudyn_flexlink.sweeps.study import dask_cluster

COUNT = 8
SCRIPT = f"""
import sys
from pathlib import Path
sys.path[:0] = [{str(Path(__file__).parent)!r}]
from small_scenes import PENDULUM, scene_from
from sweep_runs import LENGTH, Length
import exudyn_flexlink as fl

if __name__ == "__main__":
    folder = Path(sys.argv[1])
    observe = Length(folder / "log", seconds=0.2)
    fl.sweep(scene_from(PENDULUM), {{LENGTH: list(range(1, {COUNT} + 1))}}, observe=observe,
             folder=folder / "swept", workers=2)
"""


def swept(executor, observe):
    plan = plan_of(COUNT)
    return carried_out(plan, work(plan, observe), executor, {}, lambda *_: None)


def lengths(table):
    return table.columns()["length_m"]


def check_killed(executor, log):
    """A run that ends its process is made again; one that always does fails; no row is lost."""
    observe = Length(log, deadly=3, always=6)
    table = swept(executor, observe)
    assert lengths(table) == [None if k == 6 else float(k) for k in range(1, COUNT + 1)]
    row = table.rows[5]
    assert row.status == "failed"
    assert "the process that ran it ended" in row.reason
    return observe.asked()


def test_numbers_do_not_depend_on_how_many_processes_run():
    """Those of an engine, to the last bit, and in the same order."""
    scene = fl.load_scene("textbook/double_pendulum", duration=0.1)
    varied = {"initial.angles.upper": "-90:90 deg:3"}
    one, two = (fl.sweep(scene, varied, workers=workers) for workers in (1, 2))
    assert [(row.id, row.numbers) for row in one.rows] == [(r.id, r.numbers) for r in two.rows]
    assert one.count("done") == 3


def test_a_killed_worker_costs_the_run_under_way_which_is_made_again_once(tmp_path):
    asked = check_killed(partial(local_processes, 2), tmp_path / "log")
    assert asked.count(6) == 2
    assert len(asked) <= COUNT + 6  # two were under way, three times


def test_a_sweep_that_was_killed_goes_on_without_loss_or_repetition(tmp_path):
    (tmp_path / "script.py").write_text(SCRIPT)
    folder, log = tmp_path / "swept", Length(tmp_path / "log")
    running = subprocess.Popen([sys.executable, str(tmp_path / "script.py"), str(tmp_path)])
    try:
        while not (folder / "journal.jsonl").exists() or not len(load_sweep(folder).rows) >= 3:
            assert running.poll() is None
            time.sleep(0.02)
    finally:
        running.send_signal(signal.SIGKILL)
        running.wait()
    with (folder / "journal.jsonl").open("a") as journal:
        journal.write('{"number": 7, "id"')  # half a line
    time.sleep(0.5)
    made, asked = load_sweep(folder), len(log.asked())
    assert 3 <= len(made.rows) < COUNT
    time.sleep(0.5)
    assert len(log.asked()) == asked, "its processes have not ended with it"
    varied = {LENGTH: list(range(1, COUNT + 1))}
    scene, observe = scene_from(PENDULUM), Length(tmp_path / "log", seconds=0.2)
    with pytest.raises(fl.StorageError, match=f"{len(made.rows)} of the {COUNT} rows"):
        fl.sweep(scene, varied, observe=observe, folder=folder, workers=1)
    table = fl.sweep(scene, varied, observe=observe, folder=folder, workers=1, resume=True)
    assert lengths(table) == [float(k) for k in range(1, COUNT + 1)]
    assert lengths(fl.load_sweep(folder)) == lengths(table)
    again = log.asked()[asked:]
    assert set(again).isdisjoint(lengths(made))
    assert len(again) == COUNT - len(made.rows)


@pytest.fixture
def cluster():
    """Give the address of a scheduler on this machine with two workers.

    It gives a task up when its worker ends, so that the sweep itself has to try again.
    """
    distributed = pytest.importorskip("distributed", reason="needs the extra 'cluster'")
    dask = pytest.importorskip("dask")
    one = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        distributed.LocalCluster(processes=True, host="127.0.0.1", **one) as there,
    ):
        yield there.scheduler_address


def test_a_worker_of_a_cluster_that_is_killed_costs_no_row(cluster, tmp_path):
    check_killed(partial(dask_cluster, cluster), tmp_path / "log")


def test_two_sweeps_do_not_work_in_one_folder(tmp_path):
    with (
        open_journal(tmp_path, plan_of(COUNT)),
        pytest.raises(fl.StorageError, match="another process sweeps in"),
        open_journal(tmp_path, plan_of(COUNT), force=True),
    ):
        raise AssertionError("two sweeps in one folder")


@posix
def test_a_process_that_is_asked_to_end_saves_its_run_first(tmp_path):
    """Asked at every move of a file: nothing half-written stays."""
    (tmp_path / "sweep.json").write_text("{}")
    child = os.fork()
    if child == 0:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        move = os.replace

        def asked(source, target):
            os.kill(os.getpid(), signal.SIGTERM)
            move(source, target)

        os.replace = asked
        SeriesKeeper(tmp_path)(pendulum(), "run")
        os._exit(0)
    assert os.waitpid(child, 0)[1] == signal.SIGTERM
    assert load(tmp_path / "series/run").scene.title == "pendulum"
    assert not list(tmp_path.rglob(".flexlink-*"))

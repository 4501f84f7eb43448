"""Matrices of mechanisms are small: while a run is made, linear algebra has one thread."""

from importlib import import_module

import pytest
from threadpoolctl import threadpool_info

from exudyn_flexlink import load_scene, simulate
from exudyn_flexlink.shipped import ENGINES

SHORT = ("run={duration: 1e-4, sample: 1e-4}", "bodies.link.rods=2")


def threads():
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
def test_a_run_has_one_thread_and_then_as_many_as_before(engine, monkeypatch):
    room, seen = import_module(ENGINES[engine].module), []
    run = room.run

    def watched(*given, **named):
        seen.append(threads())
        return run(*given, **named)

    monkeypatch.setattr(room, "run", watched)
    scene = load_scene("no_clearance", SHORT)
    before = threads()
    for _ in range(2):
        simulate(scene, engine, measure=False)
        assert threads() == before
    assert seen == [{1}, {1}]

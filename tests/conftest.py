"""Fixtures that several files share."""

import os
import signal
from dataclasses import replace
from math import inf

import pytest
from matplotlib.figure import Figure
from results import rigid_link, solved_to, tilting_link
from studies import studied

from exudyn_flexlink.engines import interrupts
from exudyn_flexlink.result import NOT_ASKED, Outcome

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # of workers that take all cores between them
interrupts.SURE = inf  # s: no second run in a process of its own, but in `test_beside`
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # in the background: tests send Ctrl-C
    signal.signal(signal.SIGINT, signal.default_int_handler)
MOST_WORKERS = 8  # each takes 0.6 GB, and collects all tests for itself


def pytest_xdist_auto_num_workers(config):
    """Run all tests on all cores; files that are named, and those of one core, without workers."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return 0 if config.option.file_or_dir or cores in (None, 1) else min(cores, MOST_WORKERS)


LONGEST = ("test_printed_commands", "test_packaging", "test_second_day", "test_verification")


def pytest_collection_modifyitems(items):
    """Begin with files of long tests, lest the last of them keeps one core busy at the end."""
    items.sort(key=lambda item: item.path.stem not in LONGEST)


@pytest.fixture(scope="session")
def study():
    """Return a study of a world in which all goes well."""
    return studied()


@pytest.fixture(scope="session")
def rigid():
    """Return the paper's run, a rigid link that strikes twice in four laps."""
    return rigid_link()


@pytest.fixture(scope="session")
def tilting():
    """Return a run of a link with clearance in its guide."""
    return tilting_link()


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    """Put every test into an empty folder of its own."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def run_of(monkeypatch):
    """Put a function in the engine's place.

    Another one, if it is given, measures a run; else it is left as it is.
    """

    def put(fake, measure=None):
        def simulate(scene, engine, progress, **_):
            made = fake(scene, engine, progress)
            return made if measure is None else replace(made, error=NOT_ASKED)

        monkeypatch.setattr("exudyn_flexlink.engines.simulate", simulate)
        if measure is not None:
            monkeypatch.setattr(
                "exudyn_flexlink.engines.measured", lambda run, *_, **__: measure(run)
            )

    return put


@pytest.fixture
def ends(monkeypatch):
    """Put closed form in place of the engines, with a way to end, and empty figures of runs."""

    def as_(completed=True, reason="no convergence"):
        def fake(scene, engine, progress=None, **_):
            made = replace(rigid_link(scene=scene, samples=201), engine=engine, warnings=())
            made = replace(made, settings=solved_to(scene.accuracy.tolerance))
            return made if completed else replace(made, outcome=Outcome(False, 0.5, reason))

        monkeypatch.setattr("exudyn_flexlink.engines.simulate", fake)

    def empty(_result, _style):
        return {name: Figure((1, 1)) for name in ("forces", "polar")}

    monkeypatch.setattr("exudyn_flexlink.plots.figures", empty)
    as_()
    return as_

"""Fixtures that several files share."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from cli_runs import Fake
from studies import studied

from exudyn_flexlink.accuracy import Study
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene

os.environ.setdefault("NUMBA_OPT", "1")  # as the program: compiled a third sooner, as fast


@pytest.fixture(scope="session")
def study() -> Study:
    """Return a study of a world in which all goes well."""
    return studied()


@pytest.fixture
def run_of(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[[Fake], None]:
    """Put a function in the engine's place, and the test into an empty folder."""
    monkeypatch.chdir(tmp_path)

    def put(fake: Fake) -> None:
        def simulate(scene: Scene, engine: str, progress: object, **_: object) -> Result:
            return fake(scene, engine, progress)

        monkeypatch.setattr("exudyn_flexlink.engines.simulate", simulate)

    return put

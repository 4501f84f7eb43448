"""Fixtures that several files share."""

from collections.abc import Callable
from pathlib import Path

import pytest
from cli_runs import Fake
from studies import studied

from exudyn_flexlink.accuracy import Study


@pytest.fixture(scope="session")
def study() -> Study:
    """Return a study of a world in which all goes well."""
    return studied()


@pytest.fixture
def run_of(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[[Fake], None]:
    """Put a function in the engine's place, and the test into an empty folder."""
    monkeypatch.chdir(tmp_path)
    return lambda fake: monkeypatch.setattr("exudyn_flexlink.engines.simulate", fake)

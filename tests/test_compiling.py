"""Machine code of the Lagrangian where no folder can be written: a container, say."""

import gc
import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread

import pytest
from cli_runs import BARE, MODELS, ROOT

from exudyn_flexlink.engines.lagrangian import compiled
from exudyn_flexlink.engines.lagrangian.compiled import seldom_collecting

NO_CLEARANCE = str(MODELS / "no_clearance.yaml")

TRIED = """
import sys
import numpy as np
from exudyn_flexlink.engines.lagrangian.compiled import compilation
from exudyn_flexlink.engines.lagrangian.equations import eliminate
print(compilation(eliminate))
vector = np.array([2.0, 4.0])
eliminate(np.diag([2.0, 1.0]), vector)
print(*vector, compilation(eliminate))
"""

SAID = """
import sys
sys.path.insert(0, sys.argv[1])
from results import rigid_link
from exudyn_flexlink import cli, engines
engines.simulate = lambda scene, *_, **__: rigid_link(scene=scene)
sys.exit(cli.main(['simulate', *sys.argv[2:], '--engine=lagrangian', '--no-plots', '--out=o']))
"""


WALLS = """
from exudyn_flexlink.engines.lagrangian import addresses, walls
for walled in (False, True):
    addresses.equation_functions_for(walled)
    print(walled, len(walls.look.signatures))
"""


@pytest.fixture
def read_only(tmp_path: Path) -> dict[str, str]:
    """Environment of an installation, and a home, in which nothing can be kept; for root, too."""
    package = tmp_path / "installed" / "exudyn_flexlink"
    shutil.copytree(ROOT / "exudyn_flexlink", package, ignore=shutil.ignore_patterns("__pycache__"))
    (package / "engines" / "lagrangian" / "__pycache__").write_text("no folder")
    home = tmp_path / "home"
    home.write_text("no folder")
    return {**BARE, "HOME": str(home), "PYTHONPATH": str(package.parent)}


def python(where: Path, environment: dict[str, str], *arguments: str) -> str:
    """Output of a script; its stderr, too."""
    ran = subprocess.run(
        [sys.executable, "-c", *arguments], cwd=where, env=environment,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, timeout=120,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stdout
    return ran.stdout


def test_without_a_place_for_its_code_it_is_compiled_in_memory(tmp_path, read_only):
    pytest.importorskip("numba")
    assert python(tmp_path, read_only, TRIED) == "every run\n1.0 4.0 none\n"


def test_where_there_is_a_place_it_is_compiled_once(tmp_path, read_only):
    pytest.importorskip("numba")
    kept = {**read_only, "NUMBA_CACHE_DIR": str(tmp_path / "kept")}
    assert python(tmp_path, kept, TRIED) == "once\n1.0 4.0 none\n"
    assert python(tmp_path, kept, TRIED) == "none\n1.0 4.0 none\n"


def test_walls_are_compiled_for_mechanisms_that_have_them(tmp_path, read_only):
    pytest.importorskip("numba")
    assert python(tmp_path, read_only, WALLS) == "False 0\nTrue 1\n"


def test_after_compiling_garbage_is_looked_for_as_often_as_before():
    before = gc.get_threshold()
    with suppress(KeyboardInterrupt), seldom_collecting():
        assert gc.get_threshold()[0] > before[0]
        raise KeyboardInterrupt
    assert gc.get_threshold() == before


def test_a_run_says_that_it_will_compile_again(tmp_path, read_only):
    pytest.importorskip("numba")
    said = python(tmp_path, read_only, SAID, str(ROOT / "tests"), NO_CLEARANCE)
    assert said.startswith("hint: compiles the Lagrangian in memory first, ")
    assert "and will in every run" in said
    assert "NUMBA_CACHE_DIR" in said


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has other locks")
def test_who_comes_second_waits_for_what_the_first_keeps(tmp_path, monkeypatch):
    monkeypatch.setattr(compiled, "_FOLDER", tmp_path)
    entered = Event()

    def second():
        with compiled.one_at_a_time():
            entered.set()

    other = Thread(target=second)
    with compiled.one_at_a_time():
        other.start()
        assert not entered.wait(0.2)
    assert entered.wait(60)
    other.join()

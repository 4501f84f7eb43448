"""Machine code of the Lagrangian: where it is kept, and by how many processes it is made."""

import ctypes
import gc
import json
import os
import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread

import pytest
from cli_runs import BARE, MODELS, ROOT

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.engines.lagrangian import (
    absent,
    compiled,
    compiled_stepper,
    instability,
    knots,
    model,
    parallel_compiling,
    run,
    system,
)
from exudyn_flexlink.engines.lagrangian.addresses import Kind
from exudyn_flexlink.engines.lagrangian.compiled import seldom_collecting
from exudyn_flexlink.loading import load_scene

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


OWN = """
import sys
from exudyn_flexlink.engines.lagrangian import addresses, track_point, walls
has = sys.argv[1:]
addresses.equation_functions_for(addresses.Kind("walls" in has, "play" in has, knots=False))
print(len(walls.look.signatures), len(track_point._newton.signatures))
"""

AFTERWARDS = """
import sys
from exudyn_flexlink.engines.lagrangian import outcome, run
from exudyn_flexlink.loading import load_scene
def compiled():
    modules = [own for name, own in sys.modules.items() if name.startswith(run.__package__)]
    found = [one for module in modules for one in vars(module).items()]
    signatures = [(name, getattr(function, "signatures", ())) for name, function in found]
    return {(name, str(one)) for name, several in signatures for one in several}
prepared = run.prepare(load_scene(sys.argv[1], sys.argv[2:]))
run._compile(prepared)
before = compiled()
run.solve(prepared)
outcome.finish(prepared, "")
print(len(before) > 0, *sorted({name for name, _ in compiled() - before}))
"""

BRIEF = "run={duration: 10 ms, sample: 1 ms}"

IN_PARALLEL = """
import sys
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.engines.lagrangian import parallel_compiling
from exudyn_flexlink.loading import load_scene
parallel_compiling.cores = lambda: 2
take_over = parallel_compiling.take_over
def told(part, folder):
    print(*(index.name.split("-")[0].split(".")[-1] for index in part.rglob("*.nbi")))
    take_over(part, folder)
parallel_compiling.take_over = told
result = simulate(load_scene(sys.argv[1], [sys.argv[2]]), "lagrangian", measure=False)
print("compile" in result.timings, result.poses.tobytes().hex())
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


def python(where: Path, environment: dict[str, str], *arguments: str, within: int = 120) -> str:
    """Output of a script; its stderr, too."""
    ran = subprocess.run(
        [sys.executable, "-c", *arguments], cwd=where, env=environment,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, timeout=within,
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


@pytest.mark.parametrize(
    ("has", "compiled_then"), [([], "0 1\n"), (["walls"], "1 1\n"), (["walls", "play"], "1 0\n")]
)
def test_walls_are_compiled_where_there_are_any_and_the_search_for_p_where_there_is_no_play(
    tmp_path, read_only, has, compiled_then
):
    pytest.importorskip("numba")
    assert python(tmp_path, read_only, OWN, *has) == compiled_then


@pytest.mark.parametrize(
    ("model", "settings"),
    [
        ("no_clearance", ["run.turns=0.2"]),
        ("clearance", ["run.turns=0.2"]),
        ("supported", ["run.turns=0.2"]),
        ("clearance", ["run.turns=0.02", "solver.integrator=dop853"]),
        ("rigid", ["run.turns=0.6", "contacts.strike.law={type: impulse, restitution: 0.5}"]),
    ],
)
def test_nothing_is_compiled_after_the_phase_that_compiles(tmp_path, model, settings):
    pytest.importorskip("numba")
    environment, path = {**os.environ, "PYTHONPATH": str(ROOT)}, str(MODELS / f"{model}.yaml")
    assert python(tmp_path, environment, AFTERWARDS, path, *settings, within=600) == "True\n"


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
    monkeypatch.setattr(compiled, "FOLDER", tmp_path)
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


def test_what_two_processes_compile_is_whole_and_gives_the_same_motion(tmp_path):
    pytest.importorskip("numba")
    kept = tmp_path / "kept"
    # In all but the folder as here: rounding in numpy depends on the environment.
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(kept), "PYTHONPATH": str(ROOT)}
    by_second, told = python(
        tmp_path, environment, IN_PARALLEL, NO_CLEARANCE, BRIEF, within=600
    ).splitlines()
    assert {"accelerations", "coordinates_at"} < set(by_second.split())
    files = {file: file.stat().st_mtime_ns for file in kept.rglob("*.nb?")}
    again = python(tmp_path, environment, IN_PARALLEL, NO_CLEARANCE, BRIEF)
    assert files == {file: file.stat().st_mtime_ns for file in kept.rglob("*.nb?")}
    by_one = simulate(load_scene(NO_CLEARANCE, [BRIEF]), "lagrangian", measure=False)
    poses = by_one.poses.tobytes().hex()
    assert (told, again) == (f"True {poses}", f"False {poses}\n")


def test_code_of_another_process_is_taken_over_where_there_is_none(tmp_path):
    part, folder = tmp_path / "part", tmp_path / "numba-1"
    theirs, ours = part / "numba-1" / "room", folder / "room"
    for place, names in ((theirs, ("both-1", "new-2")), (ours, ("both-1",))):
        place.mkdir(parents=True)
        for name in names:
            for ending in ("nbi", "1.nbc", "2.nbc"):
                (place / f"{name}.py.{ending}").write_text(place.parts[-2])
    (theirs / "not_finished-3.py.1.nbc").touch()
    (ours / "both-1.py.1.nbc").write_text("ours")
    of_other_sources = part / "numba-2" / "room"
    of_other_sources.mkdir(parents=True)
    (of_other_sources / "newer-4.py.nbi").touch()
    parallel_compiling.take_over(part, folder)
    files = [f"{name}.py" for name in ("both-1", "new-2")]
    assert {file.name for file in ours.iterdir()} == {
        f"{file}.{ending}" for file in files for ending in ("nbi", "1.nbc", "2.nbc")
    }
    assert (ours / "both-1.py.1.nbc").read_text() == "ours"


def test_what_is_not_yet_taken_over_is_still_to_be_compiled(tmp_path, monkeypatch):
    """Parts of another process at work, or of one that was killed, are no code to begin with."""
    pytest.importorskip("numba")
    monkeypatch.setattr(compiled, "FOLDER", tmp_path)
    index = "test_compiling.never_called-1.py311.nbi"

    def never_called():
        """Is in no memory."""

    for room, expected in (("parts-x/part-0/numba-1/room", "once"), ("room", "none")):
        (tmp_path / room).mkdir(parents=True)
        (tmp_path / room / index).touch()
        assert compiled.compilation(never_called) == expected


def test_an_explicit_run_compiles_in_a_phase_of_its_own(monkeypatch):
    asked = list[str]()

    def compilation(*functions):
        asked.extend(function.__name__ for function in functions)
        return "once"

    monkeypatch.setattr(run, "compilation", compilation)
    scene = load_scene(NO_CLEARANCE, [BRIEF, "solver.integrator=dop853"])
    assert run.compiles(scene) == "once"
    assert {"motions_at", "accelerations"} < set(asked)
    assert "advance" not in asked
    assert simulate(scene, "lagrangian", measure=False).timings["compile"] >= 0.0


def test_a_namesake_in_another_file_is_not_yet_the_function(tmp_path, monkeypatch):
    """What a mechanism without knots has in their place was taken for them."""
    pytest.importorskip("numba")
    monkeypatch.setattr(compiled, "FOLDER", tmp_path)
    (tmp_path / "room").mkdir()
    for name, function in (("absent", absent.after_step), ("knots", knots.after_step)):
        monkeypatch.setattr(compiled, "_BY_ADDRESS", set())
        assert compiled.compilation(function) == "once"
        (tmp_path / "room" / f"{name}.after_step-1.py311.nbi").touch()
        assert compiled.compilation(function) == "none"


def test_fields_of_a_record_have_the_same_types_in_every_scene(monkeypatch):
    """What was compiled for one scene takes those of the others without a look at their types."""
    numba = pytest.importorskip("numba")
    types = dict[str, list[object]]()
    records = {
        model: ["constants_made"],
        system: ["mode_made"],
        compiled_stepper: ["method_made", "work_made", "means_made"],
        instability: ["motions_at"],
    }

    def recorded(name, made):
        def noted(*fields):
            types.setdefault(name, []).append(numba.typeof(fields))
            return made(*fields)

        return noted

    for module, names in records.items():
        for name in names:
            monkeypatch.setattr(module, name, recorded(name, getattr(module, name)))
    for scene in (
        "no_clearance",
        "clearance_friction",
        "spline_track",
        "hard/torque_reversal",
        "rigid",
    ):
        simulate(load_scene(MODELS / f"{scene}.yaml", [BRIEF]), "lagrangian", measure=False)
    assert len(types) == 6
    for found in types.values():
        assert len(found) >= 4
        assert len(set(found)) == 1


@pytest.mark.parametrize("helper", ["raise SystemExit(1)", "import time; time.sleep(3600)"])
def test_a_process_that_fails_or_hangs_costs_nothing_but_time(tmp_path, monkeypatch, helper):
    """What it had taken is missing then, and is compiled where it is called."""
    pytest.importorskip("numba")
    # What is no text is passed over by imports, and some put it there.
    monkeypatch.setattr(sys, "path", [*sys.path, tmp_path])
    done = list[str]()
    units = [
        parallel_compiling.Unit(function, lambda name=function.__name__: done.append(name))
        for function in (parallel_compiling.cores, parallel_compiling.units)
    ]
    monkeypatch.setattr(compiled, "FOLDER", tmp_path)
    monkeypatch.setattr(parallel_compiling, "cores", lambda: 2)
    monkeypatch.setattr(parallel_compiling, "units", lambda *_: units)
    monkeypatch.setattr(parallel_compiling, "PATIENCE", 0.2)
    monkeypatch.setattr(parallel_compiling, "HELPER", helper)
    parallel_compiling.compile_in_parallel(Kind(walls=False, play=False, knots=False))
    assert done == ["cores", "units"]
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has other locks")
def test_parts_of_a_process_that_was_killed_are_removed(tmp_path, monkeypatch):
    monkeypatch.setattr(compiled, "FOLDER", tmp_path)
    (tmp_path / "parts-1" / "part-0").mkdir(parents=True)
    (tmp_path / "room").mkdir()
    with compiled.one_at_a_time():
        assert [kept.name for kept in tmp_path.iterdir()] == ["room"]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has other locks")
def test_where_nothing_can_be_locked_parts_may_be_of_another_process(tmp_path, monkeypatch):
    def refused(*_):
        raise OSError

    monkeypatch.setattr(compiled, "FOLDER", tmp_path)
    monkeypatch.setattr(compiled.fcntl, "flock", refused)
    (tmp_path / "parts-1").mkdir()
    with compiled.one_at_a_time():
        assert (tmp_path / "parts-1").is_dir()


@pytest.mark.parametrize("then", [None, RuntimeError("no compiled object yet")])
def test_an_interrupt_that_llvm_swallows_is_one_all_the_same(then, capsys):
    """It comes in a function that is called back from outside of Python, as LLVM does."""

    @ctypes.CFUNCTYPE(None)
    def interrupted():
        raise KeyboardInterrupt

    def compile_something():
        interrupted()
        if then is not None:
            raise then

    with pytest.raises(KeyboardInterrupt), compiled.hearing_interrupts():
        compile_something()
    assert capsys.readouterr().err == ""
    with pytest.raises(RuntimeError, match="another"), compiled.hearing_interrupts():
        raise RuntimeError("another")


def test_an_interrupt_ends_the_processes(tmp_path):
    idle = [sys.executable, "-c", "import time; time.sleep(3600)"]
    with (
        suppress(KeyboardInterrupt),
        parallel_compiling.processes(idle, [tmp_path, tmp_path]) as helpers,
    ):
        raise KeyboardInterrupt
    assert all(helper.returncode is not None for helper in helpers)


def test_a_process_that_helps_ends_with_its_parent(tmp_path):
    pytest.importorskip("numba")
    given = json.dumps([sys.path, [False, False, False], [0], str(tmp_path)])
    helper = [sys.executable, "-c", parallel_compiling.HELPER, given]
    with parallel_compiling.processes(helper, [tmp_path / "part"]) as (process,):
        process.stdin.close()
        assert process.wait(timeout=120) == 1
        process.stdin = None

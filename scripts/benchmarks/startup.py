"""Times until something happens: import, check, load, prepare, and the first compiled run."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from functools import partial

from benchmarks.measuring import Table, timed
from benchmarks.strike import MODEL, ROOT
from benchmarks.variants import BEAM, VARIANTS
from exudyn_flexlink import load_scene, simulate
from exudyn_flexlink.engines.lagrangian.parallel_compiling import cores

BRIEF = ("run={duration: 0.01, sample: 1 ms}", BEAM)
NOTHING, CHECK = "Python, doing nothing", "command 'check'"
FIRST_RUN = (
    "from exudyn_flexlink import load_scene, simulate; "
    "result = simulate(load_scene({model!r}, {settings!r}), {engine!r}); "
    "print(result.timings.get('compile', 0.0))"
)


def in_new_process(*arguments: str, **environment: str) -> tuple[float, str]:
    """Processor time (s) of a new Python with these arguments, user and system; what it printed.

    Raises:
        subprocess.CalledProcessError: it failed.

    """
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    printed = subprocess.run(
        [sys.executable, *arguments],
        check=True,
        capture_output=True,
        text=True,
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
    ).stdout
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime, printed


def processes(repeat: int) -> list[tuple[str, float]]:
    """What a new process takes (s), the least of a few, in turn."""
    commands = {
        NOTHING: ("-c", "pass"),
        "import exudyn_flexlink": ("-c", "import exudyn_flexlink"),
        "import, with load_scene": ("-c", "from exudyn_flexlink import load_scene"),
        "import, with the Exudyn engine": ("-c", "import exudyn_flexlink.engines.exudyn.run"),
        CHECK: ("-m", "exudyn_flexlink", "check", str(MODEL)),
    }
    best = dict.fromkeys(commands, float("inf"))
    for _ in range(repeat):
        for name, arguments in commands.items():
            best[name] = min(best[name], in_new_process(*arguments)[0])
    return list(best.items())


def in_this_process(repeat: int) -> list[tuple[str, float]]:
    """Loading a scene, and a run of no length, which is preparing and finishing (s)."""
    rows = [("load_scene", min(timed(partial(load_scene, MODEL, BRIEF))[1] for _ in range(repeat)))]
    for variant in VARIANTS:
        settings = ("run={duration: 1e-6, sample: 1e-6}", BEAM)
        scene = load_scene(MODEL, (*settings, *variant.stepping()))
        simulate(scene, variant.engine)
        costs = [timed(partial(simulate, scene, variant.engine))[1] for _ in range(repeat)]
        rows.append((f"prepare and finish a run, {variant.name}", min(costs)))
    return rows


def first_runs(repeat: int) -> list[tuple[str, float]]:
    """10 ms of motion in a new process, with nothing compiled before and with everything (s)."""
    rows = []
    for variant in VARIANTS:
        code = FIRST_RUN.format(
            model=str(MODEL), settings=(*BRIEF, *variant.settings), engine=variant.engine
        )
        with tempfile.TemporaryDirectory() as folder:
            run = ("-c", code)
            cold, waited = in_new_process(*run, NUMBA_CACHE_DIR=folder)
            warm = min(in_new_process(*run, NUMBA_CACHE_DIR=folder)[0] for _ in range(repeat))
        if float(waited):
            rows.append((f"first run of all, compiling, {variant.name}", cold))
            name = f"compiling, as one waits for it on {cores()} cores, {variant.name}"
            rows.append((name, float(waited)))
        rows.append((f"first run in a new process, {variant.name}", warm))
    return rows


def tables(quick: bool = False, repeat: int = 3) -> list[Table]:
    """Measure, and tell it."""
    rows = [*processes(repeat), *in_this_process(repeat)]
    rows += first_runs(1 if quick else repeat)
    cost = dict(rows)
    return [
        Table(
            "Starting up",
            ("what", "processor time"),
            tuple((name, f"{seconds:.3f} s") for name, seconds in rows),
            f"'check' answers after {cost[CHECK]:.2f} s, of which Python itself takes "
            f"{cost[NOTHING]:.2f} s.",
        )
    ]

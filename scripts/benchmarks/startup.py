"""Times until something happens: import, check, load, prepare, and the first run."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from functools import partial

from benchmarks.measuring import Table, timed
from benchmarks.strike import MODEL, ROOT
from benchmarks.variants import BEAM, VARIANTS
from exudyn_flexlink import load_scene, simulate

BRIEF = ("run={duration: 0.01, sample: 1 ms}", BEAM)
NOTHING, CHECK = "Python, doing nothing", "command 'check'"
FIRST_RUN = (
    "from exudyn_flexlink import load_scene, simulate; "
    "simulate(load_scene({model!r}, {settings!r}), {engine!r})"
)


def in_new_process(*arguments: str) -> float:
    """Processor time (s) of a new Python with these arguments, user and system.

    Raises:
        subprocess.CalledProcessError: it failed.

    """
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, *arguments],
        check=True,
        capture_output=True,
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


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
            best[name] = min(best[name], in_new_process(*arguments))
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
    """10 ms of motion in a new process (s)."""
    rows = []
    for variant in VARIANTS:
        code = FIRST_RUN.format(
            model=str(MODEL), settings=(*BRIEF, *variant.settings), engine=variant.engine
        )
        cost = min(in_new_process("-c", code) for _ in range(repeat))
        rows.append((f"first run in a new process, {variant.name}", cost))
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

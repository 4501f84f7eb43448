"""Time scenes at this checkout and at another commit, in turn.

  .venv/bin/python scripts/compare_commits.py HEAD~1                 all scenes, some minutes
  .venv/bin/python scripts/compare_commits.py HEAD~1 slider_crank --repeat 5
  .venv/bin/python scripts/compare_commits.py HEAD~1 whitworth my.yaml --both --tolerance 1e-6

With --both the second run that measures the error counts, too; a scene may be a file of yours.
The other commit is checked out into a temporary folder. Both read the model files of this checkout.
Every run is a process of its own, A B A B ..., and simulates twice: the second time counts, since
the first imports. Steps are told, too: a run that is faster by fewer of them may be less accurate.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import process_time

from benchmarks.measuring import Table

ROOT = Path(__file__).resolve().parent.parent
CHILD = "--simulate"  # as the first argument: time one scene, and print it as JSON
COLUMNS = ("scene", "by", "here", "there", "ratio", "steps")
ONE_TURN = ("run.turns=1", "accuracy.tolerance=4e-5")
CASES: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    ("smooth", "exudyn", ()),
    ("no_clearance", "exudyn", ()),
    ("clearance", "exudyn", ONE_TURN),
    ("textbook/slider_crank", "exudyn", ()),
    ("textbook/flexible_four_bar", "exudyn", ()),
    ("textbook/cam_follower", "exudyn", ()),
    ("textbook/free_slider_crank", "exudyn", ()),
    ("textbook/whitworth", "exudyn", ()),
    ("textbook/geneva_wheel", "exudyn", ()),
    ("textbook/pump", "exudyn", ()),
    ("benchmarks/n_four_bar", "exudyn", ("accuracy.tolerance=1e-8",)),
    ("benchmarks/andrews_squeezer", "exudyn", ()),
    ("no_clearance", "lagrangian", ()),
    ("clearance", "lagrangian", ONE_TURN),
)
"""Models, engines and settings."""
SCENES = list(dict.fromkeys(Path(model).stem for model, *_ in CASES))


def simulate_here(model: str, engine: str, both: str, *settings: str) -> None:
    """Simulate twice by the package of a checkout; print the last processor time (s) and steps.

    It has one core, so that the second run of a measured one is made in this process, too.
    """
    from exudyn_flexlink import load_scene, simulate  # noqa: PLC0415 - not of this checkout

    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    scene = load_scene(Path(model), list(settings))
    for _ in range(2):
        began = process_time()
        result = simulate(scene, engine, measure=bool(both))
        seconds = process_time() - began
        if not result.outcome.completed:
            raise SystemExit(f"stopped at {result.outcome.time} s: {result.outcome.reason}")
    print(json.dumps([seconds, result.checks.steps]))


def timed(root: Path, model: str, engine: str, both: str, *settings: str) -> tuple[float, int]:
    """Processor time (s) and steps of a scene in a new process, by the package of a checkout.

    Raises:
        RuntimeError: the file can't be read there, or the run stopped early.

    """
    file = Path(model) if Path(model).suffix else ROOT / "models" / f"{model}.yaml"
    ended = subprocess.run(
        [sys.executable, __file__, CHILD, str(file), engine, both, *settings],
        capture_output=True, text=True, check=False, env={**os.environ, "PYTHONPATH": str(root)},
    )  # fmt: skip
    if ended.returncode:
        where = "here" if root == ROOT else "there"
        raise RuntimeError(f"{model} by {engine} failed {where}: {ended.stderr.strip()}")
    seconds, steps = json.loads(ended.stdout)
    return seconds, steps


def row(
    there: Path, repeat: int, model: str, engine: str, both: str, *settings: str
) -> tuple[str, ...]:
    """A row of the table: medians over pairs."""
    pairs = [[timed(root, model, engine, both, *settings) for root in (ROOT, there)]
             for _ in range(repeat)]  # fmt: skip
    here, other = (median(pair[i][0] for pair in pairs) for i in (0, 1))
    ratio = median(one[0] / two[0] for one, two in pairs)
    steps = " / ".join(str(steps) for _, steps in pairs[0])
    return (Path(model).stem, engine, f"{here:.2f} s", f"{other:.2f} s", f"{ratio:.3g}", steps)


@contextmanager
def checked_out(commit: str) -> Iterator[Path]:
    """A temporary folder with the files of a commit.

    Raises:
        subprocess.CalledProcessError: there is no such commit.

    """
    with TemporaryDirectory() as folder:
        place = Path(folder).resolve() / "there"
        git = ["git", "-C", str(ROOT), "worktree"]
        subprocess.run([*git, "add", "--quiet", "--detach", str(place), commit], check=True)
        try:
            yield place
        finally:
            subprocess.run([*git, "remove", "--force", str(place)], check=True)


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("commit", help="a hash, a tag or a branch")
    names = f"of: {', '.join(SCENES)}; or files"
    parser.add_argument("scenes", nargs="*", metavar="scene", help=names)
    parser.add_argument("--repeat", type=int, default=3, help="pairs of runs")
    parser.add_argument("--both", action="store_true", help="measured runs: two runs each")
    parser.add_argument("--tolerance", type=float, help="of all scenes, m; left out: as they say")
    options = parser.parse_args()
    files = [name for name in options.scenes if Path(name).suffix]
    if unknown := [name for name in options.scenes if name not in {*SCENES, *files}]:
        parser.error(f"no scene '{unknown[0]}'; there is: {', '.join(SCENES)}")
    cases = [case for case in CASES if not options.scenes or Path(case[0]).stem in options.scenes]
    cases += [(file, "exudyn", ()) for file in files]
    shared = () if options.tolerance is None else (f"accuracy.tolerance={options.tolerance}",)
    both, repeat, rows = "both" * options.both, max(1, options.repeat), []
    try:
        with checked_out(options.commit) as there:
            for model, engine, settings in cases:
                print(f"{model} by {engine} ...", file=sys.stderr, flush=True)
                rows.append(row(there, repeat, model, engine, both, *settings, *shared))
    except (subprocess.CalledProcessError, RuntimeError) as error:
        parser.error(str(error))
    told = f"Processor times, and here over there, are medians over {options.repeat} pairs."
    print(Table(f"This checkout and {options.commit}", COLUMNS, tuple(rows), told))
    return 0


if __name__ == "__main__":
    if sys.argv[1:2] == [CHILD]:
        simulate_here(*sys.argv[2:])
    else:
        sys.exit(main())

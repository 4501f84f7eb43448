"""Time scenes at this checkout and at another commit in turn, and compare their errors.

  .venv/bin/python scripts/compare_commits.py HEAD~1                 all scenes, some minutes
  .venv/bin/python scripts/compare_commits.py HEAD~1 slider_crank --repeat 5

The other commit is checked out into a temporary folder. Both read the model files of this checkout.
Every run is a process of its own, A B A B ..., and simulates twice: the second time counts, since
the first imports. Errors are the largest distance of any body from a tight run of this
checkout. They are told where the motion is not sensitive.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import numpy as np
from benchmarks.measuring import Table
from benchmarks.printing import markdown, show
from rich.console import Console

from exudyn_flexlink.arrays import FloatArray

ROOT = Path(__file__).resolve().parent.parent
CHILD = ROOT / "scripts" / "benchmarks" / "timed_simulation.py"
TIGHT = 1e-10  # m
DIGITS = 9  # of instants (s) that are the same
COLUMNS = ("scene", "by", "tolerances, m", "here", "there", "ratio", "asked", "errors, m", "")


@dataclass(frozen=True)
class Case:
    """A model and an engine, with the tolerances (m) of both commits.

    `asked`: the largest ratio of times that is allowed. It is told, not tested. `instead`:
    words of the file, and what both read in place of them.
    """

    model: str
    engine: str
    asked: float
    here: float = 1e-6
    there: float = 1e-6
    judged: bool = True  # by its errors
    instead: tuple[tuple[str, str], ...] = ()

    @property
    def scene(self) -> str:
        """Its short name."""
        return Path(self.model).stem

    def file(self, folder: Path) -> Path:
        """The model file, or one in a folder, with other words in it."""
        own = ROOT / "models" / f"{self.model}.yaml"
        if not self.instead:
            return own
        text = own.read_text(encoding="utf-8")
        for words, others in self.instead:
            text = text.replace(words, others)
        changed = folder / own.name
        changed.write_text(text, encoding="utf-8")
        return changed


ONE_TURN = (("turns: 4", "turns: 1"),)
AT_MOST = 1.15  # of the time before: what simpler code may cost
CASES = (
    Case("smooth", "exudyn", AT_MOST),
    Case("no_clearance", "exudyn", AT_MOST, judged=False),
    Case("clearance", "exudyn", AT_MOST, 4e-5, 4e-5, judged=False, instead=ONE_TURN),
    Case("textbook/slider_crank", "exudyn", AT_MOST),
    Case("textbook/flexible_four_bar", "exudyn", AT_MOST),
    Case("textbook/cam_follower", "exudyn", AT_MOST),
    Case("benchmarks/n_four_bar", "exudyn", AT_MOST, 1e-8, 1e-8, judged=False),
    Case("no_clearance", "lagrangian", AT_MOST, judged=False),
    Case("clearance", "lagrangian", AT_MOST, 4e-5, 4e-5, judged=False, instead=ONE_TURN),
)
SCENES = list(dict.fromkeys(case.scene for case in CASES))


class RunFailedError(Exception):
    """A simulation that could not be made: where, and the first line of why."""


@dataclass(frozen=True)
class Motion:
    """What a process computed: instants (N,) s, places (N, bodies, 2) m, and its time in s."""

    time: FloatArray
    places: FloatArray
    seconds: float


def simulated(root: Path, case: Case, tolerance: float, runs: int = 2) -> Motion:
    """Simulate a case in a new process, by the package of a checkout; the last run is timed.

    Raises:
        RunFailedError: the file can't be read there, or the run stopped early.

    """
    with TemporaryDirectory() as scratch:
        folder = Path(scratch)
        out = folder / "motion.npz"
        settings = f"accuracy.tolerance={tolerance!r}"
        told = (root, case.file(folder), case.engine, runs, out, settings)
        ended = subprocess.run(
            [sys.executable, str(CHILD), *map(str, told)],
            capture_output=True,
            text=True,
            check=False,
        )
        if ended.returncode:
            why = reason(ended.stderr) or f"exit code {ended.returncode}"
            raise RunFailedError(f"{'here' if root == ROOT else 'there'}: {why}")
        with np.load(out) as motion:
            places = motion["poses"][:, :, :2]
            return Motion(motion["time"], places, json.loads(ended.stdout.splitlines()[-1])[-1])


def reason(printed: str) -> str:
    """The first line of an error's message, after the lines of code that led to it."""
    lines = printed.rpartition("Traceback")[2].splitlines()
    return next((line for line in lines if line[:1].strip()), "")


def apart(one: Motion, other: Motion) -> str:
    """Largest distance (m) of any body at the instants that both have sampled, as text."""
    times = [np.round(motion.time, DIGITS) for motion in (one, other)]
    _, i, j = np.intersect1d(times[0], times[1], return_indices=True)
    if one.places.shape[1] != other.places.shape[1] or not len(i):
        return "not the same bodies or instants"
    return f"{np.linalg.norm(one.places[i] - other.places[j], axis=2).max():.1e}"


def row(case: Case, there: Path, repeat: int) -> tuple[tuple[str, ...], str]:
    """A row of the table, and what went wrong, if something did."""
    name = (case.scene, case.engine, f"{case.here:g}, {case.there:g}")
    asked = f"{case.asked:.2g}"
    pairs, errors = [], ["", ""]
    try:
        for _ in range(repeat):
            here = simulated(ROOT, case, case.here)
            pairs.append((here, simulated(there, case, case.there)))
        if case.judged:
            truth = simulated(ROOT, case, TIGHT, runs=1)
            errors = [apart(motion, truth) for motion in pairs[0]]
    except RunFailedError as error:
        cells = (*name, "failed", "", "", asked, "", "")
        return cells, f"Failed: {case.scene} by {case.engine}, {error}."
    times = [
        f"{median(motion.seconds for motion in side):.2f} s" for side in zip(*pairs, strict=True)
    ]
    ratio = median(here.seconds / other.seconds for here, other in pairs)
    return (*name, *times, f"{ratio:.3g}", asked, *errors), ""


def commit_of(name: str) -> str:
    """The hash that a name stands for; empty if there is no such commit."""
    asked = ["git", "-C", str(ROOT), "rev-parse", "--verify", "--quiet", f"{name}^{{commit}}"]
    try:
        return subprocess.run(asked, capture_output=True, text=True, check=False).stdout.strip()
    except FileNotFoundError:
        return ""  # no git


@contextmanager
def checked_out(commit: str) -> Iterator[Path]:
    """A temporary folder with the files of a commit."""
    with TemporaryDirectory() as folder:
        place = Path(folder).resolve() / "there"
        git = ["git", "-C", str(ROOT), "worktree"]
        try:
            subprocess.run(
                [*git, "add", "--quiet", "--detach", str(place), commit], check=True, text=True
            )
            yield place
        finally:
            if place.exists():
                subprocess.run([*git, "remove", "--force", str(place)], check=True, text=True)


def table(cases: Sequence[Case], there: Path, commit: str, repeat: int) -> Table:
    """Measure all cases, and tell it."""
    rows, wrong = [], []
    for case in cases:
        print(f"{case.scene} by {case.engine} ...", file=sys.stderr, flush=True)
        cells, trouble = row(case, there, repeat)
        rows.append(cells)
        if trouble:
            wrong.append(trouble)
    told = (
        f"Processor times and their ratio, here over there, are medians over pairs: {repeat}. "
        "Tolerances and errors of this checkout come first."
    )
    return Table(f"This checkout and {commit}", COLUMNS, tuple(rows), " ".join([told, *wrong]))


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("commit", help="a hash, a tag or a branch")
    parser.add_argument("scenes", nargs="*", metavar="scene", help=f"of: {', '.join(SCENES)}")
    parser.add_argument("--repeat", type=int, default=3, help="pairs of runs")
    parser.add_argument("--markdown", action="store_true", help="print the table as Markdown")
    options = parser.parse_args()
    if unknown := [name for name in options.scenes if name not in SCENES]:
        parser.error(f"no scene '{unknown[0]}'; there is: {', '.join(SCENES)}")
    found = commit_of(options.commit)
    if not found:
        parser.error(f"no commit '{options.commit}' in {ROOT}: see 'git log --oneline'")
    cases = [case for case in CASES if not options.scenes or case.scene in options.scenes]
    with checked_out(found) as there:
        made = table(cases, there, options.commit, max(1, options.repeat))
    if options.markdown:
        print(markdown(made))
    else:
        show(Console(width=140), made)
    return 0


if __name__ == "__main__":
    sys.exit(main())

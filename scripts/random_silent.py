"""Random scenes of six kinds that once went wrong without a word, against closed forms.

Usage:
  .venv/bin/python scripts/random_silent.py             640 scenes, on all cores, four minutes
  .venv/bin/python scripts/random_silent.py --kinds 1 2 --count 50 --seed 7
  .venv/bin/python scripts/random_silent.py --only 20017  one of them, with its model files

Kinds: short pulses in formulas and tables of time (1); forces and torques that bend with the state,
over three lengths of run (2); wheels on and in each other, in either order, and on a floor (3);
cams through points of which two nearly repeat (4); open rows of points without `closed` (5); tables
in other units, spellings, separators and orders of columns (6). A fifth of kinds 4 to 6 has no such
flaw. A scene's number is 10000 times its kind, and a count. Every sample of a run is held against a
closed form. What warns, stops or is refused is told; silent is what does none of that and is off by
more than its tolerance. The exit code is 1 if a scene is silent or crashes, or is refused though it
has no flaw.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import yaml
from benchmarks.side_by_side import add_numbers, judged
from fuzzing.limits import TooLongError, limited
from silent.drives import kinks, pulses
from silent.points import arcs, repeats, tables
from silent.scenes import Case
from silent.wheels import wheels

from exudyn_flexlink import NotRepresentableError, SceneError, load_scene, simulate

KINDS = {
    1: ("pulses in time", pulses, 1.0),
    2: ("kinks in the state", kinks, 1.0),
    3: ("order of two circles", wheels, 0.3),
    4: ("rows that nearly repeat", repeats, 0.3),
    5: ("open rows of points", arcs, 0.3),
    6: ("measured tables", tables, 0.3),
}
"""Names, what draws them, and how many in parts of `--count`."""
FROM = 10_000  # a kind's scenes are numbered from here times the kind on
OF_FIGURES = "samples are"  # a warning of what figures show, not of errors
PATIENCE = 60.0  # s of processor time that a run may take
SHOWN = 3  # of a kind's bad scenes are named
RIGHT, DOUBTED, TOLD, REFUSED = "right", "right, and warned", "over and told", "refused"
NEEDLESS, LATE, SILENT, CRASHED = "refused, no flaw", "not waited for", "over SILENTLY", "CRASHED"
VERDICTS = (RIGHT, DOUBTED, TOLD, REFUSED, LATE, NEEDLESS, SILENT, CRASHED)  # the worst is last
BAD = (SILENT, NEEDLESS, CRASHED)
NAMED = (*BAD, LATE)


@dataclass(frozen=True)
class Verdict:
    """What became of a run: by how many tolerances it is off, and what it says itself."""

    kind: str
    off: float = 0.0
    told: str = ""


def written(case: Case) -> str:
    """Return the model file of a case."""
    return yaml.safe_dump({"title": "drawn", **case.model}, sort_keys=False)


def judge(case: Case, measure: bool = True) -> Verdict:
    """Run a case, and hold it against its closed form."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "drawn.yaml"
        path.write_text(written(case), encoding="utf-8")
        path.with_name("rows.csv").write_text(case.rows, encoding="utf-8")
        try:
            with limited(PATIENCE), warnings.catch_warnings():
                warnings.simplefilter("error", RuntimeWarning)  # NumPy's may reach no user
                result = simulate(load_scene(path), measure=measure)
                off = case.off(result) / case.model["accuracy"]["tolerance"]
        except TooLongError:
            return Verdict(LATE)
        except (NotRepresentableError, SceneError) as error:
            return Verdict(REFUSED if case.flawed else NEEDLESS, told=" ".join(str(error).split()))
        except Exception as error:  # what a user would see as a traceback is looked for here
            return Verdict(CRASHED, told=f"{type(error).__name__}: {error}")
    said = [one for one in result.warnings if not one.startswith(OF_FIGURES)]
    told = "; ".join(said if result.outcome.completed else [result.outcome.told, *said])
    if off <= 1:
        return Verdict(DOUBTED if told else RIGHT, off, told)
    return Verdict(TOLD if told else SILENT, off, told)


def drawn(scene: int, seed: int) -> list[Case]:
    """Draw the runs of a scene by its number."""
    _, draw, _ = KINDS[scene // FROM]
    return draw(np.random.default_rng([seed, scene]))


def verdict_of(scene: int, seed: int, measure: bool) -> Verdict:
    """Judge a scene by its number: the worst of its runs counts."""
    found = [judge(case, measure) for case in drawn(scene, seed)]
    return max(found, key=lambda one: (VERDICTS.index(one.kind), one.off))


def table(found: dict[int, Verdict]) -> Iterator[str]:
    """Lines that count the verdicts of each kind."""
    yield f"| | {' | '.join(VERDICTS)} | largest of those not told, tolerances |"
    yield "|---" * (len(VERDICTS) + 2) + "|"
    for kind, (name, *_) in KINDS.items():
        own = [one for scene, one in found.items() if scene // FROM == kind]
        counts = Counter(one.kind for one in own)
        largest = max((one.off for one in own if one.kind in (RIGHT, SILENT)), default=0.0)
        yield f"| {name} | {' | '.join(str(counts[kind]) for kind in VERDICTS)} | {largest:.2g} |"


def main() -> int:
    """Print the first bad scenes of each kind, and a table of all verdicts."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    add_numbers(parser, 200)
    parser.add_argument("--kinds", type=int, nargs="+", choices=KINDS, default=list(KINDS))
    options = parser.parse_args()
    shares = {kind: range(round(KINDS[kind][2] * options.count)) for kind in options.kinds}
    numbers = [kind * FROM + k for kind, own in shares.items() for k in own]
    if options.only is not None:
        numbers = [options.only]
        for case in drawn(options.only, options.seed):
            print(written(case), case.rows, sep="\n")
    judge_one = partial(verdict_of, seed=options.seed, measure=options.measure)
    found = dict(judged(judge_one, numbers, options.jobs))
    for kind in options.kinds:
        own = [scene for scene in found if scene // FROM == kind and found[scene].kind in NAMED]
        for scene in own[:SHOWN]:
            one = found[scene]
            print(f"{scene} of seed {options.seed}, {one.kind}: {one.off:.2g}; {one.told}")
    print(*table(found), sep="\n")
    return 1 if any(one.kind in BAD for one in found.values()) else 0


if __name__ == "__main__":
    sys.exit(main())

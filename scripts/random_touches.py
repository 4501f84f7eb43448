"""Random touches that are short, or many, against closed forms: none may be missed silently.

Usage:
  .venv/bin/python scripts/random_touches.py             300 of each kind, on all cores
  .venv/bin/python scripts/random_touches.py --kinds throw hops --count 50 --seed 7
  .venv/bin/python scripts/random_touches.py --kinds throw --only 12   its model file, told in full

"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from benchmarks.side_by_side import add_numbers, judged, numbers_of
from benchmarks.verdicts import CRASHED, LATE, REFUSED, RIGHT, SILENT, STOPPED, TOLD, Verdict, of_file, table
from touching.balls import billiard, hops, throw
from touching.drawn import Drawn, Rng, until_clear
from touching.parts import hill

from exudyn_flexlink import load_scene, simulate

DOUBTED, NEEDLESS = "right, and warned", "told far too early"
VERDICTS = (RIGHT, DOUBTED, TOLD, STOPPED, LATE, REFUSED, NEEDLESS, SILENT, CRASHED)
KINDS: dict[str, Callable[[Rng], Drawn]] = {own.__name__: own for own in (throw, hops, hill, billiard)}
PATIENCE = 120.0  # s of processor time
NUMBER = 10_000


def scene_of(kind: str, number: int, seed: int) -> Drawn:
    """Draw a scene by its kind and its number."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind), number])
    return until_clear(KINDS[kind], rng)


def judge(drawn: Drawn, kind: str, measure: bool = True) -> Verdict:
    """Run a scene, and hold it against its closed form."""

    def verdict(path: Path) -> Verdict:
        result = simulate(load_scene(path), measure=measure)
        tolerance = result.scene.accuracy.tolerance
        off = np.abs(result.path(drawn.at).position @ (1, 1j) - drawn.right(result.time)) / tolerance
        told = np.inf if result.error.exceeds_from is None else result.error.exceeds_from
        said = "; ".join([result.outcome.told, *result.warnings])
        before = off[result.time < told].max(initial=0.0)
        if before > 1:
            return Verdict(kind, SILENT, before, said)
        if not result.outcome.completed:
            return Verdict(kind, STOPPED, before, said)
        if told < drawn.quiet:
            return Verdict(kind, NEEDLESS, off.max(), said)
        right = DOUBTED if np.isfinite(told) else RIGHT
        return Verdict(kind, TOLD if off.max() > 1 else right, off.max(), said)

    return of_file(drawn.model, kind, PATIENCE, verdict)


def verdict_of(pair: tuple[str, int], seed: int, measure: bool) -> Verdict:
    kind, number = pair
    return judge(scene_of(kind, number, seed), kind, measure)


def main() -> int:
    """Print the scenes that are wrong, and a table of all verdicts."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    add_numbers(parser, 300)
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    options = parser.parse_args()
    pairs = [(kind, k) for kind in options.kinds for k in numbers_of(options) if k < MOST.get(kind, k + 1)]
    if options.only is not None:
        for kind, number in pairs:
            print(scene_of(kind, number, options.seed).model)
    found = []
    for (kind, number), one in judged(partial(verdict_of, seed=options.seed, measure=options.measure), pairs, options.jobs):
        found.append(one)
        if VERDICTS.index(one.kind) >= VERDICTS.index(STOPPED) or options.only is not None:
            print(f"{kind} {number} of seed {options.seed}, {one.kind}: {one.off:.2g}; {one.told}", flush=True)
    print(*table(found, options.kinds, VERDICTS, (RIGHT, DOUBTED, SILENT), "largest of those not told"), sep="\n")
    return int(any(one.kind in (NEEDLESS, SILENT, CRASHED) for one in found))


MOST = {"billiard": 12, "strikes": 40}

if __name__ == "__main__":
    raise SystemExit(main())

"""Random scenes, drawn and judged by their numbers in processes beside each other."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from os import cpu_count
from typing import TypeVar

from exudyn_flexlink.cli.terminal import progress_bar

Judged = TypeVar("Judged")


def add_numbers(parser: argparse.ArgumentParser, count: int) -> None:
    """Add the options that say which scenes are drawn, `count` where nothing is said."""
    parser.add_argument("--count", "--number", type=int, default=count)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, help="number of one scene, told in full")
    parser.add_argument("--jobs", type=int, default=cpu_count() or 1, help="runs at once")
    parser.add_argument(
        "--no-measure",
        dest="measure",
        action="store_false",
        help="judge one run of each scene, and so the steps, not the errors that two runs tell",
    )


def numbers_of(options: argparse.Namespace) -> Sequence[int]:
    """Numbers of the scenes that the options ask for."""
    return range(options.count) if options.only is None else [options.only]


def judged(
    judge: Callable[[int], Judged], numbers: Sequence[int], jobs: int
) -> Iterator[tuple[int, Judged]]:
    """Yield each number with what comes of its scene, in order, and show how many are done."""
    with ProcessPoolExecutor(jobs) as pool, progress_bar(False, "judging") as progress:
        for done, pair in enumerate(zip(numbers, pool.map(judge, numbers), strict=True), start=1):
            yield pair
            if progress is not None:
                progress(done / len(numbers))

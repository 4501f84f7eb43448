"""The command `verify`: benchmarks, held against numbers that others published."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import partial

from exudyn_flexlink.cli.keeping import write_figure
from exudyn_flexlink.cli.running import run
from exudyn_flexlink.cli.terminal import DONE, FAILED, INTERRUPTED, complain, tell
from exudyn_flexlink.report import verification_data, verification_markdown, verification_text
from exudyn_flexlink.result import INTERRUPTED as STOPPED
from exudyn_flexlink.shipped import benchmark_files
from exudyn_flexlink.storage.documents import in_json
from exudyn_flexlink.verification import Benchmark, VerifiedRun, judged, read_benchmark


def verify_command(options: argparse.Namespace) -> int:
    """Run benchmarks and print how far they are off; code 1: one by more than is allowed."""
    found: list[VerifiedRun] = []
    files = options.benchmarks or benchmark_files().values()
    # All are read before the first is run: a mistake is no news for the end.
    whole = _verify([read_benchmark(file) for file in files], options, found)
    if found:
        tell(_printed(found, options.form))
    if not whole:
        return complain("interrupted: runs are missing", INTERRUPTED)
    code = DONE if all(one.fine for one in found) else FAILED
    if options.figure is None:
        return code
    from exudyn_flexlink.plots import differences

    return write_figure(options.figure, partial(differences, found), force=options.force) or code


def _verify(
    benchmarks: Sequence[Benchmark], options: argparse.Namespace, found: list[VerifiedRun]
) -> bool:
    """Make all runs, and add what comes of each to `found`; tells whether the user let them end."""
    pairs = [(benchmark, one) for benchmark in benchmarks for one in benchmark.runs]
    for i, (benchmark, one) in enumerate(pairs, 1):
        what = f"{i} of {len(pairs)}: {benchmark.name}, {one.name}"
        result, enough = run(one.scene, one.engine, options, what)
        if result.outcome.reason != STOPPED:
            found.append(judged(benchmark, one, result))
        if enough:
            return False
    return True


def _printed(found: Sequence[VerifiedRun], form: str) -> str:
    if form == "json":
        return in_json(verification_data(found), indent=2).decode().rstrip()
    return verification_markdown(found) if form == "markdown" else verification_text(found)

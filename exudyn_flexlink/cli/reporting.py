"""The command `report`, and the page that `simulate --report` puts beside a run."""

from __future__ import annotations

import argparse
from pathlib import Path

from exudyn_flexlink.cli.keeping import added, made
from exudyn_flexlink.cli.terminal import DONE
from exudyn_flexlink.result import Result
from exudyn_flexlink.storage import load, staged_files


def report_command(options: argparse.Namespace) -> int:
    """Write the page of a saved run; returns the exit code."""
    from exudyn_flexlink.page import PAGE, write_page

    def write() -> None:
        result = load(options.run)
        if options.out is None:
            with staged_files(options.run, force=options.force) as staged:
                write_page(result, staged / PAGE)
        else:
            write_page(result, options.out, force=options.force)

    code = made("report", write)
    if code == DONE:
        print(f"Report written to {options.out or options.run / PAGE}")
    return code


def reported(result: Result, folder: Path) -> int:
    """Write the page of a run beside its numbers; returns the exit code, see `added`."""
    from exudyn_flexlink.page import PAGE, write_page

    return added("report", lambda: write_page(result, folder / PAGE))

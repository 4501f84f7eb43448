"""The command `report`, and the page that `simulate --report` puts beside a run."""

from __future__ import annotations

import argparse
from pathlib import Path

from exudyn_flexlink.cli.keeping import added, why_not
from exudyn_flexlink.cli.terminal import DONE, FAILED, complain, refuse
from exudyn_flexlink.result import Result
from exudyn_flexlink.storage import StorageError, load, staged_files


def report_command(options: argparse.Namespace) -> int:
    """Write the page of a saved run; returns the exit code."""
    from exudyn_flexlink.page import PAGE, write_page

    file: Path = options.out or options.run / PAGE
    try:
        result = load(options.run)
        if options.out is None:
            with staged_files(options.run, force=options.force) as staged:
                write_page(result, staged / PAGE)
        else:
            write_page(result, file, force=options.force)
    except StorageError as error:
        return refuse(error)
    except Exception as error:  # a mistake of the program: the run itself is sound
        return complain(f"no report: {why_not(error)}; please report it", FAILED)
    print(f"Report written to {file}")
    return DONE


def reported(result: Result, folder: Path) -> int:
    """Write the page of a run beside its numbers; returns the exit code, see `added`."""
    from exudyn_flexlink.page import PAGE, write_page

    return added("report", lambda: write_page(result, folder / PAGE))

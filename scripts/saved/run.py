"""What scripts about one saved run do alike: a table, and if asked for a CSV file and a figure."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

import exudyn_flexlink as fl
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.storage import write_csv


def told(
    options: argparse.Namespace,
    table: Callable[[fl.Result], Table],
    columns: Callable[[fl.Result], dict[str, FloatArray]],
    figure: Callable[[fl.Result], Figure],
) -> int:
    """Load the run, print its table, write what is asked for; returns the exit code."""
    try:
        result = fl.load(options.run)
        shown = table(result)
        if options.csv:
            write_csv(options.csv, columns(result))
        if options.png:
            figure(result).savefig(options.png)
    except (fl.StorageError, ValueError) as error:
        print(error, file=sys.stderr)
        return 2
    except OSError as error:
        print(f"can't write {error.filename}: {error.strerror}", file=sys.stderr)
        return 2
    Console().print(shown)
    if not result.outcome.completed:
        print(f"incomplete: stopped at {result.outcome.time:.6g} s: {result.outcome.reason}")
    return 0


def parser(about: str | None) -> argparse.ArgumentParser:
    """Return a parser of the run, and of where its CSV file and its figure go."""
    made = argparse.ArgumentParser(
        description=about, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    made.add_argument("run", type=Path, metavar="RUN", help="folder of a finished run")
    made.add_argument("--csv", type=Path, metavar="FILE", help="write the motion as CSV")
    made.add_argument("--png", type=Path, metavar="FILE", help="write the figure")
    return made

"""Strikes and response of the struck body of a saved run: table, CSV, figure (paper, Fig. 4).

Examples:
  .venv/bin/python scripts/lever_response.py runs/no_clearance
  .venv/bin/python scripts/lever_response.py runs/no_clearance --csv lever.csv --png lever.png
  .venv/bin/python scripts/lever_response.py runs/two_levers --contact left

Exit codes: 0 done; 2 no such run or contact, or a file can't be written.

"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from exudyn_flexlink.observables import Strike, lever_response, settled, strikes
from exudyn_flexlink.plots import lever
from exudyn_flexlink.result import Result
from exudyn_flexlink.storage import StorageError, lever_columns, load, write_csv


def main() -> int:
    """Read a run folder, print the table, write what is asked for; returns the exit code."""
    options = _parser().parse_args()
    try:
        result = load(options.run)
        contact = options.contact or next(iter(result.scene.contacts), None)
        if contact is None:
            raise ValueError(f"the scene of {options.run} has no contact, so nothing is struck")
        table = _table(result, contact)
        if options.csv:
            write_csv(options.csv, lever_columns(result, contact))
        if options.png:
            _draw(result, options.png)
    except (StorageError, ValueError) as error:
        print(error, file=sys.stderr)
        return 2
    except OSError as error:
        print(f"can't write {error.filename}: {error.strerror}", file=sys.stderr)
        return 2
    Console().print(table)
    if not result.outcome.completed:
        print(f"incomplete: stopped at {result.outcome.time:.6g} s: {result.outcome.reason}")
    return 0


def _table(result: Result, contact: str) -> Table:
    """One column for each strike."""
    response, found = lever_response(result, contact), strikes(result, contact)
    (least, least_at), (greatest, greatest_at) = response.least, response.greatest
    word, unit = response.measure.word, response.measure.unit
    table = Table(
        title=f"{response.body}, struck in '{contact}': {result.scene.title}",
        caption=f"{response.body}: least {word} {least:.5f} {unit} at {least_at:.4f} s, "
        f"greatest {greatest:.5f} {unit} at {greatest_at:.4f} s",
    )
    table.add_column("strike")
    for i in range(len(found)):
        table.add_column(str(i + 1), justify="right")
    columns = [
        _cells(result, contact, strike, found[i + 1].begin if i + 1 < len(found) else None)
        for i, strike in enumerate(found)
    ]
    for name in columns[0] if columns else ():
        table.add_row(name, *(column[name] for column in columns))
    return table


def _cells(result: Result, contact: str, strike: Strike, following: float | None) -> dict[str, str]:
    response = lever_response(result, contact)
    until = response.time[-1] if following is None else following
    word, unit = response.measure.word, response.measure.unit
    values = response.value_at(np.linspace(strike.begin, until, 20000))
    rest = "-" if following is None else f"{settled(result, contact, following):.2g}"
    crank = None if strike.crank_angle is None else np.degrees(strike.crank_angle)
    return {
        "lap": str(strike.lap),
        "first touch, s": f"{strike.begin:.6f}",
        "crank angle, degrees": "-" if crank is None else f"{crank:.3f}",
        "approach speed, m/s": f"{strike.approach_speed:.4f}",
        "place on the face, mm": f"{1e3 * strike.place:.3f}",
        "until the last contact ends, ms": f"{1e3 * (strike.end - strike.begin):.3f}",
        "contacts": str(strike.contacts),
        "impulse, mN s": f"{1e3 * strike.impulse:.4f}",
        "energy lost in contact, mJ": f"{1e3 * strike.energy_lost:.5f}",
        f"least {word} after, {unit}": f"{values.min():.5f}",
        f"greatest {word} after, {unit}": f"{values.max():.5f}",
        "left of it before the next": rest,
    }


def _draw(result: Result, file: Path) -> None:
    figure = lever(result)
    if figure is None:
        raise ValueError("the run has one instant only: nothing to draw")
    figure.savefig(file, dpi=figure.dpi)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("run", type=Path, metavar="RUN", help="folder of a finished run")
    parser.add_argument("--contact", help="name of the contact; left out: the scene's first")
    parser.add_argument("--csv", type=Path, metavar="FILE", help="write the response as CSV")
    parser.add_argument("--png", type=Path, metavar="FILE", help="write the figure")
    return parser


if __name__ == "__main__":
    sys.exit(main())

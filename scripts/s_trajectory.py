"""Path of the watched point (the paper's S) of a saved run: table, CSV and figure (paper, Fig. 3).

Examples:
  .venv/bin/python scripts/s_trajectory.py runs/no_clearance
  .venv/bin/python scripts/s_trajectory.py runs/no_clearance --csv s.csv --png s.png
  .venv/bin/python scripts/s_trajectory.py runs/no_clearance --point lever.end

Exit codes: 0 done; 2 no such run or point, or a file can't be written.

"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from exudyn_flexlink.observables import crank_joint, laps, path, watched_point
from exudyn_flexlink.plots import coordinates
from exudyn_flexlink.result import Result
from exudyn_flexlink.storage import StorageError, load, trajectory_columns, write_csv


def main() -> int:
    """Read a run folder, print the table, write what is asked for; returns the exit code."""
    options = _parser().parse_args()
    try:
        result = load(options.run)
        point = options.point or watched_point(result.scene)
        table = _table(result, point)
        if options.csv:
            write_csv(options.csv, trajectory_columns(result, point))
        if options.png:
            _draw(result, point, options.png)
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


def _table(result: Result, point: str) -> Table:
    """Extremes of both coordinates in mm and of the speed in m/s, lap by lap."""
    seen = path(result, point)
    lap = laps(result) if crank_joint(result.scene) else np.ones(len(seen.time), dtype=int)
    speed = np.linalg.norm(seen.velocity, axis=1)
    table = Table(title=f"{point}: {result.scene.title}")
    columns = ("lap", "t from s", "to s", "x least mm", "greatest", "y least mm", "greatest")
    for name in (*columns, "fastest m/s"):
        table.add_column(name, justify="right")
    for number in range(1, int(lap.max()) + 1):
        here = lap == number
        if not here.any():
            continue
        x, y = 1e3 * seen.position[here].T
        numbers = (x.min(), x.max(), y.min(), y.max())
        time = seen.time[here]
        table.add_row(
            str(number),
            f"{time[0]:.4f}",
            f"{time[-1]:.4f}",
            *(f"{value:.3f}" for value in numbers),
            f"{speed[here].max():.4f}",
        )
    return table


def _draw(result: Result, point: str, file: Path) -> None:
    figure = coordinates(result, point)
    if figure is None:
        raise ValueError("the run has one instant only: nothing to draw")
    figure.savefig(file, dpi=figure.dpi)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("run", type=Path, metavar="RUN", help="folder of a finished run")
    parser.add_argument("--point", help="another point, such as lever.end")
    parser.add_argument("--csv", type=Path, metavar="FILE", help="write the path as CSV")
    parser.add_argument("--png", type=Path, metavar="FILE", help="write the figure")
    return parser


if __name__ == "__main__":
    sys.exit(main())

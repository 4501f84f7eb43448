"""Path of the watched point (the paper's S) of a saved run: table, CSV and figure (paper, Fig. 3).

Examples:
  .venv/bin/python scripts/s_trajectory.py runs/no_clearance
  .venv/bin/python scripts/s_trajectory.py runs/no_clearance --csv s.csv --png s.png
  .venv/bin/python scripts/s_trajectory.py runs/no_clearance --point lever.end

Exit codes: 0 done; 2 no such run or point, or a file can't be written.

"""

from __future__ import annotations

import sys

import numpy as np
from rich.table import Table
from saved.run import parser, told

import exudyn_flexlink as fl
from exudyn_flexlink.observables import crank_joint, laps, watched_point
from exudyn_flexlink.storage import trajectory_columns

COLUMNS = ("lap", "t from s", "to s", "x least mm", "greatest", "y least mm", "greatest")


def main() -> int:
    """Read the arguments, tell what they ask for; returns the exit code."""
    arguments = parser(__doc__)
    arguments.add_argument("--point", help="another point, such as lever.end")
    options = arguments.parse_args()

    def point(result: fl.Result) -> str:
        return options.point or watched_point(result.scene)

    return told(
        options,
        lambda result: _table(result, point(result)),
        lambda result: trajectory_columns(result, point(result)),
        lambda result: result.plot.coordinates(point(result)),
    )


def _table(result: fl.Result, point: str) -> Table:
    """Extremes of both coordinates in mm and of the speed in m/s, lap by lap."""
    seen = result.path(point)
    lap = laps(result) if crank_joint(result.scene) else np.ones(len(seen.time), dtype=int)
    table = Table(title=f"{point}: {result.scene.title}")
    for name in (*COLUMNS, "fastest m/s"):
        table.add_column(name, justify="right")
    for number in np.unique(lap):
        here = lap == number
        x, y = 1e3 * seen.position[here].T
        time, speed = seen.time[here], np.linalg.norm(seen.velocity[here], axis=1)
        table.add_row(
            str(number),
            *(f"{value:.4f}" for value in (time[0], time[-1])),
            *(f"{value:.3f}" for value in (x.min(), x.max(), y.min(), y.max())),
            f"{speed.max():.4f}",
        )
    return table


if __name__ == "__main__":
    sys.exit(main())

"""Strikes and response of the struck body of a saved run: table, CSV, figure (paper, Fig. 4).

Examples:
  .venv/bin/python scripts/lever_response.py runs/no_clearance
  .venv/bin/python scripts/lever_response.py runs/no_clearance --csv lever.csv --png lever.png
  .venv/bin/python scripts/lever_response.py runs/two_levers --contact left

Exit codes: 0 done; 2 no such run or contact, or a file can't be written.

"""

from __future__ import annotations

import sys

import numpy as np
from rich.table import Table
from saved.run import parser, told

import exudyn_flexlink as fl
from exudyn_flexlink.observables import LeverResponse, Strike, lever_response, settled
from exudyn_flexlink.storage import lever_columns


def main() -> int:
    """Read the arguments, tell what they ask for; returns the exit code."""
    arguments = parser(__doc__)
    arguments.add_argument("--contact", help="name of the contact; left out: the scene's first")
    options = arguments.parse_args()

    def contact(result: fl.Result) -> str:
        found = options.contact or next(iter(result.scene.contacts), None)
        if found is None:
            raise ValueError(f"the scene of {options.run} has no contact, so nothing is struck")
        return str(found)

    return told(
        options,
        lambda result: _table(result, contact(result)),
        lambda result: lever_columns(result, contact(result)),
        lambda result: result.plot.lever(),
    )


def _table(result: fl.Result, contact: str) -> Table:
    """One column for each strike."""
    response, found = lever_response(result, contact), result.strikes(contact)
    (least, least_at), (greatest, greatest_at) = response.least, response.greatest
    word, unit = response.measure.word, response.measure.unit
    table = Table(
        title=f"{response.body}, struck in '{contact}': {result.scene.title}",
        caption=f"{response.body}: least {word} {least:.5f} {unit} at {least_at:.4f} s, "
        f"greatest {greatest:.5f} {unit} at {greatest_at:.4f} s",
    )
    table.add_column("strike")
    columns = []
    for i, strike in enumerate(found):
        table.add_column(str(i + 1), justify="right")
        last = i + 1 == len(found)
        until = response.time[-1] if last else found[i + 1].begin
        left = "-" if last else f"{settled(result, contact, until):.2g}"
        columns.append(_cells(response, strike, until) | {"left of it before the next": left})
    for name in columns[0] if columns else ():
        table.add_row(name, *(column[name] for column in columns))
    return table


def _cells(response: LeverResponse, strike: Strike, until: float) -> dict[str, str]:
    """What is told of a strike, and of the response up to the next (s)."""
    word, unit = response.measure.word, response.measure.unit
    values = response.value_at(np.linspace(strike.begin, until, 20000))
    crank = strike.crank_angle
    return {
        "lap": str(strike.lap),
        "first touch, s": f"{strike.begin:.6f}",
        "crank angle, degrees": "-" if crank is None else f"{np.degrees(crank):.3f}",
        "approach speed, m/s": f"{strike.approach_speed:.4f}",
        "place on the face, mm": f"{1e3 * strike.place:.3f}",
        "until the last contact ends, ms": f"{1e3 * (strike.end - strike.begin):.3f}",
        "contacts": str(strike.contacts),
        "impulse, mN s": f"{1e3 * strike.impulse:.4f}",
        "energy lost in contact, mJ": f"{1e3 * strike.energy_lost:.5f}",
        f"least {word} after, {unit}": f"{values.min():.5f}",
        f"greatest {word} after, {unit}": f"{values.max():.5f}",
    }


if __name__ == "__main__":
    sys.exit(main())

"""What the program says of energy."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.report.tables import Table
from exudyn_flexlink.result import Result

_ENERGIES = {
    "kinetic": "kinetic",
    "stored": "stored in springs, weight and contacts",
    "dissipated": "dissipated since the start",
    "supplied": "supplied by drives since the start",
}


def energy_table(result: Result) -> Table:
    """Return energies where the run begins and ends, and the largest by size at any sample."""
    rows = []
    for name, told in _ENERGIES.items():
        values = getattr(result.energy, name)
        largest = values[int(np.argmax(np.abs(values)))]
        rows.append([told, *(f"{value:.4g}" for value in (values[0], values[-1], largest))])
    head, units = ["", "at the start", "at the end", "largest"], ["", "J", "J", "J"]
    return Table("Energies of all parts together", rows, head, units)

"""Reports on linear equations about a state, and on sensitivities of runs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from exudyn_flexlink.linear import LinearModel, Mode, motion_text
from exudyn_flexlink.report.text import (
    Table,
    in_blocks,
    left_out,
    lines_of,
    section,
)
from exudyn_flexlink.sensitivities import Sensitivity
from exudyn_flexlink.source import MOST_LISTED, listed


def linear_text(model: LinearModel) -> str:
    """Return the text of linear equations: modes, coordinates, contacts, errors."""
    about = "its rest" if model.time is None else f"t = {model.time:.6g} s"
    shown = list(enumerate(model.modes[:MOST_LISTED], start=1))
    modes = [[str(k), motion_text(mode.eigenvalue), _most_moved(mode)] for k, mode in shown]
    by_unit: dict[str, list[str]] = {}
    for name, unit in zip(model.coordinates, model.units, strict=True):
        by_unit.setdefault(unit, []).append(name)
    matrices = (
        ("stiffness", model.stiffness, model.stiffness_error),
        ("damping", model.damping, model.damping_error),
    )
    errors = [
        [name, f"{np.abs(error).max() / np.abs(matrix).max():.1g} of the largest"]
        for name, matrix, error in matrices
        if np.any(matrix)
    ]
    more = left_out(len(model.modes), len(modes))
    head = ["", "motion", "moves most"]
    blocks = [
        [f"Linear about {about}: '{model.scene.title}'"],
        lines_of(Table("Modes", modes, head, note=more)),
        section("Coordinates", [[unit, listed(names)] for unit, names in by_unit.items()]),
        section("Contacts that press", [["", name] for name in model.pressing]),
        section("Errors of differences", errors),
    ]
    return in_blocks(blocks)


def _most_moved(mode: Mode) -> str:
    """Name the point with the largest motion, and its motion."""
    if not mode.points:
        return ""
    name, moved = max(mode.points.items(), key=lambda point: float(np.linalg.norm(point[1])))
    return f"{name} ({abs(moved[0]):.3g}, {abs(moved[1]):.3g})"


def sensitivity_text(rows: Sequence[Sensitivity]) -> str:
    """Return a table for each quantity: its changes for 1 % of each parameter."""
    tables = []
    for quantity in dict.fromkeys(row.quantity for row in rows):
        changes = [row for row in rows if row.quantity == quantity]
        changes.sort(key=lambda row: -float(f"{abs(row.relative):.3g}"))  # equal ones keep order
        cells = [
            [
                row.parameter,
                f"{row.derivative:.5g}",
                f"+- {row.error:.2g}",
                row.unit,
                f"{row.relative:.3g} %",
            ]
            for row in changes
        ]
        head = ["", "derivative", "", "", "for 1 %"]
        tables.append(lines_of(Table(f"{quantity}, {changes[0].value:.6g}", cells, head)))
    return in_blocks(tables)

"""Figures of a run; each figure is a function of a Result. They omit what the scene lacks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from exudyn_flexlink.plots.drawing import mechanism, modes, response, start
from exudyn_flexlink.plots.forces import bending, energy, forces, guide_contact
from exudyn_flexlink.plots.frame import (
    ENGINE_COLOURS,
    PRINT,
    SCREEN,
    STYLES,
    Style,
    figure_bytes,
    is_figure,
    save_figure,
)
from exudyn_flexlink.plots.motion import coordinates, lever, polar
from exudyn_flexlink.plots.panels import Given, labelled_run, listed
from exudyn_flexlink.plots.studies import (
    against,
    bifurcation,
    comparison,
    differences,
    fit,
    stability,
    sweep,
    work_precision,
)
from exudyn_flexlink.result import Result
from exudyn_flexlink.shipped import FIGURE_FORMATS

FIGURES = {
    "coordinates": coordinates,
    "polar": polar,
    "lever": lever,
    "mechanism": mechanism,
    "guide_contact": guide_contact,
    "energy": energy,
    "forces": forces,
    "bending": bending,
}
"""Functions that draw the figures of a run, by name; they return None if nothing is to be shown."""


def figures(result: Result, style: Style = SCREEN) -> dict[str, Figure]:
    """Draw all figures that have something to show for this result; return them by name."""
    drawn = {name: draw(result, style=style) for name, draw in FIGURES.items()}
    return {name: figure for name, figure in drawn.items() if figure is not None}


def save_figures(
    result: Result, folder: Path, formats: Sequence[str] = FIGURE_FORMATS[:1], style: Style = SCREEN
) -> list[Path]:
    """Write the figures as ``<name>.<format>`` into an existing folder; returns the files.

    Raises:
        OSError: a file can't be written.

    """
    drawn = figures(result, style).items()
    return [file for name, figure in drawn for file in save_figure(figure, folder, name, formats)]

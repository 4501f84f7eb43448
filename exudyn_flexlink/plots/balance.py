"""Energies, and the error of their balance."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exudyn_flexlink.plots.frame import new_figure
from exudyn_flexlink.plots.panels import (
    engine_colour,
    legend_outside,
    letter,
    line_widths,
    shade_beyond,
)
from exudyn_flexlink.plots.style import (
    BLACK,
    BLUE,
    GREEN,
    RED,
    SCREEN,
    Style,
    styled,
)
from exudyn_flexlink.result import Result

_ENERGIES = (
    ("kinetic", BLUE, "-"),
    ("stored", GREEN, "-"),
    ("dissipated", RED, "--"),
    ("supplied", BLACK, ":"),
)


@styled
def energy(result: Result, *, style: Style = SCREEN) -> Figure | None:
    """Energies over time and, on a logarithmic axis, what their balance misses.

    None if there is nothing but one sample.
    """
    if len(result.time) < 2:
        return None
    figure = new_figure(result, "Energy, and the error of its balance", 5.2, style)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    series = [getattr(result.energy, name) for name, *_ in _ENERGIES]
    largest = max(float(np.max(np.abs(values))) for values in series)
    factor, unit = (1e3, "mJ") if largest < 1 else (1.0, "J")
    thin = float(mpl.rcParams["lines.linewidth"])
    widths = line_widths(series, thin)
    for (name, colour, line), values, width in zip(_ENERGIES, series, widths, strict=True):
        look = {"linestyle": line} if width == thin else {"alpha": 0.5}
        upper.plot(result.time, factor * values, color=colour, linewidth=width, label=name, **look)
    upper.set_ylabel(f"energy ({unit})")
    _residual(lower, result, factor, unit)
    lower.set_xlabel("time (s)")
    lower.set_xlim(result.time[0], result.time[-1])
    for axes in (upper, lower):
        shade_beyond(axes, result, result.time, named=axes is upper)
        legend_outside(axes)
    letter([upper, lower])
    return figure


def _residual(axes: Axes, result: Result, factor: float, unit: str) -> None:
    missed = np.abs(result.energy.residual)
    shown = factor * np.where(missed > 0, missed, np.nan)
    axes.set_ylabel(f"error ({unit})")
    axes.set_yscale("log")
    if np.all(np.isnan(shown)):
        axes.text(0.5, 0.5, "zero throughout", ha="center", transform=axes.transAxes)
        return
    axes.plot(result.time, shown, color=engine_colour(result), linewidth=0.9, label="|error|")
    kinetic = factor * result.checks.largest_kinetic_energy
    if kinetic > 0:
        axes.axhline(kinetic, color=BLACK, linestyle=":", label="largest kinetic\nenergy")
    worst = float(np.nanmax(shown))
    axes.set_ylim(bottom=worst * 1e-6)  # zero crossings would stretch the axis without end

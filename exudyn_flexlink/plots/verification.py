"""How far benchmarks are from published numbers, on a scale of powers of ten."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

from matplotlib.figure import Figure

from exudyn_flexlink.plots.frame import framed_figure
from exudyn_flexlink.plots.panels import legend_outside, sized
from exudyn_flexlink.plots.style import BLACK, BLUE, FAILED, GREY, SCREEN, Style, styled
from exudyn_flexlink.verification import VerifiedRun

ROW = 0.24  # inches on a screen, of a number
LEAST = 1e-17  # a smaller difference, in any unit, is none: it is drawn here


@styled
def differences(runs: Sequence[VerifiedRun], *, style: Style = SCREEN) -> Figure:
    """Every number of some runs in a row of its own: its difference, and what is allowed."""
    numbers = [(one, number) for one in runs for number in one.numbers]
    title = "Benchmarks against published numbers"
    subject = "Difference of each number, in its SI unit; a bar ends at what is allowed"
    notes = [f"{one.benchmark}, {one.run}: {one.stopped}" for one in runs if one.stopped]
    figure = framed_figure((title, subject), 0.9 + ROW * len(numbers), style, notes=notes)
    axes = figure.subplots()
    axes.set_xscale("log")
    for row, (_, number) in enumerate(numbers):
        colour = BLUE if number.fine else FAILED
        axes.plot([LEAST, number.allowed], [row, row], color=GREY, linewidth=0.7)
        axes.plot([number.allowed], [row], "|", color=BLACK, markersize=sized(8))
        if isfinite(number.computed):
            axes.plot([max(number.difference, LEAST)], [row], "o", color=colour)
    for fine, colour, label in ((True, BLUE, "as near as allowed"), (False, FAILED, "off")):
        if any(number.fine == fine for _, number in numbers):
            axes.plot([], [], "o", color=colour, label=label)
    axes.plot([], [], "|", color=BLACK, markersize=sized(8), label="allowed")
    axes.set_yticks(
        range(len(numbers)),
        [f"{one.benchmark}, {one.run}: {n.name} ({n.unit})" for one, n in numbers],
    )
    axes.set_ylim(len(numbers) - 0.5, -0.5)
    axes.set_xlabel("difference")
    legend_outside(axes)
    return figure

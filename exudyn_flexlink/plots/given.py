"""Axes that are given: how many a figure needs, and two runs told apart in one of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from math import ceil
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from exudyn_flexlink.arguments import told as in_words
from exudyn_flexlink.plots.frame import ShownFigure, doubts_of
from exudyn_flexlink.plots.style import FAILED
from exudyn_flexlink.result import Result

Given = Axes | Sequence[Axes] | NDArray[np.object_] | None
"""Axes that a figure is drawn into, of its first panel or of all; None: it makes its own."""
DASHES: tuple[Literal["-", "--", "-.", ":"], ...] = ("-", "--", "-.", ":")


def listed(ax: Given) -> list[Axes]:
    """Return given axes as a list.

    Raises:
        TypeError: something is no axes of matplotlib.

    """
    many = isinstance(ax, Sequence | np.ndarray)
    every: list[Any] = list(np.ravel(np.array(ax, dtype=object))) if many else [ax]
    for one in every:
        if not isinstance(one, Axes):
            raise TypeError(
                f"expected axes of matplotlib, or an array of them; got {in_words(one)}"
            )
    return every


def required(ax: Given, panels: Sequence[str]) -> list[Axes]:
    """Return the axes of panels that are named, given for the first of them or for all.

    Raises:
        ValueError: there are more or less.

    """
    every = listed(ax)
    if len(every) not in (1, len(panels)):
        names = ", ".join(name.replace("\n", " ") for name in panels)
        told = f"one for the first, or {len(panels)} for all: {names}"
        raise ValueError(f"ax: {len(every)} axes are given; needed are {told}")
    return every


def placed(
    ax: Given,
    panels: Sequence[str],
    new: Callable[[], Figure],
    columns: int = 1,
    **subplots: Any,
) -> tuple[Figure, list[Axes]]:
    """Return a new figure with axes for panels that are named, row by row, or those given for them.

    The last row of a new figure may have more axes than there are panels.
    """
    if ax is not None:
        every = required(ax, panels)
        return every[0].figure.figure, every
    figure = new()
    grid = figure.subplots(ceil(len(panels) / columns), columns, squeeze=False, **subplots)
    return figure, list(grid.flat)


def is_given(axes: Axes) -> bool:
    """Whether axes are the user's, in a figure that this program did not make."""
    return not isinstance(axes.figure.figure, ShownFigure)


@contextmanager
def told_apart(result: Result, every: Sequence[Axes], label: str | None) -> Iterator[None]:
    """Name what is drawn within by `label`; dash it where a run is in the axes already.

    Then these show both runs whole; they tell if this run stopped or is doubtful.
    """
    before = [(len(axes.lines), axes.get_xlim(), axes.get_ylim()) for axes in every]
    yield
    for axes, (count, x, y) in zip(every, before, strict=True):
        new = axes.lines[count:]
        # Lines of two points are marks and zeros, which belong to no run.
        curves = [line for line in new if len(np.ravel(line.get_xdata())) > 2]
        if count:
            used = {line.get_linestyle() for line in axes.lines[:count]}
            dashes = next((own for own in DASHES if own not in used), DASHES[0])
            for line in curves:
                if line.get_linestyle() in DASHES:
                    line.set_linestyle(dashes)
            axes.set_xlim(min(*x, *axes.get_xlim()), max(*x, *axes.get_xlim()))
            if not axes.get_autoscaley_on():
                axes.set_ylim(min(*y, *axes.get_ylim()), max(*y, *axes.get_ylim()))
        if label is not None:
            _name(new, curves, label)
        if doubts := doubts_of(result):
            told = ": ".join(filter(None, (label, doubts)))
            at = axes.transAxes
            axes.text(0.01, 0.02, told, color=FAILED, fontsize="small", transform=at)
        handles = dict(zip(*axes.get_legend_handles_labels()[::-1], strict=True))
        if handles:
            axes.legend(handles.values(), handles.keys())


def _name(new: Sequence[Line2D], curves: Sequence[Line2D], label: str) -> None:
    """Name new lines of a run in the legend by its label, at least the first of its curves."""
    named = [line for line in new if not str(line.get_label()).startswith("_")]
    for line in named:
        line.set_label(f"{label}: {line.get_label()}")
    if curves and not any(line in named for line in curves):
        curves[0].set_label(label)

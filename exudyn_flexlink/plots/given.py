"""Axes that are given: how many a figure needs, and two runs told apart in one of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import chain
from math import ceil
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from exudyn_flexlink.arguments import told
from exudyn_flexlink.plots.frame import ShownFigure
from exudyn_flexlink.plots.style import FAILED
from exudyn_flexlink.result import Result

Given = Axes | Sequence[Axes] | NDArray[np.object_]
"""Axes that a figure is drawn into: those of its first panel, or of all its panels."""
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
            raise TypeError(f"expected axes of matplotlib, or an array of them; got {told(one)}")
    return every


def required(ax: Given, panels: Sequence[str]) -> list[Axes]:
    """Return the axes of panels that are named, given for the first of them or for all.

    Raises:
        ValueError: there are more or less.

    """
    every = listed(ax)
    if len(every) not in (1, len(panels)):
        told = f"one for the first, or {len(panels)} for all" if len(panels) > 1 else "one"
        names = ", ".join(name.replace("\n", " ") for name in panels)
        raise ValueError(f"ax: {len(every)} axes are given; needed are {told}: {names}")
    return every


def placed(
    ax: Given | None,
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

    Then these show both runs whole; they tell if this run stopped.
    """
    before = [(len(axes.lines), axes.get_xlim(), axes.get_ylim()) for axes in every]
    yield
    for axes, (count, *limits) in zip(every, before, strict=True):
        # Lines of two points are marks and zeros, which belong to no run.
        curves = [line for line in axes.lines[count:] if len(np.ravel(line.get_xdata())) > 2]
        used = {line.get_linestyle() for line in axes.lines[:count]}
        dashes = next((own for own in DASHES if own not in used), DASHES[0])
        named = [line for line in axes.lines[count:] if not str(line.get_label()).startswith("_")]
        for line in curves if count else ():
            if line.get_linestyle() in DASHES:
                line.set_linestyle(dashes)
        if label is not None:
            for line in named:
                line.set_label(f"{label}: {line.get_label()}")
            if curves and not any(line in named for line in curves):
                curves[0].set_label(label)
        if count:
            _show_both(axes, *limits)
        if not result.outcome.completed:
            told = ": ".join(filter(None, (label, result.outcome.told)))
            axes.annotate(
                told, (0.01, 0.02), xycoords="axes fraction", color=FAILED, fontsize="small"
            )
        handles = dict(zip(*axes.get_legend_handles_labels()[::-1], strict=True))
        if handles:
            axes.legend(handles.values(), handles.keys())


def _show_both(axes: Axes, x: tuple[float, float], y: tuple[float, float]) -> None:
    ends = sorted(chain(x, axes.get_xlim()))
    axes.set_xlim(ends[0], ends[-1])
    if not axes.get_autoscaley_on():
        ends = sorted(chain(y, axes.get_ylim()))
        axes.set_ylim(ends[0], ends[-1])

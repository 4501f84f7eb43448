"""Parts that panels share: letters, legends, units, digits, the axis along a run, its horizon.

Further functions check axes of the user, and label two runs in one panel.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import cycle
from math import ceil, floor, isfinite, log10
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike, NDArray

from exudyn_flexlink.arguments import excerpt as in_words
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables import crank_angle, path, turns, watched_point
from exudyn_flexlink.plots.frame import (
    BLACK,
    ENGINE_COLOURS,
    FAILED,
    GREEN,
    NARROW,
    SCREEN,
    ShownFigure,
    doubts_of,
    text_width,
)
from exudyn_flexlink.result import Result

BEYOND: dict[str, Any] = {"color": "#C9B8D8", "alpha": 0.45, "linewidth": 0}
"""Look of the shading beyond the horizon in every figure."""
BEYOND_LINE: dict[str, Any] = {
    "color": BEYOND["color"],
    "alpha": BEYOND["alpha"],
    "solid_capstyle": "butt",
    "zorder": 1,
}
"""Look of this shading along a line."""
BAND = 9.0  # points: width of this shading

# Look of the line at the instant from which the error of positions may exceed the tolerance:
DOUBT_LINE: dict[str, Any] = {"color": "#8A63B0", "linewidth": 0.8, "zorder": 1}

# Look of the line at the instant at which a stage of the run begins:
STAGE_LINE: dict[str, Any] = {"color": "#555555", "linewidth": 0.8, "linestyle": ":", "zorder": 1}

COINCIDE = 0.01  # of the range of all lines: lines nearer than this hide each other
OFTEN = 0.3  # of the samples: a line hidden at more of them may be missed
BROADER = 2.2  # points: a line is broader by this for each later line that lies on it
DEEPEST = 1e-6  # of the largest value: lower end of a logarithmic axis
BACK = 1e-6  # rad: a crank that goes back by less between samples still goes forward
MOST = 4  # most significant digits: readers need no more from a figure
FINEST = 1e-4  # s, times the run if that is shorter than 1 s: finest digit of an instant
UNTOLD = 3  # significant digits if the error is unknown


def engine_colour(result: Result) -> str:
    """Return the colour of the result's engine; black for an engine without a colour."""
    return ENGINE_COLOURS.get(result.engine, BLACK)


def colours_of_both(first: Result, second: Result) -> tuple[str, str]:
    """Return the colours of two runs: those of their engines, or two others for one engine."""
    first_colour, second_colour = engine_colour(first), engine_colour(second)
    return (first_colour, second_colour) if first_colour != second_colour else (GREEN, BLACK)


def title_at(result: Result, index: int, digits: int = 0) -> str:
    """Return the instant of a sample and the crank's angle at that instant, for a title."""
    words = f"t = {time_text(result, float(result.time[index]))} s"
    if turns(result):
        words += f", crank {np.degrees(crank_angle(result)[index]):.{digits}f}°"
    return words.replace("-", "\N{MINUS SIGN}")


def letter(panels: Iterable[Axes]) -> None:
    """Write (a), (b), .. before the titles of panels, if there are several panels."""
    panels = [axes for axes in panels if not is_given(axes)]
    for i, axes in enumerate(panels if len(panels) > 1 else ()):
        name = chr(ord("a") + i) if i < 26 else str(i + 1)
        axes.set_title(f"({name}) {axes.get_title(loc='left')}".rstrip(), loc="left")


def legend_outside(axes: Axes, left: float = 1.01, *, below: bool = False, **more: Any) -> None:
    """Put the legend, if it has entries, outside the axes; in axes of a user, inside.

    It is at the right, at `left` times the width of the axes. In a narrow figure it is above the
    axes, or `below` the figure. `more` goes to ``Axes.legend``, for instance `handles`.
    """
    handles = more.setdefault("handles", axes.get_legend_handles_labels()[0])
    labels = [str(handle.get_label()) for handle in handles]
    if not labels:
        return
    if is_given(axes):
        axes.legend(**more)
        return
    figure: Any = axes.figure
    narrow = figure.get_figwidth() < NARROW
    if narrow and below:
        ncols = columns_of(labels, figure, part=0.95)
        figure.legend(**more, loc="outside lower center", ncols=ncols)
        return
    if not narrow:
        place: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (left, 1.0)}
    else:
        place = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "columnspacing": 1.0,
                 "handlelength": 1.6, "ncols": columns_of(labels, figure)}  # fmt: skip
        more.pop("title", None)
    legend = axes.legend(**place, borderaxespad=0.2, **more)
    legend.set_zorder(10)


def columns_of(labels: Sequence[str], figure: Any, part: float = 0.85) -> int:
    """Return the number of columns of a legend that fits into a `part` of the figure's width."""
    rc, font = mpl.rcParams, FontProperties(size=mpl.rcParams["legend.fontsize"])
    beside = rc["legend.handlelength"] + rc["legend.handletextpad"] + rc["legend.columnspacing"]
    sample = beside * font.get_size_in_points()
    widths = [max(text_width(line, font) for line in name.split("\n")) for name in labels]
    for count in range(len(labels), 1, -1):
        columns = np.array_split(np.array(widths) + sample, count)
        if sum(map(np.max, columns)) <= 72 * part * figure.get_figwidth():
            return count
    return 1


def sized(points: float) -> float:
    """Return a size or line width in the present style; `points` is its value on a screen."""
    return points * float(mpl.rcParams["lines.linewidth"]) / SCREEN.line


def forward(result: Result) -> bool:
    """Whether the crank goes round and never back, so that each angle occurs once."""
    if not turns(result):
        return False
    made = np.diff(crank_angle(result))
    return bool(np.all(made >= -BACK) or np.all(made <= BACK))


def along(result: Result) -> tuple[FloatArray, str]:
    """Return the axis (N,) of a whole run and its label: turns of the crank, or time.

    It is time if the crank goes back: over turns, a line would cover itself.
    """
    if forward(result):
        angle = crank_angle(result)
        return np.asarray(angle / (2 * np.pi)), "crank angle (turns)"
    return result.time, "time (s)"


def limits(axes: Axes, x: FloatArray) -> None:
    """Set the x-axis to a whole run, from left to right even if `x` falls."""
    if np.ptp(x) > 0:
        axes.set_xlim(float(np.min(x)), float(np.max(x)))
    if x[-1] < x[0]:
        axes.invert_xaxis()  # the crank turns clockwise


def horizon(result: Result) -> tuple[float, str] | None:
    """Return the instant (s) from which positions are unknown, and the reason.

    None if they are known to the end, or if no error was measured.
    """
    error = result.error
    if error.horizon is not None:
        return error.horizon, "beyond the horizon:\ntwo runs part"
    if error.stopped is not None:
        return error.stopped, "error not known:\nits run ended here"
    return None


def is_beyond(result: Result, time: float) -> bool:
    """Whether an instant (s) lies beyond the horizon."""
    beyond = horizon(result)
    return beyond is not None and time >= beyond[0]


def mark_doubt(
    axes: Axes, result: Result, time: FloatArray, x: FloatArray, *, named: bool = True
) -> None:
    """Draw a line where positions become doubtful; `x` (N,) are the abscissas of `time` (N,)."""
    begin, label = result.error.exceeds_from, "may be off by\nmore than asked" if named else None
    if begin is not None:
        axes.axvline(float(np.interp(begin, time, x)), label=label, **DOUBT_LINE)


def shade_beyond(axes: Axes, result: Result, x: FloatArray, *, named: bool = True) -> None:
    """Shade the time beyond the horizon; mark where doubts and stages begin.

    `x` (N,) are the abscissas of the samples.
    """
    mark_doubt(axes, result, result.time, x, named=named)
    for time, name in result.stages:
        begin = float(np.interp(time, result.time, x))
        axes.axvline(begin, label=f"{name} begins" if named else None, **STAGE_LINE)
    beyond = horizon(result)
    if beyond is None or beyond[0] >= result.time[-1]:
        return
    begin = float(np.interp(beyond[0], result.time, x))
    axes.axvspan(begin, float(x[-1]), label=beyond[1] if named else None, zorder=0, **BEYOND)


def over_run(panels: Sequence[Axes], result: Result, x: FloatArray, label: str) -> None:
    """Finish panels, one below the other, over a whole run with samples at `x` (N,)."""
    for axes in panels:
        shade_beyond(axes, result, x, named=axes is panels[0])
        legend_outside(axes)
        axes.tick_params(labelbottom=axes is panels[-1])
        limits(axes, x)
    panels[-1].set_xlabel(label)


def line_widths(series: Sequence[FloatArray], thin: float) -> list[float]:
    """Return the widths (points) of lines, in order: a line under later lines is broader.

    The `series` (N,) have one unit; `thin` is the width of a line under no other line.
    """
    room = max(float(np.ptp(values)) for values in series) or 1.0
    step = BROADER * sized(1.0)
    return [
        thin + step * sum(_coincide(values, later, room) for later in series[i + 1 :])
        for i, values in enumerate(series)
    ]


def _coincide(values: FloatArray, later: FloatArray, room: float) -> bool:
    """Whether two lines coincide at many samples; samples where both are zero do not count."""
    near = COINCIDE * room
    away = (np.abs(values) > near) | (np.abs(later) > near)
    same = np.abs(values - later) < near
    return bool(np.mean(same[away]) > OFTEN) if away.any() else True


def logarithmic(
    axes: Axes, x: FloatArray, series: Mapping[str, FloatArray], colours: Sequence[str], none: str
) -> None:
    """Draw absolute values (N,), by name for the legend, on a logarithmic axis.

    The axis ends at `DEEPEST` of the largest value; otherwise zero crossings would extend it
    without limit. If all values are 0, the text `none` stands there.
    """
    axes.set_yscale("log")
    largest = max(float(np.nanmax(np.abs(values), initial=0.0)) for values in series.values())
    if largest == 0:
        axes.text(0.5, 0.5, none, ha="center", transform=axes.transAxes)
        return
    for (name, numbers), colour in zip(series.items(), cycle(colours), strict=False):
        shown = np.where(numbers != 0, np.abs(numbers), np.nan)
        axes.plot(x, shown, color=colour, linewidth=0.8, label=name or None)
    axes.set_ylim(largest * DEEPEST, 3 * largest)


def length_unit(lengths: ArrayLike) -> tuple[float, str]:
    """Return the factor from m to the unit that suits lengths (m), and the unit's name."""
    return (1e3, "mm") if np.max(np.abs(lengths)) < 1 else (1.0, "m")


def shown_in(unit: str, values: ArrayLike) -> tuple[float, str]:
    """Return the factor from an SI unit to the unit of figures, and the unit's name."""
    return length_unit(values) if unit == "m" else (1.0, unit)


def number_text(
    value: float, error: float | None, *, signed: bool = False, most: int = MOST
) -> str:
    """Return a number whose last digit is not smaller than `error`, in the same unit.

    It has at most `most` significant digits; three if the error is unknown (None).
    """
    if value == 0:
        return "0"
    known = UNTOLD if error is None else most
    size = abs(value)
    place = known - 1 - floor(log10(size)) if size > 0 and isfinite(size) else known
    if error is not None and error > 0:
        place = min(place, floor(-log10(error)))
    place = max(place, 0)
    text = f"{round(value, place):{'+' if signed else ''}.{place}f}"
    if float(text) == 0:
        text = text.lstrip("+-")
    return text.replace("-", "\N{MINUS SIGN}")


def position_error(result: Result, time: float) -> float | None:
    """Return the error of positions at an instant, m; None if unknown.

    It is the largest error up to that instant by a second run; without that run, the tolerance.
    """
    error = result.error
    if error.missing:
        return result.scene.accuracy.tolerance
    if error.exceeds_from is not None and time < error.exceeds_from:
        return error.limit
    return error.largest if time < error.known_until else None


def time_text(result: Result, time: float) -> str:
    """Return an instant (s) as text; its last digit is about the error of an instant.

    That error is the error of positions over the largest speed. The finest digit is 0.1 ms, or
    finer in a run shorter than 1 s.
    """
    error = position_error(result, time)
    velocity = path(result, watched_point(result.scene)).velocity
    fastest = float(np.max(np.linalg.norm(velocity, axis=1)))
    if error is None or fastest == 0:
        return number_text(time, None)
    return number_text(
        time, max(error / fastest, FINEST * min(1.0, float(result.time[-1]))), most=9
    )


Given = Axes | Sequence[Axes] | NDArray[np.object_] | None
"""Axes for a figure: those of its first panel, or of all panels; None: the figure makes them."""
DASHES: tuple[Literal["-", "--", "-.", ":"], ...] = ("-", "--", "-.", ":")


def listed(ax: Given) -> list[Axes]:
    """Return given axes as a list.

    Raises:
        TypeError: an item is not an axes of matplotlib.

    """
    many = isinstance(ax, Sequence | np.ndarray)
    all_axes: list[Any] = list(np.ravel(np.array(ax, dtype=object))) if many else [ax]
    for name in all_axes:
        if not isinstance(name, Axes):
            raise TypeError(
                f"expected axes of matplotlib, or an array of them; got {in_words(name)}"
            )
    return all_axes


def required(ax: Given, panels: Sequence[str]) -> list[Axes]:
    """Return the user's axes for the named panels: for the first panel, or for all panels.

    Raises:
        ValueError: the number of axes suits neither.

    """
    all_axes = listed(ax)
    if len(all_axes) not in (1, len(panels)):
        names = ", ".join(name.replace("\n", " ") for name in panels)
        about = f"one for the first, or {len(panels)} for all: {names}"
        raise ValueError(f"ax: {len(all_axes)} axes are given; needed are {about}")
    return all_axes


def placed(
    ax: Given,
    panels: Sequence[str],
    new: Callable[[], Figure],
    columns: int = 1,
    **subplots: Any,
) -> tuple[Figure, list[Axes]]:
    """Return a figure and the axes of the named panels: the user's, or new ones, row by row.

    The last row of a new figure may have more axes than panels.
    """
    if ax is not None:
        all_axes = required(ax, panels)
        return all_axes[0].figure.figure, all_axes
    figure = new()
    grid = figure.subplots(ceil(len(panels) / columns), columns, squeeze=False, **subplots)
    return figure, list(grid.flat)


def is_given(axes: Axes) -> bool:
    """Whether axes are the user's, in a figure that this program did not make."""
    return not isinstance(axes.figure.figure, ShownFigure)


@contextmanager
def labelled_run(result: Result, all_axes: Sequence[Axes], label: str | None) -> Iterator[None]:
    """Label the lines that are drawn inside the context; dash them if the axes have a run already.

    In that case the axes show both runs whole. A text says if this run stopped or is doubtful.
    """
    before = [(len(axes.lines), axes.get_xlim(), axes.get_ylim()) for axes in all_axes]
    yield
    for axes, (count, x, y) in zip(all_axes, before, strict=True):
        new = axes.lines[count:]
        # Lines of at most two points are marks and zero lines, which belong to no run.
        curves = [line for line in new if len(np.ravel(line.get_xdata())) > 2]
        if count:
            used = {line.get_linestyle() for line in axes.lines[:count]}
            dashes = next((dash for dash in DASHES if dash not in used), DASHES[0])
            for line in curves:
                if line.get_linestyle() in DASHES:
                    line.set_linestyle(dashes)
            axes.set_xlim(min(*x, *axes.get_xlim()), max(*x, *axes.get_xlim()))
            if not axes.get_autoscaley_on():
                axes.set_ylim(min(*y, *axes.get_ylim()), max(*y, *axes.get_ylim()))
        if label is not None:
            _name(new, curves, label)
        if doubts := doubts_of(result):
            text = ": ".join(filter(None, (label, doubts)))
            in_axes = axes.transAxes
            axes.text(0.01, 0.02, text, color=FAILED, fontsize="small", transform=in_axes)
        handles = dict(zip(*axes.get_legend_handles_labels()[::-1], strict=True))
        if handles:
            axes.legend(handles.values(), handles.keys())


def _name(new: Sequence[Line2D], curves: Sequence[Line2D], label: str) -> None:
    """Give the new lines of a run its label in the legend, at least the first of its curves."""
    named = [line for line in new if not str(line.get_label()).startswith("_")]
    for line in named:
        line.set_label(f"{label}: {line.get_label()}")
    if curves and not any(line in named for line in curves):
        curves[0].set_label(label)

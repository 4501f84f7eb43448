"""Two runs of one scene over each other, and their differences below."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.comparison import Comparison
from exudyn_flexlink.observables import Measure, name_of
from exudyn_flexlink.plots.frame import doubts_of, error_of, framed_figure, links_of
from exudyn_flexlink.plots.panels import (
    BEYOND,
    along,
    colours_of_both,
    legend_outside,
    length_unit,
    letter,
    limits,
    logarithmic,
    mark_doubt,
    shown_in,
)
from exudyn_flexlink.plots.style import BLACK, GREY, ORANGE, OTHERS, SCREEN, Style, styled


@styled
def comparison(compared: Comparison, *, style: Style = SCREEN) -> Figure | None:
    """Watched point and struck bodies of both runs; below, their differences on log axes.

    Strikes are marked, and the horizon from which on instants can't be compared. None if there is
    nothing but one instant.
    """
    if len(compared.time) < 2:
        return None
    runs = compared.both
    subject = f"{compared.point}: {runs[0].name} and {runs[1].name}, and their difference"
    notes = [f"{seen.name}: {told}" for seen in runs if (told := doubts_of(seen.result))]
    title = runs[1].result.scene.title
    count = 3 + len(_kinds(compared)) + len(compared.levers)
    height, caption = 0.3 + 1.6 * count, _caption(compared)
    figure = framed_figure((title, subject), height, style, notes=notes, caption=caption)
    rows = figure.subplots(count, 1, sharex=True)
    turns, label = along(runs[0].result)
    x = np.interp(compared.time, runs[0].result.time, turns)
    _motions(rows, compared, x)
    _differences(rows[2 + len(compared.levers) :], compared, x)
    for axes in rows:
        _marks(axes, compared, x, named=axes is rows[0])
    for axes in (rows[0], rows[-1]):
        legend_outside(axes)
    rows[-1].set_xlabel(label)
    limits(rows[-1], x)
    letter(rows)
    return figure


def _caption(compared: Comparison) -> list[tuple[str, str]]:
    """Lines with their colours: the links, then the settings of both runs."""
    runs = compared.both
    links = ["; ".join(links_of(seen.result.scene)) for seen in runs]
    alike = links[0] == links[1]
    told = [(links[0], GREY)] if alike else []
    for seen, own, style in zip(runs, links, _styles(compared), strict=True):
        engine = seen.result.engine
        words = ["" if engine in seen.name else engine, "" if alike else own, seen.accuracy,
                 error_of(seen.result.error)]  # fmt: skip
        told.append((f"{seen.name}: {'; '.join(word for word in words if word)}", style["color"]))
    return told


def _styles(compared: Comparison) -> tuple[dict[str, Any], dict[str, Any]]:
    """The first run is a broad pale band, on which the second is a thin line."""
    one, other = colours_of_both(compared.first.result, compared.second.result)
    line = float(mpl.rcParams["lines.linewidth"])
    return (
        {"color": one, "linewidth": 2.6 * line, "alpha": 0.45},
        {"color": other, "linewidth": 0.8 * line},
    )


def _motions(rows: NDArray[Any], compared: Comparison, x: FloatArray) -> None:
    """Draw both coordinates and the motions of struck bodies, of both runs."""
    factor, unit = length_unit(compared.first.position)
    answers = compared.first.answers
    scales = {body: shown_in(compared.measures[body].unit, answers[body]) for body in answers}
    for seen, style in zip(compared.both, _styles(compared), strict=True):
        motions = (scales[body][0] * values for body, values in seen.answers.items())
        shown = [*(factor * seen.position.T), *motions]
        for axes, values in zip(rows, shown, strict=False):
            axes.plot(x, values, label=seen.name, **style)
    for axes, coordinate in zip(rows, "xy", strict=False):
        axes.set_ylabel(f"${coordinate}$ of {compared.point}\n({unit})")
    for axes, body in zip(rows[2:], compared.levers, strict=False):
        axes.set_ylabel(f"{compared.measures[body].word} of\n{body} ({scales[body][1]})")


def _differences(rows: NDArray[Any], compared: Comparison, x: FloatArray) -> None:
    """Draw the distance of the points and, below, how far answers of struck bodies are apart."""
    factor, unit = length_unit(compared.first.position)
    away = {"": factor * compared.deviation.distance}
    logarithmic(rows[0], x, away, OTHERS[::-1], "no difference")
    rows[0].set_ylabel(f"difference of\n{name_of(compared.judged_by)}\n({unit})")
    for axes, measure in zip(rows[1:], _kinds(compared), strict=True):
        apart = {
            body: values
            for body, values in compared.answer_differences.items()
            if compared.measures[body] is measure
        }
        factor, unit = shown_in(measure.unit, [compared.first.answers[body] for body in apart])
        shown = {body * (len(apart) > 1): factor * values for body, values in apart.items()}
        logarithmic(axes, x, shown, OTHERS[::-1], "no difference")
        axes.set_ylabel(f"difference of\n{measure.word}s\n({unit})")


def _kinds(compared: Comparison) -> list[Measure]:
    """Quantities by which motions of struck bodies are told, each once."""
    return list(dict.fromkeys(compared.measures.values()))


def _marks(axes: Axes, compared: Comparison, x: FloatArray, *, named: bool) -> None:
    """Mark the first touch of every strike, and the horizon; `named` once, for the legend."""
    begins = [
        strike.begin
        for seen in compared.both
        for found in seen.strikes.values()
        for strike in found
        if strike.begin <= compared.time[-1]
    ]
    if begins:
        places, height = np.interp(begins, compared.time, x), axes.get_xaxis_transform()
        look: dict[str, Any] = {"color": ORANGE, "linewidth": 1.0, "zorder": 1}
        axes.vlines(places, 0, 1, label="strike" * named, transform=height, **look)
    for i, seen in enumerate(compared.both):
        mark_doubt(axes, seen.result, compared.time, x, named=named and i == 0)
    if compared.horizon is None:
        return
    place = float(np.interp(compared.horizon, compared.time, x))
    label = "beyond the horizon" if named else None
    axes.axvline(place, color=BLACK, linestyle="--", linewidth=0.8)
    axes.axvspan(place, float(x[-1]), label=label, zorder=0, **BEYOND)

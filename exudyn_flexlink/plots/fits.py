"""A run beside a measured series: both over each other, and their difference below."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from exudyn_flexlink.fitting import Against, Fit
from exudyn_flexlink.plots.frame import new_figure
from exudyn_flexlink.plots.panels import (
    engine_colour,
    legend_outside,
    letter,
    limits,
    shade_beyond,
    shown_in,
    sized,
)
from exudyn_flexlink.plots.style import BLACK, GREY, SCREEN, Style, styled


@styled
def against(found: Against, *, style: Style = SCREEN) -> Figure:
    """Each quantity of a series and of the run beside it, and the run less the series."""
    what = f"{found.result.engine} and {found.series.source}"
    shift = f", shifted by {found.shift:.4g} s" if found.shift else ""
    return _drawn(found, f"{what}{shift}, and their difference", "difference", style)


@styled
def fit(found: Fit, *, style: Style = SCREEN) -> Figure:
    """Each fitted quantity with what was measured, and the residuals."""
    own = " and ".join(found.values) if len(found.values) < 3 else f"{len(found.values)} values"
    subject = f"Fit of {own} to {found.against.series.source}"
    return _drawn(found.against, subject, "residual", style)


def _drawn(found: Against, subject: str, difference: str, style: Style) -> Figure:
    """Two panels for each quantity: the run and the series; what the run is more, by its name."""
    result = found.result
    figure = new_figure(result, subject, 0.4 + 2.9 * len(found.measured), style)
    ratios = (1.7, 1) * len(found.measured)
    rows = figure.subplots(len(ratios), 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
    shown = (result.time >= found.time[0]) & (result.time <= found.time[-1])
    time, marks = result.time[shown], {"color": BLACK, "markersize": sized(2)}
    for both, below, (name, measured) in zip(
        rows[::2], rows[1::2], found.measured.items(), strict=True
    ):
        signal = found.series.signals[name]
        factor, unit = shown_in(signal.unit, measured)
        line = factor * signal.at(result, time)
        both.plot(found.time, factor * measured, ".", label=found.series.source, **marks)
        both.plot(time, line, color=engine_colour(result), label=result.engine)
        both.set_ylabel(f"{name}\n({unit})")
        apart = found.differences[name]
        small, unit = shown_in(signal.unit, apart)
        below.plot(found.time, small * apart, ".", **marks)
        below.axhline(0.0, color=GREY, linewidth=sized(0.8))
        below.set_ylabel(f"{difference}\n({unit})")
        for axes in (both, below):
            shade_beyond(axes, result, result.time, named=axes is rows[0])
    legend_outside(rows[0])
    rows[-1].set_xlabel("time (s)")
    limits(rows[-1], np.asarray(found.time))
    letter(rows)
    return figure

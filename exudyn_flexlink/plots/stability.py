"""How stable a motion is: growth of neighbours, laps against earlier ones, section, spectrum."""

from __future__ import annotations

from math import isfinite

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.plots.frame import caption_of, framed_figure
from exudyn_flexlink.plots.panels import BEYOND, legend_outside, letter, sized
from exudyn_flexlink.plots.style import BLACK, BLUE, GREY, RED, SCREEN, SERIES, SKY, Style, styled
from exudyn_flexlink.stability import Branches, Stability

FAINTEST = 1e-8  # of a spectrum's peak: nothing is drawn below


@styled
def stability(found: Stability, *, style: Style = SCREEN) -> Figure:
    """Four panels: growth of neighbours, laps against earlier ones, section, spectrum."""
    told = f"How stable the motion of {found.point} is: {found.told}"
    title, caption = found.run.scene.title, [(caption_of(found.run), GREY)]
    columns, height = (1, 13.0) if style.narrow else (2, 6.6)
    figure = framed_figure((title, told), height, style, caption=caption)
    panels = figure.subplots(4 // columns, columns, squeeze=False).ravel()
    for draw, axes in zip((_growth, _laps, _section, _spectrum), panels, strict=True):
        draw(axes, found)
    letter(panels)
    return figure


def _growth(axes: Axes, found: Stability) -> None:
    """Growth in each lap, and the mean up to there with its uncertainty in the end."""
    own = found.exponent
    laps = own.times / found.rhythm.lap
    axes.stairs(*growth_of_laps(laps, own.rates), color=SKY, linewidth=sized(0.8),
                label="each lap")  # fmt: skip
    counted = laps[own.settled + 1 :]
    whole = counted > laps[own.settled] + 1  # before, a mean tells where in the lap it ends
    axes.plot(counted[whole], own.running[whole], color=BLUE, label="mean")
    low, high = own.value - own.uncertainty, own.value + own.uncertainty
    axes.axhspan(low, high, color=BLUE, alpha=0.2, linewidth=0, label="95 %")
    axes.axhline(0.0, color=BLACK, linewidth=sized(0.6))
    axes.set_xlabel("laps")
    axes.set_ylabel("growth of distance (1/s)")
    axes.legend(loc="best")


def growth_of_laps(laps: FloatArray, rates: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean growth (L,) 1/s in each lap, and where laps begin and end (L + 1,).

    `rates` (K,) 1/s are those of stretches between `laps` (K + 1,), which are too many to be seen.
    """
    bounds = laps[0] + np.arange(max(1, round(laps[-1] - laps[0])) + 1)
    grown = np.concatenate([[0.0], np.cumsum(rates * np.diff(laps))])
    return np.diff(np.interp(bounds, laps, grown)), bounds


def _laps(axes: Axes, found: Stability) -> None:
    """Largest distance from where the point was one to eight laps before."""
    laps = found.laps
    number = laps.end / found.rhythm.lap
    for colour, before, row in zip(SERIES, laps.before.tolist(), laps.largest, strict=False):
        seen = np.isfinite(row) & (row > 0)
        axes.semilogy(number[seen], row[seen], "o-", color=colour, markersize=sized(3),
                      linewidth=sized(0.8), label=f"{before}")  # fmt: skip
    axes.axhline(found.tolerance, color=BLACK, linestyle=":", label="tolerance")
    known = (found.after + found.horizon) / found.rhythm.lap
    if isfinite(known) and known < number[-1]:
        axes.axvspan(known, float(number[-1]), zorder=0, label="beyond the\nhorizon", **BEYOND)
    axes.set_xlabel("lap")
    axes.set_ylabel("distance from laps before (m)")
    legend_outside(axes, title="laps before")


def _section(axes: Axes, found: Stability) -> None:
    """Place of the point once a lap, the darker the later."""
    section = found.section
    order = np.arange(len(section.time))
    x, y = 1e3 * section.position.T
    axes.scatter(x, y, c=order, cmap="viridis_r", s=sized(14), zorder=3)
    axes.ticklabel_format(useOffset=False)
    axes.set_xlabel(f"x of {section.point} (mm)")
    axes.set_ylabel("y (mm)")
    at = f"at {np.degrees(section.phase):.4g} deg" if section.by_crank else "once a lap"
    axes.set_title(f"{at}; later laps darker", loc="left")


def _spectrum(axes: Axes, found: Stability) -> None:
    """Power of what the point is off its ideal place; x lies below y, broad and pale."""
    vibration = found.vibration
    top = 0.0
    looks = ({"linewidth": sized(3.0), "alpha": 0.45}, {"linewidth": sized(0.6)})
    both = (("x", BLUE, vibration.x), ("y", RED, vibration.y))
    for (name, colour, own), look in zip(both, looks, strict=True):
        if len(own.frequency):
            axes.loglog(own.frequency[1:], own.power[1:], color=colour, label=name, **look)
            top = max(top, float(own.power[1:].max()))
    if top > 0:
        axes.set_ylim(FAINTEST * top, 3 * top)
        axes.legend(loc="best")
    axes.set_xlabel("frequency (Hz)")
    axes.set_ylabel(
        "off its ideal place\n(m$^2$/Hz)" if vibration.off_ideal else "power (m$^2$/Hz)"
    )


@styled
def bifurcation(found: Branches, *, axis: str = "y", style: Style = SCREEN) -> Figure:
    """Place of a point once a lap, over the value that is varied; `axis` is x or y."""
    values, places = found.points
    point = found.sections[0].point if found.sections else ""
    reasons = (("failed", found.failed), ("doubtful", found.doubtful))
    notes = [f"{len(which)} {how}" for how, which in reasons if which]
    title = f"{axis} of {point} once a lap"
    figure = framed_figure((title, f"over {found.path}"), 4.0, style, notes=notes)
    axes = figure.subplots()
    axes.plot(values, 1e3 * places[:, "xy".index(axis)], ".", color=BLUE, markersize=sized(3))
    axes.set_xlabel(f"{found.path} (SI)")
    axes.set_ylabel(f"{axis} of {point} (mm)")
    return figure

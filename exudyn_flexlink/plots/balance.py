"""Energies with the error of their balance, and the forces that act."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from exudyn_flexlink.observables import Strike, sleeves_with_play, strikes
from exudyn_flexlink.plots.frame import new_figure
from exudyn_flexlink.plots.panels import (
    along,
    engine_colour,
    legend_outside,
    letter,
    limits,
    line_widths,
    shade_beyond,
    sized,
)
from exudyn_flexlink.plots.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    RED,
    SCREEN,
    SKY,
    Style,
    styled,
)
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import RevoluteJoint

FloatArray = NDArray[np.float64]

_ENERGIES = (
    ("kinetic", BLUE, "-"),
    ("stored", GREEN, "-"),
    ("dissipated", RED, "--"),
    ("supplied", BLACK, ":"),
)
_COLOURS = (BLUE, RED, GREEN, PURPLE, ORANGE, SKY, BLACK)


BEFORE, AFTER = 0.1, 0.5  # of a strike's duration, shown before and after it


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


@styled
def forces(result: Result, *, style: Style = SCREEN) -> Figure | None:
    """Drive torques, slot, joint, wall and contact forces over the crank angle, or over time.

    Below, the first strike of every contact in a zoom. What the scene does not have is left out;
    None if nothing is left.
    """
    panels = [panel for panel in _panels(result) if panel[1]]
    if not panels or len(result.time) < 2:
        return None
    zooms = _first_strikes(result)
    count = len(panels) + bool(zooms)
    figure = new_figure(result, "Forces", max(2.8, 1.75 * count), style)
    rows = figure.subplots(count, 1, squeeze=False)[:, 0]
    x, label = along(result)
    for i, (axes, (quantity, series)) in enumerate(zip(rows, panels, strict=False)):
        if i:
            axes.sharex(rows[0])
        _draw(axes, series, x)
        axes.set_ylabel(quantity)
        axes.tick_params(labelbottom=i == len(panels) - 1)
        shade_beyond(axes, result, x, named=i == 0)
        legend_outside(axes)
    last = rows[len(panels) - 1]
    last.set_xlabel(label)
    limits(last, x)
    if zooms:
        _zoom(rows[-1], result, zooms)
    letter(rows)
    return figure


def _draw(axes: Axes, series: dict[str, FloatArray], x: FloatArray) -> None:
    """Draw series of one quantity; zero is in sight, so that rounding does not look like forces."""
    thin = 0.8 * float(mpl.rcParams["lines.linewidth"])
    widths = line_widths(list(series.values()), thin)
    for i, ((name, values), width) in enumerate(zip(series.items(), widths, strict=True)):
        colour, faint = _COLOURS[i % len(_COLOURS)], 0.5 if width > thin else 1.0
        axes.plot(x, values, color=colour, linewidth=width, alpha=faint, label=name)
    axes.axhline(0, color=GREY, linewidth=0.5, zorder=1)


def _first_strikes(result: Result) -> dict[str, Strike]:
    """First strike of every contact whose force lasts, by the contact's name."""
    found = {name: strikes(result, name) for name in result.contacts}
    return {name: s[0] for name, s in found.items() if s and s[0].end > s[0].begin}


def _zoom(axes: Axes, result: Result, zooms: dict[str, Strike]) -> None:
    """Draw the first strikes, each from its first touch on."""
    longest = max(strike.end - strike.begin for strike in zooms.values())
    for i, (name, strike) in enumerate(zooms.items()):
        since = result.time - strike.begin
        inside = (since > -BEFORE * longest) & (since < (1 + AFTER) * longest)
        force = result.contacts[name].force[inside]
        colour = _COLOURS[i % len(_COLOURS)]
        axes.plot(1e3 * since[inside], force, color=colour, marker=".", markersize=sized(2.5),
                  linewidth=0.8, label=f"{name}, first")  # fmt: skip
    axes.set_xlabel("time since the first touch (ms)")
    axes.set_ylabel("contact force\n(N)")
    legend_outside(axes)


def _panels(result: Result) -> list[tuple[str, dict[str, FloatArray]]]:
    """Quantity with unit, and its series by name, without the hinges inside a flexible body."""
    joints = {
        name: _magnitude(force)
        for name, force in result.joint_forces.items()
        if isinstance(result.scene.joints.get(name), RevoluteJoint)
    }
    return [
        ("drive torque\n(N m)", dict(result.drive_torques)),
        ("slot force\n(N)", {n: _magnitude(force) for n, force in result.slot_forces.items()}),
        ("joint force\n(N)", joints),
        ("wall force\n(N)", _wall_forces(result)),
        ("contact force\n(N)", {n: contact.force for n, contact in result.contacts.items()}),
    ]


def _wall_forces(result: Result) -> dict[str, FloatArray]:
    """Force of each wall on the link, the sum over all that touches it, where there is play."""
    found = {}
    for joint in sleeves_with_play(result):
        history = result.sleeves[joint]
        for side, wall in ((1.0, "upper"), (-1.0, "lower")):
            own = np.array(history.sides) == side
            found[f"{joint}, {wall} wall"] = history.force[:, own].sum(axis=1)
    return found


def _magnitude(force: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(force, axis=-1))

"""Energies with the error of their balance, and the forces that act."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from exudyn_flexlink.plots.frame import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    RED,
    SKY,
    along,
    engine_colour,
    legend_outside,
    new_figure,
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


@styled
def energy(result: Result) -> Figure | None:
    """Energies over time and, on a logarithmic axis, what their balance misses.

    None if there is nothing but one sample.
    """
    if len(result.time) < 2:
        return None
    figure = new_figure(result, "Energy, and the error of its balance", 5.2)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    largest = max(float(np.max(np.abs(getattr(result.energy, name)))) for name, *_ in _ENERGIES)
    factor, unit = (1e3, "mJ") if largest < 1 else (1.0, "J")
    for name, colour, line in _ENERGIES:
        series = getattr(result.energy, name)
        upper.plot(result.time, factor * series, color=colour, linestyle=line, label=name)
    upper.set_ylabel(f"energy ({unit})")
    legend_outside(upper)
    _residual(lower, result)
    return figure


def _residual(axes: Axes, result: Result) -> None:
    missed = np.abs(result.energy.residual)
    shown = np.where(missed > 0, missed, np.nan)
    axes.set_ylabel("error (J)")
    axes.set_xlabel("time (s)")
    axes.set_xlim(result.time[0], result.time[-1])
    axes.set_yscale("log")
    if np.all(np.isnan(shown)):
        axes.text(0.5, 0.5, "zero throughout", ha="center", transform=axes.transAxes)
        return
    axes.plot(result.time, shown, color=engine_colour(result), linewidth=0.9, label="|error|")
    kinetic = result.checks.largest_kinetic_energy
    if kinetic > 0:
        axes.axhline(kinetic, color=BLUE, linestyle=":", label="largest kinetic\nenergy")
    worst = float(np.nanmax(shown))
    axes.set_ylim(bottom=worst * 1e-6)  # zero crossings would stretch the axis without end
    legend_outside(axes)


@styled
def forces(result: Result) -> Figure | None:
    """Drive torques, slot, joint and contact forces over the crank angle (without one: time).

    What the scene does not have is left out; None if nothing is left.
    """
    panels = [panel for panel in _panels(result) if panel[1]]
    if not panels or len(result.time) < 2:
        return None
    figure = new_figure(result, "Forces", max(2.8, 1.75 * len(panels)))
    rows = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    x, label = along(result)
    for axes, (quantity, series) in zip(rows, panels, strict=True):
        for i, (name, values) in enumerate(series.items()):
            axes.plot(x, values, color=_COLOURS[i % len(_COLOURS)], linewidth=1.0, label=name)
        axes.set_ylabel(quantity)
        legend_outside(axes)
    rows[-1].set_xlabel(label)
    rows[-1].set_xlim(float(np.min(x)), float(np.max(x)))
    if x[-1] < x[0]:
        rows[-1].invert_xaxis()  # a crank that turns clockwise: the run still goes to the right
    return figure


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
        ("contact force\n(N)", {n: contact.force for n, contact in result.contacts.items()}),
    ]


def _magnitude(force: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(force, axis=-1))

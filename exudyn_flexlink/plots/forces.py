"""The forces that act, the first strikes in a zoom; energies, and the error of their balance."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.measured_error import ForceDeviation
from exudyn_flexlink.observables import (
    Force,
    Strike,
    forces_of,
    momentary_forces,
    strikes,
    touching,
)
from exudyn_flexlink.plots.frame import new_figure, told_error
from exudyn_flexlink.plots.given import Given, placed
from exudyn_flexlink.plots.panels import (
    along,
    engine_colour,
    legend_outside,
    letter,
    line_widths,
    logarithmic,
    over_run,
    sized,
)
from exudyn_flexlink.plots.style import BLACK, BLUE, GREEN, GREY, RED, SCREEN, SERIES, Style, styled
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene

BEFORE, AFTER = 0.1, 0.5  # of a strike's duration, shown before and after it
LEAST_HEIGHT = 1.75  # inches of a panel
ENTRY = 0.23  # inches of a line of a legend beside a panel, with the room above it
_ENERGIES = (
    ("kinetic", BLUE, "-"),
    ("stored", GREEN, "-"),
    ("dissipated", RED, "--"),
    ("supplied", BLACK, ":"),
)


@styled
def forces(result: Result, *, style: Style = SCREEN, ax: Given = None) -> Figure | None:
    """Drive torques, slot, joint, wall and contact forces over the crank angle, or over time.

    Below, the first strike of every contact in a zoom. What a second run tells of their
    errors stands with them, and as a band. What the scene does not have is left out, and so is what
    never acts beside others that do, or has impacts without duration alone; None if nothing is
    left.
    """
    panels = _panels(result)
    if not panels or len(result.time) < 2:
        return None
    found = {name: strikes(result, name) for name in result.contacts}
    zooms = {name: s[0] for name, s in found.items() if s and s[0].end > s[0].begin}
    entries = [*map(len, panels.values()), *([len(zooms)] if zooms else [])]
    heights = [max(LEAST_HEIGHT, ENTRY * (count + 1)) for count in entries]
    names = [*panels, *(["first strikes"] if zooms else [])]
    height = max(2.8, sum(heights))
    figure, rows = placed(
        ax, names, lambda: new_figure(result, "Forces", height, style), height_ratios=heights
    )
    x, label = along(result)
    for i, (axes, (quantity, panel)) in enumerate(zip(rows, panels.items(), strict=False)):
        if i and ax is None:
            axes.sharex(rows[0])
        _draw_forces(axes, result, panel, x)
        axes.set_ylabel(quantity)
    over_run(rows[: len(panels)], result, x, label)
    if zooms and len(rows) == len(names):
        _zoom(rows[-1], result, zooms)
    letter(rows)
    return figure


def _draw_forces(axes: Axes, result: Result, panel: dict[str, Force], x: FloatArray) -> None:
    """Draw forces of one quantity; zero is in sight, so that rounding does not look like forces."""
    thin = 0.8 * float(mpl.rcParams["lines.linewidth"])
    series = [force.size for force in panel.values()]
    widths = line_widths(series, thin)
    for i, ((name, force), width) in enumerate(zip(panel.items(), widths, strict=True)):
        colour, faint = SERIES[i % len(SERIES)], 0.5 if width > thin else 1.0
        own = result.error.forces.get(name, ForceDeviation("", None, None))
        error = max((part.largest for part in (own.free, own.touching) if part), default=0.0)
        label = f"{force.name}{_place(result.scene, force)}"
        label += f" \N{PLUS-MINUS SIGN} {told_error(error)}" if error > 0 else ""
        axes.plot(x, force.size, color=colour, linewidth=width, alpha=faint, label=label)
        if own.free is not None:
            # While something touches, the largest error is that of a peak: none of an instant.
            known = ~touching(result, result.time) & (result.time < result.error.known_until)
            ends = (force.size - own.free.largest, force.size + own.free.largest)
            axes.fill_between(x, *ends, where=known, color=colour, alpha=0.25, linewidth=0)
    axes.axhline(0, color=GREY, linewidth=0.5, zorder=1)


def _place(scene: Scene, force: Force) -> str:
    """At which point a force acts, in words; nothing of a torque, and of what has no one point."""
    found = {"joint": scene.joints, "slot": scene.joints, "spring": scene.springs,
             "drive": scene.drives, "contact": scene.contacts}  # fmt: skip
    own = found.get(force.quantity.split()[0], {}).get(force.name)
    if force.unit != "N" or own is None:
        return ""
    points = [getattr(own, "point", None), *reversed(getattr(own, "points", None) or ())]
    moving = [point for point in points if point not in (None, "ground")]
    return f" at {moving[0]}" if moving else ""


def _zoom(axes: Axes, result: Result, zooms: dict[str, Strike]) -> None:
    """Draw the first strikes, each from its first touch on."""
    longest = max(strike.end - strike.begin for strike in zooms.values())
    for i, (name, strike) in enumerate(zooms.items()):
        since = result.time - strike.begin
        inside = (since > -BEFORE * longest) & (since < (1 + AFTER) * longest)
        force = result.contacts[name].force[inside]
        colour = SERIES[i % len(SERIES)]
        label = f"{name}, first"
        axes.plot(1e3 * since[inside], force, color=colour, marker=".", markersize=sized(2.5),
                  linewidth=0.8, label=label)  # fmt: skip
    axes.set_xlabel("time since the first touch (ms)")
    unit = " or ".join(dict.fromkeys(result.scene.unit_of(name, "N") for name in zooms))
    axes.set_ylabel(f"contact force\n({unit})")
    legend_outside(axes)


def _panels(result: Result) -> dict[str, dict[str, Force]]:
    """Forces by what an axis is called, with the unit, and by their own names.

    Of a panel where some act, those that never do are left out: a Geneva wheel has two dozen
    contacts, of which a turn needs eight.
    """
    found: dict[str, dict[str, Force]] = {}
    # Between impacts without duration a line at zero looks as if nothing had been struck.
    momentary = momentary_forces(result)
    for name, force in forces_of(result).items():
        if name not in momentary:
            vector = "size of the\n" if force.values.ndim > 1 else ""
            line = " " if vector else "\n"
            axis = f"{vector}{force.quantity}{line}({force.unit})"
            found.setdefault(axis, {})[name] = force
    for axis, panel in list(found.items()):
        acting = {name: force for name, force in panel.items() if _acts(result, force)}
        found[axis] = acting or panel
        if momentary and not acting and axis.startswith("contact"):
            del found[axis]  # of two stops the one that was never struck
    return found


def _acts(result: Result, force: Force) -> bool:
    """Tell whether a force is ever there; a touch may be shorter than what is between samples."""
    contact = result.contacts.get(force.name) if force.quantity.startswith("contact") else None
    touched = contact is not None and len(contact.touches) > 0
    return touched or bool(np.any(force.size))


@styled
def energy(result: Result, *, style: Style = SCREEN, ax: Given = None) -> Figure | None:
    """Energies over time and, on a logarithmic axis, what their balance misses.

    None if there is nothing but one sample.
    """
    if len(result.time) < 2:
        return None
    subject = "Energy, and the error of its balance"
    figure, panels = placed(
        ax,
        ["energy", "error of the balance"],
        lambda: new_figure(result, subject, 5.2, style),
        sharex=True,
        height_ratios=(3, 2),
    )
    series = [getattr(result.energy, name) for name, *_ in _ENERGIES]
    largest = max(float(np.max(np.abs(values))) for values in series)
    factor, unit = (1e3, "mJ") if largest < 1 else (1.0, "J")
    thin = float(mpl.rcParams["lines.linewidth"])
    widths = line_widths(series, thin)
    for (name, colour, line), values, width in zip(_ENERGIES, series, widths, strict=True):
        look = {"linestyle": line} if width == thin else {"alpha": 0.5}
        panels[0].plot(
            result.time, factor * values, color=colour, linewidth=width, label=name, **look
        )
    panels[0].set_ylabel(f"energy ({unit})")
    if len(panels) > 1:
        _residual(panels[1], result, factor, unit)
    over_run(panels, result, result.time, "time (s)")
    letter(panels)
    return figure


def _residual(axes: Axes, result: Result, factor: float, unit: str) -> None:
    """Draw what the energy balance misses; `factor` is that from J to the unit."""
    missed, colours = {"|error|": factor * result.energy.residual}, [engine_colour(result)]
    logarithmic(axes, result.time, missed, colours, "zero throughout")
    axes.set_ylabel(f"error ({unit})")
    kinetic = factor * result.checks.largest_kinetic_energy
    if kinetic > 0:
        axes.axhline(kinetic, color=BLACK, linestyle=":", label="largest kinetic\nenergy")
        axes.set_ylim(top=max(3 * kinetic, axes.get_ylim()[1]))

"""Figures of forces, bending moments, energies and contacts of links in their guides.

Forces have a zoom on the first strikes; energies have the error of their balance; a guide has a
strip with the states of its contact.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from exudyn_flexlink.arrays import FloatArray, IntArray
from exudyn_flexlink.mechanism import Channel, Mechanism, build_mechanism
from exudyn_flexlink.observables import (
    BENDING,
    TWO_POINTS,
    Bending,
    ContactStates,
    Force,
    State,
    Strike,
    bent_links,
    contact_states,
    forces_of,
    laps,
    momentary_forces,
    strikes,
    touching,
    turned_since_start,
)
from exudyn_flexlink.observables import bending as bending_of
from exudyn_flexlink.plots.frame import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    RED,
    ROW_HEIGHT,
    SCREEN,
    SERIES,
    Style,
    error_text,
    new_figure,
    styled,
)
from exudyn_flexlink.plots.outline import Viewpoint, through
from exudyn_flexlink.plots.panels import (
    Given,
    along,
    engine_colour,
    forward,
    is_beyond,
    legend_outside,
    length_unit,
    letter,
    line_widths,
    logarithmic,
    over_run,
    placed,
    shade_beyond,
    sized,
    title_at,
)
from exudyn_flexlink.result import ForceDeviation, Result
from exudyn_flexlink.scene import Scene, SlotJoint

STATE_COLOURS = {
    State.FREE: "#EFEFEF",
    State.ONE_POINT: "#9ED0F0",
    State.SAME_SIDE: "#B87400",
    State.OPPOSITE_SIDES: "#6B1A08",
}
"""The colours darken from state to state, so that they also differ in grey."""
MOST_ROWS = 12  # most rows of laps in the strip
LEGEND_HEIGHT = 1.3  # inches: height of the legend
STATE_WORDS = {
    State.FREE: "free",
    State.ONE_POINT: "one point",
    State.SAME_SIDE: "two points, same side",
    State.OPPOSITE_SIDES: "two points, opposite sides",
}
BENDING_HEIGHT = 2.2  # inches: height of the panel of a link
LEGEND_ROOM = 1.0  # inches on a screen: legend above a panel in a narrow figure
ROOM = 2.3  # clearances: smallest half height of a drawing
WIDER = 1.1  # height of a drawing, as a multiple of the reach of the link
ARROW = 0.9  # clearances: length of an arrow
FORCE_DIGITS = 2  # digits of a wall's force: stiff walls magnify small errors of place


def strip_height(result: Result) -> float:
    """Return the height (inches) of `strip`, with its legend."""
    rows = min(MOST_ROWS, int(laps(result).max())) if forward(result) else 1
    return max(LEGEND_HEIGHT, ROW_HEIGHT * rows + 0.2)


def strip(axes: Axes, result: Result, joint: str) -> None:
    """Draw the states of a joint with play over the crank angle; each lap has a row.

    If no crank goes round, there is one row, over time.
    """
    states = contact_states(result, joint)
    names = []
    for row, (name, edges, state) in enumerate(_rows(result, states)):
        names.append(name)
        bars = list(zip(edges[:-1].tolist(), np.diff(edges).tolist(), strict=True))
        colours = [STATE_COLOURS[State(state_number)] for state_number in state.tolist()]
        axes.broken_barh(bars, (row + 0.1, 0.8), facecolors=colours, linewidth=0)
    axes.set_ylim(len(names), 0)
    axes.set_yticks([row + 0.5 for row in range(len(names))], names)
    axes.grid(visible=False)
    handles = [
        Patch(facecolor=colour, edgecolor=GREY, linewidth=0.5, label=state.label)
        for state, colour in STATE_COLOURS.items()
        if np.any(states.state == state)
    ]
    if not forward(result):
        shade_beyond(axes, result, result.time, named=False)
    axes.set_title(within(result, joint), loc="left")
    legend_outside(axes, handles=handles)


def within(result: Result, joint: str) -> str:
    """Name what the walls of a joint with play enclose."""
    slot = isinstance(result.scene.joints[joint], SlotJoint)
    return f"{'pin' if slot else 'link'} in {joint}"


def _rows(result: Result, states: ContactStates) -> Iterator[tuple[str, FloatArray, IntArray]]:
    """Yield the name, edges (K + 1,) and states (K,) of every row of the strip."""
    if not forward(result):
        yield "state", states.time, states.state
        return
    turned = turned_since_start(result)
    edges = np.interp(states.time, result.time, np.maximum.accumulate(turned))
    for row in range(min(MOST_ROWS, int(laps(result).max()))):
        begin = 2 * np.pi * row
        inside = (edges[1:] > begin) & (edges[:-1] < begin + 2 * np.pi)
        instants = np.append(edges[:-1][inside], edges[1:][inside][-1:]) - begin
        yield f"lap {row + 1}", np.clip(instants, 0.0, 2 * np.pi), states.state[inside]


@styled
def guide_contact(result: Result, *, style: Style = SCREEN, ax: Given = None) -> Figure | None:
    """Draw the link in its guide: free, on one point and on two points (paper, Fig. 2).

    Each panel shows the middle of the longest time in that state, in the axes of the guide. The
    scale is larger across the guide than along it. States that never occur are omitted. None
    without clearance.
    """
    model = build_mechanism(result.scene)
    channel = next((channel for channel in model.channels if channel.clearance > 0), None)
    shown = [] if channel is None else _instants(result, channel.name)
    if channel is None or not shown:
        return None
    joint = channel.name
    subject = f"Link in '{joint}', seen from the guide; drawn larger across than along"
    names, height = [what for what, _ in shown], 1.75 * len(shown) + 0.4
    figure, panels = placed(
        ax, names, lambda: new_figure(result, subject, height, style), sharex=True, sharey=True
    )
    factor, unit = length_unit(channel.length)
    for axes, (what, index) in zip(panels, shown, strict=False):
        _draw(axes, result, model, channel, index)
        beyond = ", beyond the horizon" * is_beyond(result, float(result.time[index]))
        axes.set_title(f"{what}: {title_at(result, index, 1)}{beyond}", loc="left")
        axes.set_ylabel(f"across ({unit})")
    drawn = [line.get_ydata() for axes in panels for line in axes.lines]
    reach = max(ROOM * channel.clearance * factor, WIDER * float(np.abs(np.hstack(drawn)).max()))
    for axes in panels:
        axes.set_ylim(-reach, reach)
    panels[-1].set_xlabel(f"along the guide, from its start ({unit})")
    known: dict[str, Any] = {}
    for axes in panels:
        handles, labels = axes.get_legend_handles_labels()
        known |= dict(zip(labels, handles, strict=True))
    letter(panels)
    legend_outside(panels[0], below=True, handles=list(known.values()))
    return figure


@styled
def bending(result: Result, *, style: Style = SCREEN, ax: Given = None) -> Figure | None:
    """Draw the bending moment along every flexible link over the run; None without hinges."""
    links = list(bent_links(result.scene))
    if not links or len(result.time) < 2:
        return None
    height = (BENDING_HEIGHT + LEGEND_ROOM * style.narrow) * len(links) + 0.4
    figure, panels = placed(
        ax, links, lambda: new_figure(result, "Bending of links", height, style), sharex=True
    )
    x, label = along(result)
    for axes, link in zip(panels, links, strict=False):
        _draw_bending(axes, result, bending_of(result, link), x)
    over_run(panels, result, x, label)
    letter(panels)
    return figure


def _draw_bending(axes: Axes, result: Result, bent: Bending, x: FloatArray) -> None:
    """Draw the moments of a link as colours; a hinge's band ends half-way to the next hinge."""
    body = bent_links(result.scene)[bent.link]
    factor, unit = length_unit(body.length)
    half = 0.5 * body.length / body.rods
    ends = max(bent.place[0] - half, 0.0), min(bent.place[-1] + half, body.length)
    middles = (bent.place[1:] + bent.place[:-1]) / 2
    edges = factor * np.concatenate([ends[:1], middles, ends[1:]])
    most = float(np.abs(bent.moment).max()) or 1.0
    # The colour of a sample extends half-way to the next sample.
    times = np.concatenate([x[:1], (x[1:] + x[:-1]) / 2, x[-1:]])
    drawn = axes.pcolormesh(
        times, edges, bent.moment.T, cmap="RdBu_r", vmin=-most, vmax=most, rasterized=True
    )
    peak = bent.largest
    words = f"largest: {peak.moment:.3g} N m"
    if peak.stress is not None:
        words += f",\n{peak.stress / 1e6:.3g} MPa"
    place = np.interp(peak.at, result.time, x), factor * peak.place
    axes.plot(*place, "o", mfc="none", color=BLACK, markersize=sized(7.0), clip_on=False,
              label=words.replace("-", "\N{MINUS SIGN}"))  # fmt: skip
    axes.set_ylim(0.0, factor * body.length)
    axes.set_ylabel(f"place on {bent.link} ({unit})")
    axes.grid(visible=False)
    axes.figure.colorbar(drawn, ax=axes, label="bending moment\n(N m)", pad=0.01)


def _instants(result: Result, joint: str) -> list[tuple[str, int]]:
    """Return the caption and the sample of each state: the middle of its longest time."""
    states = contact_states(result, joint)
    instants = []
    for cases in ((State.FREE,), (State.ONE_POINT,), TWO_POINTS):
        stretches = states.stretches(cases)
        for begin, end in stretches[np.argsort(stretches[:, 0] - stretches[:, 1], kind="stable")]:
            inside = np.flatnonzero((result.time > begin) & (result.time < end))
            if len(inside):  # no sample lies in a state that is shorter than a sampling interval
                nearest = np.argmin(np.abs(result.time[inside] - (begin + end) / 2))
                index = int(inside[nearest])
                state = State(int(states.at(result.time[index : index + 1])[0]))
                instants.append((STATE_WORDS[state], index))
                break
    return instants


def _draw(axes: Axes, result: Result, model: Mechanism, channel: Channel, index: int) -> None:
    q = result.poses[index]
    factor, _ = length_unit(channel.length)
    for side in (1, -1):
        y = side * channel.clearance * factor
        axes.plot([0, channel.length * factor], [y, y], color=GREY, linewidth=3, label="walls")
    line = Viewpoint(channel.guide).seen(through(channel.name, *channel.nodes).at(q), q)
    axes.plot(*(factor * line).T, color=BLUE, marker=".", markersize=4, label="link, its nodes")
    if channel.nodes[0] in [slot.anchor for slot in model.all_slots]:
        style: dict[str, Any] = {"color": BLACK, "mfc": "white", "markersize": 7, "zorder": 5}
        axes.plot(*(factor * line[0]), "o", label="in the slot", **style)
    axes.axhline(0, color=GREY, linewidth=0.6, linestyle=":")
    _mark_contacts(axes, result, channel, index)


def _mark_contacts(axes: Axes, result: Result, channel: Channel, index: int) -> None:
    """Mark the points of contact, with the force (N) on the link at each point."""
    history, q = result.sleeves[channel.name], result.poses[index]
    factor, _ = length_unit(channel.length)
    force = history.force[index]
    points = through(channel.name, *(contact.point for contact in channel.contacts)).at(q)
    places = factor * Viewpoint(channel.guide).seen(points, q)
    for side in (1.0, -1.0):
        pressing = [k for k in np.flatnonzero(force > 0).tolist() if history.sides[k] == side]
        last = max(pressing, key=lambda k: float(places[k, 0]), default=None)
        for k in pressing:
            x, y = places[k]
            tail = y + side * ARROW * channel.clearance * factor
            arrow = {"arrowstyle": "-|>", "color": RED, "linewidth": 1.6, "shrinkA": 0}
            axes.annotate("", (x, y), (x, tail), arrowprops=arrow, zorder=6)
            # If points are close together on one side, the last number is at the right.
            right = len(pressing) > 1 and k == last
            axes.annotate(
                f"{force[k]:#.{FORCE_DIGITS}g} N",
                (x, tail),
                xytext=(5 if right else -5, 0),
                textcoords="offset points",
                ha="left" if right else "right",
                va="center",
                fontsize=mpl.rcParams["legend.fontsize"],
            )
            label = "contact, force on the link"
            axes.plot(x, y, "D", color=ORANGE, markersize=4, label=label, zorder=7)


BEFORE, AFTER = 0.1, 0.5  # of the strike's duration: time shown before and after it
LEAST_HEIGHT = 1.75  # inches: smallest height of a panel
_ENERGIES = (
    ("kinetic", BLUE, "-"),
    ("stored", GREEN, "-"),
    ("dissipated", RED, "--"),
    ("supplied", BLACK, ":"),
)


@styled
def forces(result: Result, *, style: Style = SCREEN, ax: Given = None) -> Figure | None:
    """Drive torques, slot, joint, wall and contact forces over the crank angle, or over time.

    Panels below show the first strike of every contact in a zoom. Errors that a second run
    measured are written beside the forces, and drawn as bands. A force is omitted if the scene
    lacks it, or if it never acts while others do, or if it comes from impacts without duration
    only. None if no force is left.
    """
    panels = _panels(result)
    if not panels or len(result.time) < 2:
        return None
    by_contact = {name: strikes(result, name) for name in result.contacts}
    zooms = {name: s[0] for name, s in by_contact.items() if s and s[0].end > s[0].begin}
    entries = [*map(len, panels.values()), *([len(zooms)] if zooms else [])]
    heights = [max(LEAST_HEIGHT, ROW_HEIGHT * (count + 1)) for count in entries]
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
    """Draw forces of one quantity. The axis includes zero, so that rounding does not look large."""
    thin = 0.8 * float(mpl.rcParams["lines.linewidth"])
    series = [force.size for force in panel.values()]
    widths = line_widths(series, thin)
    for i, ((name, force), width) in enumerate(zip(panel.items(), widths, strict=True)):
        colour, faint = SERIES[i % len(SERIES)], 0.5 if width > thin else 1.0
        deviations = result.error.forces.get(name, ForceDeviation("", None, None))
        error = max(
            (part.largest for part in (deviations.free, deviations.touching) if part), default=0.0
        )
        label = f"{force.name}{_place(result.scene, force)}"
        label += f" \N{PLUS-MINUS SIGN} {error_text(error)}" if error > 0 else ""
        axes.plot(x, force.size, color=colour, linewidth=width, alpha=faint, label=label)
        if deviations.free is not None:
            # During a touch the largest error is that of a peak, not that of an instant.
            known = ~touching(result, result.time) & (result.time < result.error.known_until)
            ends = (force.size - deviations.free.largest, force.size + deviations.free.largest)
            axes.fill_between(x, *ends, where=known, color=colour, alpha=0.25, linewidth=0)
    axes.axhline(0, color=GREY, linewidth=0.5, zorder=1)


def _place(scene: Scene, force: Force) -> str:
    """Name the point at which a force acts; empty for a torque, and for a force without a point."""
    sections = {"joint": scene.joints, "slot": scene.joints, "spring": scene.springs,
             "drive": scene.drives, "contact": scene.contacts}  # fmt: skip
    part = sections.get(force.quantity.split()[0], {}).get(force.name)
    if force.unit != "N" or part is None:
        return ""
    points = [getattr(part, "point", None), *reversed(getattr(part, "points", None) or ())]
    moving = [point for point in points if point not in (None, "ground")]
    return f" at {moving[0]}" if moving else ""


def _zoom(axes: Axes, result: Result, zooms: dict[str, Strike]) -> None:
    """Draw the first strikes; time counts from the first touch of each."""
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
    units = dict.fromkeys(result.scene.unit_of(name, "N") for name in zooms)
    what = " or ".join("torque" if unit == "N m" else "force" for unit in units)
    axes.set_ylabel(f"contact {what}\n({' or '.join(units)})")
    legend_outside(axes)


def _panels(result: Result) -> dict[str, dict[str, Force]]:
    """Return forces by the label of their axis (with its unit), and by their names.

    A panel omits forces that never act while others do: a Geneva wheel has two dozen contacts, and
    a turn uses eight of them.
    """
    panels: dict[str, dict[str, Force]] = {}
    # Impacts without duration have no force: a line at zero would look like no impact at all.
    momentary = momentary_forces(result)
    for name, force in forces_of(result).items():
        if name not in momentary:
            axis = f"{force.quantity}\n({force.unit})"
            if force.values.ndim > 1:
                axis = f"size of the\n{force.quantity} ({force.unit})"
            if force.quantity == BENDING:
                axis = f"largest bending\nmoment ({force.unit})"
            panels.setdefault(axis, {})[name] = force
    for axis, panel in list(panels.items()):
        acting = {name: force for name, force in panel.items() if _acts(result, force)}
        panels[axis] = acting or panel
        if momentary and not acting and axis.startswith("contact"):
            del panels[axis]  # no force of this axis acts, as of a stop that nothing strikes
    return panels


def _acts(result: Result, force: Force) -> bool:
    """Tell whether a force ever acts; a touch may be shorter than the sampling interval."""
    contact = result.contacts.get(force.name) if force.quantity.startswith("contact") else None
    touched = contact is not None and len(contact.touches) > 0
    return touched or bool(np.any(force.size))


@styled
def energy(result: Result, *, style: Style = SCREEN, ax: Given = None) -> Figure | None:
    """Draw energies over time and, on a logarithmic axis, the error of their balance.

    None if the run has only one sample.
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
    """Draw the error of the energy balance; `factor` converts J to the unit."""
    missed, colours = {"|error|": factor * result.energy.residual}, [engine_colour(result)]
    logarithmic(axes, result.time, missed, colours, "zero throughout")
    axes.set_ylabel(f"error ({unit})")
    kinetic = factor * result.checks.largest_kinetic_energy
    if kinetic > 0:
        axes.axhline(kinetic, color=BLACK, linestyle=":", label="largest kinetic\nenergy")
        axes.set_ylim(top=max(3 * kinetic, axes.get_ylim()[1]))

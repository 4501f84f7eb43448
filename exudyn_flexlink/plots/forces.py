"""Figures of forces, with the first strikes in a zoom, of energies, and of links in their guides.

The error of the balance of energies is drawn, too; a guide has its states as a strip.
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
"""Ever darker, so that they are told apart in grey too."""
MOST_ROWS = 12  # of laps in the strip
LEGEND_HEIGHT = 1.3  # inches
STATE_WORDS = {
    State.FREE: "free",
    State.ONE_POINT: "one point",
    State.SAME_SIDE: "two points, same side",
    State.OPPOSITE_SIDES: "two points, opposite sides",
}
BENDING_HEIGHT = 2.2  # inches of a link's panel
LEGEND_ROOM = 1.0  # inches on a screen, of the legend above a panel in a narrow figure
ROOM = 2.3  # half the height of a drawing, at least, in clearances
WIDER = 1.1  # times as far as the link reaches
ARROW = 0.9  # length, in clearances
FORCE_DIGITS = 2  # that are shown of a wall's force: stiff walls make much of small errors


def strip_height(result: Result) -> float:
    """Height (inches) that `strip` needs, its legend included."""
    rows = min(MOST_ROWS, int(laps(result).max())) if forward(result) else 1
    return max(LEGEND_HEIGHT, ROW_HEIGHT * rows + 0.2)


def strip(axes: Axes, result: Result, joint: str) -> None:
    """Draw the states of a joint with play over the crank angle within each lap, one row for a lap.

    Without a crank that goes round over time, in one row.
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
    """What is between the walls of a joint with play, in words."""
    slot = isinstance(result.scene.joints[joint], SlotJoint)
    return f"{'pin' if slot else 'link'} in {joint}"


def _rows(result: Result, states: ContactStates) -> Iterator[tuple[str, FloatArray, IntArray]]:
    """Name, edges (K + 1,) and states (K,) of every row of the strip."""
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
    """The link in its guide free, on one point and on two (paper, Fig. 2), at instants of the run.

    Each is the middle of the longest time in that state; what never occurs is left out. Drawn in
    the guide's axes, across it larger than along it. None without clearance.
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
    """Bending moment along every flexible link over the run; None without any hinge."""
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
    """Draw a link's moments as colours, each place a band up to the middle to the next one."""
    body = bent_links(result.scene)[bent.link]
    factor, unit = length_unit(body.length)
    half = 0.5 * body.length / body.rods
    ends = max(bent.place[0] - half, 0.0), min(bent.place[-1] + half, body.length)
    middles = (bent.place[1:] + bent.place[:-1]) / 2
    edges = factor * np.concatenate([ends[:1], middles, ends[1:]])
    most = float(np.abs(bent.moment).max()) or 1.0
    # A colour holds from the middle between two samples to the next one.
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
    """What is shown, and the sample: that nearest the middle of the longest time in each case."""
    states = contact_states(result, joint)
    instants = []
    for cases in ((State.FREE,), (State.ONE_POINT,), TWO_POINTS):
        stretches = states.stretches(cases)
        for begin, end in stretches[np.argsort(stretches[:, 0] - stretches[:, 1], kind="stable")]:
            inside = np.flatnonzero((result.time > begin) & (result.time < end))
            if len(inside):  # one shorter than the time between two samples was not seen
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
    """Mark the points of contact, with the force (N) on the link at each."""
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
            # Of points close together on one side, the number of the last goes to the right.
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


BEFORE, AFTER = 0.1, 0.5  # of a strike's duration, shown before and after it
LEAST_HEIGHT = 1.75  # inches of a panel
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
    """Draw forces of one quantity; zero is in sight, so that rounding does not look like forces."""
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
            # While something touches, the largest error is that of a peak: none of an instant.
            known = ~touching(result, result.time) & (result.time < result.error.known_until)
            ends = (force.size - deviations.free.largest, force.size + deviations.free.largest)
            axes.fill_between(x, *ends, where=known, color=colour, alpha=0.25, linewidth=0)
    axes.axhline(0, color=GREY, linewidth=0.5, zorder=1)


def _place(scene: Scene, force: Force) -> str:
    """At which point a force acts, in words; nothing of a torque, and of what has no one point."""
    sections = {"joint": scene.joints, "slot": scene.joints, "spring": scene.springs,
             "drive": scene.drives, "contact": scene.contacts}  # fmt: skip
    part = sections.get(force.quantity.split()[0], {}).get(force.name)
    if force.unit != "N" or part is None:
        return ""
    points = [getattr(part, "point", None), *reversed(getattr(part, "points", None) or ())]
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
    units = dict.fromkeys(result.scene.unit_of(name, "N") for name in zooms)
    what = " or ".join("torque" if unit == "N m" else "force" for unit in units)
    axes.set_ylabel(f"contact {what}\n({' or '.join(units)})")
    legend_outside(axes)


def _panels(result: Result) -> dict[str, dict[str, Force]]:
    """Forces by what an axis is called, with the unit, and by their own names.

    Of a panel where some act, those that never do are left out: a Geneva wheel has two dozen
    contacts, of which a turn needs eight.
    """
    panels: dict[str, dict[str, Force]] = {}
    # Between impacts without duration a line at zero looks as if nothing had been struck.
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
            del panels[axis]  # of two stops the one that was never struck
    return panels


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

"""How a link stands in a guide with clearance: its states as a strip, and drawn at instants."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from exudyn_flexlink.arrays import FloatArray, IntArray
from exudyn_flexlink.mechanism import Channel, Mechanism, build_mechanism, pairs
from exudyn_flexlink.observables import (
    TWO_POINTS,
    ContactStates,
    State,
    contact_states,
    laps,
    sleeves_with_play,
    turned_since_start,
)
from exudyn_flexlink.plots.frame import new_figure
from exudyn_flexlink.plots.given import Given, placed
from exudyn_flexlink.plots.outline import Viewpoint, through
from exudyn_flexlink.plots.panels import (
    forward,
    is_beyond,
    legend_outside,
    length_unit,
    letter,
    shade_beyond,
    title_at,
)
from exudyn_flexlink.plots.style import BLACK, BLUE, GREY, ORANGE, RED, SCREEN, Style, styled
from exudyn_flexlink.result import Result

STATE_COLOURS = {
    State.FREE: "#EFEFEF",
    State.ONE_POINT: "#9ED0F0",
    State.SAME_SIDE: "#B87400",
    State.OPPOSITE_SIDES: "#6B1A08",
}
"""Ever darker, so that they are told apart in grey too."""
MOST_ROWS = 12  # of laps in the strip
LEGEND_HEIGHT = 1.3  # inches
ROW_HEIGHT = 0.24
STATE_WORDS = {
    State.FREE: "free",
    State.ONE_POINT: "one point",
    State.SAME_SIDE: "two points, same side",
    State.OPPOSITE_SIDES: "two points, opposite sides",
}
ROOM = 2.3  # half the height of a drawing, in clearances
ARROW = 0.9  # length, in clearances
FORCE_DIGITS = 2  # that are shown of a wall's force: stiff walls make much of small errors


def strip_height(result: Result) -> float:
    """Height (inches) that `strip` needs, its legend included."""
    rows = min(MOST_ROWS, int(laps(result).max())) if forward(result) else 1
    return max(LEGEND_HEIGHT, ROW_HEIGHT * rows + 0.2)


def strip(axes: Axes, result: Result, joint: str) -> None:
    """Draw the states of a sleeve over the crank angle within each lap, one row for a lap.

    Without a crank that goes round over time, in one row.
    """
    states = contact_states(result, joint)
    names = []
    for row, (name, edges, state) in enumerate(_rows(result, states)):
        names.append(name)
        bars = list(zip(edges[:-1].tolist(), np.diff(edges).tolist(), strict=True))
        colours = [STATE_COLOURS[State(one)] for one in state.tolist()]
        axes.broken_barh(bars, (row + 0.1, 0.8), facecolors=colours, linewidth=0)
    axes.set_ylim(len(names), 0)
    axes.set_yticks([row + 0.5 for row in range(len(names))], names)
    axes.grid(visible=False)
    handles = [
        Patch(facecolor=colour, edgecolor=GREY, linewidth=0.5, label=state.told)
        for state, colour in STATE_COLOURS.items()
        if np.any(states.state == state)
    ]
    if not forward(result):
        shade_beyond(axes, result, result.time, named=False)
    axes.set_title(f"link in {joint}", loc="left")
    legend_outside(axes, handles=handles)


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
        own = np.append(edges[:-1][inside], edges[1:][inside][-1:]) - begin
        yield f"lap {row + 1}", np.clip(own, 0.0, 2 * np.pi), states.state[inside]


@styled
def guide_contact(result: Result, *, style: Style = SCREEN, ax: Given = None) -> Figure | None:
    """The link in its guide free, on one point and on two (paper, Fig. 2), at instants of the run.

    Each is the middle of the longest time in that state; what never occurs is left out. Drawn in
    the guide's axes, across it larger than along it. None without clearance.
    """
    joints = sleeves_with_play(result)
    shown = _instants(result, joints[0]) if joints else []
    if not shown:
        return None
    joint, model = joints[0], build_mechanism(result.scene)
    channel = next(channel for channel in model.channels if channel.name == joint)
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
    reach = ROOM * channel.clearance * factor
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


def _instants(result: Result, joint: str) -> list[tuple[str, int]]:
    """What is shown, and the sample: that nearest the middle of the longest time in each case."""
    states = contact_states(result, joint)
    found = []
    for cases in ((State.FREE,), (State.ONE_POINT,), TWO_POINTS):
        stretches = states.stretches(cases)
        for begin, end in stretches[np.argsort(stretches[:, 0] - stretches[:, 1], kind="stable")]:
            inside = np.flatnonzero((result.time > begin) & (result.time < end))
            if len(inside):  # one shorter than the time between two samples was not seen
                nearest = np.argmin(np.abs(result.time[inside] - (begin + end) / 2))
                index = int(inside[nearest])
                state = State(int(states.at(result.time[index : index + 1])[0]))
                found.append((STATE_WORDS[state], index))
                break
    return found


def _draw(axes: Axes, result: Result, model: Mechanism, channel: Channel, index: int) -> None:
    q = result.poses[index]
    factor, _ = length_unit(channel.length)
    for side in (1, -1):
        y = side * channel.clearance * factor
        axes.plot([0, channel.length * factor], [y, y], color=GREY, linewidth=3, label="walls")
    line = Viewpoint(channel.guide).seen(through(channel.name, *channel.nodes).at(q), q)
    axes.plot(*(factor * line).T, color=BLUE, marker=".", markersize=4, label="link, its nodes")
    if channel.nodes[0] in [slot.anchor for slot in model.slots]:
        style: dict[str, Any] = {"color": BLACK, "mfc": "white", "markersize": 7, "zorder": 5}
        axes.plot(*(factor * line[0]), "o", label="in the slot", **style)
    axes.axhline(0, color=GREY, linewidth=0.6, linestyle=":")
    _mark_contacts(axes, result, channel, index)


def _mark_contacts(axes: Axes, result: Result, channel: Channel, index: int) -> None:
    """Mark the points of contact, with the force (N) on the link at each."""
    history, q = result.sleeves[channel.name], result.poses[index]
    factor, _ = length_unit(channel.length)
    force = history.force[index]
    points = through(channel.name, *(contact.point for contact in pairs(channel))).at(q)
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

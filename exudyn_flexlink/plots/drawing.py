"""The mechanism itself, drawn at a few instants."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from math import ceil
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from exudyn_flexlink.mechanism import (
    GROUND,
    Anchor,
    Channel,
    Mechanism,
    anchor_position,
    build_mechanism,
)
from exudyn_flexlink.observables import (
    crank_angle,
    lever_response,
    path,
    point_anchor,
    strikes,
    turns,
    watched_point,
)
from exudyn_flexlink.plots.frame import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    RED,
    WIDTH,
    length_unit,
    new_figure,
    styled,
)
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import FlexibleBody, RigidBody, Scene

FloatArray = NDArray[np.float64]

_WALL: dict[str, Any] = {"color": "#A9A9A9", "linewidth": 2.0, "zorder": 2}
_BODY_COLOURS = ("#9A9A9A", BLUE, RED, GREEN, PURPLE, ORANGE)
COLUMNS = 2
LEGEND = 2.6  # inches, of legend and labels beside the panels


@styled
def mechanism(result: Result, instants: Sequence[float] | None = None) -> Figure | None:
    """Draw the mechanism at `instants` (s): bodies, curves of slots, path of the watched point.

    Without `instants`: the start, the first contact, the greatest angle of the struck body and the
    same crank angle one turn after the first contact; without contacts four instants over the run.
    """
    shown = _instants(result) if instants is None else [(time, "") for time in instants]
    if not shown:
        return None
    model, point = build_mechanism(result.scene), watched_point(result.scene)
    track = path(result, point).position
    low, high = _box(result, model, track)
    width, height = high - low
    rows = ceil(len(shown) / COLUMNS)
    panel = min(4.4, max(0.9, (WIDTH - LEGEND) / COLUMNS * height / width)) + 0.65
    figure = new_figure(result, "The mechanism at some instants", rows * panel + 0.2)
    panels = figure.subplots(rows, COLUMNS, squeeze=False, sharex=True, sharey=True)
    factor, unit = length_unit(float(max(width, height)))
    for axes, (time, what) in zip(panels.flat, shown, strict=False):
        index = int(np.argmin(np.abs(result.time - time)))
        _draw(axes, result, model, index, factor)
        axes.plot(*(factor * track).T, color=GREY, linewidth=0.7, zorder=1)
        axes.plot(*(factor * track[: index + 1]).T, color=BLACK, linewidth=1.0, zorder=2)
        axes.plot(*(factor * track[index]), "o", color=BLACK, markersize=4, zorder=6)
        axes.set_title(_panel_title(result, index, what), loc="left", fontsize=9)
        axes.set_aspect("equal")
        axes.set_xlim(factor * low[0], factor * high[0])
        axes.set_ylim(factor * low[1], factor * high[1])
        axes.xaxis.set_major_locator(MaxNLocator(5))
    for axes in panels.flat[len(shown) :]:
        axes.set_axis_off()
    for axes in panels[-1]:
        axes.set_xlabel(f"x ({unit})")
    for axes in panels[:, 0]:
        axes.set_ylabel(f"y ({unit})")
    walled = {model.parts[channel.guide.part].body for channel in _with_play(model)}
    handles = _legend(result.scene, point, walled)
    panels[0, -1].legend(handles=handles, loc="upper left", bbox_to_anchor=(1.02, 1.0))
    return figure


def _instants(result: Result) -> list[tuple[float, str]]:
    """Choose times worth a drawing, with what happens there."""
    first = {name: strikes(result, name) for name in result.scene.contacts}
    struck = next(((name, found[0]) for name, found in first.items() if found), None)
    if struck is None:
        even = np.linspace(result.time[0], result.time[-1], min(5, len(result.time)))
        return [(float(time), "") for time in even[:4]]
    contact, strike = struck
    response = lever_response(result, contact)
    peak = max(response.least, response.greatest, key=lambda peak: abs(peak[0]))[1]
    chosen = [
        (float(result.time[0]), "start"),
        (strike.begin, "first contact"),
        (peak, f"greatest angle of {response.body}"),
    ]
    if turns(result):
        turned = np.abs(crank_angle(result) - crank_angle(result)[0])
        at = float(np.interp(strike.begin, result.time, turned)) + 2 * np.pi
        if turned[-1] >= at:
            time = result.time[int(np.argmin(np.abs(turned - at)))]
            chosen.append((float(time), "one turn after the first contact"))
    return chosen


def _panel_title(result: Result, index: int, what: str) -> str:
    words = [f"t = {result.time[index]:.4f} s"]
    if turns(result):
        words.append(f"crank {np.degrees(crank_angle(result)[index]):.1f}°")
    return ", ".join(words) + (f"\n{what}" if what else "")


def _box(result: Result, model: Mechanism, track: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Lower left and upper right corner (2,) of all that is drawn, with a margin."""
    every = max(1, len(result.time) // 200)
    points = [track]
    for body in result.scene.bodies:
        points += [
            line.reshape(-1, 2) for line in _lines(result, model, body, slice(None, None, every))
        ]
    points += [slot.curve.samples[1] for slot in model.slots]
    points += [
        np.array([[pin.first.x, pin.first.y]]) for pin in model.pins if pin.first.part == GROUND
    ]
    all_ = np.concatenate(points)
    low, high = all_.min(axis=0), all_.max(axis=0)
    size = float(np.max(high - low)) or 1.0
    # A mechanism that moves along a line still needs some height to be drawn.
    thin = np.maximum(0.3 * size - (high - low), 0.0) / 2
    return low - thin - 0.05 * size, high + thin + 0.05 * size


def _lines(result: Result, model: Mechanism, body: str, samples: slice) -> list[FloatArray]:
    """Polylines (instants, points, 2) in m that stand for a body: rods, or rays to its points."""
    q, scene = result.poses[samples], result.scene
    spec = scene.bodies[body]
    if isinstance(spec, RigidBody):
        centre = anchor_position(point_anchor(scene, model, f"{body}.centre"), q)
        others = [
            anchor_position(point_anchor(scene, model, f"{body}.{name}"), q) for name in spec.points
        ]
        return [np.stack([centre, other], axis=1) for other in others] or [centre[:, None]]
    starts = [q[:, part, :2] for part in model.parts_of(body)]
    end = anchor_position(point_anchor(scene, model, f"{body}.end"), q)
    return [np.stack([*starts, end], axis=1)]


def _draw(axes: Axes, result: Result, model: Mechanism, index: int, factor: float) -> None:
    for slot in model.slots:
        axes.plot(*(factor * slot.curve.samples[1]).T, color=PURPLE, linewidth=1.0, zorder=1)
    for i, body in enumerate(result.scene.bodies):
        style = _body_style(result.scene, body, i)
        walls = [c for c in _with_play(model) if c.guide.part in model.parts_of(body)]
        if walls:
            _draw_walls(axes, result.poses[index], walls, factor)
            continue
        for line in _lines(result, model, body, slice(index, index + 1)):
            axes.plot(*(factor * line[0]).T, **style)
    for pin in model.pins:
        if GROUND in (pin.first.part, pin.second.part):
            at = pin.first if pin.first.part == GROUND else pin.second
            axes.plot(
                factor * at.x, factor * at.y, "^", color=BLACK, markersize=7, mfc="white", zorder=5
            )


def _with_play(model: Mechanism) -> list[Channel]:
    """Guides with clearance: they are drawn as their two walls."""
    return [channel for channel in model.channels if channel.clearance > 0]


def _draw_walls(axes: Axes, q: FloatArray, channels: Sequence[Channel], factor: float) -> None:
    for channel in channels:
        at = channel.guide
        for y in (at.y + channel.clearance, at.y - channel.clearance):
            ends = [Anchor(at.part, x, y) for x in (at.x, at.x + channel.length)]
            wall = factor * np.array([anchor_position(end, q) for end in ends])
            axes.plot(*wall.T, **_WALL)


def _body_style(scene: Scene, body: str, number: int) -> dict[str, Any]:
    """Guides are broad and pale, so that what slides in them is seen; hinges are dots."""
    guides = [joint.guide for joint in scene.joints.values() if joint.type == "sleeve"]
    spec = scene.bodies[body]
    if body in guides:
        return {"color": "#C9C9C9", "linewidth": 7, "solid_capstyle": "butt", "zorder": 2}
    colour = _BODY_COLOURS[number % len(_BODY_COLOURS)]
    style: dict[str, Any] = {"color": colour, "linewidth": 2.2, "zorder": 4}
    if isinstance(spec, FlexibleBody):
        style |= {"linewidth": 1.5, "marker": ".", "markersize": 3}
    return style | ({"marker": "o", "markersize": 4} if isinstance(spec, RigidBody) else {})


def _legend(scene: Scene, point: str, walled: Collection[str]) -> list[Line2D]:
    """Entries for all that is drawn; `walled` bodies are guides drawn as two walls."""
    handles = []
    for i, body in enumerate(scene.bodies):
        if body in walled:
            handles.append(Line2D([], [], label=f"walls of {body}", **_WALL))
            continue
        handles.append(Line2D([], [], label=body, **_body_style(scene, body, i)))
    if any(joint.type == "slot" for joint in scene.joints.values()):
        handles.append(Line2D([], [], color=PURPLE, linewidth=1.0, label="track"))
    handles.append(Line2D([], [], color=BLACK, linewidth=1.0, label=f"path of {point}"))
    if any("ground" in getattr(joint, "points", ()) for joint in scene.joints.values()):
        pivot: dict[str, Any] = {"marker": "^", "color": BLACK, "mfc": "white", "linestyle": ""}
        handles.append(Line2D([], [], label="fixed joint", **pivot))
    return handles

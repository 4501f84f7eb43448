"""A mechanism where it starts, with the names of its parts: what a model file says, to look at."""

from __future__ import annotations

from itertools import pairwise, product
from math import pi
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.path import Path
from matplotlib.transforms import Bbox

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import Assembly, anchor_position
from exudyn_flexlink.observables import point_anchor
from exudyn_flexlink.plots.frame import framed_figure, settle, shortened
from exudyn_flexlink.plots.outline import (
    acting_marks,
    body_colour,
    coil,
    is_guide,
    joint_marks,
    together,
)
from exudyn_flexlink.plots.panels import legend_outside, sized
from exudyn_flexlink.plots.sketch import Sketch
from exudyn_flexlink.plots.style import BLACK, GREEN, GREY, ORANGE, RED, SCREEN, Style, styled
from exudyn_flexlink.scene import Scene

LEGEND = 2.2  # inches on a screen, beside the drawing; in print below it
LOWEST, TALLEST_START = 2.4, 7.5  # inches, of the drawing
SAME = 1e-6  # of the drawing: points nearer than this are one
MOST_BODIES = 14  # in the legend: it has no more room
MOST_NAMED = 40  # points: more names hide the mechanism
ROOM = 0.08  # of the drawing, around it, for names
SYMBOL = 9.0  # points, that names keep off: as wide as most symbols
SPOTS = 12  # of a line that names keep away from
DIRECTIONS = 12
NEAR = 7.0  # points, from a place to its label
FARTHER = (1.0, 2.0, 3.2, 4.6)  # times as far, where there is no room
APART = 2.0  # points, between two names, so that they don't read as one
# What a place for a name costs, which is 1 where it lies on another:
OF_LINE = 0.15  # for a spot of a line that is hidden
OUTSIDE = 4.0  # for leaving the axes
OF_DISTANCE = 0.06  # for standing farther off


_TURN = np.linspace(0.0, 4 * pi, 60)
# A marker: two turns of a spiral, as torsional springs are drawn.
_SPIRAL = Path(np.stack([_TURN * np.cos(_TURN), _TURN * np.sin(_TURN)], axis=1) / (4 * pi))

_SYMBOLS: dict[str, tuple[Any, str, str, float, int]] = {
    "revolute": ("o", BLACK, "white", 6, 6),
    "revolute, on the ground": ("^", BLACK, "white", 8, 5),
    "weld": ("s", BLACK, BLACK, 5, 6),
    "weld, to the ground": ("s", BLACK, BLACK, 9, 6),
    "in a slot": ("D", BLACK, "white", 5, 6),
    "prismatic": ("s", BLACK, "white", 8, 5),
    "torsional spring": (_SPIRAL, GREEN, "none", 13, 7),
    "drive": (r"$\circlearrowleft$", ORANGE, ORANGE, 15, 7),
    "force": (r"$\rightarrow$", ORANGE, ORANGE, 15, 7),
    "point that may strike": ("*", RED, RED, 9, 7),
}
"""Markers, their colour, that of their face, their size (points) and how far in front they are."""
_SPRING: dict[str, Any] = {"color": GREEN, "linewidth": 1.2, "zorder": 3}
# Broader than the body it is on, which lies over it.
_FACE: dict[str, Any] = {"color": RED, "linewidth": 8.0, "alpha": 0.35, "zorder": 3,
                         "solid_capstyle": "butt"}  # fmt: skip


@styled
def start(scene: Scene, assembly: Assembly, *, style: Style = SCREEN) -> Figure:
    """Draw bodies, joints, curves, springs, drives and contacts at time 0, with their names."""
    posed = Sketch(scene, assembly.state.q[None])
    low, high = _room(posed)
    width, height = high - low
    room = (style.width - LEGEND * (not style.narrow) - 0.6) / style.scale
    tall = min(TALLEST_START, max(LOWEST, room * float(height / width)))
    caption = [(_caption(scene, posed), GREY)]
    subject = "The mechanism where it starts"
    whole = tall + 0.5 + LEGEND * style.narrow
    figure = framed_figure((scene.title, subject), whole, style, caption=caption)
    axes = figure.subplots()
    posed.draw(axes, 0)
    drawn = _draw_symbols(axes, posed)
    margin = ROOM * float(max(width, height))
    posed.window(axes, (low - margin, high + margin))
    axes.set_xlabel(f"x ({posed.unit[1]})")
    axes.set_ylabel(f"y ({posed.unit[1]})")
    bodies = posed.body_legend() if len(scene.bodies) <= MOST_BODIES else []
    legend_outside(axes, below=True, handles=[*bodies, *drawn])
    settle(figure)  # names are placed in a layout that is final
    _name(axes, posed)
    return figure


def _room(posed: Sketch) -> tuple[FloatArray, FloatArray]:
    """Lower left and upper right corner (2,) m of the mechanism and the ends of its springs."""
    low, high = posed.box
    ends = [end for own in posed.drawn(["spring"]) for end in own.line.at(posed.poses[0])]
    return np.min([low, *ends], axis=0), np.max([high, *ends], axis=0)


def _caption(scene: Scene, posed: Sketch) -> str:
    """Say which gravity acts, and how many points have no room for their names."""
    x, y = scene.gravity
    words = ["no gravity"] if x == y == 0 else [f"gravity ({x:g}, {y:g}) m/s^2"]
    many = len(_named_points(posed))
    words += [f"{many} named points, too many to be named here"] if many > MOST_NAMED else []
    return "; ".join(words).replace("-", "\u2212")


def _draw_symbols(axes: Axes, posed: Sketch) -> list[Line2D]:
    """Draw joints, springs, drives and contacts; returns entries of a legend."""
    factor, _ = posed.unit
    seen: dict[str, Line2D] = {}
    scene, model = posed.scene, posed.model
    for mark in (*joint_marks(scene, model), *acting_marks(scene, model)):
        marker, colour, face, size, front = _SYMBOLS[mark.kind]
        look: dict[str, Any] = {"marker": marker, "color": colour, "mfc": face, "linestyle": "",
                                "markersize": sized(size), "zorder": front}  # fmt: skip
        axes.plot(*(factor * anchor_position(mark.anchor, posed.poses[0])), **look)
        seen[mark.kind] = Line2D([], [], label=mark.kind, **look)
    others = (("spring", "linear spring", _SPRING), ("face", "face of a contact", _FACE))
    for kind, label, look in others:
        for own in posed.drawn([kind]):
            points = own.line.at(posed.poses[0])
            axes.plot(*(factor * (coil(points) if kind == "spring" else points)).T, **look)
            seen[label] = Line2D([], [], label=label, **look)
    return list(seen.values())


def _named_points(posed: Sketch) -> dict[str, FloatArray]:
    """Places of all points that the scene names; centres only where a body has no other."""
    scene = posed.scene
    bodies = scene.bodies.items()
    names = [f"{name}.{p}" for name, body in bodies for p in body.point_names if p != "centre"]
    anchors = [point_anchor(scene, posed.model, name) for name in names]
    places = [anchor_position(anchor, posed.poses[0]) for anchor in anchors]
    return dict(zip(names, places, strict=True))


def _name(axes: Axes, posed: Sketch) -> None:
    """Write the names of bodies and of points, those of one place together."""
    factor, _ = posed.unit
    low, high = posed.box
    middle, near = (low + high) / 2, SAME * float(np.max(high - low))
    lines = {body: posed.lines(body, 0) for body in posed.scene.bodies}
    every = [
        *(x for of in lines.values() for x in of),
        *(own.line.at(posed.poses[0]) for own in posed.drawn(["curve"])[: len(posed.model.slots)]),
    ]
    # Names keep away from points all along the lines.
    spots = [np.linspace(a, b, SPOTS) for line in every for a, b in pairwise(line)]
    alone = [line for line in every if len(line) == 1]
    labels = Labels(axes, factor * np.concatenate([*spots, *alone]))
    marks = (*joint_marks(posed.scene, posed.model), *acting_marks(posed.scene, posed.model))
    if marks:
        symbols = np.stack([anchor_position(mark.anchor, posed.poses[0]) for mark in marks])
        labels.keep_free(factor * symbols, sized(SYMBOL))
    for body, own in lines.items():
        longest = max(own, key=lambda points: float(np.ptp(points, axis=0).max()))
        place = (longest[0] + longest[-1]) / 2
        colour = GREY if is_guide(posed.scene, body) else body_colour(posed.scene, body)
        labels.write(body, factor * place, place - middle, color=colour, weight="bold")
    named = _named_points(posed)
    small = float(mpl.rcParams["legend.fontsize"]) - 2
    for first, names in together(named, near).items() if len(named) <= MOST_NAMED else ():
        text, place = "\n".join(names), named[first]
        labels.write(text, factor * place, place - middle, color=BLACK, fontsize=small)


class Labels:
    """Places names one after the other; what is placed first has the best place.

    The limits of the axes, and the layout of the figure, have to be final. `spots` (N, 2), in data
    coordinates, are places that had better stay free.
    """

    def __init__(self, axes: Axes, spots: FloatArray) -> None:
        self._axes, self._window = axes, axes.get_window_extent()
        self._taken: list[Bbox] = []
        self._spots = axes.transData.transform(spots)
        figure = axes.get_figure()
        assert figure is not None
        self._pixels = figure.dpi / 72  # in a point

    def keep_free(self, places: FloatArray, size: float) -> None:
        """Keep names off symbols `size` (points) wide at places (N, 2), in data coordinates."""
        half = size / 2 * self._pixels
        self._taken += [
            Bbox([at - half, at + half]) for at in self._axes.transData.transform(places)
        ]

    def write(self, text: str, place: FloatArray, towards: FloatArray, **look: Any) -> None:
        """Write a name beside a place (data coordinates), rather in the direction `towards`."""
        x, y = (float(one) for one in place)
        shown = self._axes.annotate(
            shortened(text), (x, y), (0, 0), textcoords="offset points", ha="center", va="center",
            zorder=8, **look,
        )  # fmt: skip
        shown.set_in_layout(False)
        half = np.array(shown.get_window_extent().size) / 2
        first, at = float(np.arctan2(towards[1], towards[0])), self._axes.transData.transform(place)
        found = []
        for far, turn in product(FARTHER, range(DIRECTIONS)):
            angle = first + (turn + 1) // 2 * (-1) ** turn * 2 * pi / DIRECTIONS
            away = np.array([np.cos(angle), np.sin(angle)])
            # As far as the name's own size in that direction, and a little farther.
            middle = NEAR * self._pixels * far * away + half * away
            box = Bbox([at + middle - half, at + middle + half])
            cost = self._hidden(box) + OF_DISTANCE * (far - 1 + turn / DIRECTIONS)
            found.append((cost, middle, box))
        _, middle, box = min(found, key=lambda one: one[0])
        shown.set_position(tuple(middle / self._pixels))
        self._taken.append(box.padded(APART * self._pixels))

    def _hidden(self, box: Bbox) -> float:
        """What a name in a box costs by what it hides, and where it leaves the axes."""
        within = Bbox.intersection(box, self._window)
        inside = 0.0 if within is None else within.width * within.height
        outside = 1 - inside / (box.width * box.height)
        on_lines = OF_LINE * box.count_contains(self._spots)
        return float(OUTSIDE * outside + box.count_overlaps(self._taken) + on_lines)

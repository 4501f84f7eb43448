"""An interactive player as HTML: data, style and program in one text that loads nothing.

The data are names and short lists as JSON, and long rows of numbers as base64, little-endian:
``f4`` and ``f8`` are 32 and 64 bits of a float, ``i4`` of an integer. `player/film.js` reads them.
Lengths in m, times in s, forces in N, torques of stops in N m.
"""

from __future__ import annotations

import base64
import json
from html import escape
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from exudyn_flexlink.animation.drawing import look_data
from exudyn_flexlink.animation.film import Film, Take, Touching, strength, touching_of
from exudyn_flexlink.animation.shots import SLOW_SECONDS, kept_instants, usual_speed
from exudyn_flexlink.animation.zooms import Zoom, zooms_of
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import Anchor, pair_sides
from exudyn_flexlink.observables import turns
from exudyn_flexlink.plots.outline import Line, through
from exudyn_flexlink.plots.panels import length_unit

GENERATOR = "exudyn-flexlink animation"
"""How a file says that this program wrote it."""

_PROGRAM = ("film", "drawing", "zoom", "guide", "timeline", "controls", "begin")
"""Files of the player's program, in order."""


def player(film: Film, speed: float | None = None) -> str:
    """Return the player of a film as a fragment of HTML, a ``<div>``.

    Several may stand on one page. Its style is bounded by its class, ``flexlink-player``; it is as
    wide as what it stands in, and as light or dark as the page. It loads nothing, and starts when
    the reader asks for it; at `speed`, s of the run in a second, by default one to see it well.
    """
    return _fragment(film, speed, at_once=False)


def page(film: Film, speed: float | None = None) -> str:
    """Return a whole page with the player of a film, which starts at once."""
    title = escape(film.takes[-1].result.scene.title)
    own = _fragment(film, speed, at_once=True)
    return _own_file("page.html").format(generator=GENERATOR, title=title, player=own)


def _fragment(film: Film, speed: float | None, *, at_once: bool) -> str:
    data = {**film_data(film, speed), "at_once": at_once}
    # A '<' within the data, such as that of '</script>', must not end it.
    text = json.dumps(data, ensure_ascii=False, separators=(",", ":")).replace("<", "\\u003c")
    return (
        '<div class="flexlink-player">\n'
        f"<style>\n{_own_file('player.css')}</style>\n"
        "<noscript>This animation needs JavaScript.</noscript>\n"
        f'<script type="application/json">{text}</script>\n'
        f"<script>\n{_program()}</script>\n"
        "</div>"
    )


def _program() -> str:
    """The player's program, which finds the data beside it and leaves no names on the page."""
    own = "\n".join(_own_file(f"{name}.js") for name in _PROGRAM)
    look = json.dumps(look_data())
    return f'(function () {{\n"use strict";\n\nconst LOOK = {look};\n\n{own}\n}})();\n'


def _own_file(name: str) -> str:
    return (files(__package__) / "player" / name).read_text(encoding="utf-8")


def film_data(film: Film, speed: float | None = None) -> dict[str, Any]:
    """Return what the player shows of a film, at first at `speed`, s of the run in a second."""
    low, high = film.box
    factor, unit = length_unit(film.size)
    beyond = film.horizon
    return {
        "title": film.takes[-1].result.scene.title,
        "box": [*low.tolist(), *high.tolist()],
        "begin": film.begin,
        "end": film.end,
        "speed": speed or usual_speed(film),
        "unit": {"factor": factor, "name": unit},
        "horizon": None if beyond is None else {"from": beyond[0], "words": beyond[1]},
        "doubts": film.doubts,
        "slow_seconds": SLOW_SECONDS,
        "slow": film.slow,
        "strikes": film.strikes,
        "takes": [_take(film, take) for take in film.takes],
    }


def row(values: ArrayLike, kind: str = "f4") -> dict[str, str]:
    """Return numbers, in the order of their memory, as text."""
    packed = np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()
    return {kind: base64.b64encode(packed).decode("ascii")}


def _take(film: Film, take: Take) -> dict[str, Any]:
    times, _ = kept_instants(film, take)
    crank = take.crank(times)
    lines = [
        {"kind": drawn.kind, "colour": drawn.colour, **_line(drawn.line)} for drawn in take.lines
    ]
    return {
        "name": take.name,
        "colour": take.colour,
        "parts": len(take.model.parts),
        "time": row(times, "f8"),
        "poses": row(take.poses(times)),
        "crank": None if crank is None else row(crank, "f8"),
        "turns": turns(take.result),
        "lines": lines,
        "marks": [{"kind": mark.kind, **_anchor(mark.anchor)} for mark in take.marks],
        "points": {name: _anchor(at) for name, at in take.named.items()},
        "touching": [_touching(take, own, times) for own in touching_of(film, take)],
        "zooms": [_zoom(zoom) for zoom in zooms_of(film, take)],
    }


def _line(line: Line) -> dict[str, Any]:
    """A line through points of one part has that part's number alone."""
    alike = len(set(line.parts.tolist())) == 1
    parts = int(line.parts[0]) if alike else row(line.parts, "i4")
    return {"name": line.name, "parts": parts, "places": row(line.places)}


def _anchor(anchor: Anchor) -> dict[str, Any]:
    return {"part": anchor.part, "x": anchor.x, "y": anchor.y}


def _touching(take: Take, own: Touching, times: FloatArray) -> dict[str, Any]:
    """Touches in columns; the forces that press at the kept instants, one after the other.

    ``first[i]`` to ``first[i + 1]`` are the places of those of instant i in ``pair`` and ``force``.
    """
    touches = own.touches
    force = own.forces(take, times)
    instant, pair = np.nonzero(force > 0)
    return {
        "name": own.name,
        "unit": own.unit,
        "begin": row(touches.begin, "f8"),
        "end": row(touches.until(float(take.result.time[-1])), "f8"),
        "strength": row(strength(touches)),
        "which": row(touches.pair, "i4"),
        "first": row(np.searchsorted(instant, np.arange(len(times) + 1)), "i4"),
        "pair": row(pair, "i4"),
        "force": row(force[instant, pair]),
        "places": None if own.places is None else _line(own.places),
        "spots": None if own.places is not None else row(own.spots(take, times)[:, 0]),
    }


def _zoom(zoom: Zoom) -> dict[str, Any]:
    """A zoom; of a guide also its walls, the link's nodes, and sides of the pairs."""
    channel = zoom.channel
    guide = None if channel is None else {
        "length": channel.length,
        "clearance": channel.clearance,
        "link": _line(through(channel.name, *channel.nodes)),
        "sides": list(pair_sides(channel)),
    }  # fmt: skip
    return {
        "name": zoom.name,
        "words": zoom.words,
        "view": {**_anchor(zoom.view.origin), "angle": zoom.view.angle},
        "along": list(zoom.along),
        "across": list(zoom.across),
        "guide": guide,
        "point": None if zoom.point is None else {"name": zoom.point_name, **_anchor(zoom.point)},
    }

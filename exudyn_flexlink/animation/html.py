"""An interactive player as HTML: data, style and program in one text that loads nothing."""

from __future__ import annotations

import json
from html import escape
from importlib.resources import files

from exudyn_flexlink.animation.data import film_data
from exudyn_flexlink.animation.film import Film
from exudyn_flexlink.animation.look import look_data

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

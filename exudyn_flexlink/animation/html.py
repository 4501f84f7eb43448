"""An interactive player as HTML: data, style and program in one text that loads nothing."""

from __future__ import annotations

import json
from html import escape
from importlib.resources import files

from exudyn_flexlink.animation.data import film_data
from exudyn_flexlink.animation.film import Film

GENERATOR = "exudyn-flexlink animation"
"""How a page says that this program wrote it."""

_PROGRAM = ("film.js", "drawing.js", "guide.js", "timeline.js", "controls.js", "begin.js")
"""Files of the player's program, in order."""

_PAGE = """\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="{generator}">
<meta name="color-scheme" content="light dark">
<title>{title}</title>
<style>
body {{ margin: 0 auto; padding: 0.75rem; max-width: 72rem; background: #fff; color: #222;
  font: 16px/1.4 system-ui, sans-serif; }}
h1 {{ margin: 0 0 0.5rem; font-size: 1.1rem; }}
@media (prefers-color-scheme: dark) {{ body {{ background: #14171c; color: #e4e7eb; }} }}
</style>
</head>
<body>
<h1>{title}</h1>
{player}
</body>
</html>
"""


def player(film: Film) -> str:
    """Return the player of a film as a fragment of HTML, a ``<div>``.

    Several may stand on one page. Its style is bounded by its class, ``flexlink-player``; it is as
    wide as what it stands in, and follows the reader's light or dark colours. It loads nothing, and
    starts when the reader asks for it.
    """
    return _fragment(film, at_once=False)


def page(film: Film) -> str:
    """Return a whole page with the player of a film, which starts at once."""
    title = escape(film.takes[-1].result.scene.title)
    own = _fragment(film, at_once=True)
    return _PAGE.format(generator=GENERATOR, title=title, player=own)


def is_page(content: bytes) -> bool:
    """Whether the content of a file is a page of this program."""
    return f'name="generator" content="{GENERATOR}"'.encode() in content[:1000]


def _fragment(film: Film, *, at_once: bool) -> str:
    data = {**film_data(film), "at_once": at_once}
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
    own = "\n".join(_own_file(name) for name in _PROGRAM)
    return f'(function () {{\n"use strict";\n\n{own}\n}})();\n'


def _own_file(name: str) -> str:
    return (files(__package__) / "player" / name).read_text(encoding="utf-8")

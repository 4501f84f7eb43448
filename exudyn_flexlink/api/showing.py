"""What a notebook shows of a run or a comparison: its words, and a small figure."""

from __future__ import annotations

from base64 import b64encode
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SMALL = 70  # dots per inch: a figure beside text, some tens of kilobytes
STYLE = "display:flex;flex-wrap:wrap;gap:1em;align-items:flex-start"


def page(title: str, text: str, figure: Figure | None) -> str:
    """Return HTML of a title, a text of fixed width and a small figure, if there is one."""
    picture = "" if figure is None else _image(figure)
    words = f"<pre>{escape(text)}</pre>"
    return f"<b>{escape(title)}</b><div style='{STYLE}'>{words}{picture}</div>"


def _image(figure: Figure) -> str:
    from exudyn_flexlink.plots import figure_bytes

    content = b64encode(figure_bytes(figure, "png", SMALL)).decode("ascii")
    return f'<img alt="" src="data:image/png;base64,{content}">'

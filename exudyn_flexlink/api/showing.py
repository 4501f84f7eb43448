"""What a notebook shows of a run or a comparison: its words, and a small figure."""

from __future__ import annotations

from base64 import b64encode
from html import escape
from io import BytesIO
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SMALL = 70  # dots per inch: a figure beside text, some tens of kilobytes
STYLE = "display:flex;flex-wrap:wrap;gap:1em;align-items:flex-start"


def page(title: str, text: str, figure: Figure | None) -> str:
    """Return HTML of a title, a text of fixed width and a small figure, if there is one."""
    picture = "" if figure is None else f'<img alt="" src="data:image/png;base64,{_png(figure)}">'
    words = f"<pre>{escape(text)}</pre>"
    return f"<b>{escape(title)}</b><div style='{STYLE}'>{words}{picture}</div>"


def _png(figure: Figure) -> str:
    written = BytesIO()
    figure.savefig(written, format="png", dpi=SMALL)
    return b64encode(written.getvalue()).decode("ascii")

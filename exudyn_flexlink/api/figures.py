"""The figures of a run as methods, by the names of `plots`, and what a notebook shows."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable
from functools import partial
from html import escape
from typing import TYPE_CHECKING, Any

from exudyn_flexlink.arguments import a, among, takes
from exudyn_flexlink.result import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from exudyn_flexlink.plots import Style

# Those of `plots.FIGURES`: what is asked for names alone needs no matplotlib.
NAMES = ("coordinates", "polar", "lever", "mechanism", "guide_contact", "energy", "forces")
SMALL = 70  # dots per inch: a figure beside text, some tens of kilobytes
FORM = "display:flex;flex-wrap:wrap;gap:1em;align-items:flex-start"

RESULT = a(Result, "simulate(..) and load(..) give one")
style = among(lambda _: ("screen", "print"), "style")  # those of `plots.STYLES`


class Plots:
    """Figures of one run: each a method that returns a matplotlib figure.

    A notebook shows it once, as the value of its cell; `savefig` writes it. ``style="print"`` is
    one column of a page wide and has no titles.
    """

    def __init__(self, result: Result) -> None:
        self._result = result

    def __dir__(self) -> list[str]:
        return [*NAMES, "all"]

    def __repr__(self) -> str:
        return f"<Plots: {', '.join(dir(self))}>"

    def __getattr__(self, name: str) -> Callable[..., Figure]:
        if name not in NAMES:
            raise AttributeError(f"no figure '{name}'; there are: {', '.join(NAMES)}")
        return partial(_drawn, self._result, name)

    @takes(style=style)
    def all(self, style: str = "screen") -> dict[str, Figure]:
        """Draw every figure that makes sense for this run, by name."""
        from exudyn_flexlink import plots

        return plots.figures(self._result, style_of(style))


@takes(style=style)
def _drawn(result: Result, name: str, *arguments: Any, style: str = "screen") -> Figure:
    """Draw one figure."""
    from exudyn_flexlink import plots

    draw: Any = plots.FIGURES[name]
    figure: Figure | None = draw(result, *arguments, style=style_of(style))
    if figure is None:
        raise ValueError(f"this run has nothing to show in the figure '{name}'")
    return figure


def style_of(name: str) -> Style:
    """Return a style of figures by its name."""
    from exudyn_flexlink import plots

    return plots.STYLES[name]


def page(title: str, text: str, figure: Figure | None) -> str:
    """Return HTML of a title, a text of fixed width and a small figure, if there is one."""
    picture = "" if figure is None else _image(figure)
    words = f"<pre>{escape(text)}</pre>"
    return f"<b>{escape(title)}</b><div style='{FORM}'>{words}{picture}</div>"


def _image(figure: Figure) -> str:
    from exudyn_flexlink.plots import figure_bytes

    content = b64encode(figure_bytes(figure, "png", SMALL)).decode("ascii")
    return f'<img alt="" src="data:image/png;base64,{content}">'

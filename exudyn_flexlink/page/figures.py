"""Figures of a run for a page: as text that an image takes for its file, and in words."""

from __future__ import annotations

import re
from base64 import b64encode
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure

from exudyn_flexlink.plots import PRINT, SCREEN, figure_bytes, figures
from exudyn_flexlink.result import Result

WIDE = replace(SCREEN, titled=False)  # the page says what stands in a title
NARROW = PRINT  # a column of print, 86 mm, is about as wide as a phone
PIXELS = 96  # of a page in an inch
MOST_SVG = 250_000  # bytes: beyond, lines are so many that pixels take less room
COORDINATES = re.compile(rb' (?:d|x|y)="[^"]*"')
DECIMALS = re.compile(rb"(\.\d\d)\d+")  # more than a hundredth of a point nobody sees


@dataclass(frozen=True)
class Picture:
    """A figure with its caption and what it shows in words.

    `wide` and `narrow` are data URIs; `size` is that of the wide one, in pixels of a page.
    """

    name: str
    caption: str
    alt: str
    wide: str
    narrow: str
    size: tuple[int, int]


def pictures_of(result: Result) -> dict[str, Picture]:
    """Return every figure that makes sense for a run, by name."""
    wide, narrow = figures(result, WIDE), figures(result, NARROW)
    return {
        name: Picture(
            name,
            str(figure.get_label()),
            described(figure),
            _uri(figure),
            _uri(narrow[name]),
            (round(PIXELS * figure.get_figwidth()), round(PIXELS * figure.get_figheight())),
        )
        for name, figure in wide.items()
    }


def _uri(figure: Figure) -> str:
    """Return a figure as a data URI: lines, which stay sharp, unless they take too much room."""
    svg = COORDINATES.sub(lambda own: DECIMALS.sub(rb"\1", own[0]), figure_bytes(figure, "svg"))
    if len(svg) <= MOST_SVG:
        return data_uri("image/svg+xml", svg)
    return data_uri("image/png", figure_bytes(figure, "png"))


def data_uri(kind: str, content: bytes) -> str:
    """Return the content of a file of a kind as what a page takes for its address."""
    return f"data:{kind};base64,{b64encode(content).decode('ascii')}"


def described(figure: Figure) -> str:
    """Return what a figure shows in words: its panels, how far their lines reach, its legends."""
    told = []
    for axes in (own for own in figure.axes if own.axison):
        scale = next(filter(None, (own.get_ylabel() for own in (axes, *axes.child_axes))), "")
        lines = [line for line in axes.lines if line.get_transform() == axes.transData]
        heights = np.concatenate([[np.nan], *(line.get_ydata() for line in lines)])
        if scale and not np.isnan(heights).all():
            scale += f" from {np.nanmin(heights):.4g} to {np.nanmax(heights):.4g}"
        told.append(f"{axes.get_title(loc='left')} {scale}")
    legends = [own for axes in figure.axes if (own := axes.get_legend())]
    names = [text.get_text() for own in (*legends, *figure.legends) for text in own.get_texts()]
    told += [f"shown are {', '.join(dict.fromkeys(names))}"] * bool(names)
    return "; ".join(" ".join(words.split()) for words in told if words.strip())

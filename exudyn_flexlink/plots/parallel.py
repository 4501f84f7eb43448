"""Parallel coordinates: an axis for every quantity, a line for every point."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.plots.panels import is_narrow, sized
from exudyn_flexlink.plots.style import BLACK, GREY
from exudyn_flexlink.plots.style import FAILED as RED
from exudyn_flexlink.sweeps import DOUBTFUL, FAILED

TICKS = 5
FEW = 200  # lines that can still be told apart
LETTERS = 9.0  # of a label, in an inch


def parallel_coordinates(
    figure: Figure,
    places: FloatArray,
    labels: Sequence[tuple[str, Sequence[str]]],
    varied: int,
    status: Sequence[str],
) -> None:
    """Draw places (rows, axes) as lines across axes of their own scales.

    `labels` are names, and words at the places 0, 1, .. of an axis that has them. The first
    `varied` axes are of what varied; the colour is that of the first behind them, or grey without a
    number there. Rows whose `status` is failed are drawn across those that varied, doubtful ones
    are dashed.
    """
    axes = figure.subplots()
    count = places.shape[1]
    # An axis without numbers is one of zeros.
    known = np.where(np.isfinite(places).any(axis=0), places, 0.0)
    low, high = np.nanmin(known, axis=0), np.nanmax(known, axis=0)
    scaled = (places - low) / np.where(high > low, high - low, 1.0)
    scaled[:, high == low] = 0.5
    colours = mpl.colormaps["viridis"]
    alpha = 0.8 if len(places) <= FEW else 0.25
    for row, how in zip(scaled, status, strict=True):
        if how == FAILED:
            axes.plot(range(varied), row[:varied], color=RED, linestyle=":", alpha=alpha)
            continue
        colour = colours(row[varied]) if np.isfinite(row[varied]) else GREY
        axes.plot(range(count), row, color=colour, alpha=alpha, linewidth=sized(1.0),
                  linestyle="--" if how == DOUBTFUL else "-")  # fmt: skip
    for k, (_, words) in enumerate(labels):
        axes.axvline(k, color=BLACK, linewidth=sized(0.8))
        for at, text in _ticks(low[k], high[k], words):
            axes.annotate(text, (k, at), (3, 0), textcoords="offset points", va="center",
                          fontsize=mpl.rcParams["xtick.labelsize"], color=GREY,
                          bbox={"color": "white", "alpha": 0.7, "pad": 0.5},
                          parse_math=False)  # fmt: skip
    names = [name for name, _ in labels]
    if is_narrow(figure):
        axes.tick_params("x", rotation=90)
    else:
        names = [_broken(name, figure.get_figwidth() / count) for name in names]
    axes.set_xticks(range(count), names, parse_math=False)
    axes.set_xlim(-0.1, count - 0.6)
    axes.set_yticks([])
    axes.grid(visible=False)
    axes.set_frame_on(False)


def _broken(name: str, room: float) -> str:
    """Break a name after dots and underscores, into lines of `room` (inches)."""
    words = name.replace(".", ". ").replace("_", "_ ").replace(" (", "  (")
    lines = fill(words, max(int(room * LETTERS), 8), break_long_words=False).split("\n")
    return "\n".join(line.replace("  ", "\0").replace(" ", "").replace("\0", " ") for line in lines)


def _ticks(low: float, high: float, words: Sequence[str]) -> list[tuple[float, str]]:
    """Heights (0 to 1) along an axis and what stands there."""
    if high == low:
        return [(0.5, words[0] if words else f"{low:.3g}")]
    if words:
        return [(k / (len(words) - 1), word) for k, word in enumerate(words)]
    parts = np.linspace(0, 1, TICKS).tolist()
    return [(part, f"{low + part * (high - low):.3g}") for part in parts]

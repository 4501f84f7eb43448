"""Laps of a run over each other, so that each is seen, and what of them lies beyond the horizon."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.observables import laps, turned_since_start
from exudyn_flexlink.plots.panels import BEYOND_LINE, horizon, sized
from exudyn_flexlink.result import Result

NESTED = 4  # laps, at most, that are drawn each thinner than the one before and named alone
STEP = 0.8  # line widths between two of them
BAND = 11.0  # points, of the shading along a line


@dataclass(frozen=True)
class Lap:
    """Samples of one lap: its number, crank angle turned since it began (rad), their indices."""

    number: int
    turned: FloatArray
    samples: IndexArray


def by_lap(result: Result) -> Iterator[Lap]:
    """Split a run into laps; each but the last goes on to the first sample of the next."""
    turned, lap = turned_since_start(result), laps(result)
    for number in range(1, int(lap.max()) + 1):
        samples = np.flatnonzero(lap == number)
        if not len(samples):
            continue
        if samples[-1] + 1 < len(lap):
            samples = np.append(samples, samples[-1] + 1)
        yield Lap(number, turned[samples] - 2 * np.pi * (number - 1), samples)


def lap_style(number: int, cycle: int, last: int, colours: Sequence[str]) -> dict[str, Any]:
    """How a lap of `last` is drawn: laps on one curve share a colour.

    A few laps are nested, each broader and paler than those after it, so that all are seen where
    they lie on each other. Of many, those of the first `cycle` are, and later ones are thin lines.
    """
    rank = last - number
    if last > NESTED:
        rank = 1 + cycle - number if number <= cycle else 0
    rank = min(rank, NESTED)
    return {
        "color": colours[(number - 1) % cycle % len(colours)],
        "linewidth": float(mpl.rcParams["lines.linewidth"]) * (0.7 + STEP * rank),
        "alpha": 0.45 if rank else 1.0,
        "zorder": 3 - rank / 9,
    }


def lap_label(number: int, cycle: int, last: int) -> str:
    """Legend entry of a lap; of many laps those alike have one together."""
    if last <= NESTED or number <= cycle:
        return f"lap {number}"
    alike = list(range(number, last + 1, cycle))
    if number > 2 * cycle:
        return ""
    return f"laps {alike[0]} to {alike[-1]}" if len(alike) > 1 else f"lap {number}"


def shade_laps(
    axes: Axes, result: Result, x: Sequence[FloatArray], every: Sequence[Lap], series: FloatArray
) -> None:
    """Shade, along the lines of laps, what lies beyond the horizon.

    `x` holds the places of each lap's samples, `series` (N, k) the values of the whole run.
    """
    found = horizon(result)
    if found is None:
        return
    begin, label = found
    for place, lap in zip(x, every, strict=True):
        beyond = result.time[lap.samples] >= begin
        for values in series[lap.samples].T if beyond.any() else ():
            axes.plot(place[beyond], values[beyond], label=label or None, linewidth=sized(BAND),
                      **BEYOND_LINE)  # fmt: skip
            label = ""

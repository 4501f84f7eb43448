"""Figures of linear equations: modes of a mechanism, and its response to a force."""

from __future__ import annotations

from math import ceil

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from exudyn_flexlink.linear import LinearModel, Response, motion_text
from exudyn_flexlink.plots.frame import (
    BLUE,
    RED,
    SCREEN,
    Style,
    framed_figure,
    settle,
    styled,
)
from exudyn_flexlink.plots.outline import Sketch
from exudyn_flexlink.plots.panels import letter
from exudyn_flexlink.rounding import NEGLIGIBLE

SHOWN_MODES, COLUMNS = 6, 3
PHASES = np.array([0.0, np.pi / 2, np.pi, 3 * np.pi / 2])  # rad: phases of a mode in a figure
SIZE = 0.12  # of the mechanism: largest displacement of a mode in the figure
PALE = 0.3
BESIDE, ABOVE = 0.7, 0.9  # inches: room beside the axes of a panel; above and below them
AHEAD = 1.0  # deg: a smaller phase lead is rounding; a larger one is a lag, by the rest of 360 deg


@styled
def modes(model: LinearModel, *, style: Style = SCREEN) -> Figure:
    """Draw the slowest modes, each in a panel: the mechanism in its state; its amplitudes, pale."""
    shown = model.modes[:SHOWN_MODES]
    q = model.assembly.state.q
    low, high = Sketch(model.scene, q[None]).box
    size = SIZE * float(np.max(high - low))
    turns = np.exp(1j * PHASES)[:, None, None]
    moved = [q + size * (turns * mode.poses).real for mode in shown]
    box = Sketch(model.scene, np.concatenate(moved)).box
    columns = 1 if style.narrow else min(COLUMNS, len(shown))
    rows = ceil(len(shown) / columns)
    width, height = box[1] - box[0]
    about = "its rest" if model.time is None else f"t = {model.time:.4g} s"
    subject = f"Modes about {about}; damping in % of the critical one"
    panel = (style.width / columns - BESIDE) * height / width + ABOVE
    figure = framed_figure((model.scene.title, subject), rows * panel / style.scale, style)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, mode, poses in zip(panels, shown, moved, strict=False):
        sketch = Sketch(model.scene, np.concatenate([q[None], poses]))
        for k in range(len(sketch.poses)):
            sketch.draw(axes, k, alpha=PALE if k else 1.0)
        sketch.window(axes, box)
        axes.set_title(motion_text(mode.eigenvalue, short=True))
        axes.set_xlabel(f"x ({sketch.unit[1]})")
    for axes in panels[::columns]:
        axes.set_ylabel(f"y ({sketch.unit[1]})")
    for axes in panels[len(shown) :]:
        axes.set_visible(False)
    letter(panels[: len(shown)])
    settle(figure)
    return figure


@styled
def response(answer: Response, *, style: Style = SCREEN) -> Figure:
    """Draw gain and phase of both coordinates over frequency (a Bode plot)."""
    subject = f"{answer.at} for 1 N along {answer.along} at {answer.force}"
    figure = framed_figure((subject, "gain and phase over frequency"), 5.0, style)
    gain, phase = figure.subplots(2, 1, sharex=True)
    largest = max(float(np.abs(moved).max()) for moved in (answer.x, answer.y))
    for name, moved, colour in (("x", answer.x, BLUE), ("y", answer.y, RED)):
        if np.abs(moved).max() > NEGLIGIBLE * largest:
            gain.loglog(answer.frequency, np.abs(moved), color=colour, label=name)
            lag = (AHEAD - np.degrees(np.angle(moved))) % 360 - AHEAD
            phase.semilogx(answer.frequency, -lag, color=colour)
    gain.set_ylabel("gain (m/N)")
    gain.legend(loc="best")
    phase.yaxis.set_major_locator(MultipleLocator(90))
    phase.set_ylabel("phase (deg)")
    phase.set_xlabel("frequency (Hz)")
    letter([gain, phase])
    return figure

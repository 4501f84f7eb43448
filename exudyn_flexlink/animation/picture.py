"""The frames of a film as pixels: what stands still is drawn once, the rest at each frame."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from exudyn_flexlink.animation.drawing import (
    INK,
    PALE,
    POINTS,
    Place,
    draw_glows,
    draw_mechanism,
    draw_points,
    draw_trail,
    thickness,
)
from exudyn_flexlink.animation.film import Film
from exudyn_flexlink.animation.shots import Frames, Shots
from exudyn_flexlink.animation.zoom_panel import ZoomPanel, draw_instant, draw_timeline
from exudyn_flexlink.observables import turns
from exudyn_flexlink.plots.frame import wrapped
from exudyn_flexlink.plots.panels import length_unit
from exudyn_flexlink.plots.style import FAILED, settings

Pixels = NDArray[np.uint8]

DOTS = 100  # pixels in an inch
HEAD, ZOOM, LINE = 30.0, 112.0, 26.0  # pixels: heights of the words, of a zoom, of the line
_FONT: dict[Any, Any] = {"font.family": "sans-serif", "text.usetex": False}
SCALE = 0.16  # of the width: the length that sizes are read by is no longer


class Picture:
    """A picture `width` pixels wide of a film, at its frames; both sides are even."""

    def __init__(self, film: Film, frames: Frames, width: int) -> None:
        self._film, self._frames = film, frames
        self._shots = [Shots(film, take, frames) for take in film.takes]
        self._thick = thickness(width)
        names = list(dict.fromkeys(name for shots in self._shots for name in shots.zooms))
        low, high = film.box
        main = width * min(1.0, float((high - low)[1] / (high - low)[0]))
        heights = [h * self._thick for h in (HEAD, LINE, *[ZOOM] * len(names))]
        self.width, self.height = 2 * (width // 2), 2 * round((main + sum(heights)) / 2)
        self._figure = Figure((self.width / DOTS, self.height / DOTS), DOTS, facecolor="white")
        self._canvas = FigureCanvasAgg(self._figure)
        head, line, *zooms = heights
        bottom = line + sum(zooms)
        with settings(_FONT):
            self.axes = self._room(bottom, self.height - bottom - head)
            self._words(head)
            self._fit()
            both = len(self._shots) > 1
            self._places = [
                Place(self.axes, self._thick, i if both else -1) for i in range(len(self._shots))
            ]
            for place, shots in zip(self._places, self._shots, strict=True):
                look: dict[str, Any] = {"color": PALE, "linewidth": place.points(0.9)}
                self.axes.plot(*shots.path[1].T, **look, alpha=0.35)
            self._zooms = []
            for i, name in enumerate(names):
                place = Place(self._room(line + sum(zooms[i + 1 :]), zooms[i]), self._thick)
                self._zooms.append(ZoomPanel(place, self._shots, name, self._scale))
            self._line = Place(self._room(0, line), self._thick)
            draw_timeline(self._line, self._shots)
            self._canvas.draw()  # type: ignore[no-untyped-call]
            self._still = self._canvas.copy_from_bbox(self._figure.bbox)  # type: ignore[no-untyped-call]
        self._known = {artist for axes in self._figure.axes for artist in axes.get_children()}

    def __len__(self) -> int:
        return len(self._frames.times)

    def frame(self, frame: int) -> Pixels:
        """One frame, (height, width, 4): red, green, blue and 255, as canvas and ffmpeg know it."""
        with settings(_FONT):
            self._canvas.restore_region(self._still)  # type: ignore[no-untyped-call]
            self._told.set_text(self._text(frame))
            self._figure.draw_artist(self._told)
            self._draw(frame)
            for axes in self._figure.axes:
                for artist in axes.get_children():
                    if artist not in self._known:
                        self._figure.draw_artist(artist)
                        artist.remove()
        return np.array(self._canvas.buffer_rgba())  # type: ignore[no-untyped-call]

    def _draw(self, frame: int) -> None:
        """Draw what moves; what is in front last."""
        runs = list(zip(self._places, self._shots, strict=True))
        for place, shots in runs:
            draw_trail(place, shots, frame)
        for place, shots in runs:
            draw_mechanism(place, shots, frame)
        for place, shots in runs:
            draw_glows(place, shots, frame)
        draw_points(*runs[0], self._film.size, frame)
        for zoom in self._zooms:
            zoom.draw(frame)
        draw_instant(self._line, float(self._frames.times[frame]))

    def _room(self, bottom: float, height: float) -> Axes:
        """Axes as wide as the picture, by places in pixels."""
        axes = self._figure.add_axes((0, bottom / self.height, 1, height / self.height))
        axes.set_axis_off()
        axes.set_autoscale_on(False)
        return axes

    def _fit(self) -> None:
        """Show the film's box in the middle, and a length to read sizes by."""
        low, high = self._film.box
        room = self.axes.get_window_extent()
        scale = min(room.width / (high - low)[0], room.height / (high - low)[1])
        self._scale = scale  # pixels per m
        half = np.array([room.width, room.height]) / scale / 2
        middle = (low + high) / 2
        self.axes.set_xlim(*(middle[0] + np.array([-1, 1]) * half[0]))
        self.axes.set_ylim(*(middle[1] + np.array([-1, 1]) * half[1]))
        wanted = SCALE * 2 * half[0]
        power = 10.0 ** np.floor(np.log10(wanted))
        length = next(step * power for step in (5, 2, 1) if step * power <= wanted)
        pixel = 1 / scale
        left, bottom = middle - half + 12 * self._thick * pixel
        tick = 4 * self._thick * pixel
        corners = [(left, tick), (left, 0), (left + length, 0), (left + length, tick)]
        x, y = np.array(corners).T
        thin = POINTS * self._thick
        self.axes.plot(x, bottom + y, color=PALE, linewidth=1.2 * thin)
        factor, unit = length_unit(self._film.size)
        self.axes.text(
            left + length / 2, bottom + 1.2 * tick, f"{factor * length:.3g} {unit}", ha="center",
            va="bottom", fontsize=11 * thin, color=PALE,
        )  # fmt: skip
        lines = wrapped(self._film.doubts, (1 - 2 * SCALE) * self.width / DOTS, 11 * thin)
        self.axes.text(
            2 * middle[0] - left, bottom, "\n".join(lines), ha="right", va="bottom",
            fontsize=11 * thin, color=FAILED, parse_math=False,
        )  # fmt: skip

    def _words(self, head: float) -> None:
        """The line of words at the top; of two runs also their names."""
        size, place = 13 * POINTS * self._thick, 1 - 0.5 * head / self.height
        x = 12 * self._thick / self.width
        self._told = self._figure.text(x, place, "", va="center", fontsize=size, color=INK)
        self._told.set_animated(True)
        takes = self._film.takes if len(self._film.takes) > 1 else ()
        right = 1 - x
        for take in reversed(takes):
            name = self._figure.text(
                right, place, take.name, ha="right", va="center", fontsize=size, weight="bold",
                color=take.colour, parse_math=False,
            )  # fmt: skip
            extent = name.get_window_extent()
            right -= (extent.width + 14 * self._thick) / self.width

    def _text(self, frame: int) -> str:
        """Time and crank angle of a frame, and how fast it plays."""
        at, speed = self._frames.times[frame], self._frames.speeds[frame]
        digits = min(max(int(np.ceil(-np.log10(speed / 25))), 0), 9)
        told = [f"t = {at:.{digits}f} s"]
        crank = self._shots[0].crank
        if crank is not None:
            degrees = float(np.degrees(crank[frame]))
            whole = turns(self._shots[0].take.result)
            told.append(f"crank {degrees:.0f}°" if whole else f"angle {degrees:.1f}°")
        slow = "slow motion, " if speed < self._frames.speed else ""
        told.append(f"{slow}{speed:.2g} \N{MULTIPLICATION SIGN} real time")
        return "   ".join(told).replace("-", "\N{MINUS SIGN}")

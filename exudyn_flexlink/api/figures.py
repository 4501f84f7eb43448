"""The figures of a run as methods, by the names of `plots`, and what a notebook shows.

A run as tables of pandas, and as a dataset of xarray.

A run that moves, as a notebook shows it and as a file.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from html import escape
from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn

import numpy as np

from exudyn_flexlink.arguments import among, excerpt, instance_of, instants, takes
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables import bent_links, point_names, struck_bodies
from exudyn_flexlink.result import Result
from exudyn_flexlink.shipped import FIGURE_NAMES, FIGURE_STYLES
from exudyn_flexlink.source import unknown
from exudyn_flexlink.storage import (
    all_columns,
    arrays_of,
    attributes_of,
    bending_columns,
    lever_columns,
    touch_columns,
    trajectory_columns,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame
    from xarray import Dataset

    from exudyn_flexlink.animation import Film, Filming
    from exudyn_flexlink.plots import Given, Style


def data_frame(result: Result, name: str | None, time: FloatArray | None = None) -> DataFrame:
    """Return what is known of a point, struck body, link, contact or joint as a table; or all.

    Rows are at instants `time` (M,) s, or at the samples; touches stay one a row.
    """
    frame: DataFrame = needed("pandas").DataFrame(_columns(result, name, time))
    return frame


def _columns(result: Result, name: str | None, time: FloatArray | None) -> Mapping[str, FloatArray]:
    struck = struck_bodies(result.scene)
    if name is None:
        return all_columns(result, time)
    if name in struck:
        return lever_columns(result, struck[name], time)
    if name in bent_links(result.scene):
        return bending_columns(result, name, time)
    if name in result.intervals:
        return touch_columns(result, name)
    return trajectory_columns(result, name, time)


def table_names(result: Result) -> list[str]:
    """Names of what a table can tell of: bodies struck or bent, what touches, and points."""
    scene = result.scene
    return [*struck_bodies(scene), *bent_links(scene), *result.intervals, *point_names(scene)]


def data_set(result: Result) -> Dataset:
    """Return all arrays as one dataset, with the names, dimensions and units of the saved file."""
    arrays = {
        name: (array.dimensions, array.values, dict(array.attributes))
        for name, array in arrays_of(result).items()
    }
    arrays_set: Dataset = needed("xarray").Dataset(arrays, attrs=attributes_of(result))
    return arrays_set


def needed(package: str) -> Any:
    """Import an optional package.

    Raises:
        ImportError: it is not installed; the message says how it is.

    """
    try:
        return import_module(package)
    except ImportError as error:
        raise ImportError(
            f"this needs {package}: pip install {package}, or pip install 'exudyn-flexlink[tables]'"
        ) from error


SMALL = 70  # dots per inch: a figure beside text, some tens of kilobytes
FORM = "display:flex;flex-wrap:wrap;gap:1em;align-items:flex-start"

RESULT = instance_of(Result, "simulate(..) and load(..) give one")
style = among(lambda _: FIGURE_STYLES, "style")

POINT = among(lambda shown: point_names(shown._result.scene), "point")


def _axes(value: Any, _: Any = None) -> Any:
    """Take axes of matplotlib, or an array of them."""
    from exudyn_flexlink.plots import listed

    return listed(value)


def _instants(value: Any, plots: Any) -> FloatArray:
    """Take instants of the run."""
    times = np.atleast_1d(instants(value))
    end = float(plots._result.time[-1])
    if not len(times) or not np.all((times >= 0) & (times <= end)):
        raise ValueError(f"expected instants from 0 to {end:.9g} s, got {excerpt(value)}")
    return times


class Plots:
    """Figures of one run: each a method that returns a matplotlib figure.

    A notebook shows it once, as the value of its cell; `savefig` writes it. ``style="print"`` is
    one column of a page wide and has no titles.

    `ax` are axes of one's own to draw into: one for the first panel of the figure, or an array for
    all of its panels. `label` names the run in the legend where there are curves. A second run
    in the same axes is dashed::

        figure, axes = plt.subplots()
        rigid.plot.lever(ax=axes, label="rigid")
        flexible.plot.lever(ax=axes, label="flexible")

    All raise ValueError where the run has nothing to show in the figure, there is no such style, or
    there are not as many axes as panels.
    """

    def __init__(self, result: Result) -> None:
        self._result = result

    def __dir__(self) -> list[str]:
        return [*FIGURE_NAMES, "all"]

    def __repr__(self) -> str:
        return f"<Plots: {', '.join(dir(self))}>"

    def __getattr__(self, name: str) -> NoReturn:
        raise AttributeError(unknown("figure", name, [*FIGURE_NAMES, "all"]))

    @takes(point=POINT)
    def coordinates(
        self,
        point: str | None = None,
        *,
        style: str = "screen",
        ax: Given = None,
        label: str | None = None,
    ) -> Figure:
        """Draw x and y of a point, the watched one if left out, lap by lap or over time.

        Panels: the coordinates, and the states of each joint with clearance below.
        """
        return self._drawn("coordinates", point, style=style, ax=ax, label=label)

    def polar(self, *, style: str = "screen", ax: Given = None, label: str | None = None) -> Figure:
        """Draw the watched point's distance from O over the crank angle; `ax` is polar."""
        return self._drawn("polar", style=style, ax=ax, label=label)

    def lever(self, *, style: str = "screen", ax: Given = None, label: str | None = None) -> Figure:
        """Draw the angle or displacement of struck bodies.

        Panels of each: the whole run, and its strikes over each other if there are any.
        """
        return self._drawn("lever", style=style, ax=ax, label=label)

    @takes(instants=_instants)
    def mechanism(
        self, instants: Sequence[float] | None = None, *, style: str = "screen", ax: Given = None
    ) -> Figure:
        """Draw the mechanism at `instants` (s), a panel each, or at those of note.

        Left out, the last panel is the first strike, larger, if it lasts.
        """
        return self._drawn("mechanism", instants, style=style, ax=ax)

    def guide_contact(self, *, style: str = "screen", ax: Given = None) -> Figure:
        """Draw the link in its guide, a panel for each way in which it touches the walls."""
        return self._drawn("guide_contact", style=style, ax=ax)

    def energy(
        self, *, style: str = "screen", ax: Given = None, label: str | None = None
    ) -> Figure:
        """Draw the energies, and in a second panel what their balance misses."""
        return self._drawn("energy", style=style, ax=ax, label=label)

    def forces(
        self, *, style: str = "screen", ax: Given = None, label: str | None = None
    ) -> Figure:
        """Draw forces and torques with their errors.

        Panels: one for each quantity, and the first strikes, larger, if there are any.
        """
        return self._drawn("forces", style=style, ax=ax, label=label)

    def bending(self, *, style: str = "screen", ax: Given = None) -> Figure:
        """Draw the bending moment along flexible links over time, its largest marked.

        Panels: one for each link.
        """
        return self._drawn("bending", style=style, ax=ax)

    @takes(style=style)
    def all(self, style: str = "screen") -> dict[str, Figure]:
        """Draw every figure that makes sense for this run, by name."""
        from exudyn_flexlink import plots

        return plots.figures(self._result, style_of(style))

    @takes(style=style, ax=_axes)
    def _drawn(
        self,
        name: str,
        *arguments: Any,
        style: str,
        ax: Any = None,
        label: str | None = None,
    ) -> Figure:
        from exudyn_flexlink import plots

        if ax is None and label is not None:
            raise ValueError("'label' names the run in the axes that 'ax' gives: give both")
        draw: Any = plots.FIGURES[name]
        with plots.labelled_run(self._result, ax or [], label):
            figure: Figure | None = draw(self._result, *arguments, style=style_of(style), ax=ax)
            if figure is None:
                raise ValueError(f"this run has nothing to show in the figure '{name}'")
        return figure


class Shown:
    """Adds a figure, a text and what a notebook shows to what was found of runs."""

    _figure: ClassVar[str]
    _text: ClassVar[Callable[[Any], str]]

    @takes(style=style)
    def plot(self, style: str = "screen") -> Figure:
        """Draw it.

        Raises:
            ValueError: there is nothing to draw, or no such style.

        """
        from exudyn_flexlink import plots

        figure: Figure | None = getattr(plots, self._figure)(self, style=style_of(style))
        if figure is None:
            raise ValueError("there is no more than one instant to draw")
        return figure

    def summary(self) -> str:
        """Return what the command line tells."""
        return type(self)._text(self)

    def _repr_html_(self) -> str:
        with suppress(ValueError):
            return page(repr(self)[1:-1], self.summary(), self.plot())
        return page(repr(self)[1:-1], self.summary(), None)


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


HEIGHT = "min(90vh, 46rem)"  # of the frame in a notebook


@dataclass(frozen=True, repr=False)
class Animation:
    """A run, or two over each other, from one instant to another.

    A notebook shows it as a player; `save` writes it, `html` is for a page of one's own.
    """

    film: Film
    filming: Filming

    @takes()
    def save(
        self,
        path: str | PathLike[str],
        *,
        force: bool = False,
        progress: Callable[[float], None] | None = None,
    ) -> Path:
        """Write it, whole or not at all, as its name ends: ``.html``, ``.gif`` or ``.mp4``.

        An animation that stands there is replaced; other files are not, unless `force` says so.
        `progress` is called with the part of a GIF or a video that is done, 0 to 1.

        Raises:
            FilmError: there is no such format, or it can't hold this; a video needs ffmpeg.
            StorageError: the file can't be written, or may not be replaced.

        """
        from exudyn_flexlink.animation import film_bytes, is_animation
        from exudyn_flexlink.storage import replace_file

        file = Path(path)
        content = film_bytes(self.film, file.suffix[1:].lower(), self.filming, progress)
        replace_file(file, content, is_animation, force=force)
        if progress is not None:
            progress(1.0)
        return file

    def html(self) -> str:
        """Return the player as a fragment of HTML, a ``<div>`` that loads nothing."""
        from exudyn_flexlink.animation import player

        return player(self.film, self.filming.speed)

    def __repr__(self) -> str:
        """Return one line: of what, from when to when."""
        film = self.film
        of = " and ".join(f"'{take.result.scene.title}' by {take.name}" for take in film.takes)
        return f"<Animation of {of}: {film.begin:g} s to {film.end:g} s>"

    def _repr_html_(self) -> str:
        """A page in a frame: the style and the names of a notebook can't disturb it."""
        from exudyn_flexlink.animation import page

        source = escape(page(self.film, self.filming.speed), quote=True)
        return f'<iframe srcdoc="{source}" style="width:100%;height:{HEIGHT};border:0"></iframe>'

"""Figures fit to print: formats, a column's width, and nothing hidden, unnamed or overstated."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import results
from matplotlib.figure import Figure
from results import texts, words

from exudyn_flexlink.cli import main
from exudyn_flexlink.plots import (
    PRINT,
    SCREEN,
    STYLES,
    coordinates,
    figures,
    lever,
    polar,
    save_figure,
)
from exudyn_flexlink.plots.motion import X_COLOURS, Y_COLOURS
from exudyn_flexlink.plots.panels import BEYOND, number_text
from exudyn_flexlink.result import MeasuredError
from exudyn_flexlink.shipped import FIGURE_FORMATS, FIGURE_STYLES
from exudyn_flexlink.storage import save

MILLIMETRES = 25.4  # in an inch
STARTS = {"png": b"\x89PNG", "pdf": b"%PDF", "svg": b"<?xml"}


@pytest.fixture(scope="module")
def parting(rigid):
    """A run that parts from another one in its third lap."""
    error = MeasuredError(("link.end",), limit=1e-6, largest=2e-3, exceeds_from=1.5, horizon=1.5)
    return replace(rigid, error=error)


# --- formats


def test_figures_of_one_run_are_the_same_files_in_all_formats(rigid):
    """No date and no random names in them: a repository sees no change where there is none."""
    assert tuple(STYLES) == FIGURE_STYLES
    written = []
    for folder in (Path("a"), Path("b")):
        folder.mkdir()
        files = save_figure(polar(rigid), folder, "polar", FIGURE_FORMATS)
        assert [file.name for file in files] == [f"polar.{suffix}" for suffix in FIGURE_FORMATS]
        written.append([file.read_bytes() for file in files])
    assert written[0] == written[1]
    for suffix, content in zip(FIGURE_FORMATS, written[0], strict=True):
        assert content.startswith(STARTS[suffix])


def test_plot_writes_what_is_asked_for(rigid, monkeypatch):
    def two(_, style):
        assert style is PRINT
        return {name: Figure((1, 1)) for name in ("forces", "polar")}

    monkeypatch.setattr("exudyn_flexlink.plots.figures", two)
    save(rigid, Path("run"))
    asked = ["--out", "figures", "--format", "pdf,svg", "--style", "print"]
    assert main(["plot", "run", *asked]) == 0
    names = {file.name for file in Path("figures").iterdir()}
    assert {"forces.pdf", "forces.svg", "polar.pdf"} <= names
    assert not list(Path("figures").glob("*.png"))


# --- all figures, in both styles


RUNS = {
    "the paper's, parting": lambda parting: parting,
    "with clearance": lambda _: results.tilting_link(),
    "pendulum": lambda _: results.pendulum(),
    "without crank": lambda _: results.slider(),
}


@pytest.mark.parametrize("style", [SCREEN, PRINT])
@pytest.mark.parametrize("make", RUNS.values(), ids=RUNS)
def test_nothing_is_cut_off_and_legends_cover_no_data(make, style, parting):
    """In print a figure is a column wide, with large letters and without title, too."""
    run = make(parting)
    for name, figure in figures(run, style).items():
        said = words(figure)
        if run is parting:
            assert "beyond the horizon:\ntwo runs part" in said, name
            shaded = figure.findobj(lambda artist: artist.get_alpha() == BEYOND["alpha"])
            assert any(str(one.get_label()).startswith("beyond") for one in shaded), name
        if style is PRINT:
            assert figure.get_figwidth() * MILLIMETRES == pytest.approx(86), name
            assert run.scene.title not in said.replace("\n", " ")
            assert "engine:" not in said
            assert min(text.get_fontsize() for text in texts(figure)) >= 7
        figure.draw_without_rendering()
        seen, slack = figure.get_tightbbox(), 0.02  # inches
        assert np.all(seen.min > -slack), name
        assert np.all(seen.max < figure.get_size_inches() + slack), name
        boxes = [axes.get_legend().get_window_extent() for axes in figure.axes if axes.get_legend()]
        for axes in (axes for axes in figure.axes if axes.axison and axes.has_data()):
            shared = axes.get_window_extent().padded(-2)
            assert not any(shared.overlaps(box.padded(-2)) for box in boxes), name


# --- what is seen


def test_no_lap_is_hidden_by_another(rigid):
    """Where laps lie on each other, each is broader than those drawn over it."""
    for figure, count in ((coordinates(rigid), 4), (polar(rigid), 2)):
        (axes, *_) = figure.axes
        for colours in (X_COLOURS, Y_COLOURS)[: count // 2]:
            curves = [line for line in axes.lines if len(line.get_xdata()) > 100]
            laps = [line for line in curves if line.get_color() in colours]
            drawn = sorted(laps, key=lambda line: line.get_zorder())
            assert len(drawn) == 4
            widths = [line.get_linewidth() for line in drawn]
            assert all(below > over for below, over in pairwise(widths))
        entries = [text.get_text() for text in axes.get_legend().get_texts()]
        assert len([entry for entry in entries if "laps" in entry]) == count  # one for a colour


# --- what is known


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (0.163012345, 3e-5, "0.1630"),
        (0.163012345, 1e-9, "0.1630"),
        (-0.163012345, 0.09, "\N{MINUS SIGN}0.2"),
        (4.8682, 2.6, "5"),
        (0.163012345, None, "0.163"),
        (0.0, 1e-6, "0"),
        (-1e-9, 1e-3, "0.000"),
    ],
)
def test_no_more_digits_than_are_known(value, error, text):
    assert number_text(value, error) == text


def test_a_peak_of_which_no_digit_is_known_is_not_told(rigid):
    """The lever's tip moves by 5 mm, at 30 mm from its pivot."""
    for largest, count in ((2e-3, 2), (2e-2, 0)):
        error = MeasuredError(("link.end",), limit=1e-6, largest=largest, exceeds_from=0.1)
        assert len(lever(replace(rigid, error=error)).axes[0].texts) == count

"""Odd, but sound, results are drawn: no traceback, no warning of a library, nothing cut off."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import results
from results import words

from exudyn_flexlink import storage
from exudyn_flexlink.cli import main
from exudyn_flexlink.plots import energy, figures


@pytest.fixture(scope="module")
def rigid():
    return results.rigid_link(samples=101)


def plotted(result, capsys):
    """Save a run, and plot it: nothing is said but where figures are."""
    storage.save(result, Path("run"))
    code = main(["plot", "run", "--out", "figures"])
    said = capsys.readouterr()
    assert said.err == ""
    assert code == 0
    assert len(list(Path("figures").glob("*.png"))) >= 4


TITLES = {
    "one long word": "x" * 3000,
    "many words": "word " * 3000,
    "the widest letters": "W" * 88,
    "no formula": r"costs $5, and $\\foo{$ 6",
    "letters without a font": "\u6a5f\u69cb" * 60,
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("title", ["no formula", "letters without a font"])
def test_any_title_is_drawn(title, rigid, capsys):
    plotted(results.retitled(rigid, TITLES[title]), capsys)


@pytest.mark.parametrize("title", TITLES)
@pytest.mark.filterwarnings("ignore:Glyph")
def test_a_title_is_wrapped_into_the_figure(title, rigid):
    figure = energy(results.retitled(rigid, TITLES[title]))
    assert figure.get_figheight() < energy(rigid).get_figheight() + 1
    figure.draw_without_rendering()
    width = figure.get_figwidth() * figure.dpi
    for text in figure.texts:
        assert text.get_window_extent().x1 <= width


@pytest.mark.filterwarnings("error")
def test_what_does_not_move_is_drawn(rigid, capsys):
    plotted(replace(rigid, poses=0 * rigid.poses, rates=0 * rigid.rates), capsys)


def test_a_mistake_in_a_figure_is_no_traceback(rigid, capsys, monkeypatch):
    def draw(*_):
        raise TypeError("of the program")

    monkeypatch.setattr("exudyn_flexlink.plots.save_figures", draw)
    storage.save(rigid, Path("run"))
    assert main(["plot", "run"]) == 1
    said = capsys.readouterr().err
    assert said.startswith("no figures: TypeError: of the program")


def test_a_crank_that_goes_back_is_drawn_over_time(rigid):
    """Over its angle, one part of a line would lie on another."""
    poses = rigid.poses.copy()
    turn = np.sin(np.linspace(0, 20, len(rigid.time)))
    poses[:, 0, 2] = 8 * turn
    drawn = figures(replace(rigid, poses=poses))
    for name in ("coordinates", "forces"):
        assert "time (s)" in words(drawn[name]).splitlines(), name

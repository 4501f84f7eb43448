"""The paper's figures: each panel is a file of its own, on the scales of those side by side."""

from dataclasses import replace

import numpy as np
import pytest
import results
from paper_figures import FIGURES, Case, save_all

from exudyn_flexlink.cli.figures import Look
from exudyn_flexlink.observables import lever_response

PANELS = {f"paper_fig{number}{letter}" for number in (3, 4, 5) for letter in "ab"}


@pytest.fixture(scope="module")
def cases():
    """The second goes twice as far, and its lever turns three times as much."""
    run = results.rigid_link(samples=401)
    lever = lever_response(run, "strike")
    end = results.exact_s(run.scene, run.time)
    apart, unsure = (np.full(len(end), away) for away in (1e-6, 1e-9))
    first = Case("a", "near", run, run.time, end, apart, unsure, lever)
    far = replace(run, poses=2 * run.poses)
    wide = replace(lever, value=3 * lever.value)
    return [first, replace(first, letter="b", name="far", result=far, lever=wide)]


@pytest.mark.parametrize("name", FIGURES)
def test_a_panel_of_its_own_is_that_of_both_side_by_side(cases, name):
    drawing = FIGURES[name]
    both = drawing.figure(cases, every=cases)
    rows = len(drawing.labels)
    for column, seen in enumerate(cases):
        alone = drawing.figure([seen], every=cases)
        assert len(alone.axes) == rows
        for row, axes in enumerate(alone.axes):
            beside = both.axes[row * len(cases) + column]
            assert axes.get_ylim() == beside.get_ylim()
            assert axes.get_title(loc="left") == beside.get_title(loc="left")
            assert axes.get_ylabel() == drawing.labels[row]
            for own, same in zip(axes.lines, beside.lines, strict=True):
                assert np.array_equal(own.get_xydata(), same.get_xydata(), equal_nan=True)


def test_every_panel_is_a_file_and_in_print_nothing_else(cases, tmp_path):
    wide, narrow = tmp_path / "wide", tmp_path / "narrow"
    for folder, style in ((wide, "screen"), (narrow, "print")):
        folder.mkdir()
        told = save_all(cases, folder, Look(style=style))
        assert {file.stem for file in folder.iterdir()} == set(told)
    pairs = set(FIGURES)
    assert {file.stem for file in wide.iterdir()} == PANELS | pairs
    assert {file.stem for file in narrow.iterdir()} == PANELS

"""Mechanisms drawn at random: they are models of every kind, and judged by what they are off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import random_mechanisms
from drawing.mechanisms import FAMILIES
from random_mechanisms import LATE, OPEN, REFUSED, RIGHT, SILENT, STOPPED, TOLD, drawn, judge
from results import rigid_link

from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.result import Outcome

SEED = 1


def first_of(family: str) -> str:
    """Model file of the first mechanism of a family."""
    return next(text for of, text in (drawn(k, SEED) for k in range(200)) if of == family)


@pytest.mark.parametrize("family", FAMILIES)
def test_every_family_is_drawn_as_a_model_file(family, tmp_path):
    path = tmp_path / "drawn.yaml"
    path.write_text(first_of(family))
    assert load_scene(path).title == family


def test_a_mechanism_is_the_same_each_time():
    assert drawn(3, SEED) == drawn(3, SEED) != drawn(4, SEED)


def test_a_slider_crank_is_right():
    verdict = judge(first_of("slider-crank"), "slider-crank", seconds=60, measure=False)
    assert verdict.kind == RIGHT
    assert verdict.off < 1


@pytest.mark.parametrize(
    ("off", "judge_off", "warning", "kind"),
    [
        (0.5e-6, 0.0, "", RIGHT),
        (3e-6, 0.0, "", SILENT),
        (3e-6, 0.0, "points may be off by more than the tolerance", TOLD),
        (3e-6, 2e-6, "", OPEN),
    ],
)
def test_what_a_run_is_off_by_decides(off, judge_off, warning, kind, monkeypatch):
    exact = rigid_link(samples=201)

    def fake(scene, _engine, **_):
        tolerance = scene.accuracy.tolerance
        moved = off if tolerance == 1e-6 else judge_off if tolerance == 1e-8 else 0.0
        shifted = exact.poses + np.array([moved, 0.0, 0.0])
        return replace(exact, poses=shifted, warnings=(warning,) if moved == off else ())

    monkeypatch.setattr(random_mechanisms, "simulate", fake)
    assert judge(first_of("tree"), "tree", seconds=60).kind == kind


@pytest.mark.parametrize(("stops", "kind"), [(1e-6, STOPPED), (1e-9, OPEN)])
def test_runs_are_right_only_where_both_go_to_the_end(stops, kind, monkeypatch):
    whole = rigid_link(samples=201)
    stopped = replace(whole, outcome=Outcome(False, 0.0, "no convergence"), time=whole.time[:1])
    stopped = replace(stopped, poses=whole.poses[:1], rates=whole.rates[:1])

    def fake(scene, _engine, **_):
        return stopped if scene.accuracy.tolerance == stops else whole

    monkeypatch.setattr(random_mechanisms, "simulate", fake)
    assert judge(first_of("tree"), "tree", seconds=60).kind == kind


def test_what_takes_long_is_not_waited_for_and_what_is_no_model_is_refused():
    assert judge(first_of("slider-crank"), "slider-crank", seconds=1e-3).kind == LATE
    assert judge("title: nothing", "tree", seconds=60).kind == REFUSED

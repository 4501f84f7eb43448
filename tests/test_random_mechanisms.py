"""Mechanisms drawn at random: they are models of every kind, and judged by what they are off."""

import pytest
from drawing.mechanisms import FAMILIES
from random_mechanisms import RIGHT, drawn, judge

from exudyn_flexlink.loading import load_scene

SEED = 1


def first_of(family):
    """Model file of the first mechanism of a family."""
    return next(text for of, text in (drawn(k, SEED) for k in range(200)) if of == family)


@pytest.mark.parametrize("family", FAMILIES)
def test_every_family_is_drawn_as_a_model_file(family, tmp_path):
    path = tmp_path / "drawn.yaml"
    path.write_text(first_of(family))
    assert load_scene(path).title == family


def test_a_slider_crank_is_right():
    verdict = judge(first_of("slider-crank"), "slider-crank", seconds=60, measure=False)
    assert verdict.kind == RIGHT
    assert verdict.off < 1

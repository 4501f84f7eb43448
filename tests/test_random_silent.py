"""Scenes with closed forms: these are what pieces of known motion give, and runs keep them."""

import pytest
from benchmarks.verdicts import CRASHED, SILENT
from drawing.mechanisms import FAMILIES
from random_mechanisms import RIGHT, drawn, judge
from random_silent import NEEDLESS, worst

from exudyn_flexlink.loading import load_scene

SMALL = (10000, 20001, 30000, 40000, 50001, 60000)


@pytest.mark.parametrize("scene", SMALL)
def test_no_scene_is_silently_wrong(scene):
    assert worst(scene, seed=1, measure=False).kind not in (SILENT, NEEDLESS, CRASHED)


# --- mechanisms drawn at random -------------------------------------------------------------------

SEED = 1


def first_of(family):
    """Model file of the first mechanism of a family."""
    return next(text for of, text in (drawn(k, SEED, False) for k in range(200)) if of == family)


@pytest.mark.parametrize("family", FAMILIES)
def test_every_family_is_drawn_as_a_model_file(family, tmp_path):
    path = tmp_path / "drawn.yaml"
    path.write_text(first_of(family))
    assert load_scene(path).title == family


def test_a_slider_crank_is_right():
    verdict = judge(first_of("slider-crank"), "slider-crank", seconds=60, measure=False)
    assert verdict.kind == RIGHT
    assert verdict.off < 1

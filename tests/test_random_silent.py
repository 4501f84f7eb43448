"""Scenes with closed forms: these are what pieces of known motion give, and runs keep them."""

import numpy as np
import pytest
from benchmarks.verdicts import CRASHED, SILENT
from drawing.mechanisms import FAMILIES
from random_mechanisms import RIGHT, drawn, judge
from random_silent import (
    NAMES,
    NEEDLESS,
    PULSES,
    exact,
    worst,
)

from exudyn_flexlink.loading import load_scene

SMALL = (10000, 10010, 20001, 20004, 30000, 30001, 40000, 50001, 60000)
TIME = np.linspace(0, 0.7, 50)


@pytest.mark.parametrize(
    ("shape", "area"), [(PULSES[0], 1.0), (PULSES[1], np.sqrt(np.pi)), (PULSES[2], 2.0)]
)
def test_a_pulse_moves_a_mass_by_its_area(shape, area):
    at, wide = 0.31, 1e-6
    text = shape.format(a=at, b=wide)
    knots = [at + side * wide for side in (-20, -6, -1, 0, 1, 6, 20)]
    moved = exact(lambda t, x, v: [v, eval(text, {**NAMES, "t": t})], [0.0, 0.0], 0.7, knots)
    right = area * wide * np.maximum(TIME - at, 0)
    assert moved(TIME) == pytest.approx(right, abs=1e-12)


def test_a_stop_throws_a_mass_back_within_half_its_period():
    """Free flight at 1 m/s, half a swing in the spring of the stop, and free flight back."""
    k, g, w = 900.0, 0.1, 30.0
    push = lambda t, x, v: [v, -k * max(0.0, x - g)]  # noqa: E731
    moved = exact(push, [0.0, 1.0], 0.7, ())
    within = (g < TIME) & (g + np.pi / w > TIME)
    right = np.where(g > TIME, TIME, 2 * g + np.pi / w - TIME)
    right[within] = g + np.sin(w * (TIME[within] - g)) / w
    assert moved(TIME) == pytest.approx(right, abs=1e-11)


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

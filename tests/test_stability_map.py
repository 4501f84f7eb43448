"""The map of stability: one scale of colours for all panels, doubtful runs marked."""

from math import pi

import pytest
from stability_map import mapped, word

ROW = {
    "drives.motor.value_rad_per_s": 10.0,
    "gap": 0.0,
    "status": "done",
    "exponent_per_s": -1.0,
    "sign": -1,
    "repeats_after_laps": 2,
    "settles_to_laps": None,
}


def test_one_scale_of_colours_is_that_of_all_panels():
    """The colour bar stands for both: 5 /s at 10 rad/s is pi in a lap."""
    figure = mapped({"paper": [ROW | {"exponent_per_s": 5.0, "sign": 1}], "beam": [ROW]})
    images = [axes.images[0] for axes in figure.axes if axes.images]
    assert [image.get_clim() for image in images] == [pytest.approx((-pi, pi))] * 2


def test_a_doubtful_run_has_a_star():
    assert word(ROW) == "2"
    assert word(ROW | {"status": "doubtful"}) == "2*"
    assert word(ROW | {"status": "failed", "sign": None}) == "failed"

"""Sections and what a mechanism makes of them, against integrals over the section."""

import math

import numpy as np
import pytest

from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.mechanism import beam_of
from exudyn_flexlink.scene.bodies import RectangleSection, RoundSection
from exudyn_flexlink.shipped import model_file


def integrate(width_at, half_height):
    """A and I of a section whose width at height y is given, by the midpoint rule."""
    n = 200_000
    y = (np.arange(n) + 0.5) / n * 2 * half_height - half_height
    strip = width_at(y) * 2 * half_height / n
    return strip.sum(), (strip * y**2).sum()


def beam_with(section, slender="false"):
    settings = (f"bodies.link.section={section}", f"bodies.link.slender={slender}")
    scene = load_scene(model_file("no_clearance"), settings)
    return beam_of(scene, scene.bodies["link"])


def test_rectangle_is_its_integral():
    section = RectangleSection(width=0.01, thickness=0.5e-3)
    expected = integrate(lambda y: 0.01 + 0 * y, 0.25e-3)
    assert (section.area, section.second_moment) == pytest.approx(expected, rel=1e-6)


def test_round_bar_is_its_integral():
    section = RoundSection(diameter=0.01)
    expected = integrate(lambda y: 2 * np.sqrt(0.005**2 - y**2), 0.005)
    assert (section.area, section.second_moment) == pytest.approx(expected, rel=1e-6)


def test_the_thickness_is_that_of_a_rectangle_with_the_same_second_moment():
    assert beam_with("{width: 10 mm, thickness: 0.5 mm}").thickness == pytest.approx(0.5e-3)
    round_bar = beam_with("{type: round, diameter: 10 mm}")
    assert round_bar.thickness == pytest.approx(0.01 * math.sqrt(3) / 2)
    assert beam_with("{type: round, diameter: 10 mm}", slender="true").thickness == 0

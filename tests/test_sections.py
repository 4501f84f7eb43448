"""Sections and rods against integrals over the section."""

import math

import numpy as np
import pytest

from exudyn_flexlink import sections
from exudyn_flexlink.scene.bodies import RectangleSection, RoundSection


def integrate(width_at, half_height):
    """A and I of a section whose width at height y is given, by the midpoint rule."""
    n = 200_000
    y = (np.arange(n) + 0.5) / n * 2 * half_height - half_height
    strip = width_at(y) * 2 * half_height / n
    return strip.sum(), (strip * y**2).sum()


def section_of(spec):
    return sections.Section(spec.area, spec.second_moment)


def test_rectangle_is_its_integral():
    section = section_of(RectangleSection(width=0.01, thickness=0.5e-3))
    expected = integrate(lambda y: 0.01 + 0 * y, 0.25e-3)
    assert (section.area, section.second_moment) == pytest.approx(expected, rel=1e-6)
    assert section.thickness == pytest.approx(0.5e-3)


def test_round_bar_is_its_integral():
    section = section_of(RoundSection(diameter=0.01))
    expected = integrate(lambda y: 2 * np.sqrt(0.005**2 - y**2), 0.005)
    assert (section.area, section.second_moment) == pytest.approx(expected, rel=1e-6)
    assert section.thickness == pytest.approx(0.01 * math.sqrt(3) / 2)


def test_strip_of_the_paper():
    """Steel, 10 mm x 0.5 mm: EI = 2e11 * 1.0416667e-13 N m^2, rho A = 7850 * 5e-6 kg/m."""
    section = section_of(RectangleSection(width=0.01, thickness=0.5e-3))
    assert sections.bending_stiffness(2e11, section) == pytest.approx(0.0208333333)
    assert sections.mass_per_length(7850, section) == pytest.approx(0.03925)
    assert sections.rod_mass(7850, section, 0.07) == pytest.approx(2.7475e-3)


def test_rod_inertia_is_that_of_a_plate():
    assert sections.rod_inertia(3.0, 2.0) == pytest.approx(1.0)
    assert sections.rod_inertia(3.0, 2.0, 1.0) == pytest.approx(3.0 * (4 + 1) / 12)


@pytest.mark.parametrize("bad", [0, -1e-3, math.nan, math.inf])
def test_impossible_sizes_are_refused(bad):
    for values in ((1, bad), (bad, 1)):
        with pytest.raises(ValueError, match="positive"):
            sections.Section(*values)

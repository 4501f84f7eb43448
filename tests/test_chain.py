"""A chain of rods tends to the Euler-Bernoulli beam."""

import math
from dataclasses import replace

import numpy as np
import pytest

from exudyn_flexlink.chain import (
    Beam,
    Hinge,
    cantilever_roots,
    discretise,
    euler_bernoulli_cantilever,
)
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.mechanism import beam_of
from exudyn_flexlink.scene.bodies import RectangleSection, RoundSection
from exudyn_flexlink.shipped import model_file

STRIP = Beam(length=0.07, mass_per_length=0.03925, bending_stiffness=0.0208333)


def error(cells, layout, mode=0):
    """Relative error of a cantilever frequency, in percent."""
    chain = discretise(STRIP, cells, layout, "beam")
    exact = euler_bernoulli_cantilever(STRIP, mode + 1)[mode]
    return 100 * (chain.cantilever_frequencies(mode + 1)[mode] / exact - 1)


def test_clamped_free_roots():
    expected = [3.516015, 22.034492, 61.697214, 120.901916]
    np.testing.assert_allclose(cantilever_roots(4) ** 2, expected, atol=1e-6)
    assert cantilever_roots(300)[-1] == pytest.approx(299.5 * math.pi)


@pytest.mark.parametrize(
    ("cells", "equal", "half_ends"),
    [(4, 33.1, 1.45), (8, 14.2, 0.36), (16, 6.7, 0.090), (32, 3.2, 0.022)],
)
def test_cantilever_table(cells, equal, half_ends):
    assert error(cells, "equal") == pytest.approx(equal, abs=0.05)
    assert error(cells, "half_ends") == pytest.approx(half_ends, rel=0.02)


@pytest.mark.parametrize(("layout", "order"), [("equal", 1), ("half_ends", 2)])
@pytest.mark.parametrize("mode", [0, 1, 2])
def test_segmented_cantilever_tends_to_euler_bernoulli(layout, order, mode):
    ratio = error(64, layout, mode) / error(128, layout, mode)
    assert math.log2(abs(ratio)) == pytest.approx(order, abs=0.1)


def test_half_ends_halves_the_end_rods():
    chain = discretise(STRIP, 4, "half_ends")
    lengths = [rod.length for rod in chain.rods]
    mass = sum(rod.mass for rod in chain.rods)
    assert mass == pytest.approx(STRIP.length * STRIP.mass_per_length)
    assert len(chain.hinges) == 4
    np.testing.assert_allclose(np.array(lengths) * 8 / STRIP.length, [1, 2, 2, 2, 1])


def test_stiffness_rules():
    def hinge(rule):
        return discretise(STRIP, 10, "equal", rule, damping=2e-5).hinges[0]

    assert hinge("paper").stiffness == pytest.approx(0.0208333 / 0.07)
    assert hinge("beam").stiffness == pytest.approx(0.0208333 / 0.007)
    assert hinge(0.5) == Hinge(0.5, 2e-5)


def test_paper_stiffness_gets_softer_with_more_rods():
    """n hinges in series: the first frequency falls as 1/sqrt(n), below any bound."""
    few, many = (discretise(STRIP, n, "half_ends", "paper") for n in (50, 200))
    ratio = few.cantilever_frequencies()[0] / many.cantilever_frequencies()[0]
    assert ratio == pytest.approx(2, rel=1e-3)


def test_a_rod_has_the_inertia_of_a_plate():
    beam = Beam(length=4.0, mass_per_length=1.5, bending_stiffness=1.0)
    assert beam.rod(2.0).inertia == pytest.approx(1.0)
    assert replace(beam, thickness=1.0).rod(2.0).inertia == pytest.approx(3.0 * (4 + 1) / 12)


# --- sections -------------------------------------------------------------------------------------


def integrate(width_at, half_height):
    """A and I of a section whose width at height y is given, by the midpoint rule."""
    n = 200_000
    y = (np.arange(n) + 0.5) / n * 2 * half_height - half_height
    strip = width_at(y) * 2 * half_height / n
    return strip.sum(), (strip * y**2).sum()


@pytest.mark.parametrize(
    ("section", "width_at", "half_height"),
    [
        (RectangleSection(width=0.01, thickness=0.5e-3), lambda y: 0.01 + 0 * y, 0.25e-3),
        (RoundSection(diameter=0.01), lambda y: 2 * np.sqrt(0.005**2 - y**2), 0.005),
    ],
)
def test_a_section_is_its_integral(section, width_at, half_height):
    expected = integrate(width_at, half_height)
    assert (section.area, section.second_moment) == pytest.approx(expected, rel=1e-6)


def beam_with(section, slender="false"):
    settings = (f"bodies.link.section={section}", f"bodies.link.slender={slender}")
    scene = load_scene(model_file("no_clearance"), settings)
    return beam_of(scene, scene.bodies["link"])


def test_the_strip_of_the_paper():
    """Steel, 10 mm x 0.5 mm: EI = 2e11 * 1.0416667e-13 N m^2, rho A = 7850 * 5e-6 kg/m."""
    beam = beam_with("{width: 10 mm, thickness: 0.5 mm}")
    assert beam.bending_stiffness == pytest.approx(0.0208333333)
    assert beam.mass_per_length == pytest.approx(0.03925)


def test_the_thickness_is_that_of_a_rectangle_with_the_same_second_moment():
    assert beam_with("{width: 10 mm, thickness: 0.5 mm}").thickness == pytest.approx(0.5e-3)
    round_bar = beam_with("{type: round, diameter: 10 mm}")
    assert round_bar.thickness == pytest.approx(0.01 * math.sqrt(3) / 2)
    assert beam_with("{type: round, diameter: 10 mm}", slender="true").thickness == 0

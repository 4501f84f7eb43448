"""Bending of flexible links: moments against statics, stress, and the error that two runs tell."""

import numpy as np
import pytest
from results import words

import exudyn_flexlink as fl

LENGTH, WIDTH, THICKNESS, DENSITY, MODULUS = 0.07, 0.01, 0.5e-3, 7850, 2e11
STIFFNESS = MODULUS * WIDTH * THICKNESS**3 / 12
FORCE = -0.02  # N, downwards at the end


def cantilever(*settings):
    return fl.load_scene("textbook/welded_cantilever", ["gravity=0", *settings])


def loaded(*settings):
    """At rest under a load at its end, by 10 half-ended cells; hinges are at (k - 1/2) L/10.

    It is welded to the ground where it starts, of which the moment is told, too.
    """
    push = f"drives.load={{type: force, point: beam.end, value: [0, {FORCE}]}}"
    return cantilever(push, "initial={at_rest: true}", "run.duration=1 ms", *settings)


def test_the_moment_of_a_hinge_is_that_of_the_load_beyond_it():
    run = fl.simulate(loaded())
    bent = run.link("beam")
    np.testing.assert_allclose(bent.place[1:], (np.arange(10) + 0.5) * LENGTH / 10)
    parts = run.poses[:, :, 0]
    hinges = parts[:, 1:]  # each rod's origin is the hinge before it
    arm = run.path("beam.end").position[:, :1] - hinges
    np.testing.assert_allclose(bent.moment[:, 1:], FORCE * arm, rtol=1e-6)
    np.testing.assert_allclose(bent.moment[0], FORCE * (LENGTH - bent.place), rtol=0.01)


def test_the_moment_of_a_clamp_is_that_of_the_load_at_the_whole_length():
    run = fl.simulate(loaded("bodies.beam.points={near_end: 66 mm, mid: 30 mm}"))
    bent, reach = run.link("beam"), run.path("beam.end").position[0, 0]
    assert bent.largest.moment == pytest.approx(FORCE * reach, rel=1e-3)
    assert bent.largest.place == 0.0
    for place in (0.066, 0.03):
        at = int(np.abs(bent.place - place).argmin())
        assert bent.place[at] == pytest.approx(place)
        assert bent.moment[0, at] == pytest.approx(FORCE * (LENGTH - place), rel=0.02)


def test_stress_and_strain_are_those_of_the_outermost_fibre():
    bent = fl.simulate(loaded()).link("beam")
    np.testing.assert_allclose(bent.stress, bent.moment * 6 / (WIDTH * THICKNESS**2))
    np.testing.assert_allclose(bent.strain, bent.stress / MODULUS)
    assert bent.largest.stress == np.abs(bent.stress).max()
    round_one = fl.simulate(loaded("bodies.beam.section={type: round, diameter: 2 mm}"))
    bent = round_one.link("beam")
    np.testing.assert_allclose(bent.stress, bent.moment * 32 / (np.pi * 0.002**3))


def test_a_section_of_unknown_height_has_moments_alone():
    section = "bodies.beam.section={type: general, area: 5 mm^2, second_moment: 0.1 mm^4}"
    run = fl.simulate(loaded(section))
    assert run.link("beam").stress is None
    assert run.link("beam").largest.strain is None
    assert "MPa" not in run.summary()
    assert "N m" in run.summary()


@pytest.mark.parametrize("formulation", ["minimal", "redundant"])
def test_spinning_up_bends_a_link_as_its_inertia_asks(formulation):
    """M = -rho A alpha (L^3/3 - x L^2/2 + x^3/6), which damping lets the link settle to.

    At the clamp, x = 0, this is the moment of the whole link's inertia.
    """
    settings = [
        "bodies.hub={type: rigid, mass: 1, inertia: 1, points: {c: [0, 0]}}",
        "joints={axle: {type: revolute, points: [ground, hub.c], at: [0, 0]},"
        " clamp: {type: weld, points: [hub.c, beam.start]}}",
        "drives={motor: {type: speed, joint: axle, value: 2*t}}",
        "bodies.beam.hinges.damping=2e-3",
        "run.duration=0.5",
        f"solver.formulation={formulation}",
    ]
    run = fl.simulate(cantilever(*settings), measure=False)
    bent = run.link("beam")
    x, mass = bent.place, DENSITY * WIDTH * THICKNESS
    assert x[0] == 0.0
    expected = -2 * mass * (LENGTH**3 / 3 - x * LENGTH**2 / 2 + x**3 / 6)
    np.testing.assert_allclose(bent.moment[-1], expected, atol=0.02 * abs(expected).max())


def test_the_largest_moment_in_a_strike_settles_as_hinges_get_more():
    """A load bends a cantilever until its end hits a floor; damping is that of the material."""
    peaks = []
    for count in (8, 16, 32):
        settings = [
            f"bodies.beam.rods={count}",
            f"bodies.beam.hinges.damping={2e-6 * count}",
            "curves={floor: {type: line, from: [-0.1, -0.001], to: [0.2, -0.001]}}",
            "contacts={stop: {type: point_on_curve, point: beam.end, curve: floor,"
            " law: {type: exact, stiffness: 2000, restitution: 0.5}}}",
            "drives.load={type: force, point: beam.end, value: [0, -0.2]}",
            "run={duration: 8 ms, sample: 20 us}",
        ]
        run = fl.simulate(cantilever(*settings), measure=False)
        largest = run.link("beam").largest
        assert largest.place == 0.0
        assert run.touches("stop").begin[0] < largest.at < run.touches("stop").end[0]
        peaks.append(largest.moment)
    coarse, fine = np.abs(np.diff(peaks))
    assert 2.5 * fine < coarse < 0.005 * abs(peaks[-1])


@pytest.mark.parametrize("layout", ["half_ends", "equal"])
def test_a_link_solved_as_a_beam_has_the_moments_of_its_rods(layout):
    """Bent by its own inertia alone; with half rods the first chord is shorter than the others."""
    settings = [
        "bodies.link.hinges={stiffness: beam, damping: 2e-5}",
        f"bodies.link.layout={layout}",
        "bodies.link.rods=20",
        "run.turns=0.49",
    ]
    rods, beam = (
        fl.simulate(
            fl.load_scene("smooth", [*settings, f"solver.formulation={formulation}"]),
            measure=False,
        )
        .link("link")
        .moment[-1]
        for formulation in ("minimal", "beam")
    )
    np.testing.assert_allclose(beam, rods, atol=0.06 * np.abs(rods).max())


def test_the_told_error_bounds_the_distance_from_a_tight_run():
    settings = ["run.turns=0.7", "bodies.link.rods=4", "accuracy.tolerance=1e-5"]
    run = fl.simulate(fl.load_scene("no_clearance", settings))
    exact = fl.simulate(
        fl.load_scene("no_clearance", [*settings, "accuracy.tolerance=1e-8"]), measure=False
    )
    time = np.intersect1d(run.time, exact.time)
    ours, tight = (each.link("link") for each in (run, exact))
    at, there = (np.searchsorted(each.time, time) for each in (ours, tight))
    off = np.abs(ours.moment[at] - tight.moment[there]).max(axis=1)
    beside = off <= 1.001 * ours.error[at] + 1e-12
    assert beside.mean() > 0.99
    assert 0 < ours.error.max() < 0.02 * np.abs(ours.moment).max()


def test_it_stands_wherever_people_look(tmp_path):
    run = fl.simulate(loaded("run.duration=2 ms"))
    assert "Largest bending of links" in run.summary()
    table = run.to_dataframe("beam")
    np.testing.assert_array_equal(table["moment_at_0_m_N_m"], run.link("beam").moment[:, 0])
    np.testing.assert_array_equal(table["moment_at_0.0035_m_N_m"], run.link("beam").moment[:, 1])
    largest = np.abs(run.link("beam").moment).max(axis=1)
    np.testing.assert_array_equal(run.to_dataframe()["beam.bending_moment_N_m"], largest)
    assert (run.save(tmp_path / "run") / "bending_beam.csv").exists()
    assert "largest: " in words(run.plot.bending())
    row = fl.standard_row(run)
    assert row["beam.greatest_bending_moment_N_m"] == largest.max()
    assert row["beam.greatest_bending_stress_Pa"] == run.link("beam").largest.stress


def test_what_has_no_hinges_is_refused_by_name():
    run = fl.simulate(fl.load_scene("no_clearance", ["run.turns=0.01"]), measure=False)
    with pytest.raises(ValueError, match=r"no flexible body 'guide'.*link"):
        run.link("guide")

"""The page of the second day runs as it stands, and what it shows holds."""

import math

import matplotlib.pyplot as plt
import numpy as np
import pytest
from pages_of_docs import BLOCK, DOCS, text_of

PAGE = DOCS / "second_day.md"
SPEED, LENGTH, SECTION = 10.0, 0.09, 20e-3 * 12e-3  # of the guide: rad/s, m, m^2
DENSITY, STEEL = 7850.0, 200e9  # kg/m^3, Pa
LEVER_HZ = 40 * math.sqrt(1 - 0.1**2)  # of an oscillator with a tenth of the critical damping


@pytest.fixture(scope="module")
def day(tmp_path_factory):
    """All names of the page after it was run in a folder."""
    scope = {"__name__": "__main__"}
    with pytest.MonkeyPatch.context() as patch, plt.rc_context({"backend": "agg"}):
        patch.chdir(tmp_path_factory.mktemp("day"))
        for found in BLOCK.finditer(text_of(PAGE)):
            exec(compile(found["text"], PAGE.name, "exec"), scope)
    plt.close("all")
    return scope


def test_each_task_is_short():
    parts = text_of(PAGE).split("\n## ")[1:]
    tasks = [BLOCK.findall(part) for part in parts]
    assert len(tasks) == 10
    assert all(len(blocks) == 1 for blocks in tasks)
    lines = [[line for line in blocks[0][1].splitlines() if line] for blocks in tasks]
    assert max(map(len, lines)) <= 5


def test_the_spectrum_has_the_frequency_of_the_lever(day):
    spacing = day["frequency"][1]
    assert day["frequency"][day["power"].argmax()] == pytest.approx(LEVER_HZ, abs=spacing)
    assert day["model"].modes[0].frequency == pytest.approx(LEVER_HZ, rel=1e-6)


def test_the_section_tells_odd_turns_from_even_ones(day):
    assert day["section"].distinct(1e-4) == len(day["section"].time) == 2


def test_the_stress_is_that_of_the_moment(day):
    bent = day["bent"]
    np.testing.assert_allclose(np.abs(bent.stress), np.abs(bent.moment) / (10e-3 * 0.5e-3**2 / 6))
    np.testing.assert_allclose(bent.stress, STEEL * bent.strain, rtol=1e-9)
    assert bent.stress[day["during"]].shape[1] == len(bent.place) == 2


def test_the_force_along_the_guide_turns_it_alone(day):
    centripetal = DENSITY * SECTION * LENGTH * SPEED**2 * LENGTH / 2
    np.testing.assert_allclose(day["along"], -centripetal, rtol=1e-6)
    assert np.abs(day["across"]).max() > 0.5


def test_the_answer_is_largest_at_the_frequencies_of_the_link(day):
    answer = day["answer"]
    highest = answer.frequency[np.abs(answer.y).argmax()]
    assert highest == pytest.approx(day["model"].modes[1].frequency, rel=0.02)


def test_the_largest_force_goes_with_the_speed_and_the_root_of_the_stiffness(day):
    stiffness, speed = day["depends"].rows
    force = stiffness.value
    assert speed.derivative == pytest.approx(force / SPEED, rel=1e-3)
    assert stiffness.derivative == pytest.approx(force / 2 / stiffness.at, rel=0.01)


def test_the_spring_does_what_is_wanted(day):
    assert 20 < day["wanted"] < 30
    assert abs(day["excess"](day["wanted"])) < 1e-3


def test_forces_scatter_as_their_sensitivity_says(day):
    assert np.isfinite(day["forces"]).all()
    expected = day["depends"].rows[1].derivative * day["draws"].std(ddof=1)
    assert day["forces"].std(ddof=1) == pytest.approx(expected, rel=0.01)


def test_the_run_goes_on_with_the_other_spring(day):
    first, stiffer = day["result"], day["stiffer"]
    assert stiffer.outcome.completed
    start = stiffer.path("link.end").position[0]
    np.testing.assert_allclose(start, first.path("link.end").position[-1], atol=1e-9)
    assert stiffer.scene.springs["lever_return"].frequency == 60

"""How long a run can be trusted: made-up runs that part as they are told to."""

from dataclasses import replace
from math import exp, log, nan, pi, sqrt

import numpy as np
import pytest
import results

from exudyn_flexlink.comparison import compare
from exudyn_flexlink.observables import State, spectrum, vibration
from exudyn_flexlink.report import run_text, sensitivity_text
from exudyn_flexlink.result import Outcome
from exudyn_flexlink.scene import Outputs
from exudyn_flexlink.sensitivity import growth_rate, measured_error, sensitivity

RATE, SEED = 14.0, 1e-9  # 1/s, m: a factor of 1e6 in a second


def still():
    return results.block(np.zeros_like, np.zeros_like)


def moving():
    return results.block(lambda t: 0.2 * t, lambda t: np.full_like(t, 0.2))


def shifted(off):
    run = moving()
    return replace(run, poses=run.poses + np.array([off, 0.0, 0.0]))


def parting(rate=RATE, seed=SEED, largest=1.0):
    """A block that leaves the still one exponentially, until it is `largest` m away."""

    def off(t):
        return np.minimum(seed * np.exp(rate * t), largest)

    return results.block(off, lambda t: np.where(off(t) < largest, rate * off(t), 0.0))


def shaken():
    """The paper's rigid link whose end vibrates in x by 2 mm rms, at 40 Hz."""
    run = results.rigid_link(turns=2.0, samples=4001)
    way = 2e-3 * sqrt(2) * np.sin(2 * pi * 40 * run.time)
    poses = run.poses.copy()
    poses[:, 1:11, 0] += way[:, None]
    rates = np.gradient(poses, run.time, axis=0)
    return replace(run, poses=poses, rates=rates)


# --- horizon and growth


def test_the_horizon_is_where_the_runs_differ_by_the_limit():
    found = sensitivity(still(), parting(), limit=1e-4)
    horizon = found.compared.horizon
    assert horizon == pytest.approx(log(1e-4 / SEED) / RATE, abs=0.01)  # samples: 10 ms
    assert found.growth == pytest.approx(RATE, rel=1e-3)
    assert found.compared.distances.max() == pytest.approx(SEED * exp(RATE), rel=1e-6)
    assert found.compared.time[-1] == 1.0


def test_saturation_does_not_lower_the_growth_rate():
    found = sensitivity(still(), parting(rate=40.0, largest=1e-3), limit=1e-4)
    assert found.compared.horizon == pytest.approx(log(1e-4 / SEED) / 40, abs=0.01)
    assert found.growth == pytest.approx(40, rel=1e-2)


def test_dips_of_the_separation_do_not_count():
    time = np.linspace(0, 1, 1001)
    apart = SEED * np.exp(RATE * time) * np.abs(np.sin(60 * time))
    assert growth_rate(time, apart, 1e-4) == pytest.approx(RATE, rel=0.05)


def test_runs_that_do_not_part_have_no_horizon():
    found = sensitivity(still(), still(), limit=1e-4)
    assert (found.compared.horizon, found.growth) == (None, None)
    assert found.compared.distances.max() == 0.0


def test_spectra_are_made_only_where_statistics_are_told(monkeypatch):
    made = []
    monkeypatch.setattr("exudyn_flexlink.sensitivity.vibration", lambda *_, **__: made.append(1))
    assert "can be trusted to the end" in sensitivity_text(sensitivity(parting(), parting()))
    assert not made


def test_a_constant_difference_does_not_grow():
    time = np.linspace(0, 1, 101)
    assert growth_rate(time, np.full(101, 1e-5), 1e-4) is None


def test_the_limit_follows_from_the_room_the_point_takes():
    moving = results.block(lambda t: 0.2 * t, lambda t: np.full_like(t, 0.2))
    assert sensitivity(moving, moving).limit == pytest.approx(1e-3 * 0.2)


def test_a_run_that_stopped_is_trusted_no_further():
    stopped = results.first_samples(parting(), 31)
    found = sensitivity(still(), stopped, limit=1e-4)
    assert found.compared.horizon == found.compared.time[-1] == pytest.approx(0.3)
    assert "where a run stopped" in sensitivity_text(found)


def test_a_separation_that_is_no_number_is_no_agreement():
    broken = parting(rate=0.0, seed=0.0)
    poses = broken.poses.copy()
    poses[50:] = nan
    found = sensitivity(still(), replace(broken, poses=poses), limit=1e-4)
    assert found.compared.horizon == pytest.approx(0.5, abs=0.011)


# --- statistics


def test_vibration_about_the_guides_axis():
    run = shaken()
    seen = vibration(run)
    assert seen.off_ideal
    # The end is measured from where the link's start, moved as well, is along the guide: what is
    # left of a motion along x is that across the guide, sin^2 of its angle in x.
    assert seen.rms[0] == pytest.approx(2e-3 * sqrt(3 / 8), rel=2e-2)
    assert seen.x.lines[0] == pytest.approx(40, abs=seen.x.resolution)


@pytest.mark.parametrize(("weak", "lines"), [(1e-3, (40, 90)), (1e-4, (40,))])
def test_weak_lines_are_not_named(weak, lines):
    time = np.linspace(0, 1.256, 4001)
    seen = spectrum(time, 2.8e-3 * np.sin(80 * pi * time) + weak * np.sin(180 * pi * time))
    assert seen.lines == pytest.approx(lines, abs=seen.resolution / 2)


def test_the_resolution_is_that_of_half_the_run():
    run = shaken()
    half = run.time[-1] / 2
    assert vibration(run).x.resolution == pytest.approx(1 / half, rel=2e-2)


def test_only_what_both_runs_have_lived_through_counts():
    run = shaken()
    whole = compare(run, run).statistics()
    part = compare(results.first_samples(run, int(0.2 / run.time[-1] * 4000)), run).statistics()
    assert [own.levers["lever"][0] for own in part] == [0.0, 0.0]  # the first strike is at 0.314 s
    assert whole[0].levers["lever"][0] < -0.1


def test_where_no_ideal_path_is_known():
    assert not vibration(still()).off_ideal


def test_parts_of_the_time_in_contact():
    run = results.tilting_link()
    found = compare(run, run).second
    assert found.contact["sleeve"].fractions[State.SAME_SIDE] > 0.05
    half = int(np.searchsorted(run.time, 0.5))
    early = compare(results.first_samples(run, half), run).second
    assert early.contact["sleeve"].fractions[State.FREE] == pytest.approx(1)


# --- which points judge


def swinging(by=0.0):
    """A pendulum of 0.2 m, whose start is pinned, turned by an angle (rad)."""
    run = results.pendulum()
    return replace(run, poses=run.poses + np.array([0.0, 0.0, by]))


def test_all_named_points_judge_not_the_pivot_alone():
    found = measured_error(swinging(), swinging(1e-4), 10.0)
    assert found.points == ("rod.end", "rod.start", "rod.centre")
    assert found.worst == "rod.end"
    assert found.largest == pytest.approx(1.5 / 9 * 2e-5, rel=1e-3)


def test_a_chosen_point_judges_alone():
    def watching(run):
        return replace(run, scene=run.scene.changed(outputs=Outputs(watch="rod.centre")))

    found = measured_error(watching(swinging()), watching(swinging(1e-4)), 10.0)
    assert found.points == ("rod.centre",)
    assert found.largest == pytest.approx(1.5 / 9 * 1e-5, rel=1e-3)


# --- what is said


def test_what_is_said_of_runs_that_part():
    tilting = results.tilting_link()
    moved = tilting.poses.copy()
    moved[:, :, 0] += np.minimum(SEED * np.exp(RATE * tilting.time), 1e-2)[:, None]
    said = sensitivity_text(sensitivity(tilting, replace(tilting, poses=moved), 1e-4))
    assert said.startswith("All 6 named points can be trusted instant by instant up to t = 0.82")
    assert "differs by more than 0.0001 m, 0.01 m at most in " in said
    assert "trust statistics only." in said
    assert "like exp(14 t): tenfold every 0.16 s" in said
    rows = [line.split() for line in said.splitlines()]
    assert next(row for row in rows if row[:2] == ["sleeve:", "touches"])[2:] == ["10", "10"]
    assert any("off its ideal path, y, largest" in line for line in said.splitlines())


def test_what_is_said_of_runs_that_agree():
    said = sensitivity_text(sensitivity(moving(), shifted(3e-9), 1e-4))
    assert said == (
        "Both named points can be trusted to the end, t = 1 s: a neighbouring run differs by "
        "3e-09 m at most in block.nose."
    )
    assert "0.0001" not in said  # a limit is no measurement


def test_points_that_stand_still_tell_nothing():
    said = sensitivity_text(sensitivity(still(), still(), 1e-4))
    assert said == "Nothing is told of both named points, which stand still."
    assert measured_error(still(), still(), 0.1).missing == "both named points stand still"


@pytest.mark.parametrize("measured", [False, True])
def test_a_run_of_which_no_point_moves_says_so_and_what_to_name(measured):
    """A second run could tell nothing either, so that none is proposed."""
    run = still()
    error = measured_error(run, run, 0.1) if measured else None
    told = " ".join(run_text(replace(run, error=error)).split())
    assert "positions not measured: both named points stand still; a point off the axis" in told
    assert "--horizon" not in told
    assert "stand still" not in run_text(moving())


def test_one_point_that_stands_still_is_told_in_the_singular():
    watched = still().scene.changed(outputs=Outputs(watch="block.nose"))
    run = replace(still(), scene=watched)
    assert measured_error(run, run, 0.1).missing == "block.nose stands still"


@pytest.mark.parametrize(("factor", "times"), [(0.25, 2.0), (0.1, 1.5 / 0.9), (10.0, 1.5 / 9)])
def test_the_distance_of_a_neighbour_tells_the_error(factor, times):
    found = measured_error(moving(), shifted(3e-6), factor)
    assert found.points == ("block.nose", "block.centre")
    assert found.limit == moving().scene.accuracy.tolerance == 1e-5
    assert found.largest == pytest.approx(times * 3e-6)
    assert (found.exceeds_from, found.stopped, found.missing) == (None, None, "")


def test_errors_exceed_the_tolerance_from_the_instant_at_which_the_neighbour_says_so():
    found = measured_error(still(), parting(), 0.1)
    assert found.exceeds_from == pytest.approx(log(0.6e-5 / SEED) / RATE, abs=0.01)
    assert found.largest == pytest.approx(1.5 / 0.9 * SEED * exp(RATE), rel=1e-6)


def test_once_runs_have_parted_the_error_is_no_less_than_their_distance():
    assert measured_error(moving(), shifted(1e-2), 10.0).largest == pytest.approx(1e-2)


def test_without_a_tolerance_errors_are_told_where_one_sees_them():
    run = moving()
    stepped = run.scene.accuracy.model_copy(update={"tolerance": None, "step": 1e-3})
    found = measured_error(replace(run, scene=run.scene.changed(accuracy=stepped)), run, 0.25)
    assert found.limit == pytest.approx(1e-3 * 0.2)


def test_nothing_is_measured_after_a_neighbour_stopped():
    found = measured_error(moving(), results.first_samples(moving(), 31), 10.0)
    assert found.stopped == pytest.approx(0.3)
    assert found.exceeds_from is None


def test_a_scene_without_the_lever_can_stand_beside_one_with_it():
    smooth, run = results.rigid_link(turns=2.0, samples=4001), shaken()
    ended = Outcome(True, float(run.time[-1]))
    bare = replace(smooth, outcome=ended, scene=smooth.scene.changed(contacts={}))
    assert "sleeve" not in sensitivity_text(sensitivity(run, bare, 1e-6))

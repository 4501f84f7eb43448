"""Two results of one scene, made by closed form: what is known to differ must be found."""

import json
from dataclasses import replace
from math import pi, sqrt

import matplotlib as mpl
import numpy as np
import pytest
import results
from matplotlib.colors import same_color
from results import block, solved_to, texts

from exudyn_flexlink.comparison import compare
from exudyn_flexlink.observables import (
    lever_response,
    spectrum,
    vibration,
)
from exudyn_flexlink.plots import ENGINE_COLOURS, comparison
from exudyn_flexlink.report import comparison_text, excess_text, horizon_text
from exudyn_flexlink.result import MeasuredError
from exudyn_flexlink.scene import PrismaticJoint
from exudyn_flexlink.storage import save_study


def still(**options):
    return block(np.zeros_like, np.zeros_like, **options)


def drifting(speed, **options):
    return block(lambda t: speed * t, lambda t: np.full_like(t, speed), **options)


def known(run, until, stopped=False):
    """The run, but measured up to an instant (s), where two runs of it part, or one stopped."""
    which = {"stopped": until} if stopped else {"horizon": until}
    return replace(run, error=MeasuredError(("a.b",), limit=1e-6, largest=1e-7, **which))


def shifted(result, by, after=0.0, engine="lagrangian"):
    """The same run with every part moved by (x, y) m and turned by an angle, from a time on."""
    poses = result.poses.copy()
    poses[result.time >= after] += by
    return results.with_its_extremes(replace(result, poses=poses, engine=engine))


# --- deviation over time


def test_a_run_does_not_deviate_from_itself(rigid):
    same = compare(rigid, rigid)
    assert same.deviation.largest == 0
    assert not same.answer_differences["lever"].any()
    assert not same.exceeds(1e-15)
    assert (same.first.name, same.second.name) == ("exudyn 1", "exudyn 2")
    assert same.first.levers["lever"].least == lever_response(rigid, "strike").least


def test_deviation_is_the_distance_over_time():
    compared = compare(still(), drifting(1e-3))
    assert (compared.levers, compared.strikes, compared.first_strike) == ((), [], None)
    assert (compared.horizon, compared.beyond, compared.before_strike) == (None, None, None)
    assert "struck" not in comparison_text(compared)
    assert "no horizon was looked for" in horizon_text(compared)
    found = compared.deviation
    np.testing.assert_allclose(found.distance, 1e-3 * found.time, atol=1e-15)
    assert found.largest == pytest.approx(1e-3)
    mean_square = np.mean(found.time**2)
    assert found.rms == pytest.approx(1e-3 * mean_square**0.5)


def test_grids_that_differ_are_met_by_the_cubic():
    def swing(samples):
        return block(lambda t: np.sin(6 * t), lambda t: 6 * np.cos(6 * t), samples)

    found = compare(swing(101), swing(64)).deviation.largest
    # Hermite: h^4/384 of the fourth derivative; a straight line would miss h^2/8 of the second.
    assert 0 < found < 1.1 * (1 / 63) ** 4 / 384 * 6**4


def test_runs_of_other_scenes_are_refused(rigid):
    with pytest.raises(ValueError, match=r"watched points are link.end and rod.end"):
        compare(rigid, results.pendulum())


# --- levers


def test_lever_angles_and_peaks(rigid):
    turned = shifted(rigid, (0, 0, 1e-4), after=0.1)  # the response counts from time 0
    found = compare(rigid, turned)
    assert found.levers == ("lever",)
    apart = abs(found.answer_differences["lever"]).max()
    assert apart == pytest.approx(1e-4, rel=1e-6)
    one, other = (seen.levers["lever"].least[0] for seen in (found.first, found.second))
    assert one - other == pytest.approx(-1e-4, rel=1e-3)
    assert "angle of lever" in comparison_text(found)


# --- horizon


@pytest.mark.parametrize("ends", [(0.5, None), (None, 0.5), (0.5, 0.7)])
def test_the_horizon_is_the_earlier_one_of_both(ends):
    one, other = (known(still(), end) for end in ends)
    assert compare(one, other).horizon == 0.5
    assert compare(known(still(), None), still()).horizon is None
    assert compare(known(still(), 1e3), still()).beyond is None  # after the shorter run's end


def test_what_comes_after_the_horizon_is_not_judged():
    # The judge's own two runs part after 0.5 s, and only then does the other engine differ.
    judge = known(still(engine="lagrangian"), 0.51)
    wild = block(lambda t: np.where(t > 0.6, 0.1, 1e-7), np.zeros_like)
    found = compare(wild, judge)
    assert found.deviation.largest == pytest.approx(0.1)
    assert found.judged.largest == pytest.approx(1e-7)
    assert not found.exceeds(2e-7)
    assert found.exceeds(0.9e-7)
    parted = "beyond it by statistics: from there on two runs of lagrangian part for good"
    assert parted in horizon_text(found)


def test_a_horizon_at_the_start_and_what_is_no_number_is_no_pass():
    found = compare(still(), known(still(engine="lagrangian"), 0.0))
    assert found.exceeds(1.0)
    assert "nothing can be compared" in excess_text(found, 1.0)
    assert "no samples" in comparison_text(found)
    lost = block(lambda t: np.where(t > 0.5, np.nan, 0.0), np.zeros_like)
    assert compare(still(), lost).exceeds(1.0)


def test_statistics_beyond_the_horizon():
    judge = block(lambda t: 0.1 * np.cos(20 * pi * t), np.zeros_like)
    found = compare(judge, known(judge, float(judge.time[judge.time > 0.495][0])))
    one, other = found.beyond
    wave = 0.1 * np.cos(20 * pi * judge.time[judge.time > 0.495])
    assert one.mean[0] == pytest.approx(0.1 + wave.mean())  # the nose is 0.1 m before the centre
    assert one.rms[0] == pytest.approx(wave.std())
    assert one.greatest[0] - one.least[0] == pytest.approx(np.ptp(wave))
    assert (one.rms == other.rms).all()
    assert one.levers == {}


# --- strikes


def later(result, by, keep=lambda touch: True):
    moved = [
        replace(touch, begin=touch.begin + by, end=touch.end + by)
        for touch in result.contacts["strike"].touches
        if keep(touch)
    ]
    return replace(results.touched(result, *moved), engine="lagrangian")


def test_strikes_of_both_runs_are_paired(rigid):
    found = compare(rigid, later(rigid, 1e-6))
    assert [pair.lap for pair in found.strikes] == [1, 3]
    for pair in found.strikes:
        assert pair.second.begin - pair.first.begin == pytest.approx(1e-6)
        assert pair.first.impulse == pytest.approx(2 * results.IMPULSE)
    assert found.first_strike == pytest.approx(pi / results.SPEED)
    assert found.before_strike.time[-1] < pi / results.SPEED
    said = comparison_text(found)
    assert "-1e-06 s" in said
    assert "0.0004 N s" in said


@pytest.mark.parametrize("swap", [False, True])
def test_a_strike_that_a_run_misses_shifts_no_other(rigid, swap):
    missing = later(rigid, 1e-6, lambda touch: touch.begin > 1.0)
    pair = (missing, rigid) if swap else (rigid, missing)
    first, second = compare(*pair).strikes
    assert (first.second is None) is not swap
    assert (first.first is None) is swap
    assert (first.lap, second.lap) == (1, 3)
    assert None not in (second.first, second.second)
    assert "no strike" in comparison_text(compare(*pair))


# --- guides with clearance


def straight(tilting):
    """The same mechanism without clearance, and the link straight on the axis."""
    poses = tilting.poses.copy()
    poses[:, 1, 2] = poses[:, 0, 2]
    joints = dict(tilting.scene.joints)
    joints["sleeve"] = joints["sleeve"].model_copy(update={"clearance": 0.0, "law": None})
    return replace(tilting, scene=tilting.scene.changed(joints=joints), poses=poses, sleeves={})


def rows_of(said, name):
    return [line.split("  ") for line in said.splitlines() if line.startswith(f"  {name}")]


def test_contacts_of_both_runs_stand_side_by_side(tilting):
    part = results.first_samples(tilting, 2001)  # two of the four laps
    found = compare(tilting, part)
    one, other = found.first.contact["sleeve"], found.second.contact["sleeve"]
    assert one == other  # up to the end of the shorter run
    assert (one.touches, one.impacts) == (2, 2)
    (touches,) = rows_of(comparison_text(found), "sleeve: touches")
    assert [cell.strip() for cell in touches if cell.strip()][1:] == ["2", "2"]


@pytest.mark.parametrize("first", [True, False])
def test_a_run_with_clearance_beside_one_without(tilting, first):
    names = ("without", "with") if first else ("with", "without")
    runs = (straight(tilting), tilting) if first else (tilting, straight(tilting))
    found = compare(*runs, names=names)
    assert found.with_clearance == ("sleeve",)
    # Largest where it tilts most, by 0.06 over 70 mm; off the axis its start is in both.
    assert found.deviation.largest == pytest.approx(0.07 * 0.06, rel=2e-3)
    (row,) = rows_of(comparison_text(found), "sleeve: impacts")
    told = [cell.strip() for cell in row if cell.strip()][1:]
    assert told == (["no clearance", "6"] if first else ["6", "no clearance"])
    assert comparison(found) is not None


def test_an_angle_and_a_length_of_one_body_are_not_compared(rigid):
    slide = PrismaticJoint(points=("ground", "lever.start"), at=(0, 0), axis=(1, 0))
    joints = {**rigid.scene.joints, "pivot": slide}
    sliding = replace(rigid, scene=rigid.scene.changed(joints=joints, springs={}))
    assert compare(rigid, sliding, names=("turns", "slides")).levers == ()


# --- files, text and figure


@pytest.fixture(scope="module")
def both(rigid):
    other = later(shifted(rigid, (1e-6, 0, 1e-5), after=0.1), 1e-6)
    other = replace(other, settings=solved_to(1e-7))
    return compare(rigid, known(other, 1.5))


def test_files_say_what_was_found(both, tmp_path):
    save_study(both, tmp_path, tolerance=2e-6)
    found = json.loads((tmp_path / "comparison.json").read_text(encoding="utf-8"))
    assert found["program"] == "exudyn-flexlink"
    assert found["horizon_s"] == pytest.approx(1.5, abs=2e-3)
    # All is moved by 1e-6 m, and parts turned by 1e-5; the guide's end is 90 mm from its start.
    assert found["deviation"]["up_to_the_horizon"]["largest_m"] == pytest.approx(1.9e-6, rel=1e-4)
    assert found["exceeded"] is False
    assert found["runs"] == ["exudyn", "lagrangian"]
    assert found["beyond_the_horizon"]["exudyn"]["rms_m"][0] > 0.01
    table = np.genfromtxt(tmp_path / "comparison.csv", delimiter=",", names=True)
    assert len(table) == len(both.time)
    np.testing.assert_allclose(table["deviation_m"], both.deviation.distance, atol=1e-12)
    np.testing.assert_allclose(table["lagrangian_x_m"], both.second.position[:, 0], atol=1e-12)


def test_figure(both, rigid):
    with mpl.rc_context({"font.size": 3}):
        figure = comparison(both)
    said = "\n".join(text.get_text() for text in texts(figure))
    assert "hinges 'paper', n = 10" in said
    assert "lagrangian: tolerance 1e-07 m" in said
    assert {"beyond the horizon", "strike"} <= {text.get_text() for text in texts(figure)}
    for engine, colour in ENGINE_COLOURS.items():
        lines = [line for axes in figure.axes for line in axes.lines if line.get_label() == engine]
        assert len(lines) == 3
        assert all(same_color(line.get_color(), colour) for line in lines)
    assert min(text.get_fontsize() for text in texts(figure)) >= 9
    for axes in figure.axes:
        assert ")" in axes.get_ylabel()
    figure = comparison(compare(still(), still()))
    assert len(figure.axes) == 3
    assert "no difference" in {text.get_text() for text in texts(figure)}
    stopped = comparison(compare(rigid, results.stopped(rigid)))
    assert any(text.get_text().startswith("exudyn 2: stopped at t") for text in texts(stopped))


# --- vibrations -----------------------------------------------------------------------------------


def shaken():
    """The paper's rigid link whose end vibrates in x by 2 mm rms, at 40 Hz."""
    run = results.rigid_link(turns=2.0, samples=4001)
    way = 2e-3 * sqrt(2) * np.sin(2 * pi * 40 * run.time)
    poses = run.poses.copy()
    poses[:, 1:11, 0] += way[:, None]
    rates = np.gradient(poses, run.time, axis=0)
    return replace(run, poses=poses, rates=rates)


def test_vibration_about_the_guides_axis():
    seen = vibration(shaken())
    with pytest.raises(ValueError, match="the run ends at"):
        vibration(shaken(), 1e3)
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


def test_only_what_both_runs_have_lived_through_counts():
    run = shaken()
    whole = compare(run, run).statistics()
    part = compare(results.first_samples(run, int(0.2 / run.time[-1] * 4000)), run).statistics()
    assert [own.levers["lever"][0] for own in part] == [0.0, 0.0]  # the first strike is at 0.314 s
    assert whole[0].levers["lever"][0] < -0.1

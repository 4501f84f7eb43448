"""Clearance between link and guide: both engines against an independent integration and each other.

tests/data/clearance_*.csv hold the series and say how well they are known. Beyond half a second the
motion is sensitive: there only statistics are compared.
"""

from pathlib import Path

import numpy as np
import pytest
from benchmarks.series import deviation, read_series

from exudyn_flexlink.comparison import compare
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.observables import State, contact_states, lever_response, path

HERE = Path(__file__).parent
MODEL = HERE.parent / "models" / "clearance.yaml"
FIVE = ("bodies.link.rods=5", "bodies.link.hinges.stiffness=beam")
TIGHT = ("accuracy.tolerance=1e-6",)
SERIES = {"clearance_n5_beam": FIVE, "clearance_n10_paper": ()}
SERIES_END = {"clearance_n5_beam": 0.15, "clearance_n10_paper": 0.42}  # s


def run(engine, *settings):
    result = simulate(load_scene(MODEL, settings), engine, measure=False)
    assert result.outcome.completed, result.outcome
    return result


def along(engine, name, tolerance, end=None):
    """A run along a reference series, to its or an earlier end (s), and how far it is from that."""
    settings = (
        f"accuracy.tolerance={tolerance}",
        f"run={{duration: {end or SERIES_END[name]}, sample: 1 ms}}",
    )
    result = run(engine, *SERIES[name], *settings)
    series = read_series(HERE / "data" / f"{name}.csv")
    return result, deviation(result, series.time, series.position, series.lever_angle)


@pytest.mark.parametrize(
    ("engine", "tolerance", "limit"),
    [("exudyn", 1e-6, 1e-6), ("lagrangian", 1e-9, 2e-9), ("lagrangian", 1e-4, 1e-4)],
)
def test_s_with_five_stiff_rods(engine, tolerance, limit):
    assert along(engine, "clearance_n5_beam", tolerance)[1].largest < limit


@pytest.mark.parametrize("tolerance", [1e-3, 1e-7])
def test_the_lagrangian_keeps_its_tolerance_through_the_touches(tolerance):
    """To 0.3 s, 27 touches; the series is known to 1e-9 m, and 1e-7 m is its last rung."""
    assert along("lagrangian", "clearance_n10_paper", tolerance, 0.3)[1].largest < tolerance


def test_both_engines_with_ten_rods():
    """Through 37 touches, the last of them on both sides of the strike."""
    exudyn, found = along("exudyn", "clearance_n10_paper", 1e-6)
    judge, judged = along("lagrangian", "clearance_n10_paper", 1e-8)
    limits = ((exudyn, found, 1e-6, 2e-5, 1e-5), (judge, judged, 1.3e-9, 2.4e-6, 1e-9))
    for result, deviation_of_s, early, late, energy in limits:
        assert deviation_of_s.until(0.3).largest < early
        assert deviation_of_s.largest < late
        assert result.checks.energy_residual < energy * result.checks.largest_kinetic_energy
        assert result.checks.constraint_error < 1e-12
        parts = contact_states(result, "sleeve").fractions()
        two = parts[State.SAME_SIDE] + parts[State.OPPOSITE_SIDES]
        told = [100 * part for part in (parts[State.FREE], parts[State.ONE_POINT], two)]
        assert told == pytest.approx([65.8, 28.2, 6.0], abs=1)
    one, other = exudyn.sleeves["sleeve"], judge.sleeves["sleeve"]
    assert one.pairs == other.pairs
    assert one.sides == other.sides
    touches, judged = one.touches, other.touches
    # Pair by pair: which of two comes first that begin within the tolerance, nobody knows.
    mine, theirs = (np.lexsort((all_.begin, all_.pair)) for all_ in (touches, judged))
    assert touches.pair[mine].tolist() == judged.pair[theirs].tolist()
    off = np.abs(touches.begin[mine] - judged.begin[theirs]) * judged.approach_speed[theirs]
    assert off.max() < 1e-6  # m: what the tolerance asks for
    assert touches.impulse[mine] == pytest.approx(judged.impulse[theirs], rel=0.03, abs=1e-7)
    assert touches.energy_lost.sum() == pytest.approx(judged.energy_lost.sum(), rel=5e-3)
    assert one.deepest == pytest.approx(other.deepest, rel=1e-2)


def test_the_lever_at_the_accuracy_the_model_ships_with():
    response = lever_response(run("exudyn", "run={duration: 0.42, sample: 1 ms}"), "strike")
    assert response.least[0] == pytest.approx(-0.14155, abs=4e-4)
    assert response.greatest[0] == pytest.approx(0.10322, rel=3e-3)


@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
def test_no_touch_is_made_of_rounding(engine):
    """Where a pair parts slowly its gap is zero within a step's errors for long: it parts once."""
    settings = [
        "joints.sleeve.clearance=0.3 mm",
        "joints.sleeve.law.restitution=1",
        "run.turns=0.4",
    ]
    result = simulate(load_scene(MODEL, settings), engine, measure=False)
    touches = result.sleeves["sleeve"].touches
    assert len(touches) > 30
    assert (touches.end - touches.begin).min() > 1e-8
    assert touches.penetration.min() > 1e-12
    largest = result.checks.largest_kinetic_energy  # no touch takes energy, and it is kept
    assert result.checks.energy_residual < 1e-5 * largest
    closed = touches.end < result.time[-1]
    assert abs(touches.energy_lost[closed]).max() < 1e-5 * largest


VARIANTS = {
    "friction": ("joints.sleeve.law.friction=0.15",),
    "free guide under a torque": ("drives.motor={type: torque, joint: crank, value: 0.004}",),
    "gravity": ("gravity=[1, -9.81]",),
    "half ends, backwards": ("bodies.link.layout=half_ends", "drives.motor.value=-10"),
    "supported": ("joints.sleeve={type: sleeve, guide: guide, link: link, supported: true, "
                  "law: {stiffness: 1.0e5, restitution: 0.5}}",),
}  # fmt: skip


@pytest.mark.parametrize("name", VARIANTS)
def test_the_engines_agree(name):
    settings = (
        "bodies.link.rods=3",
        *TIGHT,
        "run={duration: 0.15, sample: 1 ms}",
        *VARIANTS[name],
    )
    exudyn, judge = run("exudyn", *settings), run("lagrangian", *settings)
    times = np.arange(0, 0.15, 1e-3)
    at, there = (np.searchsorted(r.time, times - 1e-9) for r in (exudyn, judge))
    one, other = (path(r, "link.end").position[i] for r, i in ((exudyn, at), (judge, there)))
    assert np.linalg.norm(one - other, axis=1).max() < 5e-6
    for forces, judged in ((exudyn.slot_forces, judge.slot_forces),
                           (exudyn.joint_forces, judge.joint_forces),
                           (exudyn.drive_torques, judge.drive_torques)):  # fmt: skip
        for key in judged:
            apart = np.abs(forces[key][at] - judged[key][there]).mean()
            assert apart < 0.1 * np.abs(judged[key]).mean() + 1e-6, key


def test_a_link_at_rest_stays_there_where_it_ends_in_the_mouth_of_its_guide():
    """Nothing pushes it: whether its end is inside or outside is decided by rounding."""
    settings = (
        "bodies.link.rods=3",
        "joints.crank={type: weld, points: [ground, guide.start], at: [0.02, 0]}",
        "drives=null",
        "run={duration: 0.5}",
        "solver.formulation=redundant",
    )
    result = simulate(load_scene(MODEL.with_name("supported.yaml"), settings), measure=False)
    assert result.outcome.completed, result.outcome
    assert path(result, "link.end").position[0] == pytest.approx([0.11, 0.0], abs=1e-15)
    assert np.abs(result.poses - result.poses[0]).max() < 1e-12


def test_a_held_link_and_a_bearing_of_one_law_keep_the_energy():
    """The same numbers press a link from both sides, and a journal from outside."""
    settings = (
        "bodies.link.rods=3",
        "joints.pivot.clearance=1e-4",
        "joints.pivot.law={stiffness: 1e5, restitution: 0.5}",
        "gravity=[0, 50]",
        "run={duration: 0.01}",
        "solver.formulation=redundant",
    )
    result = simulate(load_scene(MODEL.with_name("supported.yaml"), settings), measure=False)
    assert result.checks.energy_residual < 1e-6 * result.checks.largest_kinetic_energy


# --- walls ----------------------------------------------------------------------------------------


def test_a_fixed_step_is_shortened_while_a_wall_is_touched():
    """A touch lasts 0.09 ms: steps of 1 ms would go over it."""
    short = "run={duration: 0.15, sample: 1 ms}"
    fixed = ["accuracy={step: 1.0e-3}", "solver.formulation=minimal"]
    result, exact = (
        simulate(load_scene(MODEL, [short, "bodies.link.rods=3", *settings]), measure=False)
        for settings in (fixed, ["accuracy.tolerance=1e-8"])
    )
    assert any("in contact steps were" in warning for warning in result.warnings)
    assert compare(result, exact).deviation.largest < 1e-6


def test_a_rod_that_bends_past_the_end_of_its_guide_touches_however_short():
    """Of 26 touches some last 3e-7 to 2e-6 s: one rod's joint passes the end as the gap closes.

    A run that misses one is off by 1e-8 m.
    """
    assert along("exudyn", "clearance_n10_paper", 1e-8, 0.3)[1].largest < 1e-9

"""Two runs tell how far the finer one is off: held against truth, and what is told of both."""

from dataclasses import replace
from math import inf, nan
from pathlib import Path

import numpy as np
import pytest
import results
from benchmarks.series import deviation, read_series
from cli_runs import MODELS, NO_CLEARANCE
from random_strikes import draw
from scipy.integrate import solve_ivp

from exudyn_flexlink import engines
from exudyn_flexlink.cli import main
from exudyn_flexlink.effects import idealise
from exudyn_flexlink.engines import LateInterruptError, simulate
from exudyn_flexlink.engines.finer import measured_by, partner, unmeasured
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.observables import common_times, path, positions, separation
from exudyn_flexlink.observables.parting import FACTOR
from exudyn_flexlink.report import run_text
from exudyn_flexlink.result import INTERRUPTED, NOT_ASKED, EngineSettings, Integrator, Outcome
from exudyn_flexlink.scene import Outputs
from exudyn_flexlink.storage import load, save

HERE = Path(__file__).parent
G = 9.81
BOTH = pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])

# --- the told error bounds the true one


@BOTH
@pytest.mark.parametrize(
    ("name", "model", "settings"),
    [
        ("smooth_n10_beam", "smooth", ["run.turns=0.5"]),
        ("smooth_n10_beam", "smooth", ["run.turns=0.5", "accuracy.tolerance=1e-3"]),
        ("strike_n10_paper", "no_clearance", ["run.turns=0.6"]),
        ("clearance_n10_paper", "clearance", ["run.turns=0.35", "accuracy.tolerance=1e-5"]),
    ],
)
def test_the_told_error_bounds_the_distance_from_an_independent_integration(
    name, model, settings, engine
):
    scene = load_scene(MODELS / f"{model}.yaml", [*settings, "run.sample=1 ms"])
    found = simulate(scene, engine, measure=True)
    series = read_series(HERE / "data" / f"{name}.csv")
    off = deviation(found, series.time, series.position, series.lever_angle)
    assert found.scene == scene
    assert found.settings.integrator.tolerance == pytest.approx(0.1 * scene.accuracy.tolerance)
    assert off.largest <= found.error.largest <= 3 * scene.accuracy.tolerance
    assert (found.error.exceeds_from is None) == (not found.warnings)


def double_pendulum(instants):
    """Lower end (n, 2) of two bars of 1 m and 1 kg, let go from the horizontal."""

    def rates(_, y):
        one, other, w, u = y
        c, s = 0.5 * np.cos(one - other), 0.5 * np.sin(one - other)
        mass = np.array([[4 / 3, c], [c, 1 / 3]])
        force = [-s * u * u - 1.5 * G * np.cos(one), s * w * w - 0.5 * G * np.cos(other)]
        return [w, u, *np.linalg.solve(mass, force)]

    found = solve_ivp(
        rates, (0, instants[-1]), np.zeros(4), "DOP853", instants, rtol=1e-13, atol=1e-14
    )
    one, other = found.y[:2]
    return np.column_stack([np.cos(one) + np.cos(other), np.sin(one) + np.sin(other)])


def test_a_double_pendulum_says_from_when_on_it_is_off():
    """Of 12 s the last ones are, though every step keeps its part of the tolerance."""
    scene = load_scene(MODELS / "textbook" / "double_pendulum.yaml", ["run.duration=12"])
    found = simulate(scene, measure=True)
    off = positions(found, ["lower.b"], found.time)[:, 0] - double_pendulum(found.time)
    apart = np.hypot(*off.T)
    tolerance = scene.accuracy.tolerance
    assert apart.max() <= found.error.largest
    assert apart[found.time < found.error.exceeds_from].max() <= tolerance
    assert f"from t = {found.error.exceeds_from:.4g} s on" in found.warnings[0]


LIMP = [
    "bodies.link.rods=4",
    "bodies.link.hinges={stiffness: 1.0e-6, damping: 0}",
    "gravity=[0, -9.81]",
    "drives.motor.value=4",
    "run={turns: 0.35, of: crank, sample: 2 ms}",
]
RINGING = [
    "bodies.link.rods=6",
    "bodies.link.hinges={stiffness: 0.0091, damping: 0}",
    "gravity=[0, -9.81]",
    "drives.motor.value=2.5",
    "run={turns: 0.35, of: crank, sample: 2 ms}",
]


@pytest.mark.parametrize("settings", [LIMP, RINGING])
def test_links_that_keep_or_multiply_errors_have_them_told(settings):
    """One hangs like a chain; the other rings, and what single steps lose of that adds up."""
    scene = idealise(load_scene(MODELS / "no_clearance.yaml", settings), ["impact"])
    exact = simulate(scene.changed(accuracy={"tolerance": 1e-7}), "lagrangian")
    for engine in ("exudyn", "lagrangian"):
        found = simulate(scene.changed(accuracy={"tolerance": 1e-5}), engine, measure=True)
        time = common_times(exact, found)
        off = separation(exact, found, time)[time < found.error.known_until]
        assert off.max() <= found.error.largest


PUSHED, STIFF, AROUND = 19.0, 1e7, 0.08  # N/m of the spring and of the peg; m, the spring's length
PEG_AT, REACH = (0.5834, 0.0576), 0.0094  # m: of the peg, with the radius of the ball
START, FROM = (0.8, 0.1), (-1.836, -1.934)
ON_A_SPRING = f"""title: a ball on a spring strikes a small peg, and once more after four seconds
bodies: {{ball: {{type: rigid, mass: 1, inertia: 0, points: {{c: [0, 0]}}}}}}
springs:
  s: {{type: linear, points: [ground, ball.c], at: [0, 0], stiffness: {PUSHED}, length: {AROUND}}}
contacts:
  hit:
    type: circle_on_circle
    circles:
      - {{at: ball.c, radius: 1 mm}}
      - {{at: ground, place: [{PEG_AT[0]}, {PEG_AT[1]}], radius: {REACH - 1e-3}}}
    law: {{stiffness: {STIFF}, restitution: 1}}
gravity: 9.81
initial:
  positions: {{ball: [{START[0]}, {START[1]}]}}
  velocities: {{ball: [{FROM[0]}, {FROM[1]}]}}
run: {{duration: 6}}
accuracy: {{tolerance: 1.0e-6}}
"""


def on_a_spring(times):
    """Places (n, 2) of the ball, by an explicit method whose steps end where it touches."""
    peg = np.array(PEG_AT)

    def rates(_, y):
        far, away = np.hypot(*y[:2]), y[:2] - peg
        force = -PUSHED * (far - AROUND) * y[:2] / far + (0.0, -9.81)
        depth = REACH - np.hypot(*away)
        if depth > 0:
            force = force + STIFF * depth * away / np.hypot(*away)
        return np.array([*y[2:], *force])

    def gap(_, y):
        return float(np.hypot(*(y[:2] - peg)) - REACH)

    gap.terminal = True
    found, begin, y = np.full((len(times), 2), np.nan), 0.0, np.array([*START, *FROM])
    accuracy = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-15, "max_step": 2e-3}
    while begin < times[-1]:
        part = solve_ivp(rates, (begin, times[-1]), y, events=gap, dense_output=True, **accuracy)
        end = float(part.t[-1])
        own = (times >= begin) & (times <= end)
        found[own] = part.sol(times[own])[:2].T
        moment = 1e-12  # s: on to where the event is over
        y, begin = part.y[:, -1] + moment * rates(end, part.y[:, -1]), end + moment
    return found


def test_two_strikes_of_a_peg_part_motions_and_are_told():
    found = simulate(results.scene_from(ON_A_SPRING), measure=True)
    assert len(found.contacts["hit"].touches) == 2
    off = np.hypot(*(path(found, "ball.c").position - on_a_spring(found.time)).T)
    assert np.nanmax(off) <= found.error.largest  # an event's own sample may fall between two parts


def test_a_strike_that_slides_off_a_face_is_told():
    """What is left of the error of a place is multiplied as the pressed lever goes free."""
    settings = [*draw(np.random.default_rng([11, 289]), undamped=True), "run.turns=0.6"]
    settings += ["run.sample=1 ms"]
    model = MODELS / "no_clearance.yaml"
    exact = simulate(load_scene(model, [*settings, "accuracy.tolerance=1e-9"]), "lagrangian")
    for engine in ("exudyn", "lagrangian"):
        found = simulate(load_scene(model, settings), engine, measure=True)
        assert separation(exact, found, common_times(exact, found)).max() <= found.error.largest


# --- which runs are made


def test_where_something_else_bounds_steps_the_second_run_has_shorter_ones_all_the_same():
    """At 1e-3 m a turn bounds them; by a method of order 9 a tenth of the error is 0.77 of it."""
    scene = load_scene(MODELS / "smooth.yaml", ["run.turns=1", "accuracy.tolerance=1e-3"])
    one, two = simulate(scene), simulate(scene, measure=True)
    assert two.checks.steps >= 1.2 * one.checks.steps


def test_a_method_of_order_2_makes_half_steps_also_in_contact():
    settings = ["solver.formulation=redundant", "run.turns=0.55", "accuracy.tolerance=1e-5"]
    scene = load_scene(MODELS / "rigid.yaml", settings)
    one, two = simulate(scene), simulate(scene, measure=True)
    assert two.settings.integrator.tolerance == pytest.approx(2.5e-6)
    assert two.checks.steps_per_contact == pytest.approx(2 * one.checks.steps_per_contact)
    assert two.error.other == 1e-5
    assert two.timings["second run"] > 0


def test_a_tenth_below_the_least_tolerance_the_second_run_is_the_coarser_one():
    least = ["accuracy.tolerance=3e-13", "run.turns=0.1", "bodies.link.rods=2"]
    scene = load_scene(MODELS / "smooth.yaml", least)
    assert partner(scene, 9) == 10
    found = simulate(scene, measure=True)
    assert found.settings.integrator.tolerance == 3e-13
    assert found.error.other == pytest.approx(3e-12)
    assert found.error.largest >= 3e-13
    np.testing.assert_array_equal(found.poses, simulate(scene).poses)


@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
def test_a_run_of_given_steps_is_made_once(engine):
    settings = ["accuracy.step=1e-4", "run.turns=0.02", "bodies.link.rods=2"]
    found = simulate(load_scene(MODELS / "smooth.yaml", settings), engine, measure=True)
    assert "second run" not in found.timings
    assert "not measured: with 'accuracy.step' one run is made" in " ".join(run_text(found).split())


# --- made-up runs


def made_up(outcome=None):
    """A run of the paper's mechanism that asks for 1e-5 m."""
    run = results.rigid_link(turns=1, samples=801)
    scene = run.scene.changed(accuracy={"tolerance": 1e-5})
    return replace(
        run, scene=scene, error=NOT_ASKED, warnings=(), laps=(), outcome=outcome or run.outcome
    )


def off_by(off, begin=0.5, end=inf):
    """The run, but from an instant to another one (s) so far off (m)."""
    run = made_up()
    poses = run.poses.copy()
    poses[(run.time >= begin) & (run.time < end), :, 0] += off
    return replace(run, poses=poses)


def test_the_finer_run_is_the_result_and_thrice_the_distance_its_error():
    first, finer = made_up(), off_by(1e-6)
    shares = []
    found = measured_by(first, lambda share: shares.append(share) or finer)
    assert shares == [0.1]
    np.testing.assert_array_equal(found.poses, finer.poses)
    assert found.error.largest == pytest.approx(FACTOR * 1e-6)
    assert found.error.exceeds_from is found.error.horizon is None
    assert found.warnings == ()
    said = " ".join(run_text(found).split())
    assert "All 8 named points within 3e-06 m" in said or "points within 3e-06 m" in said
    assert "asked 1e-05 m" in said


def test_no_less_is_told_than_the_finer_runs_tolerance():
    second_order = replace(made_up(), settings=EngineSettings(Integrator("any", 2)))
    assert measured_by(made_up(), lambda _: made_up()).error.largest == pytest.approx(1e-6)
    assert measured_by(second_order, lambda _: made_up()).error.largest == pytest.approx(2.5e-6)


def test_what_exceeds_the_tolerance_is_told_with_the_instant_and_the_horizon():
    """Points take 0.1 m or so: runs that are 1 mm apart have parted for good."""
    near = measured_by(made_up(), lambda _: off_by(1e-5))
    (told,) = near.warnings
    assert told.startswith(
        f"from t = {near.error.exceeds_from:.4g} s on, points may be off by more than 1e-05 m, and "
    )
    assert "by up to 3e-05 m, as a second run with other steps shows" in told
    assert near.error.exceeds_from == pytest.approx(0.5, abs=1e-3)
    assert near.error.horizon is None
    far = measured_by(made_up(), lambda _: off_by(1e-2))
    assert far.error.horizon == pytest.approx(0.5, abs=1e-3)
    (told,) = far.warnings
    assert told.endswith(f"; after t = {far.error.horizon:.4g} s trust statistics only")
    assert "the horizon: after it trust statistics only" in " ".join(run_text(far).split())
    assert "m, as asked, up to t =" in " ".join(run_text(near).split())


def test_runs_that_meet_again_have_been_apart():
    found = measured_by(made_up(), lambda _: off_by(1e-5, 0.2, 0.3)).error
    assert found.largest == pytest.approx(3e-5)
    assert found.exceeds_from == pytest.approx(0.2, abs=1e-3)
    met = measured_by(made_up(), lambda _: off_by(1e-2, 0.2, 0.3)).error
    assert met.horizon == pytest.approx(0.2, abs=1e-3)


def test_up_to_the_horizon_the_largest_error_is_that_of_before():
    first = off_by(-1e-6, 0.1)
    found = measured_by(first, lambda _: off_by(1e-2)).error
    assert found.horizon == pytest.approx(0.5, abs=1e-3)
    assert found.largest == pytest.approx(3e-6)


def test_an_error_exceeds_from_the_last_instant_at_which_it_is_known_not_to():
    first, other = made_up(), off_by(1e-5, 0.2)
    time = common_times(other, first)
    before = time[separation(other, first, time) * FACTOR <= 1e-5]
    assert measured_by(first, lambda _: other).error.exceeds_from == before[-1]


def test_runs_that_are_within_the_tolerance_have_not_parted_however_little_moves():
    """Points take 0.1 m or so, and 1 cm is asked for."""
    first = made_up()
    first = replace(first, scene=first.scene.changed(accuracy={"tolerance": 1e-2}))
    found = measured_by(first, lambda _: replace(off_by(1e-3), scene=first.scene))
    assert found.error.horizon is found.error.exceeds_from is None
    assert found.error.largest == pytest.approx(3e-3)


def test_a_distance_that_is_no_number_is_no_agreement():
    found = measured_by(made_up(), lambda _: off_by(nan))
    assert found.error.exceeds_from == found.error.horizon <= 0.5


def cut(reason):
    """The run, but it stopped half-way."""
    part = results.first_samples(off_by(1e-6, 0.0), 401)
    return replace(part, outcome=Outcome(False, float(part.time[-1]), reason))


def test_where_the_finer_run_stops_the_first_is_measured_up_to_there():
    first = made_up()
    found = measured_by(first, lambda _: cut("it broke"))
    np.testing.assert_array_equal(found.poses, first.poses)
    assert found.outcome.completed
    assert found.error.largest == pytest.approx(3e-6)
    assert found.error.stopped == found.error.known_until == first.time[400]
    (told,) = found.warnings
    assert f"was measured up to t = {first.time[400]:.4g} s only" in told


def test_a_run_that_stopped_is_left_as_it_is():
    stopped = made_up(Outcome(False, 0.1, "broke"))
    stopped = replace(stopped, error=unmeasured(stopped))
    assert measured_by(stopped, lambda _: 1 / 0) is stopped
    assert "not measured: the run stopped before its end" in run_text(stopped)


def raising(error):
    raise error


def test_ctrl_c_in_the_second_run_keeps_what_is_known():
    with pytest.raises(LateInterruptError) as caught:
        measured_by(made_up(), lambda _: raising(KeyboardInterrupt()))
    kept = caught.value.result
    assert kept.error.missing == "the second run was interrupted"
    assert len(kept.warnings) == 1
    with pytest.raises(LateInterruptError) as caught:
        measured_by(made_up(), lambda _: cut(INTERRUPTED))
    assert caught.value.result.error.stopped is not None
    with pytest.raises(LateInterruptError) as caught:
        measured_by(made_up(), lambda _: raising(LateInterruptError(off_by(1e-6))))
    assert caught.value.result.error.largest == pytest.approx(3e-6)


def test_too_little_memory_for_the_second_run_costs_nothing():
    found = measured_by(made_up(), lambda _: raising(MemoryError()))
    assert found.outcome.completed
    assert "not enough memory" in found.error.missing
    assert "not enough memory" in found.warnings[0]


def swinging(by=0.0, **points):
    """A pendulum of 0.2 m, whose start is pinned, turned by an angle (rad)."""
    run = results.pendulum()
    scene = run.scene.changed(accuracy={"tolerance": 1e-4}, **points)
    return replace(run, scene=scene, error=NOT_ASKED, poses=run.poses + np.array([0.0, 0.0, by]))


def test_all_named_points_judge_or_the_chosen_one_alone():
    found = measured_by(swinging(), lambda _: swinging(1e-4)).error
    assert found.worst == "rod.end"
    assert found.largest == pytest.approx(FACTOR * 2e-5, rel=1e-3)
    chosen = {"outputs": Outputs(watch="rod.centre")}
    half = measured_by(swinging(**chosen), lambda _: swinging(1e-4, **chosen)).error
    assert half.points == ("rod.centre",)
    assert half.largest == pytest.approx(FACTOR * 1e-5, rel=1e-3)


def test_a_run_of_which_no_point_moves_says_so_and_what_to_name():
    run = replace(swinging(), poses=np.zeros_like(swinging().poses))
    still = measured_by(run, lambda _: run)
    assert still.error.missing
    assert "a point off the axis of a body would show" in " ".join(run_text(still).split())


def test_the_error_is_kept_with_the_run(tmp_path):
    for other in (off_by(1e-2), made_up(), cut("it broke")):
        found = measured_by(made_up(), lambda _, other=other: other)
        save(found, tmp_path)
        assert load(tmp_path).error == found.error
    save(made_up(), tmp_path)
    assert load(tmp_path).error == NOT_ASKED


# --- at a terminal


@pytest.mark.parametrize("option", [[], ["--no-measure"]])
def test_simulate_measures_unless_told_not_to(option, monkeypatch, capsys):
    """The first run is saved before the second is waited for."""
    there = []

    def second(run, *_, **__):
        there.append(load(Path("here")).error)
        return measured_by(run, lambda _: off_by(1e-6))

    monkeypatch.setattr(engines, "simulate", lambda *_, **__: made_up())
    monkeypatch.setattr(engines, "measured", second)
    assert main(["simulate", NO_CLEARANCE, "--no-plots", "--out=here", *option]) == 0
    said = " ".join(capsys.readouterr().out.split())
    kept = load(Path("here")).error
    if option:
        assert there == []
        assert kept == NOT_ASKED
        assert "positions not measured: no second run was made" in said
    else:
        assert there == [NOT_ASKED]
        assert kept.largest == pytest.approx(3e-6)
        assert "points within 3e-06 m" in said

"""Errors of forces: what a second run tells of them, held against closed forms."""

import json
from dataclasses import replace
from math import inf, pi, sin, sqrt
from types import SimpleNamespace

import numpy as np
import pytest
import results
from cli_runs import MODELS
from scipy.interpolate import CubicSpline
from scipy.special import ellipj, ellipk

from exudyn_flexlink.accuracy import errors
from exudyn_flexlink.comparison import compare
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene, scene_of
from exudyn_flexlink.observables import force_deviations
from exudyn_flexlink.observables.parting import _inside
from exudyn_flexlink.plots import forces
from exudyn_flexlink.report import comparison_text, run_text
from exudyn_flexlink.report.run import force_error_table
from exudyn_flexlink.report.text import lines_of
from exudyn_flexlink.result import ForceDeviation, ForceSpread, Interval, MeasuredError
from exudyn_flexlink.source import parse_document
from exudyn_flexlink.storage import load, save, save_study

CRANK = "joint force of crank"
G, LENGTH, MASS = 9.81, 0.2, 7850 * 0.2 * 0.01 * 0.002  # of results.PENDULUM

ECCENTRIC = """title: a disk turned about a point beside its centre
bodies:
  disk: {type: rigid, mass: 2, inertia: 0.01, points: {pivot: [-0.1, 0]}}
joints:
  crank: {type: revolute, points: [ground, disk.pivot], at: [0, 0]}
drives:
  motor: {type: speed, joint: crank, value: 10 rad/s}
run: {turns: 1, of: crank}
accuracy: {tolerance: 1.0e-6}
"""


def scene_from(text, **accuracy):
    scene = scene_of(parse_document(text, "model.yaml"))
    return scene.changed(accuracy=type(scene.accuracy).model_validate(accuracy))


def force_on_a_falling_rod(time):
    """Force of the pin on a rod let go as it lies, N: closed form by elliptic functions.

    Its angle from the vertical is 2 asin(k sn(K - w t)) with w^2 = 3 g / (2 l), k = sin 45 deg.
    """
    w, k = sqrt(1.5 * G / LENGTH), sin(pi / 4)
    angle = 2 * np.arcsin(k * ellipj(ellipk(k * k) - w * time, k * k)[0])
    speed_squared, acceleration = 2 * w * w * np.cos(angle), -w * w * np.sin(angle)
    sine, cosine = np.sin(angle), np.cos(angle)
    x = acceleration * cosine - speed_squared * sine
    y = acceleration * sine + speed_squared * cosine
    return MASS * np.stack([LENGTH / 2 * x, LENGTH / 2 * y + G], axis=-1)


# --- told errors bound true ones


@pytest.mark.parametrize("formulation", ["minimal", "redundant"])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6])
def test_the_told_error_bounds_that_of_a_pendulums_force(formulation, tolerance):
    scene = scene_from(results.PENDULUM, tolerance=tolerance)
    scene = scene.changed(solver=scene.solver.model_copy(update={"formulation": formulation}))
    run = simulate(scene, measure=True)
    coarse, true = (
        np.linalg.norm(each.joint_forces["pin"] - force_on_a_falling_rod(each.time), axis=1).max()
        for each in (simulate(scene), run)
    )
    told = run.error.forces["joint force of pin"]
    assert told.touching is None
    assert told.free.size == pytest.approx(2.5 * MASS * G, rel=0.1)  # as the rod hangs
    assert true <= told.free.largest <= 3 * (coarse + true) + 1e-12


@pytest.mark.parametrize("tolerance", [1e-3, 1e-9])
def test_a_force_that_is_exact_is_known_to_rounding(tolerance):
    """The pivot of a disk pulls with m r w^2 = 20 N: no step errs, and no error of 0 is told."""
    run = simulate(scene_from(ECCENTRIC, tolerance=tolerance), measure=True)
    true = np.abs(np.linalg.norm(run.joint_forces["crank"], axis=1) - 20).max()
    told = run.error.forces[CRANK].free
    assert true <= told.largest <= 1e-9
    assert told.largest > 0


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6])
def test_the_told_error_bounds_that_of_a_flexible_link_whose_steps_something_else_bounds(tolerance):
    """At 1e-4 m and at 1e-5 m steps are the same: the runs agree, and told no error at all."""
    model = MODELS / "smooth.yaml"
    settings = ["bodies.link.rods=4", "run.turns=0.25"]
    scene = load_scene(model, [*settings, f"accuracy.tolerance={tolerance}"])
    found = simulate(scene, measure=True)
    judge = load_scene(model, [*settings, "accuracy.tolerance=1e-10"])
    true = force_deviations(found, simulate(judge, "lagrangian"))
    told = found.error.forces
    bending = "bending moment of link"
    assert set(told) == {"drive torque of motor", "slot force of pin", CRANK, bending}
    for name, own in told.items():
        assert true[name].free.largest <= own.free.largest <= 100 * true[name].free.largest
    assert found.checks.steps > simulate(scene).checks.steps


STRIKE = """title: a limp link strikes a light lever
materials: {steel: {density: 7850, youngs_modulus: 200 GPa}}
curves:
  track:
    type: joined
    pieces:
      - {type: ellipse, centre: [0, 0], semi_axes: [0.04, 0.03], from: -90 deg, to: 90 deg}
      - {type: circle, centre: [0, 0], radius: 0.03, from: 90 deg, to: 270 deg}
bodies:
  guide: {type: rod, length: 90 mm, material: steel, section: {width: 20 mm, thickness: 12 mm}}
  link:
    {type: flexible, length: 70 mm, material: steel, rods: 24,
     section: {width: 10 mm, thickness: 0.203 mm}, hinges: {stiffness: paper, damping: 3.8927e-06}}
  lever: {type: rod, length: 0.01685, material: steel, section: {width: 10 mm, thickness: 0.535 mm}}
joints:
  crank: {type: revolute, points: [ground, guide.start], at: [0.018358, 0]}
  sleeve: {type: sleeve, guide: guide, link: link, clearance: 0}
  pin: {type: slot, point: link.start, curve: track}
  pivot: {type: revolute, points: [ground, lever.start], at: [-0.110846, 0]}
springs:
  back: {type: torsional, joint: pivot, frequency: 14.649 Hz, damping_ratio: 0.5672}
contacts:
  strike: {type: point_on_line, point: link.end, line: [lever.start, lever.end],
           law: {stiffness: 32731, restitution: 0.37252}}
drives: {motor: {type: speed, joint: crank, value: 15.893 rad/s}}
run: {duration: 0.23}
accuracy: {tolerance: 1.0e-5}
"""


def inside(run):
    """Times since the begin of the only touch of a run's strike, forces there, and its begin."""
    touches = run.contacts["strike"].touches
    begin, end = touches.begin[0], min(touches.end[0], run.time[-1])
    part = (run.time >= begin) & (run.time < end)
    return run.time[part] - begin, run.contacts["strike"].force[part], begin


@pytest.fixture(scope="module")
def exact_strike():
    """A run whose steps are many enough for a spline through its samples: in 3e-7 s the force falls
    by 40 %.
    """
    return inside(simulate(scene_from(STRIKE, tolerance=1e-10)))


@pytest.mark.parametrize("tolerance", [3.9e-5, 1e-6])
def test_a_force_in_a_touch_is_within_what_is_told_and_so_is_its_begin(tolerance, exact_strike):
    """Held against an exact run, as if the touch began alike."""
    run = simulate(scene_from(STRIKE, tolerance=tolerance), measure=True)
    told = run.error.forces["contact force of strike"]
    time, force, begin = inside(run)
    exact_time, exact_force, exact_begin = exact_strike
    off = np.abs(force - CubicSpline(exact_time, exact_force)(time))[time <= exact_time[-1]]
    assert np.mean(off <= told.touching.largest) >= 0.99
    assert told.touching.largest <= 100 * off.max()
    assert abs(begin - exact_begin) <= told.instants <= 1e-2 * time[-1]


def test_two_samples_of_a_touch_that_are_one_rounding_apart_count_as_the_later():
    """At another event within it forces leap; since the touch's begin both are one instant."""
    time = np.array([0.1, 0.2, 0.5, 0.75, np.nextafter(0.75, 1), 0.8])
    run = SimpleNamespace(time=time, contacts={"hit": SimpleNamespace(force=np.arange(6.0))})
    since, force = _inside(run, "hit", 0.125 + 2**-54, 0.8)
    assert (np.diff(since) > 0).all()
    assert force.tolist() == [1, 2, 4]


# --- which instants count


def linked(touches=(), more=0.0, when=None):
    """The paper's rigid link, the force in whose crank is `more` N larger at instants (a mask)."""
    scene = load_scene(results.MODEL, ["run.turns=1", f"run.sample={2e-4 * pi}"])
    run = results.touched(results.rigid_link(turns=1, samples=1001, scene=scene), *touches)
    force = np.zeros((len(run.time), 2))
    force[:, 0] = 3.0
    force[slice(None) if when is None else when(run.time), 0] += more
    return replace(run, joint_forces={"crank": force}, laps=())


def test_a_difference_has_size_place_and_mean():
    there = 0.2
    other = linked(more=0.01, when=lambda t: np.abs(t - there) < 4e-4)
    own = force_deviations(linked(), other)[CRANK]
    assert own.unit == "N"
    assert own.touching is None
    assert own.free.largest == pytest.approx(0.01, rel=1e-2)
    assert own.free.at == pytest.approx(there, abs=1e-3)
    assert own.free.size == pytest.approx(3.01, rel=1e-3)
    assert own.free.relative == pytest.approx(0.01 / 3.01, rel=1e-2)
    assert 0 < own.free.rms < 0.01 / sqrt(100)


def test_nothing_is_told_beyond_an_instant():
    other = linked(more=0.01, when=lambda t: t > 0.3)
    assert force_deviations(linked(), other, until=0.29)[CRANK].free.largest == 0
    assert force_deviations(linked(), other)[CRANK].free.largest == pytest.approx(0.01)


def test_contact_is_told_apart_and_where_only_one_run_touches_nothing_is():
    """A strike that comes 5 ms later: 1 N of the contact is no error of 1 N in between."""
    one = linked([Interval(0.2, 0.25)], 1.0, lambda t: (t >= 0.2) & (t <= 0.25))
    late = (0.205, 0.255)
    other = linked([Interval(*late)], 1.02, lambda t: (t >= late[0]) & (t <= late[1]))
    own = force_deviations(one, other)[CRANK]
    assert own.free.largest == pytest.approx(0, abs=1e-12)
    assert own.touching.largest == pytest.approx(0.02)
    assert own.touching.size == pytest.approx(4.02)


def test_beside_an_impulse_nothing_is_told():
    """Forces leap there, in each run at its own instant."""
    one = linked([Interval(0.2, 0.2, peak_force=inf)], 1.0, lambda t: t >= 0.2)
    late = 0.2004
    other = linked([Interval(late, late, peak_force=inf)], 1.0, lambda t: t >= late)
    assert force_deviations(one, other)[CRANK].free.largest == pytest.approx(0, abs=1e-12)


# --- where it is told


def known(largest=0.01, touching=None, until=None):
    own = ForceDeviation("N", ForceSpread(largest, 0.1, largest / 4, 3.0), touching)
    error = MeasuredError(("link.end",), "link.end", 1e-6, 2e-7, forces={CRANK: own},
                          horizon=until)  # fmt: skip
    return replace(linked(), error=error)


def test_the_summary_tells_errors_of_forces_beside_those_of_positions():
    lines = run_text(known(touching=ForceSpread(0.5, 0.2, 0.1, 10.0), until=0.4)).splitlines()
    at = lines.index("Errors of forces, as a second run tells, up to t = 0.4 s")
    first, second = (" ".join(line.split()) for line in lines[at + 2 : at + 4])
    assert first == f"{CRANK} 0.01 N 0.33 % 0.10000 s 0.0025 N"
    assert second == "in contact 0.5 N 5 % 0.20000 s 0.1 N"
    assert "not measured" not in "\n".join(lines)
    told = f"within 0.33 % of their largest ({CRANK}) while nothing touches, up to t = 0.4 s"
    assert told in " ".join(" ".join(lines).split())
    assert "forces          not measured" in run_text(linked())


def test_a_run_is_read_back_with_errors_of_forces(tmp_path):
    run = known(touching=ForceSpread(0.5, 0.2, 0.1, 10.0), until=0.4)
    save(run, tmp_path)
    assert load(tmp_path).error == run.error


def test_a_comparison_tells_forces(tmp_path):
    found = compare(linked(), linked(more=0.01, when=lambda t: t > 0.3))
    assert found.forces[CRANK].free.largest == pytest.approx(0.01)
    text = comparison_text(found)
    assert "Forces, difference" in text
    assert any(line.split()[:6] == [*CRANK.split(), "0.01", "N"] for line in text.splitlines())
    save_study(found, tmp_path)
    data = json.loads((tmp_path / "comparison.json").read_text())
    told = data["forces_up_to_the_horizon"][CRANK]
    assert told["unit"] == "N"
    assert told["in_contact"] is None
    assert told["free"]["relative"] == pytest.approx(0.01 / 3.01)


def test_a_study_takes_the_force_that_is_farthest_off():
    found = errors(linked(more=0.03), linked(), until=1.0)
    assert found.worst_force == CRANK
    assert found.force == pytest.approx(0.03 / 3.03)
    assert found.times(2.0).force == pytest.approx(2 * found.force)


# --- figures


def labels(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def panel(figure, quantity):
    return next(axes for axes in figure.axes if quantity in axes.get_ylabel())


def test_the_figure_tells_the_error_and_draws_it_as_a_band():
    axes = panel(forces(known(largest=0.234)), "joint force")
    assert labels(axes) == ["crank at guide.start \N{PLUS-MINUS SIGN} 0.3"]
    (band,) = axes.collections
    (path,) = band.get_paths()
    assert path.vertices[:, 1].min() == pytest.approx(3 - 0.234)
    assert path.vertices[:, 1].max() == pytest.approx(3 + 0.234)
    assert labels(panel(forces(linked()), "joint force")) == ["crank at guide.start"]
    assert not panel(forces(linked()), "joint force").collections


def test_a_force_that_is_rounding_while_nothing_touches_has_no_row():
    """A journal that flies in its bearing pushes nothing: 333 % of 1e-30 N says nothing."""
    own = ForceDeviation("N", ForceSpread(3e-30, 0.1, 1e-31, 1e-30), ForceSpread(3.0, 0.2, 1, 100))
    told = "\n".join(lines_of(force_error_table({"slot force of way": own})))
    assert "slot force of way, in contact" in told
    assert "333" not in told

"""The implicit method in the Lagrangian: tolerance, events, and places on the track."""

from pathlib import Path

import numpy as np
import pytest
from benchmarks.series import deviation, read_series
from cli_runs import MODELS

from exudyn_flexlink.curves import Arc, LineSegment, Spline, circle_arc, evaluator
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.engines.lagrangian.system import TrackPoint
from exudyn_flexlink.engines.track_follower import DeadCentreError
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.mechanism import Anchor, Slot

HERE = Path(__file__).parent
EXPLICIT = ("solver.integrator=dop853", "accuracy.tolerance=1e-8")
FIVE = ("bodies.link.rods=5", "bodies.link.hinges.stiffness=beam")
STRIKE = ("no_clearance.yaml", *FIVE, "run.turns=0.53", "run.sample=1 ms")

# --- places on the track ------------------------------------------------------------------------

POINTS = [(0.05, 0.0), (0.03, 0.03), (-0.03, 0.035), (-0.045, -0.01), (0.01, -0.04)]
PIECES = {
    "ellipse": Arc((0.01, -0.02), (0.04, 0.03), 0.3, 0.2, 2.5),
    "circle": circle_arc((0.0, 0.01), 0.05),
    "line": LineSegment((0.04, -0.03), (0.03, 0.03)),
    "open spline": Spline(np.array(POINTS)),
    "closed spline": Spline(np.array(POINTS), closed=True),
    "part of a spline": Spline(np.array(POINTS), closed=True).part(0.02, 0.11),
}


@pytest.mark.parametrize("name", PIECES)
def test_places_are_those_of_the_curves(name):
    piece = PIECES[name]
    at, every = evaluator(piece), np.linspace(piece.start - 0.01, piece.end + 0.01, 41)
    found = np.array(piece.places(every))
    for k, u in enumerate(every):
        assert found[:, k].copy().view(float) == pytest.approx(at(u), rel=1e-13, abs=1e-15)


def crossed(piece, centre, theta, u):
    """Parameters and points (x, y) where axes at angles cross a piece, from P at `u`."""
    point = TrackPoint(Slot("pin", Anchor(0, 0.0, 0.0), piece), piece.start, 0, [])
    point.u = u
    found, places = point.crossed(complex(*centre), np.exp(1j * np.atleast_1d(theta)))
    return found, places[0]


@pytest.mark.parametrize("name", ["ellipse", "circle", "line", "part of a spline"])
def test_the_guides_axis_crosses_the_piece_where_it_should(name):
    piece, centre = PIECES[name], (0.005, -0.002)
    for u in np.linspace(piece.start, piece.end, 9)[1:-1]:
        x, y = piece.point(u)
        theta = np.arctan2(y - centre[1], x - centre[0])
        found, places = crossed(piece, centre, theta, u + 1e-3 * piece.period)
        assert found[0] == pytest.approx(u, abs=1e-12)
        assert places[0] == pytest.approx(complex(x, y), abs=1e-15)
    with pytest.raises(DeadCentreError):
        crossed(PIECES["circle"], (1.0, 0.0), np.pi / 2, 0.1)


THIN = Arc((0.0, 0.0), (0.04, 1e-3))
TIPS = [(0.05, 0.0), (0.012, 0.05), (-0.04, 0.02), (-0.02, -0.04), (0.03, -0.025)]
DENTS = [(0.015, 0.012), (-0.01, 0.015), (-0.02, -0.005), (0.005, -0.015)]
STAR = [point for pair in zip(TIPS, DENTS, strict=False) for point in pair]
BENT = Spline(np.array([*STAR, TIPS[-1]]), closed=True)


@pytest.mark.parametrize("at", [-0.039, 0.0, 0.02, 0.039])
def test_p_stays_on_its_side_of_the_pivot(at):
    """Whether the guide turns a little or nearly a right angle: an ellipse has a closed form."""
    for angle in np.linspace(0, 2 * np.pi, 37):
        before = _ray(at, angle)
        u = float(np.arctan2(before[1] / 1e-3, before[0] / 0.04))
        for turned in (-1.5, -0.4, -0.05, 0.05, 0.4, 1.5):
            after = complex(*_ray(at, angle + turned))
            _, places = crossed(THIN, (at, 0.0), angle + turned, u)
            assert places[0] == pytest.approx(after, abs=1e-14)


def _ray(at, angle):
    """Where the ray from (at, 0) meets the thin ellipse."""
    c, s = np.cos(angle), np.sin(angle)
    a, b, d = (c / 0.04) ** 2 + (s / 1e-3) ** 2, at * c / 0.04**2, (at / 0.04) ** 2 - 1
    r = (-b + np.sqrt(b * b - a * d)) / a
    return at + r * c, r * s


def test_p_is_not_found_beyond_a_dead_centre():
    """Nor another crossing than that which the track leads to: walked along it by hand."""
    u = np.linspace(0, BENT.period, 20_001)
    angles = np.unwrap(np.angle(BENT.places(u)[0]))
    dead = found = 0
    for start in range(100, 15_000, 290):
        way = np.sign(angles[start + 1] - angles[start])
        gone = way * (angles[start:] - angles[start])
        for turned in (0.1, 0.25, 0.4):
            target = angles[start] + way * turned
            end = int(np.argmax(gone >= turned))
            if end > 0 and (np.diff(gone[: end + 1]) > 0).all():
                place, _ = crossed(BENT, (0.0, 0.0), target, u[start])
                assert place[0] == pytest.approx(u[start + end], abs=2 * u[1])
                found += 1
            else:
                with pytest.raises(DeadCentreError):
                    crossed(BENT, (0.0, 0.0), target, u[start])
                dead += 1
    assert found > 40
    assert dead > 20


# --- whole runs ---------------------------------------------------------------------------------


def run(*settings):
    result = simulate(load_scene(MODELS / STRIKE[0], [*STRIKE[1:], *settings]), "lagrangian")
    assert result.outcome.completed
    return result


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6])
def test_the_error_of_s_keeps_the_tolerance_and_does_not_waste_it(tolerance):
    """Over two turns, against the independent series, which knows S to 6e-8 m."""
    series = read_series(HERE / "data" / "strike_n5_beam.csv")
    result = run(f"accuracy.tolerance={tolerance}", "run.turns=2")
    assert result.settings.integrator.tolerance == tolerance
    found = deviation(result, series.time, series.position, series.lever_angle)
    assert tolerance / 100 < found.largest < tolerance
    assert found.largest_angle * 0.03 < tolerance
    assert result.checks.steps < 900
    assert result.checks.newton_iterations > result.checks.steps
    assert result.warnings == ()


@pytest.mark.parametrize(("tolerance", "part"), [(1e-4, 2e-4), (1e-6, 5e-6)])
def test_energies_are_those_of_the_stages_as_solved(tolerance, part):
    """From rates before the last correction the balance misses 2.4e-3 and 4.2e-5 of the energy."""
    settings = [f"accuracy.tolerance={tolerance}", "run.turns=0.6"]
    checks = simulate(load_scene(MODELS / "no_clearance.yaml", settings), "lagrangian").checks
    assert checks.energy_residual < part * checks.largest_kinetic_energy


def test_events_are_those_of_the_explicit_method():
    few = ("bodies.link.rods=2", "initial.angles.guide=175 deg", "run.turns=0.036")
    fine = "run.sample=0.1 ms"
    ours, other = run("accuracy.tolerance=1e-10", *few, fine), run(*EXPLICIT, *few, fine)
    assert ours.settings.integrator.method == "Radau IIA"
    assert other.settings.integrator.method == "DOP853"
    assert len(ours.events) == len(other.events) >= 4
    for mine, theirs in zip(ours.events, other.events, strict=True):
        assert (mine.kind, mine.name) == (theirs.kind, theirs.name)
        assert mine.time == pytest.approx(theirs.time, abs=1e-9)
        assert mine.details.keys() == theirs.details.keys()
        for key, value in mine.details.items():
            # The largest force is seen at looks within steps, not between them.
            allowed = 2e-3 if key == "peak_force" else 1e-6
            assert value == pytest.approx(theirs.details[key], rel=allowed, abs=1e-11), key
    # Beside those asked for there are samples at steps in contact: each has its own, some by chance
    # within a nanosecond of one another.
    _, i, k = np.intersect1d(ours.time.round(12), other.time.round(12), return_indices=True)
    assert len(i) > 200
    assert np.abs(ours.poses[i] - other.poses[k]).max() < 1e-9 / 0.07
    for name in ("kinetic", "stored", "dissipated", "supplied"):
        mine, theirs = getattr(ours.energy, name)[i], getattr(other.energy, name)[k]
        assert mine == pytest.approx(theirs, abs=1e-6 * ours.checks.largest_kinetic_energy), name
    assert ours.checks.steps < other.checks.steps / 2


def test_a_ramp_and_a_torque_are_met():
    """A drive that comes up over 50 ms, and a free guide under a torque and gravity."""
    ramp = "drives.motor={type: speed, joint: crank, value: 10, ramp: 50 ms}"
    torque = "drives.motor={type: torque, joint: crank, value: 0.01, ramp: 30 ms}"
    for drive, more in ((ramp, ()), (torque, ("gravity=[1, -9.81]",))):
        settings = (drive, "bodies.link.rods=2", "run={duration: 0.08, sample: 1 ms}", *more)
        runs = [
            simulate(load_scene(MODELS / "smooth.yaml", [*settings, *own]), "lagrangian")
            for own in (["accuracy.tolerance=1e-8"], EXPLICIT)
        ]
        assert np.abs(runs[0].poses - runs[1].poses).max() < 1e-8 / 0.07
        for name, force in runs[0].joint_forces.items():
            assert force == pytest.approx(
                runs[1].joint_forces[name], abs=2e-4 * np.abs(force).max()
            )


def test_a_dead_centre_ends_the_run_and_says_so():
    """A circle that does not go round C: the guide's axis comes to touch it."""
    scene = load_scene(
        MODELS / "smooth.yaml",
        ["curves.t={type: circle, centre: [0.06, 0], radius: 0.02}", "joints.pin.curve=t",
         "bodies.link.rods=2", "initial.guesses.guide=0.1", "accuracy.tolerance=1e-4"],
    )  # fmt: skip
    result = simulate(scene, "lagrangian")
    assert not result.outcome.completed
    assert "the guide's axis" in result.outcome.reason
    assert result.time[-1] == pytest.approx((np.arcsin(0.5) - 0.1) / 10, abs=1e-6)


def test_steps_that_get_shorter_and_shorter_turn_no_point_round():
    """Those of SciPy's method to a dead centre, where rounding moves P to and fro."""
    scene = load_scene(MODELS / "hard" / "dead_centre.yaml", ["solver.integrator=dop853"])
    result = simulate(scene, "lagrangian")
    assert "the guide's axis" in result.outcome.reason
    assert result.checks.steps > 30
    assert max(len(extreme.time) for extreme in result.extremes.values()) < 10

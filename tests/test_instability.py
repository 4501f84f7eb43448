"""Motion in which errors grow by themselves, or do not die out: they are measured."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from exudyn_flexlink import load_scene
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.effects import idealise
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.engines.diagnostics.amplification import beyond_steps
from exudyn_flexlink.integrate.growth import Growth
from exudyn_flexlink.loading import scene_of
from exudyn_flexlink.measured_error import MeasuredError
from exudyn_flexlink.observables import positions
from exudyn_flexlink.result import Result
from exudyn_flexlink.source import parse_document

MODELS = Path(__file__).parent.parent / "models"
G = 9.81  # m/s^2
SPIN, LASTS = 3.0, 2.0  # rad/s, s

BEAD = f"""title: a bead in the groove of a spoke that turns evenly
curves:
  groove: {{type: line, from: [0, 0], to: [100, 0], on: spoke}}
bodies:
  spoke: {{type: rigid, mass: 1, inertia: 1, points: {{hub: [0, 0]}}}}
  bead: {{type: rigid, mass: 0.1, inertia: 0, points: {{c: [0, 0]}}}}
joints:
  hub: {{type: revolute, points: [ground, spoke.hub], at: [0, 0]}}
  slot: {{type: slot, point: bead.c, curve: groove}}
drives: {{motor: {{type: speed, joint: hub, value: {SPIN}}}}}
initial: {{positions: {{bead: [0.1, 0]}}, speeds_along: {{slot: 0}}}}
run: {{duration: {LASTS}}}
accuracy: {{tolerance: 1.0e-6}}
"""
SWING = """title: a bar swings through less than a right angle to either side
bodies:
  bar: {type: rigid, mass: 1, inertia: 0.1, centre_of_mass: [0.5, 0], points: {pin: [0, 0]}}
joints: {pin: {type: revolute, points: [ground, bar.pin], at: [0, 0]}}
gravity: 9.81
initial: {angles: {bar: -10 deg}}
run: {duration: 5}
accuracy: {tolerance: 1.0e-6}
"""
PAST_A_FOOT = """title: a mass flies past the foot of its spring, five times
bodies:
  mass: {type: rigid, mass: 1, inertia: 0, points: {c: [0, 0]}}
springs:
  s: {type: linear, points: [ground, mass.c], at: [0, 0], stiffness: 1000, length: 0.3}
initial: {positions: {mass: [-2, 1.0e-4]}, velocities: {mass: [3, 0]}, angles: {mass: 0}}
run: {duration: 3}
accuracy: {tolerance: 1.0e-6}
"""
# A link whose hinges hold next to nothing, so that it swings as a chain.
LIMP = [
    "bodies.link.rods=4",
    "bodies.link.hinges={stiffness: 1.0e-6, damping: 0}",
    "gravity=[0, -9.81]",
    "drives.motor.value=4",
    "run.turns=1",
]
RINGING = [
    "bodies.link.rods=6",
    "bodies.link.hinges={stiffness: 0.0091, damping: 0}",
    "gravity=[0, -9.81]",
    "drives.motor.value=2.5",
    "run.turns=2",
]


def run(text: str) -> Result:
    return simulate(scene_of(parse_document(text, "test")))


def test_errors_of_a_bead_on_a_spoke_grow_with_its_speed() -> None:
    """Of r'' = omega^2 r: by e in 1/omega."""
    assert run(BEAD).checks.e_folds == pytest.approx(SPIN * LASTS, rel=1e-4)


def test_a_swing_below_the_horizontal_lets_no_error_grow() -> None:
    found = run(SWING)
    assert found.checks.e_folds == 0
    assert found.error is None


def test_a_bar_that_turns_over_its_top_wins_what_it_lost() -> None:
    """Between bottom and top its speed changes by 1.4: so do errors, lap after lap."""
    found = run(SWING.replace("{bar: -10 deg}}", "{bar: -90 deg}, speeds: {bar: 15}}"))
    slowest = np.sqrt(15**2 - 4 * 9.81 * 0.5 / (0.1 + 0.5**2))
    assert found.checks.e_folds == pytest.approx(np.log(15 / slowest), rel=0.2)
    assert found.error is None


def test_a_bar_that_leaves_its_top_is_measured() -> None:
    """It starts at rest, 1e-4 rad off: its fall makes that ten thousand times as large."""
    found = run(SWING.replace("-10 deg", f"{np.pi / 2 - 1e-4} rad"))
    assert found.checks.e_folds > np.log(1e4)
    assert found.error is not None


def double_pendulum(instants: FloatArray) -> FloatArray:
    """Lower end (n, 2) of two bars of 1 m and 1 kg, let go from the horizontal."""

    def rates(_: float, y: FloatArray) -> list[float]:
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


def test_a_double_pendulum_says_from_when_on_it_is_off() -> None:
    """Of 14 s the last six are, at the end by hundreds of tolerances: how far is told roughly."""
    found = simulate(load_scene(MODELS / "textbook" / "double_pendulum.yaml", ["run.duration=14"]))
    off = positions(found, ["lower.b"], found.time)[:, 0] - double_pendulum(found.time)
    apart = np.hypot(*off.T)
    tolerance = found.scene.accuracy.tolerance
    assert apart.max() > 50 * tolerance
    assert found.error is not None
    assert found.error.largest > 0.5 * apart.max()
    assert found.error.exceeds_from < found.time[apart > tolerance][0] + 0.5  # s
    assert any("the motion is unstable" in line for line in found.warnings)


def test_passing_the_foot_of_a_spring_is_told() -> None:
    """The place at which the mass passes decides on where the spring throws it."""
    found = run(PAST_A_FOOT)
    assert found.checks.e_folds > 3
    assert any("the motion is unstable" in line for line in found.warnings)


def test_growth_is_that_of_the_fastest_solution_that_grows() -> None:
    """Of x'' = k x - c x' and, beside it, y'' = -y: by e in 1/(sqrt(c^2/4 + k) - c/2)."""
    k, c, between = 4.0, 3.0, 0.5
    growth = Growth(between)
    shifts = np.full(2, 1e-5), np.full(2, 1e-5)

    def accelerations(q: FloatArray, v: FloatArray) -> FloatArray:
        return np.column_stack([k * q[:, 0] - c * v[:, 0], -q[:, 1]])

    growth.look(0.0, (np.array([0.3, 0.1]), np.zeros(2)), shifts, accelerations)
    growth.go(0.2)
    assert growth.e_folds == pytest.approx(0.2 * (np.sqrt(c**2 / 4 + k) - c / 2), rel=1e-6)
    assert not growth.due(0.9 * between)
    assert growth.due(between)


def moving(settings: list[str], tolerance: float, engine: str, measure: bool = True) -> Result:
    changed = [*settings, f"accuracy.tolerance={tolerance}"]
    scene = idealise(load_scene(MODELS / "no_clearance.yaml", changed), ["impact"])
    return simulate(scene, engine, measure=measure)


def told(
    settings: list[str], tolerance: float, engine: str, why: str
) -> tuple[MeasuredError, FloatArray, FloatArray]:
    """Error that a run tells for a reason; how far S is off (n,), m, at instants (n,), s."""
    found = moving(settings, tolerance, engine)
    judge = [*settings, "solver.integrator=dop853"]
    exact = moving(judge, 1e-12, "lagrangian", measure=False)
    times = exact.time[np.isin(exact.time, found.time)]
    ends = (positions(each, ["link.end"], times)[:, 0] for each in (found, exact))
    assert any(why in line for line in found.warnings)
    assert found.error is not None
    return found.error, np.hypot(*np.subtract(*ends).T), times


@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
def test_a_limp_link_says_from_when_on_it_is_off(engine: str) -> None:
    error, apart, times = told(LIMP, 1e-5, engine, "the motion is unstable")
    assert apart.max() > 1e-4
    assert error.largest >= apart.max() / 2  # of the order of the link, once all is lost
    assert error.exceeds_from <= times[apart > 1e-5][0]


@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
def test_vibrations_that_nothing_damps_say_that_they_are_off(engine: str) -> None:
    """What single steps lose of them adds up: to more than the tolerance, after 550 steps."""
    error, apart, _ = told(RINGING, 1e-5, engine, "vibrations are hardly damped")
    assert error.largest >= apart.max() > 1e-5
    damped = [line.replace("damping: 0", "damping: 2.0e-5") for line in RINGING]
    assert moving(damped, 1e-5, engine).error is None


@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
def test_a_guide_that_holds_a_link_on_its_axis_is_none_with_play(engine: str) -> None:
    """No touches tell there that errors last: its vibrations have to be looked at."""
    held = [*RINGING, "run.turns=1"]
    scene = idealise(load_scene(MODELS / "supported.yaml", held), ["impact"])
    assert "vibrations are hardly damped" in beyond_steps(simulate(scene, engine, measure=False))
    damped = simulate(scene.with_({"bodies.link.hinges.damping": 2e-5}), engine, measure=False)
    assert beyond_steps(damped) == ""

"""Radau IIA against closed forms."""

import numpy as np
import pytest
from cli_runs import MODELS
from numpy.polynomial import Polynomial
from scipy.integrate import solve_ivp

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.engines.touching import SHORTEST_SWING
from exudyn_flexlink.integrate.events import Crossing, Guard
from exudyn_flexlink.integrate.problem import FEW, MANY, Evaluation, Pressing, State
from exudyn_flexlink.integrate.radau import ErrorTimes, Radau, collocation
from exudyn_flexlink.integrate.stepper import ErrorControl, HybridProblem, ImplicitStepper
from exudyn_flexlink.loading import load_scene

TIMES = ErrorTimes(SHORTEST_SWING, 0.25 * SHORTEST_SWING)


class Oscillator:
    """``m q'' = -k q - d q'`` for several independent masses."""

    def __init__(self, mass, stiffness, damping):
        self.mass, self.stiffness, self.damping = map(np.diag, (mass, stiffness, damping))

    def evaluate(self, t, q, v):
        return Evaluation(self.mass, -self.stiffness @ q - self.damping @ v)

    def evaluate_stages(self, t, q, v):
        found = [self.evaluate(*at) for at in zip(t, q, v, strict=True)]
        mass, force, touching = (np.array([getattr(at, name) for at in found])
                                 for name in ("mass", "force", "touching"))  # fmt: skip
        return Evaluation(mass, force, None, touching)

    def jacobians(self, at):
        return self.stiffness, self.damping

    def contacts_at(self, at):
        return None

    def size(self, change):
        return float(np.abs(change).max())


class Pressed(Oscillator):
    """A mass on a face: ``f = -k q [(1 + e^2)/2 - (1 - e^2)/2 tanh(v/v_s)]``, besides springs."""

    k, e, v_s = 2e4, 0.5, 5e-3

    def evaluate(self, t, q, v):
        free = super().evaluate(t, q, v)
        touching = np.array([[q[0], v[0]]])
        force = free.force.copy()
        force[0] += self.press(touching).force[0]
        return Evaluation(self.mass, force, None, touching)

    def press(self, touching):
        q, v = touching[..., 0], touching[..., 1]
        rising, lossy = np.tanh(-v / self.v_s), (1 - self.e**2) / 2
        factor = self.k * ((1 + self.e**2) / 2 + lossy * rising)
        return Pressing(-q * factor, factor, -q * self.k * lossy * (1 - rising**2) / self.v_s)

    def contacts_at(self, at):
        return np.eye(len(self.mass))[:1], self.press


class LetGo(Pressed):
    """What presses the mass on a face that returns nothing fades: it creeps, and then is off."""

    e, pressing, lasts = 0.0, 2.5, 2e-3  # N, s

    def evaluate(self, t, q, v):
        at = super().evaluate(t, q, v)
        at.force[0] -= self.pressing * (1 - t / self.lasts)
        return at


def advance(problem, q, v, h, count, *, stages=FEW):
    """State after `count` steps, and the steps."""
    radau = Radau(problem, TIMES, np.zeros((len(q), len(q))), collocation(stages))
    at = problem.evaluate(0.0, q, v)
    state = State(q, v, np.linalg.solve(at.mass, at.force))
    steps = []
    for i in range(count):
        at = problem.evaluate(i * h, state.q, state.v)
        step = radau.step(i * h, h, at, state, 1e-12)
        assert step is not None
        steps.append(step)
        state = step.finish
    return state, steps


def exact(t, frequency, damping):
    """From q = 1 at rest."""
    decay, swing = damping / 2, np.sqrt(frequency**2 - damping**2 / 4)
    return np.exp(-decay * t) * (np.cos(swing * t) + decay / swing * np.sin(swing * t))


@pytest.mark.parametrize("stages", [FEW, MANY])
def test_the_method_is_radau_iia(stages):
    """Collocation: exact for polynomials up to degree s - 1 at the stages, 2 s - 2 at the end."""
    method = collocation(stages)
    a, c = method.a, method.c
    for degree in range(stages):
        np.testing.assert_allclose(a @ c**degree, c ** (degree + 1) / (degree + 1), atol=1e-13)
    for degree in range(method.order):
        assert method.weights @ c**degree == pytest.approx(1 / (degree + 1), abs=1e-13)
    inverse = ((method.from_systems * method.eigenvalues) @ method.to_systems).real
    np.testing.assert_allclose(inverse @ a, np.eye(stages), atol=1e-12)


@pytest.mark.parametrize(
    ("stages", "counts", "order"), [(FEW, (3, 4, 6, 8), 9), (MANY, (2, 3, 4), 13)]
)
def test_the_order_on_a_damped_oscillation(stages, counts, order):
    errors = []
    for count in counts:
        problem = Oscillator([2.0], [2.0 * 9.0], [2.0 * 0.2])
        state, _ = advance(problem, np.array([1.0]), np.zeros(1), 3.0 / count, count, stages=stages)
        errors.append(abs(state.q[0] - exact(3.0, 3.0, 0.2)))
    orders = np.log(np.array(errors[:-1]) / errors[1:]) / np.log(np.divide(counts[1:], counts[:-1]))
    np.testing.assert_allclose(orders, order, atol=0.7)


@pytest.mark.parametrize("stages", [FEW, MANY])
def test_what_flies_evenly_is_known_to_rounding_all_along_a_step(stages):
    """Ends of steps are moved along their polynomials to events, and what is lost there adds up."""
    _, (step,) = advance(
        Oscillator([2.0], [0.0], [0.0]), np.array([0.1]), np.array([0.77]), 0.7, 1, stages=stages
    )
    time = np.linspace(0, 0.7, 101)
    q, v = step.at(time)
    np.testing.assert_allclose(q[:, 0], 0.1 + 0.77 * time, atol=3e-16)
    assert (v == 0.77).all()
    ended = step.ending(0.3)
    assert ended.finish.q[0] == pytest.approx(0.1 + 0.77 * 0.3, abs=3e-16)
    assert (ended.speeds == 0.77).all()


@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
@pytest.mark.parametrize(
    ("model", "tolerance", "order"),
    [("smooth", 1e-4, 13), ("no_clearance", 1e-5, 9), ("no_clearance", 1e-6, 13)],
)
def test_with_contacts_the_order_is_lower_at_loose_tolerances(model, tolerance, order, engine):
    settings = ["run.turns=0.01", f"accuracy.tolerance={tolerance}"]
    scene = load_scene(MODELS / f"{model}.yaml", settings)
    assert simulate(scene, engine).settings.integrator.order == order


def test_what_a_contact_no_longer_damps_counts_as_error():
    """Steps that begin while the mass creeps, a stiff damper, and end where it is gone.

    None that would be good enough makes more than that, in its place or its speed.
    """
    problem, good_enough = LetGo([1e-3], [0.0], [0.0]), 1e-7

    def rates(t, y):
        return [y[1], problem.evaluate(t, y[:1], y[1:]).force[0] / 1e-3]

    exactly = {"rtol": 1e-12, "atol": 1e-15, "method": "Radau"}
    creeping = solve_ivp(rates, (0, 1.8e-3), [-2.5e-4, 0.0], dense_output=True, **exactly).sol
    for begin in (1.5e-3, 1.7e-3, 1.8e-3):
        for h in (2e-4, 6e-4):
            y = creeping(begin)
            at = problem.evaluate(begin, y[:1], y[1:])
            state = State(y[:1], y[1:], at.force / 1e-3)
            step = Radau(problem, TIMES, np.zeros((1, 1)), collocation(FEW)).step(
                begin, h, at, state, 1e-12
            )
            off = step.finish[:2] - solve_ivp(rates, (begin, begin + h), y, **exactly).y[:, -1:]
            if step.error <= good_enough:
                assert max(abs(off[0, 0]), SHORTEST_SWING * abs(off[1, 0])) <= good_enough


def test_stiff_damping_dies_out_in_one_step():
    """L-stable: what decays within a thousandth of a step is gone at its end."""
    problem = Oscillator([1.0, 1.0], [1.0, 1e4], [0.0, 1e6])
    state, _ = advance(problem, np.array([1.0, 0.0]), np.array([0.0, 1.0]), 0.1, 1)
    assert abs(state.v[1]) < 1e-4
    assert state.q[0] == pytest.approx(np.cos(0.1), abs=1e-8)


def test_the_estimated_error_is_no_less_than_that_made():
    problem = Oscillator([1.0], [100.0], [0.0])
    for h in (0.05, 0.02, 0.01):
        state, steps = advance(problem, np.array([1.0]), np.zeros(1), h, 1)
        assert steps[0].error > abs(state.q[0] - np.cos(10 * h))


def test_between_steps_places_and_speeds_belong_together():
    """Both on the solution to the order of the stages, and one the derivative of the other."""
    problem = Oscillator([1.0], [9.0], [0.2])
    h = 0.2
    _, (step,) = advance(problem, np.array([1.0]), np.zeros(1), h, 1)
    times = np.linspace(0.0, h, 9)
    q, v = step.at(times)
    np.testing.assert_allclose(q[:, 0], exact(times, 3.0, 0.2), atol=2e-8)
    through = Polynomial.fit(times, q[:, 0], 6).deriv()
    np.testing.assert_allclose(v[:, 0], through(times), atol=1e-10)
    assert q[-1, 0] == pytest.approx(step.finish.q[0], abs=1e-13)
    assert v[-1, 0] == pytest.approx(step.finish.v[0], abs=1e-12)


class Swinging(HybridProblem):
    """An oscillator in whose steps something happens, once, at 3 ms, as their polynomials tell."""

    def __init__(self, model, guard):
        self.model, self.guard, self.state = model, guard, (np.ones(1), np.zeros(1))

    def begin(self, at):
        pass

    def restart(self, time):
        at = self.model.evaluate(time, *self.state)
        return at, State(*self.state, at.accelerations)

    def position_per_speed_error(self, at):
        return np.zeros((1, 1))

    def longest(self, at):
        return 1.0

    def slipped(self, step):
        return 0.0

    def accept(self, step):
        self.state = step.finish[:2]

    def first_event(self, step):
        return Crossing(3e-3, self.guard) if step.t < 3e-3 < step.end else None


class Far(Guard):
    """What a step to it misses by its whole length, `times` times."""

    def __init__(self, times):
        self.times = times

    def late(self, step):
        self.times -= 1
        return -step.h if self.times >= 0 else 0.0


@pytest.mark.parametrize(("misses", "landed"), [(0, 3e-3), (1, 0.0), (9, 0.0)])
def test_a_step_that_misses_its_event_is_made_from_nearer_but_once(misses, landed):
    """A longer step's polynomial may only come near it; what is missed again is met as it is."""
    model = Oscillator([2.0], [18.0], [0.4])
    model.knots = tuple
    problem = Swinging(model, Far(misses))
    stepper = ImplicitStepper(model, problem, ErrorControl(1e-6, FEW), TIMES, 1.0)
    stepper.begin()
    stepper.h = 9e-3
    event = stepper.advance(1.0)
    assert stepper.time == pytest.approx(landed)
    assert (event is None) == (landed == 0.0)
    while event is None:
        event = stepper.advance(1.0)
    assert stepper.time == pytest.approx(3e-3)
    assert stepper.steps < 9

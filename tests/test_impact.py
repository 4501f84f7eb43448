"""Impact by impulse and momentum (paper, eq. 2 to 4): a bouncing mass, and the lever's strike.

The point mass is driven by the same event loop, the same jump and the same rule for the end of the
bouncing as the mechanism.
"""

import numpy as np
import pytest
from cli_runs import MODELS

from exudyn_flexlink.effects import with_impact
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.engines.diagnostics import is_over
from exudyn_flexlink.engines.lagrangian.problem import strike
from exudyn_flexlink.engines.lagrangian.run import prepare, solve
from exudyn_flexlink.integrate.events import Crossing, first_fall
from exudyn_flexlink.integrate.explicit import ExplicitStepper
from exudyn_flexlink.integrate.solve import Solution
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.observables import lever_response, strikes
from exudyn_flexlink.source import SceneError

MODEL = MODELS / "no_clearance.yaml"
SHORT = ("run.turns=0.54", "bodies.link.rods=5", "bodies.link.hinges.stiffness=beam")
TIGHT = "accuracy.tolerance=1e-7"
LATE = ("initial.angles.guide=176 deg", "run.turns=0.059")  # the strike is at 180 deg
EARLIER = ("initial.angles.guide=172 deg", "run.turns=0.07")


class Ball:
    """A point mass above a floor, height q and speed v; it lies still when its bounces end."""

    over = False

    def __init__(self, gravity=9.81, restitution=0.9):
        self.gravity, self.restitution = gravity, restitution
        self.resting, self.hits, self.rest_time = False, [], None
        self.q, self.v = np.ones(1), np.zeros(1)

    def accelerate(self, t, q, v):
        return np.array([0.0 if self.resting else -self.gravity])

    def begin(self):
        """Nothing is to be taken up."""

    def first_event(self, step):
        if self.resting:
            return None
        height, speed = (lambda t, k=k: step.at(np.array([t]))[k][0, 0] for k in (0, 1))
        time = first_fall(height, speed, (step.t, step.t + step.h))
        return None if time is None else Crossing(time, "hit")

    def longest(self):
        return np.inf

    def accept(self, step):
        self.q, self.v = (own[0] for own in step.at(np.array([step.t + step.h])))

    def cross(self, event):
        over = is_over(-self.v[0], self.restitution, -self.gravity)
        e = 0.0 if over else self.restitution
        self.hits.append(event.time)
        if over:
            self.resting, self.rest_time = True, event.time
        self.v = self.v + strike(np.eye(1), np.ones(1), self.v[0], e).jump
        return np.inf


def bounced(ball):
    """The stepper that followed the ball for 10 s."""
    stepper = ExplicitStepper(ball, 1e-7)
    Solution(stepper, ball, [10.0]).run()
    return stepper


def test_bouncing_ball_hits_and_comes_to_rest_when_it_must():
    ball = Ball()
    stepper = bounced(ball)
    first = np.sqrt(2 / 9.81)
    assert ball.hits[0] == pytest.approx(0.451524, abs=5e-7)
    assert ball.hits[0] == pytest.approx(first, abs=1e-11)
    bounces = first * (1 + 2 * np.cumsum(0.9 ** np.arange(1, 60)))
    assert ball.hits[1:60] == pytest.approx(bounces, abs=1e-9)
    assert ball.rest_time == pytest.approx(8.578949, abs=4e-6)  # bounces below 1e-6 m/s are cut
    assert stepper.steps < 2000
    assert [*ball.q, *ball.v] == pytest.approx([0, 0], abs=1e-9)


def test_jump_of_a_coupled_system():
    random = np.random.default_rng(3)
    mass = random.uniform(size=(4, 4))
    mass, gradient = mass @ mass.T + np.eye(4), random.uniform(-1, 1, 4)
    v = random.uniform(-1, 1, 4)
    v *= -np.sign(gradient @ v)
    hit = strike(mass, gradient, gradient @ v, 0.3)
    after = v + hit.jump
    assert gradient @ after == pytest.approx(-0.3 * gradient @ v, rel=1e-12)
    assert mass @ hit.jump == pytest.approx(gradient * hit.impulse, rel=1e-12)
    lost = 0.5 * v @ mass @ v - 0.5 * after @ mass @ after
    assert hit.energy_lost == pytest.approx(lost, rel=1e-12)


def impulse_scene(restitution, *settings, model=MODEL):
    law = f"contacts.strike.law={{type: impulse, restitution: {restitution}}}"
    return load_scene(model, [law, *SHORT, TIGHT, *settings])


@pytest.mark.parametrize(
    ("model", "late"),
    [
        ("no_clearance.yaml", ("initial.angles.guide=175 deg", "run.turns=0.06")),
        # In its guide the link rattles first.
        ("clearance.yaml", ("initial.angles.guide=150 deg", "run.turns=0.13")),
    ],
)
def test_each_impact_balances_momentum_and_energy(model, late):
    """Before and after: M dv = G p, kinetic energy with the drive's work, and -e v_a = v_s."""
    run = prepare(impulse_scene(0.5, "bodies.link.rods=2", *late, model=MODELS / model))
    problem, states = run.problem, []
    jump = problem.impacts._jump

    def noted(k, e):
        before = problem.begin_motion()
        hit = jump(k, e)
        states.append((e, hit, before, problem.begin_motion()))
        return hit

    problem.impacts._jump = noted
    assert solve(run) == ""
    # Five nodes tell a wall's power less exactly in the one step in which its force turns from
    # loading to unloading: in 2 of 5 runs with speeds that differ by 1e-12 that is 1.1e-8.
    exact = 1e-9 if model == "no_clearance.yaml" else 3e-8
    recorder = problem.recorder
    assert recorder.energy_residual < exact * recorder.largest_kinetic_energy
    assert sum(e > 0 for e, *_ in states) > 10
    for e, hit, before, after in states:
        v, w, mass = before.frame.v[0], after.frame.v[0], before.mass[0]
        g = run.system.contacts.push(before.frame, np.array([0]), np.zeros(1)).rows[0, 0]
        momentum = (mass @ (w - v) - g * hit.impulse)[1:]
        rounding = 4e-16 * np.abs(mass) @ np.abs(v)  # of the speeds themselves
        allowed = 1e-12 * np.abs(g * hit.impulse).max() + rounding.max()
        assert momentum == pytest.approx(0, abs=allowed)
        kinetic = 0.5 * w @ mass @ w - 0.5 * v @ mass @ v
        change = hit.work - hit.energy_lost
        assert kinetic == pytest.approx(change, abs=1e-12 * (0.5 * v @ mass @ v))
        assert g @ w == pytest.approx(-e * g @ v, rel=1e-9, abs=1e-14)
        assert hit.approach_speed == pytest.approx(-g @ v, rel=1e-12)


@pytest.mark.parametrize(
    ("restitution", "rods", "start", "count"),
    [(0.0, 3, EARLIER, 4), (0.5, 5, LATE, 40), (1.0, 3, LATE, 10)],
)
def test_both_engines_bounce_alike_and_as_the_law_says(restitution, rods, start, count):
    """Every impact, and every contact that lasts."""
    settings = *start, f"bodies.link.rods={rods}"
    judge = simulate(impulse_scene(restitution, *settings), "lagrangian")
    ours = simulate(impulse_scene(restitution, *settings, "accuracy.tolerance=1e-9"))
    as_the_law_says(judge, restitution)
    expected, found = (result.contacts["strike"].touches for result in (judge, ours))
    assert len(expected) == len(found) == count
    allowed = {"begin": 1e-10, "end": 1e-9, "place": 1e-9, "approach_speed": 2e-7,
               "separation_speed": 2e-7, "impulse": 1e-9, "energy_lost": 1e-10,
               "motor_work": 1e-12}  # fmt: skip
    for column, error in allowed.items():
        a, b = getattr(found, column), getattr(expected, column)
        np.testing.assert_allclose(a, b, rtol=0, atol=error, err_msg=column)
    np.testing.assert_allclose(found.peak_force, expected.peak_force, rtol=1e-4)  # inf: an impact
    np.testing.assert_array_equal(found.slides_off, expected.slides_off)
    assert [event.kind for event in ours.events] == [event.kind for event in judge.events]
    a, b = (lever_response(result, "strike") for result in (ours, judge))
    assert a.least[0] == pytest.approx(b.least[0], abs=1e-9)
    assert a.greatest[0] == pytest.approx(b.greatest[0], abs=1e-9)
    assert ours.checks.energy_residual < 1e-8 * ours.checks.largest_kinetic_energy


def as_the_law_says(result, restitution):
    """Nothing penetrates, speeds are reversed by e, and energy is accounted for."""
    checks, history = result.checks, result.contacts["strike"]
    assert result.outcome.completed
    assert checks.largest_penetration < 1e-9
    assert checks.energy_residual < 1e-9 * checks.largest_kinetic_energy
    kinds = [event.kind for event in result.events]
    assert kinds[0] == "impact"
    assert strikes(result, "strike")[0].impulse > 0
    hits = [event.details for event in result.events if event.kind == "impact"]
    for hit in hits:  # those that end the bouncing stop the point
        left = hit["separation_speed"]
        assert left in (0, pytest.approx(restitution * hit["approach_speed"], rel=1e-12))
    if restitution == 1:  # exactly: no impact costs energy
        assert all(hit["separation_speed"] == hit["approach_speed"] for hit in hits)
        assert sum(hit["energy_lost"] for hit in hits) == 0
    if restitution == 0:
        begin, end = (
            next(event.time for event in result.events if event.kind == f"contact {word}")
            for word in ("begins", "ends")
        )
        inside = (result.time >= begin) & (result.time < end)
        assert np.abs(history.gap[inside]).max() < 1e-11
        assert history.force[inside].min() > 0
    if restitution == 0.5:
        assert 10 < len(hits) < 100
        assert {"contact begins", "contact ends", "leaves the face"} <= set(kinds)
        # An independent integration of the penalty law, 2e4 N/m, has the peak at -0.35792 rad.
        assert lever_response(result, "strike").least[0] == pytest.approx(-0.3622, abs=5e-4)


def test_a_lever_swings_past_the_point_beside_its_face():
    """At 0.32125 s, where the Lagrangian's step ends 4e-11 m past the line."""
    scene = load_scene(MODELS / "rigid.yaml", ["run.turns=0.65", "accuracy.tolerance=1e-5"])
    ours, judge = (simulate(with_impact(scene, "impulse"), by) for by in ("lagrangian", "exudyn"))
    assert ours.outcome.completed
    np.testing.assert_allclose(ours.poses[-1], judge.poses[-1], atol=1e-5)


def test_stiffness_is_no_part_of_an_impulse():
    law = "contacts.strike.law={type: impulse, restitution: 0.5, stiffness: 100}"
    with pytest.raises(SceneError, match="stiffness"):
        load_scene(MODEL, [law])


def test_the_law_is_changed_for_a_whole_scene():
    scene = load_scene(MODEL)
    rigid = with_impact(scene, "impulse")
    assert rigid.contacts["strike"].law.type == "impulse"
    assert rigid.contacts["strike"].law.restitution == 0.5
    assert with_impact(scene, "penalty") == scene
    with pytest.raises(SceneError, match="no stiffness"):
        with_impact(rigid, "penalty")
    with pytest.raises(ValueError, match="no impact 'glue'"):
        with_impact(scene, "glue")

"""Drives that are refused, and where: values that are none, poles, jumps, kinds that don't fit."""

from math import pi

import numpy as np
import pytest
from physics_tools import MODELS, scene
from scipy.special import beta
from test_drives import BOB, REDUNDANT, J, driven

from exudyn_flexlink.engines import NotRepresentableError, simulate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.source import SceneError


def mistake(drive, *settings, text=BOB):
    with pytest.raises(SceneError) as raised:
        scene(f"{text}drives: {{m: {drive}}}\n", *settings)
    return str(raised.value)


@pytest.mark.parametrize(("drive", "words"), [
    ("{type: speed, joint: pivot, value: 'where(t < 1, 2, 3)'}", "jumps from 2 to 3 at t = 1 s"),
    ("{type: motion, joint: pivot, value: 'abs(t - 1)'}", "the speed jumps from -1 to 1"),
    ("{type: motion, joint: pivot, value: 'sqrt(t)'}", "no derivative at t = 0 s"),
    ("{type: motion, joint: pivot, value: 'log(t)'}", "no value at t = 0 s"),
    ("{type: torque, joint: pivot, value: 'sqrt(1 - t)'}", "no value at t = 1.005 s"),
    ("{type: torque, joint: pivot, value: 'sin(t - 1.5)/(t - 1.5)'}", "no value at t = 1.5 s"),
    ("{type: motion, joint: pivot, value: '1/(t - 0.4321)'}", "no value at t = 0.4321 s"),
    ("{type: motion, joint: pivot, value: '2 + 3 deg * tan(2*pi*t/7)'}", "no value at t = 1.75 s"),
    ("{type: speed, joint: pivot, value: '(t - 0.4321)**-2'}", "no value at t = 0.4321 s"),
    ("{type: torque, joint: pivot, value: 'exp(1/(t - 0.4321))'}", "no value at t = 0.4321 s"),
    ("{type: torque, joint: pivot, value: 'where(t > 1, 1/(t - 1), 0)'}", "no value at t = 1 s"),
    ("{type: torque, joint: pivot, value: 'where(t > 0, 1/t, 0)'}", "no value at t = 0 s"),
    ("{type: torque, joint: pivot, value: '0/0'}", "'0/0' has no value at t = 0 s"),
    ("{type: torque, joint: pivot, value: '0*t/(t - t)'}", "no value at t = 0 s"),
    ("{type: torque, joint: pivot, value: '0 * (1/0)'}", "no value at t = 0 s"),
    ("{type: torque, joint: pivot, value: 't * 0/(1 - 1)'}", "no value at t = 0 s"),
    ("{type: force, point: bob.hook, value: [0/0, 0]}", "'0/0' has no value at t = 0 s"),
    ("{type: torque, joint: pivot, value: 'where(t < 1, 1, sqrt(t - 1 - 1e-6))'}",
     "no value at t = 1 s"),
    ("{type: speed, joint: pivot, value: 'sqrt(3 - t)'}", "no derivative at t = 3 s"),
    ("{type: torque, joint: pivot, value: 'log(speed(pivot))'}", "no value at t = 0 s"),
    ("{type: speed, joint: pivot, value: 'angle(pivot)'}", "a speed is of t alone"),
    ("{type: speed, joint: pivot, value: '2*t', ramp: 1}", "a ramp belongs to a number"),
    ("{type: speed, joint: pivot, value: {points: [[0, 1], [2, 2]], rule: linear}}",
     "the table ends at 2 s, the run at 3 s"),
    ("{type: speed, joint: pivot, value: {points: [[0, 1], [0, 2]], rule: linear}}",
     "times must increase"),
    ("{type: speed, joint: pivot, value: {points: [[1, 1], [4, 2]], rule: linear}}",
     "must begin at time 0"),
    ("{type: speed, joint: pivot, value: {points: [[0, 1], [4, 2]], rule: step}}", "can't jump"),
    ("{type: motion, joint: pivot, value: {points: [[0, 1], [4, 2]], rule: linear}}", "can't jump"),
    ("{type: motion, joint: pivot, value: 5 mm}", "expected an angle"),
    ("{type: torque, joint: pivot, value: '5 mm * sin(t)'}", "expected a torque, got a length"),
    ("{type: torque, joint: pivot, value: '2*speed(pvot)'}", "did you mean 'pivot'"),
    ("{type: torque, joint: pivot, value: 'place(bob.hok, x)'}", "has no point 'hok'"),
    ("{type: torque, joint: pivot, value: 'place(pivot)'}", "needs a prismatic joint"),
    ("{type: force, point: bob.hook, axes: bab, value: [0, 1]}", "unknown body 'bab'"),
    ("{type: force, point: bob.hook, value: [0, sn(t)]}", "did you mean 'sin'"),
    ("{type: torque, joint: pivot, value: {file: ../x.csv, rule: step}}", "in the model's folder"),
])  # fmt: skip
def test_mistakes_stand_at_the_drive(drive, words):
    text = mistake(drive)
    assert words in text
    assert "law.yaml:" in text


@pytest.mark.parametrize("value", [
    "where(t > 0.4321, sin(t - 0.4321)/(t - 0.4321), 1)",
    "where(t > 0, sin(t)/t, 1)",
    "where(t < 0.4, 1/(0.5 - t), 10)",
    "1/((t - 0.4321)**2 + 1e-6)",
    "t/(t*t - t + 1)",
    "log(t + 1e-3)",
])  # fmt: skip
def test_a_formula_that_stays_bounded_is_taken(value):
    scene(f"{BOB}drives: {{m: {{type: torque, joint: pivot, value: '{value}'}}}}\n")


def test_an_expression_elsewhere_is_called_one():
    assert "an expression can't stand here" in mistake(
        "{type: torque, joint: pivot, value: 1}", "run.duration=2*3 s"
    )


def test_turns_of_a_drive_that_varies_need_an_end():
    """Its turns may never be made; with at_most the run ends when they are."""
    turns = BOB.replace("duration: 3", "turns: 1, of: pivot")
    drive = "{type: motion, joint: pivot, value: t**2}"
    assert "missing 'at_most'" in mistake(drive, text=turns)
    result = driven(drive, turns.replace("of: pivot", "of: pivot, at_most: 9"))
    assert result.time[-1] == pytest.approx((2 * pi) ** 0.5, abs=1e-12)


def test_a_formula_that_ends_within_a_run_is_named():
    """J a'' = sqrt(1 - a) comes to a = 1, where the root ends, after sqrt(J/3) B(2/3, 1/2)."""
    text = f"{BOB}drives: {{m: {{type: torque, joint: pivot, value: 'sqrt(1 - angle(pivot))'}}}}\n"
    for settings in ((), REDUNDANT):
        outcome = simulate(scene(text, *settings)).outcome
        assert not outcome.completed
        assert "'sqrt(1 - angle(pivot))' has no value at t = 1.3" in outcome.reason
        assert outcome.time == pytest.approx(np.sqrt(J / 3) * beta(2 / 3, 1 / 2), abs=1e-4)


def test_a_formula_of_the_state_without_a_value_past_a_knot_ends_the_run():
    """J a'' = 1 N m up to 1 s. What was computed until then is kept."""
    value = "where(t < 1, 1, sqrt(angle(pivot) - 100000))"
    text = f"{BOB}drives: {{m: {{type: torque, joint: pivot, value: '{value}'}}}}\n"
    for settings in ((), REDUNDANT):
        result = simulate(scene(text, *settings))
        assert not result.outcome.completed
        assert f"'{value}' has no value at t = 1 s" in result.outcome.reason
        assert "mend the expression" in result.outcome.advice
        assert result.outcome.time == pytest.approx(1)
        assert result.time[-1] > 0.9
        assert result.poses[:, 0, 2] == pytest.approx(result.time**2 / (2 * J), rel=1e-6)


@pytest.mark.parametrize("settings", [(), REDUNDANT])
def test_a_formula_with_a_hole_at_the_end_is_as_given_before_it(settings):
    """The root ends where the run does: no step asks for what comes after."""
    text = f"{BOB}drives: {{m: {{type: torque, joint: pivot, value: 'sqrt(3 - t)'}}}}\n"
    result = simulate(scene(text, *settings))
    assert result.outcome.completed
    assert result.drive_torques["m"][:-1] == pytest.approx(np.sqrt(3 - result.time[:-1]), abs=1e-9)


def test_the_lagrangian_takes_numbers_alone():
    rigid = load_scene(MODELS / "no_clearance.yaml", ["drives.motor.value=12 + sin(t)",
                                                      "run.at_most=1"])  # fmt: skip
    with pytest.raises(NotRepresentableError) as raised:
        simulate(rigid, engine="lagrangian")
    assert "numbers" in str(raised.value)


@pytest.mark.parametrize(
    "drive",
    [
        "{type: torque, joint: pivot, value: min(t, 5)}",
        "{type: force, point: bob.centre, value: [where(t < 1, 5, 0), 0]}",
    ],
)
def test_an_expression_that_yaml_took_apart_at_its_commas_gets_the_hint_to_quote_it(drive):
    assert "hint: YAML ends a value at a comma" in mistake(drive)

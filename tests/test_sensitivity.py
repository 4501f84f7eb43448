"""Sensitivities of runs: closed forms, told errors, and what is refused."""

from math import sqrt

import pytest
from physics_tools import scene

import exudyn_flexlink as fl

BOUNCE = """
bodies: {ball: {type: rigid, mass: 2, inertia: 0.1, points: {c: [0, 0]}}}
joints: {way: {type: prismatic, points: [ground, ball.c], at: [0, 0], axis: [0, 1]}}
curves: {floor: {type: line, from: [-1, 0], to: [1, 0]}}
contacts:
  face: {type: point_on_curve, point: ball.c, curve: floor, side: left,
         law: {stiffness: 1.0e5, restitution: 1}}
initial: {positions: {ball: [0, 0.01]}, speeds_along: {way: -3}}
run: {duration: 0.05}
accuracy: {tolerance: 1.0e-7}
"""
STIFFNESS, MASS = "contacts.face.law.stiffness", "bodies.ball.mass"


def told(of, to, text=BOUNCE, **more):
    return fl.sensitivity(scene(text), of, to, workers=1, **more)


def test_a_spring_is_struck_by_the_root_of_stiffness_and_mass():
    """F = v sqrt(k m): half a per cent for one of either, and one for one of the speed."""
    found = told("face.greatest_force_N", [STIFFNESS, MASS])
    force = 3 * sqrt(1e5 * 2)
    for row, at, unit in zip(found.rows, (1e5, 2), ("N/(N/m)", "N/kg"), strict=True):
        assert row.value == pytest.approx(force, rel=1e-6)
        assert row.derivative == pytest.approx(force / (2 * at), abs=row.error)
        assert row.error < 1e-3 * force / at
        assert row.relative == pytest.approx(0.5, rel=1e-3)
        assert row.unit == unit
    assert repr(found) == f"<Sensitivities of face.greatest_force_N to {STIFFNESS}, {MASS}>"
    assert "\n  bodies.ball.mass             335.41      +- 0.0" in found.summary()
    assert list(found.to_dataframe()["relative"]) == [row.relative for row in found.rows]


def swing(result):
    return {"swing_rad": float(result.body("lower").angle[-1])}


def test_a_told_error_holds_against_tighter_runs():
    at = fl.load_scene("double_pendulum").with_(
        {"run": {"duration": 1}, "accuracy.tolerance": 1e-5}
    )
    tight = at.with_({"accuracy.tolerance": 1e-10})
    to = "bodies.upper.mass"
    loose, known = (
        fl.sensitivity(each, "swing_rad", to, row=swing, workers=1).rows[0] for each in (at, tight)
    )
    assert known.error < 1e-3 * abs(known.derivative)
    assert abs(loose.derivative - known.derivative) <= loose.error + known.error


def test_what_jumps_has_no_small_error():
    """The ball comes back to the floor just before the end, or just after it."""

    def strikes(result):
        return {"late": float(result.time[-1] > 0.05 and result.scene.bodies["ball"].mass > 2)}

    [row] = told("late", MASS, BOUNCE.replace("0.05}", "0.06}"), row=strikes).rows
    assert row.error > abs(row.derivative) / 2


@pytest.mark.parametrize(
    ("of", "to", "error", "named"),
    [
        ("face.force_N", MASS, fl.NoSensitivityError, "no column 'face.force_N'"),
        ("face.last_period_s", MASS, fl.NoSensitivityError, "is no number here, but None"),
        (
            "end_s",
            "contacts.face.law.restitution",
            fl.NoSensitivityError,
            "at its bound, 1: move it off",
        ),
        ("end_s", "bodies.ball.mas", fl.SceneError, "to: bodies.ball.mas: "),
        ("end_s", 3, TypeError, "to: expected values"),
    ],
)
def test_what_has_no_derivative_is_refused(of, to, error, named):
    with pytest.raises(error, match=named):
        told(of, to)

"""Pins with play in the paper's mechanism: hand-written equations against minimal coordinates."""

import numpy as np
import pytest
from cli_runs import MODELS

from exudyn_flexlink.engines import NotRepresentableError, simulate
from exudyn_flexlink.engines.lagrangian.contacts import PinOnTrack
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.mechanism import build_mechanism

MODEL = MODELS / "slot_play.yaml"
RUBBING = "{stiffness: 1.0e6, restitution: 0.5, friction: 0.1}"
IN_GUIDE = ["joints.sleeve={type: sleeve, guide: guide, link: link, clearance: 0.5 mm, "
            "law: {stiffness: 1.0e6, restitution: 0.5}}"]  # fmt: skip
FREE = ["drives.motor={type: torque, joint: crank, value: 0.02}", "gravity=[1, -9.81]",
        "initial={speeds: {guide: 12}}"]  # fmt: skip


def both(rods, duration, law, *settings):
    """Results of both engines."""
    common = [
        f"bodies.link.rods={rods}",
        "bodies.link.hinges.stiffness=beam",
        f"run={{duration: {duration}, sample: 1 ms}}",
        "accuracy={tolerance: 1.0e-7}",
        f"joints.pin.law={law}",
    ]
    scene = load_scene(MODEL, [*common, *settings])
    return simulate(scene, "exudyn"), simulate(scene, "lagrangian")


@pytest.mark.parametrize(
    ("rods", "duration", "law", "settings"),
    [
        (2, 0.02, RUBBING, []),
        (1, 0.024, "{type: impulse, restitution: 0.5}", []),
        (2, 0.012, RUBBING, IN_GUIDE),
        (1, 0.018, RUBBING, FREE),
    ],
    ids=["penalty", "impulse", "play in the guide, too", "torque and weight"],
)
def test_both_engines_move_a_pin_with_play_alike(rods, duration, law, settings):
    """Touch by touch, and in all poses and forces; they share curves and laws, no equations."""
    first, second = both(rods, duration, law, *settings)
    touches, others = (result.sleeves["pin"].touches for result in (first, second))
    assert len(touches) == len(others) > 0
    np.testing.assert_array_equal(touches.pair, others.pair)
    for name in ("begin", "place", "approach_speed"):
        np.testing.assert_allclose(getattr(touches, name), getattr(others, name), atol=1e-6)
    np.testing.assert_allclose(touches.impulse, others.impulse, rtol=1e-4, atol=1e-8)
    common = np.intersect1d(first.time, second.time)
    rows, other_rows = (np.searchsorted(result.time, common) for result in (first, second))
    np.testing.assert_allclose(first.poses[rows], second.poses[other_rows], atol=3e-7)
    for kind in ("slot_forces", "joint_forces", "drive_torques"):
        for name, force in getattr(first, kind).items():
            other = getattr(second, kind)[name][other_rows]
            np.testing.assert_allclose(force[rows], other, atol=1e-4)


def test_walls_of_the_next_lap_take_over_what_presses_in_both_engines():
    """The pin lies on the outer wall past where the ellipse and the egg meet."""
    soft = "{stiffness: 1.0e5, restitution: 0.2}"
    first, second = both(1, 0.13, soft, "drives.motor.value=50 rad/s", "accuracy.tolerance=1.0e-6")
    assert [lap.details["lap"] for lap in first.laps] == [2.0]
    assert second.laps[0].time == pytest.approx(first.laps[0].time, abs=1e-8)
    for result in (first, second):
        touches = result.sleeves["pin"].touches
        met = result.laps[0].time
        ended, begun = (np.abs(edge - met) < 1e-9 for edge in (touches.end, touches.begin))
        assert touches.pair[ended].tolist() == [1]
        assert touches.pair[begun].tolist() == [3]
        assert result.checks.energy_residual < 1e-8
    assert first.poses[-1] == pytest.approx(second.poses[-1], abs=1e-6)


def test_friction_in_impacts_of_a_pin_is_refused_at_its_line():
    law = "{type: impulse, restitution: 0.5, friction: 0.1}"
    with pytest.raises(NotRepresentableError) as refused:
        both(1, 0.01, law)
    assert refused.value.path == ("joints", "pin", "law", "friction")


def test_the_place_next_to_a_pin_is_where_the_distance_is_least():
    scene = load_scene(MODEL)
    groove = build_mechanism(scene).grooves[0]
    pin = PinOnTrack(groove, 0.3, [])
    angle = np.linspace(0.1, 2.0, 20)
    points = 0.0402 * np.cos(angle) + 0.0301j * np.sin(angle)
    u, (place, first, _) = pin.feet(points)
    off = points - place
    assert np.abs((off.conj() * first).real / np.abs(first)).max() < 1e-15
    assert np.abs(off).max() < 5e-4
    assert (np.diff(u) > 0).all()

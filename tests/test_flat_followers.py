"""A straight face on a convex curve: force, torque and lift-off of flat-faced followers."""

from math import pi, radians

import numpy as np
import pytest
from physics_tools import MODELS

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import assemble_scene, load_scene
from exudyn_flexlink.source import SceneError

CAM = MODELS / "textbook" / "flat_faced_cam.yaml"
ELLIPSE = [
    "curves.rim={type: ellipse, centre: [0, 0], semi_axes: [0.04, 0.025], on: cam}",
    "drives.motor.value=40",
    "initial={angles: {cam: 0}, positions: {follower: [0, 0.025]}}",
]
HALVES = """curves={
 one: {type: ellipse, centre: [0, 0], semi_axes: [0.04, 0.025], from: 20 deg, to: 200 deg},
 two: {type: ellipse, centre: [0, 0], semi_axes: [0.04, 0.025], from: 200 deg, to: 380 deg},
 rim: {type: joined, pieces: [one, two], on: cam}}"""
CIRCLE = {
    0: (0.03, 0.01, 43.924, 0.43924),
    90: (0.04, 0.0, 49.524, 0.0),
    200: (0.02657979857, -0.009396926208, 42.0086872, -0.3947525337),
    270: (0.02, 0.0, 38.324, 0.0),
}
TABLE = {
    0: (0.025, 0.0, 58.884, 0.0),
    30: (0.02947456531, 0.01432378663, 49.00352289, 0.7019160058),
    60: (0.03682729966, 0.01146397885, 46.82270348, 0.5367744823),
    90: (0.04, 0.0, 48.324, 0.0),
}


@pytest.mark.parametrize(
    ("settings", "speed", "table"),
    [([], 60, CIRCLE), (ELLIPSE, 40, TABLE), ([*ELLIPSE, HALVES], 40, TABLE)],
    ids=["circle", "ellipse", "two halves"],
)
def test_a_follower_is_pressed_and_braked_by_what_lifts_it(settings, speed, table):
    """N = m(g + y'') + F_0 + k(y - y_low), beside the axis by y'; the drive's torque is N y'."""
    sample = f"run={{duration: {2 * pi / speed}, sample: {pi / 18 / speed}}}"
    result = simulate(load_scene(CAM, [*settings, sample]), measure=False)
    turned, face = result.poses[:, 0, 2], result.contacts["face"]
    for angle, (lift, beside, force, torque) in table.items():
        k = np.flatnonzero(np.abs(np.sin((turned - radians(angle)) / 2)) < 1e-9)[-1]
        assert result.poses[k, 1, 1] == pytest.approx(lift, abs=1e-9)
        assert face.place[k] - 0.02 == pytest.approx(beside, abs=1e-9)
        assert face.force[k] == pytest.approx(force, abs=1e-5)
        assert result.drive_torques["motor"][k] == pytest.approx(torque, abs=1e-6)
    assert result.checks.energy_residual < 1e-12
    assert result.warnings == ()


@pytest.mark.parametrize(
    ("settings", "speed", "start"), [([], 126.41598, -90), (ELLIPSE, 80.97102996, 0)]
)
def test_a_follower_lifts_off_at_the_nose_above_a_speed(settings, speed, start):
    """There N = 0 first; the gap, which then grows by the third power of time, would tell late."""
    for faster in (0.9999, 1.0001):
        drive = f"drives.motor.value={faster * speed}"
        run = f"run={{duration: {3.3 / speed}, sample: 1 ms}}"
        result = simulate(load_scene(CAM, [*settings, drive, run]), measure=False)
        held = [touch for touch in result.intervals["face"] if not touch.impact]
        ends = [touch.end * faster * speed for touch in held]
        lifted = [radians(start) + end for end in ends if end < np.inf]
        assert len(lifted) == (faster > 1)
        if lifted:
            assert lifted[0] == pytest.approx(pi / 2, abs=0.03)
    if settings == []:  # m g + F_0 + k e (1 + sin a) = m e w^2 sin a
        low, inertia = 0.4 * 9.81 + 20 + 20, 0.004 * (1.0001 * speed) ** 2 - 20
        assert np.sin(lifted[0]) == pytest.approx(low / inertia, abs=1e-9)


def test_a_penalty_presses_alike():
    law = "contacts.face.law={stiffness: 1.0e7, restitution: 0}"
    result = simulate(load_scene(CAM, [law, "run.turns=0.5"]), measure=False)
    assert result.contacts["face"].force[-1] == pytest.approx(49.524, abs=0.05)


HOLLOW = "{type: spline, points: [[0.3, 0], [0, 0.05], [-0.3, 0], [0, 0.3]], closed: true, on: cam}"


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (f"curves.rim={HOLLOW}", "not convex everywhere"),
        (
            "curves.rim={type: circle, centre: [0, 0], radius: 0.03, from: 0, to: 3, on: cam}",
            "open",
        ),
        ("contacts.face.line=[cam.hub, cam.centre]", "which carries the curve"),
    ],
)
def test_a_face_needs_a_convex_curve_of_another_body(change, told):
    with pytest.raises(SceneError, match=f"contacts.face.*{told}"):
        assemble_scene(load_scene(CAM, [change]))

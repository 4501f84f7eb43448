"""Drives along prismatic joints and sleeves, and lengths at the start: closed forms."""

from math import cos, pi, sin

import numpy as np
import pytest
from physics_tools import TRAMMEL, angle, run, run_model, scene, where

from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.source import SceneError

REDUNDANT = ("accuracy.tolerance=1e-5", "solver.formulation=redundant")
BOTH = pytest.mark.parametrize(
    ("settings", "off"), [((), 1e-10), (REDUNDANT, 1e-5)], ids=["minimal", "redundant"]
)

BLOCK = """
bodies: {block: {type: rigid, mass: 2, inertia: 1.0e-3, points: {b: [0, 0]}}}
joints: {way: {type: prismatic, points: [ground, block.b], at: [0.1, 0.2], axis: [4, 3]}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-8}
"""
SWAY = "drives: {m: {type: motion, joint: way, value: 0.3 m + 50 mm * sin(2*pi*t / 0.5 s)}}\n"
ALONG = np.array([0.8, 0.6])


# --- motions and speeds -------------------------------------------------------------------------


@BOTH
@pytest.mark.parametrize("turned", [False, True], ids=["on the ground", "on the block"])
def test_a_slider_moved_by_a_sine_takes_the_force_of_newton(settings, off, turned):
    """F = -m a w^2 sin(w t), along the line; seen from the block the line is the ground's."""
    text = BLOCK + SWAY
    if turned:
        text = text.replace("[ground, block.b]", "[block.b, ground]").replace("0.3 m", "-0.3 m")
        text = text.replace("+ 50 mm", "- 50 mm")
    result = run(text, *settings)
    w, size, t = 4 * pi, 0.05, result.time
    gone = 0.3 + size * np.sin(w * t)
    expected = np.array([0.1, 0.2]) + gone[:, None] * ALONG
    np.testing.assert_allclose(where(result, "block.b"), expected, atol=off)
    force = -2 * size * w * w * np.sin(w * t)[:, None] * ALONG * (-1 if turned else 1)
    np.testing.assert_allclose(result.drive_forces["m"], force, atol=1e-10 if not settings else 0.1)
    assert result.drive_torques == {}
    assert result.checks.energy_residual < (1e-4 if not settings else 1e-3)
    if settings:  # minimal steps are long; between their ends work is interpolated
        work = (size * w * np.cos(w * t)) ** 2 - (size * w) ** 2
        np.testing.assert_allclose(result.energy.supplied, work, atol=1e-3)


TURNTABLE = """
bodies:
  guide: {type: rigid, mass: 1, inertia: 0.1, points: {o: [0, 0], p: [0.05, 0.1]}}
  bead: {type: rigid, mass: 0.5, inertia: 2.0e-3, points: {c: [0, 0]}}
joints:
  pivot: {type: revolute, points: [ground, guide.o], at: [0, 0]}
  way: {type: prismatic, points: [guide.p, bead.c], axis: [0.6, 0.8], angle: 30 deg}
drives:
  spin: {type: speed, joint: pivot, value: 5}
  slide: {type: speed, joint: way, value: 0.2 m/s}
initial: {along: {way: 0.1}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-8}
"""


@BOTH
def test_a_slide_at_constant_speed_on_a_turning_guide_feels_coriolis(settings, off):
    """In the guide's axes the bead needs m (-w^2 r + 2 w u across); the drive what is along."""
    result = run(TURNTABLE, *settings)
    t, w, u, mass = result.time, 5.0, 0.2, 0.5
    line = np.array([0.6, 0.8])
    own = np.array([0.05, 0.1]) + (0.1 + u * t)[:, None] * line  # in the guide's axes
    c, s = np.cos(w * t), np.sin(w * t)

    def seen(vectors):
        x, y = vectors[..., 0], vectors[..., 1]
        return np.stack([c * x - s * y, s * x + c * y], axis=-1)

    np.testing.assert_allclose(where(result, "bead.c"), seen(own), atol=off)
    needed = mass * (-w * w * own + 2 * w * u * np.array([-0.8, 0.6]))
    along = (needed @ line)[:, None] * line
    close = 1e-10 if not settings else 5e-3
    np.testing.assert_allclose(result.drive_forces["slide"], seen(along), atol=close)
    rest = slice(2, None) if settings else slice(None)
    np.testing.assert_allclose(
        result.joint_forces["way"][rest], seen(needed - along)[rest], atol=close
    )
    torque = own[:, 0] * needed[:, 1] - own[:, 1] * needed[:, 0]
    np.testing.assert_allclose(result.drive_torques["spin"][rest], torque[rest], atol=close)


GUESSED = TRAMMEL + "initial: {guesses: {beam: 2.2}}\nrun: {duration: 1}\n"
HEAVIER = ("bodies.b.mass=2", "bodies.beam.mass=3")


@BOTH
@pytest.mark.parametrize("way", ["x", "y"])
def test_an_elliptic_trammel_driven_along_one_way(settings, off, way):
    """With the beam at the angle th: x = -L cos th, y = L sin th; virtual work gives the force."""
    text = GUESSED + f"drives: {{m: {{type: motion, joint: {way}, value: 0.3 + 0.1*sin(3*t)}}}}\n"
    if way == "y":  # then y closes the loop, if x came before: either is driven
        text = text.replace("guesses: {beam: 2.2}", "guesses: {beam: 2.4}")
    result = run(text, *HEAVIER, *settings)
    t, length = result.time, 0.5
    size, rate, bend = 0.3 + 0.1 * np.sin(3 * t), 0.3 * np.cos(3 * t), -0.9 * np.sin(3 * t)
    other = np.sqrt(length**2 - size**2)
    x, y = (size, other) if way == "x" else (other, size)
    turned = np.arctan2(y, -x)
    np.testing.assert_allclose(angle(result, "beam"), turned, atol=max(off, 1e-9))
    c, s = np.cos(turned), np.sin(turned)
    pen = np.stack([x + 0.7 * c - 0.1 * s, 0.7 * s + 0.1 * c], axis=-1)
    np.testing.assert_allclose(where(result, "beam.pen"), pen, atol=max(off, 1e-9))
    # Kinetic energy by the driven length z: ((m_z + m/4) + (m_o + m/4) z^2/o^2 + I/o^2) z'^2 / 2.
    driven, follows = (1.75, 2.75) if way == "x" else (2.75, 1.75)
    inertia = driven + (follows * size**2 + 0.1) / other**2
    slope = 2 * size * (follows * length**2 + 0.1) / other**4
    force = inertia * bend + 0.5 * slope * rate**2
    got = result.drive_forces["m"][:, "xy".index(way)]
    np.testing.assert_allclose(got, force, atol=1e-7 if not settings else 2e-2)


def test_a_step_that_took_the_other_way_of_closing_is_made_again_shorter():
    """The first long step finds the cross below the shuttle; guessed from it, so did all others."""
    result = run_model("textbook/driven_trammel.yaml")
    out = 0.1 + 0.06 * np.sin(4 * pi * result.time)
    np.testing.assert_allclose(where(result, "cross.pin")[:, 1], np.sqrt(0.04 - out**2), atol=1e-9)


WEDGE = """
bodies:
  wedge: {type: rigid, mass: 3, inertia: 1, points: {p: [0, 0]}}
  rod: {type: rigid, mass: 2, inertia: 1, points: {p: [0, 0]}}
joints:
  bed: {type: prismatic, points: [ground, wedge.p], at: [0, 0], axis: [1, 0]}
  post: {type: prismatic, points: [ground, rod.p], at: [0, 0], axis: [0, 1]}
  face: {type: prismatic, points: [wedge.p, rod.p], axis: [-4, 3]}
run: {duration: 1}
accuracy: {tolerance: 1.0e-8}
"""


def test_a_wedge_driven_along_the_face_that_closes_its_loop():
    """At s along the face the wedge is at 0.8 s, the rod at 0.6 s; the drive lifts both."""
    drive = "{type: motion, joint: face, value: 0.5 + 0.1*sin(3*t)}"
    result = run(WEDGE + f"drives: {{m: {drive}}}\n")
    t = result.time
    out = 0.5 + 0.1 * np.sin(3 * t)
    np.testing.assert_allclose(where(result, "wedge.p")[:, 0], 0.8 * out, atol=1e-10)
    np.testing.assert_allclose(where(result, "rod.p")[:, 1], 0.6 * out, atol=1e-10)
    # Virtual work: the force along the face moves by s, the masses by 0.8 s and 0.6 s.
    force = -(3 * 0.64 + 2 * 0.36) * 0.9 * np.sin(3 * t)
    pushed = force[:, None] * np.array([-0.8, 0.6])
    np.testing.assert_allclose(result.drive_forces["m"], pushed, atol=1e-9)
    # Newton's law of each: with a = -0.9 sin 3t the face pushes the rod by 3 (-0.8) a along x, and
    # by 2 (0.6) a along y; of that the drive's share is along the face, the joint's across it.
    push = -0.9 * np.sin(3 * t)[:, None] * np.array([-2.4, 1.2])
    np.testing.assert_allclose(result.joint_forces["face"], push - pushed, atol=1e-9)
    np.testing.assert_allclose(result.joint_forces["post"], [-1, 0] * push, atol=1e-9)
    np.testing.assert_allclose(result.joint_forces["bed"], [0, 1] * push, atol=1e-9)


# --- expressions --------------------------------------------------------------------------------


@BOTH
def test_a_force_by_length_and_speed_is_a_spring_with_a_damper(settings, off):
    """A block on its way, drawn back by place(way) and held up by speed(way)."""
    force = "-50 * (place(way) - 0.1) - 4 * speed(way)"
    text = BLOCK + f"drives: {{f: {{type: force, point: block.b, value: ['0.8*({force})', "
    result = run(text + f"'0.6*({force})']}}}}\ninitial: {{along: {{way: 0.4}}}}\n", *settings)
    t, decay = result.time, 1.0
    omega = np.sqrt(25 - decay**2)
    gone = 0.1 + 0.3 * np.exp(-t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))
    expected = np.array([0.1, 0.2]) + gone[:, None] * ALONG
    np.testing.assert_allclose(where(result, "block.b"), expected, atol=max(off, 1e-8))


def test_lengths_and_speeds_of_a_way_that_closes_a_loop():
    """The wedge again, held by a force that sees how far, and how fast, its face is out."""
    force = "-200*(place(face) - 0.3) - 5*speed(face)"
    text = WEDGE + f"drives: {{f: {{type: force, point: rod.p, value: [0, '{force}']}}}}\n"
    result = run(text + "initial: {along: {face: 0.5}}\n")
    t, mass = result.time, 3 * 0.64 + 2 * 0.36
    decay, stiffness = 0.6 * 5 / mass / 2, 0.6 * 200 / mass
    omega = np.sqrt(stiffness - decay**2)
    wave = np.cos(omega * t) + decay / omega * np.sin(omega * t)
    out = 0.3 + 0.2 * np.exp(-decay * t) * wave
    np.testing.assert_allclose(where(result, "rod.p")[:, 1], 0.6 * out, atol=1e-8)


# --- lengths at the start -----------------------------------------------------------------------


@pytest.mark.parametrize("length", [0.4, -0.3, 0.0])
def test_a_slide_starts_as_far_out_as_it_is_given(length):
    start = assemble_scene(scene(BLOCK + f"initial: {{along: {{way: {length}}}}}\n")).state
    np.testing.assert_allclose(start.q[0, :2], [0.1 + 0.8 * length, 0.2 + 0.6 * length], atol=1e-14)


@pytest.mark.parametrize("length", [0.1, 0.25, 0.45])
def test_a_loop_closes_where_one_of_its_ways_is_given(length):
    start = assemble_scene(scene(GUESSED, f"initial.along={{y: {length}}}")).state
    np.testing.assert_allclose(start.q[1, :2], [0, length], atol=1e-10)
    assert abs(start.q[0, 0]) == pytest.approx(np.sqrt(0.25 - length**2), abs=1e-10)


SLEEVE = """
materials: {steel: {density: 7850, youngs_modulus: 200 GPa}}
bodies:
  guide: {type: rigid, mass: 1, inertia: 0.1, points: {start: [0, 0], end: [0.3, 0]}}
  link: {type: rod, length: 0.2, material: steel, section: {width: 10 mm, thickness: 5 mm}}
joints:
  pivot: {type: revolute, points: [ground, guide.start], at: [0, 0]}
  in: {type: sleeve, guide: guide, link: link PLAY}
initial: {along: {in: 0.05}, angles: {guide: 0.5}}
run: {duration: 0.1}
accuracy: {tolerance: 1.0e-8}
"""


@pytest.mark.parametrize(
    "play", ["", ", clearance: 0.1 mm, law: {stiffness: 1.0e5, restitution: 0.5}"]
)
def test_a_link_starts_as_far_along_its_sleeve_as_it_is_given(play):
    start = assemble_scene(scene(SLEEVE.replace("PLAY", play))).state
    np.testing.assert_allclose(start.q[1], [0.05 * cos(0.5), 0.05 * sin(0.5), 0.5], atol=1e-12)


def test_a_link_is_drawn_through_its_sleeve():
    """A sleeve without clearance is driven as a prismatic joint is."""
    drives = "drives: {m: {type: motion, joint: in, value: 0.05 + 0.2*t**2}}\n"
    text = SLEEVE.replace("PLAY", "").replace("initial", drives + "initial")
    result = run(text.replace("{in: 0.05}", "{}"))
    turned = angle(result, "guide")
    out = 0.05 + 0.2 * result.time**2
    line = np.stack([np.cos(turned), np.sin(turned)], axis=-1)
    np.testing.assert_allclose(where(result, "link.start"), out[:, None] * line, atol=1e-8)


# --- speeds at the start ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("settings", "off", "turned"), [((), 1e-10, True), (REDUNDANT, 1e-5, False)]
)
def test_a_slider_thrown_up_its_line_goes_as_far_as_galilei_says(settings, off, turned):
    """s = v t - g sin(a) t^2 / 2; seen from the block the ground's point leaves the other way."""
    text, speed = BLOCK + "gravity: 9.81\n", 3.0
    if turned:
        text, speed = text.replace("[ground, block.b]", "[block.b, ground]"), -3.0
    result = run(text + f"initial: {{speeds_along: {{way: {speed} m/s}}}}\n", *settings)
    gone = 3 * result.time - 0.6 * 9.81 * result.time**2 / 2
    expected = np.array([0.1, 0.2]) + gone[:, None] * ALONG
    np.testing.assert_allclose(where(result, "block.b"), expected, atol=off)


@BOTH
def test_a_bead_thrown_along_a_turning_line_counts_its_speed_on_the_line(settings, off):
    """r = r0 cosh(w t) + u/w sinh(w t), with u against the guide, which itself moves along, too."""
    text = TURNTABLE.replace("  slide: {type: speed, joint: way, value: 0.2 m/s}\n", "")
    text = text.replace("{along: {way: 0.1}}", "{along: {way: 0.1}, speeds_along: {way: 0.2}}")
    result = run(text, "run.duration=0.2", *settings)
    t, w, (x, y) = result.time, 5.0, np.array([0.05, 0.1])
    line = np.array([0.6, 0.8])
    ahead, aside = line @ (x, y), 0.6 * y - 0.8 * x  # of the line's point, from the pivot
    out = (ahead + 0.1) * np.cosh(w * t) + 0.2 / w * np.sinh(w * t)
    own = out[:, None] * line + aside * np.array([-0.8, 0.6])
    c, s = np.cos(w * t), np.sin(w * t)
    expected = np.stack([c * own[:, 0] - s * own[:, 1], s * own[:, 0] + c * own[:, 1]], axis=-1)
    np.testing.assert_allclose(where(result, "bead.c"), expected, atol=max(off, 1e-8))


@pytest.mark.parametrize(
    "play", ["", ", clearance: 0.1 mm, law: {stiffness: 1.0e5, restitution: 0.5}"]
)
def test_a_link_starts_as_fast_along_its_sleeve_as_it_is_given(play):
    text = SLEEVE.replace("PLAY", play).replace("along: {", "speeds_along: {in: 2}, along: {")
    start = assemble_scene(scene(text)).state
    np.testing.assert_allclose(start.v[1], [2 * cos(0.5), 2 * sin(0.5), 0], atol=1e-12)


GROOVE = """
bodies:
  table: {type: rigid, mass: 1, inertia: 0.1, points: {o: [0, 0]}}
  bead: {type: rigid, mass: 0.5, inertia: 0, points: {c: [0, 0]}}
curves: {groove: {type: line, on: table, from: [0.02, 0], to: [1, 0]}}
joints:
  pivot: {type: revolute, points: [ground, table.o], at: [0, 0]}
  way: {type: slot, point: bead.c, curve: groove}
drives: {spin: {type: speed, joint: pivot, value: -5}}
initial: {angles: {table: 0}, positions: {bead: [0.1, 0]}, speeds_along: {way: 0.2}}
run: {duration: 0.3}
accuracy: {tolerance: 1.0e-8}
"""


@BOTH
@pytest.mark.parametrize("given", ["speeds_along: {way: 0.2}", "velocities: {bead: [0.2, -0.5]}"])
def test_a_bead_thrown_along_a_turning_groove_keeps_its_speed_in_the_groove(settings, off, given):
    """r = r0 cosh(w t) + u/w sinh(w t)."""
    result = run(GROOVE.replace("speeds_along: {way: 0.2}", given), *settings)
    t, w = result.time, 5.0
    out = 0.1 * np.cosh(w * t) + 0.2 / w * np.sinh(w * t)
    expected = out[:, None] * np.stack([np.cos(w * t), -np.sin(w * t)], axis=-1)
    np.testing.assert_allclose(where(result, "bead.c"), expected, atol=max(off, 1e-8))


@pytest.mark.parametrize("speed", [0.3, -0.3])
def test_a_speed_along_a_slot_is_that_of_its_curve(speed):
    """On an ellipse (a cos u, b sin u) the way is (-a sin u, b cos u), counter-clockwise."""
    text = GROOVE.replace("{type: line, on: table, from: [0.02, 0], to: [1, 0]}", "OVAL").replace(
        "OVAL", "{type: ellipse, centre: [0, 0], semi_axes: [0.2, 0.1]}"
    )
    text = text.replace("[0.1, 0]", f"[{0.2 * cos(0.7)}, {0.1 * sin(0.7)}]")
    text = text.replace("{way: 0.2}", f"{{way: {speed}}}")
    way = np.array([-0.2 * sin(0.7), 0.1 * cos(0.7)])
    start = assemble_scene(scene(text)).state
    np.testing.assert_allclose(start.v[1, :2], speed * way / np.hypot(*way), atol=1e-9)


def test_speeds_along_that_contradict_are_named():
    driven = GROOVE.replace("speeds_along: {way: 0.2}", "velocities: {bead: [0.3, -0.5]}, SPEED")
    assert "initial.speeds_along.way: this speed contradicts" in refused(
        driven.replace("SPEED", "speeds_along: {way: 0.2}")
    )
    assert "is of type slot" in refused(driven.replace("SPEED", "along: {way: 0.2}"))
    words = "initial.speeds_along.way: this speed contradicts the joints, the drives"
    assert words in refused(BLOCK + SWAY + "initial: {speeds_along: {way: 0.1}}\n")
    wrong = BLOCK + "initial: {speeds_along: {block: 0.1}}\n"
    assert "initial.speeds_along.block: unknown joint 'block'" in refused(wrong)
    angular = BLOCK + "initial: {speeds_along: {way: 1 rad/s}}\n"
    assert "expected a speed" in refused(angular)


# --- what is refused ----------------------------------------------------------------------------


def refused(text):
    with pytest.raises(SceneError) as raised:
        scene(text)
    return str(raised.value)


@pytest.mark.parametrize(
    ("drive", "words"),
    [
        ("{type: motion, joint: way, value: 20 deg}", "drives.m.value: expected a length, since "
         "'way' is of type prismatic; got an angle"),
        ("{type: motion, joint: way, value: '3 m/s + t*0'}", "expected an angle, got a speed"),
        ("{type: speed, joint: way, value: 3 rad/s}", "expected a speed, since 'way'"),
        ("{type: speed, joint: way, value: 2 rad/s + 1 rad/s}", "expected a speed, since 'way'"),
        ("{type: torque, joint: way, value: 3}", "along it pushes a drive of type force"),
        ("{type: force, point: block.b, value: ['place(way, x)', 0]}", "expected"),
        ("{type: force, point: block.b, value: ['angle(way)', 0]}", "needs a revolute joint"),
        ("{type: force, point: block.b, value: ['place(wy)', 0]}", "unknown joint 'wy'"),
    ],
)  # fmt: skip
def test_values_of_the_wrong_kind_are_refused_at_their_line(drive, words):
    assert words in refused(BLOCK + f"drives: {{m: {drive}}}\n")


def test_a_length_for_a_joint_that_turns_is_refused():
    text = SLEEVE.replace("PLAY", "") + "drives: {m: {type: motion, joint: pivot, value: 3 mm}}\n"
    assert "expected an angle, since 'pivot' is of type revolute; got a length" in refused(text)


def test_a_sleeve_with_clearance_is_not_driven():
    play = ", clearance: 0.1 mm, law: {stiffness: 1.0e5, restitution: 0.5}"
    text = SLEEVE.replace("PLAY", play) + "drives: {m: {type: motion, joint: in, value: 3 mm}}\n"
    assert "needs a sleeve without clearance" in refused(text)


def test_lengths_that_contradict_are_named():
    for along in ("x: 0.3, y: 0.3", "x: 0.6"):  # together, and beyond the beam
        text = GUESSED.replace("{beam: 2.2}", f"{{beam: 2.2}}, along: {{{along}}}")
        assert "initial.along.x: the joints do not allow this length" in refused(text)
    driven = BLOCK + SWAY + "initial: {along: {way: 0.1}}\n"
    assert "initial.along.way: the joints do not allow this length" in refused(driven)
    turned = BLOCK + "initial: {along: {block: 0.1}}\n"
    assert "unknown joint 'block'" in refused(turned)


def test_a_motion_that_the_joints_can_not_have_is_refused_at_the_drive():
    text = GUESSED + "drives: {m: {type: motion, joint: x, value: 0.6 + 0*t}}\n"
    assert "drives.m: the joint can't have the length that this drive gives it" in refused(text)

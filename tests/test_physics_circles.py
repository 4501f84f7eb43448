"""Circles that touch, journals in bearings: closed forms, and equations written for one case."""

from math import cos, pi, sin, sqrt

import numpy as np
import pytest
from physics_tools import alone, run_model, speed, where
from scipy.integrate import solve_ivp

from exudyn_flexlink.laws import RestitutionPenalty

G = 9.81
FORMULATIONS = ("minimal", "redundant")


# --- a ball in a hollow circle ----------------------------------------------------------------

HOLLOW = """
bodies: {ball: {type: rigid, mass: 1, inertia: 1.0e-3, points: {c: [0, 0]}}}
joints:
  hollow:
    type: revolute
    points: [ball.c, ground]
    at: [0.3, 0.2]
    clearance: 0.1
    law: {stiffness: 1.0e8, restitution: 0.8, transition_speed: 1.0e-4}
gravity: [0, -9.81]
run: {duration: 0.5}
accuracy: {tolerance: 1.0e-9}
"""


def test_a_ball_falls_in_a_hollow_circle_and_bounces_by_its_restitution():
    """First touch and speed in free fall; each flight lasts 2 v/g from one bounce to the next."""
    result = alone(HOLLOW)
    touches = list(result.intervals["hollow"])
    first = touches[0]
    assert first.begin == pytest.approx(sqrt(2 * 0.1 / G), abs=1e-12)
    assert first.approach_speed == pytest.approx(sqrt(2 * 0.1 * G), abs=1e-11)
    # Loading takes the fall into the wall, too; unloading returns e^2 of it, less the way back.
    depth = G / 1e8 + sqrt((G / 1e8) ** 2 + first.approach_speed**2 / 1e8)
    assert first.penetration == pytest.approx(depth, rel=1e-6)
    after = sqrt(0.8**2 * 1e8 * depth**2 - 2 * G * depth)
    assert first.separation_speed == pytest.approx(after, rel=1e-6)
    flight = touches[1].begin - first.end
    assert flight == pytest.approx(2 * first.separation_speed / G, abs=1e-11)
    height = where(result, "ball.c")[:, 1].copy()
    height[(result.time < first.end) | (result.time > touches[1].begin)] = -np.inf
    assert 0.1 + height.max() - 0.2 == pytest.approx(after**2 / (2 * G), rel=1e-4)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_the_bearing_holds_the_weight_of_what_has_come_to_rest(formulation):
    damped = "joints.hollow.law.restitution=0.2", "joints.hollow.law.transition_speed=0.2"
    soft = "joints.hollow.law.stiffness=1.0e4", "joints.hollow.clearance=0.01"
    settings = *damped, *soft, f"solver.formulation={formulation}", "accuracy.tolerance=1.0e-6"
    result = alone(HOLLOW, *settings, "run.duration=1.5")
    bearing = result.bearings["hollow"]
    assert bearing.gap[-1] == pytest.approx(-G / (1e4 * (1 + 0.2**2) / 2), rel=1e-3)
    # The ground is the second point's body: it is pushed down.
    np.testing.assert_allclose(result.joint_forces["hollow"][-1], [0, -G], atol=1e-2)


# --- two discs --------------------------------------------------------------------------------

DISCS = """
curves:
  rail: {type: line, from: [-0.3, 0], to: [2, 0]}
  other: {type: line, from: [0, 0], to: [-2, 0]}
bodies:
  a: {type: rigid, mass: 1, inertia: 1.0e-3, points: {c: [0, 0]}}
  b: {type: rigid, mass: 3, inertia: 1.0e-3, points: {c: [0, 0]}}
joints:
  on_rail: {type: slot, point: a.c, curve: rail}
  on_other: {type: slot, point: b.c, curve: other}
contacts:
  hit:
    type: circle_on_circle
    circles: [{at: a.c, radius: 0.05}, {at: b.c, radius: 0.1}]
    law: {stiffness: 1.0e6, restitution: 0.5, transition_speed: 1.0e-5}
initial: {angles: {a: 0, b: 0}, velocities: {a: [2, 0], b: [-0.5, 0]}}
run: {duration: 0.1}
accuracy: {tolerance: 1.0e-9}
"""


@pytest.mark.parametrize(("formulation", "exact"), [("minimal", 1e-9), ("redundant", 1e-2)])
def test_discs_that_meet_head_on_part_by_their_restitution(formulation, exact):
    """Momentum is kept, and speeds after are -e times those before.

    In minimal coordinates at 1e-7 m: at 1e-6 m the impulse is right to 4e-9 on some processors, to
    1e-11 on others.
    """
    tolerance = 1e-7 if formulation == "minimal" else 1e-6
    result = alone(DISCS, f"solver.formulation={formulation}", f"accuracy.tolerance={tolerance}")
    (touch,) = result.intervals["hit"]
    assert touch.begin == pytest.approx(0.15 / 2.5, abs=1e-6)
    before, masses, e = np.array([2.0, -0.5]), np.array([1.0, 3.0]), 0.5
    together = masses @ before / masses.sum()
    np.testing.assert_allclose(
        result.rates[-1, :, 0], together - e * (before - together), atol=exact
    )
    assert touch.impulse == pytest.approx(0.75 * 2.5 * (1 + e), rel=exact)
    assert touch.energy_lost == pytest.approx(0.5 * 0.75 * 2.5**2 * (1 - e**2), rel=exact)


# --- a disc that slides or rolls in a circle --------------------------------------------------

DISH = """
bodies: {{disc: {{type: rigid, mass: 2, inertia: {inertia}, points: {{c: [0, 0]}}}}}}
contacts:
  dish:
    type: circle_on_circle
    circles: [{{at: disc.c, radius: 0.1}}, {{at: ground, place: [0, 0], radius: 0.5, inside: true}}]
    law: {{stiffness: 1.0e7, restitution: 1, friction: {friction}, slip_speed: {slip}}}
gravity: [0, -9.81]
initial: {{positions: {{disc: [{x}, {y}]}}}}
run: {{duration: {duration}}}
accuracy: {{tolerance: {tolerance}}}
"""
ARM = 0.4  # m, from the middle of the dish to that of the disc


def disc_in_dish(angle, duration, *, friction=0.0, slip=1e-3, tolerance=1e-7, far=ARM):
    """Scene of a solid disc, whose middle starts `far` from the dish's, by its angle from below."""
    return DISH.format(
        inertia=2 * 0.1**2 / 2,
        x=far * sin(angle),
        y=-far * cos(angle),
        friction=friction,
        slip=slip,
        duration=duration,
        tolerance=tolerance,
    )


def test_a_disc_that_rolls_in_a_dish_swings_like_a_pendulum_half_as_long_again():
    """A solid disc has half its mass times its radius squared to turn: l = 3/2 (R - r)."""
    period, angle = 2 * pi * sqrt(1.5 * ARM / G), 0.05
    text = disc_in_dish(angle, period, friction=0.4, slip=1e-5)
    result = alone(text, "contacts.dish.law.restitution=0")
    x, y = where(result, "disc.c").T
    swing = angle * np.cos(2 * pi * result.time / period / (1 + angle**2 / 16))
    np.testing.assert_allclose(np.arctan2(x, -y), swing, atol=2e-5)
    # Rolling, the disc turns against its swing by (R - r)/r.
    swung = np.arctan2(x, -y) - angle
    np.testing.assert_allclose(result.poses[:, 0, 2], -ARM / 0.1 * swung, atol=2e-5)


def test_a_disc_in_a_dish_follows_its_equations_written_for_it_alone():
    """With friction and bounces, by another method: three coordinates, forces by hand."""
    mass, inertia, k, mu, slip = 2.0, 0.01, 1e5, 0.3, 0.05
    angle, duration = 1.0, 0.5
    text = disc_in_dish(angle, duration, friction=mu, slip=slip, tolerance=1e-10, far=0.35)
    result = alone(text, "contacts.dish.law.stiffness=1.0e5")

    def forces(_, s):
        x, y, _, u, v, spin = s
        far = np.hypot(x, y)
        depth = max(far - ARM, 0.0)
        nx, ny = x / far, y / far
        press = k * depth
        # As the rims would slide undeformed; the virtual power of friction tells its force.
        grip = ARM / max(far, ARM)
        slides = grip * (-ny * u + nx * v) + spin * 0.1
        rub = -mu * press * np.tanh(slides / slip)
        ax = (-press * nx - grip * rub * ny) / mass
        ay = (-press * ny + grip * rub * nx) / mass - G
        return [u, v, spin, ax, ay, rub * 0.1 / inertia]

    def gap(_, s):
        return np.hypot(s[0], s[1]) - ARM

    state, t = [0.35 * sin(angle), -0.35 * cos(angle), 0, 0, 0, 0], 0.0
    gap.terminal = True
    while t < duration:
        leg = solve_ivp(forces, (t, duration), state, "DOP853", None, False, gap, rtol=1e-12,
                        atol=1e-13, max_step=1e-3)  # fmt: skip
        t, state = leg.t[-1], leg.y[:, -1]
        if t < duration:  # go on a little beyond the event, which else is found again
            leg = solve_ivp(forces, (t, t + 1e-7), state, "DOP853", rtol=1e-12, atol=1e-13)
            t, state = leg.t[-1], leg.y[:, -1]
    assert len(result.intervals["dish"]) >= 3
    np.testing.assert_allclose(result.poses[-1, 0], state[:3], atol=1e-8)


# --- slider-crank with clearance --------------------------------------------------------------

SLIDER_CRANK = """
curves: {rail: {type: line, from: [0, 0], to: [0.3, 0]}}
bodies:
  crank: {type: rigid, mass: 0.3, inertia: 1.0e-4, points: {hub: [0, 0], pin: [0.05, 0]}}
  rod:
    {type: rigid, mass: 0.21, inertia: 2.5e-4, centre_of_mass: [0.06, 0],
     points: {big: [0, 0], small: [0.12, 0]}}
  slider: {type: rigid, mass: 0.14, inertia: 1.0e-4, points: {pin: [0, 0]}}
joints:
  hub: {type: revolute, points: [ground, crank.hub], at: [0, 0]}
  big_end: {type: revolute, points: [crank.pin, rod.big]}
  small_end:
    type: revolute
    points: [rod.small, slider.pin]
    clearance: 0.5 mm
    law: {stiffness: 1.0e6, restitution: 0.7, transition_speed: 0.05}
  way: {type: slot, point: slider.pin, curve: rail}
drives: {motor: {type: speed, joint: hub, value: 50 rad/s}}
initial: {angles: {slider: 0}, speeds: {slider: 0}}
run: {duration: 0.06}
accuracy: {tolerance: 1.0e-10}
"""


def slider_crank_by_hand(duration):
    """Angle of the rod and place of the slider at the end, from two equations of motion."""
    r, length, arm, mass, about_pin, slider, omega = 0.05, 0.12, 0.06, 0.21, 0, 0.14, 50.0
    about_pin = 2.5e-4 + mass * arm**2
    law = RestitutionPenalty(1e6, 0.7, 0.05)

    def between(t, s):
        theta, x, turning, u = s
        px, py = r * cos(omega * t), r * sin(omega * t)
        dx, dy = px + length * cos(theta) - x, py + length * sin(theta)
        vx = -omega * py - turning * length * sin(theta) - u
        vy = omega * px + turning * length * cos(theta)
        return (dx, dy), (vx, vy), (px, py)

    def rates(t, s):
        theta, _, turning, u = s
        (dx, dy), (vx, vy), (px, py) = between(t, s)
        far = np.hypot(dx, dy)
        press = 0.0
        if far > 5e-4:
            press = float(law.force(far - 5e-4, (dx * vx + dy * vy) / far, 0.0))
        fx, fy = (-press * dx / far, -press * dy / far) if press else (0.0, 0.0)
        # The rod's pin is carried on the crank's circle: -omega^2 p is its acceleration.
        moment = length * (cos(theta) * fy - sin(theta) * fx)
        carried = mass * arm * omega**2 * (cos(theta) * py - sin(theta) * px)
        return [turning, u, (moment + carried) / about_pin, -fx / slider]

    def gap(t, s):
        return np.hypot(*between(t, s)[0]) - 5e-4

    def rate(t, s):
        (dx, dy), (vx, vy), _ = between(t, s)
        return dx * vx + dy * vy

    gap.terminal = rate.terminal = True
    # At the start rod and crank are in line, the journal moves with the slider's pin.
    state, t, touches = [0.0, r + length, -omega * r / length, 0.0], 0.0, 0
    while t < duration:
        leg = solve_ivp(rates, (t, duration), state, "DOP853", None, False, (gap, rate),
                        rtol=1e-12, atol=1e-14, max_step=1e-4)  # fmt: skip
        t, state = leg.t[-1], leg.y[:, -1]
        touches += len(leg.t_events[0])
        if t < duration:
            leg = solve_ivp(rates, (t, t + 1e-8), state, "DOP853", rtol=1e-12, atol=1e-14)
            t, state = leg.t[-1], leg.y[:, -1]
    return state, (touches + 1) // 2


def test_a_slider_crank_with_clearance_follows_its_equations_written_for_it_alone():
    result = alone(SLIDER_CRANK)
    (theta, x, turning, u), touches = slider_crank_by_hand(0.06)
    assert len(result.intervals["small_end"]) == touches >= 3
    rod, slider = (result.part_names.index(name) for name in ("rod", "slider"))
    assert result.poses[-1, slider, 0] == pytest.approx(x, abs=1e-10)
    assert 0.12 * result.poses[-1, rod, 2] == pytest.approx(0.12 * theta, abs=1e-10)
    assert result.rates[-1, slider, 0] == pytest.approx(u, abs=1e-7)
    assert result.rates[-1, rod, 2] == pytest.approx(turning, abs=1e-6)


WHEELS_PRESS = (0.2 * 0.1 + 1.0 * 0.2) * G / 0.2  # N, by the weights' moments about the foot


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_friction_wheels_roll_on_each_other_in_the_end(formulation):
    """Both rims are then as fast, however deep they are pressed in."""
    result = run_model("textbook/friction_wheels.yaml", f"solver.formulation={formulation}")
    assert result.contacts["rims"].force[-1] == pytest.approx(WHEELS_PRESS, rel=1e-3)
    assert speed(result, "wheel")[-1] == pytest.approx(-20 * 0.05 / 0.1, rel=1e-6)
    if formulation == "redundant":
        return
    # The foot is as high as the hub: friction has no moment about it, and the press is known.
    wheel, time = speed(result, "wheel"), result.time
    slips = (time > 0.08) & (wheel > -9.5)
    assert slips.sum() > 20
    rate = np.polyfit(time[slips], wheel[slips], 1)[0]
    assert rate == pytest.approx(-0.3 * WHEELS_PRESS * 0.1 / 5e-3, rel=5e-3)


# --- whichever circle is named first ----------------------------------------------------------

FALLING = """
bodies:
  lower: {{type: rigid, mass: 2, inertia: {lower}, points: {{hub: [0, 0], rim: [0.05, 0]}}}}
  fork: {{type: rigid, mass: 0.2, inertia: 1.0e-3, points: {{axle: [0, 0]}}}}
  wheel: {{type: rigid, mass: 1, inertia: 5.0e-3, points: {{hub: [0, 0], rim: [0.1, 0]}}}}
joints:
  axle: {{type: revolute, points: [ground, lower.hub], at: [0, 0]}}
  up: {{type: prismatic, points: [ground, fork.axle], at: [0, 0], axis: [0, 1]}}
  head: {{type: revolute, points: [fork.axle, wheel.hub]}}
curves: {{rim: {{type: circle, centre: [0, 0], radius: {radius}, on: lower}}}}
contacts: {{rims: {{{shape}, law: {{stiffness: 1.0e5, restitution: 0.3, friction: 0.3}}}}}}
gravity: [0, -9.81]
initial: {{positions: {{fork: [0, {height}]}}, speeds: {{wheel: 3, lower: 20}}}}
run: {{duration: 0.5}}
accuracy: {{tolerance: 1.0e-7}}
"""
ON, IN = "radius: 0.05", "radius: 0.25, inside: true"  # the lower circle: a wheel, a ring


def falling(lower, *, swapped=False, inertia=2.5e-3, curve=False):
    """Scene of a wheel that falls on another or in a ring, both of which turn on their axles."""
    circles = ["{at: wheel.hub, radius: 0.1}", f"{{at: lower.hub, {lower}}}"]
    shape = f"type: circle_on_circle, circles: [{', '.join(circles[:: -1 if swapped else 1])}]"
    side = "left" if "inside" in lower else "right"
    if curve:
        shape = f"type: point_on_curve, point: wheel.hub, curve: rim, radius: 0.1, side: {side}"
    radius = float(lower.split(",")[0].split()[1])
    height = 0.155 if side == "right" else -0.145
    return FALLING.format(lower=inertia, shape=shape, radius=radius, height=height)


@pytest.mark.parametrize(("lower", "formulation"), [(ON, "minimal"), (IN, "redundant")])
def test_it_does_not_matter_which_circle_is_named_first(lower, formulation):
    """The wheel rolls in the end: w1 R1 = -w2 R2, in a ring w1 R1 = w2 R2."""
    settings = f"solver.formulation={formulation}", "accuracy.tolerance=1.0e-6"
    one, other = (alone(falling(lower, swapped=way), *settings) for way in (False, True))
    np.testing.assert_allclose(one.poses[-1], other.poses[-1], atol=1e-8)
    ratio = -0.5 if lower == ON else 2.5
    for result in (one, other):
        assert speed(result, "wheel")[-1] == pytest.approx(
            ratio * speed(result, "lower")[-1], rel=1e-6
        )


@pytest.mark.parametrize(
    ("lower", "way", "radius", "formulation"),
    [(ON, 1, 0.05, "redundant"), (IN, -1, 0.25, "minimal")],
)
def test_friction_turns_each_wheel_as_its_radius_says(lower, way, radius, formulation):
    """I1 dw1/R1 = I2 dw2/R2 through bounces, slip and rolling; less one sign in a ring."""
    text = falling(lower, inertia=0.02)
    result = alone(text, f"solver.formulation={formulation}", "accuracy.tolerance=1.0e-6")
    gained = 5e-3 * (speed(result, "wheel") - 3) / 0.1
    given = 0.02 * (speed(result, "lower") - 20) / radius
    assert abs(gained).max() > 0.05
    np.testing.assert_allclose(gained, way * given, atol=1e-5 * abs(gained).max())


@pytest.mark.parametrize("lower", [ON, IN])
def test_a_roller_on_a_round_cam_is_a_circle_on_another(lower):
    circles, cam = (alone(falling(lower, inertia=0.02, curve=curve)) for curve in (False, True))
    np.testing.assert_allclose(cam.poses[-1], circles.poses[-1], atol=1e-8)
    np.testing.assert_allclose(cam.rates[-1], circles.rates[-1], atol=1e-7)


@pytest.mark.parametrize(("clearance", "formulation"), [(1e-3, "redundant"), (1e-5, "minimal")])
def test_a_journal_far_deeper_than_its_clearance_is_braked_by_its_own_radius(
    clearance, formulation
):
    """By mu N r, with N between W and W/sqrt(1 + mu^2): pressed in 0.2 mm, clearance 0.01 mm."""
    text = f"""
bodies: {{rotor: {{type: rigid, mass: 2, inertia: 0.01, points: {{hub: [0, 0]}}}}}}
joints:
  hub:
    type: revolute
    points: [rotor.hub, ground]
    at: [0, 0]
    clearance: {clearance}
    radius: 0.02
    law: {{stiffness: 2.0e5, restitution: 0, transition_speed: 0.1, friction: 0.1}}
gravity: [0, -9.81]
initial: {{speeds: {{rotor: 100}}}}
run: {{duration: 0.4}}
accuracy: {{tolerance: 1.0e-6}}
"""
    result = alone(text, f"solver.formulation={formulation}")
    late = result.time > 0.2
    rate = np.polyfit(result.time[late], speed(result, "rotor")[late], 1)[0]
    assert rate == pytest.approx(-0.1 * 2 * G * 0.02 / 0.01, rel=0.1**2 / 2 + 1e-3)

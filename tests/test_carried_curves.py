"""Slots in curves that bodies carry, against closed forms and against the same curve at rest."""

import numpy as np
import pytest
from physics_tools import angle, run, scene, where
from scipy.integrate import solve_ivp

from exudyn_flexlink.source import SceneError

TOLERANCES = [1e-3, 1e-8]
OMEGA = 3.0


def ends(tolerance, duration=1.0):
    return f"run: {{duration: {duration}}}\naccuracy: {{tolerance: {tolerance}}}\n"


# --- a bead in a groove of a wheel that is driven ---------------------------------------------


def bead(groove, start, tolerance):
    return f"""
curves: {{groove: {groove}}}
bodies:
  wheel: {{type: rigid, mass: 1, inertia: 1}}
  bead: {{type: rigid, mass: 0.3, inertia: 0}}
joints:
  axle: {{type: revolute, points: [ground, wheel.centre], at: [0, 0]}}
  slot: {{type: slot, point: bead.centre, curve: groove}}
drives: {{motor: {{type: speed, joint: axle, value: {OMEGA} rad/s}}}}
initial: {start}
{ends(tolerance)}
"""


@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_a_bead_in_a_turning_straight_groove_is_thrown_out_as_a_hyperbolic_cosine(tolerance):
    """r'' = omega^2 r, from rest in the groove."""
    groove = "{type: line, from: [-1, 0], to: [9, 0], on: wheel}"
    start = "{positions: {bead: [0.1, 0]}, velocities: {bead: [0, 0.3]}}"
    found = run(bead(groove, start, tolerance))
    r, turned = 0.1 * np.cosh(OMEGA * found.time), OMEGA * found.time
    expected = np.column_stack([r * np.cos(turned), r * np.sin(turned)])
    np.testing.assert_allclose(where(found, "bead.centre"), expected, atol=tolerance)
    # What the groove pushes aside: Coriolis, m 2 omega r'.
    push = 0.3 * 2 * OMEGA**2 * 0.1 * np.sinh(turned)
    force = np.hypot(*found.slot_forces["slot"].T)
    np.testing.assert_allclose(force, push, atol=1e3 * tolerance)


@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_a_bead_in_a_turning_round_groove_off_its_axle_swings_as_a_pendulum(tolerance):
    """phi'' = -(omega^2 d / R) sin phi, phi from the line that leads from the axle outwards."""
    radius, off, phi = 0.2, 0.3, 1.0
    groove = f"{{type: circle, centre: [{off}, 0], radius: {radius}, on: wheel}}"
    place = np.array([off + radius * np.cos(phi), radius * np.sin(phi)])
    speed = OMEGA * np.array([-place[1], place[0]])
    start = f"{{positions: {{bead: {place.tolist()}}}, velocities: {{bead: {speed.tolist()}}}}}"
    found = run(bead(groove, start, tolerance))

    def swing(_, y):
        return [y[1], -(OMEGA**2) * off / radius * np.sin(y[0])]

    y = solve_ivp(swing, (0, 1), [phi, 0], "DOP853", found.time, rtol=1e-12, atol=1e-13).y[0]
    own = off + radius * np.exp(1j * y)
    expected = own * np.exp(1j * OMEGA * found.time)
    np.testing.assert_allclose(where(found, "bead.centre") @ [1, 1j], expected, atol=tolerance)


# --- the same curve, carried or at rest -------------------------------------------------------

ARM = """
curves:
  track: {{type: joined, pieces: [{{type: ellipse, centre: [0, 0], semi_axes: [0.4, 0.3],
    from: -90 deg, to: 90 deg}}, {{type: circle, centre: [0, 0], radius: 0.3,
    from: 90 deg, to: 270 deg}}]{on}}}
bodies:
  plate: {{type: rigid, mass: 1, inertia: 1, points: {{a: [0, 0]}}}}
  arm: {{type: rigid, mass: 1, inertia: 0.02, points: {{pin: [0.1, 0]}}}}
joints:
  held: {{type: weld, points: [ground, plate.a], at: [0, 0], angle: 30 deg}}
  slot: {{type: slot, point: arm.pin, curve: track}}
initial: {{velocities: {{arm: [0, 1]}}, guesses: {{arm: 200 deg}}}}
"""


@pytest.mark.parametrize("formulation", ["minimal", "redundant"])
def test_a_curve_on_a_body_that_is_held_is_the_curve_at_rest(formulation):
    """Turned by the weld's angle, against the ellipse and circle turned in the ground."""
    turned = """
curves:
  track: {type: joined, pieces: [{type: ellipse, centre: [0, 0], semi_axes: [0.4, 0.3],
    rotation: 30 deg, from: -90 deg, to: 90 deg}, {type: circle, centre: [0, 0], radius: 0.3,
    from: 120 deg, to: 300 deg}]}
"""
    bodies = ARM.format(on="")
    at_rest = turned + bodies[bodies.index("bodies:") :]
    method = f"solver: {{formulation: {formulation}}}\n"
    tolerance = 1e-8 if formulation == "minimal" else 1e-4
    runs = [
        run(text + method + ends(tolerance)) for text in (ARM.format(on=", on: plate"), at_rest)
    ]
    pins = [where(one, "arm.pin")[-1] for one in runs]
    np.testing.assert_allclose(*pins, atol=2 * tolerance)
    assert angle(runs[0], "arm")[-1] == pytest.approx(angle(runs[1], "arm")[-1], abs=20 * tolerance)


WHEEL = """
curves: {groove: {type: ellipse, centre: [0, 0], semi_axes: [0.3, 0.2], on: wheel}}
bodies:
  wheel: {type: rigid, mass: 2, inertia: 0.1, points: {rim: [0.4, 0]}}
  arm: {type: rigid, mass: 1, inertia: 0.02, points: {hinge: [-0.5, 0], pin: [0.1, 0]}}
joints:
  axle: {type: revolute, points: [ground, wheel.centre], at: [0, 0]}
  hinge: {type: revolute, points: [ground, arm.hinge], at: [-0.6, -0.1]}
  slot: {type: slot, point: arm.pin, curve: groove}
initial: {speeds: {wheel: 5}, guesses: {arm: 10 deg}}
gravity: 9.81
"""


def test_a_pin_in_the_groove_of_a_free_wheel_in_both_formulations():
    """Energy is kept; the pin is on the groove; Exudyn's own solver agrees to its own error.

    Newton's third law: the axle bears the wheel's weight and the pin's push.
    """
    fine = run(WHEEL + ends(1e-8))
    assert fine.checks.energy_residual < 1e-7
    pin = where(fine, "arm.pin") @ [1, 1j] * np.exp(-1j * angle(fine, "wheel"))
    np.testing.assert_allclose((pin.real / 0.3) ** 2 + (pin.imag / 0.2) ** 2, 1, atol=1e-9)
    expected = np.array([0, 2 * 9.81]) + fine.slot_forces["slot"]
    np.testing.assert_allclose(fine.joint_forces["axle"], expected, atol=1e-5)
    other = run(WHEEL + ends(1e-5) + "solver: {formulation: redundant}\n")
    np.testing.assert_allclose(
        where(fine, "wheel.rim")[-1], where(other, "wheel.rim")[-1], atol=5e-5
    )
    np.testing.assert_allclose(fine.slot_forces["slot"][0], other.slot_forces["slot"][0], atol=1e-3)


# --- what is refused --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("on: wheel", "on: weel", r"curves\.groove\.on: unknown body 'weel'; did you mean 'wheel'"),
        ("on: wheel", "on: arm", r"joints\.slot\.point: is on 'arm', which carries the curve"),
    ],
)
def test_what_can_not_carry_a_curve_is_named(old, new, message):
    with pytest.raises(SceneError, match=message):
        scene(WHEEL.replace(old, new) + ends(1e-5))


def test_a_flexible_body_carries_no_curve_and_a_piece_is_not_carried_alone():
    text = """
materials: {steel: {density: 7850, youngs_modulus: 200 GPa}}
curves:
  a: {type: line, from: [0, 0], to: [1, 0], on: strip}
  b: {type: joined, pieces: [a]}
bodies:
  strip: {type: flexible, length: 1, material: steel, section: {width: 1 cm, thickness: 1 mm},
    rods: 3, hinges: {stiffness: beam}}
"""
    with pytest.raises(SceneError) as found:
        scene(text + ends(1e-5))
    assert "curves.a.on: 'strip' is flexible" in str(found.value)
    assert "curves.b.pieces.0: a piece of a curve can't be carried by itself" in str(found.value)

"""Laws of nature: flexible links held anywhere, and links that stretch."""

from math import sqrt, tan

import numpy as np
import pytest
from physics_tools import KILOGRAM, SQUARE, STEEL, angle, run, scene, where
from scipy.integrate import solve_ivp

from exudyn_flexlink.effects import idealise
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.observables import path

G = 9.81

BEAM = """
bodies:
  beam: {type: flexible, length: 1, material: steel, section: {width: 10 mm, thickness: 10 mm},
         rods: RODS, layout: half_ends, hinges: {stiffness: beam, damping: DAMPING},
         stretch: STRETCH, points: {mid: 0.5, quarter: 250 mm}}
joints:
JOINTS
gravity: [0, -9.81]
run: {duration: 0.2}
accuracy: {tolerance: 1.0e-7}
"""


def beam(joints, rods=8, damping=0, stretch="false"):
    """A steel beam of 1 m, 10 mm thick."""
    text = STEEL + BEAM.replace("RODS", str(rods)).replace("DAMPING", str(damping))
    return text.replace("STRETCH", stretch).replace("JOINTS", joints)


@pytest.mark.parametrize("stretch", ["false", "true"])
def test_a_beam_clamped_at_its_end_is_the_mirror_image_of_one_clamped_at_its_start(stretch):
    near, far = (
        run(
            beam(
                f"  clamp: {{type: weld, points: [ground, beam.{end}], at: [0, 0]}}", 4, 0, stretch
            )
        )
        for end in ("start", "end")
    )
    for one, other in (("end", "start"), ("mid", "mid")):
        mirrored = where(far, f"beam.{other}") * [-1, 1]
        assert np.abs(where(near, f"beam.{one}") - mirrored).max() < 2e-7


@pytest.mark.parametrize(
    ("holds", "factor"),
    [
        ("  a: {type: weld, points: [ground, beam.start], at: [0, 0]}\n"
         "  b: {type: weld, points: [ground, beam.end], at: [1, 0]}", 1 / 384),
        ("  a: {type: revolute, points: [ground, beam.start], at: [0, 0]}\n"
         "  b: {type: revolute, points: [ground, beam.end], at: [1, 0]}", 5 / 384),
        ("  a: {type: weld, points: [ground, beam.start], at: [0, 0]}\n"
         "  b: {type: revolute, points: [ground, beam.end], at: [1, 0]}", 1 / 192),
    ],
)  # fmt: skip
def test_a_beam_held_at_both_ends_sags_as_tables_say(holds, factor):
    """At its middle by w L^4 / E I times the factor; it stretches by less than rounding sees."""
    held = run(beam(holds, 16, 20.0, "true"), "run.duration=3", "accuracy.tolerance=1e-6")
    sag = factor * KILOGRAM * G / (200e9 * 1e-8 / 12)
    assert -where(held, "beam.mid")[-1, 1] == pytest.approx(sag, rel=0.02)


def test_a_link_held_at_a_station_on_its_hinge_droops_on_both_sides():
    """Two rods and their spring: ``m l^2/3 a'' = -m g l/2 cos a - 2 k a``."""
    text = f"""{STEEL}
bodies:
  wing: {{type: flexible, length: 1, material: steel, {SQUARE}, rods: 2,
         hinges: {{stiffness: 3}}, points: {{mid: 500 mm}}}}
joints: {{pin: {{type: revolute, points: [ground, wing.mid], at: [0.2, 0.3]}}}}
gravity: [0, -9.81]
run: {{duration: 1}}
accuracy: {{tolerance: 1.0e-8}}
"""
    wing = run(text)
    mass, length = KILOGRAM / 2, 0.5

    def swing(_, y):
        moment = -mass * G * length / 2 * np.cos(y[0]) - 2 * 3 * y[0]
        return [y[1], moment / (mass * length**2 / 3)]

    exact = solve_ivp(swing, (0, 1), [0, 0], "DOP853", rtol=1e-12, atol=1e-12, t_eval=wing.time).y
    assert np.abs(angle(wing, "wing 2") - exact[0]).max() < 1e-7
    assert np.abs(angle(wing, "wing 1") + exact[0]).max() < 1e-7
    np.testing.assert_allclose(where(wing, "wing.mid"), [[0.2, 0.3]] * len(wing.time), atol=1e-12)


def test_stations_stay_where_a_link_becomes_rigid():
    flexible = scene(beam("  p: {type: revolute, points: [ground, beam.quarter], at: [0, 0]}"))
    rigid = simulate(idealise(flexible, ["flexibility"]))
    arm = np.hypot(*(where(rigid, "beam.mid") - where(rigid, "beam.quarter")).T)
    np.testing.assert_allclose(arm, 0.25, atol=1e-12)


# --- stretch ------------------------------------------------------------------------------------

SPUN = """
materials: {stuff: {density: 1200, youngs_modulus: 28 GPa}}
bodies:
  hub: {type: rigid, mass: 1, inertia: 1, points: {o: [0, 0]}}
  beam: {type: flexible, length: 10, material: stuff, rods: RODS, stretch: true,
         section: {type: general, area: 1.0e-3, second_moment: 5.0e-7},
         hinges: {stiffness: beam, damping: 3000}}
joints:
  shaft: {type: revolute, points: [ground, hub.o], at: [0, 0]}
  clamp: {type: weld, points: [hub.o, beam.start]}
drives: {motor: {type: speed, joint: shaft, value: 6, ramp: 4}}
run: {duration: 8}
accuracy: {tolerance: 1.0e-9}
"""


def test_a_spun_beam_stretches_as_its_closed_form_at_order_2():
    """Simo and Vu-Quoc's: tan(alpha L)/alpha - L, alpha = omega sqrt(rho A / E A)."""
    alpha = 6 * sqrt(1.2 / 2.8e7)
    exact = tan(10 * alpha) / alpha - 10
    errors = []
    for rods in (2, 4, 8):
        result = simulate(scene(SPUN.replace("RODS", str(rods))))
        late = np.hypot(*path(result, "beam.end").position[result.time > 7].T)
        errors.append(late.mean() - 10 - exact)
    assert exact == pytest.approx(5.1432e-4, rel=1e-4)
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 4, rtol=0.01)
    assert abs(errors[-1]) < 2e-3 * exact


def test_redundant_coordinates_stretch_alike():
    """A bar let hang: its end swings about the extension under its own weight."""
    bar = beam("  top: {type: weld, points: [ground, beam.start], at: [0, 0], angle: -90 deg}",
               4, 0, "true")  # fmt: skip
    soft = bar.replace("youngs_modulus: 200 GPa", "youngs_modulus: 1 MPa")
    one = run(soft, "run={duration: 0.2, sample: 1 ms}", "accuracy.tolerance=1e-8")
    other = simulate(
        scene(soft, "run={duration: 0.2, sample: 1 ms}", "accuracy.tolerance=1e-5",
              "solver.formulation=redundant")
    )  # fmt: skip
    _, i, j = np.intersect1d(one.time.round(9), other.time.round(9), return_indices=True)
    assert np.abs(where(one, "beam.end")[i] - where(other, "beam.end")[j]).max() < 1e-5
    largest = -1 - where(one, "beam.end")[:, 1].min()
    assert largest == pytest.approx(2 * 7850 * G / (2 * 1e6), rel=0.1)  # twice the static one


def test_a_coupler_that_stretches_starts_straight_and_unstretched():
    four_bar = (
        STEEL
        + """
bodies:
  crank: {type: rod, length: 0.05, material: steel, SQUARE}
  strip: {type: flexible, length: 0.2, material: steel, SQUARE, rods: 4, hinges: {stiffness: beam},
          stretch: true}
  rocker: {type: rod, length: 0.1, material: steel, SQUARE}
joints:
  a: {type: revolute, points: [ground, crank.start], at: [0, 0]}
  b: {type: revolute, points: [crank.end, strip.start]}
  c: {type: revolute, points: [strip.end, rocker.end]}
  d: {type: revolute, points: [ground, rocker.start], at: [0.2, 0]}
drives: {motor: {type: speed, joint: a, value: 3}}
initial: {guesses: {rocker: 80 deg}}
run: {duration: 0.01}
accuracy: {tolerance: 1.0e-6}
""".replace("SQUARE", SQUARE)
    )
    state = assemble_scene(scene(four_bar)).state
    strip = state.q[1:9]
    np.testing.assert_allclose(strip[:, 2], strip[0, 2], atol=1e-9)
    np.testing.assert_allclose(state.v[1:9, 2], state.v[1, 2], atol=1e-9)
    starts = np.hypot(*(strip[:, :2] - strip[0, :2]).T)
    np.testing.assert_allclose(starts, 0.025 * np.arange(8), atol=1e-9)

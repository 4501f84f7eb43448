"""Laws of nature: springs and dampers by a formula of length and rate."""

from math import exp, pi, sqrt

import numpy as np
import pytest
from physics_tools import run, scene
from scipy.integrate import simpson
from scipy.special import ellipk

import exudyn_flexlink as fl
from exudyn_flexlink.effects import idealise

SLIDER = """
bodies: {block: {type: rigid, mass: MASS, inertia: 1, points: {b: [0, 0]}}}
joints: {way: {type: prismatic, points: [ground, block.b], at: [0, 0], axis: [1, 0]}}
springs: {s: {type: linear, PLACED, force: "FORCE"}}
accuracy: {tolerance: 1.0e-9}
"""
ALONG, BETWEEN = "joint: way", "points: [ground, block.b], at: [-1, 0]"
SHAFT = """
bodies: {rotor: {type: rigid, mass: 1, inertia: 2.0e-4, points: {hub: [0, 0]}}}
joints: {axle: {type: revolute, points: [ground, rotor.hub], at: [0, 0]}}
springs: {magnets: {type: torsional, joint: axle, torque: "TORQUE"}}
initial: {angles: {rotor: 0}, speeds: {rotor: SPEED}}
accuracy: {tolerance: 1.0e-10}
"""
TWO_RATES = "200 N/m * length + 20 N s/m * max(0, rate) + 6 N s/m * min(0, rate)"
DAMPED = {6: 6 / (2 * sqrt(200 * 2)), 20: 20 / (2 * sqrt(200 * 2))}  # ratios, by coefficient
CLICK = "40*exp(-((length - 0.1)/0.5 mm)**2)"
AREA = 40 * 0.5e-3 * sqrt(pi)  # J, of the click


def slides(mass, force, start, lasts, *settings, placed=ALONG):
    """Times, places and speeds of a block that slides from `start`, a place and a speed."""
    text = SLIDER.replace("MASS", f"{mass}").replace("FORCE", force).replace("PLACED", placed)
    initial = f"initial={{along: {{way: {start[0]}}}, speeds_along: {{way: {start[1]}}}}}"
    found = run(text, initial, f"run={{duration: {lasts}}}", *settings)
    return found, found.poses[:, 0, 0], found.rates[:, 0, 0]


def half_swing(coefficient):
    """Part of the swing that is left after half of one, and how long that takes (s)."""
    ratio = DAMPED[coefficient]
    root = sqrt(1 - ratio**2)
    return exp(-pi * ratio / root), pi / (sqrt(200 / 2) * root)


@pytest.mark.parametrize(
    ("placed", "force"),
    [(ALONG, TWO_RATES), (BETWEEN, TWO_RATES.replace("length", "(length - 1)"))],
)
def test_each_half_swing_has_its_own_damping(placed, force):
    lasts, at, expected = 0.0, 0.1, []
    for coefficient in (6, 20, 6, 20, 6):
        left, half = half_swing(coefficient)
        lasts, at = lasts + half, -at * left
        expected.append((lasts, at))
    assert lasts == pytest.approx(1.678782763, rel=1e-9)
    found, x, v = slides(2, force, (0.1, 0), lasts, placed=placed)
    for time, place in expected:
        k = np.argmin(np.abs(found.time - time))
        ahead = time - found.time[k]
        pushed = -200 * x[k] - (20 if v[k] > 0 else 6) * v[k]
        assert x[k] + v[k] * ahead + pushed / 4 * ahead**2 == pytest.approx(place, abs=1e-9)
    assert found.energy.stored == pytest.approx(0, abs=1e-15)
    assert found.energy.supplied == pytest.approx(found.energy.kinetic, abs=1e-9)


def test_what_a_damper_with_two_rates_takes_in_a_cycle():
    drive = "drives={m: {type: motion, joint: way, value: 0.02*sin(10*t)}}"
    sample = f"run={{duration: {pi / 5}, sample: {pi / 5 / 160}}}"
    found, _, v = slides(2, TWO_RATES, (0, 0.2), pi / 5, drive, sample)
    power = -found.spring_forces["s"][:, 0] * v
    quarters = [simpson(power[k : k + 41], dx=pi / 5 / 160) for k in range(0, 160, 40)]
    assert sum(quarters) == pytest.approx(0.163362818, abs=5e-10)


def test_a_cubic_spring_swings_with_its_elliptic_period():
    stiff, cubic, at = 100, 4e4, 0.1
    lasts = (
        4
        * ellipk(cubic * at**2 / (2 * (stiff + cubic * at**2)))
        / sqrt((stiff + cubic * at**2) / 0.5)
    )
    assert lasts == pytest.approx(0.224840392, rel=1e-9)
    formula, sample = "100*length + 4e4*length**3", f"run.sample={lasts / 8}"
    found, x, v = slides(0.5, formula, (at, 0), lasts, sample)
    assert (x[-1], v[-1]) == pytest.approx((at, 0), abs=1e-7)
    assert x[-1] == pytest.approx(at, abs=1e-9)
    quarter = np.argmin(np.abs(found.time - lasts / 4))
    assert v[quarter] == pytest.approx(-2.449489743, abs=1e-8)
    assert found.energy.kinetic[quarter] == pytest.approx(1.5, abs=1e-8)
    assert found.energy.stored[quarter] - found.energy.stored[0] == pytest.approx(-1.5, abs=1e-8)
    assert found.energy.supplied == pytest.approx(0, abs=1e-11)


@pytest.mark.parametrize(
    ("rate", "speed", "arrives"),  # AREA is energy that is stored, or momentum that is lost
    [("", sqrt(1 - 2 * AREA / 0.1), 0.28521317), (" * rate", 1 - AREA / 0.1, 0.2548685848)],
)
def test_a_click_is_never_stepped_over(rate, speed, arrives):
    found, x, v = slides(0.1, CLICK + rate, (0, 1), arrives)
    assert x[-1] == pytest.approx(0.2, abs=1e-9)
    assert v[-1] == pytest.approx(speed, abs=1e-8)
    given = found.energy.supplied[-1] if rate else -found.energy.stored[-1]
    assert 0.05 * v[-1] ** 2 - 0.05 == pytest.approx(given, abs=1e-10)
    assert (found.energy.stored[-1] == 0) == bool(rate)


def turns(speed, lasts, drag="2e-4*rate"):
    """Times, angles and speeds of a shaft with magnets, six to a turn."""
    text = SHAFT.replace("TORQUE", f"0.04*sin(6*angle) + {drag}").replace("SPEED", f"{speed}")
    found = run(text, f"run={{duration: {lasts}}}")
    return found.poses[:, 0, 2], found.rates[:, 0, 2]


@pytest.mark.parametrize(
    ("lasts", "angle", "speed"),  # by two integrations with other methods
    [(0.05, 1.905396884, 37.63288583), (1.785243033, 31.84619658, 0), (2, 31.42866298, None)],
)
def test_magnets_slow_a_shaft_and_hold_it(lasts, angle, speed):
    """It stays in tooth 30, at 10 pi."""
    turned, rate = turns(40, lasts)
    assert turned[-1] == pytest.approx(angle, abs=1e-8)
    assert speed is None or rate[-1] == pytest.approx(speed, abs=1e-6)


@pytest.mark.parametrize(("part", "passes"), [(0.999, False), (1.001, True)])
def test_a_shaft_passes_a_magnet_from_the_least_speed_on(part, passes):
    turned, _ = turns(part * sqrt(4 * 0.04 / (6 * 2e-4)), 0.4, drag="0*rate")
    assert (turned.max() > pi / 3) == passes


def test_a_fast_shaft_takes_its_time_from_magnet_to_magnet():
    assert turns(40, 0.0267525013, drag="0")[0][-1] == pytest.approx(pi / 3, abs=1e-8)
    quarter = pi / 2 / sqrt(6 * 0.04 / 2e-4)
    assert turns(1e-3, quarter, drag="0")[1][-1] == pytest.approx(0, abs=1e-9)


def test_without_damping_a_formula_has_0_for_its_rate():
    text = SLIDER.replace("MASS", "2").replace("PLACED", ALONG).replace("FORCE", TWO_RATES)
    ideal = idealise(scene(text + "run: {duration: 1}\n"), ["damping"])
    assert ideal.springs["s"].force.text == TWO_RATES.replace("rate", "0")


def test_linear_equations_have_the_slopes_by_length_and_by_rate():
    text = SLIDER.replace("MASS", "2").replace("PLACED", ALONG)
    formula = "300*tanh(length/0.5) + 8*rate*(1 + length) + rate**3"
    still = scene(text.replace("FORCE", formula) + "run: {duration: 1}\n")
    model = fl.linearised(still)
    assert model.stiffness == pytest.approx(600)
    assert model.damping == pytest.approx(8)

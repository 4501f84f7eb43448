"""Pulses of formulas that are shorter than a step, in time or along the way: closed forms."""

from itertools import pairwise
from math import asin, cos, exp, log, pi, sin, sqrt

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.expressions import parse_expression, resolved
from exudyn_flexlink.loading import assemble_scene, scene_of
from exudyn_flexlink.source import parse_document

MASS, TOLERANCE = 2.0, 1e-6  # kg, m

BLOCK = """title: a block slides freely, but for a pulse
bodies: {{block: {{type: rigid, mass: 2, inertia: 1, points: {{b: [0, 0]}}}}}}
joints: {{way: {{type: prismatic, points: [ground, block.b], at: [0, 0], axis: [1, 0]}}}}
drives: {{push: {{type: force, point: block.b, value: ["{force}", 0]}}}}
initial: {{along: {{way: 0}}, speeds_along: {{way: {speed}}}}}
run: {{duration: {lasts}}}
accuracy: {{tolerance: 1.0e-6}}
"""
LED = """title: a block is led along a line, and a mass on a spring hangs on it
bodies:
  block: {{type: rigid, mass: 2, inertia: 1, points: {{b: [0, 0]}}}}
  load: {{type: rigid, mass: 1, inertia: 1, points: {{c: [0, 0]}}}}
joints:
  way: {{type: prismatic, points: [ground, block.b], at: [0, 0], axis: [1, 0]}}
  shelf: {{type: prismatic, points: [block.b, load.c], axis: [1, 0]}}
springs: {{s: {{type: linear, joint: shelf, stiffness: 25, length: 0}}}}
drives: {{lead: {{type: {drive}, joint: way, value: "{value}"}}}}
initial: {{along: {{shelf: 0}}}}
run: {{duration: 1}}
accuracy: {{tolerance: 1.0e-6}}
"""


ARM = """title: an arm is turned
bodies: {{arm: {{type: rigid, mass: 1, inertia: 1, points: {{hub: [0, 0], tip: [1, 0]}}}}}}
joints: {{axle: {{type: revolute, points: [ground, arm.hub], at: [0, 0]}}}}
drives: {{motor: {{type: {drive}, joint: axle, value: "{value}"}}}}
run: {{duration: 0.6}}
accuracy: {{tolerance: 1.0e-6}}
"""


def run(text, *settings):
    return simulate(scene_of(parse_document(text, "test"), settings))


BELL, ROOF = "exp(-((t-0.3)/1e-4)**2)", "max(0, 1 - abs((t-0.3)/2e-5))"
FORMULATIONS = [["solver.formulation=minimal"], ["solver.formulation=redundant"]]


@pytest.mark.parametrize("settings", FORMULATIONS)
@pytest.mark.parametrize(
    ("force", "way"),
    [  # of 2 kg after 1 s
        (f"where(t < 0.1, 1000, 10*{BELL})", 50 * 0.95 + 5e-4 * sqrt(pi) * 0.7),
        (f"3*cos(3*t)*(1 + {ROOF})", 1 / 6 * (1 - cos(3)) + 3e-5 * cos(0.9) * 0.7),
        ("2000 + where(abs(t - 0.30007) < 1e-6, 100, 0)", 500 + 1e-4 * 0.69993),
        ("12*t + 4/(exp((t-0.3)/1e-4) + exp((0.3-t)/1e-4))", 1 + 1e-4 * pi * 0.7),
        (f"50*({BELL} - exp(-((t-0.302)/1e-4)**2))", 25e-4 * sqrt(pi) * 2e-3),
    ],
)
def test_a_pulse_counts_by_the_tolerance(force, way, settings):
    """Whatever else the force does, and however large it is."""
    found = run(BLOCK.format(force=force, speed=0, lasts=1), *settings)
    assert found.poses[-1, 0, 0] == pytest.approx(way, abs=TOLERANCE, rel=0)


@pytest.mark.parametrize("settings", FORMULATIONS)
@pytest.mark.parametrize(
    ("drive", "value", "turn"),
    [
        ("speed", "10*(1 + 0.0199*exp(-((t-0.3)/3e-3)**2))", 6 + 0.199 * 3e-3 * sqrt(pi)),
        ("speed", f"20*t + 0.1*{BELL} + 3*{ROOF}", 3.6 + 1e-5 * sqrt(pi) + 6e-5),
        ("speed", "1e3*sin(20*t)*exp(-((t-0.3)/1e-7)**2)", 1e-4 * sqrt(pi) * sin(6)),
        ("torque", f"where(t < 0.1, 200, 0) + {BELL} - 3*{ROOF}", 11 + 3e-5 * sqrt(pi) - 18e-6),
        ("motion", "3*t + 1e-5*(1 + tanh((t-0.3)/1e-6))", 1.8 + 2e-5),
    ],
)
def test_a_pulse_turns_an_arm(drive, value, turn, settings):
    found = run(ARM.format(drive=drive, value=value), *settings)
    assert found.poses[-1, 0, 2] == pytest.approx(turn, abs=TOLERANCE, rel=0)


def test_a_run_by_steps_ends_them_at_pulses():
    """Without a tolerance a millionth of the mechanism's reach stands for it."""
    text = BLOCK.format(force=f"1000 + 10*{BELL}", speed=0, lasts=1)
    text = text.replace("tolerance: 1.0e-6", "step: 0.01")
    found = run(text, "solver.formulation=minimal")
    assert found.poses[-1, 0, 0] == pytest.approx(250 + 5e-4 * sqrt(pi) * 0.7, abs=TOLERANCE)


def test_a_force_too_fast_to_look_into_is_told():
    text = BLOCK.format(force="1e4*sin(1e7*t)", speed=0, lasts=1)
    (told,) = assemble_scene(scene_of(parse_document(text, "test"))).mechanism.unfound
    assert told.startswith("drive 'push' varies too fast to look for pulses shorter than")


def test_a_condition_is_not_missed_between_looks():
    found = parse_expression("where(abs(t - 0.3) < 1e-9, 1, 0)*abs(cos(1e3*t))").bends(0.0, 1.0)
    rest = [t for t in found if abs(t - 0.3) > 1e-6]
    assert rest == pytest.approx([(k + 0.5) * pi / 1e3 for k in range(318)], abs=1e-14)
    near = [t - 0.3 for t in found if abs(t - 0.3) < 1e-6]
    assert near == pytest.approx([-1e-9, 0.0, 1e-9], abs=1e-15)


@pytest.mark.parametrize(("size", "width"), [(1.0, 1e-4), (0.3, 1e-3), (1e3, 1e-6)])
def test_a_weak_pulse_along_the_way_counts_by_the_tolerance(size, width):
    """On a block that a thousandfold force pulls back, in the same term and as another."""
    bell = f"exp(-((place(way) - 0.3003)/{width})**2)"
    found = run(BLOCK.format(force=f"-200*place(way) + {size}*{bell}", speed=9, lasts=0.1))
    passed = asin(0.3003 * 10 / 9) / 10
    after = sqrt(81 * cos(10 * passed) ** 2 + 2 * size * width * sqrt(pi) / MASS)
    left = 0.1 - passed
    right = 0.3003 * cos(10 * left) + after / 10 * sin(10 * left)
    # Within the bell it is slower than after it: by less than the time that this takes.
    allowed = TOLERANCE + size * width**2 / MASS / 9
    assert found.poses[-1, 0, 0] == pytest.approx(right, abs=allowed, rel=0)


def test_a_pulse_too_weak_to_matter_costs_no_steps():
    """A force of 1e-9 N that swings a million times: 1e-16 m at most."""
    found = run(BLOCK.format(force="1e-9*sin(1e6*t)", speed=1, lasts=1))
    assert found.checks.steps < 100


@pytest.mark.parametrize(
    ("drive", "value"),
    [
        ("speed", "10*exp(-((t - 0.5003)/1e-5)**2)"),
        ("motion", "1e-4*sqrt(pi)*0.5*(1 + tanh((t - 0.5003)/1e-5))"),
    ],
)
def test_no_pulse_of_a_prescribed_motion_is_overlooked(drive, value):
    """The block jumps by 0.18 mm, and the mass swings about its new place with omega = 5 rad/s."""
    found = run(LED.format(drive=drive, value=value))
    jump = 1e-4 * sqrt(pi)
    assert found.poses[-1, 0, 0] == pytest.approx(jump, abs=TOLERANCE)
    load = jump * (1 - cos(5 * (1 - 0.5003)))
    assert found.poses[-1, 1, 0] == pytest.approx(load, abs=TOLERANCE)


def test_the_energy_of_a_drive_in_a_pulse_is_summed_up():
    """Where nothing is free: at its end the block is as fast as before, so that none is left."""
    text = BLOCK.format(force="0*t", speed=1, lasts=1)
    text = text.replace("type: force, point: block.b", "type: speed, joint: way")
    text = text.replace('["0*t", 0]', '"1 + 10*exp(-((t - 0.5003)/1e-4)**2)"')
    found = run(text.replace(", speeds_along: {way: 1}", ""))
    assert found.poses[-1, 0, 0] == pytest.approx(1 + 1e-3 * sqrt(pi), abs=TOLERANCE)
    largest = MASS / 2 * 11**2
    assert found.energy.supplied[-1] == pytest.approx(0, abs=1e-5 * largest)


# --- springs by a formula -----------------------------------------------------------------------

SLIDER = """title: a slider passes a click
bodies: {m: {type: rigid, mass: 2, inertia: 1, points: {c: [0, 0]}}}
joints: {way: {type: prismatic, points: [ground, m.c], at: [0, 0], axis: [1, 0]}}
springs: {click: {type: linear, joint: way, force: FORCE}}
initial: {along: {way: 0}, speeds_along: {way: SPEED}}
run: {duration: LASTS}
accuracy: {tolerance: 1.0e-6}
"""
WHEEL = """title: a wheel passes a click
bodies: {m: {type: rigid, mass: 1, inertia: 2, points: {c: [0, 0], rim: [1, 0]}}}
joints: {way: {type: revolute, points: [ground, m.c], at: [0, 0]}}
springs: {click: {type: torsional, joint: way, torque: FORCE}}
initial: {speeds: {m: SPEED}}
run: {duration: LASTS}
accuracy: {tolerance: 1.0e-6}
"""
PUSHED = SLIDER.replace(
    "springs: {click: {type: linear, joint: way, force: FORCE}}",
    'drives: {push: {type: force, point: m.c, value: ["-(FORCE)", 0]}}',
)
SCENES = {"length": (SLIDER, 0), "angle": (WHEEL, 2), "place(way)": (PUSHED, 0)}
AT = 0.5  # m or rad, of the click
ASIDE = 8.0  # widths: no force is left so far from it


def click(energy, width, place):
    """Force that stores an energy (J) at a click of a width (m or rad), without it around."""
    off = f"(({place} - {AT})/{width})"
    return f"{-2 * energy / width}*{off}*exp(-{off}**2)"


def passed(force, speed, lasts, place="length"):
    """A run, and the place at its end."""
    text, coordinate = SCENES[place]
    formula = force if place == "place(way)" else f'"{force}"'
    text = text.replace("FORCE", formula).replace("SPEED", f"{speed}")
    found = run(text.replace("LASTS", f"{lasts}"), "solver.formulation=minimal")
    return found, found.poses[-1, 0, coordinate]


def beyond(energy, width, speed, lasts):
    """Place after a time of what passes a click, or is turned back by it: energy is kept."""
    near, kinetic = ASIDE * width, MASS * speed**2 / 2
    top = width * sqrt(log(energy / kinetic)) if energy > kinetic else 0.0

    def slowness(root):
        """Time by the root of the distance from where it turns: that keeps it finite."""
        off = (top + root**2) / width
        left = kinetic - energy * exp(-(off**2))
        return 2 * root / sqrt(2 * left / MASS)

    edges = np.linspace(0, sqrt(near - top), 9)
    half = sum(quad(slowness, a, b, epsabs=1e-13)[0] for a, b in pairwise(edges))
    left = lasts - (AT - near) / speed - 2 * half
    return AT - near - speed * left if top else AT + near + speed * left


@pytest.mark.parametrize("place", ["length", "angle"])
@pytest.mark.parametrize(
    ("energy", "width", "speed"),  # of 1 J at 1 m/s or rad/s
    [
        (0.8, 0.02, 1),
        (0.8, 0.01, 1),
        (0.8, 0.005, 1),
        (0.8, 0.001, 1),
        (-0.8, 0.01, 1),  # a catch
        (0.02, 1e-4, 1),
        (5.0, 0.003, 3),
        (1.5, 0.01, 1),  # turns it back
        (1.1, 0.001, 1),
    ],
)
def test_no_click_is_passed_unseen(energy, width, speed, place):
    """Nor is energy missed: what it stores is the integral of its force, however narrow."""
    lasts = 1.0 / speed
    found, end = passed(click(energy, width, place), speed, lasts, place)
    assert end == pytest.approx(beyond(energy, width, speed, lasts), abs=TOLERANCE, rel=0)
    assert found.checks.energy_residual < 1e-6
    assert not found.warnings


@pytest.mark.parametrize("energy", [0.8, 1.5, -2.0])
def test_a_drive_of_the_place_moves_as_a_spring(energy):
    ends = [passed(click(energy, 0.01, own), 1, 1.2, own)[1] for own in ("length", "place(way)")]
    assert ends[0] == pytest.approx(ends[1], abs=TOLERANCE, rel=0)


def test_a_weak_click_in_a_strong_spring_counts_by_the_tolerance():
    """It swings with 10 rad/s; 0.5 of 100 J slow it while it is within the click, and no more."""
    found, end = passed(f"200*length + {click(0.5, 0.001, 'length')}", 10, 0.1)
    within = quad(
        lambda x: 1 / sqrt(100 - 100 * x**2 - 0.5 * exp(-(((x - AT) / 0.001) ** 2)))
        - 1 / sqrt(100 - 100 * x**2),
        AT - 0.008, AT + 0.008, epsabs=1e-15,
    )[0]  # fmt: skip
    assert end == pytest.approx(sin(10 * (0.1 - within)), abs=TOLERANCE, rel=0)
    assert found.checks.energy_residual < 1e-6


@pytest.mark.parametrize("wide", [0.02, 100])
def test_a_hundred_magnets_a_turn(wide):
    """All around, or in a part of a turn (rad) that a free wheel comes to."""
    formula = f"20*sin(100*angle)*exp(-((angle - 0.6)/{wide})**4)"
    found, end = passed(formula, 10, 0.1, "angle")
    right = solve_ivp(
        lambda _, y: [y[1], -10 * np.sin(100 * y[0]) * np.exp(-(((y[0] - 0.6) / wide) ** 4))],
        (0, 0.1), [0, 10], "DOP853", rtol=1e-12, atol=1e-13, max_step=1e-4,
    )  # fmt: skip
    assert end == pytest.approx(right.y[0, -1], abs=TOLERANCE, rel=0)
    assert found.checks.energy_residual < 1e-5


@pytest.mark.parametrize("half", [5e-3, 5e-4, 5e-6])
def test_a_spike_of_a_table_is_met(half):
    """It is at rows, where steps end. The slider has 1 J, of which the spike takes a tenth."""
    rows = [[-1, 0], [AT - half, 0], [AT, 0.1 / half], [AT + half, 0], [2, 0]]
    text = SLIDER.replace("FORCE", f"{{points: {rows}}}").replace("SPEED", "1")
    found = run(text.replace("LASTS", "1.2"), "solver.formulation=minimal")
    after = sqrt(0.9)
    # As fast as at the end, but for less than the way through it at the speed that it loses.
    right = AT + (1.2 - AT) * after
    assert found.poses[-1, 0, 0] == pytest.approx(right, abs=TOLERANCE + half * (1 / after - 1))
    assert found.checks.energy_residual < 1e-9


def test_a_spring_stores_energy_where_it_goes_alone():
    """It swings by 0.06 m; the formula has no value beyond 0.07 m."""
    found, end = passed("50*length + 1e-9*sqrt(0.07 - length)", 0.3, 2)
    assert found.outcome.completed
    assert end == pytest.approx(0.06 * sin(10), abs=TOLERANCE)
    assert found.checks.energy_residual < 1e-9


def test_where_a_derivative_has_no_bounds_no_higher_one_is_asked_for():
    """Every round halves the part with the kink; its eighth derivative costs the most by far."""
    (term,) = parse_expression("max(0, t - 0.3)**1.5").addends
    orders = []

    class Counted:
        def derivative(self, order):
            orders.append(order)
            return term.derivative(order)

    edges, unresolved = resolved(Counted(), np.array([0.0, 1.0]), lambda _: 1.0, 1e-7)
    assert not len(unresolved)
    assert np.abs(edges - 0.3).min() < 1e-6
    assert len(edges) < 60
    assert orders.count(8) < 0.3 * orders.count(0)

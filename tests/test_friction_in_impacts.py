"""Friction in impacts: slip that goes on, sticks or turns back, and energy that never grows."""

import numpy as np
import pytest
from physics_tools import MODELS, alone, scene

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.engines.exudyn.minimal.impacts import Meeting, impulses
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.source import SceneError

DISC = """
curves: {floor: {type: line, from: [-9, 0], to: [9, 0]}}
bodies:
  disc: {type: rigid, mass: 0.5, inertia: 2.5e-3, points: {c: [0, 0], left: [-0.1, 0]}}
contacts:
  floor:
    type: point_on_curve
    point: disc.c
    curve: floor
    radius: 0.1
    law: {type: impulse, restitution: 0.8, friction: 0.1}
initial: {positions: {disc: [0, 0.3]}, velocities: {disc: [3, -2]}}
run: {duration: 0.2}
accuracy: {tolerance: 1.0e-9}
"""
RUB = "contacts.floor.law.friction="
BACKSPIN = "initial={positions: {disc: [0, 0.3]}, velocities: {disc: [1, -2]}, speeds: {disc: -40}}"


@pytest.mark.parametrize(
    ("settings", "after"),
    [
        ([], (2.64, -7.2)),
        ([RUB + "0.5"], (2.0, -20.0)),
        ([RUB + "0.2777777778"], (2.0, -20.0)),
        ([RUB + "0.2", BACKSPIN], (1.72, -25.6)),
    ],
    ids=["slides", "sticks", "at the limit", "backspin"],
)
def test_a_disc_slides_or_sticks(settings, after):
    """P_n = m(1 + e)v_n; P_t = -mu P_n against the slip u = v + omega r, or -m u/3 if less."""
    result = alone(DISC, *settings)
    (hit,) = result.intervals["floor"]
    assert hit.impulse == pytest.approx(0.5 * 1.8 * 2)
    assert hit.separation_speed == pytest.approx(1.6)
    pushed = 0.5 * (after[0] - result.rates[0, 0, 0])  # along the floor, whose places grow with x
    assert hit.tangential_impulse == pytest.approx(pushed, abs=1e-9)
    assert result.rates[-1, 0] == pytest.approx([after[0], 1.6, after[1]], abs=1e-9)
    kinetic = result.energy.kinetic
    assert hit.energy_lost == pytest.approx(kinetic[0] - kinetic[-1])


BY_TURNS = {2.5e-3: (0.5, -20.0), 2.0e-3: (0.6428571429, -21.42857143)}


@pytest.mark.parametrize("inertia", BY_TURNS)
def test_a_super_ball_moves_in_long_and_short_bounds(inertia):
    """Garwin: both speeds of the contact point turn back, and energy stays; disc and sphere."""
    model = load_scene(MODELS / "textbook" / "super_disc.yaml", [f"bodies.disc.inertia={inertia}"])
    result = simulate(model, measure=False)
    touches = [touch.begin for touch in result.intervals["floor"]]
    assert touches == pytest.approx(0.4283529369 + 0.8567058738 * np.arange(4), abs=1e-9)
    for k, touch in enumerate(touches):
        after = result.rates[np.searchsorted(result.time, touch + 1e-6), 0]
        wanted = (1.5, 0.0) if k % 2 else BY_TURNS[inertia]
        assert after[[0, 2]] == pytest.approx(wanted, abs=1e-8)
    if inertia == 2.5e-3:
        places = [touch.place - 0.2 for touch in result.intervals["floor"]]
        wanted = [0.6425294053, 1.070882342, 2.355941153, 2.78429409]
        assert places == pytest.approx(wanted, abs=1e-8)
    assert result.checks.energy_residual < 1e-12


def test_a_super_disc_with_backspin_comes_straight_back():
    """With omega = 2 v/r the slip 3 v turns back, and so do v and omega."""
    law = "{type: impulse, restitution: 1, tangential_restitution: 1, friction: 2}"
    start = BACKSPIN.replace("[1, -2]", "[1.5, -2]").replace("-40", "30")
    result = alone(DISC, start, f"contacts.floor.law={law}")
    assert result.rates[-1, 0] == pytest.approx([-1.5, 2, -30])


ROD = """
curves: {floor: {type: line, from: [-9, 0], to: [9, 0]}}
bodies:
  rod: {type: rigid, mass: 0.5, inertia: 1.0e-2, points: {a: [-0.25, 0], b: [0.25, 0]}}
contacts:
  a: &end
    type: point_on_curve
    point: rod.a
    curve: floor
    law: {type: impulse, restitution: 0.9, friction: 0.4}
  b: {<<: *end, point: rod.b}
gravity: 9.81
initial: {positions: {rod: [0, 0.5]}, angles: {rod: 0.7}, velocities: {rod: [1.5, -2]}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-8}
"""


@pytest.mark.parametrize("settings", [[], ["initial.velocities.rod=[-1.5, -2]"]])
def test_a_rod_that_hits_askew_wins_no_energy(settings):
    result = alone(ROD, *settings)
    hits = [hit for name in "ab" for hit in result.intervals[name]]
    assert len(hits) > 5
    assert min(hit.energy_lost for hit in hits) > 0
    assert result.checks.energy_residual < 1e-11 * result.checks.largest_kinetic_energy


def test_no_impact_with_friction_makes_energy_and_all_keep_coulombs_law():
    """What they lose is that of both impulses, each by the mean of the speeds before and after."""
    draw = np.random.default_rng(9)
    for restitution in (0.0, 0.5, 1.0) * 2000:
        root = draw.normal(size=(2, 2))
        (along, both), (_, across) = root @ root.T + 0.01 * np.eye(2)
        slip, rate, friction = draw.normal(), -draw.exponential(), draw.exponential()
        pressed, rub = impulses(Meeting(along, across, both, slip, rate), friction, restitution)
        slips, parts = slip + along * rub + both * pressed, rate + across * pressed + both * rub
        assert pressed * (rate + parts) + rub * (slip + slips) <= 1e-9
        assert parts >= -1e-9
        assert abs(rub) <= friction * pressed * (1 + 1e-12)
        if slips * slip > 1e-9:  # what still slides rubbed in full
            assert rub == pytest.approx(-friction * pressed * np.sign(slip))


def test_what_comes_to_rest_slides_and_then_rolls():
    """v = v_0 - mu g t until it rolls at 2/3 of v_0: regularised friction of what lasts."""
    start = "initial={positions: {disc: [0, 0.1]}, velocities: {disc: [3, 0]}}"
    law = "contacts.floor.law={type: impulse, restitution: 0, friction: 0.3}"
    result = alone(DISC, start, law, "gravity=9.81", "run={duration: 0.6, sample: 0.1}")
    sliding = result.rates[np.searchsorted(result.time, 0.2), 0]
    assert sliding[[0, 2]] == pytest.approx([3 - 0.06 * 9.81, -1.2 * 9.81], abs=1e-6)
    assert result.rates[-1, 0, [0, 2]] == pytest.approx([2, -20], abs=1e-6)
    assert result.energy.kinetic[-1] == pytest.approx(2.25 * 2 / 3)
    assert result.checks.energy_residual < 1e-8


CORNER = """{floor: {type: line, from: [-9, 0], to: [9, 0]},
 wall: {type: line, from: [0.5, 9], to: [0.5, -1]}}"""
MEETS_WALL = """{type: point_on_curve, point: disc.c, curve: wall, side: right, radius: 0.1,
 law: {type: impulse, restitution: 1}}"""
LIES = "{type: impulse, restitution: 0, friction: 0.3}"
LATER = 'drives.run={type: speed, joint: way, value: "-0.1*max(t - 0.1, 0)"}'
BRAKE = """
bodies:
  shoe: {type: rigid, mass: 1, inertia: 0.1, centre_of_mass: [0.2, 0],
         points: {o: [0, 0], tip: [0.5, 0]}}
  belt: {type: rigid, mass: 1, inertia: 1, points: {o: [0, 0], a: [-2, 0], b: [2, 0]}}
joints:
  hinge: {type: revolute, points: [ground, shoe.o], at: [0, 0]}
  way: {type: prismatic, points: [ground, belt.o], at: [0, -0.4], axis: [1, 0]}
drives: {run: {type: speed, joint: way, value: -0.1, ramp: 0.1}}
contacts: {grip: {type: point_on_line, point: shoe.tip, line: [belt.a, belt.b],
  law: {type: impulse, restitution: 0, friction: 0.8}}}
gravity: 9.81
initial: {angles: {shoe: -0.9272}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-6}
"""


def test_a_disc_that_lies_on_the_floor_bounces_off_a_smooth_wall():
    """The floor's contact takes part, and has nothing to do: it bears no impulse."""
    result = alone(
        DISC,
        f"curves={CORNER}",
        f"contacts.wall={MEETS_WALL}",
        "initial={positions: {disc: [0, 0.1]}, velocities: {disc: [3, 0]}, speeds: {disc: -30}}",
        "gravity=9.81",
        f"contacts.floor.law={LIES}",
        "run.duration=0.15",
    )
    (hit,) = result.intervals["wall"]
    after = result.rates[np.searchsorted(result.time, hit.begin, side="right") - 1, 0]
    assert after == pytest.approx([-3, 0, -30], abs=1e-6)


GROOVE = """
curves:
  left: {type: line, from: [-3, 2], to: [1.5, -1]}
  right: {type: line, from: [-1, -1.5], to: [2, 3]}
bodies:
  body: {type: rigid, mass: 0.5, inertia: 6.25e-4, points: {c: [0, 0], a: [-0.15, 0], b: [0.15, 0]}}
contacts: CONTACTS
gravity: 9.81
initial: {positions: {body: [-0.05, 0.3]}, velocities: {body: [0.4, -0.5]}, speeds: {body: 4}}
run: {duration: 1.5}
accuracy: {tolerance: 1.0e-6}
"""


@pytest.mark.parametrize(
    "touching",
    [["point: body.c, radius: 0.05"], ["point: body.a", "point: body.b"]],
    ids=["disc", "rod"],
)
def test_what_falls_into_a_groove_comes_to_rest_there(touching):
    """Contacts that rub are closed together, in impacts and at rest."""
    law = "law: {type: impulse, restitution: 0.4, friction: 0.3}"
    contacts = [
        f"{curve}{k}: {{type: point_on_curve, {point}, curve: {curve}, {law}}}"
        for curve in ("left", "right")
        for k, point in enumerate(touching)
    ]
    result = alone(GROOVE.replace("CONTACTS", "{" + ", ".join(contacts) + "}"))
    assert result.outcome.completed
    assert np.abs(result.rates[-1, 0]).max() < 1e-3  # the default slip_speed, by which it may creep
    assert result.checks.energy_residual < 1e-8
    closed = [name for name, history in result.contacts.items() if history.force[-1] > 0]
    assert {name.rstrip("01") for name in closed} == {"left", "right"}


@pytest.mark.parametrize(
    ("text", "settings", "reason", "advice"),
    [
        (ROD, ["contacts.a.law.tangential_restitution=0.5"], "'a' turns slip back", "stiffness"),
        (BRAKE, [], "friction jams the contact 'grip'", "stiffness"),
        (BRAKE, [LATER], "friction jams the contact 'grip'", "stiffness"),
    ],
    ids=["not round", "jams in an impact", "jams as it lasts"],
)
def test_what_is_not_known_ends_the_run(text, settings, reason, advice):
    """Which of two contacts slides first, and what a shoe does that grips ever more."""
    outcome = simulate(scene(text, *settings), measure=False).outcome
    assert not outcome.completed
    assert reason in outcome.reason
    assert advice in outcome.advice
    assert "drive" not in outcome.advice  # there is none in these scenes


def test_slip_comes_back_by_friction_alone():
    with pytest.raises(SceneError, match="needs 'friction', which turns the slip back"):
        scene(DISC, "contacts.floor.law={type: impulse, restitution: 1, tangential_restitution: 1}")

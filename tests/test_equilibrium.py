"""Static equilibrium: closed forms of statics, and small motions about a rest."""

from math import atan2, hypot, pi, sqrt

import numpy as np
import pytest
from cli_runs import MODELS
from physics_tools import scene

import exudyn_flexlink as fl
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.mechanism import equilibrium
from exudyn_flexlink.source import SceneError

G = 9.81
RUN = "run: {duration: 0.5}\naccuracy: {tolerance: 1.0e-9}\ngravity: 9.81\n"


def rod(name, mass, length):
    return (
        f"  {name}: {{type: rigid, mass: {mass}, inertia: {mass * length**2 / 12}, "
        f"centre_of_mass: [{length / 2}, 0], points: {{a: [0, 0], b: [{length}, 0]}}}}\n"
    )


def pin(name, first, second, at=""):
    return f"  {name}: {{type: revolute, points: [{first}, {second}]{at and f', at: {at}'}}}\n"


def rest(text, initial="at_rest", run=RUN):
    given = initial if initial == "at_rest" else f"{{{initial}}}"
    return fl.equilibrium(scene(f"{text}initial: {given}\n{run}"))


CHAIN = "bodies:\n" + "".join(rod(f"r{i}", 0.3, 0.2) for i in range(5))
CHAIN += "joints:\n" + pin("top", "ground", "r0.a", "[0, 0]")
CHAIN += "".join(pin(f"j{i}", f"r{i - 1}.b", f"r{i}.a") for i in range(1, 5))
HANGING = f"{CHAIN}drives: {{tip: {{type: force, point: r4.b, value: [6, -2]}}}}\n"
UPRIGHT = f"bodies:\n{rod('rod', 1.2, 0.8)}joints:\n{pin('foot', 'ground', 'rod.a', '[0, 0]')}"
SPRUNG = "springs: {coil: {type: torsional, joint: foot, stiffness: 3.5, rest_angle: 90 deg}}\n"
BALL = "bodies: {ball: {type: rigid, mass: 2, inertia: 0.1, points: {c: [0, 0]}}}\n"
FLOOR = """
curves: {floor: {type: line, from: [-1, 0], to: [1, 0]}}
contacts: {face: {type: point_on_curve, point: ball.c, curve: floor, side: left, law: LAW}}
"""


def test_a_chain_pulled_at_its_tip_has_the_slopes_of_its_loads():
    """tan(phi_i) = Fx/(w/2 + (n - i) w - Fy), from down; each joint carries what is below it."""
    w, found = 0.3 * G, rest(HANGING)
    slopes = [found.poses[f"r{i}"][2] + pi / 2 for i in range(5)]
    assert slopes == pytest.approx([atan2(6, w / 2 + (4 - i) * w + 2) for i in range(5)], abs=1e-12)
    assert found.points["r4.b"] == pytest.approx([0.578623375, -0.7804422171], abs=1e-10)
    assert found.forces["top"] == pytest.approx([-6, 5 * w + 2], abs=1e-12)
    assert found.stable
    assert not found.notes


def test_a_chain_between_supports_sags_to_the_lower_branch():
    """Slopes are 2 w/H, w/H, 0; from guesses above the supports, too."""
    text = CHAIN + pin("end", "r4.b", "ground", "[0.7, 0]")
    for turn in (1, -1):
        guessed = ", ".join(f"r{i}: {turn * own}" for i, own in enumerate((-1, -0.5, 0, 0.5, 1)))
        found = rest(text, f"at_rest: true, guesses: {{{guessed}}}")
        assert found.poses["r0"][2] == pytest.approx(-1.050859726, abs=1e-9)
        assert found.points["r2.a"][1] == pytest.approx(-0.3051342035, abs=1e-10)
        assert hypot(*found.forces["top"]) == pytest.approx(8.092405925, abs=1e-9)
        assert found.forces["top"][0] == pytest.approx(-3.369603448, abs=1e-9)


def test_a_four_bar_on_springs_balances():
    text = f"bodies:\n{rod('crank', 0.4, 0.15)}{rod('coupler', 0.8, 0.35)}{rod('rocker', 0.5, 0.3)}"
    text += f"joints:\n{pin('A', 'ground', 'crank.a', '[0, 0]')}{pin('B', 'crank.b', 'coupler.a')}"
    text += f"{pin('C', 'coupler.b', 'rocker.b')}{pin('D', 'ground', 'rocker.a', '[0.4, 0]')}"
    text += """
springs:
  coil: {type: torsional, joint: A, stiffness: 6, rest_angle: 60 deg}
  pull: {type: linear, points: [coupler.b, ground], at: [0.6, 0.1], stiffness: 150, length: 0.2}
"""
    found = rest(text, "at_rest: true, guesses: {crank: 80 deg, coupler: 20 deg, rocker: 100 deg}")
    assert found.poses["crank"][2] == pytest.approx(0.8710077988, abs=1e-10)
    assert found.points["rocker.b"] == pytest.approx([0.3936041736, 0.2999318146], abs=1e-10)
    assert found.forces["A"] == pytest.approx([-8.961889077, 2.260015251], abs=1e-8)
    assert found.forces["D"] == pytest.approx([-0.4495403485, 23.53366214], abs=1e-8)
    assert found.stable


def test_an_upright_rod_tips_to_the_stable_side_and_says_so():
    """m g l sin(theta) = k theta, from up; upright it grows by sqrt((m g l - k)/I)."""
    found = rest(UPRIGHT + SPRUNG, "at_rest: true, guesses: {rod: 90 deg}")
    assert abs(found.poses["rod"][2] - pi / 2) == pytest.approx(1.294254573, abs=1e-9)
    assert found.stable
    grows = sqrt((1.2 * G * 0.4 - 3.5) / (1.2 * 0.8**2 / 3))
    assert f"grows by exp({grows:.4g} t/s)" in found.notes[0]


def test_a_force_that_no_energy_belongs_to_makes_a_rest_flutter():
    """Ziegler's column: a push along the tip rod is no slope of an energy; of 3 k/l it flutters."""
    text = f"bodies:\n{rod('r0', 2, 1)}{rod('r1', 1, 1)}joints:\n"
    text += pin("foot", "ground", "r0.a", "[0, 0]") + pin("knee", "r0.b", "r1.a") + "springs:\n"
    text += "".join(
        f"  {j}: {{type: torsional, joint: {j}, stiffness: 1}}\n" for j in ("foot", "knee")
    )
    text += "drives: {push: {type: force, point: r1.b, value: [PUSH, 0], axes: r1}}\n"
    run = RUN.replace("gravity: 9.81\n", "")
    mass = np.array([[2 / 3 + 1, 0.5], [0.5, 1 / 3]])
    for push in (1.0, 3.0):
        found = rest(text.replace("PUSH", str(-push)), run=run)
        stiff = np.array([[2 - push, push - 1], [-1.0, 1.0]])
        exponents = np.sqrt(-np.linalg.eigvals(np.linalg.solve(mass, stiff)).astype(complex))
        assert found.growth == pytest.approx(np.abs(exponents.real).max(), abs=1e-7)
        assert found.stable == (push < 2)


def test_small_motions_of_a_pendulum_have_its_frequency():
    found = rest(UPRIGHT)
    assert found.poses["rod"][2] == pytest.approx(-pi / 2, abs=1e-12)
    assert found.frequencies == pytest.approx([sqrt(1.5 * G / 0.8) / (2 * pi)], rel=1e-9)
    assert repr(found).endswith("stable, lowest frequency 0.68258 Hz>")


LINK = """
materials: {steel: {density: 7850, youngs_modulus: 200 GPa}}
bodies:
  link: {type: flexible, length: 0.5, material: steel, section: {width: 10 mm, thickness: 0.5 mm},
         rods: 6, hinges: {stiffness: beam}, stretch: STRETCH}
joints: {clamp: {type: weld, points: [ground, link.start], at: [0, 0]}}
"""


@pytest.mark.parametrize("stretch", ["false", "true"])
def test_a_flexible_link_hangs_by_its_weight(stretch):
    """The clamp holds the weight and its moment; places round to 1e-15 m, stiff rods to 1e-7 N."""
    found = rest(LINK.replace("STRETCH", stretch))
    weight, q = 7850 * 5e-6 * 0.5 * G, found.assembly.state.q
    assert found.forces["clamp"] == pytest.approx([0, weight], abs=1e-7)
    parts = found.assembly.mechanism.parts
    moment = sum(
        p.mass * G * (x + p.centre[0] * np.cos(a)) for p, (x, _, a) in zip(parts, q, strict=True)
    )
    assert found.torques["clamp"] == pytest.approx(moment, rel=1e-6)
    assert found.points["link.end"][1] < -0.09


RESTING = {
    "chain": HANGING,
    "link": LINK.replace("STRETCH", "false"),
    "rope": BALL + "springs: {rope: {type: linear, points: [ground, ball.c], at: [0, 0], "
    "acts: tension, length: 0.2, stiffness: 500}}\n",
    "soft": BALL
    + """
joints: {way: {type: prismatic, points: [ground, ball.c], at: [0, 0], axis: [0, -1]}}
springs: {rope: {type: linear, joint: way, acts: tension, length: 0.1, stiffness: 20}}
""",
    "journal": UPRIGHT.replace(
        "at: [0, 0]", "at: [0, 0], clearance: 1 mm, law: {stiffness: 1.0e6, restitution: 0.8}"
    ),
    "floor": BALL + FLOOR.replace("LAW", "{stiffness: 1.0e5, restitution: 0.5}"),
}


def test_gears_at_rest_push_as_they_do_in_a_run():
    """A rack's spring holds T/r of the motor, which the pinion's shaft bears."""
    path = MODELS / "textbook" / "rack_with_spring.yaml"
    found = fl.equilibrium(load_scene(path))
    assert found.gears == {"teeth": pytest.approx(6 / 0.04, rel=1e-12)}
    assert found.forces["shaft"] == pytest.approx([150, 0], abs=1e-9)
    assert "teeth  150 N" in found.summary()
    # Teeth mesh as they are where the search begins.
    turned = load_scene(path, ["initial={at_rest: true, guesses: {pinion: 0.3}}"])
    for own, angle in ((found, 0), (fl.equilibrium(turned), 0.3)):
        assert own.poses["pinion"][2] == pytest.approx(angle + 150 / 800 / 0.04, abs=1e-10)


def test_what_falls_into_a_rope_hangs_below_it():
    """From the anchor, far above: the rounding of its place is all that is left of the forces."""
    found = fl.equilibrium(load_scene(MODELS / "textbook" / "rope_catch.yaml"))
    assert found.points["man.belt"] == pytest.approx([0, -12 - 70 * G / 1500], abs=1e-12)
    assert found.stable


@pytest.mark.parametrize(
    ("name", "form"), [*((n, "minimal") for n in RESTING), ("journal", "redundant")]
)
def test_what_starts_at_rest_stays(name, form):
    start = {"rope": "positions: {ball: [0.01, -0.1]}", "floor": "positions: {ball: [0, 0.3]}"}
    lasts = RUN if form == "minimal" else RUN.replace("0.5", "0.1")  # its steps are short
    given = f"initial: {{at_rest: true, {start.get(name, '')}}}\nsolver: {{formulation: {form}}}\n"
    result = simulate(scene(RESTING[name] + given + lasts))
    assert result.outcome.completed
    assert np.abs(result.poses - result.poses[0]).max() < 1e-10
    assert np.abs(result.rates[0]).max() == 0
    for touches in result.intervals.values():
        assert touches.begin == pytest.approx([0])
        assert touches.energy_lost == pytest.approx(0, abs=1e-12)
    assert np.abs(result.energy.residual).max() < 1e-12


@pytest.mark.parametrize(
    ("text", "path", "told"),
    [
        (BALL, "initial.at_rest", "a force of 19.62 N drives 'ball' on"),
        (
            BALL + FLOOR.replace("LAW", "{type: impulse, restitution: 0.5}"),
            "initial.at_rest",
            "ball",
        ),
        (
            UPRIGHT + "drives: {m: {type: speed, joint: foot, value: 3}}\n",
            "drives.m",
            "moves at 3 rad/s",
        ),
    ],
)
def test_no_rest_is_refused(text, path, told, monkeypatch):
    """After 40 steps, not 400: the ball falls on and on."""
    monkeypatch.setattr(equilibrium, "STEPS", 40)
    with pytest.raises(SceneError) as caught:
        scene(f"{text}initial: at_rest\n{RUN}")
    (mistake,) = caught.value.mistakes
    assert ".".join(map(str, mistake.path)) == path
    assert told in mistake.message

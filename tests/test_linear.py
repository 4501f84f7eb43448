"""Linear equations about a state: closed forms, Exudyn's own eigenvalues, and what is refused."""

import doctest
from math import cos, pi, sin, sqrt

import numpy as np
import pytest
from cli_runs import code_of
from pages_of_docs import DOCS
from physics_tools import scene
from scipy.optimize import brentq

import exudyn_flexlink as fl

G = 9.81
RUN = "run: {duration: 0.5}\naccuracy: {tolerance: 1.0e-9}\n"
WEIGHT = f"gravity: {G}\n"


def rod(name, mass, length):
    return (
        f"  {name}: {{type: rigid, mass: {mass}, inertia: {mass * length**2 / 12}, "
        f"centre_of_mass: [{length / 2}, 0], points: {{a: [0, 0], b: [{length}, 0]}}}}\n"
    )


def pin(name, first, second, at=""):
    return f"  {name}: {{type: revolute, points: [{first}, {second}]{at and f', at: {at}'}}}\n"


def about_rest(text, run=RUN + WEIGHT):
    return fl.linearised(scene(text + run))


PENDULUM = f"bodies:\n{rod('r', 1.2, 0.8)}joints:\n{pin('top', 'ground', 'r.a', '[0, 0]')}"


def test_a_pendulum_has_its_frequency_decay_and_answer():
    """I z'' + c z' + m g l/2 z = F l, with the force at the tip."""
    damper = "springs: {d: {type: torsional, joint: top, stiffness: 0, damping: 0.3}}\n"
    model = about_rest(PENDULUM + damper)
    inertia, stiffness = 1.2 * 0.8**2 / 3, 1.2 * G * 0.4
    assert (model.coordinates, model.units, model.time) == (("top",), ("rad",), None)
    assert model.mass == pytest.approx(inertia, rel=1e-14)
    assert model.damping == pytest.approx(0.3, rel=1e-9)
    assert model.stiffness == pytest.approx(stiffness, rel=1e-11)
    assert np.abs(model.stiffness - stiffness) < 10 * model.stiffness_error + 1e-15
    decay = 0.15 / inertia
    [mode] = model.modes
    assert mode.eigenvalue.real == pytest.approx(-decay, rel=1e-9)
    assert mode.frequency == pytest.approx(sqrt(stiffness / inertia - decay**2) / (2 * pi))
    assert mode.damping_ratio == pytest.approx(decay / sqrt(stiffness / inertia))
    assert np.abs(mode.points["r.b"]) == pytest.approx([1, 0], abs=1e-12)
    frequency = np.array([0.1, 0.7, 5.0])
    answer = model.response("r.b", "r.centre", frequency, "x")
    turn = 2j * pi * frequency
    known = 0.8 / (inertia * turn**2 + 0.3 * turn + stiffness) * 0.4
    assert answer.x == pytest.approx(known, rel=1e-9)
    assert np.abs(answer.y).max() < 1e-15


def test_a_double_pendulum_has_the_matrices_of_its_relative_angles():
    text = f"bodies:\n{rod('p', 2, 0.5)}{rod('q', 1, 0.3)}joints:\n"
    text += pin("top", "ground", "p.a", "[0, 0]") + pin("knee", "p.b", "q.a")
    model = about_rest(text)
    own, tied, lower = 2 * 0.25 / 3 + 1 * 0.25, 1 * 0.5 * 0.15, 1 * 0.09 / 3
    mass = [[own + 2 * tied + lower, tied + lower], [tied + lower, lower]]
    weight = G * np.array([[2 * 0.25 + 1 * 0.65, 0.15], [0.15, 0.15]])
    assert model.coordinates == ("top", "knee")
    assert model.mass == pytest.approx(np.array(mass), rel=1e-13)
    assert model.stiffness == pytest.approx(weight, rel=1e-10)
    assert not model.damping.any()
    squares = np.linalg.eigvals(np.linalg.solve(mass, weight))
    assert [mode.frequency * 2 * pi for mode in model.modes] == pytest.approx(
        np.sqrt(np.sort(squares))
    )


@pytest.mark.parametrize("model", ["cantilever", "textbook/flexible_four_bar"])
def test_frequencies_are_those_of_exudyns_own_solver(model):
    """Of redundant coordinates; a cantilever's are those of a beam, too, as rods become many."""
    at = fl.load_scene(model)
    still = at.with_({f"drives.{name}.value": 0 for name in at.drives}) if at.drives else at
    exudyns, _ = fl.exudyn_system(still).mbs.ComputeODE2Eigenvalues(convert2Frequencies=True)
    undamped = fl.equilibrium(still).frequencies
    linear = fl.linearised(still)
    found = np.sort(np.sqrt(np.linalg.eigvals(np.linalg.solve(linear.mass, linear.stiffness))))
    assert found / (2 * pi) == pytest.approx(undamped, rel=1e-7)
    assert np.sort(exudyns)[: len(found)] == pytest.approx(found / (2 * pi), rel=1e-5)


OSCILLATOR = """
bodies: {m: {type: rigid, mass: 2, inertia: 1, points: {c: [0, 0]}}}
joints: {way: {type: prismatic, points: [ground, m.c], at: [0, 0], axis: [1, 0]}}
springs: {s: {type: linear, points: [ground, m.c], at: [-1, 0], stiffness: 50, damping: DAMPING}}
"""


@pytest.mark.parametrize("damping", [0.5, 30.0])
def test_an_oscillator_decays_as_its_damper_says(damping):
    model = about_rest(OSCILLATOR.replace("DAMPING", str(damping)), RUN)
    known = np.roots([2, damping, 50])
    assert (model.coordinates, model.units) == (("way",), ("m",))
    assert np.sort_complex(model.eigenvalues) == pytest.approx(np.sort_complex(known), rel=1e-9)
    assert len(model.modes) == (1 if damping < 20 else 2)


FLOOR = """
bodies: {ball: {type: rigid, mass: 2, inertia: 0.1, points: {c: [0, 0]}}}
joints: {way: {type: prismatic, points: [ground, ball.c], at: [0, 0], axis: [0, 1]}}
curves: {floor: {type: line, from: [-1, 0], to: [1, 0]}}
contacts: {face: {type: point_on_curve, point: ball.c, curve: floor, side: left, law: LAW}}
"""


@pytest.mark.parametrize(
    ("law", "stiffness", "damping"),
    [
        ("{stiffness: 1.0e5, restitution: 0.5}", 0.625e5, 2 * G * 0.375 / 0.625 / 5e-3),
        ("{type: hertz, stiffness: 2.0e9}", 1.5 * 2.0e9 ** (2 / 3) * (2 * G) ** (1 / 3), 0.0),
    ],
)
def test_what_rests_on_a_contact_swings_on_its_slope(law, stiffness, damping):
    """k (1 + e^2)/2 and d k (1 - e^2)/2 / v_s; of Hertz 3/2 K d^(1/2), as deep as it lies."""
    model = about_rest(FLOOR.replace("LAW", law))
    assert model.pressing == ("face",)
    assert model.stiffness == pytest.approx(stiffness, rel=1e-8)
    assert model.damping == pytest.approx(damping, rel=1e-8)


def test_a_touch_that_lasts_presses_as_it_does_then():
    """Two thirds of the way down K = k: e = 1 leaves no loss."""
    text = FLOOR.replace("LAW", "{stiffness: 1.0e4, restitution: 1}")
    run = RUN.replace("0.5", "0.1") + WEIGHT
    result = fl.simulate(scene(f"{text}initial: {{positions: {{ball: [0, 0.01]}}}}\n{run}"))
    touches = result.touches("face")
    model = fl.linearised(result, at=touches.begin[0] + 0.3 * (touches.end[0] - touches.begin[0]))
    assert model.pressing == ("face",)
    assert model.stiffness == pytest.approx(1e4, rel=1e-9)
    flying = fl.linearised(result, at=touches.begin[0] / 2)
    assert not flying.pressing
    assert flying.stiffness == pytest.approx(0, abs=1e-12)
    assert [mode.eigenvalue for mode in flying.modes] == [0, 0]


TURNTABLE = f"""
bodies:
  table: {{type: rigid, mass: 5, inertia: 1, points: {{o: [0, 0], rim: [0.4, 0]}}}}
{rod("r", 1.2, 0.3)}joints:
{pin("axle", "ground", "table.o", "[0, 0]")}{pin("hinge", "table.rim", "r.a")}"""


@pytest.mark.parametrize(("turn", "gain"), [(0.0, 0.0), (0.7, 0.0), (0.7, 3.0)])
def test_a_pendulum_on_a_turntable_is_stiffened_by_its_spin(turn, gain):
    """K = m R l (w^2 cos(z) - w' sin(z)) for the angle z off the radius, at any instant."""
    text = TURNTABLE + f"drives: {{m: {{type: speed, joint: axle, value: '20 + {gain}*t'}}}}\n"
    text += f"initial: {{guesses: {{r: {turn}}}, speeds: {{r: 20}}}}\n"
    result = fl.simulate(scene(text + RUN.replace("0.5", "0.05")))
    model = fl.linearised(result, at=0.03)
    z = result.body("r").angle - result.body("table").angle
    k = result.sample_at(0.03)
    assert model.time == result.time[k]
    assert model.coordinates == ("hinge",)
    speed = 20 + gain * model.time
    known = 1.2 * 0.4 * 0.15 * (speed**2 * cos(z[k]) - gain * sin(z[k]))
    assert model.stiffness == pytest.approx(known, rel=1e-8)
    assert model.damping == pytest.approx(0, abs=1e-9)


def test_a_bead_on_a_turning_rod_has_its_gyroscopic_matrices():
    """Residuals (J + m s^2) f'' + 2 m s s' f' and m s'' - m s f'^2 + k (s - s_0)."""
    text = """
bodies:
  rod: {type: rigid, mass: 1, inertia: 0.2, points: {o: [0, 0], e: [1, 0]}}
  bead: {type: rigid, mass: 0.5, inertia: 0.001, points: {c: [0, 0]}}
joints:
  axle: {type: revolute, points: [ground, rod.o], at: [0, 0]}
  way: {type: prismatic, points: [rod.o, bead.c], axis: [1, 0]}
springs: {s: {type: linear, joint: way, stiffness: 40, length: 0.3}}
initial: {positions: {bead: [0.3, 0]}, speeds: {rod: 6, bead: 6}}
"""
    result = fl.simulate(scene(text + RUN))
    model = fl.linearised(result, at=0.2)
    k = result.sample_at(0.2)
    place, moving = result.poses[k, 1, :2], result.rates[k, 1, :2]
    angle, w = result.poses[k, 0, 2], result.rates[k, 0, 2]
    along = np.array([cos(angle), sin(angle)])
    s, v = along @ place, along @ moving
    spin = -2 * 0.5 * s * v * w / (0.2 + 0.001 + 0.5 * s**2)
    damping = 0.5 * 2 * s * np.array([[v, w], [-w, 0]])
    damping[0, 0] = 2 * 0.5 * s * v
    stiffness = [[0, 2 * 0.5 * (s * spin + v * w)], [0, 40 - 0.5 * w**2]]
    order = [model.coordinates.index(name) for name in ("axle", "way")]
    assert abs(v) > 0.1
    for told, known in ((model.damping, damping), (model.stiffness, np.array(stiffness))):
        assert told[np.ix_(order, order)] == pytest.approx(known, rel=1e-7, abs=1e-8)


def test_a_loop_in_motion_has_the_slopes_of_its_equation_of_motion():
    """A beam on two sliders, of one freedom z: M z'' + M_z z'^2/2 + V_z, differentiated."""
    a, b, length, own, inertia = 1.0, 3.0, 0.5, 2.0, 0.1
    text = f"""
bodies:
  a: {{type: rigid, mass: {a}, inertia: 1, points: {{p: [0, 0]}}}}
  b: {{type: rigid, mass: {b}, inertia: 1, points: {{p: [0, 0]}}}}
  beam: {{type: rigid, mass: {own}, inertia: {inertia}, centre_of_mass: [0.25, 0],
         points: {{s: [0, 0], e: [{length}, 0]}}}}
joints:
  x: {{type: prismatic, points: [ground, a.p], at: [0, 0], axis: [1, 0]}}
  y: {{type: prismatic, points: [ground, b.p], at: [0, 0], axis: [0, 1]}}
  sa: {{type: revolute, points: [a.p, beam.s]}}
  sb: {{type: revolute, points: [beam.e, b.p]}}
initial: {{guesses: {{beam: 125 deg}}, speeds: {{beam: 4}}}}
"""
    result = fl.simulate(scene(text + RUN.replace("0.5", "0.1") + WEIGHT))
    model = fl.linearised(result, at=0.05)
    k = result.sample_at(0.05)
    angle, w = result.poses[k, 2, 2], result.rates[k, 2, 2]

    def by_angle(q):
        """Mass, its slope, and the slope of the potential, by the beam's angle."""
        s, c = np.sin(q), np.cos(q)
        mass = length**2 * (a * s**2 + b * c**2) + own * length**2 / 4 + inertia
        return mass, length**2 * (a - b) * 2 * s * c, G * (b + own / 2) * length * c

    mass, rise, pull = by_angle(angle)
    turned = -(rise * w**2 / 2 + pull) / mass
    [name] = model.coordinates
    # The coordinate's own derivatives by the angle, and the angle's by it.
    place = {"x": lambda q: -length * np.cos(q), "y": lambda q: length * np.sin(q),
             "sa": lambda q: q, "sb": lambda q: -q}[name]  # fmt: skip
    ahead = {"x": lambda q: length * np.sin(q), "y": lambda q: length * np.cos(q),
             "sa": lambda q: 1.0 + 0 * q, "sb": lambda q: -1.0 + 0 * q}[name]  # fmt: skip
    bend = {"x": lambda q: length * np.cos(q), "y": lambda q: -length * np.sin(q),
            "sa": lambda q: 0 * q, "sb": lambda q: 0 * q}[name]  # fmt: skip
    speed, pace = ahead(angle) * w, ahead(angle) * turned + bend(angle) * w**2

    def residual(q, v):
        m, m_q, pull_q = by_angle(q)
        slope = ahead(q)
        rate = v / slope
        return (m * (pace - bend(q) * rate**2) / slope + m_q * rate**2 / 2 + pull_q) / slope

    step = 1e-30j
    assert place(angle).imag == 0
    assert residual(angle, speed) == pytest.approx(0, abs=1e-6)
    known = (residual(angle + step, speed) / ahead(angle)).imag / 1e-30
    assert model.mass == pytest.approx(mass / ahead(angle) ** 2, rel=1e-8)
    assert model.stiffness == pytest.approx(known, rel=1e-6)
    assert model.damping == pytest.approx(residual(angle, speed + step).imag / 1e-30, rel=1e-6)


@pytest.mark.parametrize("friction", ["torque: 0.2", "coefficient: 0.2, radius: 20 mm"])
def test_friction_that_slides_goes_on_by_the_force_in_its_joint(friction):
    """I z'' + m g l/2 cos(z) + T = 0, with T given, or mu R times the force of the pin."""
    text = PENDULUM.replace("at: [0, 0]}", f"at: [0, 0], friction: {{{friction}}}}}")
    text += "initial: {guesses: {r: -40 deg}, speeds: {r: 5}}\n"
    result = fl.simulate(scene(text + RUN.replace("0.5", "0.2") + WEIGHT))
    model = fl.linearised(result, at=0.1)
    k, inertia = result.sample_at(0.1), 1.2 * 0.8**2 / 3
    angle, speed = result.body("r").angle[k], result.body("r").rate[k]

    def turned(z, w):
        def left(a):
            arm = 0.4 * np.array([cos(z), sin(z)])
            pull = 1.2 * (a * np.array([-arm[1], arm[0]]) - w**2 * arm + [0, G])
            brake = 0.2 if "torque" in friction else 0.2 * 0.02 * np.hypot(*pull)
            return inertia * a + 1.2 * G * 0.4 * cos(z) + brake

        return brentq(left, -100, 100, xtol=1e-13)

    h = 1e-4
    stiffness = -inertia * (turned(angle + h, speed) - turned(angle - h, speed)) / (2 * h)
    damping = -inertia * (turned(angle, speed + h) - turned(angle, speed - h)) / (2 * h)
    assert speed > 1
    assert model.stiffness == pytest.approx(stiffness, rel=1e-7)
    assert model.damping == pytest.approx(damping, abs=1e-7)


def test_a_link_that_presses_on_a_wall_keeps_its_slow_motions():
    """The wall, 1e5 times as stiff as all else, must not hide them; its depth is below 1 um."""
    result = fl.simulate(fl.load_scene("clearance", turns=0.35))
    model = fl.linearised(result, at=0.1972)
    assert model.pressing == ("sleeve: rod 9 on lower corner of the end",)
    assert 10 < abs(model.eigenvalues[0]) < 50
    assert model.stiffness_error.max() < 1e-11 * model.stiffness.max()


def test_a_bead_in_a_slot_swings_by_the_curvature_of_its_lowest_place():
    """w^2 = g b/a^2 at the bottom of an ellipse; its place counts in metres."""
    text = """
bodies: {bead: {type: rigid, mass: 0.4, inertia: 0, points: {c: [0, 0]}}}
curves: {bowl: {type: ellipse, centre: [0, 0], semi_axes: [0.5, 0.2]}}
joints: {way: {type: slot, point: bead.c, curve: bowl}}
initial: {positions: {bead: [0.3, -0.16]}}
"""
    model = about_rest(text)
    assert dict(zip(model.coordinates, model.units, strict=True))["way"] == "m"
    swing = max(mode.frequency for mode in model.modes)
    assert (2 * pi * swing) ** 2 == pytest.approx(G * 0.2 / 0.25, rel=1e-7)
    k = model.coordinates.index("way")
    assert model.mass[k, k] == pytest.approx(0.4, rel=1e-9)


def test_damped_frequencies_at_rest_are_found_twice():
    """By motions of unit mass without an engine, and by joints' coordinates in Exudyn."""
    for name in ("no_clearance", "textbook/flexible_four_bar"):
        at = fl.load_scene(name)
        rest, model = fl.equilibrium(at), fl.linearised(at)
        eigenvalues = np.array([mode.eigenvalue for mode in model.modes])
        assert rest.damped == pytest.approx(eigenvalues, rel=1e-5)


def test_check_tells_damped_frequencies_and_draws_modes(tmp_path, capsys):
    file = tmp_path / "modes.svg"
    assert code_of("check", "no_clearance", "--equilibrium", "--figure", str(file)) == 0
    told = capsys.readouterr().out
    assert "damped    29.227 Hz, 0.617 % of critical damping" in told
    assert file.stat().st_size > 1000


@pytest.mark.parametrize(
    ("text", "named"),
    [
        (
            PENDULUM.replace("at: [0, 0]}", "at: [0, 0], friction: {torque: 0.2}}"),
            "friction of joint 'top' holds",
        ),
        (
            FLOOR.replace(
                "LAW", "{stiffness: 1.0e5, restitution: 0.5, friction: 0.3}"
            ),
            "friction of 'face' holds",
        ),
        ("bodies: {b: {type: rigid, mass: 1, inertia: 1, points: {c: [0, 0]}}}\n"
         "joints: {w: {type: weld, points: [ground, b.c], at: [0, 0]}}\n", "nothing can move"),
    ],
)  # fmt: skip
def test_what_holds_is_refused_by_name(text, named):
    with pytest.raises(fl.NotLinearError, match=named):
        about_rest(text)


def test_a_contact_by_impulse_that_presses_is_refused():
    text = FLOOR.replace("LAW", "{type: impulse, restitution: 0}")
    result = fl.simulate(scene(f"{text}initial: {{positions: {{ball: [0, 0.01]}}}}\n{RUN}{WEIGHT}"))
    with pytest.raises(fl.NotLinearError, match="'face' presses by impulse"):
        fl.linearised(result)
    with pytest.raises(fl.CannotContinueError, match="not in it"):
        fl.linearised(result, at=2)


def test_arguments_that_can_not_be_are_refused():
    at = fl.load_scene("pendulum")
    with pytest.raises(ValueError, match="'at' is an instant of a run"):
        fl.linearised(at, at=1)
    with pytest.raises(TypeError, match="of: expected"):
        fl.linearised("pendulum")
    model = fl.linearised(at)
    with pytest.raises(ValueError, match=r"no point 'bob\.tip'"):
        model.response("bob.tip", "bob.mass")
    with pytest.raises(ValueError, match="no axis 'z'"):
        model.response("bob.mass", "bob.mass", along="z")
    beam = fl.load_scene("cantilever").with_({"solver.formulation": "beam"})
    with pytest.raises(fl.NotRepresentableError, match="beam"):
        fl.linearised(beam)


def test_its_page_shows_what_it_prints():
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    page = str(DOCS / "linear.md")
    found = doctest.testfile(page, module_relative=False, globs={"fl": fl}, optionflags=flags)
    assert found.attempted > 5
    assert found.failed == 0


def test_figures_show_every_mode_and_answer():
    model = fl.linearised(fl.load_scene("textbook/flexible_four_bar"))
    shown = [axes.get_title(loc="left") for axes in model.plot().axes if axes.get_visible()]
    assert [text[:3] for text in shown] == [f"({letter})" for letter in "abcdef"]
    assert "50.861 Hz, 0.449 %" in shown[0]
    gain, phase = model.response("coupler.end", "coupler.end").plot(style="print").axes
    assert gain.get_yscale() == "log"
    assert all(-360 <= y <= 1 for line in phase.lines for y in line.get_ydata())

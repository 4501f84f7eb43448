"""Contact laws of Hertz and those that damp by the approach speed: closed forms, run by engines.

Restitution, depth and time are those of the phase plane (Marhefka and Orin 1999), forces of
cylinders those of Johnson (1985), Radzimovsky (1953) and Lankarani and Nikravesh (1990).
"""

import numpy as np
import pytest
from cli_runs import MODELS
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from exudyn_flexlink.cli import main
from exudyn_flexlink.effects import with_impact
from exudyn_flexlink.engines import NotRepresentableError, simulate
from exudyn_flexlink.laws import (
    FACTORS,
    LineContact,
    PowerPenalty,
    RestitutionPenalty,
    SpringDamper,
    SpringTable,
    restitution_of,
)
from exudyn_flexlink.loading import assemble_scene, load_scene
from exudyn_flexlink.source import SceneError

# Restitution that each law gives, by that which is asked.
GIVEN = {
    "hunt_crossley": (0.5158326164, 0.5812880418, 0.6629622, 0.7679997891, 0.9090157413),
    "lankarani_nikravesh": (0.6652654068, 0.6842246057, 0.725241114, 0.7959725954, 0.9131766778),
    "flores": (0.06944422515, 0.2562079067, 0.4704447793, 0.6831841997, 0.8939206927),
    "gonthier": (0.1009897742, 0.3042248639, 0.487741256, 0.6695813197, 0.8764354239),
    "exact": (0.1, 0.3, 0.5, 0.7, 0.9),
}
ASKED = (0.1, 0.3, 0.5, 0.7, 0.9)
# Two spheres at 0.7: depth, force, time, speeds after.
# fmt: off
SPHERES = {
    "hertz": (2.951370226e-05, 1985.306672, 0.0001737338949, 0.125, 0.625),
    "hunt_crossley": (2.664850418e-05, 1808.65985, 0.0001795230701, 0.1685000395, 0.5524999341),
    "lankarani_nikravesh":
        (2.700903004e-05, 1819.32815, 0.0001785938663, 0.1632551384, 0.5612414361),
    "flores": (2.552435007e-05, 1793.359721, 0.0001828944269, 0.1844029626, 0.5259950624),
    "gonthier": (2.533927733e-05, 1793.238628, 0.0001835262109, 0.1869535025, 0.5217441624),
}
# fmt: on
STEEL = "materials: {steel: {density: 7850, youngs_modulus: 207 GPa, poissons_ratio: 0.3}}\n"
CLOSE = "accuracy.tolerance=1e-9"
RUN = "run: {duration: %s}\naccuracy: {tolerance: 1.0e-12}\n"
TWO_SPHERES = f"""title: two spheres
{STEEL}bodies:
  one: {{type: rigid, mass: 0.5, inertia: 1.0e-4}}
  two: {{type: rigid, mass: 0.3, inertia: 1.0e-4}}
joints:
  a: {{type: prismatic, points: [ground, one.centre], at: [0, 0], axis: [1, 0]}}
  b: {{type: prismatic, points: [ground, two.centre], at: [0, 0], axis: [1, 0]}}
contacts:
  hit:
    type: circle_on_circle
    circles: [{{at: one.centre, radius: 10 mm}}, {{at: two.centre, radius: 20 mm}}]
    law: {{stiffness: 1, restitution: 1}}
initial: {{speeds_along: {{a: 0.5 m/s}}, along: {{b: 30.1 mm}}}}
{RUN % "1 ms"}"""
BEARING = f"""title: pin in a bore
{STEEL}bodies:
  pin: {{type: rigid, mass: 1, inertia: 0.1}}
joints:
  own: {{type: revolute, points: [pin.centre, ground], at: [0, 0], clearance: 0.1 mm,
    radius: 9.9 mm, law: {{stiffness: 1, restitution: 1}}}}
drives: {{load: {{type: force, point: pin.centre, value: [0, "-5e4*t"]}}}}
{RUN % "1"}"""


def load(tmp_path, text, *settings):
    path = tmp_path / "model.yaml"
    path.write_text(text, encoding="utf-8")
    return load_scene(path, settings)


def spheres(tmp_path, kind, *settings):
    own = "" if kind == "hertz" else ", restitution: 0.7"
    law = f"contacts.hit.law={{type: {kind}, stiffness: 1.238203606e10{own}}}"
    return simulate(load(tmp_path, TWO_SPHERES, law, *settings))


def balls(kind, speeds, asked, transition="1 mm/s", more=""):
    """A free ball for each speed and restitution asked, which flies against a wall."""
    rows = [*zip("abcde", speeds, asked, strict=False)]
    law = f"type: {kind}, stiffness: 1.0e6, transition_speed: {transition}, restitution:"
    hit = "type: point_on_curve, curve: wall, side: right, point:"
    lines = ["title: balls", "curves: {wall: {type: line, from: [0, -1], to: [0, 1]}}", "bodies:"]
    lines += [f"  {n}: {{type: rigid, mass: 2, inertia: 0.1}}" for n, *_ in rows]
    lines += ["contacts:"]
    lines += [f"  {n}_hit: {{{hit} {n}.centre, law: {{{law} {e}}}}}" for n, _, e in rows]
    lines += ["initial:", "  positions:", *(f"    {n}: [0.01, 0]" for n, *_ in rows)]
    lines += ["  velocities:", *(f"    {n}: [-{v}, 0]" for n, v, _ in rows)]
    return "\n".join([*lines, more, RUN % (0.01 / min(speeds) + 0.1)])


# --- closed forms ---------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", FACTORS)
def test_restitution_that_a_law_gives(kind):
    found = [restitution_of(FACTORS[kind](asked)) for asked in ASKED]
    assert found == pytest.approx(GIVEN[kind], rel=1e-9)
    if kind == "exact":  # to its limits
        for asked in (0.001, 0.999, 1 - 1e-7, 1.0):
            assert restitution_of(FACTORS[kind](asked)) == pytest.approx(asked, rel=1e-10)


small = st.floats(-1e-3, 1e-3)


@given(d=small, rate=st.floats(-3, 3), v0=st.floats(0, 2), a=st.floats(0, 20))
def test_never_pulls_and_never_creates_energy(d, rate, v0, a):
    for law in (PowerPenalty(1e8, 1.5, a), LineContact(1e11, 0.01, 5e8)):
        force, stored = float(law.force(d, rate, v0)), float(law.stored_energy(d))
        storing = float(law.force(d, 0.0, v0)) * rate  # dU/dt
        assert force >= 0
        assert force * rate >= storing - 1e-12 * abs(storing)
        assert (force, stored) == (0, 0) if d <= 0 else stored >= 0


ALL_LAWS = [
    RestitutionPenalty(1e6, 0.5),
    PowerPenalty(1e8, 1.5, 3.0),
    LineContact(1e11, 0.01, 5e8),
    SpringDamper(1e6, 20.0, 3.0),
    SpringTable((0.0, 3.3e-5, 2e-4), (0.0, 50.0, 70.0), 20.0),
]


@pytest.mark.parametrize("law", ALL_LAWS)
def test_slopes_and_stored_energy_are_those_of_the_force(law):
    d, rate, by = np.linspace(1e-5, 1e-4, 5), np.linspace(-0.1, 1, 5), 1e-9
    force, stiffness, damping = law.pressing(d, rate, 0.5)
    for slope, (x, y) in ((stiffness, (by, 0.0)), (damping, (0.0, by))):
        ahead, back = law.force(d + x, rate + y, 0.5), law.force(d - x, rate - y, 0.5)
        assert slope == pytest.approx((ahead - back) / (2 * by), rel=1e-5, abs=1e-3)
    storing = (law.stored_energy(d + by) - law.stored_energy(d - by)) / (2 * by)
    assert law.force(d, 0.0, 0.5) == pytest.approx(storing, rel=1e-6)
    assert law.lets_go or (law.pressing(-d, rate, 0.5)[0] <= 0).all()
    assert (force >= 0).all()


FORMULAS = {
    "johnson": ((773.753919, 5371.159542, 34138.90243), (417.5157302, 2418.521478, 11230.30056)),
    "radzimovsky": (
        (739.5590757, 5027.328845, 30341.28238),
        (408.0425801, 2354.360981, 1.088068078e4),
    ),
    "lankarani_nikravesh": ((150.8882047, 1686.981414, 13495.85131), None),
}


@pytest.mark.parametrize("formula", FORMULAS)
def test_force_of_a_pin_in_a_bore_and_outside(tmp_path, formula):
    lines = formula != "lankarani_nikravesh"
    given = f"{{type: hertz, materials: [steel, steel], formula: {formula}"
    given += ", length: 15 mm}" if lines else "}"
    inside, outside = FORMULAS[formula]
    bearing = load(tmp_path, BEARING, f"joints.own.law={given}")
    law = assemble_scene(bearing).mechanism.bearings[0].law
    assert law.force([1e-6, 5e-6, 20e-6], 0.0, 0.0) == pytest.approx(inside, rel=1e-8)
    if lines:
        sizes = [f"contacts.hit.circles.{i}.radius={r} mm" for i, r in enumerate((9.9, 10))]
        pair = load(tmp_path, TWO_SPHERES, f"contacts.hit.law={given}", *sizes)
        law = assemble_scene(pair).mechanism.contacts[0].law
        assert law.force([1e-6, 5e-6, 20e-6], 0.0, 0.0) == pytest.approx(outside, rel=1e-8)


# --- run by engines -------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", FACTORS)
def test_an_impact_returns_the_restitution_of_its_law(tmp_path, kind):
    result = simulate(load(tmp_path, balls(kind, [1.0] * 5, ASKED), CLOSE))
    touches = [own.touches for own in result.contacts.values()]
    found = [float(own.separation_speed[0] / own.approach_speed[0]) for own in touches]
    assert found == pytest.approx(GIVEN[kind], rel=1e-6)
    assert result.checks.relative_energy_residual < 1e-10


@pytest.mark.parametrize("kind", SPHERES)
def test_two_spheres_strike(tmp_path, kind):
    result = spheres(tmp_path, kind)
    touch = next(iter(result.contacts["hit"].touches))
    found = touch.penetration, touch.peak_force, touch.end - touch.begin, *result.rates[-1, :, 0]
    assert found == pytest.approx(SPHERES[kind], rel=2e-9)


@pytest.mark.parametrize("kind", ["hertz", "flores"])
def test_redundant_coordinates_return_nearly_the_same(tmp_path, kind):
    settings = "accuracy.tolerance=1e-7", "solver={formulation: redundant, steps_per_contact: 200}"
    result = spheres(tmp_path, kind, *settings)
    touch, wanted = next(iter(result.contacts["hit"].touches)), SPHERES[kind]
    found = touch.penetration, touch.peak_force, *result.rates[-1, :, 0]
    assert found == pytest.approx((*wanted[:2], *wanted[3:]), rel=1e-4)
    assert result.checks.relative_energy_residual < 1e-4


def test_the_approach_speed_is_that_of_each_touch_and_has_a_floor(tmp_path):
    """Slower than the transition speed v_s a touch is damped by a v0/v_s."""
    speeds = 2.0, 0.5, 0.1, 0.05
    text = balls("hunt_crossley", speeds, [0.4] * 4, transition="0.2 m/s")
    result = simulate(load(tmp_path, text, CLOSE))
    touches = [next(iter(own.touches)) for own in result.contacts.values()]
    found = [touch.separation_speed / touch.approach_speed for touch in touches]
    wanted = [restitution_of(0.9 * min(1.0, v / 0.2)) for v in speeds]
    assert found == pytest.approx(wanted, rel=1e-6)


def test_what_is_dragged_apart_is_not_held(tmp_path):
    pull = 'drives: {pull: {type: force, point: a.centre, value: ["where(t > 0.011, 4000, 0)", 0]}}'
    text = balls("gonthier", [1.0], [0.3], more=pull)
    result = simulate(load(tmp_path, text))
    law = PowerPenalty(1e6, 1.5, FACTORS["gonthier"](0.3))

    def rates(t, y):
        return [y[1], (4000.0 * (t > 0.011) + float(law.force(-y[0], -y[1], 1.0))) / 2]

    state = [0.0, -1.0]
    for span in ((0.01, 0.011), (0.011, 0.012)):
        path = solve_ivp(rates, span, state, method="LSODA", rtol=1e-11, atol=1e-13)
        state = path.y[:, -1]
    k = result.sample_at(0.012)
    after = state[1] + 2000 * (result.time[k] - 0.012)
    assert result.rates[k, 0, 0] == pytest.approx(after, rel=1e-7)
    assert law.factor * path.y[1].max() > 1  # without its bound the law would pull
    assert result.checks.relative_energy_residual < 1e-8


def test_johnsons_law_beyond_its_maximum_is_told(tmp_path):
    """Beyond 0.5413 of the clearance no load is that deep."""
    law = "{type: hertz, materials: [steel, steel], formula: johnson, length: 0.01 mm}"
    scene = load(tmp_path, BEARING, f"joints.own.law={law}", "accuracy.tolerance=1e-7")
    result = simulate(scene)
    assert "'own' was pressed" in result.outcome.reason
    assert "beyond 5.408e-05 m its law has no force" in result.outcome.reason


@pytest.mark.parametrize("kind", ["hertz", "exact"])
def test_two_engines_agree_on_walls_and_a_strike_with_friction(kind):
    own = "" if kind == "hertz" else ", restitution: 0.5"
    law = f"{{type: {kind}, stiffness: 1e7, friction: 0.1{own}}}"
    settings = [f"{at}.law={law}" for at in ("contacts.strike", "joints.sleeve")]
    settings += ["run={duration: 0.17}", "accuracy.tolerance=1e-7", "bodies.link.rods=3"]
    scene = load_scene(MODELS / "clearance_friction.yaml", settings)
    one, other = (simulate(scene, engine) for engine in ("exudyn", "lagrangian"))
    assert len(one.sleeves["sleeve"].touches.begin) > 1
    _, here, there = np.intersect1d(one.time, other.time, return_indices=True)
    assert len(here) > 1000
    assert one.poses[here] == pytest.approx(other.poses[there], abs=1e-7)


def test_two_formulations_agree_on_a_slider_crank_with_clearance():
    settings = "run.turns=0.05", "accuracy.tolerance=1e-7"
    model = MODELS / "textbook" / "slider_crank_contact_laws.yaml"
    one = simulate(load_scene(model, settings))
    redundant = [*settings, "solver={formulation: redundant, steps_per_contact: 200}"]
    other = simulate(load_scene(model, [*redundant, "accuracy={step: 1e-5}"]))
    first, second = (own.bearings["small_end"].touches for own in (one, other))
    assert len(first.begin) == len(second.begin) > 1
    assert first.peak_force == pytest.approx(second.peak_force, rel=1e-3)


# --- told and refused -----------------------------------------------------------------------------


def test_check_and_the_summary_tell_which_restitution_a_law_gives(tmp_path, capsys):
    model = MODELS / "textbook" / "slider_crank_contact_laws.yaml"
    assert main(["check", str(model)]) == 0
    assert "asked, gives 0.4704" in capsys.readouterr().out
    short = ["--set", "run.turns=0.01", "--no-plots", "--out", str(tmp_path / "o")]
    assert main(["simulate", str(model), *short]) == 0
    assert "small_end flores 0.5 asked, gives 0.4704" in " ".join(capsys.readouterr().out.split())


def test_what_turns_into_an_impulse_returns_and_rubs_as_the_law_did(tmp_path):
    law = "contacts.hit.law={type: flores, stiffness: 1, restitution: 0.7, friction: 0.2}"
    changed = with_impact(load(tmp_path, TWO_SPHERES, law), "impulse")
    assert changed.contacts["hit"].law.restitution == pytest.approx(0.6831841997)
    assert changed.contacts["hit"].law.friction == 0.2


def test_cylinders_in_redundant_coordinates_and_laws_without_a_rest_are_refused(tmp_path):
    law = "{type: hertz, materials: [steel, steel], formula: johnson, length: 15 mm}"
    scene = load(tmp_path, BEARING, f"joints.own.law={law}", "solver.formulation=redundant")
    with pytest.raises(NotRepresentableError, match="no formula 'johnson'") as caught:
        simulate(scene)
    assert caught.value.path == ("joints", "own", "law", "formula")
    law = "joints.sleeve.law={type: flores, stiffness: 1e7, restitution: 0.5}"
    with pytest.raises(SceneError, match="what holds a link on its axis is a 'penalty'"):
        load_scene(MODELS / "supported.yaml", [law])


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.2])
def test_the_half_period_of_a_power_law_is_how_long_a_mass_stays(exponent):
    """At 1 m/s: m v v' = -K d^n, so that t = 2 times the integral of dd/v to the deepest place."""
    law, mass = PowerPenalty(3e5, exponent), 0.7
    deepest = ((exponent + 1) * mass / (2 * 3e5)) ** (1 / (exponent + 1))

    def slowness(s):  # d = deepest (1 - s^2): the end of the integral is smooth
        return 2 * s * deepest / np.sqrt(1 - (1 - s * s) ** (exponent + 1))

    once = quad(slowness, 0, 1)[0]
    assert law.half_period(mass) == pytest.approx(2 * once, rel=1e-6)

"""The link as a beam in Exudyn: against closed forms, laws of nature, and ever more rods."""

import numpy as np
import pytest
from physics_tools import (
    MODELS,
    STEEL,
    angle,
    on_grid,
    run,
    run_model,
    scene,
    speed,
    total_energy,
    velocity,
    where,
)
from scipy.optimize import least_squares

from exudyn_flexlink.chain import cantilever_roots
from exudyn_flexlink.continuing import continued
from exudyn_flexlink.engines import NotRepresentableError, simulate
from exudyn_flexlink.loading import load_scene

G = 9.81
LENGTH, WIDTH, THICKNESS = 0.07, 0.01, 0.5e-3
PER_METRE = 7850 * WIDTH * THICKNESS
BENDING = 2e11 * WIDTH * THICKNESS**3 / 12
BEAM = "solver.formulation=beam"
STATION = "bodies.link.points={middle: 31 mm}"

LINK = """{type: flexible, length: 0.07, material: steel, section: {width: 10 mm,
           thickness: 0.5 mm}, rods: 10, hinges: {stiffness: beam, damping: 0}}"""

# The guide is fixed, and the slot runs across it: the link's start can't move.
CANTILEVER = f"""
{STEEL}
curves: {{across: {{type: line, from: [0.02, -1], to: [0.02, 1]}}}}
bodies:
  guide: {{type: rod, length: 0.09, material: steel, section: {{width: 1 cm, thickness: 1 cm}}}}
  link: {LINK}
joints:
  fix: {{type: weld, points: [ground, guide.start], at: [0, 0]}}
  sleeve: {{type: sleeve, guide: guide, link: link}}
  pin: {{type: slot, point: link.start, curve: across}}
gravity: [0, -{G}]
run: {{duration: 0.12, sample: 0.1 ms}}
accuracy: {{step: 2.0e-5}}
solver: {{formulation: beam, elements: 3, spectral_radius: 1}}
"""


def test_cantilever_swings_about_its_deflection_at_its_frequencies():
    """Let go straight, under its weight: rho A g L^4 / 8 E I, and (beta L)^2 sqrt(EI/rho A)/L^2."""
    result = run(CANTILEVER)
    time, y = result.time, where(result, "link.end")[:, 1]
    sagged = -PER_METRE * G * LENGTH**4 / (8 * BENDING)
    exact = cantilever_roots(2) ** 2 * np.sqrt(BENDING / PER_METRE) / LENGTH**2

    def off(x):
        first, second = x[1] * np.cos(exact[0] * x[3] * time), x[2] * np.cos(exact[1] * x[4] * time)
        return (x[0] - first - second) / abs(sagged) - y / abs(sagged)

    found = least_squares(off, [sagged, sagged, 0, 1, 1], x_scale=[1e-5, 1e-5, 1e-6, 1e-2, 1e-2])
    assert found.x[0] == pytest.approx(sagged, rel=1e-5)
    assert found.x[3] == pytest.approx(1, abs=3e-4)
    assert found.x[4] == pytest.approx(1, abs=4e-3)
    # Of the deflection mode i makes 32 sigma/(beta L)^5, in turn up and down.
    roots = cantilever_roots(2)
    parts = 32 * (np.cosh(roots) + np.cos(roots)) / (np.sinh(roots) + np.sin(roots)) / roots**5
    np.testing.assert_allclose(found.x[1:3] / sagged, [parts[0], -parts[1]], atol=2e-4)
    energy = total_energy(result)
    assert abs(energy - energy[0]).max() < 1e-8 * result.energy.kinetic.max()


def test_damping_of_the_hinges_is_that_of_the_beam():
    """Amplitudes of the first mode fall by exp(-lag w^2 t / 2), lag = d l / E I."""
    damping = 2e-4
    result = run(CANTILEVER, f"bodies.link.hinges.damping={damping}")
    sagged = -PER_METRE * G * LENGTH**4 / (8 * BENDING)
    first = cantilever_roots(1)[0] ** 2 * np.sqrt(BENDING / PER_METRE) / LENGTH**2
    rate = damping * LENGTH / 10 / BENDING * first**2 / 2
    away = where(result, "link.end")[:, 1] - sagged
    late = result.time > 0.02  # higher modes are gone
    shape = np.exp(-rate * result.time[late])
    waves = [shape * f(first * result.time[late]) for f in (np.cos, np.sin)]
    left = away[late] - np.transpose(waves) @ np.linalg.lstsq(
        np.transpose(waves), away[late], rcond=None
    )[0]  # fmt: skip
    assert abs(left).max() < 0.01 * abs(away[late]).max()
    assert np.exp(-rate * 0.12) < 0.6
    residual = result.energy.residual
    assert abs(residual).max() < 1e-4 * result.energy.kinetic.max()
    assert result.energy.dissipated[-1] > 0.1 * result.energy.kinetic.max()


QUARTER = ("run.turns=0.25", "run.sample=1 ms", "accuracy.tolerance=1.0e-7")


@pytest.fixture(scope="module")
def smooth():
    return run_model("smooth.yaml", *QUARTER, BEAM, "solver.elements=4")


def test_many_rods_tend_to_the_beam_with_the_square_of_their_number(smooth):
    beam = on_grid(smooth, where(smooth, "link.end"), 1e-3)
    off = []
    for rods in (8, 16, 32):
        result = run_model(
            "smooth.yaml",
            *QUARTER,
            "solver.formulation=redundant",  # whose steps err alike
            "bodies.link.layout=half_ends",
            f"bodies.link.rods={rods}",
            f"bodies.link.hinges.damping={2e-6 * rods}",
        )
        off.append(abs(on_grid(result, where(result, "link.end"), 1e-3) - beam).max())
    assert off[0] / off[1] == pytest.approx(4, rel=0.15)
    assert off[1] / off[2] == pytest.approx(4, rel=0.15)
    assert off[2] < 1e-6


def test_rods_shown_are_chords_of_the_beam(smooth):
    """End of each is the start of the next; the last ends where the beam does."""
    rods = [smooth.part_names.index(f"link {k}") for k in range(1, 11)]
    poses = smooth.poses[:, rods]
    along = np.stack([np.cos(poses[..., 2]), np.sin(poses[..., 2])], axis=-1)
    ends = poses[..., :2] + 0.007 * along
    np.testing.assert_allclose(ends[:, :-1], poses[:, 1:, :2], atol=1e-9)
    turned = poses[..., 2] - angle(smooth, "guide")[:, None]
    assert abs(turned[:, 0]).max() < abs(turned[:, -1]).max() < 0.1
    before, after = smooth.poses[:-2][:, rods], smooth.poses[2:][:, rods]
    slope = (after - before) / (smooth.time[2:] - smooth.time[:-2])[:, None, None]
    np.testing.assert_allclose(slope, smooth.rates[1:-1][:, rods], atol=0.03)
    assert smooth.checks.constraint_error < 1e-10
    assert smooth.checks.energy_residual < 1e-6 * smooth.checks.largest_kinetic_energy


def test_extremes_of_a_station_are_those_of_its_samples():
    """They were those of a rod that stands still."""
    settings = [BEAM, STATION, "outputs.watch=link.middle", "run={duration: 0.3, sample: 0.5 ms}"]
    result = simulate(load_scene(MODELS / "smooth.yaml", settings), measure=False)
    x = where(result, "link.middle")[:, 0]
    seen = result.extremes["link.middle.x_m"]
    assert seen.least[0] == pytest.approx(x.min(), abs=1e-5)
    assert seen.greatest[0] == pytest.approx(x.max(), abs=1e-5)
    assert np.ptp(x) > 0.05


def test_start_runs_on_a_spline_as_that_of_rods_does():
    """The general slot constraint, on a node with a slope; rigid start, nothing struck."""
    turn = ("run.turns=0.4", "run.sample=1 ms", "accuracy.tolerance=1.0e-6")
    link = ("bodies.link.hinges.stiffness=beam",)
    beam = run_model("spline_track.yaml", *turn, *link, BEAM)
    rods = run_model("spline_track.yaml", *turn, *link, "bodies.link.layout=half_ends")
    np.testing.assert_allclose(
        on_grid(beam, where(beam, "link.start"), 1e-3),
        on_grid(rods, where(rods, "link.start"), 1e-3),
        atol=1e-7,
    )
    force = on_grid(beam, beam.slot_forces["pin"], 1e-3)[5:]
    other = on_grid(rods, rods.slot_forces["pin"], 1e-3)[5:]
    np.testing.assert_allclose(force, other, atol=0.02 * abs(other).max())


def test_a_slow_crank_leaves_no_strain():
    """Steps turn it by a degree: a beam turned by Newton's first guess alone would be stretched."""
    settings = ("drives.motor.value=0.1 rad/s", "run.turns=0.3", "accuracy.tolerance=4e-5")
    beam = run_model("smooth.yaml", *settings, BEAM)
    assert beam.checks.largest_step > 0.2
    assert beam.warnings == ()
    assert beam.checks.energy_residual < 1e-4 * beam.checks.largest_kinetic_energy
    rods = run_model("smooth.yaml", *settings)
    ends = [r.poses[-1, r.part_names.index("link 10"), :2] for r in (beam, rods)]
    np.testing.assert_allclose(*ends, atol=1e-7)


# --- the strike ----------------------------------------------------------------------------------

LAST = (
    "initial.angles.guide=178 deg",
    "run.duration=0.03",
    "run.sample=0.05 ms",
    "bodies.link.hinges.stiffness=beam",
    "accuracy.tolerance=2.0e-6",
)


def test_strike_is_that_of_many_rods():
    struck = run_model("no_clearance.yaml", *LAST, BEAM, "solver.elements=4")
    assert struck.checks.energy_residual < 1e-5 * struck.checks.largest_kinetic_energy
    assert struck.energy.dissipated[-1] > 100 * struck.checks.energy_residual
    rods = run_model(
        "no_clearance.yaml",
        *LAST,
        "bodies.link.layout=half_ends",
        "bodies.link.rods=20",
        "bodies.link.hinges.damping=4.0e-5",
    )
    levers = [on_grid(r, angle(r, "lever"), 5e-5) for r in (struck, rods)]
    np.testing.assert_allclose(*levers, atol=1e-3)
    assert levers[0].min() < -0.3
    ends = [on_grid(r, where(r, "link.end"), 5e-5) for r in (struck, rods)]
    np.testing.assert_allclose(*ends, atol=3e-5)
    begins = [next(e for e in r.events if e.kind == "contact begins") for r in (struck, rods)]
    assert begins[0].time == pytest.approx(begins[1].time, abs=2e-6)
    speeds = [e.details["approach_speed"] for e in begins]
    assert speeds[0] == pytest.approx(speeds[1], rel=1e-3)


# Nothing drives it: guide and link swing about O onto a lever with the same pivot.
SWINGING = f"""
{STEEL}
curves: {{ring: {{type: circle, centre: [0, 0], radius: 0.05}}}}
bodies:
  guide: {{type: rod, length: 0.09, material: steel, section: {{width: 1 cm, thickness: 3 mm}}}}
  link: {LINK.replace("rods: 10", "rods: 48")}
  lever: {{type: rod, length: 0.15, material: steel, section: {{width: 1 cm, thickness: 1 mm}}}}
joints:
  crank: {{type: revolute, points: [ground, guide.start], at: [0, 0]}}
  sleeve: {{type: sleeve, guide: guide, link: link}}
  pin: {{type: slot, point: link.start, curve: ring}}
  pivot: {{type: revolute, points: [ground, lever.start], at: [0, 0]}}
contacts:
  hit:
    type: point_on_line
    point: link.end
    line: [lever.start, lever.end]
    law: {{stiffness: 2.0e4, restitution: 0.5}}
initial: {{angles: {{guide: 0.03, lever: 0}}, speeds: {{guide: -3, lever: 1}}}}
run: {{duration: 0.011}}
accuracy: {{tolerance: 1.0e-6}}
solver: {{formulation: beam, elements: 3}}
"""


def link_momentum(result):
    """Angular momentum (N,) of the link about O: Simpson's rule over the chords' ends."""
    rods = [i for i, name in enumerate(result.part_names) if name.startswith("link")]
    points = np.concatenate([result.poses[:, rods, :2], where(result, "link.end")[:, None]], axis=1)
    speeds = np.concatenate(
        [result.rates[:, rods, :2], velocity(result, "link.end")[:, None]], axis=1
    )
    moment = points[..., 0] * speeds[..., 1] - points[..., 1] * speeds[..., 0]
    weights = np.array([1, *[4, 2] * (len(rods) // 2 - 1), 4, 1]) / 3 * LENGTH / len(rods)
    return PER_METRE * moment @ weights


def test_angular_momentum_survives_the_strike_of_a_beam():
    result = simulate(scene(SWINGING), measure=True)
    assert result.warnings == ()
    assert result.error.largest < 1e-6
    assert any(event.kind == "contact ends" for event in result.events)
    of_guide = 7850 * 3e-5 * 0.09**3 / 3 * speed(result, "guide")
    of_lever = 7850 * 1e-5 * 0.15**3 / 3 * speed(result, "lever")
    of_link = link_momentum(result)
    total = of_guide + of_lever + of_link
    assert abs(of_link - of_link[0]).max() > 0.1 * abs(of_link[0])
    np.testing.assert_allclose(total, total[0], atol=2e-6 * abs(of_link[0]))
    assert result.checks.energy_residual < 1e-4 * result.checks.largest_kinetic_energy


# The slot runs round the crank's axis: nothing but the torque changes the momentum about it.
KICKED = f"""
{STEEL}
curves: {{round: {{type: circle, centre: [0, 0], radius: 0.02}}}}
bodies:
  guide: {{type: rod, length: 0.09, material: steel, section: {{width: 1 cm, thickness: 1 cm}}}}
  link: {LINK}
joints:
  crank: {{type: revolute, points: [ground, guide.start], at: [0, 0]}}
  sleeve: {{type: sleeve, guide: guide, link: link}}
  pin: {{type: slot, point: link.start, curve: round}}
drives:
  kick:
    type: torque
    joint: crank
    value: {{points: [[0, 1e-3], [0.03, -2e-3], [0.07, 1e-3], [1, 0]], rule: step}}
run: {{duration: 0.12}}
accuracy: {{step: 2.0e-4}}
solver: {{formulation: beam, spectral_radius: 1}}
"""


@pytest.mark.parametrize("settings", [(), ("solver.formulation=redundant",)], ids=["beam", "rods"])
def test_a_torque_that_jumps_keeps_the_books(settings):
    """A speed that misses h/2 of the jump of the acceleration would miss 2 % of the energy."""
    checks = run(KICKED, *settings).checks
    assert checks.energy_residual < 1e-6 * checks.largest_kinetic_energy


# --- what can't be a beam ------------------------------------------------------------------------


SETLAW = "joints.sleeve.law={stiffness: 1.0e5, restitution: 0.5}"
WIND = "drives.wind={type: force, point: link."
NO_BEAM = {
    "bodies.link.hinges.stiffness=paper": "bodies.link.hinges.stiffness",
    "bodies.link.hinges.stiffness=0.5": "bodies.link.hinges.stiffness",
    "bodies.link.rods=1": "bodies.link.rods",
    "bodies.link.slender=false": "bodies.link.slender",
    f"joints.sleeve.clearance=1 mm; {SETLAW}": "joints.sleeve.clearance",
    f"joints.sleeve.supported=true; {SETLAW}": "joints.sleeve.supported",
    f"{STATION}; {WIND}middle, value: [0, 1]}}": "drives.wind.point",
    f"{WIND}end, axes: link, value: [0, 1]}}": "drives.wind.axes",
    f"{STATION}; {WIND}end, value: [0, '1 N/m*place(link.middle, y)']}}": "drives.wind.value",
}


@pytest.mark.parametrize(("settings", "place"), NO_BEAM.items())
def test_what_is_no_beam_is_refused_by_name(settings, place):
    found = load_scene(MODELS / "smooth.yaml", [BEAM, *settings.split("; ")])
    with pytest.raises(NotRepresentableError) as caught:
        simulate(found)
    assert ".".join(caught.value.path) == place


def test_a_beam_goes_on_from_no_bent_state():
    """The chords of the rods do not tell how the beam bends between them."""
    begun = continued(run_model("smooth.yaml", "run.turns=0.1", BEAM))
    with pytest.raises(NotRepresentableError, match="a beam starts straight") as caught:
        simulate(begun)
    assert caught.value.path == ("bodies", "link")


PENDULUM = f"""
{STEEL}
bodies: {{link: {LINK}}}
joints: {{pin: {{type: revolute, points: [ground, link.start], at: [0, 0]}}}}
run: {{duration: 0.1}}
accuracy: {{tolerance: 1.0e-5}}
solver: {{formulation: beam}}
"""


def test_a_link_on_a_pin_is_refused():
    with pytest.raises(NotRepresentableError, match="no other joints") as caught:
        simulate(scene(PENDULUM))
    assert caught.value.path == ("joints", "pin")


def test_a_link_that_is_struck_is_refused():
    text = SWINGING.replace("point: link.end", "point: lever.end")
    text = text.replace("rods: 48", "rods: 48, points: {near: 3 mm, far: 4 mm}")  # of one rod
    text = text.replace("line: [lever.start, lever.end]", "line: [link.far, link.near]")
    with pytest.raises(NotRepresentableError) as caught:
        simulate(scene(text))
    assert caught.value.path == ("contacts", "hit", "line")

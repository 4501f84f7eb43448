"""Stops of hinges and slides: impacts, rest and penalty against closed forms and integrations."""

from itertools import pairwise
from math import pi, sqrt

import pytest
from physics_tools import alone, scene
from test_physics_impulse import balanced, impacts

import exudyn_flexlink as fl
from exudyn_flexlink.accuracy.study import with_stiffer_contacts
from exudyn_flexlink.effects import idealise, with_impact
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.observables import force_peaks, strikes
from exudyn_flexlink.plots.forces import forces
from exudyn_flexlink.report import comparison_text, strike_table
from exudyn_flexlink.scene import ImpulseLaw
from exudyn_flexlink.source import SceneError
from exudyn_flexlink.storage import arrays_of
from exudyn_flexlink.sweeps.rows import standard_row

G = 9.81
ROD = """
bodies:
  rod:
    type: rigid
    mass: 1.2
    inertia: 0.064
    centre_of_mass: [0.4, 0]
    points: {{top: [0, 0], end: [0.8, 0]}}
joints:
  hinge:
    type: revolute
    points: {points}
    at: [0, 0]
    limits: {limits}
gravity: 9.81
initial: {{angles: {{rod: {start} deg}}}}
run: {{duration: {time}}}
accuracy: {{tolerance: 1.0e-11}}
"""
ON_GROUND, FROM_GROUND = "[ground, rod.top]", "[rod.top, ground]"


def rod(limits, start, time, points=ON_GROUND):
    """Run a uniform rod that hangs down at -90 deg; its inertia about the hinge is 0.256 kg m2."""
    return alone(ROD.format(limits=limits, start=start, time=time, points=points))


def amplitudes(result, hits):
    """Greatest angles from straight down, rad, between touches."""
    angle = result.poses[:, 0, 2] + pi / 2
    edges = [(result.time > a) & (result.time < b) for a, b in pairwise(hits)]
    return [float(angle[own].max()) for own in edges]


@pytest.mark.parametrize(
    ("limits", "points", "name"),
    [
        ("{from: -100 deg, law: {type: impulse, restitution: 0.6}}", ON_GROUND, "hinge.from"),
        ("{to: 100 deg, law: {type: impulse, restitution: 0.6}}", FROM_GROUND, "hinge.to"),
    ],
)
def test_a_pendulum_on_a_stop_returns_e_of_its_speed_and_never_rests(limits, points, name):
    """cos a_(n+1) = cos s - e^2 (cos s - cos a_n): swings tend to the stop's angle, 10 deg."""
    result = rod(limits, -30, 3.5, points)
    hits = impacts(result, name)
    expected = [0.4339636165, 1.318800953, 2.272013558, 3.328616882]
    assert [hit.begin for hit in hits] == pytest.approx(expected, abs=1e-9)
    speeds = [4.223134525, 2.533880715, 1.520328429, 0.9121970573]
    assert [hit.approach_speed for hit in hits] == pytest.approx(speeds, rel=2e-10)
    assert hits[0].impulse == pytest.approx(1.729795901, rel=1e-9)
    assert hits[0].energy_lost == pytest.approx(1.461032158, rel=1e-9)
    swings = amplitudes(result, [hit.begin for hit in hits])
    assert swings == pytest.approx([0.6261717727, 0.3976420329, 0.2758700922], abs=1e-4)
    assert len(result.contacts[name].touches) == len(hits)
    assert balanced(result)


def test_a_figure_has_no_line_at_zero_beside_a_stop_that_impulses_struck():
    result = rod("{from: -100 deg, to: 10 deg, law: {type: impulse, restitution: 0.6}}", -30, 1)
    assert not any("contact" in axes.get_ylabel() for axes in forces(result).axes)


def test_a_stop_beyond_half_a_turn_counts_whole_turns():
    """A rotor turns by 270 deg to its limit, and comes to rest there: touches accumulate."""
    result = alone("""
bodies:
  rotor: {type: rigid, mass: 1, inertia: 0.05, points: {c: [0, 0]}}
joints:
  hinge:
    type: revolute
    points: [ground, rotor.c]
    at: [0, 0]
    limits: {from: -1 deg, to: 270 deg, law: {type: impulse, restitution: 0.5}}
drives: {motor: {type: torque, joint: hinge, value: 0.2}}
run: {duration: 5}
accuracy: {tolerance: 1.0e-10}
""")
    first, *_, rest = result.intervals["hinge.to"]
    assert first.begin == pytest.approx(1.534990062, abs=1e-9)
    assert first.approach_speed == pytest.approx(6.139960248, rel=1e-10)
    back = result.time < 1.534990062 * 2.2
    assert result.poses[back & (result.time > first.begin), 0, 2].min() == pytest.approx(
        3.534291735, abs=1e-5
    )
    assert rest.begin == pytest.approx(4.604970186, abs=2e-6)
    assert rest.lasts
    assert rest.peak_force == pytest.approx(0.2, rel=1e-9)
    assert result.poses[-1, 0, 2] == pytest.approx(1.5 * pi, abs=1e-9)
    assert balanced(result)


SLIDE = """
bodies:
  block: {{type: rigid, mass: 2, inertia: 1, points: {{c: [0, 0]}}}}
joints:
  guide:
    type: prismatic
    points: [ground, block.c]
    at: [0.1, 0.2]
    axis: [0, 1]
    limits: {{from: 0, law: {law}}}
gravity: 9.81
initial: {{along: {{guide: 0.5}}}}
run: {{duration: {time}}}
accuracy: {{tolerance: 1.0e-10}}
"""


def test_a_stop_that_gives_way_is_no_penetration():
    for formulation in ("minimal", "redundant"):
        text = SLIDE.format(law="{stiffness: 1e6, restitution: 0.7}", time=0.5)
        result = alone(text, f"solver.formulation={formulation}", "accuracy.tolerance=1e-5")
        assert result.intervals["guide.from"].penetration.max() > 1e-4
        assert result.checks.largest_penetration == 0  # which is that of contacts


@pytest.mark.parametrize(
    ("damping", "depth", "leaves", "back"),
    [(50, 0.02689565636, 0.02990916734, 2.157761617), (0, 0.03231727867, None, sqrt(G))],
)
def test_a_stop_with_a_damper_lets_go_before_it_would_pull(damping, depth, leaves, back):
    """It leaves where k p + c p' = 0, not where p = 0; without a damper nothing is lost."""
    law = f"{{stiffness: 2e4 N/m, damping: {damping} N s/m}}"
    result = alone(SLIDE.format(law=law, time=0.6))
    (touch,) = result.intervals["guide.from"]
    assert touch.penetration == pytest.approx(depth, rel=1e-9)
    assert touch.begin == pytest.approx(0.3192754284, abs=1e-9)
    assert touch.separation_speed == pytest.approx(back, rel=1e-9)
    if leaves is not None:
        assert touch.end - touch.begin == pytest.approx(leaves, abs=1e-9)
        assert result.contacts["guide.from"].force.min() >= 0
    below = damping * back / 2e4  # m, where the force ends
    assert touch.energy_lost == pytest.approx(G - back**2 + 2 * G * below, abs=1e-8)
    assert balanced(result)


@pytest.mark.parametrize("formulation", ["minimal", "redundant"])
@pytest.mark.parametrize(
    ("law", "returned"),
    [
        ("{stiffness: 1e6, restitution: 0.7}", 0.7),
        ("{type: lankarani_nikravesh, stiffness: 1e8, restitution: 0.7}", 0.7959980556),
        ("{type: hertz, stiffness: 1e8}", 1.0),
    ],
)
def test_a_slide_comes_back_from_its_stop_with_its_restitution(formulation, law, returned):
    """Both formulations: e of the speed, above the transition speed, without gravity."""
    text = SLIDE.format(law=law, time=0.3)
    text = text.replace("gravity: 9.81", "").replace(
        "guide: 0.5}", "guide: 0.5}, speeds_along: {guide: -3}, speeds: {wheel: 40}"
    )
    wheel = "  wheel: {type: rigid, mass: 1, inertia: 1, points: {c: [0, 0]}}\n"
    text = text.replace("joints:\n", f"{wheel}joints:\n")  # which has nothing to do with it
    result = alone(text, f"solver.formulation={formulation}", "accuracy.tolerance=1e-6")
    (touch,) = result.intervals["guide.from"]
    assert touch.begin == pytest.approx(0.5 / 3, abs=1e-6)
    assert touch.separation_speed == pytest.approx(3 * returned, rel=2e-3)
    assert touch.energy_lost == pytest.approx(9 - touch.separation_speed**2, abs=0.03)


def test_without_impact_joints_are_free_and_impulses_take_the_restitution():
    own = scene(SLIDE.format(law="{stiffness: 1e6, restitution: 0.7}", time=1))
    assert idealise(own, ["impact"]).stops == {}
    assert with_impact(own, "impulse").stops["guide.from"].law == ImpulseLaw(restitution=0.7)
    damped = scene(SLIDE.format(law="{stiffness: 1e6, damping: 7}", time=1))
    with pytest.raises(SceneError, match=r"joints\.guide\.limits\.law: no restitution is known"):
        with_impact(damped, "impulse")


@pytest.mark.parametrize(
    ("law", "stiffer"),
    [
        ("{stiffness: 1e6, restitution: 0.7}", {"stiffness": 4e6}),
        ("{stiffness: 1e6, damping: 7}", {"stiffness": 4e6, "damping": 14}),
        ("{type: hertz, stiffness: 1e6}", {"stiffness": 4**1.25 * 1e6}),
    ],
)
def test_stops_are_read_as_written_and_made_stiffer_where_compliance_is_measured(law, stiffer):
    """All touches get half as long; the ratio of damping, so the restitution, stays."""
    own = scene(SLIDE.format(law=law, time=1))
    assert fl.load_scene(own.to_data()) == own
    found = with_stiffer_contacts(own).stops["guide.from"].law
    assert found == own.stops["guide.from"].law.model_copy(update=stiffer)


def test_what_is_told_of_a_hinge_is_told_as_angles_and_torques():
    result = rod("{from: -90 deg, law: {stiffness: 3000, restitution: 0.6}}", -50, 0.4)
    peak = force_peaks(result)["contact torque of hinge.from"]
    assert peak.unit == "N m"
    assert peak.value == pytest.approx(result.extremes["hinge.from.torque_N_m"].greatest[0])
    assert "hinge.from.penetration_rad" in result.extremes
    assert "hinge.from.greatest_approach_speed_rad_per_s" in standard_row(result)
    assert f"{peak.value:.5g} N m" in comparison_text(fl.compare(result, result))
    table = strike_table(result, "hinge.from", 3)
    assert "rad/s" in table.units
    assert table.rows[0][0] == "-90.00"  # as its limit is written
    told = {"gap": "rad", "force": "N m", "touches.approach_speed": "rad/s", "touches.end": "s"}
    told |= {"touches.penetration": "rad", "touches.impulse": "N m s", "touches.energy_lost": "J"}
    arrays = arrays_of(result)
    found = {name: arrays[f"contacts.hinge.from.{name}"].attributes["units"] for name in told}
    assert found == told


def test_what_the_spring_of_a_lasting_touch_stores_is_not_lost():
    """A ball of 1 kg at 1 m/s is at its deepest after a quarter period: all is stored, 0.5 J."""
    text = """
curves: {floor: {type: line, from: [-1, 0], to: [1, 0]}}
bodies: {ball: {type: rigid, mass: 1, inertia: 1.0e-3}}
contacts: {pad: {type: point_on_curve, point: ball.centre, curve: floor, side: left,
           law: {type: hertz, exponent: 1, stiffness: 1.0e4}}}
initial: {positions: {ball: [0, 0]}, velocities: {ball: [0, -1]}}
run: {duration: 0.015707963267948967}
accuracy: {tolerance: 1.0e-9}
"""
    result = simulate(scene(text), measure=False)
    (touch,) = result.intervals["pad"]
    assert touch.lasts
    assert touch.impulse == pytest.approx(1, rel=1e-6)
    assert touch.energy_lost == pytest.approx(0, abs=1e-10)
    assert standard_row(result)["pad.energy_lost_J"] == pytest.approx(0, abs=1e-10)


def test_touches_are_strikes_of_their_own_where_the_rotor_has_turned_out_and_back():
    """By up to 1.9 turns, which end where they began: at the stop."""
    text = """
bodies: {r: {type: rigid, mass: 1, inertia: 0.05, points: {o: [0, 0], e: [0.3, 0]}}}
joints:
  h: {type: revolute, points: [ground, r.o], at: [0, 0],
      limits: {from: -0.5, law: {restitution: 0.9, stiffness: 2000}}}
springs: {s: {type: torsional, joint: h, stiffness: 2, rest_angle: 0}}
initial: {speeds: {r: -80}}
run: {duration: 3}
accuracy: {tolerance: 1.0e-7}
"""
    result = simulate(scene(text), measure=False)
    touches = result.intervals["h.from"]
    assert len(touches.begin) == 6
    assert [strike.begin for strike in strikes(result, "h.from")] == touches.begin.tolist()

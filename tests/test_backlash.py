"""Gears with backlash: rattling, lost motion and teeth that give way.

Numbers are closed forms, with their roots refined, and two integrations that agree to 1e-11.
"""

import numpy as np
import pytest
from physics_tools import alone, scene
from test_physics_impulse import balanced

from exudyn_flexlink.accuracy.study import with_stiffer_contacts
from exudyn_flexlink.continuing import continued, joined
from exudyn_flexlink.effects import idealise, with_impact
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.scene import Run
from exudyn_flexlink.source import SceneError

R1, R2, J2 = 0.03, 0.02, 2e-4
PAIR = """
bodies:
  pinion: {type: rigid, mass: 0.2, inertia: 2.0e-3, points: {o: [0, 0], rim: [30 mm, 0]}}
  wheel: {type: rigid, mass: 0.5, inertia: 2.0e-4, points: {o: [0, 0], rim: [20 mm, 0]}}
joints:
  shaft: {type: revolute, points: [ground, pinion.o], at: [0, 0]}
  axle: {type: revolute, points: [ground, wheel.o], at: [50 mm, 0]}
  mesh:
    type: gear
    joints: [shaft, axle]
    teeth: [30, 20]
    backlash: 0.02 rad
    law: {type: impulse, restitution: 0.6}
run: {duration: 0.15}
accuracy: {tolerance: 1.0e-10}
"""
SHAKEN = (
    PAIR,
    "drives={motor: {type: motion, joint: shaft, value: 0.03*sin(60*t)},"
    " load: {type: torque, joint: axle, value: -0.02}}",
)


def rotor(result, body, time):
    """Rate of a body right after an instant."""
    after = np.searchsorted(result.time, time, side="right")
    return float(result.rates[after, result.part_names.index(body), 2])


def test_a_driven_pinion_rattles_a_wheel_until_that_lasts_on_a_flank():
    """9A: flights are parabolas; it leaves where ``J2 w2' - T = 0`` on the flank."""
    result = alone(*SHAKEN)
    to, back = result.intervals["mesh.to"], result.intervals["mesh.from"]
    np.testing.assert_allclose(to.begin, [0.004046581326, 0.09480126629], atol=1e-11)
    expected = [0.01348684584, 0.02853126065, 0.03770483601]
    np.testing.assert_allclose(back.begin[:3], expected, atol=1e-11)
    np.testing.assert_allclose(R2 * to.approach_speed, [0.04432300826, 0.02449410687], rtol=1e-9)
    speeds = [0.0606267324, 0.03856959912, 0.02204753841]
    np.testing.assert_allclose(R2 * back.approach_speed[:3], speeds, rtol=1e-9)
    assert to.impulse[0] == pytest.approx(R2 * 0.03545840661, rel=1e-9)
    impulses = [0.04850138592, 0.03085567929, 0.01763803073]
    np.testing.assert_allclose(back.impulse[:3] / R2, impulses, rtol=1e-9)
    lasting = [touch for touch in back if touch.end > touch.begin]
    begins = [touch.begin for touch in lasting]
    assert begins == pytest.approx([0.05826666037, 0.1415986242], abs=1e-7)
    assert lasting[0].end == pytest.approx(0.063447973, abs=1e-9)
    (struck,) = back.where((back.begin > 0.11) & (back.begin < 0.1113))
    assert struck.begin == pytest.approx(0.1112591151, abs=1e-10)
    angle, rate = result.poses[-1, 1, 2], result.rates[-1, 1, 2]
    assert (angle, rate) == pytest.approx((-0.02854533184, 2.460051707), rel=1e-9)
    assert balanced(result)


def test_a_plastic_rattle_repeats_with_the_drive_from_the_first_leaving_on():
    """9A with e = 0: a hit lasts unless the flank leaves at once."""
    result = alone(*SHAKEN, "joints.mesh.law.restitution=0", "run.duration=0.25")
    to, back = result.intervals["mesh.to"], result.intervals["mesh.from"]
    expected = [0.004046581326, 0.09480126629, 0.1995210214]
    np.testing.assert_allclose(to.begin, expected, atol=1e-10)
    hits = [0.01889902544, 0.1174756647, 0.2221954198]
    np.testing.assert_allclose(np.unique(back.begin), hits, atol=1e-10)
    leaves = back.end[np.isfinite(back.end) & (back.end > back.begin)]
    np.testing.assert_allclose(leaves, [0.063447973, 0.1681677281], atol=1e-9)
    assert leaves[1] - leaves[0] == pytest.approx(2 * np.pi / 60, rel=1e-8)


COASTING = (PAIR, "initial.speeds.pinion=30", "joints.mesh.law.restitution=0.5")


def test_an_impulse_on_a_flank_acts_on_both_wheels_by_their_radii():
    """9B: ``-(1 + e) m_e s'`` with ``1/m_e = r1^2/J1 + r2^2/J2``."""
    result = alone(*COASTING, "run.duration=0.0012")
    (hit,), (other,) = (result.intervals[f"mesh.{end}"] for end in ("to", "from"))
    assert hit.begin == pytest.approx(0.0002222222222, abs=1e-12)
    assert other.begin == pytest.approx(0.001111111111, abs=1e-11)
    assert hit.impulse == pytest.approx(R2 * 0.5510204082, rel=1e-9)
    assert hit.energy_lost == pytest.approx(0.1239795918, rel=1e-9)
    turning = [rotor(result, body, hit.begin) for body in ("pinion", "wheel")]
    assert turning == pytest.approx([21.73469388, -55.10204082], rel=1e-9)


def test_teeth_that_give_way_part_with_the_speeds_of_their_law():
    """9B by penalty: stiffness along the pitch circle times r2^2."""
    law = "{stiffness: 400 N m/rad, restitution: 0.5, transition_speed: 0.25 rad/s}"
    result = alone(*COASTING, f"joints.mesh.law={law}", "run.duration=0.0075")
    (hit,), (other,) = (result.intervals[f"mesh.{end}"] for end in ("to", "from"))
    assert hit.end == pytest.approx(0.003225477166, abs=1e-10)
    assert R2 * hit.penetration == pytest.approx(0.0005749920483, rel=1e-8)
    assert other.begin == pytest.approx(0.004114312442, abs=1e-10)
    assert other.end == pytest.approx(0.007110192237, abs=1e-10)
    assert R2 * other.penetration == pytest.approx(0.0002875180747, rel=1e-8)
    turning = [rotor(result, body, hit.end) for body in ("pinion", "wheel")]
    assert turning == pytest.approx([21.73452769, -55.10314871], rel=1e-9)
    assert list(result.rates[-1, :, 2]) == pytest.approx([25.86776235, -27.54825101], rel=1e-9)
    assert balanced(result)


REVERSED = (
    PAIR,
    "drives={motor: {type: motion, joint: shaft, value: 0.1*(1 - cos(5*t))}}",
    "joints.axle.friction.torque=0.05",
    "joints.mesh.law.restitution=0",
    "joints.mesh.start=0.01 rad",
)


def test_a_reversal_loses_the_play_of_a_driver():
    """9C: wheel 1 turns back by b/r1 before it takes wheel 2 along, which friction holds."""
    result = alone(*REVERSED, "run.duration=1.2566370614359172")
    to, back = result.intervals["mesh.to"], result.intervals["mesh.from"]
    half = result.sample_at(np.pi / 5)
    assert result.poses[half, 1, 2] == pytest.approx(-0.3, abs=1e-9)
    hit = next(iter(back))
    assert hit.begin == pytest.approx(0.7327814951, abs=1e-9)
    assert hit.impulse == pytest.approx(R2 * 0.003741657387, rel=1e-8)
    assert to.begin[0] == 0
    assert rotor(result, "wheel", hit.begin) == pytest.approx(0.3741657387, rel=1e-2)
    before = 0.1 * (1 - np.cos(5 * hit.begin))
    assert 0.2 - before == pytest.approx(0.01333333333, abs=1e-9)
    assert result.poses[-1, 1, 2] == pytest.approx(-0.02, abs=1e-8)
    assert balanced(result)


def test_both_flanks_are_struck_in_one_step_where_the_play_is_tiny():
    """A wheel without a load comes to the speed of its pinion; hits between flanks take e each."""
    result = alone(*COASTING, "joints.mesh.backlash=1.0e-7 rad", "run.duration=0.0001")
    hits = np.sort([*result.intervals["mesh.to"].begin, *result.intervals["mesh.from"].begin])
    times, gaps, speed = [], 5e-8, 30 * R1 / R2
    for _ in range(8):
        times.append((times[-1] if times else 0.0) + gaps / speed)
        gaps, speed = 1e-7, speed * 0.5
    np.testing.assert_allclose(hits[:8], times, rtol=1e-6)


RACK = """
bodies:
  pinion: {type: rigid, mass: 1, inertia: 3.0e-3, points: {o: [0, 0], rim: [40 mm, 0]}}
  rack: {type: rigid, mass: 1.5, inertia: 0.01, points: {o: [0, 0]}}
joints:
  shaft: {type: revolute, points: [ground, pinion.o], at: [0.04, 0]}
  way: {type: prismatic, points: WAY, at: [0, 0], axis: [0, 1]}
  mesh:
    type: gear
    joints: [shaft, way]
    radius: 0.04
    backlash: 0.2 mm
    start: 0.05 mm
    law: {type: impulse, restitution: 0.5}
initial: {speeds: {pinion: 10}}
run: {duration: 0.0005}
accuracy: {tolerance: 1.0e-10}
"""


@pytest.mark.parametrize("way", ["[ground, rack.o]", "[rack.o, ground]"])
@pytest.mark.parametrize("first", ["shaft", "way"])
def test_a_rack_is_struck_by_a_flank_of_its_pinion(way, first):
    """x = c2 - r c1, or c2 - c1/r: play as long as it is, 1/m_e = 1/m + r^2/J."""
    text = RACK.replace("WAY", way)
    settings = []
    if first == "way":
        settings = ["joints.mesh.joints=[way, shaft]", "joints.mesh.backlash=0.005 rad"]
        settings += ["joints.mesh.start=-0.00125 rad"]
    result = alone(text, *settings)
    # The pinion runs ahead of the rack: x of the slide falls, that of the pinion grows.
    (hit,) = result.intervals["mesh.from" if first == "shaft" else "mesh.to"]
    assert hit.begin == pytest.approx(0.15e-3 / 0.4, rel=1e-10)
    mass = 1 / (1 / 1.5 + 0.04**2 / 3e-3)
    unit = 1 if first == "shaft" else 0.04
    assert hit.impulse == pytest.approx(unit * 1.5 * mass * 0.4, rel=1e-10)
    pinion, rack = result.rates[-1, 0, 2], result.rates[-1, 1, 1]
    assert (pinion, rack) == pytest.approx((10 - 0.04 * 0.6 * mass / 3e-3, 0.6 * mass / 1.5))
    assert balanced(result)


def test_a_ring_turns_alike_with_its_pinion_and_pins_bear_the_teeth():
    """x = c2 - (r1/r2) c1 inside; a lasting flank pulls the pin as the ideal gear does."""
    inside = (
        PAIR,
        "joints.mesh.internal=true",
        "joints.mesh.ratio=3",
        "joints.mesh.teeth=null",
        "joints.axle.at=[20 mm, 0]",
        "joints.mesh.start=-0.01",
        "joints.mesh.law.restitution=0",
        "drives={motor: {type: torque, joint: shaft, value: 0.5}}",
        "run.duration=0.02",
    )
    loose = alone(*inside)
    ideal = simulate(idealise(scene(*inside), ["clearance"]))
    assert loose.rates[-1, :, 2] == pytest.approx(ideal.rates[-1, :, 2], rel=1e-9)
    press = loose.contacts["mesh.from"].force[-1]
    assert press / 0.03 == pytest.approx(-ideal.gear_forces["mesh"][-1], rel=1e-9)
    for pin in ("shaft", "axle"):
        pulled = loose.joint_forces[pin][-1]
        assert pulled == pytest.approx(ideal.joint_forces[pin][-1], rel=1e-9, abs=1e-12)
        assert np.linalg.norm(pulled) == pytest.approx(press / 0.03, rel=1e-9)


def test_a_run_goes_on_where_it_is_in_the_play():
    whole = alone(*COASTING, "run.duration=0.003")
    first = alone(*COASTING, "run.duration=0.001")
    second = simulate(continued(first).changed(run=whole.scene.run))
    both = joined(first, second)
    np.testing.assert_allclose(
        both.intervals["mesh.from"].begin[:1], whole.intervals["mesh.from"].begin[:1], rtol=1e-9
    )


def test_a_run_goes_on_while_teeth_give_way():
    """The second joint is then beyond the play, by how far its teeth do."""
    soft = "joints.mesh.law={stiffness: 40, restitution: 0.5}"
    whole = alone(*COASTING, soft, "run.duration=0.02")
    touch = next(iter(whole.intervals["mesh.from"]))
    begun = continued(whole, (touch.begin + min(touch.end, 0.02)) / 2)
    assert abs(begun.joints["mesh"].start) > begun.joints["mesh"].backlash / 2
    rest = Run(duration=0.02 - begun.initial.clock)
    again = simulate(begun.changed(run=rest), measure=False)
    np.testing.assert_allclose(again.poses[-1], whole.poses[-1], atol=1e-9)


def test_teeth_that_press_go_on_to_press_in_a_stage():
    """They are pressed in then, beyond the play that a start must be within."""
    soft = ("joints.mesh.law={stiffness: 400, restitution: 0.3}", "run={duration: 0.02}")
    pulled = (*soft, "drives={load: {type: torque, joint: axle, value: -0.02}}")
    plain = alone(PAIR, *pulled)
    (touch,) = plain.intervals["mesh.from"]
    pressed = touch.begin + 5e-4
    staged = alone(PAIR, *pulled, f"stages=[{{until: t - {pressed}, set: {{gravity: 0}}}}]")
    (same,) = staged.intervals["mesh.from"]
    for key in ("begin", "end", "approach_speed", "peak_force"):
        assert getattr(same, key) == pytest.approx(getattr(touch, key), rel=1e-6)
    np.testing.assert_allclose(staged.poses[-1], plain.poses[-1], atol=1e-9)


def test_effects_take_the_play_out_or_let_teeth_strike_rigidly():
    loose = scene(PAIR, "joints.mesh.law={stiffness: 400, restitution: 0.3}")
    ideal = idealise(loose, ["clearance"]).joints["mesh"]
    assert (ideal.backlash, ideal.start, ideal.law) == (0, 0, None)
    assert idealise(loose, ["impact"]) == loose
    assert with_impact(loose, "impulse").joints["mesh"].law.restitution == 0.3
    stiffer = with_stiffer_contacts(loose)
    assert stiffer.joints["mesh"].law.stiffness == 1600


REFUSED = {
    "joints.mesh.law=null": "'backlash' needs a 'law'",
    "joints.mesh.start=0.6 deg": "beyond the flanks",
    "joints.mesh.backlash=0.2 mm": "expected an angle, since 'axle' is of type revolute",
    "joints.mesh.start=0.2 mm": "expected an angle, since 'axle' is of type revolute",
    "joints.mesh.backlash=-0.2 deg": "must be 0 or greater",
    "joints.mesh.backlash=2 kg": "expected a length or an angle",
    "joints.mesh.law={stiffness: 4 kN/m, restitution: 0}": "expected a torsional stiffness, since",
    "joints.mesh.law={stiffness: 4, restitution: 0, friction: 0.1}": "friction",
    "joints.mesh.law={stiffness: 4}": "needs 'restitution' or 'damping'",
}


@pytest.mark.parametrize(("setting", "words"), REFUSED.items())
def test_play_that_can_not_be_is_refused(setting, words):
    with pytest.raises(SceneError) as refused:
        scene(PAIR, setting)
    (mistake,) = refused.value.mistakes
    assert words in mistake.message
    assert mistake.path[:2] == ("joints", "mesh")

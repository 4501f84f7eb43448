"""Where forces jump samples stand on both sides, so that what is integrated by them is right."""

import numpy as np
import pytest
from physics_tools import MODELS, alone, velocity

from exudyn_flexlink import load_scene, simulate

G = 9.81

LEDGE = """
curves: {{ledge: {{type: line, from: [0, 0], to: [0.3, 0]}}}}
bodies:
  bead: {{type: rigid, mass: 2, inertia: 1.0e-3, points: {{c: [0, 0]}}}}
  plate: {{type: rigid, mass: 1, inertia: 1, points: {{o: [0, 0], a: [0, 0], b: [0.3, 0]}}}}
joints: {{bolts: {{type: weld, points: [ground, plate.o], at: [0, 0]}}}}
contacts: {{ledge: {{point: bead.c, {shape}, law: {{{law}}}}}}}
gravity: [0, -9.81]
initial: {{positions: {{bead: [0.1, 0]}}, velocities: {{bead: [1, 0]}}}}
run: {{duration: 0.4, sample: 0.01}}
accuracy: {{tolerance: 1.0e-6}}
"""
ON_LINE = "type: point_on_line, line: [plate.a, plate.b]"
ON_CURVE = "type: point_on_curve, curve: ledge"
SOFT, RIGID = "stiffness: 1.0e4, restitution: 0.5", "type: impulse, restitution: 0"
CASES = [
    (ON_LINE, SOFT, "minimal"),
    (ON_LINE, SOFT, "redundant"),
    (ON_CURVE, SOFT, "minimal"),
    (ON_LINE, RIGID, "minimal"),
    (ON_CURVE, RIGID, "minimal"),
]


@pytest.mark.parametrize(("shape", "law", "formulation"), CASES)
def test_the_impulse_up_to_a_slide_off_is_that_of_the_samples(shape, law, formulation):
    """By momentum, m (v + g T); in even samples the last one would lose up to half a spacing."""
    result = alone(LEDGE.format(shape=shape, law=law), f"solver.formulation={formulation}")
    contact = result.contacts["ledge"]
    *_, last = contact.touches
    assert last.slides_off
    assert last.end == pytest.approx(0.2, abs=1e-5)
    given = 2 * (velocity(result, "bead.c")[-1, 1] + G * 0.4)
    assert sum(touch.impulse for touch in contact.touches) == pytest.approx(given, rel=5e-5)
    assert np.trapezoid(contact.force, result.time) == pytest.approx(given, rel=1e-3)
    assert np.diff(result.time).min() > 0
    k = int(np.searchsorted(result.time, last.end))
    before, after = contact.force[k - 1 : k + 1]
    assert result.time[k] - result.time[k - 1] < 1e-15
    assert (before, after) == (pytest.approx(2 * G, rel=0.05), 0)


@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
def test_a_lasting_contact_of_the_paper_ends_between_two_samples(engine):
    """S sticks to the lever, pushes it, and slides off its tip."""
    law = "contacts.strike.law={type: impulse, restitution: 0}"
    scene = load_scene(MODELS / "rigid.yaml", [law, "run.turns=0.55"])
    result = simulate(scene, engine, measure=False)
    contact = result.contacts["strike"]
    (last,) = [touch for touch in contact.touches if touch.slides_off]
    inside = (result.time >= last.begin) & (result.time <= last.end)
    impulse = np.trapezoid(contact.force[inside], result.time[inside])
    assert impulse == pytest.approx(last.impulse, rel=1e-4)
    assert contact.force[inside][-2] > 0.4 > contact.force[inside][-1] == 0


def test_speeds_before_and_after_an_impact_are_both_kept():
    text = LEDGE.format(shape=ON_LINE, law="type: impulse, restitution: 0.5")
    result = alone(text, "initial.positions.bead=[0.1, 0.05]", "run.duration=0.15")
    (hit,) = result.contacts["ledge"].touches
    k = int(np.searchsorted(result.time, hit.begin))
    before, after = velocity(result, "bead.c")[k - 1 : k + 1, 1]
    assert before == pytest.approx(-np.sqrt(2 * G * 0.05), abs=1e-9)
    assert after == pytest.approx(-0.5 * before, abs=1e-9)

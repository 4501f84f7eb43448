"""What the program says of joints with clearance and circles: scenes, results, files, figures."""

import json

import numpy as np
import pytest
from physics_tools import scene, tree_contacts
from test_physics_circles import SLIDER_CRANK, disc_in_dish

from exudyn_flexlink.effects import absent, idealise
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.mechanism import approach
from exudyn_flexlink.observables import contact_totals, joints_with_play
from exudyn_flexlink.report import check_text, run_text
from exudyn_flexlink.storage import load, save
from exudyn_flexlink.storage.run import tables_of

SHORT = "run.duration=5 ms", "accuracy.tolerance=1.0e-6"


@pytest.fixture(scope="module")
def result():
    return simulate(scene(SLIDER_CRANK, *SHORT), measure=False)


# --- effects and assembly ---------------------------------------------------------------------


def test_without_clearance_the_joint_is_ideal():
    loose = scene(SLIDER_CRANK)
    ideal = idealise(loose, ["clearance"])
    joint = ideal.joints["small_end"]
    assert (joint.clearance, joint.law, joint.radius) == (0.0, None, None)
    assert absent(ideal, ["clearance"]) == ["clearance"]
    assert assemble_scene(loose).degrees_of_freedom == assemble_scene(ideal).degrees_of_freedom + 2


def test_without_friction_journals_and_circles_are_smooth():
    rough = scene(SLIDER_CRANK, "joints.small_end.law.friction=0.1", "joints.small_end.radius=5 mm")
    assert absent(rough, ["friction"]) == []
    smooth = idealise(rough, ["friction"])
    assert smooth.joints["small_end"].law.friction == 0
    assert idealise(scene(disc_in_dish(0.1, 1, friction=0.3)), ["friction"]) == scene(
        disc_in_dish(0.1, 1)
    )


def test_a_journal_starts_in_the_middle_of_its_bearing_and_moves_with_it():
    state = assemble_scene(scene(SLIDER_CRANK)).state
    mechanism = assemble_scene(scene(SLIDER_CRANK)).mechanism
    at = approach(mechanism.bearings[0], state.q, state.v, 0.0)
    assert at.gap == pytest.approx(5e-4, abs=1e-12)
    assert at.gap_rate == pytest.approx(0.0, abs=1e-9)


def test_the_speed_of_a_journal_can_be_given():
    text = """
bodies: {ball: {type: rigid, mass: 1, inertia: 1.0e-3, points: {c: [0, 0]}}}
joints:
  a: {type: revolute, points: [ball.c, ground], at: [0, 0], clearance: 0.1,
      law: {stiffness: 1.0e6, restitution: 0.8}}
initial: {velocities: {ball: [0.3, 0.4]}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-6}
"""
    assembly = assemble_scene(scene(text))
    at = approach(assembly.mechanism.bearings[0], assembly.state.q, assembly.state.v, 0.0)
    assert (float(at.gap), float(at.gap_rate)) == pytest.approx((0.1, -0.5))


# --- results ----------------------------------------------------------------------------------


def test_the_result_speaks_of_the_joint(result):
    assert list(result.bearings) == ["small_end"] == joints_with_play(result)
    assert result.contacts == {}
    assert list(result.intervals) == ["small_end"]
    assert {"small_end.force_N", "small_end.penetration_m"} <= set(result.extremes)
    assert contact_totals(result, "small_end").touches == len(result.intervals["small_end"]) > 0
    assert any("bearing of 'small_end'" in told for told in result.warnings)
    assert "touches_small_end.csv" in tables_of(result)


def test_run_and_check_name_the_bearing(result):
    told = run_text(result)
    assert "Journal in 'small_end'" in told
    checked = " ".join(check_text(result.scene, assemble_scene(result.scene)).split())
    assert "rod.small and slider.pin, clearance 0.0005 m" in checked
    assert "journal at rod.small" in checked


def test_a_saved_run_is_read_back_as_it_was(result, tmp_path):
    save(result, tmp_path)
    back = load(tmp_path)
    for name in ("gap", "place", "force"):
        kept, read = (getattr(r.bearings["small_end"], name) for r in (result, back))
        np.testing.assert_array_equal(kept, read)
    assert list(back.intervals["small_end"]) == list(result.intervals["small_end"])
    summary = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert summary["clearances"]["small_end"]["touches"] > 0


@pytest.mark.parametrize("which", ["normal", "friction"])
def test_slopes_of_a_contact_are_derivatives_of_its_force(which):
    """By central differences, for one disc in a dish: nothing else turns with the coordinates."""
    text = disc_in_dish(0.3, 1, friction=0.4 if which == "friction" else 0.0, slip=0.2)
    assembly = assemble_scene(scene(text, "contacts.dish.law.restitution=0.6"))
    contacts = tree_contacts(assembly.mechanism)
    acting, law, began = contacts.acting((0,)), assembly.mechanism.contacts[0].law, np.zeros(1)
    far = 0.4 + 1e-4
    x = np.array([far * np.sin(0.7), -far * np.cos(0.7), 0.2])
    v = np.array([0.02, 0.03, 0.7])

    def moving(x, v):
        return contacts.kinematics.moving(x, v)

    def force(x, v):
        return acting.push(moving(x, v), began).force

    def slopes(x, v):
        return acting.slopes(acting.push(moving(x, v), began), moving(x, v), began)

    def slope(of, at, h):
        columns = [(of(at + h * e) - of(at - h * e)) / (2 * h) for e in np.eye(3)]
        return -np.column_stack(columns)

    touch, row = contacts.touch(0, x, v), acting.look(moving(x, v))[1].across[0]
    by_gap = slope(lambda y: np.array([contacts.touch(0, y, v).gap]), x, 1e-6)[0]
    np.testing.assert_allclose(by_gap, -row, atol=1e-7)
    e = 0.6
    rising = np.tanh(-touch.gap_rate / law.transition_speed)
    damper = -touch.gap * law.stiffness * (1 - e**2) / 2 / law.transition_speed * (1 - rising**2)
    along_gap = np.outer(row, row)
    by_speed = slope(lambda w: force(x, w), v, 1e-6)
    np.testing.assert_allclose(slopes(x, v)[1] + damper * along_gap, by_speed, atol=1e-3, rtol=1e-4)
    # A disc that spins fast: its friction has reached its bound, and turns with the normal alone;
    # that its arm shortens with the depth, a thousandth of the radius, is left to the iteration.
    spinning = np.array([0.0, 0.0, 50.0])
    by_place = slope(lambda y: force(y, spinning), x, 1e-8)
    spring = law.stiffness * (1 + e**2) / 2
    np.testing.assert_allclose(
        slopes(x, spinning)[0] + spring * along_gap, by_place, atol=5.0, rtol=2e-3
    )

"""A mechanism as a tree of links: what is one, where its links are, and how it moves."""

from functools import cache

import numpy as np
import pytest
from cli_runs import MODELS

from exudyn_flexlink.engines import formulations, simulate
from exudyn_flexlink.engines.exudyn.minimal.kinematics import motions, start_coordinates
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.loading import assemble_scene, load_scene
from exudyn_flexlink.mechanism import formulation
from exudyn_flexlink.mechanism.tree import tree_layout
from exudyn_flexlink.observables import lever_response

LEVER = 0.03  # m
FEW = ("bodies.link.rods=4", "run.turns=0.6", "run.sample=1 ms")


@cache
def run(model, *settings):
    return simulate(load_scene(MODELS / model, settings))


def both(model, *settings, joints="accuracy.step=1e-5"):
    """The same scene as a tree and with joints, at steps that leave 2e-10 m in 0.2 turns."""
    tree = run(model, *settings, "solver.formulation=minimal", "accuracy.tolerance=1e-10")
    return tree, run(model, *settings, "solver.formulation=redundant", joints)


def common(one, other):
    """Samples at the same instants."""
    _, first, second = np.intersect1d(
        np.round(one.time, 9), np.round(other.time, 9), return_indices=True
    )
    return first, second


# --- what is a tree ---------------------------------------------------------------------------


def test_auto_takes_minimal_coordinates():
    for model in ("no_clearance.yaml", "spline_track.yaml", "clearance_friction.yaml"):
        scene = load_scene(MODELS / model)
        assert formulation(scene) == "minimal"
        assert formulations(scene, "exudyn")[:2] == ("minimal", "redundant")


def test_a_fixed_step_is_for_joints_unless_the_tree_is_asked_for():
    scene = load_scene(MODELS / "smooth.yaml", ["accuracy={step: 1e-3}"])
    assert formulation(scene) == "redundant"


# --- where its links are ----------------------------------------------------------------------


@pytest.mark.parametrize("model", ["no_clearance.yaml", "spline_track.yaml"])
def test_links_start_where_the_parts_are_put_together(model):
    """Poses, rates and accelerations of the tree are those of the mechanism's own equations."""
    assembly = assemble_scene(load_scene(MODELS / model))
    layout = tree_layout(assembly.mechanism)
    x, v = start_coordinates(layout, assembly)
    tree = MinimalModel(assembly, layout, [])
    at = tree.evaluate(0.0, *tree.coordinates.independent())
    state = at.kept.state.pick(None)
    whole = state.b + state.transform.expanded(at.accelerations[None, :])
    found = motions(layout, tree.kinematics, x[None], v[None], whole)
    np.testing.assert_allclose(found.poses[0], assembly.state.q, atol=1e-14)
    np.testing.assert_allclose(found.rates[0], assembly.state.v, atol=1e-13)
    np.testing.assert_allclose(found.bends[0], assembly.state.a, atol=1e-5)


# --- how it moves -----------------------------------------------------------------------------


def test_the_smooth_motion_is_that_with_joints_to_2e_10_and_so_are_reactions():
    tree, joints = both("smooth.yaml", *FEW, "run.turns=0.2")
    first, second = common(tree, joints)
    assert len(first) > 100
    np.testing.assert_allclose(tree.poses[first], joints.poses[second], atol=2e-10)
    calm = slice(5, -5)  # the integrator with joints knows no reactions at time 0
    for name in ("drive_torques", "slot_forces", "joint_forces"):
        for key, values in getattr(tree, name).items():
            expected = getattr(joints, name)[key][second][calm]
            scale = np.abs(expected).max()
            np.testing.assert_allclose(values[first][calm], expected, atol=2e-4 * scale)


def test_a_guide_with_a_torque_moves_the_same():
    """Then the guide's angle is free, and the slide follows it along the track."""
    settings = (
        *FEW,
        "drives={motor: {type: torque, joint: crank, value: 4e-3}}",
        "run={duration: 0.12, sample: 1e-3}",
    )
    tree, joints = both("smooth.yaml", *settings)
    first, second = common(tree, joints)
    assert abs(tree.poses[-1, 0, 2]) > 0.05
    np.testing.assert_allclose(tree.poses[first], joints.poses[second], atol=2e-8)
    assert tree.checks.energy_residual < 1e-9 * tree.checks.largest_kinetic_energy


def test_a_strike_with_friction_is_the_same():
    late = "initial.angles.guide=170 deg", "run.turns=0.1"
    rubs = "contacts.strike.law.friction=0.3"
    settings = (*FEW, *late, rubs, "bodies.link.hinges.stiffness=beam")
    joints = ("accuracy.tolerance=1e-6", "solver.steps_per_contact=200")
    tree = run("no_clearance.yaml", *settings, "accuracy.tolerance=1e-8")
    other = run("no_clearance.yaml", *settings, "solver.formulation=redundant", *joints)
    first, second = common(tree, other)
    assert [event.kind for event in tree.events] == [event.kind for event in other.events]
    np.testing.assert_allclose(tree.poses[first], other.poses[second], atol=1e-5)
    lost, same = (
        sum(event.details.get("energy_lost", 0.0) for event in result.events)
        for result in (tree, other)
    )
    assert lost == pytest.approx(same, rel=2e-4)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-8])
def test_no_step_misses_that_a_struck_lever_turns_back(tolerance):
    """The force leaps there. Against the Lagrangian, for a rigid link and few steps."""
    settings = ("run.turns=0.6", "run.sample=1 ms")
    scene = load_scene(MODELS / "rigid.yaml", (*settings, "accuracy.tolerance=1e-11"))
    exact = lever_response(simulate(scene, "lagrangian"), "strike")
    found = lever_response(
        run("rigid.yaml", *settings, f"accuracy.tolerance={tolerance}"), "strike"
    )
    instants = np.round(found.time, 9), np.round(exact.time, 9)
    common, seen, same = np.intersect1d(*instants, return_indices=True)
    assert len(common) > 300
    off = np.abs(found.value[seen] - exact.value[same]).max()
    assert off * LEVER < tolerance


def test_steps_can_be_fixed_and_then_converge_with_order_nine():
    """Each step's equations are solved to rounding, which is all that is left at finer ones.

    With contacts the order is 9, also before the strike.
    """

    def at_the_end(*settings):
        soft = "bodies.link.hinges.stiffness=paper"
        return run("no_clearance.yaml", *FEW, soft, "run.turns=0.15", *settings).poses[-1]

    exact = at_the_end("accuracy.tolerance=1e-12")
    errors = [
        np.abs(at_the_end(f"accuracy.step={step}", "solver.formulation=minimal") - exact).max()
        for step in ("12e-3", "6e-3", "3e-3")
    ]
    assert errors[-1] < 1e-12
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 9, rtol=0, atol=1)


@pytest.mark.parametrize(("step", "told"), [("30 ms", True), ("3 ms", False)])
def test_a_users_step_that_misses_a_cusp_of_the_track_says_so(step, told):
    """Between two stages the guide's slide went in and out by 33 mm, and no error shows that.

    Stages beside the cusp tell 11 mm of them.
    """
    minimal = "solver.formulation=minimal"
    result = run("hard/near_cusp.yaml", f"accuracy.step={step}", minimal)
    warnings = [warning for warning in result.warnings if "is too long from" in warning]
    assert len(warnings) == told
    assert all("from 0.3 s on" in warning and "it 0.011 m" in warning for warning in warnings)


def test_a_users_step_that_an_event_cuts_short_of_a_cusp_is_not_told():
    """A ball lands before the cusp, and contact asks for steps that follow the track."""
    settings = [
        "curves.floor={type: line, from: [-1, -1], to: [1, -1]}",
        "bodies.ball={type: rigid, mass: 1, inertia: 1.0e-4}",
        "contacts.land={type: point_on_curve, point: ball.centre, curve: floor, side: left,"
        " law: {stiffness: 24674, restitution: 1}}",
        "initial={positions: {ball: [0, -0.6948]}, velocities: {ball: [0, -1]}}",
        "solver.formulation=minimal",
    ]
    exact = run("hard/near_cusp.yaml", *settings, "accuracy.tolerance=1e-9")
    found = run("hard/near_cusp.yaml", *settings, "accuracy.step=30 ms")
    np.testing.assert_allclose(found.poses[-1], exact.poses[-1], atol=1e-6)
    assert not any("is too long from" in warning for warning in found.warnings)


def test_forces_are_those_of_the_equations_at_every_sample():
    """A track's force is a tenth of the crank's: as a derivative of the steps it was 1 % off."""
    at = ("run={duration: 0.3, sample: 1 ms}",)
    loose = run("spline_track.yaml", *at, "accuracy.tolerance=1e-6")
    tight = run("spline_track.yaml", *at, "accuracy.tolerance=1e-10")
    first, second = common(loose, tight)
    found, exact = loose.slot_forces["pin"][first], tight.slot_forces["pin"][second]
    assert np.abs(found - exact).max() < 2e-4 * np.abs(exact).max()

"""Advice that leads somewhere: what no run can keep is refused, and a failure names its cause."""

import numpy as np
import pytest
from cli_runs import MODELS, NO_CLEARANCE

from exudyn_flexlink import engines
from exudyn_flexlink.cli import main
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.engines.exudyn.engine import no_solution_advice
from exudyn_flexlink.integrate.events import EVENT_TIME
from exudyn_flexlink.integrate.problem import instant
from exudyn_flexlink.loading import assemble_scene, load_scene
from exudyn_flexlink.mechanism import extent, least_tolerance
from exudyn_flexlink.source import SceneError

SMOOTH = str(MODELS / "smooth.yaml")


# --- tolerances that no run can keep ------------------------------------------------------------


def test_the_least_tolerance_is_of_the_mechanisms_size():
    """The lever's pivot is 0.138 m from the origin, the lever 0.03 m long."""
    assembly = assemble_scene(load_scene(NO_CLEARANCE))
    assert extent(assembly) == pytest.approx(0.168)
    assert least_tolerance(assembly) == 2e-13


@pytest.mark.parametrize("asked", ["1e-30", "1e-17", "1.9e-13", "1e-4 nm"])
def test_a_tolerance_below_rounding_is_refused_and_the_least_told(asked):
    with pytest.raises(SceneError) as refused:
        load_scene(NO_CLEARANCE, [f"accuracy.tolerance={asked}"])
    said = str(refused.value)
    assert said.startswith(f"--set accuracy.tolerance={asked}: accuracy.tolerance: ")
    assert "m is less than rounding allows" in said
    assert "hint: at least 2e-13 m: " in said


def test_the_least_tolerance_can_be_kept():
    """By both engines, which round in different places."""
    least = ["accuracy.tolerance=2e-13", "run.turns=0.1", "bodies.link.rods=2"]
    scene = load_scene(SMOOTH, least)
    tree, other = (simulate(scene, engine) for engine in ("exudyn", "lagrangian"))
    assert tree.outcome.completed
    assert other.outcome.completed
    assert np.abs(tree.poses[-1] - other.poses[-1]).max() < 2e-13


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (["compare", "--tolerance=1e-30"], "--tolerance: 1e-30 m is less than rounding allows"),
        (["compare", "--tolerance=3"], "--tolerance: 3 m is more than the mechanism reaches"),
        (["accuracy", "--target=1e-30"], "--target: 1e-30 m is less than rounding allows"),
        (["accuracy", "--target=1e30"], "--target: 1e+30 m is more than the mechanism reaches"),
    ],
)
def test_options_that_nothing_can_keep_are_refused(command, said, monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(engines, "simulate", None)  # before anything runs
    assert main([command[0], SMOOTH, *command[1:]]) == 2
    shown = capsys.readouterr()
    assert shown.err.startswith(said)
    assert shown.out == ""
    assert list(tmp_path.iterdir()) == []


# --- runs without a solution ----------------------------------------------------------------------


def test_a_run_so_long_that_its_steps_are_is_told_to_be_shorter():
    """The clock of a run that has come so far goes on by no less."""
    assembly = assemble_scene(load_scene(NO_CLEARANCE))
    late = 6e6
    told = no_solution_advice(assembly, 1e-6, instant(late, EVENT_TIME), late)
    assert told.startswith("shorten the run: at 6e+06 s no step below 6e-09 s is made")
    assert "lock" not in told


def test_only_a_tolerance_that_can_be_tightened_is_to_be():
    assembly = assemble_scene(load_scene(NO_CLEARANCE))
    assert no_solution_advice(assembly, 1e-6).startswith("tighten the tolerance, soften")
    near = no_solution_advice(assembly, 1e-12)
    assert near.startswith(
        "loosen the tolerance: 1e-12 m is near what rounding allows; else soften"
    )
    assert no_solution_advice(assembly, None).startswith("shorten the step, soften")


def test_what_has_no_stiffness_is_not_to_be_softened():
    law = "contacts.strike.law={type: impulse, restitution: 0.5}"
    told = no_solution_advice(assemble_scene(load_scene(NO_CLEARANCE, [law])), 1e-6)
    assert told.startswith("tighten the tolerance, give the contact a law with stiffness, or look")

"""Costs, ladders of settings and methods of a work-precision study."""

import numpy as np
import pytest
from studies import BOTH, World, scene_with

from exudyn_flexlink.accuracy import Method, Runs, methods_of
from exudyn_flexlink.accuracy.methods import ladder
from exudyn_flexlink.accuracy.runs import predict
from exudyn_flexlink.accuracy.study import Studying

# --- costs and ladders


def test_costs_follow_the_power_law_of_the_two_finest():
    """One alone grows like a second-order method; noise makes no finer run cheaper, or absurd."""
    costs = {1e-4: 1.0, 1e-5: 2.0, 1e-6: 8.0}  # fourfold per decade at the end
    assert [predict(costs, x) for x in (1e-7, 1e-8, 1e-3)] == pytest.approx([32.0, 128.0, 1.0])
    assert predict({1e-4: 1.0}, 1e-6) == pytest.approx(10.0)
    assert predict({1e-4: 1.0}, 1e-6, "step") == pytest.approx(100.0)
    assert predict({1e-4: 2.0, 1e-5: 1.0}, 1e-6) == 1.0
    assert predict({1e-4: 1e-3, 1e-5: 1.0}, 1e-6) == pytest.approx(10.0)


def test_a_ladder_reaches_from_above_the_target_to_below_it():
    """A decade above, or up to about 1e-3 m."""
    assert ladder("tolerance", 1e-6, 1e-6)[:2] == pytest.approx([1e-3, 1e-4])
    rungs = ladder("tolerance", 4e-5, 4e-5)
    np.testing.assert_allclose(rungs, [4e-4, 4e-5, 4e-6, 4e-7, 4e-8, 4e-9])
    assert ladder("tolerance", 1e-5, 1e-2)[0] == pytest.approx(1e-2)
    assert ladder("tolerance", 1e-5, 1e-10)[-1] <= 1.01e-11
    np.testing.assert_allclose(ladder("step", 1e-3, 1e-5)[:3], [10**-2.5, 1e-3, 10**-3.5])


# --- methods


def test_methods_are_engines_and_formulations_the_models_own_first():
    scene = scene_with("accuracy.tolerance=1e-5")
    found = methods_of(scene, {"exudyn": ("minimal", "redundant", "beam"), "lagrangian": ()})
    assert [m.name for m in found] == [
        "Exudyn, minimal", "Exudyn, redundant", "Exudyn, beam", "Lagrangian", "Exudyn, fixed step",
    ]  # fmt: skip
    assert [m.of_rods for m in found] == [True, True, False, True, True]
    assert found[-1].settings == {"formulation": "redundant"}
    stepped = scene.changed(accuracy={"step": 1e-4})
    assert methods_of(stepped, BOTH)[0].name == "Exudyn, fixed step"


def test_a_dear_method_begins_with_coarse_settings():
    """At 4e-5 m joints would take a quarter of the budget, at 4e-4 m a tenth, at 4e-3 m less."""

    class Dear(World):
        @staticmethod
        def cost(engine, scene):
            if scene.solver.spectral_radius == 0.8:
                return 5.0 * (scene.accuracy.tolerance / 4e-5) ** -0.5
            return World.cost(engine, scene)

    world, scene = Dear(), scene_with()
    methods = [*methods_of(scene, BOTH), Method("Dear", "exudyn", "tolerance",
                                                {"spectral_radius": 0.8})]  # fmt: skip
    made = Studying(Runs(scene, 4e-5, methods), world.solve, 20.0, world.clock).run()
    first = next(t for t in made.trials if t.method.name == "Dear")
    assert first.value == pytest.approx(4e-4)
    assert world.now < 20.0


def test_a_method_keeps_what_is_not_its_own():
    scene = scene_with("solver.steps_per_contact=50", "solver.integrator=dop853")
    tight = Method("Lagrangian", "lagrangian").at(scene, 1e-7)
    assert (tight.accuracy.tolerance, tight.solver.steps_per_contact) == (1e-7, 50)
    assert tight.solver.integrator == "dop853"
    stepped = Method("Exudyn", "exudyn", "step").at(scene, 1e-4).accuracy
    assert (stepped.step, stepped.tolerance) == (1e-4, None)

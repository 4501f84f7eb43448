"""Sweeps: plans, values, rows; the same numbers whoever runs."""

from dataclasses import replace
from math import pi
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
from results import PENDULUM, rigid_link, scene_from
from results import words as words_of

import exudyn_flexlink as fl
from exudyn_flexlink import plots
from exudyn_flexlink.report import run_text
from exudyn_flexlink.result import NOT_ASKED, MeasuredError, Outcome
from exudyn_flexlink.source import Document
from exudyn_flexlink.sweeps import (
    OneRun,
    carried_out,
    drawn,
    grid,
    in_this_process,
    listed,
    planned,
    standard_row,
    work_of,
)

LENGTH, ANGLE = "bodies.rod.length", "initial.angles.rod"


def design_of(made):
    assert made is not None
    return made


def plan_of(varied, scene=None):
    mistakes = []
    own = scene or scene_from(PENDULUM)
    return planned(own, grid(varied, (), mistakes), Document("test"), mistakes=mistakes)


def table(plan, observe, simulate=None):
    work = work_of(plan, simulate or still, observe)
    return carried_out(plan, work, in_this_process, {}, lambda *_: None)


def still(scene):
    """Closed form in place of an engine."""
    return rigid_link(samples=101)


def own_length(scene, simulate):
    return {"length_m": scene.bodies["rod"].length}


MINUS = "\N{MINUS SIGN}"
GIVEN = [
    ({LENGTH: "1:2:2", ANGLE: "0, 90 deg"}, [(1, 0), (1, pi / 2), (2, 0), (2, pi / 2)]),
    ({LENGTH: "100, 200, 300 mm"}, [(0.1,), (0.2,), (0.3,)]),
    ({ANGLE: f"{MINUS}90:90:3 deg"}, [(-pi / 2,), (0,), (pi / 2,)]),
    ({ANGLE: "0 deg:90:2deg"}, [(0,), (pi / 2,)]),
    ({ANGLE: f"{MINUS}90, {MINUS}45, 180 deg"}, [(-pi / 2,), (-pi / 4,), (pi,)]),
]


@pytest.mark.parametrize(("varied", "points"), GIVEN)
def test_every_value_with_every_other_and_the_last_varies_fastest(varied, points):
    """A unit is that of all values before it; a minus sign may be that of typeset text."""
    plan = plan_of(varied)
    assert [point.values for point in plan.points] == points
    units = {LENGTH: "m", ANGLE: "rad"}
    assert [one.column for one in plan.varied] == [f"{path}_{units[path]}" for path in varied]


def test_turns_a_minute_are_an_angular_speed_in_the_table():
    speed = "initial.speeds.rod"
    plan = plan_of({speed: "30:60:2 1/min"}, scene_from(PENDULUM + "initial: {speeds: {rod: 1}}"))
    assert [point.values[0] for point in plan.points] == pytest.approx([pi, 2 * pi])


def test_listed_points_are_as_they_are_listed():
    made = design_of(listed([{LENGTH: 1, ANGLE: "90 deg"}, {ANGLE: 0, LENGTH: 2}], (), []))
    assert made.paths == (LENGTH, ANGLE)
    assert made.points == ((1.0, "90 deg"), (2.0, 0.0))


@pytest.mark.parametrize(
    "values", ["1:-1:50", "-1:1:1500", [*range(1, 60), "-5 mm", *range(60, 120)]]
)
def test_many_values_are_checked_before_anything_runs(values):
    """All of up to 1,000, and of more as many."""
    with pytest.raises(fl.SceneError, match="must be greater than 0"):
        plan_of({LENGTH: values})


def test_scenes_have_the_values_of_their_points():
    found = table(plan_of({LENGTH: "100:300:3 mm"}), own_length)
    assert found.columns()["length_m"] == found.columns()[f"{LENGTH}_m"] == [0.1, 0.2, 0.3]


def test_a_latin_hypercube_has_one_point_in_every_part_of_a_range():
    made = design_of(drawn("latin_hypercube", {LENGTH: "1:2", ANGLE: "0:3"}, 20, (), [], seed=4))
    points = np.array(made.points, dtype=float)
    for column, (low, high) in zip(points.T, ((1, 2), (0, 3)), strict=True):
        parts = np.floor(20 * (column - low) / (high - low))
        assert sorted(parts) == list(range(20))


@pytest.mark.parametrize("kind", ["latin_hypercube", "random"])
def test_a_seed_makes_the_same_points_again_and_another_seed_others(kind):
    one, same, other = (
        design_of(drawn(kind, {LENGTH: "1:2"}, 5, (), [], seed=seed)).points for seed in (1, 1, 2)
    )
    assert one == same != other


def test_all_mistakes_come_at_once():
    with pytest.raises(fl.SceneError) as error:
        plan_of({LENGTH: [1, "2 kg", "3 mmm"], "bodies.rd.length": [1], ANGLE: "1:2", "run": []})
    told = str(error.value)
    for words in (f"{LENGTH}.1", "expected a length, got '2 kg'", "unknown unit 'mmm'",
                  "did you mean 'rod'?", "expected start:stop:count", "at least one value",
                  "5 mistakes"):  # fmt: skip
        assert words in told


def stops(scene):
    return replace(still(scene), outcome=Outcome(False, 0.25, "no convergence"))


def warns(scene):
    return replace(still(scene), warnings=("energy is created",))


@pytest.mark.parametrize(
    ("simulate", "status", "reason"),
    [
        (stops, "failed", "stopped at t = 0.25 s: no convergence"),
        (warns, "doubtful", "energy is created"),
    ],
)
def test_a_run_that_fails_or_warns_is_a_row_with_its_reason(simulate, status, reason):
    [row] = table(plan_of({LENGTH: [1]}), OneRun(standard_row), simulate).rows
    assert (row.status, row.reason) == (status, reason)
    assert bool(row.numbers) == (status == "doubtful")


def test_what_raises_is_a_failed_row_and_the_others_go_on():
    def refuses(scene, simulate):
        length = own_length(scene, simulate)["length_m"]
        if length == 2:
            raise ValueError("not two")
        return {"length_m": np.float64(length), "bound_m": -np.inf, "missing_m": np.nan}

    found = table(plan_of({LENGTH: "1:3:3"}), refuses)
    assert [row.status for row in found.rows] == ["done", "failed", "done"]
    assert found.rows[1].reason == "ValueError: not two"
    assert found.columns()["length_m"] == [1.0, None, 3.0]
    assert found.columns()["bound_m"] == [-np.inf, None, -np.inf]
    assert found.columns()["missing_m"] == [None] * 3


def test_inf_of_a_row_function_outlives_the_journal_and_is_left_out_of_figures():
    scene = fl.load_scene("pendulum", tolerance=1e-4).with_({"run.duration": 0.02})
    varied = {"gravity": "9.81, 1.62, 3.7"}
    for _ in range(2):  # which is read from the journal, once more
        table = fl.sweep(
            scene, varied, row=lambda r: {"slow_s": np.inf if r.scene.gravity[1] > -2 else 1.0},
            folder="swept", resume=True, workers=1,
        )  # fmt: skip
        assert list(table["slow_s"]) == [1.0, np.inf, 1.0]
    for line in table.plot("slow_s").axes[0].lines:
        assert not np.isinf(line.get_ydata()).any()
    assert Path("swept/table.csv").read_text().splitlines()[2].split(",")[-1] == "inf"


def lengths_within_a_pool():
    """Sweeps in a worker of a pool, which may start no processes of its own."""
    scene = fl.load_scene("pendulum", tolerance=1e-4).with_({"run.duration": 0.02})
    swept = [fl.sweep(scene, {"gravity": "9.81, 1.62"}, workers=count) for count in (None, 2)]
    return [[row.status for row in one.rows] for one in swept]


def test_a_sweep_in_a_worker_of_a_pool_runs_there():
    with get_context("spawn").Pool(1) as pool:
        found = pool.apply_async(lengths_within_a_pool).get(timeout=60)
    assert found == [["done", "done"]] * 2


def test_a_row_has_the_error_and_the_horizon_that_two_runs_tell():
    known = MeasuredError(("link.end",), limit=1e-6, largest=3e-7, horizon=0.5)
    row = fl.standard_row(replace(rigid_link(), error=known))
    assert (row["error_m"], row["horizon_s"]) == (3e-7, 0.5)
    row = fl.standard_row(replace(rigid_link(), error=NOT_ASKED))
    assert (row["error_m"], row["horizon_s"]) == (None, None)


@pytest.mark.parametrize("measure", [True, False])
def test_a_sweep_measures_unless_told_not_to(measure):
    scene = fl.load_scene("pendulum", tolerance=1e-6).with_({"run.duration": 0.05})
    table = fl.sweep(scene, {"gravity": "9.81, 1.62"}, workers=1, measure=measure)
    errors = [row.numbers["error_m"] for row in table.rows]
    assert errors == (pytest.approx([1e-7, 1e-7]) if measure else [None, None])


def test_an_empty_design_is_called_empty():
    with pytest.raises(
        fl.SceneError, match="expected a mapping of paths to values, got an empty one"
    ):
        fl.sweep(fl.load_scene("textbook/pump"), [{}])


def rounding_beside_results(scene, simulate):
    """A place, what a balance misses, a loss, and a number that is always the same."""
    length = scene.bodies["rod"].length
    return {
        "rod.end.greatest_x_m": length,
        "error_m": 1e-10 * length,
        "energy_dissipated_J": length**2,
        "energy_residual_J": 1e-12 * length,
        "end_s": 1.0,
    }


def test_the_usual_figure_shows_neither_rounding_nor_what_never_differs():
    swept = table(plan_of({LENGTH: "1:3:3"}), rounding_beside_results)
    shown = words_of(plots.sweep(swept))
    assert "greatest_x (m)" in shown
    assert "energy_dissipated (J)" in shown
    assert not [name for name in ("error", "residual", "end_s", "end (s)") if name in shown]
    assert "error (m)" in words_of(plots.sweep(swept, ["error_m"]))  # by name each is drawn


def test_nothing_lost_is_a_loss_of_zero():
    """Where a friction or a clearance is varied down to 0, its column has no hole."""
    base = rigid_link(samples=101)
    friction = {"coefficient": 0.0, "radius": 0.01}
    scene = fl.load_scene("no_clearance").with_({
        "joints.crank.friction": friction,
        "joints.sleeve.clearance": 0,
        "joints.sleeve.law": {"stiffness": 1e5, "restitution": 0.5},
    })  # fmt: skip
    row = fl.standard_row(replace(base, scene=scene))
    assert row["crank.friction_loss_J"] == row["sleeve.energy_lost_J"] == 0.0
    assert "pivot.friction_loss_J" not in row


def test_a_run_at_rest_does_not_tell_its_rounding_as_a_part_of_nothing():
    base = rigid_link(samples=101)
    still = replace(base, checks=replace(base.checks, largest_kinetic_energy=1e-36))
    assert "nothing moved with as much energy" in run_text(still)
    assert "% of the largest kinetic energy" not in run_text(still)

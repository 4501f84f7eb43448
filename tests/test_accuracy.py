"""Work-precision studies of engines made up by closed form: what is found, and in what time."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import same_color
from studies import BOTH, CONTACT, RODS, World, points_of, scene_with, studied

from exudyn_flexlink.accuracy import (
    Method,
    NothingRunError,
    Runs,
    advise,
    dominating,
    judge,
    methods_of,
)
from exudyn_flexlink.accuracy.study import NO_TIME, StudyRunner
from exudyn_flexlink.effects import idealise
from exudyn_flexlink.plots import ENGINE_COLOURS, work_precision
from exudyn_flexlink.report import accuracy_text, recommendation
from exudyn_flexlink.result import Outcome
from exudyn_flexlink.storage import save_study, staged_folder

# --- what is found


def test_errors_are_those_made_up(study):
    for point in points_of(study, "Exudyn"):
        assert point.errors.largest == pytest.approx(0.5 * point.value, rel=1e-6, abs=1e-12)
        assert point.errors.rms == pytest.approx(0.5 * point.value, rel=1e-6, abs=1e-12)
        assert point.errors.worst.startswith("link.")
        assert point.processor == pytest.approx(0.1 * (point.value / 1e-5) ** -0.5)
    assert {"link.end", "lever.end", "guide.start"} < set(study.judged_by)
    assert study.model_point.value == 4e-5


def test_what_the_references_do_not_tell_is_not_claimed(study):
    """The tight Lagrangian and the finest Exudyn run, 4e-8 or 4e-9 m, differ by its error."""
    finest = min(point.value for point in points_of(study, "Exudyn"))
    assert study.reference.label == "Lagrangian, tolerance 1e-12 m"
    assert study.independent
    assert study.floor == pytest.approx(0.5 * finest, rel=1e-4)
    for point in points_of(study, "Lagrangian"):
        assert point.below_floor == (0.1 * point.value < study.floor)
        assert point.claimed == pytest.approx(max(0.1 * point.value, study.floor), rel=1e-4)


def test_the_cheapest_setting_well_within_the_target_is_chosen(study):
    """By 4e-5 m, asked for, Exudyn is off by half: too near to the target to be advised."""
    chosen = advise(study).choice
    fit = [p for p in study.points if p.claimed <= 4e-5 / 3 and p.value <= 4e-5]
    assert chosen.processor == min(p.processor for p in fit if p.method.knob == "tolerance")
    assert chosen.label == "Exudyn, tolerance 4e-06 m"
    assert chosen.processor == pytest.approx(0.158, rel=1e-3)


def test_of_methods_that_cost_the_same_the_first_is_chosen(study):
    """Not the one whose name has the smallest hash, which is another in each process."""
    exudyn = points_of(study, "Exudyn")
    named = [replace(exudyn[0].method, name=f"Exudyn, {k}") for k in range(8)]
    twins = [replace(p, method=method) for method in named for p in exudyn]
    assert advise(replace(study, points=tuple(twins))).choice.method == named[0]


def test_luck_is_advised_only_where_no_error_control_keeps_the_target(study):
    """A cheap run at 25 times the target that happens to be exact: no reason to trust it."""
    judge_, exudyn = points_of(study, "Lagrangian")[0], points_of(study, "Exudyn")
    lucky = replace(judge_, value=1e-3, claimed=1e-9, processor=1e-3)
    assert advise(replace(study, points=(*exudyn, lucky))).choice.value == pytest.approx(4e-6)
    assert advise(replace(study, points=(lucky,))).choice is lucky


def test_sources_are_told_apart_by_their_orders(study):
    sources = {source.kind: source for source in study.sources}
    assert sources["time"].errors.largest == pytest.approx(2e-5, rel=1e-4)
    assert sources["rods"].errors.largest == pytest.approx(RODS / 4, rel=1e-6)
    assert sources["contact"].errors.rms == pytest.approx(CONTACT, rel=1e-6)
    assert not any(source.at_most for source in study.sources)
    assert dominating(study.sources).kind == "rods"


# --- time


def test_no_study_takes_longer_than_its_budget():
    world = World()
    study = studied(world, budget=4.0)
    begun = sum(World.cost(m.engine, scene_with()) for m in study.runs.methods[:2]) * 0.01
    assert world.now <= 4.0 + 3 * begun
    assert NO_TIME in study.runs.left_out.values()
    finer = [name for name in study.runs.left_out if "and what is finer" in name]
    assert finer
    assert not {name.split(", and")[0] for name in finer} & set(world.labels)
    assert {s.kind for s in study.sources} == {"time", "rods", "contact"}


# --- what can't be done


def test_without_the_lagrangian_the_finest_run_judges():
    study = studied(World(refused=("lagrangian",)))
    finest = min(p.value for p in points_of(study, "Exudyn")) / 10
    assert study.reference.label == f"Exudyn, tolerance {finest:.2g} m"
    assert not study.independent
    assert "not independent" in accuracy_text(study, "simulate it")
    assert study.runs.left_out["Lagrangian"] == "no lagrangian here"
    nearest = min(abs(p.errors.largest) for p in study.points)
    assert study.floor == pytest.approx(nearest)
    assert study.floor <= 0.5 * 10 * finest


def test_beyond_the_horizon_nothing_is_judged():
    """Errors in y grow a thousandfold every 0.1 s from 0.2 s on."""
    study = studied(World(diverging=True))
    finest = min(p.value for p in points_of(study, "Exudyn"))
    limit = study.horizon.limit
    when = 0.2 + 0.1 * np.log10(limit / (0.5 * finest)) / 3
    assert study.horizon.parted == pytest.approx(when, abs=5e-3)
    assert study.until < study.horizon.parted
    assert study.floor < 0.05 * limit
    assert "Horizon" in accuracy_text(study, "simulate it")
    assert f"to t = {study.until:.4g} s" in work_precision(study).texts[1].get_text()


@pytest.mark.parametrize("after", [0, 9])
def test_an_interrupted_study_keeps_what_was_run(after):
    world = World(stop_after=after)
    runs = Runs(scene_with(), 4e-5, methods_of(scene_with(), BOTH))
    made = StudyRunner(runs, world.solve, 60.0, world.clock).run()
    assert made.interrupted
    if len(made.trials) < 2:
        with pytest.raises(NothingRunError, match="nothing to compare"):
            judge(made)
    else:
        assert judge(made).points


def test_a_run_that_fails_is_left_out_and_told():
    world = World()
    whole = world.solve

    def solve(scene, engine, label, allowed):
        solved = whole(scene, engine, label, allowed)
        if engine == "lagrangian":
            failed = Outcome(False, 0.1, "no step is short enough")
            return replace(solved, result=replace(solved.result, outcome=failed))
        return solved

    runs = Runs(scene_with(), 4e-5, methods_of(scene_with(), BOTH))
    study = judge(StudyRunner(runs, solve, 60.0, world.clock).run())
    assert "stopped at t = 0.1 s: no step is short enough" in accuracy_text(study, "simulate it")
    assert not points_of(study, "Lagrangian")


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


# --- words


def test_the_advice_says_how_to_follow_it(study):
    lines = accuracy_text(study, "simulate it").splitlines()
    assert lines[-1] == 'That is: simulate it --set "accuracy={tolerance: 4e-06}"'

    def by(method, value, scene=study.scene):
        point = replace(points_of(study, "Exudyn")[0], method=method, value=value, claimed=0.0)
        text = accuracy_text(replace(study, scene=scene, points=(point,)), "simulate it")
        return text.splitlines()[-1].split("simulate it ")[1]

    step = Method("Exudyn, fixed step", "exudyn", "step", {"formulation": "redundant"})
    assert by(step, 1e-4) == (
        '--set "accuracy={step: 0.0001}" --set "solver={formulation: redundant}"'
    )
    redundant = Method("Exudyn, redundant", "exudyn", settings={"formulation": "redundant"})
    beam = scene_with("solver={formulation: beam, elements: 3, steps_per_contact: 80}")
    assert by(redundant, 1e-5, scene=beam) == (
        '--set "accuracy={tolerance: 1e-05}" --set "solver={formulation: redundant, '
        'steps_per_contact: 80}"'
    )
    other = Method("Lagrangian", "lagrangian")
    assert by(other, 1e-6) == ('--engine lagrangian --set "accuracy={tolerance: 1e-06}"')


def test_the_recommendation_names_setting_error_cost_and_limit(study):
    assert recommendation(study) == (
        "Recommendation: for 4e-05 m choose Exudyn, tolerance 4e-06 m (2.0e-06 m, 0.16 s); but the "
        "rods, not the steps, limit you: 5.0e-04 m, a beam to 4e-05 m takes about 50 rods; "
        "'layout: half_ends' takes fewer."
    )


def test_a_contact_that_limits_is_told():
    study = studied(scene=scene_with("bodies.link.hinges.stiffness=paper"))
    text = accuracy_text(study, "simulate it")
    assert "contact's compliance, not the steps, limits you" in text
    needed = float(text.split("some ")[1].split()[0])
    assert needed == pytest.approx(6.25, rel=0.05)  # (1e-4 / 4e-5)^2
    assert "'paper' hinges tends to no beam as rods are added; n = 4 is part of the model" in text


@pytest.mark.parametrize(
    ("without", "told"),
    [
        (["impact"], "contact compliance: none, there is no contact"),
        (["flexibility"], "number of rods: no flexible body"),
    ],
)
def test_causes_that_a_scene_lacks_are_told(study, without, told):
    scene = idealise(study.scene, without)
    kept = tuple(s for s in study.sources if s.kind == "time")
    text = accuracy_text(replace(study, scene=scene, sources=kept), "simulate it")
    assert told in text
    assert "There is only one known source of error" in text


# --- figure and files


def test_the_figure_shows_every_method_and_what_limits(study):
    figure = work_precision(study)
    (top,) = figure.axes
    assert top.get_ylabel() == "largest error of\nall 8 named points (m)"
    curves = {line.get_label(): line for line in top.lines}
    for name, engine in (("Exudyn", "exudyn"), ("Lagrangian", "lagrangian")):
        assert same_color(curves[name].get_color(), ENGINE_COLOURS[engine])
    assert curves["Exudyn"].get_linestyle() != curves["Exudyn, fixed step"].get_linestyle()
    found = points_of(study, "Exudyn")
    np.testing.assert_allclose(curves["Exudyn"].get_ydata(), [p.errors.largest for p in found])
    words = [text.get_text() for text in top.get_legend().get_texts()]
    told = {
        "target asked for, 4e-05 m",
        "below the floor",
        "error of the rods",
        "contact compliance",
        "the model's own settings",
    }
    assert told <= set(words)
    assert curves["error of the rods"].get_ydata()[0] == pytest.approx(RODS / 4)


def test_files_hold_what_was_found(study, tmp_path):
    out = tmp_path / "out"
    with staged_folder(out) as folder:
        save_study(study, folder)
    data = json.loads((out / "accuracy.json").read_text())
    assert data["dominating"] == "rods"
    assert data["floor_m"] == study.floor
    assert data["advice"]["limited_by"] == "rods"
    sources = {source["kind"]: source for source in data["sources"]}
    assert sources["rods"]["error_largest_m"] == pytest.approx(RODS / 4, rel=1e-6)
    with (out / "accuracy.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(data["points"]) == len(study.points)
    largest = study.points[0].errors.largest
    assert float(rows[0]["error_largest_m"]) == pytest.approx(largest, rel=1e-11)
    assert set(rows[0]) < set(data["points"][0])

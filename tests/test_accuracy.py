"""Work-precision studies of engines made up by closed form: every error and cost is known."""

import csv
import json
from dataclasses import replace
from math import inf, pi

import numpy as np
import pytest
from matplotlib.colors import same_color
from results import MODEL, rigid_link

from exudyn_flexlink import engines
from exudyn_flexlink.accuracy import (
    Method,
    NothingRunError,
    RefusedError,
    Runs,
    Solved,
    advise,
    dominating,
    judge,
    methods_of,
)
from exudyn_flexlink.accuracy.costs import predict
from exudyn_flexlink.accuracy.methods import ladder, own_value
from exudyn_flexlink.accuracy.sources import extrapolated, with_more_rods, with_stiffer_contacts
from exudyn_flexlink.accuracy.study import Studying
from exudyn_flexlink.effects import idealise, with_impact
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.plots import ENGINE_COLOURS, work_precision
from exudyn_flexlink.report import accuracy_text, recommendation
from exudyn_flexlink.result import Outcome
from exudyn_flexlink.storage import save_accuracy, staged_folder

BOTH = {"exudyn": (), "lagrangian": ()}
SAMPLES = 200  # intervals of a turn at 10 rad/s: those of the made-up motion
SETTINGS = [
    "run.turns=1",
    f"run.sample={2 * pi / 10 / SAMPLES}",
    "bodies.link.rods=4",
    "bodies.link.hinges.stiffness=beam",
    "accuracy.tolerance=4e-5",
]
RODS = 2e-3  # m: error of S of one rod
CONTACT = 1e-4  # m: error of S at the model's stiffness, 2e4 N/m
TIP = 0.5  # of the error of S: that of the lever's tip


def scene_with(*settings):
    return load_scene(MODEL, [*SETTINGS, *settings])


class World:
    """Engines that shift the link by known errors; their cost passes on a clock of their own."""

    def __init__(self, refused=(), stop_after=inf, diverging=False, still=False):
        self.refused, self.stop_after = refused, stop_after
        self.diverging, self.still = diverging, still
        self.now, self.labels, self.kept = 0.0, [], {}

    def clock(self):
        return self.now

    def solve(self, scene, engine, label, allowed):
        if engine in self.refused:
            raise RefusedError(f"no {engine} here")
        if len(self.labels) >= self.stop_after:
            raise KeyboardInterrupt
        self.labels.append(label)
        accuracy = scene.accuracy
        cost = self.cost(engine, accuracy) * (scene.run.duration or 0.63) / 0.63
        if cost > allowed:
            self.now += allowed
            return Solved(self.motion(scene, 0.0), allowed, cost, given_up=True)
        self.now += cost
        return Solved(self.motion(scene, self.error(engine, accuracy)), cost, cost)

    @staticmethod
    def cost(engine, accuracy):
        """Second order: time goes as error^-1/2; the Lagrangian as error^-1/10."""
        if engine == "lagrangian":
            return 0.2 * ((accuracy.relative_tolerance or accuracy.tolerance) / 1e-5) ** -0.1
        return 0.1 * ((accuracy.tolerance or 10 * accuracy.step**2) / 1e-5) ** -0.5

    @staticmethod
    def error(engine, accuracy):
        if engine == "lagrangian":
            return 0.0 if accuracy.relative_tolerance else 0.1 * accuracy.tolerance
        return 0.5 * accuracy.tolerance if accuracy.tolerance else 100 * accuracy.step**2

    def motion(self, scene, error):
        link, law = scene.bodies["link"], None
        if scene.contacts:
            law = scene.contacts["strike"].law
        rods = getattr(link, "rods", 1)
        if rods not in self.kept:
            self.kept[rods] = rigid_link(1.0, SAMPLES + 1, scene_with(f"bodies.link.rods={rods}"))
        base = self.kept[rods]
        order = 2 if getattr(link, "layout", "") == "half_ends" else 1
        off = error + RODS / rods**order + CONTACT * (getattr(law, "stiffness", 2e4) / 2e4) ** -0.5
        poses = base.poses.copy()
        if self.still:
            poses[:] = poses[0]
            return replace(base, poses=poses, rates=0 * base.rates)
        own = [i for i, name in enumerate(base.part_names) if name.startswith("link")]
        poses[:, own, 0] += off
        poses[:, base.part_names.index("lever"), 1] += TIP * off
        if self.diverging:
            poses[:, own, 1] += error * 1e3 ** np.maximum(10 * base.time - 2, 0)[:, None]
        return replace(base, poses=poses)


def studied(world=None, scene=None, target=4e-5, budget=60.0):
    world, scene = world or World(), scene or scene_with()
    runs = Runs(scene, target, methods_of(scene, BOTH))
    return judge(Studying(runs, world.solve, budget, world.clock).run())


@pytest.fixture(scope="module")
def study():
    return studied()


def points_of(study, name):
    return [point for point in study.points if point.method.name == name]


# --- costs and ladders


def test_costs_follow_the_power_law_of_the_last_two():
    costs = {1e-4: 1.0, 1e-5: 2.0, 1e-6: 8.0}  # fourfold per decade at the end
    assert predict(costs, 1e-7) == pytest.approx(32.0)
    assert predict(costs, 1e-8) == pytest.approx(128.0)
    assert predict(costs, 1e-3) == 1.0


def test_one_cost_grows_like_a_second_order_method():
    assert predict({1e-4: 1.0}, 1e-6) == pytest.approx(10.0)
    assert predict({1e-4: 1.0}, 1e-6, "step") == pytest.approx(100.0)


def test_a_noisy_cost_makes_no_finer_run_cheaper_or_absurd():
    assert predict({1e-4: 2.0, 1e-5: 1.0}, 1e-6) == 1.0
    assert predict({1e-4: 1e-3, 1e-5: 1.0}, 1e-6) == pytest.approx(10.0)
    with pytest.raises(ValueError, match="no costs"):
        predict({}, 1.0)


def test_a_ladder_reaches_from_above_the_target_to_below_it():
    """A decade above, or up to about 1e-3 m."""
    assert ladder("tolerance", 1e-6, 1e-6)[:2] == pytest.approx([1e-3, 1e-4])
    assert ladder("relative_tolerance", 1e-6, 1e-6) == pytest.approx(
        [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10]
    )
    rungs = ladder("tolerance", 4e-5, 4e-5)
    np.testing.assert_allclose(rungs, [4e-4, 4e-5, 4e-6, 4e-7, 4e-8, 4e-9])
    assert ladder("tolerance", 1e-5, 1e-2)[0] == pytest.approx(1e-2)
    assert ladder("tolerance", 1e-5, 1e-10)[-1] <= 1.01e-11
    np.testing.assert_allclose(ladder("step", 1e-3, 1e-5)[:3], [10**-2.5, 1e-3, 10**-3.5])


# --- methods


def test_methods_are_engines_and_formulations_the_models_own_first():
    scene = scene_with("accuracy.tolerance=1e-5")
    found = methods_of(scene, {"exudyn": ("tree", "joints", "beam"), "lagrangian": ()})
    assert [m.name for m in found] == [
        "Exudyn, tree", "Exudyn, joints", "Exudyn, beam", "Lagrangian", "Exudyn, fixed step",
    ]  # fmt: skip
    assert [m.of_rods for m in found] == [True, True, False, True, True]
    assert found[-1].settings == {"formulation": "joints"}
    stepped = scene.changed(accuracy={"step": 1e-4})
    assert methods_of(stepped, BOTH)[0].name == "Exudyn, fixed step"


def test_an_engine_of_local_tolerances_is_turned_by_those():
    """The Lagrangian with walls: the tolerance of the model does not reach it."""
    scene = scene_with("accuracy.tolerance=1e-5", "accuracy.relative_tolerance=1e-7")
    method = methods_of(scene, BOTH, local=["lagrangian"])[1]
    assert method.told(1e-8) == "Lagrangian, rtol 1e-08"
    accuracy = method.at(scene, 1e-8).accuracy
    assert (accuracy.tolerance, accuracy.relative_tolerance) == (1e-5, 1e-8)
    assert accuracy.absolute_tolerance == pytest.approx(1e-10)
    assert own_value(scene, method) == 1e-7
    walls = load_scene(MODEL.with_name("clearance.yaml"))
    assert not engines.takes_tolerance(walls, "lagrangian")
    assert engines.takes_tolerance(walls, "exudyn")
    assert engines.takes_tolerance(scene, "lagrangian")
    assert not engines.takes_tolerance(with_impact(scene, "impulse"), "lagrangian")


def test_a_dear_method_begins_with_coarse_settings():
    """At 4e-5 m joints would take a quarter of the budget, at 4e-4 m a tenth, at 4e-3 m less."""

    class Dear(World):
        @staticmethod
        def cost(engine, accuracy):
            if accuracy.spectral_radius == 0.8:
                return 5.0 * (accuracy.tolerance / 4e-5) ** -0.5
            return World.cost(engine, accuracy)

    world, scene = Dear(), scene_with()
    methods = [*methods_of(scene, BOTH), Method("Dear", "exudyn", "tolerance",
                                                {"spectral_radius": 0.8})]  # fmt: skip
    made = Studying(Runs(scene, 4e-5, methods), world.solve, 20.0, world.clock).run()
    first = next(t for t in made.trials if t.method.name == "Dear")
    assert first.value == pytest.approx(4e-4)
    assert world.now < 20.0


def test_the_advice_says_how_to_follow_it(study):
    lines = accuracy_text(study).splitlines()
    assert lines[-1] == "That is: simulate with --set accuracy.tolerance=4e-05"

    def by(method, value):
        point = replace(points_of(study, "Exudyn")[0], method=method, value=value, claimed=0.0)
        return accuracy_text(replace(study, points=(point,))).splitlines()[-1].split("with ")[1]

    step = Method("Exudyn, fixed step", "exudyn", "step", {"formulation": "joints"})
    assert by(step, 1e-4) == '--set "accuracy={step: 0.0001, formulation: joints}"'
    local = Method("Lagrangian", "lagrangian", "relative_tolerance")
    assert by(local, 1e-6) == (
        "--engine lagrangian --set accuracy.relative_tolerance=1e-06 "
        "--set accuracy.absolute_tolerance=1e-08"
    )


def test_a_method_keeps_what_is_not_its_own():
    scene = scene_with("accuracy.steps_per_contact=50", "accuracy.relative_tolerance=1e-6")
    tight = Method("Lagrangian", "lagrangian").at(scene, 1e-7).accuracy
    assert (tight.tolerance, tight.steps_per_contact) == (1e-7, 50)
    assert tight.relative_tolerance is None
    stepped = Method("Exudyn", "exudyn", "step").at(scene, 1e-4).accuracy
    assert (stepped.step, stepped.tolerance) == (1e-4, None)


# --- what is found


def test_errors_are_those_made_up(study):
    for point in points_of(study, "Exudyn"):
        assert point.errors.point.largest == pytest.approx(0.5 * point.value, rel=1e-6, abs=1e-12)
        assert point.errors.point.rms == pytest.approx(0.5 * point.value, rel=1e-6, abs=1e-12)
        assert point.errors.tip.largest == pytest.approx(
            TIP * 0.5 * point.value, rel=1e-5, abs=1e-12
        )
        assert point.processor == pytest.approx(0.1 * (point.value / 1e-5) ** -0.5)
    assert study.point == "link.end"
    assert study.tips == ("lever.end",)
    assert study.own.value == 4e-5


def test_what_the_references_do_not_tell_is_not_claimed(study):
    """The tight Lagrangian and the finest Exudyn run, 4e-8 or 4e-9 m, differ by its error."""
    finest = min(point.value for point in points_of(study, "Exudyn"))
    assert study.reference == "Lagrangian, tolerance 1e-12 m"
    assert study.independent
    assert study.floor == pytest.approx(0.5 * finest, rel=1e-4)
    assert study.tip_floor == pytest.approx(TIP * 0.5 * finest, rel=1e-4)
    for point in points_of(study, "Lagrangian"):
        assert point.below_floor == (0.1 * point.value < study.floor)
        assert point.claimed == pytest.approx(max(0.1 * point.value, study.floor), rel=1e-4)


def test_the_cheapest_setting_within_the_target_is_chosen(study):
    """0.2 s x 10^-0.1 of the Lagrangian at 4e-4 m: above the target of 4e-5 m by no error."""
    chosen = advise(study).choice
    fit = [p for p in study.points if p.claimed <= 4e-5]
    assert chosen.processor == min(p.processor for p in fit)
    assert chosen.told == "Exudyn, tolerance 4e-05 m"
    assert chosen.processor == pytest.approx(0.05)


def test_sources_are_told_apart_by_their_orders(study):
    sources = {source.kind: source for source in study.sources}
    assert sources["time"].errors.point.largest == pytest.approx(2e-5, rel=1e-4)
    assert sources["rods"].errors.point.largest == pytest.approx(RODS / 4, rel=1e-6)
    assert sources["rods"].errors.tip.largest == pytest.approx(TIP * RODS / 4, rel=1e-5)
    assert sources["contact"].errors.point.rms == pytest.approx(CONTACT, rel=1e-6)
    assert not any(source.at_most for source in study.sources)
    assert dominating(study.sources).kind == "rods"


def test_half_ends_are_extrapolated_at_second_order():
    study = studied(scene=scene_with("bodies.link.layout=half_ends"))
    rods = next(source for source in study.sources if source.kind == "rods")
    assert rods.errors.point.largest == pytest.approx(RODS / 16, rel=1e-6)
    assert "O(1/n^2)" in accuracy_text(study)
    assert "about 8 rods" in recommendation(study)  # 4 sqrt(1.25e-4 / 4e-5) = 7.07


def test_extrapolation():
    assert extrapolated(2, 1) == 2
    assert extrapolated(2, 2) == pytest.approx(4 / 3)
    assert extrapolated(4, 0.5) == 2


def test_a_finer_link_is_damped_like_the_link():
    """Hinges of a beam's material: stiffness and damping both go as 1 / length of a rod."""
    scene = scene_with()
    link, finer = scene.bodies["link"], with_more_rods(scene).bodies["link"]
    assert finer.rods == 8
    assert finer.hinges.damping == 2 * link.hinges.damping
    assert finer.hinges.stiffness == "beam"
    assert with_more_rods(scene_with("bodies.link.hinges.stiffness=paper")) is None
    many = scene.changed(bodies={**scene.bodies, "link": link.model_copy(update={"rods": 600})})
    assert with_more_rods(many) is None


def test_walls_are_stiffened_with_the_contacts():
    clearance = load_scene(MODEL.with_name("clearance.yaml"))
    stiffer = with_stiffer_contacts(clearance)
    assert stiffer.joints["sleeve"].law.stiffness == 4 * clearance.joints["sleeve"].law.stiffness
    assert stiffer.contacts["strike"].law.stiffness == 4 * 2e4
    assert with_stiffer_contacts(with_impact(scene_with(), "impulse")) is None


# --- time


def test_no_run_is_started_that_would_exceed_the_budget():
    world = World()
    study = studied(world, budget=4.0)
    assert world.now <= 4.0
    assert study.runs.left_out
    assert not any("given up" in name for name in study.runs.left_out)
    started = {label.removesuffix(", again") for label in world.labels}
    assert not any(name.split(" (")[0] in started for name in study.runs.left_out)
    assert {s.kind for s in study.sources} == {"time", "rods", "contact"}


def test_short_runs_are_repeated(study):
    assert all(point.repeats == 3 for point in study.points if point.processor < 0.3)


def test_a_run_that_takes_too_long_gives_way_to_coarser_ones():
    """At 4e-5 m the run takes 0.05 s: with 0.04 s there is time for 4e-4 and 4e-3 m at most."""
    world = World(refused=("lagrangian",))
    runs = Runs(scene_with(), 4e-5, methods_of(scene_with(), BOTH))
    made = Studying(runs, world.solve, 0.05, world.clock).run()
    assert all(trial.value > 4e-5 for trial in made.trials)
    assert "4e-05" in made.left_out[0]


# --- what can't be done


def test_without_the_lagrangian_the_finest_run_judges():
    study = studied(World(refused=("lagrangian",)))
    finest = min(p.value for p in points_of(study, "Exudyn")) / 10
    assert study.reference == f"Exudyn, tolerance {finest:.2g} m"
    assert not study.independent
    assert "not independent" in accuracy_text(study)
    assert study.runs.refused == {"Lagrangian": "no lagrangian here"}
    nearest = min(abs(p.errors.point.largest) for p in study.points)
    assert study.floor == pytest.approx(nearest)
    assert study.floor <= 0.5 * 10 * finest


def test_the_own_settings_may_be_the_finest_run_of_all():
    """Of 0.2 s, 0.05 s go to 4e-5 m and 0.016 s to 4e-4 m, but 4e-6 m would take 0.16 s."""
    world = World(refused=("lagrangian",))
    study = studied(world, budget=0.2)
    assert study.own is None
    time = next(source for source in study.sources if source.kind == "time")
    assert time.at_most
    assert time.errors.point.largest == pytest.approx(0.5 * (4e-4 - 4e-5), rel=1e-4)
    assert "<~" in accuracy_text(study)


def test_another_formulation_is_independent():
    scene, world = scene_with(), World()
    methods = [Method("A", "exudyn"), Method("B", "exudyn", settings={"spectral_radius": 0.8})]
    study = judge(Studying(Runs(scene, 4e-5, methods), world.solve, 20.0, world.clock).run())
    assert study.independent


def test_beyond_the_horizon_nothing_is_judged():
    """Errors in y grow a thousandfold every 0.1 s from 0.2 s on."""
    study = studied(World(diverging=True))
    finest = min(p.value for p in points_of(study, "Exudyn"))
    limit = study.horizon.limit
    when = 0.2 + 0.1 * np.log10(limit / (0.5 * finest)) / 3
    assert study.horizon.parted == pytest.approx(when, abs=5e-3)
    assert study.until < study.horizon.parted
    assert study.floor < 0.05 * limit
    assert "Horizon" in accuracy_text(study)
    assert f"to t = {study.until:.4g} s" in work_precision(study).texts[1].get_text()


@pytest.mark.parametrize("after", [0, 4, 9, 30])
def test_an_interrupted_study_keeps_what_was_run(after):
    world = World(stop_after=after)
    runs = Runs(scene_with(), 4e-5, methods_of(scene_with(), BOTH))
    made = Studying(runs, world.solve, 60.0, world.clock).run()
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
    study = judge(Studying(runs, solve, 60.0, world.clock).run())
    assert "stopped at t = 0.1 s: no step is short enough" in accuracy_text(study)
    assert not points_of(study, "Lagrangian")


# --- words


def test_the_recommendation_names_setting_error_cost_and_limit(study):
    assert recommendation(study) == (
        "Recommendation: for 4e-05 m choose Exudyn, tolerance 4e-05 m (2.0e-05 m, 0.05 s); but the "
        "rods, not the steps, limit you: 5.0e-04 m, a beam to 4e-05 m takes about 50 rods; "
        "'layout: half_ends' takes fewer."
    )


def test_a_contact_that_limits_is_told():
    study = studied(scene=scene_with("bodies.link.hinges.stiffness=paper"))
    text = accuracy_text(study)
    assert "contact's compliance, not the steps, limits you" in text
    needed = float(text.split("some ")[1].split()[0])
    assert needed == pytest.approx(1.25e5, rel=0.05)  # 2e4 (1e-4 / 4e-5)^2
    assert "'paper' hinges tends to no beam as rods are added; n = 4 is part of the model" in text


def test_what_nothing_limits_is_told_without_but():
    assert "but" not in recommendation(studied(target=1e-3))
    assert "but the rods" in recommendation(studied(target=3e-4))


def test_a_target_out_of_reach_is_told(study):
    assert "the references agree to" in recommendation(replace(study, target=1e-12))
    exudyn = tuple(points_of(study, "Exudyn"))
    coarse = replace(study, target=1e-6, points=exudyn[:2])
    assert "no setting tried is accurate enough; the best is Exudyn" in recommendation(coarse)


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
    text = accuracy_text(replace(study, scene=scene, sources=kept))
    assert told in text
    assert "There is only one known source of error" in text


def test_impulses_have_no_compliance(study):
    kept = tuple(s for s in study.sources if s.kind != "contact")
    text = accuracy_text(replace(study, scene=with_impact(study.scene, "impulse"), sources=kept))
    assert "contact compliance: none, strike by impulses" in text
    assert "The number of rods dominates: 25 times the error of the time steps" in text


def test_nothing_moves():
    study = studied(World(still=True))
    assert study.still
    assert "nothing moves, so that any setting will do" in accuracy_text(study)
    work_precision(study)


def test_a_beam_is_told_as_another_model():
    scene, world = scene_with(), World()
    methods = [Method("Exudyn, joints", "exudyn"),
               Method("Exudyn, beam", "exudyn", settings={"spectral_radius": 0.8},
                      of_rods=False)]  # fmt: skip
    study = judge(Studying(Runs(scene, 4e-5, methods), world.solve, 20.0, world.clock).run())
    assert "Exudyn, beam: another model of the link" in accuracy_text(study)
    assert advise(study).choice.method.name == "Exudyn, joints"
    assert not study.independent


# --- figure and files


def test_the_figure_shows_every_method_and_what_limits(study):
    figure = work_precision(study)
    top, bottom = figure.axes
    assert top.get_ylabel() == "largest error of link.end (m)"
    assert bottom.get_ylabel() == "largest error of lever.end (m)"
    assert bottom.get_xlabel() == "processor time of the solve (s)"
    assert {axes.get_xscale() for axes in figure.axes} == {"log"}
    assert {axes.get_yscale() for axes in figure.axes} == {"log"}
    curves = {line.get_label(): line for line in top.lines}
    for name, engine in (("Exudyn", "exudyn"), ("Lagrangian", "lagrangian")):
        assert same_color(curves[name].get_color(), ENGINE_COLOURS[engine])
    assert curves["Exudyn"].get_linestyle() != curves["Exudyn, fixed step"].get_linestyle()
    found = points_of(study, "Exudyn")
    np.testing.assert_allclose(curves["Exudyn"].get_xdata(), [p.processor for p in found])
    np.testing.assert_allclose(
        curves["Exudyn"].get_ydata(), [p.errors.point.largest for p in found]
    )
    words = [text.get_text() for text in top.get_legend().get_texts()]
    assert {"target 4e-05 m", "below the floor", "error of the rods", "contact compliance",
            "the model's own settings"} <= set(words)  # fmt: skip
    assert curves["error of the rods"].get_ydata()[0] == pytest.approx(RODS / 4)


def test_files_hold_what_was_found(study, tmp_path):
    save_accuracy(study, "choose this", tmp_path)
    data = json.loads((tmp_path / "accuracy.json").read_text())
    assert data["program"] == "exudyn-flexlink"
    assert data["recommendation"] == "choose this"
    assert data["dominating"] == "rods"
    assert data["floor_m"] == study.floor
    assert data["target_m"] == 4e-5
    assert data["advice"]["choice"]["value"] == 4e-5
    assert data["advice"]["limited_by"] == "rods"
    sources = {source["kind"]: source for source in data["sources"]}
    assert sources["rods"]["error_largest_m"] == pytest.approx(RODS / 4, rel=1e-6)
    with (tmp_path / "accuracy.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(data["points"]) == len(study.points)
    assert float(rows[0]["error_largest_m"]) == study.points[0].errors.point.largest
    assert set(rows[0]) < set(data["points"][0])
    with staged_folder(tmp_path) as folder:  # a study may replace a study
        (folder / "new").touch()
    assert [file.name for file in tmp_path.iterdir()] == ["new"]

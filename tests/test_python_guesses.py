"""What a user of Python guesses: bodies, joints, instants, tables, axes, scenes, joined runs."""

import math
from dataclasses import replace
from inspect import signature
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
import results
from matplotlib.colors import to_hex
from pages_of_docs import BLOCK, DOCS, text_of

import exudyn_flexlink as fl
from exudyn_flexlink.api.results import api_result
from exudyn_flexlink.result import ForceDeviation, ForceSpread, MeasuredError

FIRST_HOUR = DOCS / "first_hour.md"
FREE, TOUCHING, HORIZON = 0.25, 0.5, 2.0  # N, N, s


@pytest.fixture(scope="module")
def run():
    """The paper's run with a rigid link, of which errors of one force are told up to 2 s."""
    spreads = [ForceSpread(largest, 0.1, 0.1, 1.0) for largest in (FREE, TOUCHING)]
    forces = {"joint force of crank": ForceDeviation("N", *spreads)}
    error = MeasuredError(points=("link.end",), largest=1e-7, horizon=HORIZON, forces=forces)
    return api_result(replace(results.rigid_link(), error=error))


# --- what moves and what acts ----------------------------------------------------------------


def test_a_body_turns_as_its_drive_does(run):
    guide = run.body("guide")
    np.testing.assert_allclose(guide.angle, results.SPEED * run.time, atol=1e-12)
    np.testing.assert_allclose(guide.rate, results.SPEED, rtol=1e-9)
    np.testing.assert_array_equal(guide.position, np.tile(results.CRANK, (len(run.time), 1)))
    assert np.abs(guide.velocity).max() < 1e-12
    assert "guide: to 2.5133 s" in repr(guide)


def test_a_force_in_a_joint_has_its_error_over_time(run):
    crank = run.joint("crank")
    np.testing.assert_array_equal(crank.force, run.joint_forces["crank"])
    np.testing.assert_array_equal(crank.torque, run.drive_torques["motor"])
    touches, known = run.touches("strike"), run.time < HORIZON
    pressed = np.any([(t.begin <= run.time) & (run.time <= t.end) for t in touches], axis=0)
    assert (crank.error[known & ~pressed] == FREE).all()
    assert (crank.error[known & pressed] == TOUCHING).all()
    assert pressed[known].any()
    assert np.isinf(crank.error[~known]).all()
    assert np.isnan(crank.torque_error).all()  # nothing was measured of it
    pin = run.joint("pin")
    np.testing.assert_array_equal(pin.force, run.slot_forces["pin"])
    assert (pin.torque, pin.torque_error) == (None, None)


def test_a_path_is_known_between_samples_and_within_the_run_alone(run):
    s, time = run.path("link.end"), np.linspace(0.3, 2.4, 7)
    exact = results.exact_s(run.scene, time)
    np.testing.assert_allclose(s.at(time), exact, atol=2e-6)  # rates are central differences
    np.testing.assert_array_equal(s.at(time[2]), s.at(time)[2])
    np.testing.assert_array_equal(s.at(list(run.time[:3])), s.position[:3])
    for beyond in (-0.1, 2.6, [0.1, math.nan]):
        with pytest.raises(ValueError, match=r"the run goes from 0 to 2\.51327412 s"):
            s.at(beyond)


@pytest.mark.parametrize(
    ("ask", "told"),
    [
        (lambda run: run.body("gide"), "no body 'gide'; did you mean 'guide'.*: guide, link, lev"),
        (lambda run: run.joint("crnk"), "no joint 'crnk'; did you mean 'crank'.*: crank, sleeve"),
        (lambda run: run.joint("sleeve"), "no force of 'sleeve' is kept; of: crank, pin, pivot"),
        (lambda run: run.continued(turns=1, duration=1), "'turns' and 'duration' exclude"),
        (lambda run: run.plot.lever(label="a"), "give both"),
        (lambda run: fl.joined(run, run), "it starts anew, the first ends at 2.51"),
    ],
)
def test_what_can_not_be_had_is_told_with_what_can(run, ask, told):
    with pytest.raises(ValueError, match=told):
        ask(run)


# --- tables ----------------------------------------------------------------------------------


def test_a_table_of_everything(run):
    pytest.importorskip("pandas")
    table = run.to_dataframe()
    for column, values in {
        "t_s": run.time,
        "guide.angle_rad": run.body("guide").angle,
        "guide.rate_rad_per_s": run.body("guide").rate,
        "link.end.x_m": run.path("link.end").position[:, 0],
        "lever.response.tip_displacement_m": run.lever("lever").tip_displacement,
        "crank.joint_force_y_N": run.joint("crank").force[:, 1],
        "pin.slot_force_x_N": run.joint("pin").force[:, 0],
        "motor.drive_torque_N_m": run.drive_torques["motor"],
        "strike.contact_force_N": run.contacts["strike"].force,
        "energy.residual_J": run.energy.residual,
    }.items():
        np.testing.assert_array_equal(table[column], values)
    assert np.isfinite(table).all(axis=None)


def test_forces_are_in_a_file_of_a_saved_run(run, tilting):
    pandas = pytest.importorskip("pandas")
    folder = run.save("runs/a")
    table = pandas.read_csv(folder / "forces.csv")
    assert set(table) <= set(run.to_dataframe())
    assert list(table)[:3] == ["t_s", "crank_angle_rad", "motor.drive_torque_N_m"]
    np.testing.assert_allclose(table["crank.joint_force_x_N"], run.joint("crank").force[:, 0])
    walls = api_result(tilting).to_dataframe()
    both = walls["sleeve.upper_wall_force_N"] + walls["sleeve.lower_wall_force_N"]
    np.testing.assert_allclose(both, tilting.sleeves["sleeve"].force.sum(axis=1))


def test_a_contact_by_impulses_has_no_column_of_forces(run):
    strike = replace(run.contacts["strike"].touches, peak_force=np.full(4, np.inf))
    history = replace(run.contacts["strike"], touches=strike, force=0 * run.time)
    hit = replace(run, contacts={"strike": history})
    pytest.importorskip("pandas")
    assert "strike.contact_force_N" not in hit.to_dataframe()


def test_a_column_of_a_sweep():
    scene = api_result(results.pendulum()).scene
    table = fl.sweep(scene, {"run.duration": [0.01, 0.02]}, "lagrangian", workers=1, measure=False)
    np.testing.assert_array_equal(table["run.duration_s"], [0.01, 0.02])
    assert list(table["status"]) == table.columns()["status"]
    with pytest.raises(KeyError, match=r"did you mean 'run\.duration_s'"):
        table["run.duraton_s"]


# --- figures ---------------------------------------------------------------------------------

PANELS = {"coordinates": 1, "lever": 2, "mechanism": 5, "energy": 2, "forces": 6, "bending": 1}


@pytest.mark.parametrize("name", PANELS)
def test_figures_draw_into_axes_that_are_given(run, name):
    draw = getattr(run.plot, name)
    assert {"ax", "style"} <= set(signature(draw).parameters)
    assert "Draw" in draw.__doc__
    own = draw().axes
    figure, rows = plt.subplots(PANELS[name], 1, squeeze=False)
    assert draw(ax=rows) is figure
    for axes, usual in zip(figure.axes, own, strict=False):
        lines, others = ([to_hex(li.get_color()) for li in ax.lines] for ax in (axes, usual))
        assert lines == others
        assert usual.get_ylabel() in {axes.get_ylabel(), ""}  # of a grid the left ones alone
    one = plt.figure().add_subplot()
    draw(ax=one)
    assert len(one.lines) == len(own[0].lines)
    if PANELS[name] > 1:
        with pytest.raises(ValueError, match=f"3 axes are given; .* or {PANELS[name]} for all: "):
            draw(ax=plt.figure().subplots(3))
    plt.close("all")


def test_two_runs_in_one_figure(run):
    short = api_result(results.stopped(results.rigid_link(turns=2.0)))
    figure, axes = plt.subplots()
    run.plot.lever(ax=axes, label="long")
    short.plot.lever(ax=axes, label="short")
    curves = {line.get_label(): line for line in axes.lines}
    assert [curves[name].get_linestyle() for name in ("long", "short")] == ["-", "--"]
    assert {"long", "short"} <= {text.get_text() for text in axes.get_legend().get_texts()}
    assert axes.get_xlim()[1] == pytest.approx(run.time[-1])  # the longer one is seen whole
    assert "short: stopped at t = 0.5 s" in results.words(figure)
    plt.close("all")


def test_polar_axes_are_asked_for(run):
    figure, axes = plt.subplots(subplot_kw={"projection": "polar"})
    assert run.plot.polar(ax=axes) is figure
    with pytest.raises(ValueError, match="'projection': 'polar'"):
        run.plot.polar(ax=plt.figure().add_subplot())
    with pytest.raises(TypeError, match=r"expected axes of matplotlib.*'left'"):
        run.plot.energy(ax="left")
    plt.close("all")


# --- scenes ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", fl.model_names())
def test_a_scene_comes_back_from_its_dict_and_from_its_file(name):
    scene = fl.load_scene(name)
    assert fl.load_scene(scene.to_dict()) == scene
    Path("model.yaml").write_text(scene.to_yaml(), encoding="utf-8")
    assert fl.load_scene("model.yaml") == scene


def test_a_scene_is_given_back_and_changed():
    scene = fl.load_scene("no_clearance")
    assert fl.load_scene(scene) is scene
    assert fl.load_scene(scene, turns=2) == scene.with_({"run.turns": 2})
    assert fl.load_scene(scene, ["run.turns=2"]) == scene.with_({"run.turns": 2})


def test_what_there_is_is_listed(run):
    for found, some in (
        (run.scene, {"bodies", "run", "with_", "to_yaml"}),
        (run, {"time", "poses", "error", "events", "body", "joint", "plot", "save"}),
    ):
        names = dir(found)
        assert some <= set(names)
        assert not [name for name in names if name.startswith(("_", "model_", "from_"))]
        for name in names:
            assert getattr(found, name) is not None


# --- a run that goes on ----------------------------------------------------------------------


def test_a_run_and_its_continuation_are_as_one_run():
    """A lap and a bit in one go, and in two runs; errors are known up to where they join."""
    settings = {"bodies.link.rods": 2, "accuracy.tolerance": 1e-6, "run.turns": 1.2}
    scene = fl.load_scene("no_clearance", settings)
    whole = fl.simulate(scene, "lagrangian", measure=False)
    first = fl.simulate(scene.with_({"run.turns": 0.65}), "lagrangian")
    second = fl.simulate(first.continued(turns=0.55), "lagrangian", measure=False)
    both = fl.joined(first, second)
    time = np.linspace(0, whole.time[-1], 50)
    apart = both.path("link.end").at(time) - whole.path("link.end").at(time)
    assert np.linalg.norm(apart, axis=1).max() < 2e-6  # of which each keeps a micrometre
    assert both.outcome.completed
    assert both.outcome.time == pytest.approx(whole.outcome.time, rel=1e-9)
    assert both.scene.run.turns == pytest.approx(1.2, rel=1e-9)
    assert [lap.time for lap in both.laps] == pytest.approx([lap.time for lap in whole.laps])
    for name in ("kinetic", "stored", "dissipated", "supplied"):
        ends = (getattr(of.energy, name)[-1] for of in (both, whole))
        assert next(ends) == pytest.approx(next(ends), abs=1e-7)
    assert both.lever("lever").farthest == pytest.approx(whole.lever("lever").farthest, abs=1e-4)
    assert len(both.touches("strike")) == len(whole.touches("strike"))
    missed = [np.abs(of.energy.residual).max() for of in (both, first, second)]
    assert missed[0] <= sum(missed[1:])
    assert both.checks.steps == first.checks.steps + second.checks.steps
    assert both.error == replace(first.error, stopped=first.time[-1])
    error, later = both.joint("crank").error, both.time >= first.time[-1]
    assert np.isinf(error[later]).all()
    assert np.isfinite(error[~later]).all()
    again = fl.load(both.save("runs/both"))
    np.testing.assert_array_equal(again.poses, both.poses)
    assert again.scene == both.scene
    for one, other, told in (
        (first, replace(second, engine="exudyn"), "one is by lagrangian, the other by exu"),
        (second, first, "it starts anew"),
        (results.first_samples(first, 99), second, r"it begins at 0\.4084.* s, the first"),
        (first, replace(second, scene=softer(second.scene)), "they differ in springs"),
    ):
        with pytest.raises(ValueError, match=told):
            fl.joined(one, other)


def softer(scene):
    return scene.with_({"springs.lever_return.frequency": 39})


# --- the page of the first hour ----------------------------------------------------------------


def measure(file, ratio):
    """Write what the page's scene gives with another damping, with noise of 0.1 mrad."""
    scene = fl.load_scene("no_clearance", turns=1).with_({"bodies.link.rods": 3})
    scene = scene.with_({"drives.motor.value": 11, "springs.lever_return.damping_ratio": ratio})
    lever = fl.simulate(scene, measure=False).body("lever")
    noise = np.random.default_rng(1).normal(0, 1e-4, len(lever.time))
    rows = np.column_stack([lever.time, lever.angle + noise])
    np.savetxt(file, rows, delimiter=",", header="t,theta", comments="")


def test_the_first_hour_runs_as_its_page_says(capsys, tmp_path, monkeypatch):
    """Its model is run for 0.6 turns, up to which the link strikes, to a coarser tolerance."""
    monkeypatch.chdir(tmp_path)
    whole = fl.load_scene

    def shorter(model, *changes, **more):
        more |= {"turns": 0.6, "tolerance": 1e-5} if "turns" in more else {}
        return whole(model, *changes, **more)

    monkeypatch.setattr(fl, "load_scene", shorter)
    measure("measured.csv", 0.07)
    scope = {}
    with plt.rc_context({"backend": "agg"}):
        for found in BLOCK.finditer(text_of(FIRST_HOUR)):
            exec(compile(found["text"], FIRST_HOUR.name, "exec"), scope)
    plt.close("all")
    assert scope["whole"].outcome.completed
    turned = scope["whole"].body("guide").angle[-1] - scope["whole"].body("guide").angle[0]
    assert turned == pytest.approx(1.6 * 2 * math.pi, abs=1e-6)  # the second run is a whole turn
    assert len(scope["rows"]["run"]) == 8
    assert " s: " in capsys.readouterr().out  # of a strike
    [ratio], [error] = scope["fit"].values.values(), scope["fit"].standard_errors.values()
    assert abs(ratio - 0.07) < 4 * error < 0.01


def test_each_task_of_the_first_hour_is_short():
    parts = text_of(FIRST_HOUR).split("\n## ")[1:]
    found = [BLOCK.findall(part) for part in parts]
    assert len(found) == 15
    assert all(len(blocks) in {1, 2} for blocks in found)
    assert all(len(text.splitlines()) <= 5 for blocks in found for _, text in blocks)

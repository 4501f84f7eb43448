"""The package as Python sees it: its docstring, its names, scenes and results with methods."""

import doctest
import pkgutil
import runpy
import signal
import sys
from html import unescape
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
import results
from cli_runs import MODELS, ROOT

import exudyn_flexlink as fl
from exudyn_flexlink import engines, observables
from exudyn_flexlink.api.results import api_result
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.plots import FIGURES, drawing, motion

EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


RUNS = [
    ("exudyn", {"solver.formulation": "minimal"}),
    ("exudyn", {"solver.formulation": "redundant"}),
    ("lagrangian", {}),
]


@pytest.fixture(scope="module")
def run():
    return api_result(results.rigid_link())


@pytest.fixture(scope="module")
def tilting():
    return api_result(results.tilting_link())


# --- the package ------------------------------------------------------------------------------


def test_the_docstring_is_what_happens():
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    found = doctest.testmod(fl, optionflags=flags)
    assert found.attempted > 15
    assert found.failed == 0


def test_every_name_is_there_and_told():
    assert dir(fl) == sorted(fl.__all__)
    modules = {module.name for module in pkgutil.iter_modules(fl.__path__)}
    for name in fl.__all__:
        assert getattr(fl, name) is not None
        assert name not in modules  # importing one sets it as an attribute of its package
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        fl.simulat  # noqa: B018


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda file: file.stem)
def test_examples_run(example, monkeypatch, capsys):
    """Links have 2 rods for 10, and all figures are two: the same is done in less time."""
    whole = fl.load_scene

    def smaller(*asked, **more):
        scene = whole(*asked, **more)
        small = {"bodies.link.rods": 2, "accuracy.tolerance": 1e-5}
        if scene.run.turns is not None:
            small["run.turns"] = 0.6
        rods = getattr(scene.bodies.get("link"), "rods", 0)
        return scene.with_(small) if rods > 2 else scene

    monkeypatch.setattr(fl, "load_scene", smaller)
    for name in set(FIGURES) - {"coordinates", "energy"}:
        monkeypatch.delitem(FIGURES, name)
    with mpl.rc_context({"backend": "agg"}):
        runpy.run_path(str(example))
    assert capsys.readouterr().out or list(Path().glob("*.pdf"))


# --- scenes -----------------------------------------------------------------------------------


def test_a_name_a_path_and_a_dict_are_one_scene():
    named = fl.load_scene("no_clearance")
    file = MODELS / "no_clearance.yaml"
    assert named == fl.load_scene(file) == fl.load_scene(str(file)) == load_scene(file)
    assert fl.load_scene(named.to_data()) == named
    assert isinstance(named, fl.Scene)
    assert fl.load_scene("whitworth") == fl.load_scene("textbook/whitworth")
    assert "textbook/whitworth" in fl.model_names()


def test_a_file_wins_over_a_name():
    Path("no_clearance").write_text(results.PENDULUM, encoding="utf-8")
    assert fl.load_scene("no_clearance").title == "pendulum"


def test_settings_by_keyword_are_those_of_the_command_line():
    found = fl.load_scene("no_clearance", tolerance=1e-7, turns=2, formulation="redundant")
    texts = ["accuracy.tolerance=1e-7", "run.turns=2", "solver.formulation=redundant"]
    assert found == load_scene(MODELS / "no_clearance.yaml", texts)
    assert fl.load_scene("no_clearance", texts) == found


def test_changes_are_those_of_the_command_line():
    scene = fl.load_scene("no_clearance")
    for changes, text in (
        ({"joints.crank.at": np.array([0.021, 0])}, "joints.crank.at=[0.021, 0]"),
        ({"run": {"duration": 0.5}}, "run={duration: 0.5}"),
        ({"bodies.link.rods": np.int64(4)}, "bodies.link.rods=4"),
        ({"accuracy.step": np.float64(1e-4)}, "accuracy.step=1e-4"),
    ):
        assert scene.with_(changes) == load_scene(MODELS / "no_clearance.yaml", [text])
    assert scene == fl.load_scene("no_clearance")


def test_changes_follow_changes_and_effects():
    scene = fl.load_scene("clearance", turns=1)
    rigid = fl.idealise(scene, without=["flexibility"]).with_({"run.turns": 2})
    assert (rigid.run.turns, rigid.bodies["link"].type) == (2, "rod")
    assert fl.idealise(scene, "clearance").joints["sleeve"].clearance == 0
    assert scene.with_({"run.turns": 3}).with_({"bodies.link.rods": 2}).run.turns == 3
    points = fl.load_scene("spline_track").with_({"run.turns": 1})  # which a file gives
    assert fl.idealise(points, "flexibility").with_({"run.turns": 2}).curves == points.curves


def test_none_takes_a_key_away():
    scene = fl.load_scene("rigid", {"initial.guesses": {"lever": 0.1}, "run.sample": "1 ms"})
    plain = scene.with_({"initial.guesses": None, "run.sample": None})
    assert plain == fl.load_scene("rigid")
    assert scene.with_({"initial.guesses.lever": None}).initial.guesses == {}
    assert not scene.with_({"drives.motor": None, "run.at_most": 1}).drives
    # A duration that is not given excludes no turns.
    assert scene.with_({"run.duration": None}).run.turns == scene.run.turns
    with pytest.raises(fl.SceneError, match="missing 'curve'"):
        scene.with_({"joints.pin.curve": None})
    with pytest.raises(fl.SceneError, match="unknown key 'smaple'"):
        scene.with_({"run.smaple": None})


def test_mistakes_have_their_hints():
    scene = fl.load_scene("no_clearance")
    for known in (scene, fl.idealise(scene, "flexibility")):
        with pytest.raises(fl.SceneError, match="did you mean 'sleeve'"):
            known.with_({"joints.sleve.clearance": "2 mm"})
    with pytest.raises(fl.SceneError, match="expected a length"):
        scene.with_({"bodies.link.length": "2 N"})
    with pytest.raises(fl.SceneError, match="did you mean 'no_clearance'"):
        fl.load_scene("no_clearence")
    with pytest.raises(fl.SceneError, match=r"nowhere\.yaml"):
        fl.load_scene("nowhere.yaml")
    with pytest.raises(TypeError, match="did you mean 'tolerance'"):
        fl.load_scene("no_clearance", tolerence=1)
    with pytest.raises(TypeError, match="a model can't hold"):
        scene.with_({"run.turns": object()})


@pytest.mark.parametrize(
    "call",
    [
        fl.simulate,
        lambda given: fl.idealise(given, "impact"),
        lambda given: fl.sweep(given, {"run.turns": [1, 2]}, workers=1),
        fl.stability_of,
    ],
    ids=["simulate", "idealise", "sweep", "stability_of"],
)
def test_a_path_is_no_scene(call):
    for given, told in (
        (Path("yoke.yaml"), r"a Scene; load_scene\('yoke\.yaml'\) makes one"),
        ({"title": "a"}, r"scene: expected a Scene, got a dict of 1; load_scene"),
        (None, r"a Scene, got None$"),
    ):
        with pytest.raises(TypeError, match=told):
            call(given)


# --- results ----------------------------------------------------------------------------------


def test_observables_are_methods(run, tilting):
    np.testing.assert_array_equal(
        run.path("link.end").position, observables.path(run, "link.end").position
    )
    assert run.strikes("strike") == observables.strikes(run, "strike")
    assert run.lever("lever").farthest == observables.lever_response(run, "strike").farthest
    for touches, known in (
        (run.touches("strike"), run.contacts["strike"].touches),
        (tilting.touches("sleeve"), tilting.sleeves["sleeve"].touches),
    ):
        assert all(getattr(touches, name) is values for name, values in vars(known).items())


def test_what_there_is_none_of_is_told_with_what_there_is(run):
    for ask, name in ((run.path, "link.middle"), (run.strikes, "bump")):
        with pytest.raises(ValueError, match=name):
            ask(name)
    with pytest.raises(ValueError, match="no contact or joint with clearance 'bump'"):
        run.touches("bump")
    with pytest.raises(ValueError, match="body: there is no struck body 'bump'; there are: lever"):
        run.lever("bump")
    with pytest.raises(ValueError, match=r"there are: lever, .*link\.end"):
        run.to_dataframe("bump")
    with pytest.raises(AttributeError, match="There are: coordinates"):
        run.plot.cordinates  # noqa: B018


def test_things_tell_themselves_in_a_line_and_in_a_notebook(run):
    same = fl.compare(run, run, names=("rigid", "flexible"))
    stopped = api_result(results.stopped(results.pendulum()))
    for found, told in (
        (run, "completed at 2.51327 s, 1601 samples, 1 warning"),
        (stopped, "stopped: no convergence at the smallest step at 0.5 s"),
        (run.path("link.end"), "<PointPath of link.end: to "),
        (run.lever("lever"), "rad at"),
        (same, "of rigid and flexible: all 8 named points apart by 0 m at most>"),
        (fl.load_scene("no_clearance", turns=2), "2 turns of crank"),
    ):
        assert told in repr(found)
        assert "\n" not in repr(found)
    page = unescape(run._repr_html_())
    assert "Strikes of contact 'strike'" in page
    assert "warning: made up" in page
    for shown in (page, same._repr_html_()):
        assert "data:image/png;base64," in shown
    assert "<li>bodies guide, link, lever</li>" in run.scene._repr_html_()


def test_figures_by_name(run, tilting, monkeypatch):
    for module in (drawing, motion):  # its layout is of no matter here
        monkeypatch.setattr(module, "settle", lambda _: None)
    drawn = run.plot.all()
    assert set(drawn) < {*FIGURES, "all"} == set(dir(run.plot))
    figure = run.plot.coordinates()
    assert figure._repr_png_().startswith(b"\x89PNG")
    figure.savefig("s.pdf")
    assert Path("s.pdf").read_bytes().startswith(b"%PDF")
    assert tilting.plot.guide_contact() is not None
    narrow = run.plot.coordinates(style="print").get_figwidth()
    assert narrow < 0.5 * figure.get_figwidth()
    with pytest.raises(ValueError, match="style: there is no style 'prnt'; did you mean 'print'"):
        run.plot.coordinates(style="prnt")
    with pytest.raises(ValueError, match="nothing to show in the figure 'guide_contact'"):
        run.plot.guide_contact()


def test_a_saved_run_comes_back(run):
    folder = run.save("runs/a")
    again = fl.load(folder)
    assert isinstance(again, fl.Result)
    assert isinstance(again.scene, fl.Scene)
    assert again.strikes("strike") == run.strikes("strike")
    assert run.save("runs/a") == folder
    with pytest.raises(fl.StorageError):
        fl.load("nowhere")


def test_tables_are_those_of_the_saved_run(run, tilting, monkeypatch):
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    found = run.to_xarray()
    np.testing.assert_array_equal(found["poses.angle"].sel(part="lever"), run.poses[:, -1, 2])
    assert found["contacts.strike.force"].attrs["units"] == "N"
    path = run.to_dataframe("link.end")
    assert list(path)[:4] == ["t_s", "crank_angle_rad", "x_m", "y_m"]
    np.testing.assert_array_equal(path["x_m"], run.path("link.end").position[:, 0])
    assert len(run.to_dataframe("lever")) == len(run.time)
    assert len(run.to_dataframe("strike")) == 4
    touches = tilting.to_dataframe("sleeve")
    assert list(touches["impulse_N_s"]) == list(tilting.touches("sleeve").impulse)
    for name, ask in (("pandas", lambda: run.to_dataframe("lever")), ("xarray", run.to_xarray)):
        monkeypatch.setitem(sys.modules, name, None)
        with pytest.raises(ImportError, match=rf"pip install {name}.*exudyn-flexlink\[tables\]"):
            ask()


def test_even_rows_hold_what_is_between_samples_and_give_a_spectrum_without_a_shift():
    """A mass on a spring, at 5 Hz, beside a pendulum whose touches have samples of their own."""
    scene = fl.load_scene(
        "textbook/pendulum_on_stop",
        {
            "bodies.mass": {"type": "rigid", "mass": 1, "points": {"c": [0, 0]}, "inertia": 1},
            "joints.rail": {
                "type": "prismatic", "points": ["ground", "mass.c"], "at": [3, 0], "axis": [1, 0],
            },
            "springs.coil": {
                "type": "linear", "joint": "rail", "stiffness": (10 * np.pi) ** 2, "length": 0,
            },
            "initial.along": {"rail": 0.1},
            "run": {"duration": 4},
        },
    )  # fmt: skip
    run = fl.simulate(scene, measure=False)
    assert np.ptp(np.diff(run.time)) > 1e-4
    table = run.to_dataframe(every="1 ms")
    time, place = table["t_s"].to_numpy(), table["mass.c.x_m"].to_numpy() - 3
    np.testing.assert_allclose(time, 1e-3 * np.arange(4001), rtol=1e-12)
    np.testing.assert_allclose(place, 0.1 * np.cos(10 * np.pi * time), atol=2e-4)
    np.testing.assert_array_equal(place + 3, run.path("mass.c").at(time)[:, 0])
    power = np.abs(np.fft.rfft(place[:-1]))
    assert np.fft.rfftfreq(4000, 1e-3)[power.argmax()] == 5.0
    with pytest.raises(ValueError, match="every: must be greater than 0"):
        run.to_dataframe(every=0)


# --- signals ----------------------------------------------------------------------------------


@pytest.mark.parametrize(("engine", "settings"), RUNS)
def test_ctrl_c_in_python_gives_what_was_computed(engine, settings):
    """Also out of Exudyn's own solver, through which nothing may be raised; by no handler."""
    long = {"run": {"duration": 400}, "bodies.link.rods": 3}
    scene = fl.load_scene("smooth", tolerance=1e-5).with_({**long, **settings})
    before, seen = signal.getsignal(signal.SIGINT), []

    def press(_):
        seen.append(signal.getsignal(signal.SIGINT))
        signal.raise_signal(signal.SIGINT)

    result = fl.simulate(scene, engine, press)
    assert {*seen, signal.getsignal(signal.SIGINT)} == {before}
    assert result.outcome.reason == "interrupted"
    assert 0 < result.outcome.time < 400
    assert result.time[-1] == pytest.approx(result.outcome.time)
    assert result.error.missing == "the run stopped before its end"


def test_ctrl_c_in_the_second_run_keeps_the_first(monkeypatch):
    monkeypatch.setattr("exudyn_flexlink.integrate.solve.SECONDS_BETWEEN_REPORTS", 0.0)
    scene, pressed = fl.load_scene("smooth", turns=0.2).with_({"bodies.link.rods": 3}), []

    def press(done):
        if engines.FIRST < done < 1 and not pressed:
            pressed.append(done)
            signal.raise_signal(signal.SIGINT)

    result = fl.simulate(scene, progress=press)
    assert pressed
    assert result.outcome.completed
    assert any("second run" in warning for warning in result.warnings)


def test_ctrl_c_at_the_end_keeps_the_run():
    scene = fl.load_scene("smooth", turns=0.01).with_({"bodies.link.rods": 2})
    press = lambda done: done == 1 and signal.raise_signal(signal.SIGINT)  # noqa: E731
    assert fl.simulate(scene, progress=press).outcome.completed


def test_what_progress_raises_is_raised():
    scene = fl.load_scene("smooth", tolerance=1e-5).with_({"run": {"duration": 400}})
    with pytest.raises(LookupError):
        fl.simulate(scene, progress=lambda _: {}[0])


def test_ctrl_c_in_a_sweep_gives_the_rows_that_are_finished():
    scene = fl.load_scene("no_clearance", turns=0.01, tolerance=1e-4)
    table = fl.sweep(
        scene,
        {"drives.motor.value": [8.0, 9.0, 10.0]},
        progress=lambda _: signal.raise_signal(signal.SIGINT),
        workers=1,
    )
    assert (len(table.rows), table.whole) == (1, False)
    assert "interrupted, 1 of 3 rows" in repr(table)

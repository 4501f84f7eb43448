"""Results can't be changed, taken for another, or lost on their way."""

import importlib
import inspect
import multiprocessing
import pickle
import pkgutil
import re
import signal
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
import results
from folders import posix

import exudyn_flexlink as fl
from exudyn_flexlink.api.scenes import api_scene
from exudyn_flexlink.loading import scene_of
from exudyn_flexlink.source import parse_document
from exudyn_flexlink.storage import StorageError, staged_folder
from exudyn_flexlink.storage.replacing import KINDS


@pytest.fixture(scope="module")
def run():
    return fl.simulate(fl.load_scene("no_clearance", turns=1.2, tolerance=1e-6), measure=False)


# --- files ------------------------------------------------------------------------------------


@pytest.mark.parametrize(("there", "new"), list(permutations(KINDS, 2)))
def test_a_result_of_one_kind_never_replaces_one_of_another(there, new, tmp_path):
    def write(document):
        with staged_folder(tmp_path / "o", force=True) as folder:
            (folder / document).write_text('{"title": "t", "completed": true}')
            (folder / "table.csv").write_text("1")

    write(there)
    before = {file.name: file.read_bytes() for file in (tmp_path / "o").iterdir()}
    with pytest.raises(StorageError, match=f"holds a {KINDS[there]} of 't', which a {KINDS[new]}"):
        write(new)
    assert {file.name: file.read_bytes() for file in (tmp_path / "o").iterdir()} == before
    write(there)  # one of its own kind does


# --- numbers ----------------------------------------------------------------------------------


def test_what_a_run_gave_is_read_only(run, tmp_path):
    run.save(tmp_path / "o")
    for result in (run, fl.load(tmp_path / "o"), pickle.loads(pickle.dumps(run))):
        t = result.time
        with pytest.raises(ValueError, match="read-only"):
            t *= 1e3
        with pytest.raises(ValueError, match="read-only"):
            result.poses[:] = 0
        with pytest.raises(ValueError, match="read-only"):
            result.contacts["strike"].touches.begin[:] = 0


def test_nothing_is_told_beyond_a_run(run):
    lever = run.lever("lever")
    assert lever.at(run.time[-1]).value == pytest.approx(lever.value[-1])
    for beyond in (5.0, -0.1, np.nan):
        with pytest.raises(ValueError, match="the run goes from 0 to"):
            lever.at(beyond)


@pytest.mark.parametrize("at", [np.inf, np.nan, 99.0, -1.0])
def test_a_run_goes_on_from_no_instant_outside_of_it(run, at):
    with pytest.raises(ValueError, match=r"is not in it|^at: (expected|must be)"):
        run.continued(at)


def test_a_run_and_what_goes_on_from_it_are_compared_by_one_clock(run):
    scene = run.continued(0.2).with_({"run.turns": None, "run.duration": 0.05})
    later = fl.simulate(scene, measure=False)
    found = fl.compare(run, later)
    assert found.time[0] == pytest.approx(0.2)
    assert found.deviation.largest < 1e-6
    assert fl.compare(later, run).deviation.largest < 1e-6


def test_runs_of_two_scenes_are_not_compared_as_one(run):
    other = fl.simulate(
        run.scene.with_({"drives.motor.value": 20, "run.turns": 0.1}), measure=False
    )
    with pytest.raises(ValueError, match=r"drives\.motor\.value is 10\.0 and 20\.0; give 'names'"):
        fl.compare(run, other)
    assert fl.compare(run, other, names=("slow", "fast")).deviation.largest > 0.01
    finer = fl.simulate(
        run.scene.with_({"accuracy.tolerance": 1e-8, "run.turns": 0.1}), measure=False
    )
    assert fl.compare(run, finer).deviation.largest < 1e-6


def test_a_lever_that_starts_bent_counts_from_the_rest_of_its_spring(run):
    k = int(np.searchsorted(run.time, 0.36))
    while True:
        try:
            scene = run.continued(run.time[k])
            break
        except ValueError:
            k += 1
    scene = scene.with_({"run.turns": None, "run.duration": 0.05})
    whole, part = run.lever("lever"), fl.simulate(scene, measure=False).lever("lever")
    assert abs(whole.value[k]) > 1e-3
    assert part.value[0] == pytest.approx(whole.value[k], abs=1e-9)
    assert part.tip_displacement[0] == pytest.approx(whole.tip_displacement[k], abs=1e-9)
    at = part.time + run.time[k]
    assert np.abs(part.value - whole.at(at).value).max() < 1e-4


RAIL = """
title: a rod and a slider
materials: {steel: {density: 7850, youngs_modulus: 200 GPa}}
bodies:
  rod: {type: rod, length: 0.4, material: steel, section: {width: 20 mm, thickness: 5 mm}}
  slider: {type: rigid, mass: 1, inertia: 0.1, points: {p: [0, 0]}}
joints:
  pivot: {type: revolute, points: [ground, rod.start], at: [0, 0]}
  rail: {type: prismatic, points: [ground, slider.p], at: [0.5, 0], axis: [1, 0]}
run: {duration: 1, sample: 0.1}
accuracy: {tolerance: 1.0e-4}
"""


@pytest.mark.parametrize(
    ("joint", "kind", "values", "jump"),
    [
        ("pivot", "speed", (4, 4.1), "sets 4.1 rad/s where the run .* had 4 rad/s"),
        ("pivot", "motion", ("0.5*sin(3*t)", "0.4*sin(3*t)"), "sets 0.398998 rad where"),
        ("pivot", "motion", ("t**2", "t - 0.25"), None),
        ("pivot", "speed", ("3*t", "1.5*sin(pi*t)"), None),
        ("rail", "speed", ("0.1*t", "0.2*t"), "sets 0.1 m/s where the run .* had 0.05 m/s"),
        ("rail", "motion", ("0.1*t", "0.1*t + 0.01"), "sets 0.06 m where the run .* had 0.05 m"),
    ],
)
def test_drives_that_jump_are_told_and_others_are_not(joint, kind, values, jump):
    """At 0.5 s, in place or speed; a drive that meets the one before may take its place."""
    drive = f"drives: {{own: {{type: {kind}, joint: {joint}, value: {values[0]}}}}}"
    document = parse_document(RAIL + drive, "rail.yaml")
    scene = api_scene(scene_of(document))
    begun = fl.simulate(scene, measure=False).continued(0.5).with_({"run": {"duration": 0.01}})
    assert not [told for told in fl.simulate(begun, measure=False).warnings if "jumps" in told]
    again = fl.simulate(begun.with_({"drives.own.value": values[1]}), measure=False)
    told = [warning for warning in again.warnings if "it jumps as it begins" in warning]
    if jump is None:
        assert not told
    else:
        assert re.search(jump, "\n".join(told))


def test_a_run_that_goes_on_with_other_geometry_says_what_that_moves():
    """The rod turns about another place: its centre, where it was, is 12 mm too far left."""
    document = parse_document(RAIL + "initial: {speeds: {rod: 2}}", "rail.yaml")
    run = fl.simulate(api_scene(scene_of(document)), measure=False)
    begun = run.continued(0.5)
    begun = begun.with_({"run": {"duration": 0.01}})
    assert not fl.simulate(begun, measure=False).warnings
    other = begun.with_({"joints.pivot.at": ["12 mm", 0]})
    (note,) = fl.simulate(other, measure=False).warnings
    assert note.startswith("initial.states: joints are not where the run that this one goes on")
    moved = float(re.search(r"rod is moved by (\S+) m as it begins", note)[1])
    assert 0.005 < moved <= 0.0121


@pytest.mark.parametrize("text", ["no # 3", "~", "1e3", " 2 ", "[1, 2]", "'a'", "a\tb", "a\x85b"])
def test_a_text_from_python_is_that_text(text, tmp_path):
    """Whatever YAML would make of it: of a dict of sections, in a sweep, and once it was saved."""
    known = fl.load_scene("textbook/friction_wheels", {"run.duration": 0.01})
    scene = known.with_({"title": text})
    assert fl.load_scene(scene.to_data()).title == text
    given = {"title": [text, "b"]}
    row = lambda run: {"is": run.scene.title}  # noqa: E731
    table = fl.sweep(known, given, workers=1, row=row, measure=False)
    assert table.columns()["is"] == [text, "b"]
    assert fl.load(fl.simulate(scene, measure=False).save(tmp_path / "run")).scene == scene


def test_what_no_model_can_hold_is_refused():
    """Else a run that is saved could not be loaded."""
    with pytest.raises(fl.SceneError, match="a text with a control character"):
        fl.load_scene("smooth").with_({"title": "a\x00b"})


def test_two_paths_of_a_sweep_to_one_value_are_refused():
    """Each point would show both values, and run one of them."""
    varied = {"run.duration": [0.01, 0.02], "run": [{"duration": 0.03}]}
    for found in (varied, dict(reversed(varied.items()))):
        with pytest.raises(fl.SceneError, match="is varied twice with"):
            fl.sweep(fl.load_scene("textbook/friction_wheels"), found, workers=1)


# --- exceptions -------------------------------------------------------------------------------

GIVEN = {
    "Document": lambda: fl.load_scene("smooth").document,
    "Iterable[Mistake]": list,
    "Result": results.pendulum,
    "StorageError": lambda: StorageError("told", forcible=True),
    "Path": lambda: Path("o"),
    "tuple[str, ...]": lambda: ("joints", "pin"),
    "float": lambda: 1.5,
    "int | None": lambda: 1,
    "tuple[float, float] | None": lambda: (1.0, 2.0),
    "bool": lambda: True,
}


def exceptions():
    found = set()
    for module in pkgutil.walk_packages(fl.__path__, "exudyn_flexlink."):
        if not module.name.endswith("__main__"):
            members = vars(importlib.import_module(module.name)).values()
            found |= {
                own
                for own in members
                if inspect.isclass(own)
                and issubclass(own, BaseException)
                and own.__module__.startswith("exudyn_flexlink")
                and not own.__name__.startswith("_")
            }
    return sorted(found, key=lambda own: own.__qualname__)


@pytest.mark.parametrize("kind", exceptions(), ids=lambda own: own.__name__)
def test_every_exception_survives_being_sent(kind):
    positional, named = [], {}
    for name, own in list(inspect.signature(kind.__init__).parameters.items())[1:]:
        value = GIVEN.get(str(own.annotation), lambda: "text")()
        if own.kind is own.KEYWORD_ONLY:
            named[name] = value
        elif own.kind is not own.VAR_KEYWORD:
            positional.append(value)
    error = kind(*positional, **named)
    back = pickle.loads(pickle.dumps(error))
    assert type(back) is kind
    assert str(back) == str(error)
    assert vars(back).keys() == vars(error).keys()


def test_a_scene_that_an_engine_refuses_does_not_hang_a_pool():
    scene = fl.load_scene("textbook/slider_crank", tolerance=1e-5)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        asked = pool.starmap_async(fl.simulate, [(scene, "lagrangian")])
        with pytest.raises(fl.NotRepresentableError):
            asked.get(timeout=60)


class MineError(Exception):
    """Of a handler of the user's."""


@posix
@pytest.mark.parametrize("formulation", ["redundant", "minimal"])
def test_what_a_signals_handler_raises_comes_out(formulation):
    def handler(*_):
        raise MineError

    scene = fl.load_scene("no_clearance", tolerance=1e-8, turns=40, formulation=formulation)
    before = signal.signal(signal.SIGALRM, handler)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.5)
        with pytest.raises(MineError):
            fl.simulate(scene, measure=False)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)

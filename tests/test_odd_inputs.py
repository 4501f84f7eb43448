"""What functions for Python take, how they refuse the rest, and that no message is another's."""

import re
import subprocess
import sys

import numpy as np
import pint
import pytest
import results
from cli_runs import ROOT

import exudyn_flexlink as fl
from exudyn_flexlink.api.results import api_result

NAN = float("nan")
UNITS = pint.UnitRegistry()


@pytest.fixture(scope="module")
def run():
    return api_result(results.rigid_link())


@pytest.fixture(scope="module")
def scene():
    return fl.load_scene("rigid", turns=0.02, tolerance=1e-4)


def test_odd_inputs_are_answered_or_refused():
    script = [sys.executable, ROOT / "scripts" / "odd_inputs.py", "--count", "80", "--seed", "3"]
    made = subprocess.run(script, capture_output=True, text=True, check=False)
    assert made.returncode == 0, made.stdout + made.stderr
    answered, refused, *wrong = map(int, re.findall(r"\d+", made.stdout.splitlines()[-1]))
    assert (answered + refused, wrong) == (80, [0, 0, 0])


@pytest.mark.parametrize(
    ("call", "kind", "told"),
    [
        (lambda s, r: fl.simulate(s, measure=1), TypeError, "measure: expected True or False"),
        (lambda s, r: fl.simulate(s, "exodyn"), ValueError, "engine: .* did you mean 'exudyn'"),
        (lambda s, r: fl.simulate(s, progress=3), TypeError, "progress: expected a function"),
        (lambda s, r: fl.compare(r, s), TypeError, "second: expected a Result, a CSV file, or"),
        (lambda s, r: r.continued(at=NAN), ValueError, "at: .* in seconds, .* got nan"),
        (lambda s, r: r.continued(at="3 kg"), ValueError, "at: expected a time, got '3 kg'"),
        (lambda s, r: r.continued(at=UNITS("3 kg")), ValueError, "at: expected a time"),
        (lambda s, r: r.continued(at=-1), ValueError, "at: must be 0 or greater, got -1"),
        (lambda s, r: r.save("\0"), ValueError, "folder: expected a path"),
        (lambda s, r: r.path(["a"]), TypeError, "point: expected a text, got a list of 1"),
        (lambda s, r: r.animate(width=2.5), ValueError, "width: expected a whole number"),
        (lambda s, r: r.plot.mechanism([9.9]), ValueError, "instants: expected instants from 0 to"),
        (lambda s, r: r.plot.polar(ax=3), TypeError, "ax: expected axes of matplotlib"),
        (lambda s, r: r.sample_at(np.zeros(3)), TypeError, "time: .* got an array of shape"),
        (lambda s, r: fl.sweep(s, {"run.turns": ""}), fl.SceneError, "needs at least one value"),
        (lambda s, r: fl.stability_of(s, laps=True), TypeError, "laps: expected a whole number"),
        (lambda s, r: fl.load_scene(s, turns="x"), fl.SceneError, "^turns: expected a number"),
        (lambda s, r: fl.load_scene(s, "run.turns=2"), TypeError, "changes: expected a dict, or"),
        (lambda s, r: fl.load_scene("rigid", ["run.turns=x"]), fl.SceneError, "^run.turns: expec"),
        (lambda s, r: s.with_({"drives.motor.value": "5 m"}), fl.SceneError, "^drives.motor.value"),
        (lambda s, r: s.with_({"run.turns": {1, 2}}), TypeError, "run.turns: a model can't hold"),
        (lambda s, r: s.with_({"run": [10**5000]}), TypeError, "run: a model can't hold"),
        (lambda s, r: fl.Scene(title="a"), TypeError, r"title; load_scene\(..\) makes scenes"),
    ],
)  # fmt: skip
def test_messages_name_the_argument(call, kind, told, scene, run):
    with pytest.raises(kind, match=told) as refused:
        call(scene, run)
    assert type(refused.value) is kind


def test_units_of_measured_columns_count(run):
    """A table in other units is the same table; a mass is no angle."""
    body = run.body("lever")
    time, angle = UNITS.Quantity(body.time * 1e3, "ms"), UNITS.Quantity(body.angle, "rad")
    for theta in (angle.to("deg"), list(angle)):
        found = fl.compare(run, {"t": time, "theta": theta}, columns={"theta": "lever.angle"})
        assert found.distances[0].largest < 1e-12
        assert len(found.time) == len(body.time)
    with pytest.raises(fl.SceneError, match="'kg' is no unit of an angle"):
        fl.compare(run, {"t": time, "lever.angle": body.angle * UNITS.kg})
    for wrong in ([1 * UNITS.s, 2.0], [1 * UNITS.s, 2 * UNITS.kg]):
        with pytest.raises(TypeError, match="second: expected"):
            fl.compare(run, {"t": wrong, "lever.angle": [0.0, 0.0]})


def test_all_mistakes_are_told_at_once(scene):
    with pytest.raises(TypeError, match=r"engine: .*\nmeasure: "):
        fl.simulate(scene, "nix", measure=None)
    with pytest.raises(TypeError, match=r"missing 1 required positional argument: 'scene'"):
        fl.simulate()


def test_numbers_come_as_they_are_at_hand(scene, run):
    at = run.sample_at(0.5)
    for time in (np.float32(0.5), np.array([0.5]), np.array(0.5), UNITS("500 ms"), "500 ms"):
        assert run.sample_at(time) == at
    rpm = {"drives.motor.value": UNITS("60 rpm")}
    assert scene.with_(rpm).drives["motor"].value == pytest.approx(2 * np.pi)
    assert fl.load_scene(scene, tolerance=UNITS("1 mm")).accuracy.tolerance == 1e-3
    path = run.path("link.end")
    own = path.at([500, 700] * UNITS.ms)
    np.testing.assert_allclose(own, path.at([0.5, 0.7]), rtol=1e-12)


def test_a_scene_is_given_back(scene):
    assert fl.load_scene(scene) is scene
    assert fl.load_scene(scene, turns=2).run.turns == 2


def test_errors_that_are_documented_are_exported():
    own = [thing for name in fl.__all__ if callable(thing := getattr(fl, name))]
    methods = [own for one in own if isinstance(one, type) for own in vars(one).values()]
    texts = "\n".join(str(one.__doc__) for one in [*own, *methods])
    for name in set(re.findall(r"^ +(\w+Error): ", texts, re.MULTILINE)):
        assert hasattr(fl, name) or name in dir(__builtins__) or name in __builtins__, name


def test_progress_ends_at_one(scene, run):
    for call in (
        lambda told: fl.simulate(scene, progress=told),
        lambda told: fl.sweep(scene, {"run.turns": [0.01]}, progress=told, workers=1),
        lambda told: fl.bifurcation(scene, "drives.motor.value", [9.0], progress=told, laps=1,
                                    after=0, workers=1),
        lambda told: run.animate("a.html", progress=told),
    ):  # fmt: skip
        seen = []
        call(seen.append)
        assert seen[-1] == 1
        assert seen == sorted(seen)

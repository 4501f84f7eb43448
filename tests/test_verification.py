"""Benchmarks against published numbers: files of numbers, what is computed, the command."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from cli_runs import code_of

from exudyn_flexlink.cli import main
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.observables import strongest_line
from exudyn_flexlink.shipped import benchmark_files
from exudyn_flexlink.source import SceneError
from exudyn_flexlink.verification import judged, read_benchmark

PENDULUM = """\
title: Pendulum
bodies:
  bob:
    {type: rigid, mass: 1, inertia: 0, centre_of_mass: [1, 0],
     points: {pivot: [0, 0], end: [1, 0]}}
joints:
  pivot: {type: revolute, points: [ground, bob.pivot], at: [0, 0]}
initial: {angles: {bob: 0}, speeds: {bob: 2}}
run: {duration: 1, sample: 10 ms}
accuracy: {tolerance: 1.0e-9}
"""
NUMBERS = """\
source: "closed form: it turns evenly"
runs:
  turning:
    numbers:
      x: {type: position, point: bob.end, axis: x, at: 0.5, value: 0.5403023058681398, allowed: 1.0e-8, because: tolerance}
      still: {type: position, point: bob.end, axis: x, seen_from: bob, value: 1, allowed: 1.0e-8, because: tolerance}
      fast: {type: velocity, point: bob.end, axis: y, at: 0.5, value: 1.0806046117362795, allowed: 1.0e-7, because: tolerance}
      angle: {type: angle, body: bob, value: 2, allowed_part: 1.0e-9, because: tolerance}
      speed: {type: angular_speed, body: bob, value: 2, allowed: 1.0e-8, because: tolerance}
      drift: {type: energy_drift, value: 0, allowed: 1.0e-9, because: nothing damps it}
"""  # noqa: E501


@pytest.fixture
def files(tmp_path):
    """Return a file of published numbers, beside its model."""
    (tmp_path / "own.yaml").write_text(PENDULUM, encoding="utf-8")
    file = tmp_path / "own.published.yaml"
    file.write_text(NUMBERS, encoding="utf-8")
    return file


def cheaper(run):
    """The four-bar up to 0.6 s, at the coarsest tolerance (m) that its clearance allows.

    The largest differences are those that the strikes at 0.52 and 0.53 s leave there; then the pins
    roll and slide as before. Touches, not the tolerance, make its steps as short as they are: at
    1e-5 m differences are the same.
    """
    accuracy = run.scene.accuracy.model_copy(update={"tolerance": 5e-4})
    duration = run.scene.run.model_copy(update={"duration": 0.6})
    numbers = {name: number for name, number in run.numbers.items() if number.at <= 0.6}
    return replace(run, scene=run.scene.changed(accuracy=accuracy, run=duration), numbers=numbers)


CHEAPER = {"four_bar_clearance": cheaper}


def verified(file):
    benchmark = read_benchmark(file)
    runs = [CHEAPER.get(benchmark.name, lambda run: run)(run) for run in benchmark.runs]
    return [judged(benchmark, one, simulate(one.scene, one.engine, measure=False)) for one in runs]


@pytest.mark.parametrize("name", sorted(set(benchmark_files()) - {"cantilever"}))
def test_benchmarks_are_as_near_as_allowed(name):
    runs = verified(benchmark_files()[name])
    numbers = [(run.run, number) for run in runs for number in run.numbers]
    assert numbers
    assert [named for named in numbers if not named[1].fine] == []


def test_frequencies_of_a_cantilever_of_rods_are_of_order_two():
    benchmark = read_benchmark(benchmark_files()["cantilever"])
    errors = []
    for rods, one in zip((4, 8, 16), benchmark.runs[1:4], strict=True):
        scene = one.scene.changed(run=one.scene.run.model_copy(update={"duration": 16}))
        found = judged(benchmark, one, simulate(scene, measure=False))
        assert found.fine
        assert one.scene.bodies["beam"].rods == rods
        errors.append([abs(n.difference) for n in found.numbers])
    orders = np.log2(np.array(errors)[:-1] / np.array(errors)[1:])
    assert np.all(np.abs(orders[1] - 2) < 0.25)
    assert np.all(orders > 1.6)


def test_quantities_of_an_even_turn(files):
    (found,) = verified(files)
    assert found.fine, found
    assert [n.unit for n in found.numbers] == ["m", "m", "m/s", "rad", "rad/s", "J"]


def test_a_number_that_is_off_costs_the_exit_code(files, capsys):
    files.write_text(NUMBERS.replace("body: bob, value: 2, allowed_part", "body: bob, value: 2.1, "
                                     "allowed_part"), encoding="utf-8")  # fmt: skip
    assert main(["verify", str(files), "--quiet"]) == 1
    told = capsys.readouterr().out
    assert "OFF" in told
    assert "6 numbers: 1 is off" in told
    assert "allowed because: tolerance" in told
    assert "closed form: it turns evenly" in told


@pytest.mark.parametrize(("allowances", "fine"), [(0.9, True), (1.1, False), (3, False)])
def test_a_number_is_off_by_more_than_is_allowed(allowances, fine, files):
    """It is told by the value that is published: the run itself is right to 1e-9 m."""
    value = 0.5403023058681398 + allowances * 1e-5
    text = NUMBERS.replace("value: 0.5403023058681398, allowed: 1.0e-8",
                           f"value: {value!r}, allowed: 1.0e-5")  # fmt: skip
    files.write_text(text, encoding="utf-8")
    (found,) = verified(files)
    assert found.numbers[0].fine == found.fine == fine
    assert found.numbers[0].difference == pytest.approx(allowances * 1e-5, abs=1e-8)


MISTAKES = {
    "value: 2, allowed_part: 1.0e-9": ("value: 2", "needs 'allowed' or 'allowed_part'"),
    "axis: x, at: 0.5": ("axis: z, at: 0.5", "must be one of x, y"),
    "point: bob.end, axis: x, at": ("point: bob.ende, axis: x, at", "no point 'bob.ende'; did you"),
    "type: angle,": ("type: angel,", "did you mean 'angle'?"),
    "body: bob, value: 2, allowed:": ("body: bib, value: 2, allowed:", "no body 'bib'; did you"),
    "at: 0.5, value: 0.54": ("at: 0.505, value: 0.54", "no sample at 0.505 s"),
    "    numbers:": ("    engin: exudyn\n    numbers:", "unknown key 'engin'; did you mean"),
}


@pytest.mark.parametrize("right", MISTAKES)
def test_a_mistake_is_shown_where_it_stands(files, right, capsys):
    wrong, message = MISTAKES[right]
    assert NUMBERS.count(right) == 1
    files.write_text(NUMBERS.replace(right, wrong), encoding="utf-8")
    assert main(["verify", str(files), "--quiet"]) == 2
    told = capsys.readouterr().err
    assert message in told
    assert told.startswith(f"{files}:")
    assert "^" in told


def test_all_mistakes_are_shown_at_once(files):
    text = NUMBERS.replace("axis: x, at", "axis: z, at").replace("type: angle,", "type: angel,")
    files.write_text(text, encoding="utf-8")
    with pytest.raises(SceneError) as caught:
        read_benchmark(files)
    assert len(caught.value.mistakes) == 2


def test_an_unknown_benchmark_is_named(capsys):
    assert code_of("verify", "pendulem") == 2
    assert "did you mean 'pendulum'?" in capsys.readouterr().err


def test_a_line_is_found_beside_a_stronger_one():
    time = np.linspace(0, 40, 8001)
    signal = 3 + np.cos(3.516 * time) + 1e-3 * np.sin(22.03 * time + pi / 5)
    assert strongest_line(time, signal, 2, 5) == pytest.approx(3.516, rel=1e-6)
    assert strongest_line(time, signal, 15, 28) == pytest.approx(22.03, rel=1e-6)

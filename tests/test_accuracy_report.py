"""What a work-precision study is told in: words, a figure, files."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import same_color
from studies import RODS, points_of, scene_with, studied

from exudyn_flexlink.accuracy import Method
from exudyn_flexlink.effects import idealise
from exudyn_flexlink.plots import ENGINE_COLOURS, work_precision
from exudyn_flexlink.report import accuracy_text, recommendation
from exudyn_flexlink.storage import save_accuracy, staged_folder

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
    assert needed == pytest.approx(1.25e5, rel=0.05)  # 2e4 (1e-4 / 4e-5)^2
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
    assert top.get_xlabel() == "processor time of the solve (s)"
    assert {axes.get_xscale() for axes in figure.axes} == {"log"}
    assert {axes.get_yscale() for axes in figure.axes} == {"log"}
    curves = {line.get_label(): line for line in top.lines}
    for name, engine in (("Exudyn", "exudyn"), ("Lagrangian", "lagrangian")):
        assert same_color(curves[name].get_color(), ENGINE_COLOURS[engine])
    assert curves["Exudyn"].get_linestyle() != curves["Exudyn, fixed step"].get_linestyle()
    found = points_of(study, "Exudyn")
    np.testing.assert_allclose(curves["Exudyn"].get_xdata(), [p.processor for p in found])
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
        save_accuracy(study, "choose this", folder)
    data = json.loads((out / "accuracy.json").read_text())
    assert data["program"] == "exudyn-flexlink"
    assert data["recommendation"] == "choose this"
    assert data["dominating"] == "rods"
    assert data["floor_m"] == study.floor
    assert data["target_m"] == 4e-5
    assert data["advice"]["choice"]["value"] == pytest.approx(4e-6)
    assert data["advice"]["limited_by"] == "rods"
    sources = {source["kind"]: source for source in data["sources"]}
    assert sources["rods"]["error_largest_m"] == pytest.approx(RODS / 4, rel=1e-6)
    with (out / "accuracy.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(data["points"]) == len(study.points)
    largest = study.points[0].errors.largest
    assert float(rows[0]["error_largest_m"]) == pytest.approx(largest, rel=1e-11)
    assert set(rows[0]) < set(data["points"][0])

"""Scenes with closed forms: these are what pieces of known motion give, and runs keep them."""

from dataclasses import replace

import pytest
import random_mechanisms
import random_scenes
from benchmarks.verdicts import CRASHED, SILENT
from drawing.mechanisms import FAMILIES
from random_mechanisms import RIGHT, drawn, judge
from random_silent import NEEDLESS, worst

from exudyn_flexlink import load_scene

SMALL = (10000, 20001, 30000, 40000, 50001, 60000)


@pytest.mark.parametrize("scene", SMALL)
def test_no_scene_is_silently_wrong(scene):
    assert worst(scene, seed=1, measure=False).kind not in (SILENT, NEEDLESS, CRASHED)


# --- mechanisms drawn at random -------------------------------------------------------------------

SEED = 1


def first_of(family):
    """Model file of the first mechanism of a family."""
    return next(text for of, text in (drawn(k, SEED, False) for k in range(200)) if of == family)


@pytest.mark.parametrize("family", FAMILIES)
def test_every_family_is_drawn_as_a_model_file(family, tmp_path):
    path = tmp_path / "drawn.yaml"
    path.write_text(first_of(family))
    assert load_scene(path).title == family


def test_a_slider_crank_is_right():
    verdict = judge(first_of("slider-crank"), "slider-crank", seconds=60, measure=False)
    assert verdict.kind == RIGHT
    assert verdict.off < 1


def test_every_part_is_drawn_into_mechanisms():
    texts = [drawn(k, SEED, True)[1] for k in range(60)]
    parts = ("freewheel: ", "until: ", "stages:", "latch:", "later:", "backlash:", "clearance:",
             "type: rope", "type: polygon", "max(0, rate)", "friction:", "limits:")  # fmt: skip
    assert not [part for part in parts if not any(part in text for text in texts)]


LATCHED = """
title: what latches
bodies:
  arm: {type: rigid, mass: 1, inertia: 0.03, points: {hub: [0, 0], tip: [0.6, 0]}}
  other: {type: rigid, mass: 0.7, inertia: 0.015, points: {hub: [0, 0]}}
joints:
  first: {type: revolute, points: [ground, arm.hub], at: [0, 0]}
  second: {type: revolute, points: [arm.tip, other.hub]}
initial: {speeds: {arm: 2, other: -5}}
run: {duration: 0.1}
accuracy: {tolerance: 1.0e-6}
stages:
  - until: t - 0.05
    remove: [joints.second]
    add: {joints: {latch: {type: weld, points: [arm.tip, other.hub]}}}
"""


@pytest.mark.parametrize("part", [1.0, 0.9])
def test_what_a_stage_loses_is_held_against_its_jump_of_speeds(part, monkeypatch):
    run = random_mechanisms.simulate

    def simulate(*scene, **options):
        result = run(*scene, **options)
        event = next(event for event in result.laps if event.kind == "stage")
        lost = {"energy_lost": part * event.details["energy_lost"]}
        return replace(result, laps=(replace(event, details=lost),))

    monkeypatch.setattr(random_mechanisms, "simulate", simulate)
    assert judge(LATCHED, "tree", 60, measure=False).kind == (RIGHT if part == 1.0 else SILENT)


def test_play_is_drawn_into_the_slot_of_the_mechanism():
    model, settings = random_scenes.drawn(0, SEED, play=True)
    assert load_scene(model, settings).joints["pin"].clearance > 0

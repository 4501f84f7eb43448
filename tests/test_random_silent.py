"""Scenes with closed forms: these are what an independent integration gives, and runs keep them."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
import random_silent
from random_silent import (
    BAD,
    DOUBTED,
    NEEDLESS,
    REFUSED,
    RIGHT,
    SILENT,
    TOLD,
    drawn,
    judge,
    verdict_of,
)
from results import rigid_link
from scipy.integrate import solve_ivp
from silent.closed_forms import SHAPES, Term, radius_at
from silent.scenes import Case

EXACT = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14}
END = 0.7  # s
SMALL = (10000, 10010, 20001, 20004, 30000, 30001, 40000, 50001, 60000)
OF_FORMULAS = {
    "exp": np.exp,
    "tanh": np.tanh,
    "sin": np.sin,
    "where": lambda c, a, b: a if c else b,
}


def value_of(text: str, **names: float) -> float:
    """Value of a formula of a model file, by Python."""
    return float(eval(text, {**OF_FORMULAS, "abs": abs, "max": max, "min": min}, names))


def pieces(term: Term) -> list[tuple[float, float]]:
    """Stretches of a run between the edges of a pulse."""
    edges = [term.at + side * term.wide for side in (-6, -1, 0, 1, 6)]
    ends = [0.0, *(edge for edge in edges if 0 < edge < END), END]
    return list(pairwise(ends))


@pytest.mark.parametrize("shape", SHAPES)
def test_pulses_move_a_mass_as_an_integration_of_their_formulas_says(shape):
    at = {"level": 0.0, "wave": 0.0, "decay": 0.0, "early": 0.02}.get(shape, 0.31)
    term, w = Term(shape, at, 0.02, -3.0), 40.0
    moved = np.zeros(5)  # integral, double integral, and speed of the oscillator with its place
    for begin, end in pieces(term):
        middle = (begin + end) / 2

        def rates(t, x, begin=begin, end=end, middle=middle):
            inside = middle + (t - middle) * (1 - 1e-12)  # the formula may jump at the edges
            force = value_of(term.text, t=inside)
            return [force, x[0], x[3], force - w**2 * x[2], 0.0]

        moved = solve_ivp(rates, (begin, end), moved, max_step=0.01, **EXACT).y[:, -1]
    time = np.array([END])
    assert term.integral(time, 1)[0] == pytest.approx(moved[0], abs=1e-12)
    assert term.integral(time, 2)[0] == pytest.approx(moved[1], abs=1e-12)
    if shape == "gauss":
        assert term.resonant(time, w)[0] == pytest.approx(moved[2], abs=1e-12)


def samples(
    time: np.ndarray, poses: dict[str, np.ndarray], **points: np.ndarray
) -> SimpleNamespace:
    """What a case asks of a result."""
    return SimpleNamespace(
        time=time,
        part_names=list(poses),
        poses=np.stack(list(poses.values()), axis=1) if poses else None,
        scene=SimpleNamespace(outputs=SimpleNamespace(watch=next(iter(points), ""))),
        path=lambda name: SimpleNamespace(position=points[name]),
    )


@pytest.mark.parametrize("scene", [20000, 20001, 20002, 20003, 20004, 20006, 20009, 20014])
def test_kinks_move_a_body_as_an_integration_of_their_formula_says(scene):
    case = drawn(scene, seed=1)[-1]
    drive, body = case.model["drives"]["drive"], case.model["bodies"]["body"]
    turns, reach = drive["type"] == "torque", body["points"]["tip"][0]
    text = drive["value"] if turns else drive["value"][0]
    text = re.sub(r"(place|angle)\([^)]*\)", "x", text).replace("speed(way)", "v")
    start = [next(iter(one.values())) for one in case.model["initial"].values()]

    def rates(_, y):
        return [y[1], value_of(text, x=y[0], v=y[1]) / body["mass"]]

    end = case.model["run"]["duration"]
    time = np.linspace(0, end, 200)
    out = solve_ivp(rates, (0, end), start, t_eval=time, **EXACT).y[0]
    angle, out = (out, 0 * out) if turns else (0 * out, out)
    tip = np.stack([out + reach * np.cos(angle), reach * np.sin(angle)], axis=1)
    assert case.off(samples(time, {}, **{"body.tip": tip})) < 1e-9
    assert case.off(samples(time, {}, **{"body.tip": tip + np.array([1e-6, 0])})) == pytest.approx(
        1e-6, rel=1e-2
    )


def test_a_spline_around_a_hub_is_met_in_every_direction():
    angle = np.linspace(-4, 4, 50)
    around = 2 * np.pi * np.arange(60) / 60
    points = np.column_stack([0.01 + 0.03 * np.cos(around), 0.03 * np.sin(around)])
    circle = 0.01 * np.cos(angle) + np.sqrt(0.03**2 - (0.01 * np.sin(angle)) ** 2)
    assert radius_at(points, angle) == pytest.approx(circle, abs=1e-7)


@pytest.mark.parametrize(
    ("off", "warning", "flawed", "kind"),
    [
        (0.5e-6, "", False, RIGHT),
        (0.5e-6, "off by an error", False, DOUBTED),
        (3e-6, "", False, SILENT),
        (3e-6, "samples are far apart", False, SILENT),
        (3e-6, "off by an error", False, TOLD),
    ],
)
def test_what_a_run_is_off_by_decides(off, warning, flawed, kind, monkeypatch):
    exact = replace(rigid_link(samples=21), warnings=(warning,) if warning else ())
    monkeypatch.setattr(random_silent, "simulate", lambda _, **__: exact)
    case = drawn(10000, seed=1)[0]
    case.model["accuracy"]["tolerance"] = 1e-6
    assert judge(replace(case, off=lambda _: off)).kind == kind


@pytest.mark.parametrize(("flawed", "kind"), [(True, REFUSED), (False, NEEDLESS)])
def test_only_what_is_unclear_may_be_refused(flawed, kind):
    assert judge(Case({}, lambda _: 0.0, flawed=flawed)).kind == kind


@pytest.mark.parametrize("scene", SMALL)
def test_no_scene_is_silently_wrong(scene):
    assert verdict_of(scene, seed=1, measure=False).kind not in BAD

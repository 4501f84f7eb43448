"""Laws of nature: the mechanism of the paper, against closed forms and against itself."""

from math import pi

import numpy as np
import pytest
from physics_tools import MODELS, angle, on_grid, where

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import scene_of
from exudyn_flexlink.source import parse_document

C = np.array([0.02, 0.0])


def reach(theta):
    """Distance from C to the track at crank angle theta: ellipse in odd laps, egg in even ones."""
    c, s = np.cos(theta), np.sin(theta)
    a, b = 0.04, 0.03
    # |C + r e| on the ellipse: (0.02 + r c)^2/a^2 + (r s)^2/b^2 = 1
    p, q, k = c**2 / a**2 + s**2 / b**2, 0.02 * c / a**2, 0.25 - 1
    ellipse = (-q + np.sqrt(q**2 - p * k)) / p
    circle = -0.02 * c + np.sqrt(0.03**2 - (0.02 * s) ** 2)
    left = C[0] + ellipse * c < 0
    odd = np.floor(theta / (2 * pi) + 1e-9) % 2 == 0
    return np.where(odd | ~left, ellipse, circle)


def without(name, *keys):
    """Text of a model file without some sections."""
    text = (MODELS / name).read_text(encoding="utf-8")
    lines, skipping = [], False
    for line in text.splitlines():
        if line and not line[0].isspace() and not line.startswith("#"):
            skipping = line.split(":")[0] in keys
        if not skipping:
            lines.append(line)
    return "\n".join(lines) + "\n"


def bare_rigid(*settings):
    """models/rigid.yaml without spring and contact; the lever stays and rests."""
    return scene_of(parse_document(without("rigid.yaml", "contacts"), "rigid.yaml"), settings)


@pytest.fixture(scope="module")
def rigid():
    result = simulate(bare_rigid("run.turns=20", "accuracy.step=1.0e-3"))
    assert result.outcome.completed
    assert result.warnings == ()
    return result


def test_end_of_the_rigid_link_is_where_track_and_crank_put_it(rigid):
    """S = C + (r(theta) + l) e(theta), over 20 turns of both tracks."""
    theta = 10 * on_grid(rigid, rigid.time, rigid.time[1])
    exact = C + (reach(theta) + 0.07)[:, None] * np.column_stack([np.cos(theta), np.sin(theta)])
    got = on_grid(rigid, where(rigid, "link.end"), rigid.time[1])
    assert rigid.checks.constraint_error < 1e-9
    # Samples lie between steps, on cubics; events' steps are exact.
    np.testing.assert_allclose(got, exact, atol=2e-6)


def test_end_of_the_rigid_link_is_exact_at_every_step():
    """With a sample at each step no interpolation hides the solver's own error."""
    result = simulate(bare_rigid("run.turns=0.95", "run.sample=1.0e-3", "accuracy.step=1.0e-3"))
    theta = angle(result, "guide")
    exact = C + (reach(theta) + 0.07)[:, None] * np.column_stack([np.cos(theta), np.sin(theta)])
    at_step = slice(-1)  # the turn does not end with a whole step
    np.testing.assert_allclose(where(result, "link.end")[at_step], exact[at_step], atol=1e-9)


def test_laps_of_the_rigid_link_begin_with_every_turn(rigid):
    laps = [event for event in rigid.events if event.kind == "lap"]
    assert [event.details["lap"] for event in laps] == list(range(2, 21))
    times = [event.time for event in laps]
    np.testing.assert_allclose(times, 2 * pi * np.arange(1, 20) / 10, atol=1e-6)

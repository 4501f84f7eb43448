"""Laws of nature: the mechanism of the paper, against closed forms and against itself."""

from math import pi

import numpy as np
import pytest
from test_physics_tools import MODELS, angle, on_grid, run_model, where

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import scene_of
from exudyn_flexlink.observables import crank_angle
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
    result = simulate(
        bare_rigid("run.turns=0.95", "run.sample=1.0e-3", "accuracy.step=1.0e-3"), measure=False
    )
    theta = angle(result, "guide")
    exact = C + (reach(theta) + 0.07)[:, None] * np.column_stack([np.cos(theta), np.sin(theta)])
    at_step = slice(-1)  # the turn does not end with a whole step
    np.testing.assert_allclose(where(result, "link.end")[at_step], exact[at_step], atol=1e-9)


def test_laps_of_the_rigid_link_begin_with_every_turn(rigid):
    laps = [event for event in rigid.events if event.kind == "lap"]
    assert [event.details["lap"] for event in laps] == list(range(2, 21))
    times = [event.time for event in laps]
    np.testing.assert_allclose(times, 2 * pi * np.arange(1, 20) / 10, atol=1e-6)


def test_observed_order_is_two():
    """Halving the step quarters the error of S, in the first half turn of the smooth scene."""
    steps = [2e-4, 1e-4, 1.25e-5]
    ends = [
        where(
            run_model(
                "smooth.yaml",
                "run.duration=0.12",
                "run.sample=0.004",
                f"accuracy.step={step}",
                "bodies.link.rods=5",
            ),
            "link.end",
        )
        for step in steps
    ]
    coarse, fine = (abs(end - ends[-1]).max() for end in ends[:2])
    # Against a reference of step h/8 the ratio of errors is (64 - 1/4)/(16 - 1/4) = 4.05.
    assert 3.6 < coarse / fine < 4.4


def mirrored(text):
    """The paper's model reflected in the x-axis; its tracks are symmetric themselves."""
    text = text.replace("value: 10 rad/s", "value: -10 rad/s")
    return text.replace("    law:", "    side: right\n    law:")


@pytest.mark.parametrize("curve", ["ellipse", "track"])
def test_mirrored_mechanism_moves_mirrored(curve):
    """Crank the other way, struck face below: S reflected in the x-axis, the ellipse first."""
    settings = ["run.turns=1", "run.sample=1.0e-3", "accuracy.step=1.0e-4"]
    text = (MODELS / "rigid.yaml").read_text(encoding="utf-8")
    text = text.replace("curve: track", f"curve: {curve}")
    one, other = (
        simulate(scene_of(parse_document(t, "rigid.yaml"), settings))
        for t in (text, mirrored(text))
    )
    a, b = (on_grid(r, where(r, "link.end"), 1e-3) for r in (one, other))
    np.testing.assert_allclose(b, a * [1, -1], atol=1e-9)
    a, b = (on_grid(r, angle(r, "lever"), 1e-3) for r in (one, other))
    # Another seam shifts the fixed steps, which do not resolve the strike.
    np.testing.assert_allclose(b, -a, atol=1e-9 if curve == "ellipse" else 1e-2)


def test_motor_of_the_paper_supplies_energy_and_the_dampers_take_it():
    """Power balance of the flexible scene with strikes, two turns."""
    result = run_model("no_clearance.yaml", "run.turns=1", "bodies.link.rods=5")
    kinetic = result.checks.largest_kinetic_energy
    assert result.checks.energy_residual < 2e-2 * kinetic
    np.testing.assert_allclose(crank_angle(result), 10 * result.time, atol=1e-9)
    assert result.energy.dissipated[-1] > 0
    assert np.all(np.diff(result.energy.dissipated) > -1e-3 * kinetic)

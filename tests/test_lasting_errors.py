"""For how long errors of speeds count between walls, and how the steps after an event begin."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from exudyn_flexlink import load_scene
from exudyn_flexlink.engines.exudyn.minimal.run import MinimalRun, prepare
from exudyn_flexlink.integrate.control import MOST_GROWTH
from exudyn_flexlink.integrate.events import Event
from exudyn_flexlink.integrate.slow_motions import FREELY
from exudyn_flexlink.loading import assemble_scene

MODELS = Path(__file__).parent.parent / "models"
PAIR = 3  # of link and guide


@pytest.fixture
def run() -> MinimalRun:
    """The paper's link between its walls, before its first step."""
    scene = load_scene(MODELS / "clearance.yaml", ["bodies.link.rods=3", "accuracy.tolerance=1e-6"])
    prepared = prepare(scene, assemble_scene(scene), None)
    prepared.stepper.begin()
    return prepared


def test_a_pair_that_has_touched_lets_its_gap_swing(run: MinimalRun) -> None:
    """One spring: of M^-1 K one eigenvalue is 1/swing^2, the others are zero."""
    at, walls, swing = run.stepper.at, run.model.walls, 0.3
    pairs = np.arange(len(walls.contacts))
    walls.choose(pairs == PAIR)
    walls.choose(pairs < 0)
    state = at.kept.state
    stiffness = walls.catching(state, at.mass, swing)
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(at.mass, stiffness)).real)
    assert squares[-1] == pytest.approx(swing**-2, rel=1e-9)
    assert abs(squares[:-1]).max() < 1e-9 * squares[-1]


def test_errors_of_speeds_last_until_the_run_ends_or_walls_catch_them(run: MinimalRun) -> None:
    """The rigid motions: for a part of the run before the first touch, less after it."""
    at, problem = run.stepper.at, run.problem

    def longest() -> float:
        return float(abs(np.linalg.eigvals(problem.position_per_speed_error(at))).max())

    assert longest() == pytest.approx(FREELY * problem.end)
    walls = run.model.walls
    walls.choose(np.ones(len(walls.contacts), dtype=bool))
    assert longest() < 0.05 * FREELY * problem.end


def test_the_trend_of_errors_ends_where_a_wall_begins_to_press(run: MinimalRun) -> None:
    """The first step, cut short, was far better than asked: the next is as long as may be."""
    stepper, control = run.stepper, run.stepper.control
    control.note(1e-3, 0.5 * control.allowed)
    stepper.restart(Event(0.0, None, bends=True))
    assert control.factor(1e-5, 1e-6 * control.allowed) == MOST_GROWTH

"""A contact is one interval, whichever engine writes it: against the samples of the same run."""

from pathlib import Path

import numpy as np
import pytest

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.observables import strikes

MODEL = Path(__file__).parents[1] / "models" / "no_clearance.yaml"
ENGINES = [
    ("exudyn", ["solver.formulation=minimal"]),
    ("exudyn", ["solver.formulation=redundant"]),
    ("lagrangian", []),
]


def run(engine, settings, until):
    """The strike at 0.3142 s lasts until 0.3153 s, then the point bounces."""
    changes = [*settings, f"run={{duration: {until}, sample: 1.0e-5}}", "accuracy.tolerance=1e-6"]
    return simulate(load_scene(MODEL, changes), engine)


@pytest.mark.parametrize(("engine", "settings"), ENGINES)
def test_a_contact_that_lasts_as_the_run_ends_has_no_end(engine, settings):
    result = run(engine, settings, 0.3145)
    history = result.contacts["strike"]
    (only,) = history.touches
    assert only.lasts
    assert [event.kind for event in result.events] == ["contact begins"]
    during = result.time >= only.begin
    time, force = result.time[during], history.force[during]
    # What passed until the run ended counts, as do the largest force and the deepest place.
    assert only.impulse == pytest.approx(np.trapezoid(force, time), rel=2e-2)
    assert only.peak_force == pytest.approx(force.max(), rel=1e-2)
    assert only.penetration == pytest.approx(-history.gap[during].min(), rel=1e-2)
    assert only.place == pytest.approx(np.interp(only.begin, time, history.place[during]))
    (strike,) = strikes(result, "strike")
    assert (strike.ended, strike.end) == (False, result.time[-1])


@pytest.mark.parametrize(("engine", "settings"), ENGINES)
def test_a_contact_that_ends_tells_how_the_point_parts(engine, settings):
    result = run(engine, settings, 0.32)
    history = result.contacts["strike"]
    first = next(iter(history.touches))
    at = np.searchsorted(result.time, first.end)
    assert result.time[at] == pytest.approx(first.end, abs=1e-12)
    assert history.gap[at] == pytest.approx(0, abs=1e-7)
    assert first.end_place == pytest.approx(history.place[at], abs=1e-7)
    assert 0 < first.separation_speed < first.approach_speed
    assert not first.slides_off


@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
def test_no_force_is_larger_than_the_law_gives_where_the_point_is_deepest(engine):
    """The third touch slides off the face: what would press beyond its end is no force."""
    settings = ["run={duration: 0.322, sample: 1 ms}"]
    scene = load_scene(MODEL.with_name("rigid.yaml"), settings)
    touches = list(simulate(scene, engine).contacts["strike"].touches)
    assert [touch.slides_off for touch in touches] == [False, False, True]
    stiffness = scene.contacts["strike"].law.stiffness
    for touch in touches:
        assert 0 < touch.peak_force < stiffness * touch.penetration * (1 + 1e-6)


def test_a_link_that_is_held_on_its_axis_at_time_0_is_a_run_like_others():
    """Its pairs press before the first step; a sleeve without clearance tells no touches."""
    changes = [
        "solver.formulation=redundant",
        "bodies.link.rods=3",
        "accuracy={step: 0.2 ms}",
        "run={duration: 2 ms, sample: 0.2 ms}",
    ]
    result = simulate(load_scene(MODEL.with_name("supported.yaml"), changes))
    assert result.outcome.completed
    history = result.sleeves["sleeve"]
    assert np.any(history.force[1:] > 0)
    assert len(history.touches) == 0

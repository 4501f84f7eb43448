"""Values of a model from measurements: against two integrations by others, and closed forms.

tests/data/fit_A.csv and fit_B.csv are exact motions with noise that was added. Their right answers,
and how far they are known, come from fits with two other integrators that agree.
"""

from dataclasses import replace
from functools import cache, partial
from math import inf
from pathlib import Path

import numpy as np
import pytest
from cli_runs import RIGID
from results import result_of

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.fitting import NoFitError, fit, read_series
from exudyn_flexlink.fitting.least_squares import Estimate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.observables import signals
from exudyn_flexlink.result import INTERRUPTED, Outcome
from exudyn_flexlink.source import SceneError

DATA = Path(__file__).parent / "data"
K, C, START = "springs.s.stiffness", "springs.s.damping", "initial.angles.lever"
BODIES = {"fit_A": "lever", "fit_B": "rod"}
# Values and standard errors of k and c, sum of squares, correlation.
RIGHT = {
    "fit_A": ((3.199619575, 0.02411457442), (9.84319e-4, 7.75879e-5), 0.006643125111, 0.104672),
    "fit_B": ((1.100111009, 0.01201235264), (2.68103e-4, 2.84755e-5), 0.02619545518, -0.570004),
}
alone = partial(simulate, measure=False)


def scene_of(name, *settings):
    return load_scene(DATA / f"{name}.yaml", settings)


def fitted(name, *settings):
    scene = scene_of(name, *settings)
    columns = {"theta": f"{BODIES[name]}.angle"}
    return fit(scene, read_series(scene, DATA / f"{name}.csv", columns), [K, C], alone)


@pytest.mark.parametrize("name", RIGHT)
def test_stiffness_and_damping_with_their_errors(name):
    values, errors, squares, correlation = RIGHT[name]
    found = fitted(name)
    assert list(found.values.values()) == pytest.approx(values, rel=1e-6)
    assert list(found.standard_errors.values()) == pytest.approx(errors, rel=1e-4)
    assert found.correlations[0, 1] == pytest.approx(correlation, abs=1e-4)
    assert sum(np.sum(own**2) for own in found.residuals.values()) == pytest.approx(
        squares, rel=1e-8
    )
    assert max(found.integrator.values()) < 1e-8
    assert not found.warnings
    spring = found.scene.springs["s"]
    assert (spring.stiffness, spring.damping) == tuple(found.values.values())
    assert found.scene.accuracy == scene_of(name).accuracy


def test_a_coarse_tolerance_does_not_move_the_values():
    """At 1e-3 a public integrator gives a stiffness that is 12.5 standard errors off."""
    values, errors, *_ = RIGHT["fit_B"]
    found = fitted("fit_B", "accuracy.tolerance=1e-3")
    for own, right, error in zip(found.values.values(), values, errors, strict=True):
        assert abs(own - right) < error / 10


def test_the_restitution_of_a_strike_from_data_of_the_other_engine():
    """The Lagrangian has its own equations, and the strike its own place in them."""
    path, true = "contacts.strike.law.restitution", 0.62
    short = ["initial.angles.guide=176 deg", "run.turns=0.05"]  # the strike is at 180 deg
    scene = load_scene(RIGID, [*short, "accuracy.tolerance=1e-6", f"{path}=0.6"])
    made = load_scene(RIGID, [*short, "accuracy.tolerance=1e-8", f"{path}={true}"])
    other = simulate(made, "lagrangian", measure=False)
    time = np.arange(0, other.time[-1], 1e-3)
    noise = np.random.default_rng(5).normal(0, 1e-5, len(time))
    angle = signals(made)["lever.angle"].at(other, time) + noise
    series = read_series(scene, {"t": time, "lever.angle": angle})
    found = fit(scene, series, path, alone)
    assert found.standard_errors[path] < 1e-4
    assert abs(found.values[path] - true) < 4 * found.standard_errors[path]


# --- closed form in place of an engine: the lever of fit_A, of an inertia of 0.02 kg m^2


@cache
def still(samples):
    """Make a result of so many samples once: what a fit looks at is filled in."""
    scene = scene_of("fit_A")
    return result_of(scene, np.linspace(0, 1, samples), np.zeros((samples, 1, 3)))


def lever(scene):
    """Damped vibration from rest."""
    ends = np.arange(0, scene.run.duration + scene.run.sample / 2, scene.run.sample)
    k = sum(own.stiffness for own in scene.springs.values())
    decay = sum(own.damping or 0.0 for own in scene.springs.values()) / 0.04
    w, a = np.sqrt(k / 0.02 - decay**2), scene.initial.angles["lever"]
    fade = a * np.exp(-decay * ends)
    q, v = np.zeros((len(ends), 1, 3)), np.zeros((len(ends), 1, 3))
    q[:, 0, 2] = fade * (np.cos(w * ends) + decay / w * np.sin(w * ends))
    v[:, 0, 2] = -fade * (w + decay**2 / w) * np.sin(w * ends)
    done = Outcome(completed=True, time=float(ends[-1]))
    return replace(still(len(ends)), scene=scene, time=ends, poses=q, rates=v, outcome=done)


def measured(scene, rate_noise=None, seed=1):
    """What a scene gives, with noise, at 200 instants."""
    long = scene.changed(run=scene.run.model_copy(update={"duration": 2.0, "sample": 0.01}))
    result, noise = lever(long), np.random.default_rng(seed).normal(0, 1, (2, 201))
    columns = {"t": result.time, "lever.angle": result.poses[:, 0, 2] + 1e-3 * noise[0]}
    if rate_noise is not None:
        columns["lever.rate"] = result.rates[:, 0, 2] + rate_noise * noise[1]
    return read_series(scene, columns)


def test_standard_errors_are_those_of_a_straight_line():
    x = np.linspace(0, 1, 20)
    y = 2 * x + 1 + np.random.default_rng(3).normal(0, 0.1, 20)
    line, covariance = np.polyfit(x, y, 1, cov=True)
    slopes = np.stack([x, np.ones(20)], axis=1)
    found = Estimate(["slope", "height"], line, slopes @ line - y, slopes)
    assert found.standard_error == pytest.approx(np.sqrt(np.diag(covariance)))
    root = np.sqrt(np.diag(covariance))
    assert found.correlations == pytest.approx(covariance / np.outer(root, root))
    assert found.moved_by(found.residuals - 0.01) == pytest.approx([0, 0.01])


def test_a_quantity_counts_by_its_scatter():
    """One that is nothing but noise leaves the values where they are."""
    scene = scene_of("fit_A")
    alone_, with_noise = (
        fit(scene, measured(scene, noise), [K, C], lever) for noise in (None, 1e4)
    )
    for path in (K, C):
        moved = abs(with_noise.values[path] - alone_.values[path])
        assert moved < 0.02 * alone_.standard_errors[path]


def test_a_start_that_is_fitted_widens_the_error_of_the_damping():
    scene = scene_of("fit_A")
    found = fit(scene, measured(scene), [K, C, START], lever)
    held = fit(scene, measured(scene), [K, C], lever)
    assert found.standard_errors[C] > 1.2 * held.standard_errors[C]
    assert abs(found.values[START] - 0.3) < 4 * found.standard_errors[START]


@pytest.mark.parametrize(
    ("vary", "words"),
    [
        ([K, "springs.t.stiffness"], f"can't tell {K} and springs.t.stiffness apart"),
        (["springs.t.rest_angle", K], "do not depend on springs.t.rest_angle"),
        ({K: (1.0, 2.0)}, f"{K} ends at its bound, 2"),
    ],
)
def test_what_data_can_not_tell(vary, words):
    second = "springs.t={type: torsional, joint: hinge, stiffness: 0.5, rest_angle: 0.0}"
    scene = scene_of("fit_A", second, f"{K}=1.9")
    series = measured(scene_of("fit_A", second, f"{K}=2.5"))
    found = fit(scene, series, vary, lever)
    assert any(words in told for told in found.warnings)
    if "bound" not in words:
        assert inf in found.standard_errors.values()


@pytest.mark.parametrize(
    ("vary", "words"),
    [
        ([], "nothing is varied"),
        (["springs.s.stifness"], "unknown key 'stifness'; did you mean 'stiffness'?"),
        (
            ["initial.angels.lever"],
            "initial.angels.lever: unknown key 'angels'; did you mean 'angles",
        ),
        (["springs.s.frequency"], "springs.s.frequency: has no number to start from"),
        (["joints.hinge.points"], "is no number that varies without steps"),
        ({K: (5, 9)}, "starts at 3, outside its bounds 5 to 9"),
        ({K: "1:5 mm"}, "expected a torsional stiffness, got '1 mm'"),
    ],
)
def test_what_can_not_be_varied(vary, words):
    scene = scene_of("fit_A")
    with pytest.raises(SceneError) as raised:
        fit(scene, measured(scene), vary, lever)
    assert words in str(raised.value)


def test_no_fit():
    scene = scene_of("fit_A")
    few = read_series(scene, {"t": [0.1], "lever.angle": [0.3]})
    early = read_series(scene, {"t": [-1.0, 0.0, 1.0], "lever.angle": [0.3, 0.2, 0.1]})
    stop = replace(lever(load_scene(DATA / "fit_A.yaml", ["run.sample=0.1"])).outcome,
                   completed=False, time=0.5, reason="no convergence")  # fmt: skip
    for series, run, words in (
        (few, lever, "1 measured values can't tell 1 numbers"),
        (early, lever, "goes from -1 to 1 s, a run from 0 s"),
        (measured(scene), lambda own: replace(lever(own), outcome=stop), "no convergence"),
    ):
        with pytest.raises(NoFitError, match=words):
            fit(scene, series, K, run)
    ended = replace(stop, reason=INTERRUPTED)
    with pytest.raises(KeyboardInterrupt):
        fit(scene, measured(scene), K, lambda own: replace(lever(own), outcome=ended))


def test_a_start_that_moves_the_rest_of_a_spring_is_told():
    """A spring without 'rest_angle' rests as assembled: elsewhere for each start that is tried."""
    scene, told = scene_of("fit_A", "springs.s.rest_angle=null"), "where spring 's' rests"
    series = replace(measured(scene), source="made up")
    found = fit(scene, series, [K, START], lever)
    assert [told in text for text in found.warnings].count(True) == 1
    assert not any(told in text for text in fit(scene, series, [K, C], lever).warnings)
    assert not any(told in text for text in fit(scene_of("fit_A"), series, [START], lever).warnings)

"""Runs a variant of a hard case one way; holds it against its truth and against the criteria."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import gettempdir

import numpy as np
from benchmarks.lever_tip import tip_apart

from exudyn_flexlink.comparison import Comparison, compare
from exudyn_flexlink.engines import NotRepresentableError, measured, simulate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.observables import path, watched_point
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.source import SceneError
from hard.case import LAGRANGIAN, MODELS, REDUNDANT, Case, Variant
from hard.catalogue import MODEL_OF
from hard.symmetry import mirrored, scaled
from hard.truths import ellipse_points

RIGHT, REFUSED, TOLD, WRONG = "right", "refused, as documented", "off, and said so", "WRONG"

TIGHT = 1e-11  # m: tolerance of the run that judges
DRIFT = 1e-9  # m or rad
ENERGY = 1e-2  # of the largest kinetic energy: what the balance may miss at most
LOSSLESS = 1e-3  # the same without any damping
NO_ENERGY = 1e-12  # J
GAIN = 1e-5  # of the kinetic energy, at one impact: a hundred keep to LOSSLESS
STATISTICS = 0.05
MANY_TURNS = 10
STEADY = 3.0  # by which half the step lessens the error of a second-order method, at least
REDUNDANT_TOLERANCE = 4e-5  # m: what this formulation's steps are made for
GROWS = 10.0


@dataclass(frozen=True)
class Row:
    """What came out of one run: deviation (m) and what is allowed, criteria it breaks, verdict."""

    case: str
    variant: str
    way: str
    truth: str
    deviation: float
    allowed: float
    steps: int
    warnings: tuple[str, ...]
    broken: tuple[str, ...]
    verdict: str


def scene_of(case: Case, variant: Variant, way: str) -> Scene:
    """Load the model of a case in one variant, for an engine or a formulation."""
    settings = list(variant.settings)
    if way == REDUNDANT and not any(s.startswith("accuracy.") for s in settings):
        settings.append(f"accuracy.tolerance={REDUNDANT_TOLERANCE}")
    if way != LAGRANGIAN:
        settings.append(f"solver.formulation={way}")
    if variant.points:
        file = ellipse_points(variant.points, Path(gettempdir()))
        settings.append(f"curves.track.file={file}")
    model = MODELS / f"{MODEL_OF.get(case.name, case.name)}.yaml"
    return load_scene(model, settings, allow_outside=True)


def engine_of(way: str) -> str:
    """Name of the engine that runs a scene this way."""
    return LAGRANGIAN if way == LAGRANGIAN else "exudyn"


@cache
def judge_of(case: Case, variant: Variant) -> Result:
    """The run that judges where there is no closed form: the other engine, tight."""
    settings = tuple(s for s in variant.settings if not s.startswith("accuracy."))
    scene = scene_of(case, replace(variant, settings=settings), LAGRANGIAN)
    return simulate(with_tolerance(scene, TIGHT), LAGRANGIAN, measure=False)


def with_tolerance(scene: Scene, tolerance: float) -> Scene:
    """Return the scene with another tolerance, m."""
    return scene.changed(
        accuracy=scene.accuracy.model_copy(update={"tolerance": tolerance, "step": None})
    )


def judge(case: Case, variant: Variant, way: str) -> Row:
    """Run and judge one line of the table."""
    blank = Row(case.name, variant.label, way, case.says, np.nan, np.nan, 0, (), (), WRONG)
    try:
        scene = scene_of(case, variant, way)
        result = simulate(scene, engine_of(way))
    except (SceneError, NotRepresentableError) as error:
        why = str(error).splitlines()[0].split(": ", 1)[-1]
        return _ended(blank, variant, why)
    row = replace(blank, steps=result.checks.steps, warnings=result.warnings)
    if not result.outcome.completed:
        return _ended(row, variant, f"{result.outcome.reason} at {result.outcome.time:.4g} s")
    deviation, allowed, broken = _against_truth(case, variant, result)
    broken = [*broken, *criteria(result)]
    if deviation > allowed or (np.isnan(deviation) and allowed < np.inf):
        broken.insert(0, f"off by {deviation:.2g} m, allowed {allowed:.2g} m")
    if variant.refused:
        broken.insert(0, f"should have ended with '{variant.refused[0]}'")
    row = replace(row, deviation=deviation, allowed=allowed, broken=tuple(broken))
    if broken and variant.told:  # a second run tells it
        row = replace(row, warnings=(*row.warnings, *measured(result).warnings))
    told = any(words in text for words in variant.told for text in row.warnings)
    return replace(row, verdict=RIGHT if not broken else TOLD if told else WRONG)


def _ended(row: Row, variant: Variant, why: str) -> Row:
    documented = any(text in why for text in variant.refused)
    return replace(row, broken=(why,), verdict=REFUSED if documented else WRONG)


def _against_truth(case: Case, variant: Variant, result: Result) -> tuple[float, float, list[str]]:
    """Deviation, what is allowed (m), and what is wrong with lever and contacts."""
    allowed = _stated(result)
    if case.truth is not None:
        found = case.truth(result)
        if not _judged(case):
            return found, allowed, []
    else:
        found = 0.0
    reference = judge_of(case, variant)
    if not reference.outcome.completed:
        return np.nan, allowed, [f"the judge stopped: {reference.outcome.reason}"]
    seen = compare(result, reference)
    if case.says.startswith("statistics"):
        wrong = [*_levers(seen), *_touching(seen, parted=True), *_spread(seen)]
        return np.nan, np.inf, wrong
    wrong = [*_levers(seen), *_touching(seen, parted=False)]
    return max(found, seen.deviation.largest, tip_apart(seen)), allowed, wrong


def _judged(case: Case) -> bool:
    return "other engine" in case.says


def _stated(result: Result) -> float:
    """Error (m) that the run's own settings promise."""
    tolerance = result.scene.accuracy.tolerance
    return tolerance if tolerance is not None else REDUNDANT_TOLERANCE


def _spread(seen: Comparison) -> Iterator[str]:
    """Means and scatter of S that are more than a twentieth of its range off."""
    one, other = seen.first.position, seen.second.position
    for says, of in (("mean", np.mean), ("scatter", np.std)):
        apart = np.abs(of(one, axis=0) - of(other, axis=0)) / np.ptp(other, axis=0)
        if (apart > STATISTICS).any():
            yield f"{says} of S off by {apart.max():.2g} of its range"


def _touching(seen: Comparison, parted: bool) -> Iterator[str]:
    """Joints with clearance that touch for another time, by more than chance may explain.

    In runs that have parted touches come by chance, each as long as they do; else short ones do.
    """
    for joint in seen.with_clearance:
        lasted = [
            run.result.intervals[joint].until(run.result.time[-1])
            - run.result.intervals[joint].begin
            for run in (seen.first, seen.second)
        ]
        one, other = (float(times.sum()) for times in lasted)
        if parted:
            chance = 2 * float(np.sqrt(sum((times**2).sum() for times in lasted)))
        else:
            chance = other / np.sqrt(max(len(lasted[1]), 1))
        if abs(one - other) > max(STATISTICS * other, chance):
            yield f"{joint} is touched for {one:.4g} s in all, should be {other:.4g} s"


def _levers(seen: Comparison) -> Iterator[str]:
    """Extremes of the levers that are more than a twentieth off."""
    for body in seen.levers:
        one, other = seen.first.levers[body], seen.second.levers[body]
        size = max(abs(other.least[0]), abs(other.greatest[0]))
        for name, a, b in (
            ("least", one.least[0], other.least[0]),
            ("greatest", one.greatest[0], other.greatest[0]),
        ):
            if abs(a - b) > STATISTICS * size + 1e-9:
                word, unit = one.measure.word, one.measure.unit
                yield f"{body}'s {name} {word} {a:.4g}, should be {b:.4g} {unit}"


def criteria(result: Result) -> Iterator[str]:
    """What a stable run keeps, whatever the case."""
    checks = result.checks
    energy = max(checks.largest_kinetic_energy, NO_ENERGY)
    share = checks.energy_residual / energy
    if not share <= (LOSSLESS if lossless(result.scene) else ENERGY):
        yield f"energy balance misses {share:.2g} of the largest kinetic energy"
    if not checks.constraint_error < DRIFT:
        yield f"joints open by {checks.constraint_error:.2g}"
    gained = [
        -event.details["energy_lost"] for event in result.events
        if event.details.get("energy_lost", 0.0) < -GAIN * energy
    ]  # fmt: skip
    if gained:
        yield f"{len(gained)} impacts gain energy, up to {max(gained) / energy:.2g} of the kinetic"
    if _drifts(result):
        yield "the energy balance misses more with every turn"
    for name, values in (("positions", result.poses), ("rates", result.rates)):
        if not np.isfinite(values).all():
            yield f"{name} are not finite"


def _drifts(result: Result) -> bool:
    """Tell whether the balance misses more in late turns than in early ones, of many."""
    laps = [event.time for event in result.events if event.kind == "lap"]
    if len(laps) < MANY_TURNS:
        return False
    missing = np.interp(laps, result.time, result.energy.residual)
    early, late = np.array_split(np.abs(np.diff(missing)), 2)
    noise = 1e-3 * ENERGY * result.checks.largest_kinetic_energy
    return float(np.median(late)) > 2 * float(np.median(early)) + noise


def lossless(scene: Scene) -> bool:
    """Tell whether nothing damps: neither hinges nor springs nor contacts nor walls."""
    laws = [contact.law for contact in scene.contacts.values()]
    laws += [law for joint in scene.joints.values() if (law := getattr(joint, "law", None))]
    dampers = [body.hinges.damping for body in scene.bodies.values() if hasattr(body, "hinges")]
    for spring in scene.springs.values():
        dampers += [spring.damping or 0.0, getattr(spring, "damping_ratio", None) or 0.0]
    return not any(dampers) and all(law.restitution == 1 for law in laws)


def properties(case: Case, variant: Variant, way: str) -> Iterator[Row]:
    """Try what must hold whatever the truth: mirror, scale, again, finer."""
    scene = scene_of(case, variant, way)
    result = simulate(scene, engine_of(way))
    for name in case.properties:
        says, measure = _PROPERTIES[name]
        blank = Row(case.name, name, way, says, np.nan, np.nan, 0, (), (), WRONG)
        other, deviation, allowed = measure(scene, result, engine_of(way))
        row = replace(
            blank, deviation=deviation, allowed=allowed,
            steps=other.checks.steps, warnings=other.warnings,
        )  # fmt: skip
        good = deviation <= allowed and other.outcome.completed
        why = other.outcome.reason or f"off by {deviation:.2g} m, allowed {allowed:.2g} m"
        yield replace(row, broken=() if good else (why,), verdict=RIGHT if good else WRONG)


Measured = tuple[Result, float, float]


def _seen(result: Result, time: np.ndarray) -> np.ndarray:
    at = path(result, watched_point(result.scene))
    return np.stack([np.interp(time, at.time, at.position[:, k]) for k in (0, 1)], axis=1)


def _mirror(scene: Scene, result: Result, engine: str) -> Measured:
    other = simulate(mirrored(scene), engine, measure=False)
    time = np.intersect1d(result.time, other.time)
    apart = _seen(result, time) - _seen(other, time) * [1, -1]
    return other, float(np.abs(apart).max()), 2 * _stated(result)


def _scale(scene: Scene, result: Result, engine: str) -> Measured:
    other = simulate(scaled(scene, GROWS), engine, measure=False)
    near = _even_samples(result, other, GROWS)
    apart = _seen(result, near) - _seen(other, near * GROWS) / GROWS
    return other, float(np.abs(apart).max()), 2 * _stated(result)


def _even_samples(result: Result, other: Result, factor: float) -> np.ndarray:
    """Samples that both runs have, of the second at `factor` times the instant."""
    index = np.searchsorted(other.time, result.time * factor * (1 - 1e-9))
    index = np.minimum(index, len(other.time) - 1)
    same = np.abs(other.time[index] - factor * result.time) < 1e-9 * factor * result.time[-1]
    return result.time[same]


def _again(scene: Scene, result: Result, engine: str) -> Measured:
    other = simulate(scene, engine)
    same = result.time.shape == other.time.shape and all(
        np.array_equal(getattr(result, name), getattr(other, name))
        for name in ("time", "poses", "rates")
    )
    return other, 0.0 if same else np.inf, 0.0


def _finer(scene: Scene, result: Result, engine: str) -> Measured:
    tighter = (scene.accuracy.tolerance or 1.0) / 10
    other = simulate(with_tolerance(scene, tighter), engine, measure=False)
    seen = compare(result, other)
    return other, seen.deviation.largest, _stated(result)


def _order(scene: Scene, result: Result, engine: str) -> Measured:
    """Half the step: the error falls as the order of the method says, also across events."""
    step = (scene.accuracy.step or 0.0) / 2
    accuracy = scene.accuracy.model_copy(update={"step": step})
    other = simulate(scene.changed(accuracy=accuracy), engine, measure=False)
    exact = simulate(with_tolerance(scene, TIGHT), LAGRANGIAN, measure=False)
    first, half = (compare(run, exact).deviation.largest for run in (result, other))
    return other, half, first / STEADY


_PROPERTIES: dict[str, tuple[str, Callable[[Scene, Result, str], Measured]]] = {
    "mirror": ("reflected in the x-axis", _mirror),
    "scale": ("lengths and times x 10", _scale),
    "again": ("bit for bit the same", _again),
    "order": ("half the step, a third of the error", _order),
    "finer": ("a tenth of the tolerance", _finer),
}

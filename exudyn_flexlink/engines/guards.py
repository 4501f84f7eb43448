"""What a run's own numbers say against it, whatever engine made it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.coasting import left_by_strikes
from exudyn_flexlink.engines.gains import gaining_impacts
from exudyn_flexlink.intervals import Intervals
from exudyn_flexlink.mechanism import (
    Mechanism,
    build_mechanism,
    end_of_run,
    face_length,
    kept_interval,
    wanted_interval,
)
from exudyn_flexlink.observables import crank_angle, crank_joint
from exudyn_flexlink.result import INTERRUPTED, Outcome, Result
from exudyn_flexlink.scene import SleeveJoint

FloatArray = NDArray[np.float64]

ENERGY = 1e-2  # of the largest kinetic energy
LOCAL_ENERGY = 1e-6  # the same under local tolerances, which are far below
GROSS = 0.1  # of all energy that moves: what misses more is no motion of the mechanism
NO_ENERGY = 1e-12  # J: what is less is rounding, and no measure for an error
OPEN = 1e-8  # m or rad, of a joint
MANY_ITERATIONS = 10  # of Newton's method for a step: more than one attempt takes
THIN = 0.25  # of the overlap of a strike: where a point goes deeper, the face's stiffness decides
FEW_SAMPLES = 100  # a turn: a chord between two is 1/2000 of the radius off
# What makes a neighbouring run worth its cost (see `neighbours`). What is told follows from it.
FEW_TOUCHES = 2  # of walls
FEW_BOUNCES = 3  # in a row: a single strike may be a burst of so many
FREE_TURN = np.pi  # rad of the guide while a link swings free of its walls, like a double pendulum
# Of the fastest motion: a point that slides off its face's end more slowly makes much time of a
# small error of its place, and what springs back goes far in it. Measured on models/no_clearance at
# 1e-6 m: at 0.01 rad/s, where it is 1e-3, S is 0.5 tolerances off right after, at 0.0015 rad/s 3.
SLOW_SLIDE = 1e-3
CRAWL = 1e-10  # s: steps this short in a contact lead nowhere soon


def doubts(result: Result) -> list[str]:
    """Say what is wrong with the numbers of a run, and would be less so with smaller steps."""
    return [*_energy(result), *_joints(result), *_gains(result)]


def limits(result: Result) -> list[str]:
    """Say what is doubtful about a run that smaller steps do not change."""
    told = [*_iterations(result), *_crawling(result), *_thin(result)]
    if _struck(result):
        told += _overlaps(result, build_mechanism(result.scene))
    return told


def multiplying(result: Result) -> str:
    """Say what may have multiplied errors beyond what steps foresee; empty if nothing did."""
    found = [*_rattling(result), *_bouncing(result), *_sliding_off(result), *_coarse(result)]
    return "; ".join(found)


def _struck(result: Result) -> bool:
    touches = (contact.touches for contact in result.contacts.values())
    return any(np.isfinite(own.peak_force).any() for own in touches)


def refusal(result: Result) -> Outcome | None:
    """Return how a run ended whose energy balance is grossly wrong; None if it is not."""
    energy = result.energy
    moved = np.abs(energy.stored - energy.stored[0]) + energy.kinetic + np.abs(energy.dissipated)
    all_of_it = max(float(moved.max()), result.checks.largest_kinetic_energy, NO_ENERGY)
    if result.checks.energy_residual <= GROSS * all_of_it:
        return None
    off = np.abs(energy.residual)
    at = result.time[int(np.argmax(off > min(GROSS * all_of_it, 0.5 * off.max())))]
    return Outcome(
        False,
        float(at),
        f"the energy balance misses {result.checks.energy_residual / all_of_it:.2g} of all energy",
        f"what follows is no motion of this mechanism; {_knob(result)}, and look at it there",
    )


def _knob(result: Result) -> str:
    if "relative_tolerance" in result.settings:
        return "tighten 'relative_tolerance'"
    return "shorten the step" if "step" in result.settings else "tighten the tolerance"


def _kinetic(result: Result) -> float:
    return max(result.checks.largest_kinetic_energy, NO_ENERGY)


def _energy(result: Result) -> Iterator[str]:
    missing, kinetic = result.checks.energy_residual, _kinetic(result)
    if missing > (LOCAL_ENERGY if "relative_tolerance" in result.settings else ENERGY) * kinetic:
        yield (
            f"the energy balance misses {missing:.3g} J, {missing / kinetic:.2g} of the largest "
            f"kinetic energy: {_knob(result)} and compare"
        )


def _joints(result: Result) -> Iterator[str]:
    gap = result.checks.constraint_error
    if gap > OPEN:
        yield f"a joint is violated by {gap:.3g} (m or rad): {_knob(result)}"


def _gains(result: Result) -> list[str]:
    return gaining_impacts(result, _kinetic(result))


def _iterations(result: Result) -> Iterator[str]:
    """Steps that were not solved at first have been made shorter already: no error, but a sign."""
    checks = result.checks
    each = checks.newton_iterations / max(checks.steps, 1)
    if each > MANY_ITERATIONS:
        yield (
            f"Newton's method took {each:.2g} iterations a step, where 2 to 4 are usual: most "
            "steps were not solved at first, and made shorter; look for a contact, a bend of the "
            "track or a dead centre that asks for it"
        )


def _crawling(result: Result) -> Iterator[str]:
    """Say why a run that the user ended hardly went on."""
    if result.outcome.reason != INTERRUPTED or result.checks.smallest_step > CRAWL:
        return
    for name, history in result.contacts.items():
        if len(history.force) and history.force[-1] != 0:
            yield (
                f"contact '{name}' acted as the run was ended, which had made steps as short as "
                f"{result.checks.smallest_step:.2g} s: less stiffness or friction, or a larger "
                "'transition_speed', make them longer"
            )


def _overlaps(result: Result, mechanism: Mechanism) -> Iterator[str]:
    """Strikes in which a point went deep, measured by the face between it and the face's end."""
    for face in mechanism.contacts:
        touches, length = result.contacts[face.name].touches, face_length(face)
        ends = np.minimum(touches.end_place, length - touches.end_place)
        overlap = np.maximum(np.minimum(touches.place, length - touches.place), ends)
        found = [
            (depth / max(over, 1e-300), depth, over, at)
            for depth, over, at in _deepest(result, touches, overlap)
        ]
        share, depth, over, at = max(found, default=(0.0, 0.0, 0.0, 0.0))
        if share > THIN:
            yield (
                f"contact '{face.name}' is {depth:.2g} m deep after {at:.6g} s, {share:.2g} of the "
                f"{over:.2g} m by which the point overlaps the face: the face's stiffness "
                "decides there, not the mechanism; raise it and compare"
            )


def _deepest(
    result: Result, touches: Intervals, overlap: FloatArray
) -> Iterator[tuple[float, float, float]]:
    """Depth (m), largest overlap (m) and begin (s) of the deepest contact of each lap."""
    laps = _laps_of(result, touches)
    for lap in np.unique(laps).tolist():
        mine = np.flatnonzero(laps == lap)
        k = mine[np.argmax(touches.penetration[mine])]
        depth, at = float(touches.penetration[k]), float(touches.begin[k])
        yield depth, float(overlap[mine].max()), at


def _laps_of(result: Result, touches: Intervals) -> NDArray[np.int64]:
    """Number of the lap in which each contact begins, by the events between them."""
    return np.asarray(np.searchsorted([lap.time for lap in result.laps], touches.begin, "right"))


def _rattling(result: Result) -> Iterator[str]:
    """Touches of walls, or long flights between them, let errors grow."""
    for name, sleeve in result.sleeves.items():
        count, turned = len(sleeve.touches.end), _free_turn(result, name)
        if count > FEW_TOUCHES:
            yield f"{count} touches of the walls of '{name}'"
        elif turned > FREE_TURN:
            yield (
                f"a link that swung free of the walls of '{name}' while its guide turned by "
                f"{np.degrees(turned):.3g} deg"
            )


def _bouncing(result: Result) -> Iterator[str]:
    """Strikes in a row let errors grow, the more so off a lever that moves."""
    for name, count in _in_a_row(result).items():
        if count > FEW_BOUNCES:
            yield f"{count} strikes of '{name}' in a row"


def _coarse(result: Result) -> Iterator[str]:
    """Fixed numbers of steps for a strike do not see what a tolerance asks for."""
    tolerance, steps = result.scene.accuracy.tolerance, result.settings.get("steps_per_contact")
    if tolerance is None or steps is None or not _struck(result):
        return
    mechanism = build_mechanism(result.scene)
    if left_by_strikes(mechanism, float(result.time[-1]), float(steps)) > tolerance:
        yield f"{steps:g} steps for a strike"


def _sliding_off(result: Result) -> Iterator[str]:
    """Points that crept along a face to its end let what they bent spring back all at once."""
    parts = build_mechanism(result.scene).parts
    fastest = float(np.sqrt(2 * _kinetic(result) / sum(part.mass for part in parts)))
    slowest: dict[str, tuple[float, float]] = {}
    for name, contact in result.contacts.items():
        off = contact.touches.where(contact.touches.slides_off)
        if len(off):
            way = np.abs(off.end_place - off.place)
            speeds = way / np.maximum(off.end - off.begin, 1e-300)
            k = int(np.argmin(speeds))
            slowest[name] = float(speeds[k]), float(off.end[k])
    for name, (speed, at) in slowest.items():
        if speed < SLOW_SLIDE * fastest:
            yield (
                f"the point of '{name}' crept off its face's end at {at:.6g} s, at about "
                f"{speed:.2g} m/s, and what was bent sprang back at {fastest:.2g} m/s or more"
            )


def _free_turn(result: Result, name: str) -> float:
    """Largest angle (rad) by which a guide turned while nothing touched; 0 without play."""
    sleeve, joint = result.sleeves[name], result.scene.joints[name]
    if not any(sleeve.sides) or not isinstance(joint, SleeveJoint):
        return 0.0
    angle = result.poses[:, result.part_names.index(joint.guide), 2]
    until = np.maximum.accumulate(sleeve.touches.until(float(result.time[-1])))
    begins = np.concatenate([result.time[:1], until])
    ends = np.concatenate([sleeve.touches.begin, result.time[-1:]])
    free = ends > begins
    turned = np.interp(ends, result.time, angle) - np.interp(begins, result.time, angle)
    return float(np.abs(turned[free]).max(initial=0.0))


def _thin(result: Result) -> Iterator[str]:
    """Say where samples are fewer than the motion asks for, or than turns that nobody foresaw."""
    scene, mechanism = result.scene, build_mechanism(result.scene)
    if scene.run.sample is not None:
        return
    end = end_of_run(scene, mechanism)
    kept, wanted = (of(scene, mechanism, end) for of in (kept_interval, wanted_interval))
    angle = crank_angle(result) if crank_joint(scene) else np.zeros(1)
    made = abs(float(angle[-1] - angle[0])) / (2 * np.pi)
    apart = f"samples are {kept:.3g} s apart"
    less = "figures and tables show less of it, peaks are what they are; 'run.sample' sets them"
    if kept > wanted * (1 + 1e-9):
        yield f"{apart}, since the run is long, where its motion asks for {wanted:.3g} s: {less}"
    elif made > 1 and result.outcome.time / kept < FEW_SAMPLES * made:
        yield f"{apart}, which is {result.outcome.time / kept / made:.3g} a turn: {less}"


def _in_a_row(result: Result) -> dict[str, int]:
    """Largest number of contacts of each name within one lap, impacts not counted."""
    most = {}
    for name, contact in result.contacts.items():
        touches = contact.touches.where(np.isfinite(contact.touches.peak_force))
        if len(touches):
            most[name] = int(np.bincount(_laps_of(result, touches)).max())
    return most

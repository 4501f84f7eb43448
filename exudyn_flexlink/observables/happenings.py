"""What happens in a run, in words: touches, lift-offs, impacts, reversals, rests, laps."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import GROUND, build_mechanism, length_along, speed_along
from exudyn_flexlink.observables.points import joint_turning, part_of_point
from exudyn_flexlink.result import Interval, Result
from exudyn_flexlink.rounding import INVISIBLE, NEGLIGIBLE
from exudyn_flexlink.scene import RevoluteJoint


class Happening(NamedTuple):
    """What happened at `time` (s), in words, and `where`: a contact, a joint or a slot by name.

    `what` is one of ``touches``, ``lifts off``, ``slides off the face``, ``impact`` (speeds jump),
    ``turns back`` (a joint's rate changes its sign, before and after it goes farther than the run
    may be off), ``comes to rest`` and ``moves again`` (dry friction holds a joint), ``locks`` and
    ``overruns`` (a freewheel), ``lap`` (a point passes the seam of its closed slot), ``stage`` (the
    run goes on with the next one).
    """

    time: float
    what: str
    where: str


def happenings(result: Result) -> list[Happening]:
    """Everything that happens in a run, in order of time."""
    seen = [Happening(lap.time, lap.kind, lap.name) for lap in result.laps]
    for name, touches in result.intervals.items():
        pairs = result.sleeves[name].pairs if name in result.sleeves else (name,)
        for touch in touches:
            seen += _of_touch(touch, pairs[touch.pair])
    for name, friction in result.frictions.items():
        ends = friction.end[np.isfinite(friction.end)]
        one_way = getattr(result.scene.joints[name], "freewheel", None) is not None
        held, free = ("locks", "overruns") if one_way else ("comes to rest", "moves again")
        seen += [Happening(time, held, name) for time in friction.begin.tolist()]
        seen += [Happening(time, free, name) for time in ends.tolist()]
    # A smaller way (m) between two reversals than points may be off by means nothing. If the error
    # exceeds the tolerance, the motion before the instant that warnings name may still be accurate.
    error = result.error
    least = max(INVISIBLE, 0.0 if error.missing else min(error.largest, error.limit))
    for name, (way, rate) in _motions(result).items():
        back = _reversals(result.time, way, rate, least).tolist()
        seen += [Happening(time, "turns back", name) for time in back]
    return sorted(seen, key=lambda happening: happening.time)


def _of_touch(touch: Interval, where: str) -> Iterator[Happening]:
    if touch.impact:
        yield Happening(touch.begin, "impact", where)
        return
    yield Happening(touch.begin, "touches", where)
    if not touch.lasts:
        what = "slides off the face" if touch.slides_off else "lifts off"
        yield Happening(touch.end, what, where)


def _motions(result: Result) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Ways of joints (N,), m, and their rates (N,), m/s, by names.

    The way of a hinge is its angle times the reach of the larger part that turns.
    """
    model, motions = build_mechanism(result.scene), {}
    for name, joint in result.scene.joints.items():
        if isinstance(joint, RevoluteJoint):
            ends = [part_of_point(result.scene, model, point) for point in joint.points]
            reach = max(model.parts[part].reach for part in ends if part != GROUND)
            angle, rate = joint_turning(result, name)
            motions[name] = reach * angle, reach * rate
    for slide in model.slides:
        if slide.name in result.scene.joints:
            speed = speed_along(slide, result.poses, result.rates)
            motions[slide.name] = length_along(slide, result.poses), speed
    return motions


def _reversals(time: FloatArray, way: FloatArray, rate: FloatArray, least: float) -> FloatArray:
    """Instants (K,) s at which a rate (N,) changes its sign; after a rest, the begin of the rest.

    Only extremes of the `way` (N,) count that it leaves by `least` or more on both sides. Between
    two samples the rate is linear.
    """
    from scipy.signal import find_peaks  # noqa: PLC0415 - a check needs no SciPy

    largest = float(np.abs(rate).max(initial=0.0))
    moving = np.flatnonzero(np.abs(rate) > NEGLIGIBLE * largest)
    turns = np.flatnonzero(rate[moving[1:]] * rate[moving[:-1]] < 0)
    before, after = moving[turns], moving[turns + 1]
    part = rate[before] / (rate[before] - rate[after])
    span = time[after] - time[before]
    crossing = time[before] + part * span
    instants = np.where(after == before + 1, crossing, time[before + 1])
    # Both ends of the run bound the first and the last way.
    extremes = np.concatenate([way[:1], np.interp(instants, time, way), way[-1:]])
    peaks = [find_peaks(side * extremes, prominence=least)[0] - 1 for side in (1.0, -1.0)]
    return np.asarray(instants[np.sort(np.concatenate(peaks))])

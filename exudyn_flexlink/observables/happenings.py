"""What happens in a run, in words: touches, lift-offs, impacts, reversals, rests, laps."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import build_mechanism, speed_along
from exudyn_flexlink.observables.points import joint_turning
from exudyn_flexlink.result import Interval, Result
from exudyn_flexlink.scene import RevoluteJoint

STANDS = 1e-9  # of a joint's largest rate: what is slower stands still, but for rounding
LEAST_WAY = 1e-9  # m or rad: a joint that could not move farther in the whole run never turns back


class Happening(NamedTuple):
    """What happened at `time` (s), in words, and `where`: a contact, a joint or a slot by name.

    `what` is one of ``touches``, ``lifts off``, ``slides off the face``, ``impact`` (speeds jump),
    ``turns back`` (a joint's rate changes its sign), ``comes to rest`` and ``moves again`` (dry
    friction holds a joint), ``lap`` (a point passes the seam of its closed slot).
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
        seen += [Happening(time, "comes to rest", name) for time in friction.begin.tolist()]
        seen += [Happening(time, "moves again", name) for time in ends.tolist()]
    for name, rate in _rates(result).items():
        back = _reversals(result.time, rate).tolist()
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


def _rates(result: Result) -> dict[str, FloatArray]:
    """How fast joints turn (rad/s) or slide (m/s), (N,) each, by their names."""
    joints = result.scene.joints
    hinges = [name for name, joint in joints.items() if isinstance(joint, RevoluteJoint)]
    slides = [slide for slide in build_mechanism(result.scene).slides if slide.name in joints]
    return {name: joint_turning(result, name)[1] for name in hinges} | {
        slide.name: speed_along(slide, result.poses, result.rates) for slide in slides
    }


def _reversals(time: FloatArray, rate: FloatArray) -> FloatArray:
    """Instants (K,) s at which a rate (N,) changes its sign; where it rests before, those of that.

    Between two samples the rate goes straight.
    """
    largest = float(np.abs(rate).max(initial=0.0))
    if largest * (time[-1] - time[0]) < LEAST_WAY:
        return np.zeros(0)
    moving = np.flatnonzero(np.abs(rate) > STANDS * largest)
    turns = np.flatnonzero(rate[moving[1:]] * rate[moving[:-1]] < 0)
    before, after = moving[turns], moving[turns + 1]
    part = rate[before] / (rate[before] - rate[after])
    span = time[after] - time[before]
    crossing = time[before] + part * span
    return np.where(after == before + 1, crossing, time[before + 1])

"""The largest Lyapunov exponent of a mechanism: runs that go on from states of another run.

The run gives the motion; between instants at which nothing presses, a neighbour of it, and the
run itself again, start from its state (see `continuing`). A state is of all parts, so that joints
bind its numbers; neighbours are put onto the joints as they are put together. Impacts do no harm:
both runs of a stretch start and end free, and what a difference does to an impact's instant shows
in where they are when it is over.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.continuing import continued, free_spans, moved, state_at
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.result import INTERRUPTED, Result
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.stability.exponent import (
    Exponent,
    Neighbours,
    TooShortError,
    Trajectory,
    largest_exponent,
)
from exudyn_flexlink.stability.laps import Rhythm

Simulate = Callable[[Scene], Result]
"""Runs a scene once: who calls knows the engine."""

STRETCHES = 16  # in a lap: impacts on stiff walls part neighbours a thousandfold in a quarter of it
ABOVE_ERROR = 1e3  # times the tolerance: how far neighbours are apart, well above its errors
MOST = 1e-3  # of the parts' reach: neighbours no farther apart, as they stand for infinitely near
EDGE = 0.04  # of a stretch: at least so far from any touch
NEAR = 0.25  # of a stretch: an instant farther from where one is wanted is left out


class StoppedError(ValueError):
    """A run that the exponent needs stopped before its end; the text says why."""


def require_whole(made: Result, told: str) -> None:
    """Refuse a run that stopped; `told` says so.

    Raises:
        KeyboardInterrupt: the user stopped it.
        StoppedError: it stopped for another reason.

    """
    if made.outcome.reason == INTERRUPTED:
        raise KeyboardInterrupt
    if not made.outcome.completed:
        raise StoppedError(told)


def exponent_of(
    result: Result,
    simulate: Simulate,
    rhythm: Rhythm,
    after: float = 0.0,
    progress: Callable[[float], None] | None = None,
) -> Exponent:
    """Measure the exponent along a run, from `after` (s) on, when its motion has settled.

    Stretches are sixteenths of a lap, and speeds count in distances as what they make in a radian
    of it. Growth scatters from one cycle to the next. `simulate` must run scenes as the run was.

    Raises:
        StoppedError: a run of a stretch stopped.
        TooShortError: the run is too short, or hardly ever free of contact.

    """
    scene = result.scene
    times = restarts(result, rhythm.lap / STRETCHES, after)
    states = np.array([state_at(result, time) for time in times])
    bases = [continued(result, time) for time in times[:-1]]
    by_begin = dict(zip(times.tolist(), bases, strict=False))

    def flow(state: FloatArray, begin: float, end: float) -> FloatArray:
        """Run a stretch from a state of all parts, one after the other."""
        base = by_begin[begin]
        run = type(scene.run)(duration=end - begin, sample=end - begin)
        there = moved(base, state.reshape(-1, 6)).changed(run=run)
        made = simulate(there)
        require_whole(made, f"from {begin:.6g} s on: {made.outcome.reason}")
        return np.concatenate([made.poses[-1], made.rates[-1]], axis=-1).ravel()

    motion = Trajectory(times, states.reshape(len(times), -1))
    near = Neighbours(distance_of(scene), rhythm.cycle, scales(scene, rhythm.lap))
    return largest_exponent(flow, motion, near, progress)


def restarts(result: Result, stretch: float, after: float = 0.0) -> FloatArray:
    """Instants (s) about a stretch (s) apart, from `after` on, at which nothing presses.

    Each is the sample with most room to the touches before and after it: neighbours touch a little
    earlier or later, and have to be free there, too.
    """
    room = _room(result, NEAR * stretch)
    free = (room >= EDGE * stretch) & (result.time >= after)
    times, room = result.time[free], room[free]
    if not len(times):
        raise TooShortError("the run is never free of contact, where another could go on")
    found = []
    for wanted in np.arange(after, float(result.time[-1]) + stretch / 2, stretch):
        away = np.abs(times - wanted)
        near = np.flatnonzero(away <= NEAR * stretch)
        found += [times[k] for k in near[np.lexsort((away[near], -room[near]))][:1]]
    if len(found) < 2:
        raise TooShortError(f"from {after:.4g} s on something presses nearly all the time")
    return np.array(found)


def _room(result: Result, enough: float) -> FloatArray:
    """Time (s) from each sample (N,) to the nearest touch, at most `enough`; 0 within a touch."""
    spans = free_spans(result)
    spans[spans == 0.0], spans[spans == result.time[-1]] = -np.inf, np.inf  # no touches
    if not len(spans):
        return np.zeros(len(result.time))
    k = np.searchsorted(spans[:, 0], result.time, side="right") - 1
    inside = np.minimum(result.time - spans[k, 0], spans[k, 1] - result.time)
    return np.where(k >= 0, np.clip(inside, 0.0, enough), 0.0)


def distance_of(scene: Scene) -> float:
    """How far neighbours are apart, m: well above the run's errors, well below its parts."""
    assembly = assemble_scene(scene)
    reach = min(part.reach for part in assembly.mechanism.parts if part.reach > 0)
    error = scene.accuracy.tolerance
    return min(MOST * reach, ABOVE_ERROR * error) if error is not None else MOST * reach


def scales(scene: Scene, lap: float) -> FloatArray:
    """What makes a metre of each number of a state (6 parts,), in the mean over the parts.

    Angles count by the reach of their part, rates by what they make in a radian of the lap.
    """
    parts = assemble_scene(scene).mechanism.parts
    lengths = np.array([[1.0, 1.0, part.reach] for part in parts])
    radian = lap / (2 * np.pi)
    whole = np.concatenate([lengths, radian * lengths], axis=1).ravel()
    return np.asarray(np.sqrt(len(parts)) / whole)

"""All that is told of the stability of a scene's motion, of one long run and its neighbours.

The largest Lyapunov exponent of a mechanism: runs that go on from states of another run.

The run gives the motion; between instants at which nothing presses, a neighbour of it, and the
run itself again, start from its state (see `continuing`). A state is of all parts, so that joints
bind its numbers; neighbours are put onto the joints as they are put together. Impacts do no harm:
both runs of a stretch start and end free, and what a difference does to an impact's instant shows
in where they are when it is over.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, inf, pi

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.continuing import continued, free_spans, moved, state_at
from exudyn_flexlink.loading import SHORTEST_RUN, assemble_scene, run_mistakes
from exudyn_flexlink.mechanism import extent, least_tolerance
from exudyn_flexlink.observables import Vibration, crank_joint, parting_limit, turns, vibration
from exudyn_flexlink.observables.parting import TIGHTER
from exudyn_flexlink.quantities import LARGEST
from exudyn_flexlink.result import INTERRUPTED, Result
from exudyn_flexlink.scene import Accuracy, Run, Scene
from exudyn_flexlink.shipped import AFTER, LAPS
from exudyn_flexlink.stability.exponent import (
    ALIKE,
    FEWEST,
    PHASES,
    SETTLE,
    Exponent,
    ImpossibleLapsError,
    LapDistances,
    Neighbours,
    Repeating,
    Rhythm,
    Section,
    TooShortError,
    Trajectory,
    lap_distances,
    largest_exponent,
    repeating,
    rhythm_of,
    section_by_crank,
    section_by_time,
)

Simulate = Callable[[Scene], Result]
"""Runs a scene once: who calls knows the engine."""

STRETCHES = 16  # in a lap: impacts on stiff walls part neighbours a thousandfold in a quarter of it
ABOVE_ERROR = 1e3  # times the tolerance: how far neighbours are apart, well above its errors
MOST = 1e-3  # of the parts' reach: neighbours no farther apart, as they stand for infinitely near
EDGE = 0.04  # of a stretch: at least so far from any touch
OFF_STRETCH = 0.25  # of a stretch: an instant farther from where one is wanted is left out


class StoppedError(ValueError):
    """A run that the exponent needs stopped before its end; the text says why."""


def require_whole(made: Result, message: str) -> None:
    """Refuse a run that stopped; `message` says so.

    Raises:
        KeyboardInterrupt: the user stopped it.
        StoppedError: it stopped for another reason.

    """
    if made.outcome.reason == INTERRUPTED:
        raise KeyboardInterrupt
    if not made.outcome.completed:
        raise StoppedError(message)


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
        start = moved(base, state.reshape(-1, 6)).changed(run=run)
        made = simulate(start)
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
    room = _room(result, OFF_STRETCH * stretch)
    free = (room >= EDGE * stretch) & (result.time >= after)
    times, room = result.time[free], room[free]
    if not len(times):
        raise TooShortError("the run is never free of contact, where another could go on")
    instants = []
    for wanted in np.arange(after, float(result.time[-1]) + stretch / 2, stretch):
        away = np.abs(times - wanted)
        near = np.flatnonzero(away <= OFF_STRETCH * stretch)
        instants += [times[k] for k in near[np.lexsort((away[near], -room[near]))][:1]]
    if len(instants) < 2:
        raise TooShortError(f"from {after:.4g} s on something presses nearly all the time")
    return np.array(instants)


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


FINE = 1e-8  # of the mechanism's extent: a tolerance that leaves room for neighbours above it
SAMPLES = 4  # between phases at which laps are compared: a thousand in a lap


@dataclass(frozen=True)
class Stability:
    """What one run of many laps, and its neighbours, tell of a motion.

    `run` is that run, from its start; laps, section, spectrum and exponent count from `after` (s)
    on, when it has settled. `tighter` is the exponent at a ten times smaller tolerance, None if not
    asked for; `horizon` (s) is for how long from its
    start, or from any state, the motion is known instant by instant at the run's tolerance, inf
    where neighbours do not part: until then laps and section are the motion's own, after it only
    their statistics are. `repeating` judges laps up to there; None if these are too few.
    """

    run: Result
    rhythm: Rhythm
    after: float
    exponent: Exponent
    tighter: Exponent | None
    laps: LapDistances
    repeating: Repeating | None
    section: Section
    vibration: Vibration
    horizon: float

    @property
    def point(self) -> str:
        """Name of the point that is looked at."""
        return self.laps.point

    @property
    def tolerance(self) -> float:
        """Error (m) that the run may make."""
        return float(self.run.scene.accuracy.tolerance or inf)

    @property
    def limit(self) -> float:
        """How far places of a section are apart (m) that count as two."""
        return max(parting_limit(self.run), ALIKE * self.tolerance)

    @property
    def behaviour(self) -> str:
        """What the motion does, in words."""
        if self.exponent.sign > 0:
            return "it never repeats itself, as neighbours part"
        return (
            "too few laps are known" if self.repeating is None else f"it {self.repeating.behaviour}"
        )


def long_scene(scene: Scene, rhythm: Rhythm, laps: int, tolerance: float | None) -> Scene:
    """Return the scene with so many laps, at a tolerance (m) that leaves room for neighbours."""
    assembly = assemble_scene(scene)
    given = scene.accuracy.tolerance
    fine = max(FINE * extent(assembly), least_tolerance(assembly) / TIGHTER)
    asked = tolerance if tolerance is not None else min(fine, given if given is not None else fine)
    # Phases of a lap are samples, so that nothing is interpolated where laps are compared.
    run = Run(duration=laps * rhythm.lap, sample=rhythm.lap / (SAMPLES * PHASES))
    long = scene.changed(run=run, accuracy=Accuracy(tolerance=asked))
    for mistake in run_mistakes(long):
        raise ImpossibleLapsError(
            f"{laps} laps of {rhythm.lap:.4g} s can't be run: the run {mistake.message}"
        )
    return long


def require_possible(laps: int, rhythm: Rhythm) -> None:
    """Refuse what would be no number of a run, or a stretch that is no run."""
    shortest, longest = STRETCHES * SHORTEST_RUN, LARGEST / max(laps, 1)
    if not shortest <= rhythm.lap <= longest:
        raise ImpossibleLapsError(
            f"a lap of {rhythm.lap:.4g} s can't be run: each of {laps} laps must take from "
            f"{shortest:.2g} to {longest:.2g} s"
        )


@dataclass(frozen=True)
class Asked:
    """What a study is of: so many `laps`, of which those up to `after` let the motion settle.

    A lap is a turn of the joint that a drive turns at one speed, or takes `lap` (s). The section is
    at a crank angle (rad) `angle`, or at that part of a lap, a whole one being 2 pi. `tolerance`
    (m) is by default one that leaves room for neighbours, see `long_scene`. With `twice` the
    exponent is made again at a ten times smaller tolerance; without it, whether the tolerance
    matters is told by the noise of the exponent alone.
    """

    laps: int = LAPS
    after: float = AFTER
    lap: float | None = None
    angle: float = 0.0
    tolerance: float | None = None
    twice: bool = False


def least_time(rhythm: Rhythm) -> float:
    """Shortest time (s) after the motion has settled that tells an exponent."""
    return (FEWEST / (1 - SETTLE) + 1) * rhythm.cycle


def study(
    scene: Scene, simulate: Simulate, asked: Asked, progress: Callable[[float], None] | None = None
) -> Stability:
    """Run a scene over many laps, whatever its own run is, and measure how stable its motion is.

    Raises:
        ImpossibleLapsError: no run can have such laps, or so many.
        NoRhythmError: nothing tells what a lap is.
        StoppedError: a run stopped before its end.
        TooShortError: there are too few laps.

    """
    rhythm = rhythm_of(scene, asked.lap)
    require_possible(asked.laps, rhythm)
    after = asked.after * rhythm.lap
    whole = asked.laps * rhythm.lap - after
    if whole < least_time(rhythm) * (1 - 1e-9):
        least = ceil((after + least_time(rhythm)) / rhythm.lap - 1e-9)
        raise TooShortError(f"too few laps to tell an exponent: at least {least}")
    scene = long_scene(scene, rhythm, asked.laps, asked.tolerance)
    tolerance = float(scene.accuracy.tolerance or inf)
    parts = 2 if asked.twice else 1
    run = _whole(simulate, scene)
    exponent = exponent_of(run, simulate, rhythm, after, _part(progress, 0, parts))
    tighter = None
    if asked.twice:
        again = _whole(simulate, scene.changed(accuracy=Accuracy(tolerance=TIGHTER * tolerance)))
        tighter = exponent_of(again, simulate, rhythm, after, _part(progress, 1, parts))
    horizon = exponent.horizon(tolerance, parting_limit(run)) if exponent.sign > 0 else inf
    laps = lap_distances(run, rhythm.lap, after=after)
    return Stability(
        run,
        rhythm,
        after,
        exponent,
        tighter,
        laps,
        repeating(laps, tolerance, horizon),
        _section(run, rhythm.lap, asked.angle, after),
        vibration(run, after),
        horizon,
    )


def _whole(simulate: Simulate, scene: Scene) -> Result:
    run = simulate(scene)
    require_whole(run, f"the run {run.outcome.ending}")
    return run


def _part(
    progress: Callable[[float], None] | None, which: int, parts: int
) -> Callable[[float], None] | None:
    """Progress of one part of as many."""
    if progress is None:
        return None
    return lambda done: progress((which + done) / parts)


def _section(run: Result, lap: float, angle: float, after: float) -> Section:
    if crank_joint(run.scene) is not None and turns(run):
        return section_by_crank(run, angle, after=after)
    return section_by_time(run, lap, angle / (2 * pi) % 1, after=after)

"""A study of the stability of a scene's motion, by a long run and its neighbours.

The largest Lyapunov exponent of a mechanism is measured by runs that go on from states of this run.
They start at instants without contact forces: a neighbour, and the run itself again, from its state
(see `continuing`). A state has coordinates of all parts, which joints bind; the assembly of a
neighbour closes its joints. Impacts do no harm: both runs of a stretch start and end without
contact, and a different instant of an impact shows in the states after it.
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
"""Runs a scene once; the caller chooses the engine."""

STRETCHES = (
    16  # in a lap: impacts on stiff walls part neighbours a thousandfold in a quarter of a lap
)
ABOVE_ERROR = 1e3  # times the tolerance: distance of neighbours, well above errors
MOST = 1e-3  # of the parts' reach: largest distance of neighbours, which stand for infinitely near
EDGE = 0.04  # of a stretch: least time from its ends to a touch
OFF_STRETCH = 0.25  # of a stretch: farthest instant from the wanted one


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

    Stretches are sixteenths of a lap. In distances, speeds count by their motion in a radian of the
    lap. Growth scatters from cycle to cycle. `simulate` must run scenes as the run was.

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
        """Run a stretch from a state of all parts in a row."""
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
    """Instants (s) about a stretch (s) apart, from `after` on, without contact forces.

    Each is the sample with the most time to touches before and after it: neighbours touch a little
    earlier or later, and must be free there, too.
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
    """Distance of neighbours, m: well above the run's errors, well below the size of parts."""
    assembly = assemble_scene(scene)
    reach = min(part.reach for part in assembly.mechanism.parts if part.reach > 0)
    error = scene.accuracy.tolerance
    return min(MOST * reach, ABOVE_ERROR * error) if error is not None else MOST * reach


def scales(scene: Scene, lap: float) -> FloatArray:
    """Value of each number of a state (6 parts,) that counts as a metre, in the mean over parts.

    Angles count by the reach of their part, rates by their motion in a radian of the lap.
    """
    parts = assemble_scene(scene).mechanism.parts
    lengths = np.array([[1.0, 1.0, part.reach] for part in parts])
    radian = lap / (2 * np.pi)
    whole = np.concatenate([lengths, radian * lengths], axis=1).ravel()
    return np.asarray(np.sqrt(len(parts)) / whole)


FINE = 1e-8  # of the mechanism's extent: a tolerance well below the distance of neighbours
SAMPLES = 4  # per phase at which laps are compared: a thousand in a lap


@dataclass(frozen=True)
class Stability:
    """Results of a run of many laps and its neighbours.

    `run` is the whole run; laps, section, spectrum and exponent count from `after` (s) on, when the
    motion has settled. `tighter` is the exponent at a ten times smaller tolerance, if it was asked
    for. `horizon` (s) is the time, from any state, in which the motion is known at single instants
    at the run's tolerance; inf if neighbours do not part. Beyond it laps and section are true as
    statistics only. `repeating` compares laps up to the horizon; None if they are too few.
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
        """Name of the point of laps and section."""
        return self.laps.point

    @property
    def tolerance(self) -> float:
        """Error (m) that the run may make."""
        return float(self.run.scene.accuracy.tolerance or inf)

    @property
    def limit(self) -> float:
        """Least distance (m) of two places of a section that count as different."""
        return max(parting_limit(self.run), ALIKE * self.tolerance)

    @property
    def behaviour(self) -> str:
        """Behaviour of the motion, in words."""
        if self.exponent.sign > 0:
            return "it never repeats itself, as neighbours part"
        return (
            "too few laps are known" if self.repeating is None else f"it {self.repeating.behaviour}"
        )


def long_scene(scene: Scene, rhythm: Rhythm, laps: int, tolerance: float | None) -> Scene:
    """Return the scene with this number of laps, at a tolerance (m) below neighbours' distance."""
    assembly = assemble_scene(scene)
    given = scene.accuracy.tolerance
    fine = max(FINE * extent(assembly), least_tolerance(assembly) / TIGHTER)
    asked = tolerance if tolerance is not None else min(fine, given if given is not None else fine)
    # Phases of a lap are samples, so that comparing laps needs no interpolation.
    run = Run(duration=laps * rhythm.lap, sample=rhythm.lap / (SAMPLES * PHASES))
    long = scene.changed(run=run, accuracy=Accuracy(tolerance=asked))
    for mistake in run_mistakes(long):
        raise ImpossibleLapsError(
            f"{laps} laps of {rhythm.lap:.4g} s can't be run: the run {mistake.message}"
        )
    return long


def require_possible(laps: int, rhythm: Rhythm) -> None:
    """Refuse laps whose run would be too long, or whose stretches would be too short."""
    shortest, longest = STRETCHES * SHORTEST_RUN, LARGEST / max(laps, 1)
    if not shortest <= rhythm.lap <= longest:
        raise ImpossibleLapsError(
            f"a lap of {rhythm.lap:.4g} s can't be run: each of {laps} laps must take from "
            f"{shortest:.2g} to {longest:.2g} s"
        )


@dataclass(frozen=True)
class Asked:
    """Options of a study: the number of `laps`; the motion settles in the first `after` of them.

    A lap is a turn of the joint that a drive turns at constant speed, or takes `lap` (s). The
    section is at the crank `angle` (rad), or at this part of a lap, with 2 pi for a whole lap. The
    default `tolerance` (m) is well below the distance of neighbours, see `long_scene`. With `twice`
    the exponent is also measured at a ten times smaller tolerance; without it, only the noise of
    the exponent shows whether the tolerance matters.
    """

    laps: int = LAPS
    after: float = AFTER
    lap: float | None = None
    angle: float = 0.0
    tolerance: float | None = None
    twice: bool = False


def least_time(rhythm: Rhythm) -> float:
    """Shortest time (s), after settling, from which an exponent can be measured."""
    return (FEWEST / (1 - SETTLE) + 1) * rhythm.cycle


def study(
    scene: Scene, simulate: Simulate, asked: Asked, progress: Callable[[float], None] | None = None
) -> Stability:
    """Run a scene over many laps, instead of its `run`, and measure the stability of its motion.

    Raises:
        ImpossibleLapsError: a run can't have such laps, or so many.
        NoRhythmError: the duration of a lap is not determined.
        StoppedError: a run stopped before its end.
        TooShortError: the laps are too few.

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
    """Progress of one of several parts."""
    if progress is None:
        return None
    return lambda done: progress((which + done) / parts)


def _section(run: Result, lap: float, angle: float, after: float) -> Section:
    if crank_joint(run.scene) is not None and turns(run):
        return section_by_crank(run, angle, after=after)
    return section_by_time(run, lap, angle / (2 * pi) % 1, after=after)

"""All that is told of the stability of a scene's motion, of one long run and its neighbours."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, inf, pi

from exudyn_flexlink.loading import SHORTEST_RUN, assemble_scene, run_mistakes
from exudyn_flexlink.mechanism import extent, least_tolerance
from exudyn_flexlink.observables import Vibration, crank_joint, parting_limit, turns, vibration
from exudyn_flexlink.quantities import LARGEST
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Accuracy, Run, Scene
from exudyn_flexlink.stability.exponent import FEWEST, SETTLE, Exponent, TooShortError
from exudyn_flexlink.stability.laps import (
    ALIKE,
    PHASES,
    ImpossibleLapsError,
    LapDistances,
    Repeating,
    Rhythm,
    lap_distances,
    repeating,
    rhythm_of,
)
from exudyn_flexlink.stability.neighbours import STRETCHES, Simulate, exponent_of, require_whole
from exudyn_flexlink.stability.sections import Section, section_by_crank, section_by_time

FINE = 1e-8  # of the mechanism's extent: a tolerance that leaves room for neighbours above it
SAMPLES = 4  # between phases at which laps are compared: a thousand in a lap
TIGHTER = 0.1  # times the tolerance: of a second look, which tells whether it matters


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
    def told(self) -> str:
        """What the motion does, in words."""
        if self.exponent.sign > 0:
            return "it never repeats itself, as neighbours part"
        return "too few laps are known" if self.repeating is None else f"it {self.repeating.told}"


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

    laps: int = 24
    after: float = 4
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
    require_whole(run, f"the run {run.outcome.told}")
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

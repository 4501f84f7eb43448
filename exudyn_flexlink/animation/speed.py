"""How fast a film plays, and which instants its frames show."""

from __future__ import annotations

from dataclasses import dataclass
from math import log10

import numpy as np

from exudyn_flexlink.animation.film import Film, FilmError
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables import crank_angle, turns

SECONDS = 9.0  # of a film
OF_A_TURN = 3.0  # s: a crank that goes round faster can't be followed by the eye
SLOW_SECONDS = 4.0  # of a film, that a stretch of slow motion lasts
MOST_FRAMES = 50_000  # half an hour
STEPS = (1.0, 2.0, 5.0, 10.0)  # of speeds, in each power of ten


@dataclass(frozen=True)
class Frames:
    """Instants (K,) s of the run that the frames show, and `seconds` (K,) of the film at which.

    `speeds` (K,) are those of the film there, s of the run per s; `speed` that without slow motion.
    """

    times: FloatArray
    seconds: FloatArray
    speeds: FloatArray
    speed: float

    def since(self, instants: FloatArray, frame: int) -> FloatArray:
        """How long ago (s) in the film instants of the run were, at a frame; 0 if not yet."""
        shown = np.interp(instants, self.times, self.seconds)
        return np.asarray(np.maximum(self.seconds[frame] - shown, 0.0))


def usual_speed(film: Film) -> float:
    """Return the speed at which a film is seen best, 1, 2 or 5 times a power of ten.

    The film lasts some seconds, and longer where a crank makes many turns.
    """
    result = film.takes[0].result
    seconds = SECONDS
    if turns(result):
        angle = np.interp([film.begin, film.end], result.time, crank_angle(result))
        seconds = max(seconds, OF_A_TURN * float(abs(angle[1] - angle[0])) / (2 * np.pi))
    speed = (film.end - film.begin) / seconds
    power = 10.0 ** np.floor(log10(speed))
    nearest = min(STEPS, key=lambda step: abs(log10(step * power / speed)))
    return float(f"{nearest * power:.0e}")


def frames_of(film: Film, fps: float, speed: float) -> Frames:
    """Return the frames of a film, `fps` in a second; the last shows its end.

    Raises:
        FilmError: they are too many.

    """
    edges, speeds = _paces(film, speed)
    lasts = np.diff(edges) / speeds
    seconds = np.concatenate([[0.0], np.cumsum(lasts)])
    if seconds[-1] * fps > MOST_FRAMES:
        raise FilmError(
            f"too long: the film would last {seconds[-1]:.3g} s, {seconds[-1] * fps:.3g} frames; "
            "show a part of the run, or play it faster"
        )
    count = max(2, round(seconds[-1] * fps) + 1)
    at = np.linspace(0.0, seconds[-1], count)
    inside = np.clip(np.searchsorted(seconds, at, side="right") - 1, 0, len(speeds) - 1)
    return Frames(np.interp(at, seconds, edges), at, speeds[inside], speed)


def _paces(film: Film, speed: float) -> tuple[FloatArray, FloatArray]:
    """Edges (K + 1,) s of the times of one speed, and these (K,): slower in slow motion."""
    ends = (end for own in film.slow for end in (own.begin, own.end))
    edges = np.unique([film.begin, *ends, film.end])
    speeds = np.full(len(edges) - 1, speed)
    for own in film.slow:
        inside = (edges[:-1] >= own.begin) & (edges[1:] <= own.end)
        speeds[inside] = min(speed, (own.end - own.begin) / SLOW_SECONDS)
    return edges, speeds

"""Instants and speeds of a film, and the contents of its frames."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import log10

import numpy as np

from exudyn_flexlink.animation.film import (
    Film,
    FilmError,
    Take,
    Touching,
    Zoom,
    strength,
    touching_of,
    zooms_of,
)
from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.mechanism import anchor_position
from exudyn_flexlink.observables import crank_angle, turns
from exudyn_flexlink.plots.outline import walled

PRECISE = 1 / 4000  # of the picture: error of a path, a pixel of a large screen
OF_CLEARANCE = 1 / 40  # of a clearance, which is enlarged: error of a path
MOST = 1_000_000  # most numbers of all poses: a page of about 6 megabytes
LOOSER = 1.6  # factor of the allowed error, repeated until at most MOST numbers remain
SECONDS = 9.0  # s: duration of a film
OF_A_TURN = 3.0  # s: shortest turn of a crank in a film; the eye can't follow a faster one
SLOW_SECONDS = 4.0  # s: duration of a stretch of slow motion in the film
GLOW_SECONDS = 0.45  # s of the film: a touch stays visible for this time after its end
LABELLED = 0.12  # of the largest force: weaker touches in a joint have no number
MOST_FRAMES = 50_000  # half an hour
STEPS = (1.0, 2.0, 5.0, 10.0)  # speeds in each power of ten


@dataclass(frozen=True)
class Frames:
    """The frames of a film. Frame k shows the run at `times[k]`, s.

    Its time in the film is `seconds[k]`, s. `speeds[k]` is the speed there, in s of the run
    per s of the film; `speed` is the speed without slow motion. The arrays have the shape (K,).
    """

    times: FloatArray
    seconds: FloatArray
    speeds: FloatArray
    speed: float

    def since(self, instants: FloatArray, frame: int) -> FloatArray:
        """Return the film's time (s) from instants of the run to a frame; 0 for later instants."""
        shown = np.interp(instants, self.times, self.seconds)
        return np.asarray(np.maximum(self.seconds[frame] - shown, 0.0))


def usual_speed(film: Film) -> float:
    """Return the usual speed of a film: 1, 2 or 5 times a power of ten.

    The film lasts some seconds, and longer if a crank makes many turns.
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
    """Return the frames of a film, `fps` per second; the last frame shows its end.

    Raises:
        FilmError: there are too many frames.

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
    shown = np.linspace(0.0, seconds[-1], count)
    inside = np.clip(np.searchsorted(seconds, shown, side="right") - 1, 0, len(speeds) - 1)
    return Frames(np.interp(shown, seconds, edges), shown, speeds[inside], speed)


def _paces(film: Film, speed: float) -> tuple[FloatArray, FloatArray]:
    """Return the limits (K + 1,) s of intervals with constant speed, and their speeds (K,)."""
    ends = (end for interval in film.slow for end in (interval.begin, interval.end))
    edges = np.unique([film.begin, *ends, film.end])
    speeds = np.full(len(edges) - 1, speed)
    for span in film.slow:
        inside = (edges[:-1] >= span.begin) & (edges[1:] <= span.end)
        speeds[inside] = min(speed, (span.end - span.begin) / SLOW_SECONDS)
    return edges, speeds


def kept_instants(film: Film, take: Take) -> tuple[FloatArray, float]:
    """Return instants (K,) s to keep, and the largest error (m) of straight lines between them.

    During a strike that a zoom shows, the error is smaller by the zoom's factor.
    """
    instants = take.result.time
    inside = instants[(instants > film.begin) & (instants < film.end)]
    times = np.concatenate([[film.begin], inside, [film.end]])
    poses = take.poses(times)
    # An angle counts as the distance that it moves the end of its part.
    scales = np.array([(1.0, 1.0, part.reach) for part in take.model.parts])
    values = (poses * scales).reshape(len(times), -1)
    plays = [channel.clearance for channel in walled(take.model)]
    plays += [bearing.distance for bearing in take.model.bearings]
    plays += [groove.clearance for groove in take.model.grooves]
    allowed = min([PRECISE * film.size, *(OF_CLEARANCE * play for play in plays)])
    parts = _parts_allowed(film, take, times)
    most = max(2, MOST // max(values.shape[1], 1) // len(film.takes))
    while True:
        kept = straightened(times, values, allowed * parts)
        if len(kept) <= most:
            return times[kept], allowed
        allowed *= LOOSER


def _parts_allowed(film: Film, take: Take, times: FloatArray) -> FloatArray:
    """Return the allowed error at instants (N,), over the allowed error outside strikes."""
    faces = [zoom.length for zoom in zooms_of(film, take) if zoom.channel is None]
    part = min(faces, default=film.size) / film.size
    striking = np.zeros(len(times), dtype=bool)
    for strike in film.strikes:
        striking |= (times >= strike.begin) & (times <= strike.end)
    return np.where(striking, part, 1.0)


def straightened(times: FloatArray, values: FloatArray, allowed: FloatArray) -> IndexArray:
    """Return the indices of samples to be joined by straight lines.

    The lines follow `values` (N, k) with an error of at most `allowed` (N,). This is the algorithm
    of Ramer, Douglas and Peucker: it keeps the sample farthest from a line, and repeats this for
    both parts.
    """
    kept = {0, len(times) - 1}
    left = [(0, len(times) - 1)]
    while left:
        first, last = left.pop()
        if last - first < 2:
            continue
        part = (times[first + 1 : last] - times[first]) / (times[last] - times[first])
        line = values[first] + part[:, None] * (values[last] - values[first])
        off = np.max(np.abs(values[first + 1 : last] - line), axis=1) / allowed[first + 1 : last]
        worst = int(np.argmax(off))
        if off[worst] > 1:
            middle = first + 1 + worst
            kept.add(middle)
            left += [(first, middle), (middle, last)]
    return np.array(sorted(kept), dtype=np.intp)


@dataclass(frozen=True)
class Glow:
    """A touch in a frame: its `place` (2,) m, its `strength` and its freshness `fresh`, 0 to 1.

    `name` is the name of the contact or joint. `frame` is the number of the frame from which the
    place comes: a touch of a contact that has ended does not move any more.
    """

    name: str
    frame: int
    place: FloatArray
    strength: float
    fresh: float
    text: str


@dataclass(frozen=True)
class Shots:
    """A run at the instants of the frames."""

    film: Film
    take: Take
    frames: Frames

    @cached_property
    def poses(self) -> FloatArray:
        """Poses (K, parts, 3)."""
        return self.take.poses(self.frames.times)

    @cached_property
    def crank(self) -> FloatArray | None:
        """Angle (K,) of the crank, rad; None without a crank."""
        return self.take.crank(self.frames.times)

    @cached_property
    def path(self) -> tuple[FloatArray, FloatArray]:
        """Path of S in the film: instants (N,) s and places (N, 2) m, joined by straight lines."""
        times, _ = kept_instants(self.film, self.take)
        return times, anchor_position(self.take.watched, self.take.poses(times))

    @cached_property
    def watched(self) -> FloatArray:
        """Places (K, 2) of S, m."""
        return anchor_position(self.take.watched, self.poses)

    @cached_property
    def touching(self) -> list[Touching]:
        """Contacts and joints that may touch."""
        return touching_of(self.film, self.take)

    @cached_property
    def zooms(self) -> dict[str, Zoom]:
        """Zooms by name."""
        return {zoom.name: zoom for zoom in zooms_of(self.film, self.take)}

    def forces(self, touching: Touching, frame: int) -> FloatArray:
        """Return the forces (pairs,) of a contact or joint at a frame."""
        return np.asarray(touching.forces(self.take, self.frames.times[frame : frame + 1])[0])

    def glows(self, frame: int) -> list[Glow]:
        """Return the touches in a frame: present ones, and for some time those that ended."""
        lights: list[Glow] = []
        for touching in self.touching:
            values, shown = strength(touching.touches), list(self._shown(touching, frame))
            parts = {k: self.film.part(float(values[k])) for k, _ in shown}
            # In a burst of touches only the brightest has a number.
            brightest, _ = max(
                shown, key=lambda touch: parts[touch[0]] * touch[1], default=(None, 0.0)
            )
            for k, fresh in shown:
                pair = int(touching.touches.pair[k]) if touching.places is not None else 0
                matters = k == brightest and (touching.places is None or parts[k] > LABELLED)
                pressing = float(self.forces(touching, frame)[pair]) if fresh == 1 else None
                text = _label(float(values[k]), pressing, touching.unit) if matters else ""
                placed = self._placing_frame(touching, k, frame)
                place = touching.spots(self.take, self.frames.times[placed : placed + 1])[0, pair]
                lights.append(Glow(touching.name, placed, place, parts[k], fresh, text))
        return lights

    def _shown(self, touching: Touching, frame: int) -> Iterator[tuple[int, float]]:
        """Yield the touches that are visible in a frame, and their freshness."""
        ended = touching.touches.until(float(self.take.result.time[-1]))
        fresh = 1 - self.frames.since(ended, frame) / GLOW_SECONDS
        begun = touching.touches.begin <= self.frames.times[frame]
        for k in np.flatnonzero(begun & (fresh > 0)).tolist():
            yield k, float(fresh[k])

    def _placing_frame(self, touching: Touching, k: int, frame: int) -> int:
        """Return the frame from which touch k has its place in frame `frame`; see `Glow`."""
        if touching.places is not None:
            return frame
        last = int(np.searchsorted(self.frames.times, touching.touches.end[k], side="right")) - 1
        return min(max(last, 0), frame)


def _label(value: float, pressing: float | None, unit: str) -> str:
    """Return the text of a touch: its present force; after its end the peak, or the impulse."""
    if value == 0:
        return ""
    if value < 0:
        return f"{_three_digits(-value)} {unit} s"
    if pressing is None:
        return f"0 {unit}, was {_three_digits(value)} {unit}"
    return f"{_three_digits(pressing)} {unit}" if pressing > 0 else f"0 {unit}"


def _three_digits(size: float) -> str:
    return f"{size:.0f}" if size >= 1000 else f"{size:#.3g}".rstrip(".")

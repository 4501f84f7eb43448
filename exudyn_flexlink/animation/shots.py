"""What the frames of a film show of a take: poses, the crank, the trail of S, glowing touches."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from exudyn_flexlink.animation.film import Film, Take, Touching, strength, touching_of
from exudyn_flexlink.animation.look import GLOW_SECONDS, LABELLED
from exudyn_flexlink.animation.samples import kept_instants
from exudyn_flexlink.animation.speed import Frames
from exudyn_flexlink.animation.zooms import Zoom, zooms_of
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import anchor_position


@dataclass(frozen=True)
class Glow:
    """A touch as a frame shows it: at `place` (2,) m, `strength` and how `fresh` it is, 0 to 1.

    `name` is that of what touches, `frame` the one at which it was there.
    """

    name: str
    frame: int
    place: FloatArray
    strength: float
    fresh: float
    text: str


@dataclass(frozen=True)
class Shots:
    """A take at the instants of the frames."""

    film: Film
    take: Take
    frames: Frames

    @cached_property
    def poses(self) -> FloatArray:
        """Poses (K, parts, 3)."""
        return self.take.poses(self.frames.times)

    @cached_property
    def crank(self) -> FloatArray | None:
        """Angle (K,) of the crank, rad; None without one."""
        return self.take.crank(self.frames.times)

    @cached_property
    def path(self) -> tuple[FloatArray, FloatArray]:
        """Where S goes within the film: instants (N,) s, places (N, 2) m; straight between them."""
        times, _ = kept_instants(self.film, self.take)
        return times, anchor_position(self.take.watched, self.take.poses(times))

    @cached_property
    def watched(self) -> FloatArray:
        """Where S is (K, 2), m."""
        return anchor_position(self.take.watched, self.poses)

    @cached_property
    def touching(self) -> list[Touching]:
        """All that can touch."""
        return touching_of(self.film, self.take)

    @cached_property
    def zooms(self) -> dict[str, Zoom]:
        """What is drawn larger, by name."""
        return {zoom.name: zoom for zoom in zooms_of(self.film, self.take)}

    def forces(self, own: Touching, frame: int) -> FloatArray:
        """Forces (pairs,) N of what touches, at a frame."""
        return np.asarray(own.forces(self.take, self.frames.times[frame : frame + 1])[0])

    def glows(self, frame: int) -> list[Glow]:
        """Touches that a frame shows: those that touch, and for a while those that did."""
        found: list[Glow] = []
        for own in self.touching:
            values, shown = strength(own.touches), list(self._shown(own, frame))
            parts = {k: self.film.part(float(values[k])) for k, _ in shown}
            # Of a burst of touches one is told in numbers.
            told = max(shown, key=lambda seen: parts[seen[0]] * seen[1], default=(None, 0.0))[0]
            for k, fresh in shown:
                pair = int(own.touches.pair[k]) if own.places is not None else 0
                matters = k == told and (own.places is None or parts[k] > LABELLED)
                pressing = float(self.forces(own, frame)[pair]) if fresh == 1 else 0.0
                text = _told(float(values[k]), pressing) if matters else ""
                seen = self._seen_at(own, k, frame)
                place = own.spots(self.take, self.frames.times[seen : seen + 1])[0, pair]
                found.append(Glow(own.name, seen, place, parts[k], fresh, text))
        return found

    def _shown(self, own: Touching, frame: int) -> Iterator[tuple[int, float]]:
        """Touches that are seen at a frame, and how fresh they are."""
        ended = own.touches.until(float(self.take.result.time[-1]))
        fresh = 1 - self.frames.since(ended, frame) / GLOW_SECONDS
        begun = own.touches.begin <= self.frames.times[frame]
        for k in np.flatnonzero(begun & (fresh > 0)).tolist():
            yield k, float(fresh[k])

    def _seen_at(self, own: Touching, k: int, frame: int) -> int:
        """Frame whose place a touch has: what has ended in a contact stays where it was."""
        if own.places is not None:
            return frame
        last = int(np.searchsorted(self.frames.times, own.touches.end[k], side="right")) - 1
        return min(max(last, 0), frame)


def _told(value: float, pressing: float) -> str:
    """A force in N, that which presses, else the largest; of an impact its impulse in N s."""
    if value == 0:
        return ""
    if value < 0:
        return f"{_digits(-value)} N s"
    return f"{_digits(pressing if pressing > 0 else value)} N"


def _digits(value: float) -> str:
    return f"{value:.0f}" if value >= 1000 else f"{value:#.3g}".rstrip(".")

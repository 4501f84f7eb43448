"""The track of P, piece by piece, and where the guide's axis crosses it.

Without play P is where the axis from the guide's pivot C, along e, crosses the track: with
``w = gamma(u) - C`` and x the 2D cross product, ``e x w = 0``. Differentiated by the angle, with
``sigma = e x gamma_u`` and ``r = e.w``:

    u' = r / sigma,    u'' = (2 (e.gamma_u) u' - (e x gamma_uu) u'^2) / sigma
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.curves import Places
from exudyn_flexlink.engines.track_follower import DeadCentreError, TrackFollower

NEWTON_STEPS = 30
NEAR = 1e-8  # of the parameter: a last change
LEAST_PART = 1e-6  # of the way that the guide has turned
LEAST_SLOPE = 1e-9  # sine of the angle between guide and track at a dead centre
NEARLY = 1e-5  # likewise, where steps got too short to go on
SLANTING = 1e-2  # likewise, where a track that is lost was not touched
TOUCHES = "the guide's axis touches the track"
MISSES = "the guide's axis misses the track"


class TrackPoint(TrackFollower):
    """The track of P; `u` is where P was after the last accepted step, on the present piece.

    Every search starts there: trial steps leave no trace, but for the `trouble` of the last one
    that found no place.
    """

    trouble = ""

    @property
    def at(self) -> Callable[[FloatArray], Places]:
        """Places and two derivatives (m,) at parameters (m,) of the present piece."""
        return self.curve.pieces[self.piece].places

    def crossed(self, centre: complex, axes: ComplexArray) -> tuple[FloatArray, Places]:
        """Where axes (m,) from `centre` cross the present piece: u, and gamma and by the angle.

        Of several crossings it is the one that P comes to from its last place: along the way, which
        is gone in parts that are sure, the axis must not be tangential to the track, nor P pass the
        pivot.

        Raises:
            DeadCentreError: there is none.

        """
        u, done, part = np.full(len(axes), self.u), 0.0, 1.0
        places = self.at(u)
        home = places[0] - centre
        # The axis may have turned so far that P is on its other side: half turns do not count.
        turned = np.mod(np.angle(axes / home) + np.pi / 2, np.pi) - np.pi / 2
        rays = axes * np.where((axes / home * np.exp(-1j * turned)).real > 0, 1.0, -1.0)
        while done < 1.0:
            now, ahead = (rays * np.exp(1j * (to - 1.0) * turned) for to in (done, done + part))
            found = self._near(centre, (now, ahead), part * turned, (u, places))
            if found is not None:
                done += part
                (u, places), part = found, min(2 * part, 1.0 - done)
                continue
            part /= 2
            if part < LEAST_PART:
                first = places[1]
                slanting = np.abs((now.conj() * first).imag) > SLANTING * np.abs(first)
                self.trouble = MISSES if slanting.all() else TOUCHES
                raise DeadCentreError(self.trouble)
        place, by_u, by_uu = places
        rate, bend = _by_angle(centre, rays, places)
        return u, (place, by_u * rate, by_uu * rate**2 + by_u * bend)

    def _near(
        self,
        centre: complex,
        rays: tuple[ComplexArray, ComplexArray],
        turned: FloatArray,
        last: tuple[FloatArray, Places],
    ) -> tuple[FloatArray, Places] | None:
        """Go along with rays to where they are ahead, by Newton's method; None if that is not sure.

        Seen along the ray there is one crossing on the way if the track bends there so little.
        """
        (now, ahead), (home, known) = rays, last
        back, by_u = ahead.conj(), known[1]
        was, before = (now.conj() * by_u).imag, np.abs((back * by_u).imag)
        if np.any(np.abs(was) < LEAST_SLOPE * np.abs(by_u)):
            return None
        rate, bend = _by_angle(centre, now, known)
        u, largest = home + turned * (rate + 0.5 * turned * bend), np.inf
        for _ in range(NEWTON_STEPS):
            place, first, second = places = self.at(u)
            slope, away = (back * first).imag, back * (place - centre)
            if largest <= NEAR * (1 + abs(self.u)):  # quadratic: the last step made it exact
                break
            step = away.imag / slope
            u, before_it, largest = u - step, largest, float(np.abs(step).max())
            if not largest < before_it:
                return None
        bends = max(np.abs(second).max(), np.abs(known[2]).max())
        steep = bends * np.abs(u - home) <= np.minimum(np.abs(slope), before)
        enough = np.abs(slope) >= LEAST_SLOPE * np.abs(first)
        return (u, places) if (steep & enough & (slope * was > 0) & (away.real > 0)).all() else None

    def touched_by_axis(self, centre: complex) -> str:
        """Say so if P is so near to a dead centre that its place is as good as undecided."""
        place, first, _ = (own[0] for own in self.at(np.array([self.u])))
        ray = (place - centre).conjugate()
        return TOUCHES if abs((ray * first).imag) < NEARLY * abs(ray * first) else ""

    @property
    def shift(self) -> float:
        """By how much the parameter of the whole curve is more than that of the present piece."""
        return float(self.curve.breaks[self.piece] - self.present.start)


def _by_angle(centre: complex, rays: ComplexArray, places: Places) -> tuple[FloatArray, FloatArray]:
    """Two derivatives of places u by the angle of the rays that cross the track there."""
    place, by_u, by_uu = places
    back = rays.conj()
    slope = (back * by_u).imag
    rate = (back * (place - centre)).real / slope
    return rate, (2 * (back * by_u).real * rate - (back * by_uu).imag * rate**2) / slope

"""The track of P, piece by piece, and where the guide's axis crosses it.

Without play P is where the axis from the guide's pivot C, along e, crosses the track: with
``w = gamma(u) - C`` and x the 2D cross product, ``e x w = 0``. Differentiated by the angle, with
``sigma = e x gamma_u`` and ``r = e.w``:

    u' = r / sigma,    u'' = (2 (e.gamma_u) u' - (e x gamma_uu) u'^2) / sigma
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.curves import Places
from exudyn_flexlink.engines.track_follower import DeadCentreError, TrackFollower

NEWTON_STEPS = 30
NEAR = 1e-8  # of the parameter: a last change
LEAST_PART = 1e-6  # of the way that the guide has turned
LOOKS = 5  # on the way of a step of Newton's method, for how much the track bends there
LEAST_SLOPE = 1e-9  # sine of the angle between guide and track at a dead centre
NEARLY = 1e-5  # likewise, where steps got too short to go on
TOUCHES = "the guide's axis touches the track"
MISSES = "the guide's axis misses the track"


class TrackPoint(TrackFollower):
    """The track of P; `u` is where P was after the last accepted step, on the present piece.

    Every search starts there: trial steps leave no trace.
    """

    _from: tuple[Any, ...] = ()  # piece and u, and `_ways` from there

    @property
    def at(self) -> Callable[[FloatArray], Places]:
        """Places and two derivatives (m,) at parameters (m,) of the present piece."""
        return self.curve.pieces[self.piece].places

    def crossed(self, centre: complex, axes: ComplexArray) -> tuple[FloatArray, Places]:
        """Where axes (m,) from `centre` cross the present piece: u, and gamma and by the angle.

        Of several crossings it is the one that P comes to from its last place: along the way the
        axis must not be tangential to the track, nor P pass the pivot.

        Raises:
            DeadCentreError: there is none.

        """
        if self._from[:2] != (self.piece, self.u):
            self._from = (self.piece, self.u, *self._ways(centre))
        *_, home, by_u, was, rate, bend = self._from
        back = axes.conj()
        # The axis may have turned so far that P is on its other side: half turns do not count.
        turned = np.mod(np.angle(axes / home) + np.pi / 2, np.pi) - np.pi / 2
        u, largest = self.u + turned * (rate + 0.5 * turned * bend), np.inf
        before = np.abs((back * by_u).imag)
        for _ in range(NEWTON_STEPS):
            place, first, second = places = self.at(u)
            slope, away = (back * first).imag, back * (place - centre)
            if largest <= NEAR * (1 + abs(self.u)):  # quadratic: the last step made it exact
                break
            step = away.imag / slope
            u, last, largest = u - step, largest, float(np.abs(step).max())
            if not largest < last:
                return self._walked(centre, axes)
        # Seen along the axis there is one crossing between here and home, if it bends so little.
        steep = np.abs(second).max() * np.abs(u - self.u) <= np.minimum(np.abs(slope), before)
        same_side = (slope * away.real * was > 0) & ((back * home).real * away.real > 0)
        if not (steep & same_side).all():
            return self._walked(centre, axes)
        return u, self._by_angle(centre, axes, places)

    def _ways(self, centre: complex) -> tuple[complex, complex, float, float, float]:
        """P's last place from the pivot, by u; the track's slope across the ray; u by the angle.

        Of that the first two derivatives.

        Raises:
            DeadCentreError: the track touches the ray.

        """
        place, first, second = (complex(own[0]) for own in self.at(np.array([self.u])))
        home = place - centre
        back = home.conjugate() / abs(home)
        slope, along, across = (back * first).imag, (back * first).real, (back * second).imag
        if abs(slope) < LEAST_SLOPE * abs(first):
            raise DeadCentreError(TOUCHES)
        rate = abs(home) / slope
        return home, first, slope, rate, (2 * along * rate - across * rate**2) / slope

    def touched_by_axis(self, centre: complex) -> str:
        """Say so if P is so near to a dead centre that its place is as good as undecided."""
        place, first, _ = (own[0] for own in self.at(np.array([self.u])))
        ray = (place - centre).conjugate()
        return TOUCHES if abs((ray * first).imag) < NEARLY * abs(ray * first) else ""

    def _walked(self, centre: complex, axes: ComplexArray) -> tuple[FloatArray, Places]:
        """As `crossed`, axis by axis, in parts of the way that are sure."""
        u = np.array([self._walk(centre, axis) for axis in axes.tolist()])
        return u, self._by_angle(centre, axes, self.at(u))

    def _walk(self, centre: complex, axis: complex) -> float:
        u, done, part = self.u, 0.0, 1.0
        start = complex(self.at(np.array([u]))[0][0]) - centre
        way = np.angle(axis / start)
        if abs(way) > np.pi / 2:  # the guide's axis goes on behind its pivot
            way, axis = np.angle(-axis / start), -axis
        while part > LEAST_PART:
            ahead = min(1.0, done + part)
            found = self._newton(centre, axis * np.exp(1j * (ahead - 1.0) * way), u)
            if found is None:
                part /= 2
                continue
            u, done, part = found, ahead, 2 * part
            if done == 1.0:
                return u
        first = self.at(np.array([u]))[1][0]
        slope = abs((axis.conjugate() * np.exp(1j * (1.0 - done) * way) * first).imag)
        raise DeadCentreError(TOUCHES if slope < 1e-2 * abs(first) else MISSES)

    def _newton(self, centre: complex, axis: complex, u: float) -> float | None:
        """One crossing from near, to which Newton's method is sure to lead; None else.

        It is if Kantorovich's condition holds at every step, ``2 |f'' step| <= |f'|``, with f''
        between the ends of the step, and if the pivot is not passed.
        """
        back = axis.conjugate()
        place, first, second = (own[0] for own in self.at(np.array([u])))
        slope, away, last = (back * first).imag, back * (place - centre), np.inf
        if abs(slope) < LEAST_SLOPE * abs(first):
            return None
        side, least = away.real, abs(slope)
        for _ in range(NEWTON_STEPS):
            step = away.imag / slope
            if abs(step) <= NEAR * (1 + abs(u)):
                return float(u - step) if side * away.real > 0 else None
            if 2 * abs(step) > last:
                return None
            place, first, second = self.at(np.linspace(u, u - step, LOOKS))
            if 2 * np.abs((back * second).imag).max() * abs(step) > least:
                return None
            u, last = u - step, abs(step)
            slope, away = (back * first[-1]).imag, back * (place[-1] - centre)
            least = abs(slope)
        return None

    @staticmethod
    def _by_angle(centre: complex, axes: ComplexArray, places: Places) -> Places:
        place, by_u, by_uu = places
        back = axes.conj()
        slope, reach = (back * by_u).imag, (back * (place - centre)).real
        if np.any(np.abs(slope) < LEAST_SLOPE * np.abs(by_u)):
            raise DeadCentreError(TOUCHES)
        rate = reach / slope
        bend = (2 * (back * by_u).real * rate - (back * by_uu).imag * rate**2) / slope
        return place, by_u * rate, by_uu * rate**2 + by_u * bend

    @property
    def shift(self) -> float:
        """By how much the parameter of the whole curve is more than that of the present piece."""
        return float(self.curve.breaks[self.piece] - self.present.start)

"""Which pairs of link and guide may touch soon: one look at all of them, after every step.

Nearly all pairs of a sleeve are far from touching at any time. This look at stacked arrays finds
them, so that only the others are looked at one by one (the narrow phase, `contacts`).

With C a pair's point, O the origin of the part that carries its face, w that part's angular
velocity and e the face's direction (complex numbers, global axes), the point is in the axes of the
face at

    z = e* (C - O) - z_0,      z' = e* (C' - O') - i w (z + z_0),

along the face by Re z, to its left by Im z; z_0 is where the face starts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray, IndexArray
from exudyn_flexlink.engines.exudyn.redundant.step_end import StepEnd
from exudyn_flexlink.mechanism import FaceContact

BESIDE = 0.05  # of the face's length beyond its ends, where a point may still come over it


class BroadPhase:
    """Pairs of a point and a face that presses on whatever is behind it."""

    def __init__(self, pairs: Sequence[FaceContact]) -> None:
        self._points = np.array([pair.point.part for pair in pairs])
        self._bases = np.array([pair.start.part for pair in pairs])
        self._own = np.array([complex(pair.point.x, pair.point.y) for pair in pairs])
        starts = np.array([complex(pair.start.x, pair.start.y) for pair in pairs])
        ends = np.array([complex(pair.end.x, pair.end.y) for pair in pairs])
        self._back = np.conj(ends - starts) / np.abs(ends - starts)
        self._start = self._back * starts
        lengths = np.array([pair.length for pair in pairs])
        self._low, self._high = -BESIDE * lengths, (1 + BESIDE) * lengths
        self._side = np.array([pair.side for pair in pairs])
        self._gap_rate: FloatArray | None = None  # at the last look

    def near(self, now: StepEnd, ahead: float) -> IndexArray:
        """Numbers of the pairs that may touch within a time (s) ahead, or touch now.

        Gaps go on with their rate and with its change in the last step, where that closes them;
        places with the slip. A pair that is held on its line from both sides touches wherever its
        point is over the face.
        """
        at, rate = self._seen(now)
        gap, gap_rate = self._side * at.imag, self._side * rate.imag
        closing = np.minimum(gap_rate, 0.0)
        if self._gap_rate is not None and now.step > 0:
            closing += (0.5 * ahead / now.step) * np.minimum(gap_rate - self._gap_rate, 0.0)
        self._gap_rate = gap_rate
        close = (gap + ahead * closing <= 0).nonzero()[0]
        if not len(close):
            return close
        place, slide = at.real[close], ahead * rate.real[close]
        over = (place + np.maximum(slide, 0.0) >= self._low[close]) & (
            place + np.minimum(slide, 0.0) <= self._high[close]
        )
        return close[over]

    def _seen(self, now: StepEnd) -> tuple[ComplexArray, ComplexArray]:
        """Where the points are in the axes of the faces, and the rates of that."""
        x, y, angle = np.array(now.q_list).reshape(-1, 3).T
        u, v, spin = np.array(now.v_list).reshape(-1, 3).T
        points, bases = self._points, self._bases
        axis, turning = np.exp(1j * angle), 1j * spin
        origin, moving = x + 1j * y, u + 1j * v
        arm = axis[points] * self._own
        back = axis.conj()[bases] * self._back
        apart = back * (origin[points] - origin[bases] + arm)
        rate = back * (moving[points] - moving[bases] + turning[points] * arm)
        return apart - self._start, rate - turning[bases] * apart

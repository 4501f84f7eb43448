r"""Knots of a slot's curve, where its third derivative jumps: over which of them a step may go.

With the speed u' the acceleration of the slot's point bends at a knot: from there on it has
``J u'^3 (t - t_k)`` more, J the jump of the third derivative. The method takes smooth functions to
order 9, a bend only to order 2. If a step of length h passes the knots after its parts sigma_k, the
speed at its stage i misses

    h^2 u'^3 sum_k kappa_i(sigma_k) J_k,
    kappa_i(s) = (c_i - s)_+^2 / 2 - sum_j a_ij (c_j - s)_+    (Peano's kernel).

A lone knot counts in full; many close knots of a smooth curve cancel each other, as their jumps
change slowly. A step goes over as many knots as may be, and else ends at one of them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.integrate.collocation import A, C
from exudyn_flexlink.integrate.problem import Evaluation, State
from exudyn_flexlink.integrate.radau import Step

FloatArray = NDArray[np.float64]

AT_KNOT = 1e-7  # of the step: a knot so close to its start is there, and is aimed at so closely


class KnotControl:
    """Keeps what knots cost below an error of the accelerations, m/s^2, of any part's end."""

    def __init__(self, model: MinimalModel, allowed: float) -> None:
        """Take that error of a step, on average over the step."""
        self.model, self.allowed = model, allowed
        self._some = any(len(point.curve.knots.places) for point in model.coordinates.points)
        self._moved = [0.0] * len(
            model.coordinates.points
        )  # by a push of each point: the most so far

    def shortened(self, t: float, h: float, state: State, at: Evaluation) -> float:
        """Length (s) of the next step, at most h, by where the slots' points will be.

        `at` is the evaluation at its start.
        """
        if not self._some:
            return h

        def place(k: int, after: float) -> float:
            q = state.q + after * (state.v + after / 2 * state.a)
            return self.model.whole(t + after, q, state.v).places[k]

        def left(k: int, to: float, after: float) -> float:
            return place(k, after) - to

        for k in range(len(self.model.coordinates.points)):
            try:
                end = place(k, h)
                to = self._reached(k, at, end, h)
                if to != end:
                    h = self._until(partial(left, k, to), h)
            except ValueError:
                return h  # too far for the guide: the step itself will be shorter
        return h

    def part(self, step: Step) -> float:
        """Part of a step after which it should have ended; 1 if it is good."""
        part = 1.0
        if self._some:
            ends = step.stages[-1].kept.places
            for k, (begin, end) in enumerate(zip(step.begin.kept.places, ends, strict=True)):
                to = self._reached(k, step.begin, end, step.h, step.stages[-1])
                if to != end:
                    part = min(part, (to - begin) / (end - begin))
        return part

    def _until(self, left: Callable[[float], float], h: float) -> float:
        """Time (s) until a place is reached; `left` is the way from there, by the time."""
        return float(brentq(left, 0, h, xtol=1e-3 * AT_KNOT * h, rtol=AT_KNOT))

    def _reached(
        self, k: int, at: Evaluation, end: float, h: float, after: Evaluation | None = None
    ) -> float:
        """How far a step of length h from `at` to `end` may go: there, or to a knot before."""
        knots, begin = self.model.coordinates.points[k].knots, at.kept.places[k]
        low, high = np.searchsorted(knots.places, [min(begin, end), max(begin, end)])
        if low == high:
            return end
        places, jumps, speed = knots.places[low:high], knots.jumps[low:high], abs(end - begin) / h
        if end < begin:
            places, jumps = places[::-1], jumps[::-1]
        for known in (at, after):
            if known is not None:
                self._moved[k] = max(self._moved[k], self.model.moved_by_point(k, known))
        scale = speed**2 * self._moved[k]
        while len(places):
            parts = (places - begin) / (end - begin)
            since = np.maximum(C[:, None] - parts, 0.0)
            missed = ((since * since / 2 - A @ since) * (parts > AT_KNOT)) @ jumps
            if scale * abs(end - begin) * np.hypot(*missed.T).max() <= self.allowed:
                break
            half = np.count_nonzero(parts <= AT_KNOT)
            half += (len(places) - half) // 2
            end, places, jumps = float(places[half]), places[:half], jumps[:half]
        return end

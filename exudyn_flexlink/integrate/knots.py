r"""Knots of a curve that a coordinate follows: over which of them a step may go.

At a knot the curve's third derivative jumps by J. With the speed u' of the place on the curve the
acceleration of the point there bends: from there on it has ``J u'^3 (t - t_k)`` more. The method
takes smooth functions to order 9, a bend only to order 2. If a step of length h passes the knots
after its parts sigma_k, the speed at its stage i misses

    h^2 u'^3 sum_k kappa_i(sigma_k) J_k,
    kappa_i(s) = (c_i - s)_+^2 / 2 - sum_j a_ij (c_j - s)_+    (Peano's kernel).

A lone knot counts in full; many close knots of a smooth curve cancel each other, as their jumps
change slowly. A step goes over as many knots as may be, and else ends at one of them.
"""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.integrate.collocation import A, C
from exudyn_flexlink.integrate.problem import Equations
from exudyn_flexlink.integrate.radau import Step

AT_KNOT = 1e-7  # of the step: a knot so close to its start is there


class KnotControl:
    """Keeps what knots cost below an error of the accelerations, m/s^2, of anything."""

    def __init__(self, followed: Equations, allowed: float) -> None:
        """Take that error of a step, on average over the step."""
        self.followed, self.allowed = followed, allowed
        self._moved: dict[int, float] = {}  # by a push of each point: the most so far

    def part(self, step: Step) -> float:
        """Part of a step after which it should have ended; 1 if it is good."""
        part = 1.0
        for k, (knots, _) in enumerate(self.followed.knots()):
            if not len(knots):
                continue
            ends = step.begin, step.stages.pick(-1)
            begin, end = (self.followed.places(at)[k] for at in ends)
            to = self._allowed_end(k, begin, end, step)
            if to != end:
                part = min(part, (to - begin) / (end - begin))
        return part

    def _allowed_end(self, k: int, begin: float, end: float, step: Step) -> float:
        """How far a step between two places may go: there, or to a knot before."""
        places, jumps = self.followed.knots()[k]
        low, high = np.searchsorted(places, [min(begin, end), max(begin, end)])
        if low == high:
            return end
        places, jumps, speed = places[low:high], jumps[low:high], abs(end - begin) / step.h
        if end < begin:
            places, jumps = places[::-1], jumps[::-1]
        for at in (step.begin, step.stages.pick(-1)):
            moved = self.followed.moved_by_point(k, at)
            self._moved[k] = max(self._moved.get(k, 0.0), moved)
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

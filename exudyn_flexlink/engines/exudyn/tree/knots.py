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

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from exudyn_flexlink.curves import Knots
from exudyn_flexlink.engines.exudyn.tree.collocation import A, C
from exudyn_flexlink.engines.exudyn.tree.model import TreeModel
from exudyn_flexlink.engines.exudyn.tree.radau import State, Step

FloatArray = NDArray[np.float64]

# Of the step, within which it ends at a knot. Too short by this leaves (1e-5)^2 / 2 of the bend to
# the next step; too long by as much would cost 1e-5 c, hence half of it is aimed short.
AT_KNOT = 1e-5


class KnotControl:
    """Keeps what knots cost below an error of the acceleration, m/s^2."""

    def __init__(self, model: TreeModel, allowed: float) -> None:
        """Take the error that a step may make in the acceleration of a slot's point, on average."""
        self.model, self.allowed = model, allowed
        self._some = any(
            len(piece.knots.places) for guide in model.guides for piece in guide.curve.pieces
        )

    def shortened(self, t: float, h: float, state: State, places: tuple[float, ...]) -> float:
        """Length (s) of the next step, at most h, by where the slots' points will be.

        `places` are those at its start.
        """
        if not self._some:
            return h

        def ahead(k: int, after: float) -> float:
            q = state.q + after * (state.v + after / 2 * state.a)
            return self.model.whole(t + after, q, state.v).places[k]

        for k, guide in enumerate(self.model.guides):
            begin = places[k]
            try:
                end = ahead(k, h)
                to = self._reached(guide.knots, begin, end, h)
                if to != end:
                    h = float(
                        brentq(
                            lambda after, k=k, to=to: ahead(k, after) - to, 0, h, rtol=AT_KNOT / 4
                        )
                    ) * (1 - AT_KNOT / 2)
            except ValueError:
                return h  # too far for the guide: the step itself will be shorter
        return h

    def part(self, step: Step) -> float:
        """Part of a step after which it should have ended; 1 if it is good."""
        part = 1.0
        if not self._some:
            return part
        for k, guide in enumerate(self.model.guides):
            begin, end = step.begin.kept.places[k], step.stages[-1].kept.places[k]
            to = self._reached(guide.knots, begin, end, step.h)
            if to != end:
                part = min(part, (to - begin) / (end - begin) * (1 - AT_KNOT / 2))
        return part

    def _reached(self, knots: Knots, begin: float, end: float, h: float) -> float:
        """How far a step of length h from `begin` to `end` may go: there, or to a knot before."""
        low, high = np.searchsorted(knots.places, [min(begin, end), max(begin, end)])
        places, jumps, speed = knots.places[low:high], knots.jumps[low:high], (end - begin) / h
        if end < begin:
            places, jumps = places[::-1], jumps[::-1]
        while len(places):
            parts = (places - begin) / (end - begin)
            after = np.maximum(C[:, None] - parts, 0.0)
            missed = (after * after / 2 - A @ after) @ jumps
            error = abs(speed) ** 3 * (end - begin) / speed * np.hypot(*missed.T).max()
            if error <= self.allowed:
                break
            half = len(places) // 2
            end, places, jumps = float(places[half]), places[:half], jumps[:half]
        return end

"""How much small errors may grow by themselves, without a contact: a pendulum near its top, say.

Steps keep their own errors small; what the motion makes of these later, they do not see. Near a
state errors obey ``e'' = K e + D e'``, with the derivatives K and D of the accelerations by
coordinates and speeds. Where an eigenvalue of that has a positive real part, errors grow by e in
its inverse. Summed up over the run that is at least what they grow by where the motion is slow
against it; what grows in one place and shrinks in the next counts as well, so that it may be much
more than they do. A neighbouring run then tells.

A mechanism with one independent coordinate that nothing drives follows one path, and two motions
along it part as its own speed and acceleration change: what it loses in one place it wins in the
next. There that ratio bounds the growth, as of a rod that turns over its top again and again.
"""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.integrate.radau import Step

EVALUATIONS = 2000  # of the equations in a run: where this was chosen, less than a tenth of it
MOST_LOOKS = 64
SHIFT = 1e-5  # of the largest part: changes of places that derivatives are taken from
TINY = 1e-300  # m/s: stands for rest, whose logarithm is none
ROUNDED = 1e-5  # of the largest eigenvalue: what rounding makes of one that is zero, twice over


class Instability:
    """Sums up, over the steps of a run to `end` (s), by how many factors e errors may grow."""

    def __init__(self, model: MinimalModel, end: float) -> None:
        self._model, self._end = model, end
        mechanism = model.assembly.mechanism
        # With play the error is measured in any case: touches multiply it.
        self._idle = bool(mechanism.channels or mechanism.bearings)
        driven = mechanism.speed_motors or mechanism.torque_motors or model.loads.any
        self._on_one_path = len(model.coordinates.state()[0]) == 1 and not driven
        self._next, self._rate, self._fastest = 0.0, 0.0, 0.0
        self._sum = 0.0
        self._paces: list[tuple[float, float]] = []  # speeds (m/s), accelerations (m/s^2)

    @property
    def e_folds(self) -> float:
        """By how many factors e errors may have grown so far."""
        if self._sum == 0 or not self._on_one_path:
            return self._sum
        speed, acceleration = np.array(self._paces).T
        own = np.log(np.maximum(np.hypot(speed, acceleration / self._fastest), TINY))
        return min(self._sum, float((own - np.minimum.accumulate(own)).max()))

    def follow(self, step: Step) -> None:
        """Go along a step that is accepted, before its end is the model's present state."""
        if self._idle or not len(step.start.q) or any(c.acts for c in self._model.contacts):
            return
        if step.t >= self._next:
            self._rate = self._growth(step)
            count = EVALUATIONS // (4 * len(step.start.q))
            self._next = step.t + self._end / max(1, min(MOST_LOOKS, count))
            self._fastest = max(self._fastest, self._rate)
        self._sum += self._rate * step.h
        if self._on_one_path:
            size, start = self._model.size, step.start
            self._paces.append((float(size(start.v)), float(size(start.a))))

    def _growth(self, step: Step) -> float:
        """Rate (1/s) at which errors grow at the start of a step; 0 where none do."""
        q, v = step.start.q, step.start.v
        if len(q) == 1:
            # One coordinate alone follows the same path faster or slower: what its own speed
            # adds is won and lost again in turns.
            v = np.zeros(1)
        try:
            by_place, by_speed = self._derivatives(step, q, v)
        except (ValueError, ArithmeticError):  # beyond what the joints, or a force, allow
            return self._rate
        none = np.zeros_like(by_place)
        found = np.linalg.eigvals(np.block([[none, np.eye(len(q))], [by_place, by_speed]]))
        fastest = float(found.real.max())
        return fastest if fastest > ROUNDED * float(np.abs(found).max()) else 0.0

    def _derivatives(
        self, step: Step, q: FloatArray, v: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives (n, n) of the accelerations, by coordinates and by speeds."""
        n, model = len(q), self._model
        reach = max(part.reach for part in model.assembly.mechanism.parts)
        moves = np.array([model.size(row) for row in np.eye(n)])
        places = SHIFT * reach / np.maximum(moves, SHIFT)
        speeds = places / step.h
        to_sides = np.concatenate([np.diag(places), -np.diag(places)])
        faster = np.concatenate([np.diag(speeds), -np.diag(speeds)])
        still = np.zeros((2 * n, n))
        at = model.evaluate_all(
            np.full(4 * n, step.t),
            q + np.concatenate([to_sides, still]),
            v + np.concatenate([still, faster]),
        )
        rows = np.linalg.solve(at.mass, at.force[:, :, None])[:, :, 0].reshape(4, n, n)
        by_place = (rows[0] - rows[1]) / (2 * places[:, None])
        by_speed = (rows[2] - rows[3]) / (2 * speeds[:, None])
        return by_place.T, by_speed.T

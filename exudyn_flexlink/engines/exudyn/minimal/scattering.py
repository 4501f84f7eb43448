"""How much strikes part motions that are near each other, as round things scatter what hits them.

A strike of impulse p along the gradient g of a gap changes the speeds by ``M^-1 g p``. What is off
by places e is struck in another direction: its speeds are off by ``p D e``, with D the derivatives
of ``M^-1 g`` by places along the gap; where it is off across the gap, it is struck sooner or later.
From then on errors of speeds make places of them: a motion without springs does so all the time, a
vibration within the inverse of its angular frequency. The norm is that of the kinetic energy, by
which reflection alone enlarges nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import log

import numpy as np
from scipy.linalg import eigh

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.expressions import NoValueError
from exudyn_flexlink.integrate.collocation import WEIGHTS
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.result import laps_begun

LEAST_INTERVAL = 1e-12  # s: two strikes nearer to each other are one
TINY = 1e-300  # 1/kg: mobility of a gap that only drives move, whose impulse is none


class Scattering:
    """Follows the strikes of a run.

    Errors of a lap do not outlast it, as the number of strikes in a row is that of a lap.
    """

    def __init__(self, model: MinimalModel) -> None:
        self._model = model
        mechanism, free = model.assembly.mechanism, len(model.coordinates.independent()[0])
        # With play the error is measured in any case: touches multiply it.
        self._idle = not model.contacts or mechanism.has_play or not free
        self._impulses = np.zeros(len(model.contacts))  # N s, of the present touches
        self._worst = 0.0
        self._begin_lap(0.0)

    def _begin_lap(self, time: float) -> None:
        links = self._model.start[0].size
        self._laps, self._time = len(laps_begun(self._model.events)), time
        self._e_folds = 0.0  # of errors of places, since the lap began
        # 1/s, present errors of speeds over those of places, of all coordinates of the tree: which
        # of them are the independent ones may change.
        self._speeds = np.zeros((links, links))

    def e_folds(self, time: float) -> float:
        """By how many factors e strikes may have enlarged errors in any lap up to a time (s)."""
        self._fly(time)
        return self._worst

    def follow(self, step: Step) -> None:
        """Go along a step that is accepted."""
        if not self._idle and self._model.pressed_of_scene:
            self._impulses += step.h * (WEIGHTS @ step.stages.kept.pushes[..., 0])

    def release(self, time: float, k: int) -> None:
        """Contact k, which gives way, has ceased to press at a time (s)."""
        impulse, self._impulses[k] = float(self._impulses[k]), 0.0
        self.strike(time, [(k, impulse)])

    def strike(self, time: float, impulses: Sequence[tuple[int, float]]) -> None:
        """Take impulses (N s) of contacts, by their numbers, that act at once at a time (s)."""
        if self._idle or not impulses:
            return
        self._fly(time)
        if len(laps_begun(self._model.events)) > self._laps:
            self._begin_lap(time)
        try:
            self._speeds = self._speeds + self._scattered(time, impulses)
        except (ValueError, ArithmeticError):  # beside the state are places that joints forbid
            return

    def _fly(self, time: float) -> None:
        """Go on from the last strike, with the springs and masses of the present state."""
        flight, self._time = time - self._time, time
        if flight > LEAST_INTERVAL and self._speeds.any():
            try:
                at = self._model.evaluate(time, *self._model.coordinates.independent())
            except NoValueError:  # of a drive, which ends the run here
                return
            squares, modes = eigh(self._model.springs(at)[0], at.mass)
            lasts = 1 / np.sqrt(np.maximum(squares, flight**-2))
            moved = at.kept.state.transform.matrix
            speeds = np.linalg.pinv(moved) @ self._speeds @ moved
            grown = lasts[:, None] * (modes.T @ at.mass @ speeds @ modes)
            growth = 1 + float(np.linalg.norm(grown, 2))
            self._e_folds += log(growth)
            self._speeds = self._speeds / growth
        self._worst = max(self._worst, self._e_folds)

    def _scattered(self, time: float, impulses: Sequence[tuple[int, float]]) -> FloatArray:
        """Derivatives (links, links), 1/s, of speeds after impulses, by places along the gaps."""
        model, (q, v) = self._model, self._model.coordinates.independent()
        n, places = len(q), model.shifts()
        sides = np.concatenate([q[None], q + np.diag(places), q - np.diag(places)])
        at = model.evaluate_all(np.full(2 * n + 1, time), sides, np.tile(v, (2 * n + 1, 1)))
        states, found = at.kept.state, np.zeros((n, n))
        for k, impulse in impulses:
            rows = zip(states.x, states.v, strict=True)
            gradients = np.array([model.contacts[k].gradient(*row) for row in rows])
            gaps = states.transform.reduced_rows(gradients)
            arms = np.linalg.solve(at.mass, gaps[..., None])[..., 0]
            turned = ((arms[1 : n + 1] - arms[n + 1 :]) / (2 * places[:, None])).T
            across = np.outer(arms[0], gaps[0]) / max(float(gaps[0] @ arms[0]), TINY)
            found += impulse * (turned - turned @ across)
        moved = states.transform[0].matrix
        return np.asarray(moved @ found @ np.linalg.pinv(moved))

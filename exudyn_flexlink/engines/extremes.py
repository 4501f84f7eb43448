"""The extremes of a run, from the polynomials of its steps: once, for every engine."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray
from exudyn_flexlink.integrate.turning import ROUNDING, StepPolynomial, TurnSeeker, highest
from exudyn_flexlink.laws import Impulse, Penalty
from exudyn_flexlink.mechanism import Contact, approach
from exudyn_flexlink.observables import Watched
from exudyn_flexlink.result import Extremes

# Where a point in a contact turns, its force falls steeply: more looks, nearer and nearer.
LOOKS_AT_FORCES = (17, 9, 9)
EPSILON = float(np.finfo(float).eps)
HERMITE = np.array([0.0, 1.0])  # nodes of a step that is known by its ends: a cubic


class ExtremeSeeker:
    """Takes the steps of a run, and finds where what it tells is least and greatest.

    `contacts` (c,) are looked at while they press; `nodes` (n,) are the parts of a step, from 0 to
    1, at which its motion is given.
    """

    def __init__(self, watched: Watched, contacts: Sequence[Contact], nodes: FloatArray) -> None:
        self.contacts = contacts
        self.nodes = nodes
        self.deepest = np.zeros(len(contacts))  # m
        self._watched = watched
        self._polynomial = StepPolynomial(nodes)
        self._seeker = TurnSeeker(len(self._watched.names))
        self._pressed: list[list[tuple[FloatArray, ...]]] = [[] for _ in contacts]
        self._laws: dict[Penalty, list[int]] = {}
        for k, contact in enumerate(contacts):
            if not isinstance(contact.law, Impulse):  # rigid: no depth tells its force
                self._laws.setdefault(contact.law, []).append(k)
        self._peaks: dict[int, tuple[Extremes, Extremes]] = {}

    def take(
        self,
        time: FloatArray,
        length: FloatArray,
        motion: tuple[FloatArray, FloatArray],
        pressed: BoolArray,
        began: FloatArray,
    ) -> None:
        """Take steps in a row that begin at `time` (m,) s, of `length` (m,) s.

        `motion` are poses and rates (m, n, parts, 3) at the nodes; `pressed` (m, c) tells which
        contacts press through each step, `began` (m, c) how fast (m/s) their touches began.
        """
        if not len(time):
            return
        polynomial = self._polynomial
        places, rates, speeds, changes = self._watched.of(*motion, polynomial.slopes)
        values = np.concatenate([places, speeds], axis=2)
        slopes = np.concatenate([rates * length[:, None, None], changes], axis=2)
        rounding = _rounding(self._watched.sizes(motion[0]), speeds, float(length.min()))
        # Near a dead centre things are so fast that the rounding of the clock moves them.
        clock = np.spacing(time[-1]) / length[:, None, None]
        rounding += (clock * np.abs(slopes)).max(axis=(0, 1))
        self._seeker.take(polynomial, (time, length), values, slopes, rounding)
        if pressed.any():
            for law, members in self._laws.items():
                self._press(law, [k for k in members if pressed[:, k].any()], (time, length),
                            motion, (pressed, began))  # fmt: skip

    def _press(
        self,
        law: Penalty,
        which: list[int],
        steps: tuple[FloatArray, FloatArray],
        motion: tuple[FloatArray, FloatArray],
        touches: tuple[BoolArray, FloatArray],
    ) -> None:
        """Find how deep each of the contacts is at most, and how hard it presses, in each step."""
        if not which:
            return
        pressed, began = touches
        rows = [np.flatnonzero(pressed[:, k]) for k in which]
        seen = [
            approach(self.contacts[k], *(part[own] for part in motion))
            for k, own in zip(which, rows, strict=True)
        ]
        time, length = (part[np.concatenate(rows)] for part in steps)
        depth = np.concatenate([-at.gap for at in seen])
        rate = np.concatenate([-at.gap_rate for at in seen])
        speeds = np.concatenate([began[own, k] for k, own in zip(which, rows, strict=True)])
        step = self._polynomial
        found = step.coefficients(depth, rate * length[:, None])
        speed = step.derivative(found) / length[:, None]
        low, high = np.zeros(len(found)), np.ones(len(found))

        def force(at: FloatArray) -> FloatArray:
            return law.force(step.value(found, at), step.value(speed, at), speeds[:, None])

        hardest = highest(force, low, high, LOOKS_AT_FORCES)
        lowest = highest(lambda at: step.value(found, at), low, high, LOOKS_AT_FORCES)
        columns = (
            time + hardest * length,
            force(hardest[:, None])[:, 0],
            time + lowest * length,
            np.maximum(step.value(found, lowest[:, None])[:, 0], 0.0),
        )
        ends = np.cumsum([len(own) for own in rows])[:-1]
        for k, *own in zip(which, *(np.split(column, ends) for column in columns), strict=True):
            self._pressed[k].append(tuple(own))
            self.deepest[k] = max(self.deepest[k], float(own[3].max()))

    def peaks(self, contact: int, begin: float, end: float) -> tuple[float, float]:
        """Largest force (N) and penetration (m) of a contact from `begin` to `end` (s).

        Once all steps are taken.
        """
        if contact not in self._peaks:
            self._peaks[contact] = self._of_contact(contact)
        within = (own.between(begin, end).value for own in self._peaks[contact])
        force, depth = (float(values.max(initial=0.0)) for values in within)
        return force, depth

    def _of_contact(self, k: int) -> tuple[Extremes, Extremes]:
        """Largest force and penetration of a contact, of every step in which it presses."""
        columns = [np.concatenate([np.zeros(0), *c]) for c in zip(*self._pressed[k], strict=True)]
        force_at, force, depth_at, depth = columns or [np.zeros(0)] * 4
        return Extremes(force_at, force), Extremes(depth_at, depth)

    def extremes(self) -> dict[str, Extremes]:
        """Everything found, for the Result: see `result.Result.extremes`."""
        found = {}
        for i, name in enumerate(self._watched.names):
            time, value = self._seeker.found(i)
            found[name] = Extremes(time, self._watched.told(i, value))
        for k, contact in enumerate(self.contacts):
            if contact.name in self._watched.contacts:
                force, depth = self._of_contact(k)
                names = self._watched.of_contact(contact.name)
                found |= dict(zip(names, (force, depth), strict=True))
        return found


def _rounding(sizes: FloatArray, speeds: FloatArray, shortest: float) -> FloatArray:
    """What rounding may move the watched quantities by in a step, in their order.

    `sizes` are those of what places are differences of, `speeds` (m, n, speeds) have the square of
    the point's speed last. Where places alone hold the joints, as in redundant coordinates, speeds
    follow from them within a step: they have the rounding of places over the `shortest` step (s).
    """
    of_rates = EPSILON / shortest * sizes[:-2]  # of answers and of x
    fastest = float(np.sqrt(speeds[..., -1].max()))
    of_square = (fastest + of_rates[-1]) ** 2 - fastest**2
    return np.array([*(ROUNDING * sizes), *of_rates[:-1], of_square])

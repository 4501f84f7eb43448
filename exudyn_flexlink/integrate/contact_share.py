"""The share of contacts in the systems of an implicit step: few forces, which leap.

A contact's force changes from loading to unloading within a small part of a step, so its slopes at
one instant mislead the iteration. Each round therefore solves for the gaps at all stages, which are
few numbers, with the forces themselves. The matrices only carry their effect on the other
coordinates.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.integrate.collocation import Collocation, collocation
from exudyn_flexlink.integrate.problem import Press, Pressing

ROUNDS = 40
CLOSE = 1e-3  # of the change: allowed residual of the gaps' equations
SHORTEST_PART = 1e-3  # of a full Newton step
LOOKS, LOOK_WEIGHTS = np.polynomial.legendre.leggauss(12)  # a finer rule than that of the stages
LOOKS, LOOK_WEIGHTS = (1 + LOOKS) / 2, LOOK_WEIGHTS / 2
STEADY = 0.5  # if a contact keeps this share of its largest damping, the stages resolve the step


class ContactShare(NamedTuple):
    """Contacts that Woodbury's formula adds to the iteration's systems."""

    rows: FloatArray  # (c, n): gradients of the gaps
    inverse_times_rows: ComplexArray  # (systems, n, c)
    # (stages c, stages c): changes of the gaps' rates by forces at the stages, m/s per N.
    rate_per_force: FloatArray
    press: Press
    touching: FloatArray  # (c, 2): gaps and rates at the start of the step
    start: Pressing  # (c,) each: forces at the start of the step
    method: Collocation

    @classmethod
    def of(
        cls,
        rows: FloatArray,
        press: Press,
        inverses: ComplexArray,
        touching: FloatArray,
        method: Collocation,
    ) -> ContactShare:
        """The share of contacts with the gaps and rates `touching` (c, 2) at the step's start."""
        stages = method.stages
        inverse_times_rows = inverses @ rows.T
        by_system = rows @ inverse_times_rows  # (systems, c, c)
        count = len(rows)
        pairs = (_both(stages) @ by_system.reshape(len(by_system), -1)).real  # (stages stages, c c)
        blocks = pairs.reshape(stages, stages, count, count).transpose(0, 2, 1, 3)
        rate_per_force = blocks.reshape(stages * count, stages * count)
        start = press(touching)
        return cls(rows, inverse_times_rows, rate_per_force, press, touching, start, method)

    def share(self, h: float, change: FloatArray, touching: FloatArray) -> FloatArray:
        """Part (stages, n) by which contacts correct a change of the speeds computed without them.

        `touching` (stages, c, 2) are gaps and rates before the change.
        """
        free = change @ self.rows.T
        before = self.press(touching)
        pushes = self._pushes(h, free, touching, before) - before.force
        of_systems = self.method.to_systems @ pushes  # (systems, c)
        moved = (self.inverse_times_rows @ of_systems[:, :, None])[:, :, 0]
        return np.asarray((self.method.from_systems @ moved).real)

    def _pushes(
        self, h: float, free: FloatArray, touching: FloatArray, start: Pressing
    ) -> FloatArray:
        """Forces (stages, c) after `free` and these forces have changed the rates of the gaps.

        Newton's method, with steps shortened until they help. Forces fall with gap and rate, so
        there is one solution; but they hardly change on either side of a leap.
        """
        shape, size = free.shape, free.size
        spread, same = h * _spread(*shape), np.eye(size)
        flat = free.ravel()
        enough = CLOSE * float(np.abs(flat).max())
        pressing, rates, off = start, np.zeros(size), flat
        left = float(np.abs(off).max())
        for _ in range(ROUNDS):
            if left <= enough:
                break
            slopes = pressing.stiffness.reshape(size, 1) * spread
            slopes.flat[:: size + 1] += pressing.damping.ravel()
            way = np.linalg.solve(same + self.rate_per_force @ slopes, off)
            part, before = 1.0, left
            while True:
                trial = rates + part * way
                moved = np.stack([(spread @ trial).reshape(shape), trial.reshape(shape)], axis=-1)
                pressing = self.press(touching + moved)
                off = flat + self.rate_per_force @ (pressing.force - start.force).ravel() - trial
                left = float(np.abs(off).max())
                if left < before or part < SHORTEST_PART:
                    break
                part /= 2
            rates = trial
        return np.asarray(pressing.force)

    def pull(self, change: FloatArray) -> FloatArray:
        """Forces (n,) against a change of the coordinates, at the start of the step."""
        return np.asarray(self.rows.T @ (self.start.stiffness * (self.rows @ change)))

    def errors(self, h: float, change: FloatArray, touching: FloatArray) -> FloatArray:
        """Errors of the speeds (1 or 2, n); `change` (n,) is the error computed without contacts.

        `touching` (stages, c, 2) are gaps and rates at the stages. A contact that creeps is a stiff
        damper and removes errors. The damper fades when the point speeds up to lift off; then
        errors remain. So the least damping within the step is used. If the damping changes much,
        the forces between the stages are checked as well.
        """
        stages = self.press(touching)
        stiffness = np.minimum(self.start.stiffness, stages.stiffness.min(axis=0))
        damping = np.minimum(self.start.damping, stages.damping.min(axis=0))
        filtered = self._filtered(stiffness * h / self.method.real + damping, change)
        most = np.maximum(self.start.damping, stages.damping.max(axis=0))
        if np.all(damping > STEADY * most):  # if all are zero, a leap may lie between the stages
            return filtered[None]
        return np.stack([filtered, self._missed(h, touching, stages)])

    def _filtered(self, of_rates: FloatArray, change: FloatArray) -> FloatArray:
        """A change (n,) by the real system without contacts, corrected by slopes (c,) of theirs."""
        inverse = self.inverse_times_rows[0].real
        system = np.eye(len(self.rows)) + (self.rows @ inverse) * of_rates
        return np.asarray(
            change - inverse @ (of_rates * np.linalg.solve(system, self.rows @ change)), float
        )

    def _missed(self, h: float, touching: FloatArray, stages: Pressing) -> FloatArray:
        """Errors (n,) of the speeds by changes of the forces between the stages.

        The embedded formula only knows the stages. If a force leaps between two of them, its
        impulse by a finer rule, along the step's polynomial, differs from that by the stages.
        """
        nodes, method = np.concatenate([self.touching[None], touching]), self.method
        between = self.press(
            (_to_looks(method.stages) @ nodes.reshape(len(nodes), -1)).reshape(-1, *nodes.shape[1:])
        )
        impulses = h * (LOOK_WEIGHTS @ between.force - method.weights @ stages.force)
        return np.asarray((method.real / h) * (self.inverse_times_rows[0].real @ impulses))


@cache
def _spread(stages: int, count: int) -> FloatArray:
    """Coefficients a of the method, for each of `count` contacts."""
    return np.asarray(np.kron(collocation(stages).a, np.eye(count)), dtype=np.float64)


@cache
def _to_looks(stages: int) -> FloatArray:
    """Weights of values at the nodes, for values at `LOOKS`."""
    return collocation(stages).to_parts(LOOKS)


@cache
def _both(stages: int) -> ComplexArray:
    """Coefficients (stages stages, systems) from forces at stages to changes at stages."""
    method = collocation(stages)
    both = method.from_systems[:, None, :] * method.to_systems.T[None, :, :]
    return np.asarray(both.reshape(stages * stages, -1))

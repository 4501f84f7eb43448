"""Energies and powers of a mechanism over many instants at once."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism.kinematics import turned
from exudyn_flexlink.mechanism.linear_springs import damping_power, stored_energy
from exudyn_flexlink.mechanism.model import Mechanism


class EnergyMeter:
    """Energies (J) and powers (W) of states `q`, `v` of shape (instants, parts, 3)."""

    def __init__(self, mechanism: Mechanism) -> None:
        parts, springs = mechanism.parts, mechanism.springs
        self._linear = mechanism.linear_springs
        self._mass = np.array([part.mass for part in parts])
        self._inertia = np.array([part.inertia_about_origin for part in parts])
        self._centre = np.array([part.centre for part in parts])
        self._gravity = np.asarray(mechanism.gravity, dtype=float)
        self._first = np.array([spring.first for spring in springs], dtype=int)
        self._second = np.array([spring.second for spring in springs], dtype=int)
        self._stiffness = np.array([spring.stiffness for spring in springs])
        self._damping = np.array([spring.damping for spring in springs])
        self._rest = np.array([spring.rest_angle or 0.0 for spring in springs])

    def kinetic(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Kinetic energy, (instants,)."""
        arms = turned(self._centre, q[..., 2])
        linear = np.sum(v[..., :2] ** 2, axis=-1)
        coupled = v[..., 2] * (v[..., 1] * arms[..., 0] - v[..., 0] * arms[..., 1])
        rotary = self._inertia * v[..., 2] ** 2
        return np.asarray(0.5 * np.sum(self._mass * (linear + 2 * coupled) + rotary, axis=-1))

    def potential(self, q: FloatArray) -> FloatArray:
        """Energy of springs and weight, zero weight at the coordinate origin, (instants,)."""
        height = (q[..., :2] + turned(self._centre, q[..., 2])) @ self._gravity
        stored = 0.5 * np.sum(self._stiffness * (self._turned(q) - self._rest) ** 2, axis=-1)
        for spring in self._linear:
            stored = stored + stored_energy(spring, q)
        return np.asarray(stored - np.sum(self._mass * height, axis=-1))

    def damping_power(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Power lost in the dampers of hinges and springs, never negative, (instants,)."""
        lost = np.sum(self._damping * self._turned(v) ** 2, axis=-1)
        for spring in self._linear:
            lost = lost + damping_power(spring, q, v)
        return np.asarray(lost)

    def _turned(self, x: FloatArray) -> FloatArray:
        """Second part's angle (or speed) relative to the first's, (instants, springs)."""
        ground = np.zeros((*x.shape[:-2], 1))  # index -1: the ground does not turn
        angles = np.concatenate([x[..., 2], ground], axis=-1)
        return np.asarray(angles[..., self._second] - angles[..., self._first])

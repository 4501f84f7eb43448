"""A beam of cubic elements: where its points are, and what it stores and loses.

The elements are those of Exudyn's ``ObjectANCFCable2D`` (absolute nodal coordinates): between two
nodes the centre line is the cubic through their positions and slopes, ``strain = |r'| - 1``,
``curvature = (r' x r'')/|r'|^2`` with respect to the unbent arc length. Energies here are summed
at the points at which the element itself sums its forces, so that both balance: three of Lobatto
for the strain, two of Gauss for the curvature. With the five and three points that would be exact
an element can't bend without stretching: the end of a cantilever of the paper's link, pushed by
5 mm, was then 14 to 30 times farther off with one to four elements, at the same cost.

The controls of a beam are position and slope of its nodes in turn, (2 nodes, 2): x and y of each.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import polynomial

from exudyn_flexlink.arrays import FloatArray, IndexArray

LOBATTO = (np.array([0.0, 0.5, 1.0]), np.array([1.0, 4.0, 1.0]) / 6)
# Coefficients (powers, 4) of position and slope at both ends, in parts of an element of length 1.
CUBICS = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [-3, -2, 3, -1], [2, 1, -2, 1]])
GAUSS = (0.5 + np.array([-0.5, 0.5]) / 3**0.5, np.array([0.5, 0.5]))


@dataclass(frozen=True)
class Elastic:
    """Per length: mass (kg/m), stiffnesses EA (N) and EI (N m^2); `lag` (s) is the damping's.

    Strain and curvature meet the resistances ``lag EA`` and ``lag EI`` as they change (Kelvin and
    Voigt).
    """

    mass: float
    axial: float
    bending: float
    lag: float


class CubicBeam:
    """A beam of a length (m) in equal elements."""

    def __init__(self, length: float, elements: int, elastic: Elastic) -> None:
        self.length, self.elements, self.elastic = length, elements, elastic
        self.element = length / elements
        self.count = 2 * (elements + 1)  # controls
        strained, self._strain_weights = self._points(*LOBATTO)
        bent, self._bend_weights = self._points(*GAUSS)
        self._slope_where_strained = self._rows_of(strained, 1)
        self._slope_where_bent = self._rows_of(bent, 1)
        self._bend = self._rows_of(bent, 2)
        self.mass = self._mass_matrix()

    def rows(self, places: FloatArray, derivative: int = 0) -> FloatArray:
        """Matrix (places, controls) that gives points, or slopes, at arc lengths (m)."""
        element = np.clip((places / self.element).astype(int), 0, self.elements - 1)
        return self._rows_of((element, places / self.element - element), derivative)

    def weight_rows(self) -> FloatArray:
        """Integral of the point over the length for each control, m; (controls,)."""
        points, weights = np.polynomial.legendre.leggauss(2)
        at, spread = self._points((points + 1) / 2, weights / 2)
        return spread @ self._rows_of(at, 0)

    def kinetic(self, rates: FloatArray) -> FloatArray:
        """Kinetic energy (instants,) in J of rates (instants, controls, 2)."""
        return np.asarray(0.5 * np.einsum("nia,ij,nja->n", rates, self.mass, rates))

    def stored(self, controls: FloatArray) -> FloatArray:
        """Energy of stretching and bending (instants,) in J."""
        strain, curvature = self.strain(controls), self.curvature(controls)
        stretched = 0.5 * self.elastic.axial * strain**2 @ self._strain_weights
        return np.asarray(
            stretched + 0.5 * self.elastic.bending * curvature**2 @ self._bend_weights
        )

    def damping_power(self, controls: FloatArray, rates: FloatArray) -> FloatArray:
        """Power lost as strain and curvature change (instants,) in W, never negative."""
        if self.elastic.lag == 0:
            return np.zeros(len(controls))
        strain, curvature = self._strain_rate(controls, rates), self._bend_rate(controls, rates)
        stretched = self.elastic.axial * strain**2 @ self._strain_weights
        bent = self.elastic.bending * curvature**2 @ self._bend_weights
        return np.asarray(self.elastic.lag * (stretched + bent))

    def strain(self, controls: FloatArray) -> FloatArray:
        """Axial strain (instants, points)."""
        slope = self._slope_where_strained @ controls
        return np.hypot(slope[..., 0], slope[..., 1]) - 1

    def curvature(self, controls: FloatArray) -> FloatArray:
        """Curvature (instants, points) in 1/m."""
        slope, bend = self._slope_where_bent @ controls, self._bend @ controls
        return np.asarray(cross(slope, bend) / np.sum(slope**2, axis=-1))

    def _strain_rate(self, controls: FloatArray, rates: FloatArray) -> FloatArray:
        slope, rate = (self._slope_where_strained @ x for x in (controls, rates))
        return np.asarray(np.sum(slope * rate, axis=-1) / np.hypot(slope[..., 0], slope[..., 1]))

    def _bend_rate(self, controls: FloatArray, rates: FloatArray) -> FloatArray:
        slope, slope_rate = (self._slope_where_bent @ x for x in (controls, rates))
        bend, bend_rate = (self._bend @ x for x in (controls, rates))
        square = np.sum(slope**2, axis=-1)
        turned = cross(slope_rate, bend) + cross(slope, bend_rate)
        stretched = 2 * np.sum(slope * slope_rate, axis=-1) * cross(slope, bend) / square
        return np.asarray((turned - stretched) / square)

    def _points(
        self, part: FloatArray, weights: FloatArray
    ) -> tuple[tuple[IndexArray, FloatArray], FloatArray]:
        """Element and part of it of every point of a rule, and the points' weights in m."""
        element = np.repeat(np.arange(self.elements), len(part))
        return (element, np.tile(part, self.elements)), self.element * np.tile(
            weights, self.elements
        )

    def _rows_of(self, points: tuple[IndexArray, FloatArray], derivative: int) -> FloatArray:
        element, part = points
        rows = np.zeros((len(part), self.count))
        for k, values in enumerate(_hermite(part, self.element, derivative)):
            rows[np.arange(len(part)), 2 * element + k] = values
        return rows

    def _mass_matrix(self) -> FloatArray:
        """Consistent mass matrix (controls, controls) in kg, kg m, kg m^2; the same for x and y."""
        points, weights = np.polynomial.legendre.leggauss(4)
        at, spread = self._points((points + 1) / 2, weights / 2)
        rows = self._rows_of(at, 0)
        return np.asarray(self.elastic.mass * (rows.T * spread) @ rows)


def cross(one: FloatArray, other: FloatArray) -> FloatArray:
    """Cross product of plane vectors (..., 2)."""
    return np.asarray(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])


def _hermite(x: FloatArray, length: float, derivative: int) -> FloatArray:
    """Cubics (4, points) of position and slope at both ends of an element, at its parts x."""
    slopes = polynomial.polyder(CUBICS, derivative) / length**derivative
    sizes = np.array([[1.0], [length], [1.0], [length]])
    return np.asarray(sizes * polynomial.polyval(x, slopes))

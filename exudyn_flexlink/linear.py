"""A mechanism's equations of motion, linearised about a state: modes and responses.

With z the independent coordinates, the residual of the equations is ``r = M z'' - f``, a function
of z, z', z'' and the time. Forces of joints are not in it, since they do no work along z. At an
instant of a motion it is zero, and neighbouring motions satisfy, to first order,

    M dz'' + C dz' + K dz = df,      M = dr/dz'',  C = dr/dz',  K = dr/dz

with dr/dz at the z' and z'' of the motion. So K contains springs, weight, forces of joints that
turn with the parts, and inertial forces. C contains dampers and, in a motion, Coriolis forces.
Drives prescribe the same values as in the motion.

About a rest these equations hold at all times, in any coordinates. In a motion the matrices belong
to one instant and to the named coordinates. Their eigenvalues show how neighbours part while the
matrices hardly change.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import pi

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.mechanism import Assembly, anchor_jacobian
from exudyn_flexlink.rounding import NEGLIGIBLE, SUM_ROUNDING
from exudyn_flexlink.scene import Scene


class NotLinearError(ValueError):
    """A mechanism has no linear equations at a state; the text names what prevents them."""


def motion_text(exponent: complex, *, short: bool = False) -> str:
    """A motion ``exp(s t)`` in words; `short`: damping in % of the critical one."""
    rate, size = exponent.real, abs(exponent)
    if size == 0:
        return "nothing resists it"
    if exponent.imag == 0:
        return f"{'grows' if rate > 0 else 'decays'} by exp({rate:.4g} t/s)"
    swings = f"{abs(exponent.imag) / (2 * pi):.5g} Hz"
    if abs(rate) <= NEGLIGIBLE * size:
        return swings
    share = f"{-100 * rate / size:.3g} %{'' if short else ' of critical damping'}"
    return f"{swings}, {share if rate < 0 else f'grows by exp({rate:.4g} t/s)'}"


@dataclass(frozen=True)
class Mode:
    """A motion ``exp(s t)`` with the `eigenvalue` s (1/s); of an oscillation that with Im s > 0.

    Complex amplitudes of the independent `coordinates` (n,), of the parts' x, y (m) and angles
    (rad), `poses` (parts, 3), and of named `points`, [x, y] (m): the real part of each times
    ``exp(s t)`` is the motion. The point that moves farthest has 1 m.
    """

    eigenvalue: complex
    coordinates: ComplexArray
    poses: ComplexArray
    points: Mapping[str, ComplexArray]

    @property
    def frequency(self) -> float:
        """Frequency (Hz) of the damped oscillation; 0 without oscillation."""
        return abs(self.eigenvalue.imag) / (2 * pi)

    @property
    def damping_ratio(self) -> float:
        """``-Re s/|s|``: from 1 on no oscillation, negative if it grows; 0 if s is 0."""
        size = abs(self.eigenvalue)
        return -self.eigenvalue.real / size if size else 0.0


@dataclass(frozen=True)
class Response:
    """Response of a point to an oscillating force, by `frequency` (F,), Hz.

    `x` and `y` (F,) m/N are complex amplitudes of the point `at` for 1 N `along` x or y at the
    point `force`: their absolute value is the gain, their angle the phase.
    """

    force: str
    along: str
    at: str
    frequency: FloatArray
    x: ComplexArray
    y: ComplexArray


@dataclass(frozen=True)
class LinearModel:
    """``M z'' + C z' + K z = f`` about the state of an `assembly`; n coordinates in SI units.

    `coordinates` are names of the independent ones, in `units` (rad, m): angles and lengths of
    joints, ``link hinge 2`` of a flexible link, ``ball.x`` of a free body; points in slots count
    along their curves. `mass`, `damping` and `stiffness` are (n, n). The last two are differences,
    with the errors `damping_error` and `stiffness_error` of each entry. `motions` (parts, 3, n) are
    the derivatives of poses by the coordinates. The contacts `pressing` keep pressing. `time` (s)
    is that of the run, None at rest.
    """

    scene: Scene
    assembly: Assembly
    time: float | None
    coordinates: tuple[str, ...]
    units: tuple[str, ...]
    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    damping_error: FloatArray
    stiffness_error: FloatArray
    motions: FloatArray
    pressing: tuple[str, ...]

    @property
    def eigenvalues(self) -> ComplexArray:
        """All 2 n eigenvalues, 1/s, by size; pairs are in a row."""
        return self._solved[0]

    @cached_property
    def _solved(self) -> tuple[ComplexArray, ComplexArray]:
        """Eigenvalues (2 n,), and their coordinates (n, 2 n)."""
        count = len(self.mass)
        solved = np.linalg.solve(self.mass, np.hstack([-self.stiffness, -self.damping]))
        first_order = np.vstack([np.eye(count, 2 * count, count), solved])
        values, vectors = np.linalg.eig(first_order)
        # Errors of each square by those of K; a square that is not larger counts as no stiffness.
        sizes = np.abs(vectors[:count])
        whole = np.abs(solved[:, :count]).max()
        moved = (vectors[:count].conj() * (self.mass @ vectors[:count])).sum(axis=0).real
        squares = (sizes * (self.stiffness_error @ sizes)).sum(axis=0) / moved
        squares += SUM_ROUNDING * whole
        values = np.where(np.abs(values) ** 2 > squares, values, 0.0)
        order = np.lexsort((values.imag, np.abs(values)))
        return values[order].astype(complex), vectors[:count, order].astype(complex)

    @cached_property
    def modes(self) -> list[Mode]:
        """Motions of an eigenvalue each, the slowest first; pairs have one."""
        pairs = zip(self._solved[0].tolist(), self._solved[1].T, strict=True)
        return [self._mode(value, vector) for value, vector in pairs if value.imag >= 0]

    def _mode(self, value: complex, vector: ComplexArray) -> Mode:
        """Scale the coordinates of an eigenvalue so that the farthest point moves by 1 m."""
        moved = {name: slopes @ vector for name, slopes in self._slopes.items()}
        farthest = max(moved.values(), key=np.linalg.norm, default=vector)
        if not np.any(farthest):
            farthest = vector
        largest = farthest[np.argmax(np.abs(farthest))]
        scale = 1 / (np.linalg.norm(farthest) * largest / abs(largest))
        points = {name: scale * place for name, place in moved.items()}
        return Mode(value, scale * vector, self.motions @ (scale * vector), points)

    @cached_property
    def _slopes(self) -> dict[str, FloatArray]:
        """Derivatives (2, n) of the place of each point by the coordinates."""
        q, points = self.assembly.state.q, self.assembly.mechanism.points
        by_coordinates = self.motions.reshape(q.size, -1)
        return {
            name: anchor_jacobian(anchor, q) @ by_coordinates for name, anchor in points.items()
        }

    def response(
        self,
        force: str,
        at: str,
        frequency: FloatArray | None = None,
        along: str = "y",
    ) -> Response:
        """Response of the point `at` to 1 N `along` x or y at the point `force`, both 'body.point'.

        By default the `frequency` (Hz) is from a tenth of the slowest oscillation to ten times the
        fastest.

        Raises:
            KeyError: a point does not exist.

        """
        frequency = self._band() if frequency is None else np.asarray(frequency, dtype=float)
        turning = (2j * pi * frequency)[:, None, None]
        dynamic = turning**2 * self.mass + turning * self.damping + self.stiffness
        pushed = self._slopes[force]["xy".index(along), :, None]
        x, y = (self._slopes[at] @ np.linalg.solve(dynamic, pushed))[:, :, 0].T
        return Response(force, along, at, frequency, x, y)

    def _band(self) -> FloatArray:
        """Frequencies (Hz) around those of the modes, evenly spaced on a logarithmic axis."""
        known = [mode.frequency for mode in self.modes if mode.frequency > 0] or [1.0]
        return np.geomspace(0.1 * min(known), 10 * max(known), 1000)

"""How much small errors may grow by themselves along a motion: of a pendulum near its top, say.

Steps keep their own errors small; what the motion makes of these later, they do not see. Near a
state errors obey ``e'' = K e + D e'``, with the derivatives K and D of the accelerations by
coordinates and speeds. Where an eigenvalue of that has a positive real part, errors grow by e in
its inverse. Summed up over the run that is at least what they grow by where the motion is slow
against it; what grows in one place and shrinks in the next counts as well, so that it may be much
more than they do. A neighbouring run then tells.

Vibrations that nothing damps keep the errors of all steps, and add them up. Of fast ones, of more
than a radian a step, that is more than the estimate of one step's error foresees.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray

# Accelerations (m, n) at rows (m, n) of coordinates and speeds.
Accelerations = Callable[[FloatArray, FloatArray], FloatArray]

# Smaller real parts, relative to the largest eigenvalue, count as zero: rounding makes them, most
# of an eigenvalue that is zero twice over.
ROUNDED = 1e-5
FAST = 1.0  # rad a step: of slower vibrations steps of order 9 make no error to speak of


class Growth:
    """Adds up over steps by how many factors e errors may grow.

    `between` (s) is the time from one look at the equations to the next.
    """

    def __init__(self, between: float) -> None:
        self._between = between
        self._next, self._rate = 0.0, 0.0
        self.fastest = 0.0  # 1/s, the largest rate so far
        self.e_folds = 0.0
        self._spectra: list[ComplexArray] = []

    def due(self, t: float) -> bool:
        """Tell whether to look at the equations at t (s)."""
        return t >= self._next

    def look(
        self,
        t: float,
        state: tuple[FloatArray, FloatArray],
        shifts: tuple[FloatArray, FloatArray],
        accelerations: Accelerations,
    ) -> None:
        """Take the rate of growth at t (s) in a state, coordinates and speeds (n,).

        `shifts` (n,) of both are what derivatives are taken over. Where the accelerations can't be
        told, the last rate stands.
        """
        q, v = state
        if len(q) == 1:
            # One coordinate alone follows the same path faster or slower: what its own speed
            # adds is won and lost again in turns.
            v = np.zeros(1)
        self._next = t + self._between
        try:
            spectrum = _spectrum(*_derivatives((q, v), shifts, accelerations))
        except (ValueError, ArithmeticError):  # beyond what the joints, or a force, allow
            return
        self._spectra.append(spectrum)
        fastest = float(spectrum.real.max())
        self._rate = fastest if fastest > ROUNDED * float(np.abs(spectrum).max()) else 0.0
        self.fastest = max(self.fastest, self._rate)

    def go(self, h: float) -> None:
        """Go on by h (s)."""
        self.e_folds += self._rate * h

    def ringing(self, time: float, steps: int) -> float:
        """How many steps of a run fast vibrations last over: of so many steps in a time (s)."""
        if not self._spectra or not steps:
            return 0.0
        found, h = np.concatenate(self._spectra), time / steps
        fast = found[np.abs(found.imag) * h > FAST]
        slowest = float(np.maximum(-fast.real, 1 / time).min(initial=np.inf))
        return 1 / (slowest * h)


def _spectrum(by_place: FloatArray, by_speed: FloatArray) -> ComplexArray:
    """Eigenvalues (2 n,), 1/s, of derivatives (n, n) of accelerations."""
    one, none = np.eye(len(by_place)), np.zeros_like(by_place)
    return np.asarray(np.linalg.eigvals(np.block([[none, one], [by_place, by_speed]])))


def _derivatives(
    state: tuple[FloatArray, FloatArray],
    shifts: tuple[FloatArray, FloatArray],
    accelerations: Accelerations,
) -> tuple[FloatArray, FloatArray]:
    """Derivatives (n, n) of the accelerations, by coordinates and by speeds."""
    (q, v), (places, speeds), n = state, shifts, len(state[0])
    still = np.zeros((2 * n, n))
    to_sides, faster = (np.concatenate([np.diag(by), -np.diag(by)]) for by in shifts)
    rows = accelerations(q + np.concatenate([to_sides, still]), v + np.concatenate([still, faster]))
    rows = rows.reshape(4, n, n)
    by_place = (rows[0] - rows[1]) / (2 * places[:, None])
    by_speed = (rows[2] - rows[3]) / (2 * speeds[:, None])
    return by_place.T, by_speed.T

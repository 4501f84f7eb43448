"""How near a curve comes to itself: up to there one place of it alone is the nearest."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.curves.base import Curve

MOST_SAMPLES = 500  # of a curve, between which a neck is looked for


def reach(curve: Curve, side: float, radius: float) -> float:
    """Smallest radius (m) of the line that the centre of a roller on a side of a curve can't cross.

    `side` is 1 on the left of the curve, -1 on its right; `radius` (m) is the roller's, 0 of a
    point. Half the width of a neck counts as a radius. 0: the roller does not fit everywhere.
    H. Federer, Curvature measures, Trans. Amer. Math. Soc. 93 (1959) 418, theorem 4.18.
    """
    u = curve.samples[0]
    u = u[: -1 if curve.closed else None : 1 + len(u) // MOST_SAMPLES]
    at, tangent = (of @ [1, 1j] for of in (curve.point(u), curve.tangent(u)))
    between = at - at[:, None]
    seen = between * tangent.conj()[:, None]
    across = np.abs(seen.imag)
    if not curve.closed:  # beyond its ends there is no tangent
        across[0] = np.where(seen[0].real < 0, np.abs(seen[0]), across[0])
        across[-1] = np.where(seen[-1].real > 0, np.abs(seen[-1]), across[-1])
    with np.errstate(divide="ignore", invalid="ignore"):
        radii = np.abs(between) ** 2 / (2 * across) - np.sign(side * seen.imag) * radius
        np.fill_diagonal(radii, np.inf)
        bend = side * curve.curvature(u)
        bends = 1 / np.abs(bend) - np.sign(bend) * radius
    return max(0.0, min(float(radii.min()), float(bends.min())))

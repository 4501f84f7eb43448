"""Rigid parts that move as one, in numbers of the link that carries them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.mechanism import Mechanism
from exudyn_flexlink.mechanism.tree import TreeLayout

FloatArray = NDArray[np.float64]


class Body(NamedTuple):
    """Mass (kg), centre of mass (m, in the link's axes) and inertia about it (kg m^2)."""

    mass: float
    centre: tuple[float, float]
    inertia: float


def body_of(mechanism: Mechanism, layout: TreeLayout, parts: tuple[int, ...]) -> Body:
    """Rigid parts that move as one."""
    masses = [mechanism.parts[part].mass for part in parts]
    total = sum(masses)
    if total == 0:
        return Body(0.0, (0.0, 0.0), 0.0)
    centres = [layout.frames[part].place(*mechanism.parts[part].centre) for part in parts]
    weighted = list(zip(masses, centres, strict=True))
    x = sum(m * c[0] for m, c in weighted) / total
    y = sum(m * c[1] for m, c in weighted) / total
    inertia = sum(mechanism.parts[part].inertia for part in parts)
    inertia += sum(m * ((c[0] - x) ** 2 + (c[1] - y) ** 2) for m, c in weighted)
    return Body(total, (x, y), inertia)


def turned(angle: float) -> FloatArray:
    """Rotation (3, 3) about z."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

"""Torsional springs that start wound by more than half a turn."""

from __future__ import annotations

from collections.abc import Iterator
from math import degrees, pi

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism.kinematics import turning
from exudyn_flexlink.mechanism.model import Mechanism

HALF_A_TURN = pi + 1e-6  # rad: what is assembled at half a turn is not beyond it by rounding


def wound_at_start(mechanism: Mechanism, q: FloatArray) -> Iterator[str]:
    """Say which springs are wound by more than half a turn at coordinates (parts, 3) of time 0.

    That may be meant, as of the spring of a clock. But 170 deg and -190 deg are one place of a body
    and two of a spring.
    """
    for spring in mechanism.springs:
        wound = float(turning(spring.first, spring.second, q)) - (spring.rest_angle or 0.0)
        if spring.stiffness > 0 and abs(wound) > HALF_A_TURN:
            yield (
                f"'{spring.name}' starts wound by {degrees(wound):.4g} deg: whole turns count; "
                "where they are not meant, give an angle in 'initial' 360 deg more or less"
            )

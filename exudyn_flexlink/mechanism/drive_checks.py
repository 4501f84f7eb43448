"""Whether drives have values as long as a run lasts, and do not ask for jumps."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import inf

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.expressions import NoValueError
from exudyn_flexlink.mechanism.model import Mechanism, Motor
from exudyn_flexlink.mechanism.prescribed import Applied, SpeedOf, Tabled
from exudyn_flexlink.mechanism.ramps import Ramp
from exudyn_flexlink.source import KeyPath, Mistake

LOOKS = 200  # parts of a run, at whose ends a value is looked at: halves and tenths are among them
BESIDE = 1e-9  # s, to either side of a knot: there a value is looked at
JUMP = 1e-6  # of the largest value: a difference that is no rounding


def drive_mistakes(mechanism: Mechanism, end: float) -> list[Mistake]:
    """Return the drives of time alone that have no value up to `end` (s), or jump where none may.

    `end` is that of the run at the latest.
    """
    found: list[Mistake] = []
    for motor in mechanism.speed_motors:
        path = ("drives", motor.name, "value")
        speed = motor.speed
        others = [speed.rates, *([speed.integrals] if isinstance(speed, SpeedOf) else [])]
        missing = list(_missing(path, speed, end, *others))
        found += missing or _jumps(path, motor, end)
    for torque in mechanism.torque_motors:
        if not torque.size.senses:
            found += _missing(("drives", torque.name, "value"), torque.size.value, end)
    for force in mechanism.forces:
        for i, size in enumerate(force.sizes):
            if not size.senses:
                found += _missing(("drives", force.name, "value", i), size.value, end)
    return found


def _missing(
    path: KeyPath, function: Applied, end: float, *others: Callable[[FloatArray], FloatArray]
) -> Iterator[Mistake]:
    """Say where a function of time has no value, or no value of `others` of it."""
    if isinstance(function, Ramp) or end == inf:
        return
    table = function.motion if isinstance(function, SpeedOf) else function
    if isinstance(table, Tabled):
        last = table.times[-1]
        if last < end * (1 - 1e-12):
            message = f"the table ends at {last:g} s, the run at {end:g} s"
            yield Mistake(path, message, "more rows, or a shorter run")
        return
    try:
        looks = _instants(function, end)
        for values in (function.values, *others):
            values(looks)
    except NoValueError as error:
        yield Mistake(path, str(error), "where(t < 1, one, other) takes other formulas elsewhere")


def _instants(function: Applied, end: float) -> FloatArray:
    """Instants (n,) s of a run up to `end` at which values are looked at: beside knots, too."""
    knots = np.array(function.knots(end))
    beside = np.maximum(BESIDE, BESIDE * knots)
    sides = np.clip(np.concatenate([knots - beside, knots + beside]), 0.0, end)
    return np.concatenate([np.linspace(0.0, end, LOOKS + 1), np.sort(sides)])


def _jumps(path: KeyPath, motor: Motor, end: float) -> Iterator[Mistake]:
    """A speed can't jump, nor can an angle: no finite force would do that."""
    speed = motor.speed
    if isinstance(speed, (Ramp, Tabled)):
        return
    kinds = [("speed", speed.values, speed.rates)]
    if isinstance(speed, SpeedOf):
        kinds = [("value", speed.motion.values, speed.values), *kinds]
    looks = np.linspace(0.0, end, LOOKS + 1)
    for knot in speed.knots(end):
        for name, values, rates in kinds:
            beside = max(BESIDE, BESIDE * knot)
            sides = np.array([knot - beside, knot + beside])
            before, after = values(sides)
            steep, largest = np.abs(rates(sides)).max(), np.abs(values(looks)).max()
            if abs(after - before) > 4 * beside * steep + JUMP * largest:
                yield Mistake(
                    path,
                    f"the {name} jumps from {before:.6g} to {after:.6g} at t = {knot:.6g} s",
                    "formulas must meet where one follows the other",
                )
                return

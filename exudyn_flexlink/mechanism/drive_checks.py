"""Whether drives have values as long as a run lasts, and do not ask for jumps."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import inf

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.expressions import NoValueError, pole
from exudyn_flexlink.mechanism.model import Mechanism, Motor
from exudyn_flexlink.mechanism.prescribed import Applied, Formula, SpeedOf, Tabled
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
        missing = list(_missing(path, motor.speed, end, motor.speed.rates))
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
        looks = np.concatenate([_looks(end), *_sides(function, end)]).clip(0.0, end)
        for values in (function.values, *others):
            values(looks)
        if isinstance(function, SpeedOf):
            function.integrals(looks)
        if isinstance(table, Formula):
            _require_bounds(table, end)
    except NoValueError as error:
        yield Mistake(path, str(error), "where(t < 1, one, other) takes other formulas elsewhere")


def _require_bounds(formula: Formula, end: float) -> None:
    """Refuse a formula of time that has a pole: values on both sides of it tell nothing of it.

    Raises:
        NoValueError: it grows without bound.

    """
    for addend in formula.expression.addends:
        time = pole(addend, formula.clock, formula.clock + end)
        if time is not None:
            raise NoValueError(formula.expression.text, time)


def _looks(end: float) -> FloatArray:
    """Instants (n,) s of a run up to `end` at which values are looked at."""
    return np.linspace(0.0, end, LOOKS + 1)


def _sides(function: Applied, end: float) -> tuple[FloatArray, FloatArray]:
    """Instants (knots,) s just before and just after every knot."""
    knots = np.array(function.knots(end))
    beside = np.maximum(BESIDE, BESIDE * knots)
    return knots - beside, knots + beside


def _jumps(path: KeyPath, motor: Motor, end: float) -> Iterator[Mistake]:
    """A speed can't jump, nor can an angle: no finite force would do that."""
    speed = motor.speed
    if isinstance(speed, (Ramp, Tabled)):
        return
    kinds = [("speed", speed.values, speed.rates)]
    if isinstance(speed, SpeedOf):
        kinds = [("value", speed.motion.values, speed.values), *kinds]
    first, last = _sides(speed, end)
    for name, values, rates in kinds:
        before, after = values(first), values(last)
        steep = np.maximum(np.abs(rates(first)), np.abs(rates(last)))
        least = 2 * (last - first) * steep + JUMP * np.abs(values(_looks(end))).max()
        jumps = np.flatnonzero(np.abs(after - before) > least)
        if len(jumps):
            k = jumps[0]
            time = (first[k] + last[k]) / 2
            yield Mistake(
                path,
                f"the {name} jumps from {before[k]:.6g} to {after[k]:.6g} at t = {time:.6g} s",
                "formulas must meet where one follows the other",
            )
            return

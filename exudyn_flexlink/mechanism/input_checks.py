"""Whether drives have values and do not jump, and what is told of valid points and starts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import inf
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves import closing
from exudyn_flexlink.expressions import NoValueError, pole
from exudyn_flexlink.mechanism.assembly import Assembly
from exudyn_flexlink.mechanism.closing import CLOSED
from exudyn_flexlink.mechanism.kinematics import motor_place, motor_speed
from exudyn_flexlink.mechanism.model import Mechanism, Motor
from exudyn_flexlink.mechanism.prescribed import Applied, Formula, Ramp, SpeedOf, Tabled
from exudyn_flexlink.scene import Scene, SplineSpec
from exudyn_flexlink.source import KeyPath, Mistake

PARTS_LOOKED_AT = (
    200  # parts of a run, at whose ends a value is looked at: halves and tenths are among them
)
BESIDE = 1e-9  # s, to either side of a knot: there a value is looked at
JUMP = 1e-6  # of the largest value: a difference that is no rounding
LEAP = 1e-3  # of the fastest part: coarse runs in redundant coordinates are off by a third of it
STILL = 1e-2  # rad/s, m/s or m: what is less may be nothing but for a run's errors
MOVED = 0.1  # of the tolerance: so far a place may give way to joints without a word


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
    return np.linspace(0.0, end, PARTS_LOOKED_AT + 1)


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


def input_notes(scene: Scene, assembly: Assembly) -> Iterator[str]:
    """Say which splines are closed by their last point, which places moved, which drives jump."""
    mechanism = assembly.mechanism
    for name, curve in scene.curves.items():
        for gap in _repeats(curve):
            told = "closes the curve, and is left out"
            yield f"curves.{name}: the last point, {gap:.3g} m from the first, {told}"
    if scene.initial.states:
        yield from list(_set_otherwise(scene, mechanism)) or _closed_otherwise(scene, assembly)
    held = {} if scene.initial.at_rest else scene.initial.positions  # or it is where a search began
    for body, given in held.items():
        found = assembly.state.q[mechanism.bodies[body][0], :2]
        away = float(np.hypot(*(found - given)))
        if away > MOVED * (scene.accuracy.tolerance or CLOSED):
            yield (
                f"initial.positions.{body}: moved by {away:.2g} m, to [{found[0]:.12g}, "
                f"{found[1]:.12g}], which its joints allow"
            )


def _set_otherwise(scene: Scene, mechanism: Mechanism) -> Iterator[str]:
    """Say which drives set another place or speed than the run had that a scene goes on from."""
    q, v = _states(scene, mechanism)
    for motor in mechanism.speed_motors:
        unit, axes = ("m", slice(0, 2)) if motor.slide else ("rad", slice(2, 3))
        largest = np.abs(v[:, axes]).max(), np.abs(q[:, :2]).max() if motor.slide else 1.0
        speeds = f"{unit}/s", motor_speed(motor, q, v), motor.speed.at(0.0), largest[0]
        places = unit, motor_place(motor, q), motor.start, largest[1]
        for of, was, now, size in (speeds, places):
            if now is not None and abs(now - was) > LEAP * max(abs(now), size, STILL):
                yield (
                    f"drives.{motor.name}: sets {now:.6g} {of} where the run that this one goes on "
                    f"from had {was:.6g} {of}: it jumps as it begins"
                )


def _closed_otherwise(scene: Scene, assembly: Assembly) -> Iterator[str]:
    """Say how far joints move bodies from where the run had them that a scene goes on from."""
    mechanism = assembly.mechanism
    moves = np.hypot(*(assembly.state.q - _states(scene, mechanism)[0])[:, :2].T)
    of_bodies = {body: moves[list(parts)].max() for body, parts in mechanism.bodies.items()}
    farthest, away = max(of_bodies.items(), key=lambda item: item[1])
    if away > MOVED * (scene.accuracy.tolerance or CLOSED):
        yield (
            f"initial.states: joints are not where the run that this one goes on from had them: "
            f"{farthest} is moved by {away:.2g} m as it begins"
        )


def _states(scene: Scene, mechanism: Mechanism) -> tuple[FloatArray, FloatArray]:
    """Coordinates and velocities (parts, 3) of all parts that a scene goes on from."""
    rows = [row for name in mechanism.bodies for row in scene.initial.states[name]]
    q, v = np.split(np.array(rows, dtype=float), 2, axis=1)
    return q, v


def _repeats(curve: Any) -> Iterator[float]:
    """How far first and last points are apart, m, of splines in a curve that leave the last out."""
    if isinstance(curve, SplineSpec):
        points = np.array(curve.points)
        if len(closing(points, curve.closed)[0]) < len(points):
            yield float(np.linalg.norm(points[-1] - points[0]))
    for inner in (*getattr(curve, "pieces", ()), *getattr(curve, "curves", ())):
        yield from _repeats(inner)

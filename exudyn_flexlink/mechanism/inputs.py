"""What is told of a scene's points and tables before a run, though they are valid."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from exudyn_flexlink.curves import closing
from exudyn_flexlink.mechanism.assembly import Assembly
from exudyn_flexlink.mechanism.closing import CLOSED
from exudyn_flexlink.mechanism.model import Mechanism
from exudyn_flexlink.mechanism.schedule import end_of_run
from exudyn_flexlink.mechanism.sensing import motor_place, motor_speed
from exudyn_flexlink.scene import Scene, SplineSpec, Table

MANY_ROWS = 10_000  # of a table: fewer cost no run much time
JUMP = 1e-3  # of the fastest part: coarse runs in redundant coordinates are off by a third of it
STILL = 1e-2  # rad/s, m/s or m: what is less may be nothing but for a run's errors
MOVED = 0.1  # of the tolerance: so far a place may give way to joints without a word
SAME = 1e-6  # of a table's largest value: what a row adds to the line between its neighbours


def input_notes(scene: Scene, assembly: Assembly) -> Iterator[str]:
    """Say which splines are closed by their last point, which places moved, which rows are idle."""
    mechanism = assembly.mechanism
    for name, curve in scene.curves.items():
        for gap in _repeats(curve):
            told = "closes the curve, and is left out"
            yield f"curves.{name}: the last point, {gap:.3g} m from the first, {told}"
    yield from _jumps(scene, mechanism)
    for body, given in scene.initial.positions.items():
        found = assembly.state.q[mechanism.bodies[body][0], :2]
        away = float(np.hypot(*(found - given)))
        if away > MOVED * (scene.accuracy.tolerance or CLOSED):
            yield (
                f"initial.positions.{body}: moved by {away:.2g} m, to [{found[0]:.12g}, "
                f"{found[1]:.12g}], which its joints allow"
            )
    begin, end = scene.initial.clock, end_of_run(scene, mechanism)
    for name, drive in scene.drives.items():
        for value in drive.value if isinstance(drive.value, tuple) else (drive.value,):
            rows = len(value.points or ()) if isinstance(value, Table) else 0
            if rows >= MANY_ROWS and (idle := _idle_rows(value, begin, begin + end)) > rows / 2:
                yield (
                    f"drives.{name}: {idle:,} of {rows:,} rows are outside of the run, or on the "
                    "line between their neighbours: fewer rows would give the same in less time"
                )


def _jumps(scene: Scene, mechanism: Mechanism) -> Iterator[str]:
    """Say which drives set another place or speed than the run had that a scene goes on from."""
    if not scene.initial.states:
        return
    rows = [row for name in mechanism.bodies for row in scene.initial.states[name]]
    q, v = np.split(np.array(rows, dtype=float), 2, axis=1)
    for motor in mechanism.speed_motors:
        unit, axes = ("m", slice(0, 2)) if motor.slide else ("rad", slice(2, 3))
        largest = np.abs(v[:, axes]).max(), np.abs(q[:, :2]).max() if motor.slide else 1.0
        speeds = f"{unit}/s", motor_speed(motor, q, v), motor.speed.at(0.0), largest[0]
        places = unit, motor_place(motor, q), motor.start, largest[1]
        for of, was, now, size in (speeds, places):
            if now is not None and abs(now - was) > JUMP * max(abs(now), size, STILL):
                yield (
                    f"drives.{motor.name}: sets {now:.6g} {of} where the run that this one goes on "
                    f"from had {was:.6g} {of}: it jumps as it begins"
                )


def _repeats(curve: Any) -> Iterator[float]:
    """How far first and last points are apart, m, of splines in a curve that leave the last out."""
    if isinstance(curve, SplineSpec):
        points = np.array(curve.points)
        if len(closing(points, curve.closed)[0]) < len(points):
            yield float(np.linalg.norm(points[-1] - points[0]))
    for inner in (*getattr(curve, "pieces", ()), *getattr(curve, "curves", ())):
        yield from _repeats(inner)


def _idle_rows(table: Any, begin: float, end: float) -> int:
    times, values = np.array(table.points, dtype=float).T
    between = values[:-2].copy()
    if table.rule != "step":
        rates = (values[2:] - values[:-2]) / (times[2:] - times[:-2])
        between += rates * (times[1:-1] - times[:-2])
    needed = np.ones(len(times), dtype=bool)
    needed[1:-1] = np.abs(values[1:-1] - between) > SAME * np.abs(values).max()
    return len(times) - int(np.count_nonzero(needed & (times >= begin) & (times <= end)))

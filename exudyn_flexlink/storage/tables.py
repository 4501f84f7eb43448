"""Tables of a run: columns by name and unit."""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.intervals import Intervals
from exudyn_flexlink.observables import (
    body_motion,
    crank_angle,
    crank_column,
    forces_of,
    lever_response,
    momentary_forces,
    path,
    point_names,
    struck_bodies,
    watched_point,
)
from exudyn_flexlink.result import Result
from exudyn_flexlink.sweeps import column_of
from exudyn_flexlink.variables import members

UNITS = {own.name: own.variable.units or "" for own in members(Intervals) if own.variable}
"""Of what is told of touches, and of the strikes that are made of them."""


def trajectory_columns(result: Result, point: str) -> dict[str, FloatArray]:
    """Motion of 'body.point' as columns (N,) by name and unit.

    Raises:
        ValueError: the scene has no such point.

    """
    seen = path(result, point)
    (x, y), (vx, vy) = seen.position.T, seen.velocity.T
    return _instants(result) | {"x_m": x, "y_m": y, "vx_m_per_s": vx, "vy_m_per_s": vy}


def lever_columns(result: Result, contact: str) -> dict[str, FloatArray]:
    """Motion of the body that a contact strikes, as columns (N,) by name and unit.

    Raises:
        ValueError: the scene has no such contact.

    """
    seen = lever_response(result, contact)
    return _instants(result) | {
        seen.measure.name: seen.value,
        seen.measure.rate_name: seen.rate,
        "tip_displacement_m": seen.tip_displacement,
    }


def touch_columns(result: Result, name: str) -> dict[str, FloatArray]:
    """Every touch of a joint's pairs or of a contact, as columns (touches,) by name and unit.

    `pair` counts from 1, in the order of the sleeve's `pairs` in the summary. What still touches as
    the run ends has `ended` 0, and its `end_s` is the end of the run.
    """
    touches, last = result.intervals[name], float(result.time[-1])
    columns: dict[str, FloatArray] = {"begin_s": touches.begin, "end_s": touches.until(last)}
    angle = crank_column(result.scene)
    if angle is not None:
        columns[f"{angle}_rad"] = np.interp(touches.begin, result.time, crank_angle(result))
    told = ("impulse", "energy_lost", "peak_force", "approach_speed", "place", "penetration")
    columns["pair"] = np.asarray(touches.pair + 1, dtype=np.float64)
    columns |= {column_of(name, UNITS[name]): getattr(touches, name) for name in told}
    return columns | {"ended": np.isfinite(touches.end).astype(np.float64)}


def force_columns(result: Result) -> dict[str, FloatArray]:
    """All forces and torques as columns (N,), as ``crank.joint_force_x_N``.

    A contact by impulses has none: they are in `touch_columns`.
    """
    columns, left_out = _instants(result), momentary_forces(result)
    for told, force in forces_of(result).items():
        name, quantity, values = force.name, force.quantity.replace(" ", "_"), force.values
        if quantity == "wall_force":  # of 'sleeve, upper wall'
            name, _, wall = name.rpartition(", ")
            quantity = f"{wall.replace(' ', '_')}_force"
        parts = {"": values} if values.ndim == 1 else {"_x": values[:, 0], "_y": values[:, 1]}
        if told not in left_out:
            for axis, own in parts.items():
                columns[column_of(f"{name}.{quantity}{axis}", force.unit)] = own
    return columns


def all_columns(result: Result) -> dict[str, FloatArray]:
    """All that is told at every sample, as columns (N,): ``link.angle_rad``, ``link.end.x_m``.

    Bodies and points, answers of struck bodies (``lever.response.angle_rad``), forces (see
    `force_columns`) and energies (``energy.kinetic_J``).
    """
    struck, energy, told = struck_bodies(result.scene), result.energy, _instants(result)
    columns = dict(told)
    for body in result.scene.bodies:
        seen = body_motion(result, body)
        columns |= {f"{body}.angle_rad": seen.angle, f"{body}.rate_rad_per_s": seen.rate}
    tables = {point: trajectory_columns(result, point) for point in point_names(result.scene)}
    tables |= {f"{body}.response": lever_columns(result, own) for body, own in struck.items()}
    for name, table in tables.items():
        columns |= {f"{name}.{key}": own for key, own in table.items() if key not in told}
    names = ("kinetic", "stored", "dissipated", "supplied", "residual")
    return (
        columns
        | force_columns(result)
        | {f"energy.{name}_J": getattr(energy, name) for name in names}
    )


def _instants(result: Result) -> dict[str, FloatArray]:
    columns = {"t_s": result.time}
    angle = crank_column(result.scene)
    if angle is not None:
        columns[f"{angle}_rad"] = crank_angle(result)
    return columns


def tables_of(result: Result) -> dict[str, dict[str, FloatArray]]:
    """Return the tables of a run by file name; the user's names may not be fit for one."""
    point = watched_point(result.scene)
    tables = {f"trajectory_{_fit(point)}.csv": trajectory_columns(result, point)}
    forces = force_columns(result)
    if len(forces) > len(_instants(result)):
        tables["forces.csv"] = forces
    for body, contact in struck_bodies(result.scene).items():
        tables[_free_name(f"lever_{_fit(body)}", tables)] = lever_columns(result, contact)
    for joint in (*result.bearings, *result.sleeves):
        if len(result.intervals[joint]):
            tables[_free_name(f"touches_{_fit(joint)}", tables)] = touch_columns(result, joint)
    return tables


def _fit(name: str) -> str:
    return re.sub(r"[^\w.-]", "_", name)[:60]


def _free_name(stem: str, taken: Iterable[str]) -> str:
    """Name of a file that is not taken: two names of a scene may become one."""
    while f"{stem}.csv".lower() in map(str.lower, taken):  # some file systems see no case
        stem += "_"
    return f"{stem}.csv"

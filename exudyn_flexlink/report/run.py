"""What the program says after a run: how it ended, strikes, energy, how far to trust it."""

from __future__ import annotations

from math import isfinite

import numpy as np

from exudyn_flexlink.measured_error import MeasuredError
from exudyn_flexlink.observables import (
    STILL,
    forces_of,
    joints_with_play,
    judged_points,
    name_of,
    room,
    still_text,
    worst_force,
)
from exudyn_flexlink.observables.forces import NO_FORCE
from exudyn_flexlink.report.contacts import (
    BESIDES,
    force_error_table,
    guide_lines,
    response_table,
    strike_table,
)
from exudyn_flexlink.report.parts import restitution_table
from exudyn_flexlink.report.text import Table, in_blocks, lines_of, number
from exudyn_flexlink.result import Result

MOST_STRIKES = 20  # more than that scroll the rest of the summary away
_ENERGIES = {
    "kinetic": "kinetic",
    "stored": "stored in springs, weight and contacts",
    "dissipated": "dissipated since the start",
    "supplied": "supplied by drives since the start",
}
_REDUNDANT = ("redundant", "beam")
_USED_BY = {
    "steps_per_contact": _REDUNDANT,
    "spectral_radius": _REDUNDANT,
    "integrator": ("lagrangian",),
}
"""Which formulations, or engine, use a setting of the solver that others do not."""


def run_text(result: Result) -> str:
    """Return the summary of a run: time and steps, strikes, errors."""
    ending = "Completed" if result.outcome.completed else "Stopped before its end"
    blocks = [
        [f"{ending}: {result.scene.title}", *lines_of(cost_table(result))],
        lines_of(restitution_table(result.scene)),
        *(_strikes(result, contact) for contact in result.scene.all_contacts),
        lines_of(response_table(result)),
        lines_of(friction_table(result)),
        *(guide_lines(result, joint) for joint in joints_with_play(result)),
        lines_of(error_table(result)),
        lines_of(run_force_errors(result)),
    ]
    return in_blocks(blocks)


def failure_text(result: Result) -> str:
    """Return when and why a run stopped, and what to try."""
    outcome = result.outcome
    lines = [f"the run stopped at {number(outcome.time)} s: {outcome.reason}"]
    return "\n".join(lines + ([f"try: {outcome.advice}"] if outcome.advice else []))


def idle_settings(result: Result) -> list[str]:
    """Say which settings of how to solve the model had no use in this run.

    Nobody shall look for their effect. What has its default counts as not given: saved scenes say
    everything.
    """
    way = result.settings.formulation or result.engine
    by = "the engine 'lagrangian'" if way == "lagrangian" else f"the formulation '{way}'"
    solver = result.scene.solver
    usual = type(solver).model_fields
    return [
        f"'solver.{name}' changes nothing: {by} has no use for it"
        for name, users in _USED_BY.items()
        if way not in users and getattr(solver, name) != usual[name].default
    ]


def cost_table(result: Result) -> Table:
    """Return how long a run is, and what it took."""
    checks = result.checks
    steps = f"{checks.steps}, from {checks.smallest_step:.3g} to {checks.largest_step:.3g} s"
    rows = [["simulated time", f"{number(result.outcome.time)} s"]]
    if "solve" in result.timings:
        second = result.timings.get("second run", 0.0)
        more = f", and {second:.2f} s of a second run" if second else ""
        rows.append(["solver time", f"{result.timings['solve']:.2f} s{more}"])
    return Table("", [*rows, ["steps", steps]])


def energy_table(result: Result) -> Table:
    """Return energies where the run begins and ends, and the largest by size at any sample."""
    rows = []
    for name, told in _ENERGIES.items():
        values = getattr(result.energy, name)
        largest = values[int(np.argmax(np.abs(values)))]
        rows.append([told, *(f"{value:.4g}" for value in (values[0], values[-1], largest))])
    head, units = ["", "at the start", "at the end", "largest"], ["", "J", "J", "J"]
    return Table("Energies of all parts together", rows, head, units)


def _strikes(result: Result, contact: str) -> list[str]:
    told = strike_table(result, contact, MOST_STRIKES).without(BESIDES)
    return lines_of(told) or [f"{told.caption}: none"]


def friction_table(result: Result) -> Table:
    """Return what dry friction took in each joint, and how long that rested."""
    end, rows = float(result.time[-1]), []
    for name, own in result.frictions.items():
        lasts = bool(np.isinf(own.end[-1:]).any())
        since = f"from {number(float(own.begin[-1]))} s on" if lasts else ""
        rows.append([name, f"{own.lost[-1]:.4g}", number(own.rest_until(end)), since])
    head, units = ["joint", "lost", "at rest", ""], ["", "J", "s", ""]
    return Table("Friction in joints", rows, head, units)


def error_table(result: Result) -> Table:
    """Return how far a run is off, as it knows itself and by a second run."""
    checks = result.checks
    share = f"{100 * checks.relative_energy_residual:.2g} % of the largest kinetic energy"
    rows = [
        ["energy balance", f"off by {checks.energy_residual:.2g} J, {share}"],
        ["joints", f"open by {checks.constraint_error:.2g} (m or rad) at most"],
    ]
    penetration = f"penetration {checks.largest_penetration:.2g} m at most"
    if isfinite(checks.steps_per_contact):
        steps = f"{number(checks.steps_per_contact)} steps per contact"
        rows.append(["contacts", f"{steps}, {penetration}"])
    elif checks.largest_penetration > 0:
        rows.append(["contacts", penetration])
    rows.append(["positions", _still(result) or positions_text(result.error)])
    if forces_of(result):
        rows.append(["forces", forces_text(result.error)])
    return Table("Errors", rows)


def _still(result: Result) -> str:
    """Say that no point which is judged moves, so that the tolerance limits nothing; else ''."""
    points = judged_points(result.scene)
    moved = len(result.time) < 2 or not room(result, points) <= STILL  # nan of a failed run moves
    if moved:
        return ""
    hint = "a point off the axis of a body would show how that turns"
    return f"not measured: {still_text(points)}; {hint}"


def run_force_errors(result: Result) -> Table:
    """Return how far forces are off, as a second run tells; no rows without one."""
    caption = f"Errors of forces, as a second run tells{_until(result.error)}"
    return force_error_table(result.error.forces, caption)


def positions_text(error: MeasuredError) -> str:
    """How far points are off, as a second run tells, and up to when instants are known."""
    if error.missing:
        return f"not measured: {error.missing}"
    points, limit = name_of(error.points), f"{error.limit:.3g} m"
    worst = f" ({error.worst})" if len(error.points) > 1 else ""
    until = "" if error.stopped is None else f" up to t = {number(error.stopped)} s"
    if error.exceeds_from is None:
        return f"{points} within {error.largest:.2g} m{worst}{until}, asked {limit}"
    told = f"{points} within {limit}, as asked, up to t = {number(error.exceeds_from)} s"
    then = f"within {error.largest:.2g} m{worst}"
    if error.horizon is None:
        return f"{told}; then {then}{until}"
    horizon = f"t = {number(error.horizon)} s, the horizon: after it trust statistics only"
    return f"{told}; {then} up to {horizon}"


def forces_text(error: MeasuredError) -> str:
    """How far the force is off that is farthest off, as a part of its largest value."""
    name, part = worst_force(error.forces)
    if error.missing or not name:
        return "not measured"
    own = error.forces[name]
    free = " while nothing touches" if own.free and own.free.size > NO_FORCE else " in contact"
    when = free if own.free and own.touching else ""
    return f"within {100 * part:.2g} % of their largest ({name}){when}{_until(error)}"


def _until(error: MeasuredError) -> str:
    end = error.known_until
    return f", up to t = {number(end)} s" if isfinite(end) else ""

"""What the program says after a run: how it ended, strikes, how far to trust it."""

from __future__ import annotations

from math import degrees, inf, isfinite

from exudyn_flexlink.observables import (
    LeverResponse,
    Strike,
    crank_joint,
    forces_of,
    joints_with_play,
    lever_response,
    name_of,
    relative_energy_residual,
    strikes,
    struck_bodies,
)
from exudyn_flexlink.report.contacts import sleeve_lines
from exudyn_flexlink.report.forces import force_table
from exudyn_flexlink.report.text import number, table
from exudyn_flexlink.result import MeasuredError, Result

MOST_STRIKES = 20  # more than that scroll the rest of the summary away


def run_text(result: Result) -> str:
    """Return the summary of a run: time and steps, strikes, errors."""
    blocks = [
        [_ending(result), *_cost(result)],
        *(_strikes(result, contact) for contact in result.scene.contacts),
        _responses(result),
        *(sleeve_lines(result, joint) for joint in joints_with_play(result)),
        _errors(result),
        _errors_of_forces(result),
    ]
    return "\n\n".join("\n".join(block) for block in blocks if block)


def failure_text(result: Result) -> str:
    """Return when and why a run stopped, and what to try."""
    outcome = result.outcome
    lines = [f"the run stopped at {number(outcome.time)} s: {outcome.reason}"]
    return "\n".join(lines + ([f"try: {outcome.advice}"] if outcome.advice else []))


def _ending(result: Result) -> str:
    outcome = result.outcome
    word = "Completed" if outcome.completed else "Stopped before its end"
    return f"{word}: {result.scene.title}"


def _cost(result: Result) -> list[str]:
    checks = result.checks
    steps = f"{checks.steps}, from {checks.smallest_step:.3g} to {checks.largest_step:.3g} s"
    rows = [["simulated time", f"{number(result.outcome.time)} s"]]
    if "solve" in result.timings:
        rows.append(["solver time", f"{result.timings['solve']:.2f} s"])
    if "compile" in result.timings:
        rows.append(["compiling before", f"{result.timings['compile']:.2f} s"])
    return table([*rows, ["steps", steps]])


def _strikes(result: Result, contact: str) -> list[str]:
    found = strikes(result, contact)
    if not found:
        return [f"Strikes of {contact}: none"]
    struck = result.scene.contacts[contact].struck
    response = None if struck is None else lever_response(result, contact)
    ends = [strike.begin for strike in found[1:]] + [inf]
    peak = "" if struck is None else f"{struck} peak"
    lap = ["lap"] if found[0].lap is not None else []
    turned = [] if found[0].crank_angle is None else [f"angle of {crank_joint(result.scene)}"]
    rows = [[*lap, *turned, "time", "approach", "place", peak]]
    rows += [
        [*_turned(strike), *_strike(strike, response, end)]
        for strike, end in list(zip(found, ends, strict=True))[:MOST_STRIKES]
    ]
    more = len(found) - MOST_STRIKES
    return [f"Strikes of {contact}", *table(rows), *([f"  and {more} more"] if more > 0 else [])]


def _strike(strike: Strike, response: LeverResponse | None, until: float) -> list[str]:
    """Return one row of the table; `until` is when the next strike begins."""
    peak = None if response is None else response.between(strike.begin, until).farthest
    return [
        f"{strike.begin:.5f} s",
        f"{strike.approach_speed:.4f} m/s",
        f"{strike.place:.5f} m",
        "" if peak is None else f"{peak:+.5f} rad",
    ]


def _turned(strike: Strike) -> list[str]:
    """Lap and angle of the joint whose turns count, as far as there are any."""
    lap, angle = strike.lap, strike.crank_angle
    told = [] if lap is None else [str(lap)]
    return [*told, *([] if angle is None else [f"{degrees(angle) % 360:.2f} deg"])]


def _responses(result: Result) -> list[str]:
    """Least and largest angle of every struck body, from where it stood at time 0."""
    rows = []
    for body, contact in struck_bodies(result.scene).items():
        response = lever_response(result, contact)
        (low, _), (high, _) = response.least, response.greatest
        rows.append([body, f"from {low:+.5f} to {high:+.5f} rad"])
    return ["Angle of struck bodies", *table(rows)] if rows else []


def _errors(result: Result) -> list[str]:
    checks = result.checks
    share = f"{100 * relative_energy_residual(result):.2g} % of the largest kinetic energy"
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
    if result.error is not None:
        rows.append(["positions", _off(result.error)])
    if forces_of(result) and (result.error is None or result.error.missing):
        rows.append(["forces", "not measured: '--horizon' makes a second run, which tells them"])
    return ["Errors", *table(rows)]


def _errors_of_forces(result: Result) -> list[str]:
    """How far forces are off, as a neighbouring run tells."""
    if result.error is None or not (lines := force_table(result.error.forces)):
        return []
    until = result.error.forces_until
    end = "" if until is None else f", up to t = {number(until)} s"
    return [f"Errors of forces, as a neighbouring run tells{end}", *lines]


def _off(error: MeasuredError) -> str:
    """How far points are off, as a neighbouring run tells."""
    if error.missing:
        return f"not measured: {error.missing}"
    points, limit = name_of(error.points), f"{error.limit:.3g} m"
    until = "" if error.stopped is None else f" up to t = {number(error.stopped)} s"
    worst = f" ({error.worst})" if len(error.points) > 1 else ""
    if error.exceeds_from is None:
        return f"{points} off by {error.largest:.2g} m at most{worst}{until}, of {limit} allowed"
    within = f"within {limit} up to t = {number(error.exceeds_from)} s"
    return f"{points} {within}; off by {error.largest:.2g} m in the end{worst}{until}"

"""The report on a run: its end, strikes, touches in joints with clearance, forces.

It also has energies and errors, so that users can judge how far to trust the run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import islice, pairwise
from math import degrees, inf, isfinite

import numpy as np

from exudyn_flexlink.observables import (
    BendingPeak,
    ContactTotals,
    PairTotals,
    State,
    Strike,
    bending,
    bent_links,
    contact_totals,
    crank_joint,
    deepest,
    force_peaks,
    forces_of,
    joints_with_play,
    judged_points,
    lap_contacts,
    lever_response,
    name_of,
    pair_totals,
    room,
    still_text,
    strikes,
    struck_bodies,
    worst_force,
)
from exudyn_flexlink.observables.forces import NO_FORCE, WEAK_FORCE
from exudyn_flexlink.report.parts import restitution_table
from exudyn_flexlink.report.text import (
    MOST_ROWS,
    Column,
    Table,
    in_blocks,
    instant,
    left_out,
    lines_of,
    number,
    table,
    table_of_items,
)
from exudyn_flexlink.result import (
    ForceDeviation,
    FrictionHistory,
    Interval,
    MeasuredError,
    Result,
)
from exudyn_flexlink.rounding import PLACE_ROUNDING
from exudyn_flexlink.scene import RevoluteJoint, SleeveJoint, SlotJoint
from exudyn_flexlink.shipped import ENGINES, LAGRANGIAN

MOST_PAIRS = 3
NO_PLAY = "no clearance"
BESIDES = ("lasts", "touches", "impulse", "energy lost", "peak force")
"""Columns that a terminal has no room for."""


def _part_of_time(state: State) -> Column[ContactTotals]:
    key = f"part_of_time_{state.name.lower()}"
    return Column(
        state.label,
        lambda totals: totals.fractions[state],
        lambda part: f"{100 * part:.1f}",
        "%",
        key,
    )


TOTALS: Sequence[Column[ContactTotals]] = (
    *map(_part_of_time, State),
    Column("touches", "touches", key="touches"),
    Column("impacts", "impacts", key="impacts"),
    Column("impulse", "impulse", "{:.3g}".format, "N s", "impulse_N_s"),
    Column("energy lost", "energy_lost", "{:.2g}".format, "J", "energy_lost_J"),
    Column(None, "longest", key="longest_touch_s"),
)
"""Columns on the contacts of a joint in a stretch of time."""


def guide_lines(result: Result, joint: str) -> list[str]:
    """Return the states of a link in its guide, by lap and in all, and its longest touches."""
    whole = lines_of(guide_table(result, joint), units_above=True)
    return [*whole, *table([*guide_facts(result, joint).rows, *_longest_pairs(result, joint)])]


def guide_table(result: Result, joint: str) -> Table:
    """Return times free and in contact, of a link, a journal or a pin: by lap and in all."""
    whole = contact_totals(result, joint)
    laps = lap_contacts(result, joint) if crank_joint(result.scene) is not None else []
    totals = {str(i): lap for i, lap in enumerate(laps[:MOST_ROWS], start=1)}
    totals |= {"all": whole} if len(laps) != 1 else {}
    more = len(laps) - MOST_ROWS
    if joint in result.bearings:
        what = f"Journal in '{joint}': time free, on one point; touches and impacts"
    elif isinstance(result.scene.joints[joint], SlotJoint):
        what = f"Pin in '{joint}': time free, on one wall; touches and impacts"
    else:
        what = f"Link in '{joint}': time free, on one point, on two; touches of all points; impacts"
        what += " of the free link"
    shown = table_of_items(what, TOTALS, list(totals.values()))
    note = f"'all' includes {more} laps more" if more > 0 else ""
    return replace(shown.named(totals, "lap" if laps else ""), note=note)


def guide_facts(result: Result, joint: str) -> Table:
    """Return the deepest penetration of a guide's walls, and the longest touch, if there is one."""
    sleeve, depth = result.scene.joints[joint], deepest(result, joint)
    assert isinstance(sleeve, (SleeveJoint, RevoluteJoint, SlotJoint))
    # The walls are too soft if this is a large part of the clearance.
    part = f"{100 * depth / sleeve.clearance:.3g} % of the clearance"
    rows = [["deepest in a wall", f"{depth:.2g} m, {part}"]]
    if len(result.intervals[joint]):
        rows.append(["longest touch", f"{contact_totals(result, joint).longest:.3g} s"])
    return Table("", rows)


def pair_table(result: Result, joint: str, most: int) -> Table:
    """Return the pairs of a joint that touched; the longest total time comes first."""
    totals = pair_totals(result, joint)
    columns: Sequence[Column[PairTotals]] = (
        Column("", "pair", lambda name: name.removeprefix(f"{joint}: ")),
        Column("touches", "touches"),
        Column("in all", "time", "{:.3g}".format, "s"),
        Column("impulse", "impulse", "{:.3g}".format, "N s"),
        Column("energy lost", "energy_lost", "{:.3g}".format, "J"),
        Column("peak force", "peak_force", "{:.4g}".format, "N"),
    )
    caption = f"What touched in '{joint}', the longest first"
    return table_of_items(caption, columns, totals[:most], len(totals))


def touch_table(result: Result, joint: str, most: int) -> Table:
    """Return the first touches of a joint with clearance, each in a row."""
    last = float(result.time[-1])
    pairs = result.sleeves[joint].pairs if joint in result.sleeves else ("journal",)
    columns: Sequence[Column[Interval]] = (
        Column("begins", "begin", lambda time: instant(time, last), "s"),
        Column("lasts", lambda touch: min(touch.end, last) - touch.begin, "{:.3g}".format, "s"),
        Column("", lambda touch: pairs[touch.pair].removeprefix(f"{joint}: ")),
        Column("approach", "approach_speed", "{:.4f}".format, "m/s"),
        Column("impulse", "impulse", "{:.3g}".format, "N s"),
        Column("energy lost", "energy_lost", "{:.3g}".format, "J"),
        Column("peak force", "peak_force", _known, "N"),
    )
    touches = result.intervals[joint]
    first = list(islice(touches, most))
    return table_of_items(f"Touches in '{joint}'", columns, first, len(touches))


def contact_rows(
    joint: str, first: ContactTotals | None, second: ContactTotals | None
) -> list[list[str]]:
    """Return rows on a link in its guide in two runs; one run may have no clearance."""
    return [
        [
            f"{joint}: {column.head}",
            *(
                NO_PLAY if totals is None else f"{column.text(totals)} {column.unit}".rstrip()
                for totals in (first, second)
            ),
        ]
        for column in TOTALS
        if column.head
    ]


def _longest_pairs(result: Result, joint: str) -> list[list[str]]:
    """Return the pairs with the longest total time of touch, if any pair touches."""
    rows = []
    for i, pair in enumerate(pair_totals(result, joint)[:MOST_PAIRS]):
        name = pair.pair.removeprefix(f"{joint}: ")
        times = f"{pair.touches} touch{'es' if pair.touches > 1 else ''}"
        rows.append(["" if i else "longest in all", f"{name}: {pair.time:.3g} s in {times}"])
    return rows


def strike_table(result: Result, contact: str, most: int) -> Table:
    """Return the first `most` strikes of a contact, and the response of the struck body to each.

    Empty cells: the total impulse of a strike that has not ended, and the force of an impulse.
    """
    every_strike, last = strikes(result, contact), float(result.time[-1])
    struck = result.scene.all_contacts[contact].struck
    columns: list[Column[Strike]] = []
    turning = bool(every_strike) and every_strike[0].lap is not None
    if turning:
        columns.append(Column("lap", "lap"))
    if every_strike and every_strike[0].crank_angle is not None:
        whole = (lambda angle: angle % 360) if turning else float  # -120 deg of a limit are not 240
        head = f"angle of {crank_joint(result.scene)}"
        columns.append(
            Column(head, "crank_angle", lambda angle: f"{whole(degrees(angle)):.2f}", "deg")
        )
    columns += [
        Column("time", "begin", lambda time: instant(time, last), "s"),
        Column("approach", "approach_speed", lambda speed: f"{round(speed, 4) + 0.0:.4f}", "m/s"),
    ]
    if contact in result.scene.contacts:
        columns.append(Column("place", "place", "{:.5f}".format, "m"))
    if struck is not None:
        response = lever_response(result, contact)
        begins = [*(strike.begin for strike in every_strike), inf]
        until = dict(pairwise(begins))  # the begin of the next strike
        measure = response.measure
        columns.append(
            Column(
                f"{struck} peak",
                lambda strike: response.between(strike.begin, until[strike.begin]).farthest,
                measure.number,
                measure.unit,
            )
        )
    columns += [
        Column("lasts", lambda strike: strike.end - strike.begin, lambda t: instant(t, last), "s"),
        Column("touches", "contacts"),
        Column("impulse", "impulse", _known, "N s"),
        Column("energy lost", "energy_lost", _known, "J"),
        Column("peak force", "peak_force", _known, "N"),
    ]
    units = [result.scene.unit_of(contact, column.unit) for column in columns]
    shown = table_of_items(
        f"Strikes of contact '{contact}'", columns, every_strike[:most], len(every_strike)
    )
    return replace(shown, units=units)


def response_table(result: Result) -> Table:
    """Return the least and greatest displacement of every struck body, from its place at time 0."""
    rows = []
    for body, contact in struck_bodies(result.scene).items():
        response = lever_response(result, contact)
        (low, _), (high, _) = response.least, response.greatest
        measure = response.measure
        reach = f"from {measure.number(low)} to {measure.text(high)}"
        rows.append([body, f"{measure.word} {reach}"])
    return Table("Motion of struck bodies", rows)


def _known(value: float) -> str:
    return f"{value:.4g}" if isfinite(value) else ""


def peak_table(result: Result) -> Table:
    """Return the largest value of every force and torque, its instant, and its error.

    The error is omitted if no second run measured it.
    """
    known = result.error.forces
    rows = [
        [
            name,
            f"{peak.value:.4g} {peak.unit}",
            instant(peak.at, float(result.time[-1])) if peak.value else "",
            _off_by(known.get(name)),
        ]
        for name, peak in force_peaks(result).items()
    ]
    head, units = ["", "largest", "at", "off by at most"], ["", "", "s", ""]
    shown = Table("Largest forces and torques", rows, head, units)
    return shown if known else shown.without(head[3:])


def bending_peak_columns(last: float) -> Sequence[Column[BendingPeak]]:
    """Return columns on the largest bending of a link, in a run up to the instant `last` (s)."""
    return (
        Column("moment", "moment", "{:.4g} N m".format, "", "moment_N_m"),
        Column("at place", "place", lambda place: f"{1e3 * place:.4g} mm", "", "place_m"),
        Column("at", "at", lambda time: instant(time, last), "s", "at_s"),
        Column("stress", "stress", lambda stress: f"{stress / 1e6:.4g} MPa", "", "stress_Pa"),
        Column("strain", "strain", "{:.3g}".format, "", "strain"),
    )


def bending_table(result: Result) -> Table:
    """Return the largest bending of flexible links: moment, place, instant, stress and strain."""
    links = bent_links(result.scene)
    columns = bending_peak_columns(float(result.time[-1]))
    peaks = [bending(result, link).largest for link in links]
    return table_of_items("Largest bending of links", columns, peaks).named(links)


def force_error_table(deviations: Mapping[str, ForceDeviation], caption: str = "") -> Table:
    """Return the errors of forces, of the first forces if there are many."""
    rows = [row for name, deviation in deviations.items() for row in _rows(name, deviation)]
    head = ["", "largest", "of peak", "at", "rms"]
    return Table(caption, rows[:MOST_ROWS], head, [""] * 5, left_out(len(rows), MOST_ROWS))


def _off_by(deviation: ForceDeviation | None) -> str:
    parts = (
        [part.largest for part in (deviation.free, deviation.touching) if part] if deviation else []
    )
    return f"{max(parts):.2g} {deviation.unit}" if deviation and parts else ""


def _rows(name: str, deviation: ForceDeviation) -> list[list[str]]:
    """Return a row for a force, and a row for it in contact; none if its error is rounding."""
    parts = [
        (when, part)
        for when, part in (("", deviation.free), ("in contact", deviation.touching))
        if part
    ]
    rounding = max([NO_FORCE, *(WEAK_FORCE * part.size for _, part in parts)])
    rows: list[list[str]] = []
    for when, part in parts:
        if part.size > rounding:
            about = f"  {when}" if rows else ", ".join(filter(None, (name, when)))
            largest, rms = (f"{value:.2g} {deviation.unit}" for value in (part.largest, part.rms))
            percent = 100 * part.relative
            relative = f"{percent:.2g}" if percent < 99 else f"{percent:.0f}"
            rows.append([about, largest, f"{relative} %", f"{part.at:.5f} s", rms])
    if rows and deviation.instants is not None:
        rows.append(["  instants of its touches", f"{deviation.instants:.2g} s", "", "", ""])
    return rows


MOST_STRIKES = 20  # most rows: more scroll the rest of the summary away
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
    "integrator": (LAGRANGIAN,),
}
"""Formulations, or the engine, that use a setting of the solver which others ignore."""


def run_text(result: Result) -> str:
    """Return the summary of a run: time and steps, strikes, errors."""
    ending = "Completed" if result.outcome.completed else "Stopped before its end"
    blocks = [
        [f"{ending}: {result.scene.title}", *lines_of(cost_table(result))],
        lines_of(restitution_table(result.scene)),
        *(_strikes(result, contact) for contact in result.scene.all_contacts),
        lines_of(response_table(result)),
        lines_of(bending_table(result)),
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
    """Return the settings of the solver that had no effect in this run.

    Users then do not look for an effect. A setting with its default value counts as not given,
    because saved scenes have all settings.
    """
    way = result.settings.formulation or result.engine
    by = f"the {'engine' if way in ENGINES else 'formulation'} '{way}'"
    solver = result.scene.solver
    usual = type(solver).model_fields
    return [
        f"'solver.{name}' changes nothing: {by} has no use for it"
        for name, users in _USED_BY.items()
        if way not in users and getattr(solver, name) != usual[name].default
    ]


def cost_table(result: Result) -> Table:
    """Return the duration of a run, and its cost."""
    checks = result.checks
    steps = f"{checks.steps}, from {checks.smallest_step:.3g} to {checks.largest_step:.3g} s"
    rows = [["simulated time", f"{number(result.outcome.time)} s"]]
    if result.outcome.until is not None and result.scene.run.until is not None:
        ended = "came to 0, and ended the run" if result.outcome.until else "never came to 0"
        rows.append(["until", f"{result.scene.run.until}: {ended}"])
    if "solve" in result.timings:
        second = result.timings.get("second run", 0.0)
        more = f", and {second:.2f} s of a second run" if second else ""
        rows.append(["solver time", f"{result.timings['solve']:.2f} s{more}"])
    return Table("", [*rows, ["steps", steps]])


def energy_table(result: Result) -> Table:
    """Return energies at the begin and the end of a run, and the largest absolute values."""
    rows = []
    for name, text in _ENERGIES.items():
        values = getattr(result.energy, name)
        largest = values[int(np.argmax(np.abs(values)))]
        rows.append([text, *(f"{value:.4g}" for value in (values[0], values[-1], largest))])
    head, units = ["", "at the start", "at the end", "largest"], ["", "J", "J", "J"]
    return Table("Energies of all parts together", rows, head, units)


def _strikes(result: Result, contact: str) -> list[str]:
    shown = strike_table(result, contact, MOST_STRIKES).without(BESIDES)
    return lines_of(shown) or [f"{shown.caption}: none"]


def friction_columns(end: float) -> Sequence[Column[FrictionHistory]]:
    """Return columns on dry friction in a joint, in a run up to its `end` (s)."""
    return (
        Column(
            "lost", lambda friction: float(friction.lost[-1]), "{:.4g}".format, "J", "energy_lost_J"
        ),
        Column("at rest", lambda friction: friction.rest_until(end), number, "s", "time_at_rest_s"),
        Column(None, lambda friction: friction.begin.tolist(), key="rests_begin_s"),
        Column(None, lambda friction: np.minimum(friction.end, end).tolist(), key="rests_end_s"),
        Column(
            "",
            lambda friction: (
                float(friction.begin[-1]) if np.isinf(friction.end[-1:]).any() else None
            ),
            lambda begin: f"from {number(begin)} s on",
        ),
    )


def friction_table(result: Result) -> Table:
    """Return the energy that dry friction took in each joint, and the joint's time at rest."""
    columns = friction_columns(float(result.time[-1]))
    shown = table_of_items("Friction in joints", columns, list(result.frictions.values()))
    return shown.named(result.frictions, "joint")


def error_table(result: Result) -> Table:
    """Return the errors of a run by its own checks, and by a second run."""
    checks = result.checks
    missed, share = f"off by {checks.energy_residual:.2g} J", checks.relative_energy_residual
    if share > 1:  # a mechanism at rest has only rounding as kinetic energy
        missed += "; nothing moved with as much energy"
    else:
        missed += f", {100 * share:.2g} % of the largest kinetic energy"
    rows = [
        ["energy balance", missed],
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
    """Say that no judged point moves, so that the tolerance limits nothing; empty if one moves."""
    points = judged_points(result.scene)
    if len(result.time) < 2 or not room(result, points) <= PLACE_ROUNDING:  # nan if the run failed
        return ""
    hint = "a point off the axis of a body would show how that turns"
    return f"not measured: {still_text(points)}; {hint}"


def run_force_errors(result: Result) -> Table:
    """Return the errors of forces by a second run; no rows without a second run."""
    caption = f"Errors of forces, as a second run tells{_until(result.error)}"
    return force_error_table(result.error.forces, caption)


def positions_text(error: MeasuredError) -> str:
    """Return the error of points by a second run, and up to when instants are known."""
    if error.missing:
        return f"not measured: {error.missing}"
    points, limit = name_of(error.points), f"{error.limit:.3g} m"
    worst = f" ({error.worst})" if len(error.points) > 1 else ""
    until = "" if error.stopped is None else f" up to t = {number(error.stopped)} s"
    if error.exceeds_from is None:
        return f"{points} within {error.largest:.2g} m{worst}{until}, asked {limit}"
    about = f"{points} within {limit}, as asked, up to t = {number(error.exceeds_from)} s"
    then = f"within {error.largest:.2g} m{worst}"
    if error.horizon is None:
        return f"{about}; then {then}{until}"
    horizon = f"t = {number(error.horizon)} s, the horizon: after it trust statistics only"
    return f"{about}; {then} up to {horizon}"


def forces_text(error: MeasuredError) -> str:
    """Return the largest error of a force by a second run, relative to its largest value."""
    name, part = worst_force(error.forces)
    if error.missing or not name:
        return "not measured"
    deviation = error.forces[name]
    free = (
        " while nothing touches"
        if deviation.free and deviation.free.size > NO_FORCE
        else " in contact"
    )
    when = free if deviation.free and deviation.touching else ""
    return f"within {100 * part:.2g} % of their largest ({name}){when}{_until(error)}"


def _until(error: MeasuredError) -> str:
    end = error.known_until
    return f", up to t = {number(end)} s" if isfinite(end) else ""

"""Reports on two runs of one scene, on a run beside a measured series, and on a fit.

Each is a text, and a document with tables: SI numbers, with units in the names. The report of a
comparison has only what two runs tell together; the summary of each run has the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import isfinite
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.comparison import Comparison, Seen, Statistics, StrikePair
from exudyn_flexlink.fitting import Against, Fit
from exudyn_flexlink.observables import Deviation, Measure, Strike, name_of
from exudyn_flexlink.report.run import contact_rows, force_error_table
from exudyn_flexlink.report.text import (
    MOST_ROWS,
    Document,
    Table,
    in_blocks,
    left_out,
    lines_of,
    number,
    table,
)
from exudyn_flexlink.result import ForceSpread
from exudyn_flexlink.source import listed
from exudyn_flexlink.sweeps import column_of

STATISTICS = ("mean", "rms", "least", "greatest")
"""Statistics over a stretch of time, of each coordinate of the watched point."""


def comparison_text(comparison: Comparison) -> str:
    """Return the table of a comparison."""
    both = comparison.both
    contacts = dict.fromkeys(pair.contact for pair in comparison.strikes)
    until = "" if comparison.horizon is None else " up to the horizon"
    blocks = [
        [f"Comparison {_of(both[0])} and {both[1].name}: {both[1].result.scene.title}"],
        _deviations(comparison),
        [horizon_text(comparison)],
        lines_of(force_error_table(comparison.forces, f"Forces, difference{until}")),
        _beyond(comparison),
        _levers(comparison),
        *(_strikes(comparison, contact) for contact in contacts),
        _clearances(comparison),
        _runs(comparison),
    ]
    return in_blocks(blocks)


def horizon_text(comparison: Comparison) -> str:
    """Say up to which instant the runs can be compared instant by instant."""
    end, parted = comparison.time[-1], comparison.horizon
    measured = [seen for seen in comparison.both if not seen.result.error.missing]
    if parted is None:
        to_end = f"Compared instant by instant to t = {end:.5g} s, the end"
        off = [f"{seen.name} within {seen.result.error.largest:.2g} m" for seen in measured]
        return f"{to_end}: {', '.join(off)}" if off else f"{to_end}; no horizon was looked for"
    first = min(measured, key=lambda seen: seen.result.error.known_until)
    if first.result.error.horizon != parted:
        why = f"where the second run {_of(first)} stopped"
    else:
        why = f"beyond it by statistics: from there on two runs {_of(first)} part for good"
    return f"Compared instant by instant up to t = {parted:.5g} s, {why}"


def excess_text(comparison: Comparison, tolerance: float) -> str:
    """Say by how much the deviation exceeds a tolerance (m)."""
    judged = comparison.judged
    if not len(judged.time):
        return "nothing can be compared instant by instant: the horizon is at the start"
    time = judged.largest_at
    return (
        f"{comparison.farthest(time)} deviates by {judged.largest:.3g} m at t = {time:.5g} s, "
        f"more than the {tolerance:.3g} m allowed"
    )


def _of(seen: Seen) -> str:
    """Return 'of exudyn' for an engine; a scene's name, such as 'with clearance', is unchanged."""
    return seen.name if seen.name.startswith("with") else f"of {seen.name}"


def _deviations(comparison: Comparison) -> list[str]:
    strike, horizon = comparison.first_strike, comparison.horizon
    parts = {"whole run": comparison.deviation}
    if horizon is not None:
        parts = {f"up to the horizon, {horizon:.5f} s": comparison.judged} | parts
    if strike is not None and comparison.before_strike is not None:
        parts = {f"up to the first strike, {strike:.5f} s": comparison.before_strike} | parts
    rows = [["", "largest", "of", "at", "rms"]]
    for when, part in parts.items():
        cells = ["no samples", "", "", ""]
        if len(part.time):
            instant = part.largest_at
            size, rms = f"{part.largest:.3g} m", f"{part.rms:.3g} m"
            cells = [size, comparison.farthest(instant), f"{instant:.5f} s", rms]
        rows.append([when, *cells])
    what = name_of(comparison.judged_by)
    farthest = ", of the one that is farthest" if len(comparison.judged_by) > 1 else ""
    return [f"Deviation of {what}{farthest}", *table(rows)]


def _beyond(comparison: Comparison) -> list[str]:
    if comparison.beyond is None:
        return []
    first, second = comparison.beyond
    rows = [["", comparison.first.name, comparison.second.name]]
    for i, axis in enumerate("xy"):
        for what in STATISTICS:
            values = (f"{getattr(part, what)[i]:+.6f} m" for part in (first, second))
            rows.append([f"{axis}, {what}", *values])
    for body, measure in comparison.measures.items():
        for k, what in enumerate(("least", "greatest")):
            rows.append(
                [
                    f"{measure.word} of {body}, {what}",
                    *(measure.text(part.levers[body][k]) for part in (first, second)),
                ]
            )
    about = f"Beyond the horizon: {comparison.point}, all but the mean relative to the mean"
    return [about, *table(rows)]


def _levers(comparison: Comparison) -> list[str]:
    rows = []
    for body, apart in comparison.answer_differences.items():
        measure = comparison.measures[body]
        named, unit = f"{measure.word} of {body}", measure.unit
        for what in ("least", "greatest"):
            (first, t1), (second, t2) = (
                getattr(seen.levers[body], what) for seen in comparison.both
            )
            values = [f"{measure.text(x)} at {t:.4f} s" for x, t in ((first, t1), (second, t2))]
            rows.append([f"{named}, {what}", *values, f"{first - second:+.2g} {unit}"])
        largest = f"{abs(apart).max():.2g} {unit}"
        rows.append([f"{named}, largest difference at one instant", "", "", largest])
    names = ["", comparison.first.name, comparison.second.name, "difference"]
    return lines_of(Table("Struck bodies", rows, names))


def _strikes(comparison: Comparison, contact: str) -> list[str]:
    pairs = [pair for pair in comparison.strikes if pair.contact == contact]
    turns = any(pair.lap is not None for pair in pairs)
    rows = [["lap" if turns else "", "", *(run.name for run in comparison.both), "difference"]]
    for pair in pairs[:MOST_ROWS]:
        rows += [row if turns else ["", *row[1:]] for row in _strike(pair, comparison.both)]
    note = left_out(len(pairs), MOST_ROWS)
    return lines_of(Table(f"Strikes of contact '{contact}'", rows, note=note))


def _clearances(comparison: Comparison) -> list[str]:
    """Return the states of links in guides and of journals in bearings, in both runs.

    They count up to the end of the shorter run.
    """
    first, second = comparison.both
    rows = [
        row
        for joint in comparison.with_clearance
        for row in contact_rows(joint, first.contact.get(joint), second.contact.get(joint))
    ]
    return lines_of(Table("Joints with clearance", rows, ["", first.name, second.name]))


_OF_A_STRIKE: dict[str, tuple[Callable[[Strike], float], str, str]] = {
    "time": (lambda strike: strike.begin, ".7f", "s"),
    "impulse": (lambda strike: strike.impulse, ".5g", "N s"),
    "energy lost": (lambda strike: strike.energy_lost, ".5g", "J"),
    "peak force": (lambda strike: strike.peak_force, ".5g", "N"),
}


def _strike(pair: StrikePair, both: tuple[Seen, Seen]) -> list[list[str]]:
    """Return the rows of one strike."""
    rows = []
    for what, (of, digits, linear) in _OF_A_STRIKE.items():
        unit = both[pair.first is None].result.scene.unit_of(pair.contact, linear)
        values = [None if strike is None else of(strike) for strike in (pair.first, pair.second)]
        shown = ["no strike" if x is None else _amount(x, digits, unit) for x in values]
        first, second = values
        apart = "" if first is None or second is None else _amount(first - second, "+.2g", unit, "")
        rows.append([str(pair.lap or "") if what == "time" else "", what, *shown, apart])
    return rows


def _amount(value: float, digits: str, unit: str, unknown: str = "not known") -> str:
    return f"{value:{digits}} {unit}" if isfinite(value) else unknown


def _runs(comparison: Comparison) -> list[str]:
    columns = [["engine", "accuracy", "energy balance, off by", "steps", "solver time"]]
    for seen in comparison.both:
        result, checks = seen.result, seen.result.checks
        part = checks.relative_energy_residual
        energy = f"{checks.energy_residual:.2g} J" + f" ({100 * part:.2g} %)" * (part <= 1)
        time = f"{result.timings['solve']:.2f} s" if "solve" in result.timings else "not known"
        columns.append([result.engine, seen.accuracy, energy, number(checks.steps), time])
    names = ["", *(seen.name for seen in comparison.both)]
    return lines_of(Table("Runs", list(zip(*columns, strict=True)), names))


def comparison_document(
    comparison: Comparison, tolerance: float | None = None, *, whole: bool = True
) -> Document:
    """Return the document of a comparison of two runs.

    `tolerance` (m) is the limit of the deviation up to the horizon, if the user gave one. `whole`
    tells whether all runs were made, including those that give the errors.
    """
    columns = {"t_s": comparison.time, "deviation_m": comparison.deviation.distance}
    for seen in comparison.both:
        name = seen.name.replace(" ", "_")
        columns |= {f"{name}_{axis}_m": seen.position[:, i] for i, axis in enumerate("xy")}
        columns |= {
            f"{name}_{body}_{seen.levers[body].measure.name}": values
            for body, values in seen.answers.items()
        }
    ended = all(seen.result.outcome.completed for seen in comparison.both)
    statistics = zip(comparison.both, comparison.beyond or (), strict=False)
    data: dict[str, Any] = {
        "title": comparison.second.result.scene.title,
        "runs": [seen.name for seen in comparison.both],
        "point": comparison.point,
        "judged_by": list(comparison.judged_by),
        "end_s": comparison.time[-1],
        "horizon_s": comparison.horizon,
        "first_strike_s": comparison.first_strike,
        "deviation": {
            "up_to_the_first_strike": _deviation(comparison.before_strike),
            "up_to_the_horizon": _deviation(comparison.judged),
            "whole_run": _deviation(comparison.deviation),
        },
        "forces_up_to_the_horizon": {
            name: {
                "unit": force.unit,
                "instants_of_touches_s": force.instants,
                "free": _spread(force.free),
                "in_contact": _spread(force.touching),
            }
            for name, force in comparison.forces.items()
        },
        "levers": {
            f"{body}_largest_difference_{comparison.measures[body].unit}": np.abs(apart).max()
            for body, apart in comparison.answer_differences.items()
        },
        "beyond_the_horizon": {
            seen.name: _statistics(part, comparison.measures) for seen, part in statistics
        }
        or None,
        "completed": whole and ended,
        "tolerance_m": tolerance,
    }
    if tolerance is not None:
        data["exceeded"] = comparison.exceeds(tolerance)
    return Document(data, {"comparison.csv": columns})


def _deviation(part: Deviation | None) -> dict[str, float] | None:
    if part is None or not len(part.time):
        return None
    return {"largest_m": part.largest, "largest_at_s": part.largest_at, "rms_m": part.rms}


def _spread(part: ForceSpread | None) -> dict[str, float] | None:
    """Return the differences of a force, in its unit; None if the runs share no such instant."""
    return None if part is None else {**vars(part), "relative": part.relative}


def _statistics(part: Statistics, measures: Mapping[str, Measure]) -> dict[str, Any]:
    levers = {f"{body}_{measures[body].name}": list(ends) for body, ends in part.levers.items()}
    return {f"{name}_m": getattr(part, name).tolist() for name in STATISTICS} | levers


DIGITS = 10  # significant digits of a fitted value


def against_text(beside: Against) -> str:
    """Return the table of a run beside a series."""
    head = f"Comparison of {beside.result.engine} and {beside.series.source}"
    return in_blocks([[f"{head}: {beside.result.scene.title}"], _distances(beside), _how(beside)])


def fit_text(fitted: Fit) -> str:
    """Return the table of a fit: values with their errors, correlations, residuals."""
    last = fitted.against
    rows = [
        [
            p.path,
            f"{fitted.values[p.path]:.{DIGITS}g}",
            f"{fitted.standard_errors[p.path]:.4g}",
            f"{fitted.integrator[p.path]:.1g}",
            f"{p.start:.4g}",
            p.unit,
        ]
        for p in fitted.parameters
    ]
    note = "standard error: of the data's scatter; integrator: how far its error moves the value"
    head = ["", "value", "standard error", "integrator", "start", "unit"]
    accuracy = last.result.scene.accuracy
    to = f"{accuracy.tolerance:.1g} m" if accuracy.step is None else f"steps of {accuracy.step:g} s"
    return in_blocks(
        [
            [f"Fit of {last.result.engine} to {last.series.source}: {last.result.scene.title}"],
            lines_of(Table("Fitted values", rows, head, note=note)),
            _correlations(fitted),
            _distances(last, "Residuals"),
            [f"Found in {fitted.runs} runs, the last to {to}"],
        ]
    )


def _correlations(fitted: Fit) -> list[str]:
    pairs = [
        [f"{p.path} and {q.path}", f"{fitted.correlations[i, j]:.6f}"]
        for i, p in enumerate(fitted.parameters)
        for j, q in enumerate(fitted.parameters)
        if i < j and isfinite(fitted.correlations[i, j])
    ]
    return lines_of(Table("Correlations", pairs))


def _distances(beside: Against, caption: str = "Distances, run less series") -> list[str]:
    rows = [
        [
            distance.signal,
            f"{distance.largest:.3g} {distance.unit}",
            f"{distance.at:.5g} s",
            f"{distance.rms:.3g} {distance.unit}",
            f"{100 * distance.rms / distance.span:.2g} %" if distance.span else "",
            f"{np.sum(beside.differences[distance.signal] ** 2):.{DIGITS}g}",
        ]
        for distance in beside.distances
    ]
    head = ["", "largest", "at", "rms", "of the span", "sum of squares, SI"]
    return lines_of(Table(caption, rows, head)) or [f"{caption}: none, the horizon is at the start"]


def _how(beside: Against) -> list[str]:
    """Return instants, time shift, omitted samples, and the error of the run itself."""
    begin, end = beside.time[[0, -1]]
    rows = [["instants", f"{len(beside.time)}, from {begin:.5g} to {end:.5g} s of the run"]]
    if beside.shift:
        rows.append(["shift", f"{beside.shift:.6g} s are added to times of the series"])
    if beside.outside:
        rows.append(["outside the run", f"{beside.outside} of {len(beside.series.time)} rows"])
    if beside.series.left_out:
        rows.append(["columns left out", listed(beside.series.left_out)])
    error = beside.result.error
    about = f"{name_of(error.points)} within {error.largest:.2g} m" if not error.missing else ""
    rows.append(["the run's own error", about or f"not known: {error.missing}"])
    if isfinite(error.known_until) and error.known_until < end:
        rows.append(["horizon", f"{error.known_until:.5g} s: distances are of instants before it"])
    return table(rows)


def against_document(beside: Against) -> Document:
    """Return the document of a run beside a series."""
    data = _held(beside) | {"completed": beside.result.outcome.completed}
    return Document(data, {"comparison.csv": _beside(beside)})


def fit_document(fitted: Fit) -> Document:
    """Return the document of a fit."""
    accuracy = fitted.against.result.scene.accuracy
    data = _held(fitted.against) | {
        "completed": True,
        "parameters": [vars(parameter) for parameter in fitted.parameters],
        "values": fitted.values,
        "standard_errors": fitted.standard_errors,
        "correlations": fitted.correlations,
        "moved_by_integrator": fitted.integrator,
        "tolerance_m": accuracy.tolerance,
        "step_s": accuracy.step,
        "runs": fitted.runs,
        "warnings": fitted.warnings,
        "scene": fitted.scene.to_data(),
    }
    return Document(data, {"residuals.csv": _beside(fitted.against)})


def _beside(beside: Against) -> dict[str, FloatArray]:
    """Return the run's instants, and measured value, computed value and difference by quantity."""
    columns = {"t_s": beside.time}
    for name, apart in beside.differences.items():
        column = column_of(name, beside.series.signals[name].unit)
        columns[f"{column}_measured"] = beside.measured[name]
        columns |= {f"{column}_computed": beside.computed[name], f"{column}_difference": apart}
    return columns


def _held(beside: Against) -> dict[str, Any]:
    return {
        "title": beside.result.scene.title,
        "engine": beside.result.engine,
        "series": beside.series.source,
        "shift_s": beside.shift,
        "rows": len(beside.time),
        "rows_outside_the_run": beside.outside,
        "distances": [vars(distance) for distance in beside.distances],
        "own_error_m": beside.result.error.largest,
        "horizon_s": beside.result.error.known_until,
    }

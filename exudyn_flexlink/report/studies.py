"""Reports on studies: cost of accuracy, stability of a motion, sweeps, sensitivities, benchmarks.

Each is a text, and a document with tables: SI numbers, with units in the names.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from functools import partial
from math import isfinite
from typing import Any

import numpy as np

from exudyn_flexlink.accuracy import (
    STIFFER,
    Advice,
    Method,
    Point,
    Source,
    Study,
    advise,
    beams,
    dominating,
    flexible,
    needed,
    rods_needed,
    stiffnesses,
)
from exudyn_flexlink.accuracy.study import MOST_RODS
from exudyn_flexlink.observables import Vibration, measures, name_of
from exudyn_flexlink.report.text import (
    MOST_ROWS,
    Column,
    Document,
    Table,
    entries,
    in_blocks,
    lines_of,
    number,
    table,
    table_of_items,
)
from exudyn_flexlink.scene import FlexibleBody, ImpulseLaw
from exudyn_flexlink.sensitivities import Sensitivity
from exudyn_flexlink.shipped import EXUDYN
from exudyn_flexlink.stability import Exponent, Stability, section_columns
from exudyn_flexlink.sweeps import DOUBTFUL, FAILED, SweepTable, shortened
from exudyn_flexlink.verification import Compared, VerifiedRun

NAMES = {"time": "time steps", "rods": "number of rods", "contact": "contact compliance"}


def accuracy_text(study: Study, command: str) -> str:
    """Return the whole report of a study; `command` simulates the scene that was studied."""
    left_out = [f"  {name}: {why}" for name, why in study.runs.left_out.items()]
    blocks = [
        [f"What accuracy costs: {study.scene.title}"],
        judged_by(study),
        _points(study),
        _sources(study),
        ["Left out", *left_out] if left_out else [],
        [recommendation(study), *_how_accurate(study, command)],
    ]
    return in_blocks(blocks)


def judged_by(study: Study) -> list[str]:
    """Return the reference of the errors, the accuracy of that reference, and its last instant."""
    lines = [f"Errors of {name_of(study.judged_by)}, against {study.reference.label}"]
    if study.check is not None:
        what = "independent" if study.independent else "not independent: the same equations"
        lines.append(
            f"Cross-check ({what}): {study.check.label} is {study.floor:.2g} m from it at most; "
            "smaller errors are not claimed"
        )
    else:
        lines.append("There was no second run to check it with")
    if study.horizon is not None:
        lines.append(
            f"Horizon: both part by more than {study.horizon.limit:.2g} m at t = "
            f"{study.horizon.parted:.5g} s of {study.end:.5g} s (the motion is sensitive, or the "
            f"check coarse); errors are those up to t = {study.until:.5g} s"
        )
    return lines


def _point_columns(study: Study) -> Sequence[Column[Point]]:
    """Return columns on each setting that was run."""

    def setting(point: Point) -> str:
        whose = " (model's own)" if point is study.model_point else ""
        return f"  {point.method.amount(point.value)}{whose}"

    length, force = partial(_known_to, study.floor), partial(_known_to, study.force_floor)
    return (
        Column(None, "method.name", key="method"),
        Column(None, "method.engine", key="engine"),
        Column(None, "method.knob", key="knob"),
        Column(None, "value", key="value"),
        Column(None, lambda point: dict(point.method.settings), key="settings"),
        Column(None, "processor", key="processor_time_s"),
        Column(None, "repeats", key="repeats"),
        Column("", setting),
        Column("steps", "steps", key="steps"),
        Column("rms", "errors.rms", length),
        Column("largest", "errors.largest", length),
        Column("of", lambda p: p.errors.worst if p.errors.largest >= study.floor else ""),
        Column("forces", "errors.force", force),
        *_ERRORS,
        Column(None, "below_floor", key="below_floor"),
        Column("processor time", lambda point: f"{point.processor:.3g} (of {point.repeats})"),
    )


_ERRORS: Sequence[Column[Any]] = (
    Column(None, "errors.rms", key="error_rms_m"),
    Column(None, "errors.largest", key="error_largest_m"),
    Column(None, "errors.worst", key="error_point"),
    Column(None, "errors.force", key="error_force_relative"),
    Column(None, "errors.worst_force", key="error_force"),
)
"""Columns in files on the errors of a setting, or of a cause."""


def _known_to(floor: float, error: float) -> str:
    """Return an error; if it is below the floor, '<' and the floor."""
    return f"{error:.1e}" if error >= floor else f"< {floor:.1e}"


def _points(study: Study) -> list[str]:
    shown, method = table_of_items("", _point_columns(study), study.points), ""
    rows = [shown.head]
    for point, row in zip(study.points, shown.rows, strict=True):
        if point.method.name != method:
            method = point.method.name
            rows.append([f"{method}: {point.method.knob}"])
        rows.append(row)
    what = "" if len(study.judged_by) == 1 else " of the point that is farthest off"
    return [
        f"Errors (m){what}, errors of forces as parts of the force (of the one that is worst), "
        "and processor time (s) of the solve, best of those run",
        *table(rows),
    ]


def _source_columns(study: Study) -> Sequence[Column[Source]]:
    """Return columns on each cause of error."""
    measures_by = measures(study.scene)

    def peaks(source: Source) -> dict[str, float]:
        return {f"{body}_{measures_by[body].name}": x for body, x in source.errors.levers.items()}

    def about(source: Source, error: float) -> str:
        return f"{'<~ ' if source.at_most else ''}{error:.1e}"

    return (
        Column("", "kind", NAMES.__getitem__, key="kind"),
        Column("rms", lambda source: f"{about(source, source.errors.rms)} m"),
        Column("largest", lambda source: f"{about(source, source.errors.largest)} m"),
        Column("of", "errors.worst"),
        Column("forces", lambda source: about(source, source.errors.force)),
        Column("", partial(_about, study)),
        *_ERRORS,
        Column(None, peaks, key="peaks"),
        Column(None, "order", key="order"),
        Column(None, "at_most", key="at_most"),
        Column(None, "dearer", key="cost_of_the_finer_model"),
    )


def _sources(study: Study) -> list[str]:
    if study.still:
        return ["Nothing that is judged moves: there is no error to take apart"]
    setting = study.model_point.label if study.model_point is not None else ""
    caption = (
        f"Where the error comes from, at the model's own settings{setting and f' ({setting})'}"
    )
    shown = table_of_items(caption, _source_columns(study), study.sources)
    lines = lines_of(shown) or [caption]
    return [*lines, *(f"  {note}" for note in notes(study)), dominance(study)]


def _about(study: Study, source: Source) -> str:
    """Return how a source's error was measured."""
    if source.kind == "time":
        is_known = study.model_point is not None
        return "against the reference" if is_known else "this is the finest run: that of the check"
    if source.kind == "rods":
        rods = ", ".join(f"{b.rods}" for b in beams(study.scene).values())
        twice = ", ".join(f"{2 * b.rods}" for b in beams(study.scene).values())
        power = f"^{source.order:g}" if source.order != 1 else ""
        return f"n = {rods} against {twice}, which {_cost(source)}; estimated as O(1/n{power})"
    measures_by = measures(study.scene)
    peaks = "".join(
        f"; peak of {body} {x:.1e} {measures_by[body].unit}"
        for body, x in source.errors.levers.items()
    )
    against = f"{STIFFER:g} times the stiffness, which {_cost(source)}"
    return f"{against}; estimated as O(k^-1/2){peaks}"


def _cost(source: Source) -> str:
    return f"costs {source.dearer:.2g} times as much"


def notes(study: Study) -> list[str]:
    """Return causes of error that the scene does not have, and those not studied, with reasons."""
    kinds = {source.kind for source in study.sources}
    others = dict.fromkeys(point.method for point in study.points if not point.method.of_rods)
    reasons = [_other_model(study, method) for method in others]
    if "time" not in kinds:
        reasons.append(
            "time steps: not told, the model's own settings were not run, or are the judge"
        )
    reasons += _of_rods(study, "rods" in kinds)
    if not stiffnesses(study.scene):
        laws = study.scene.laws.values()
        jumps = any(isinstance(law, ImpulseLaw) for law in laws)
        why = "strike by impulses" if jumps else "give way as their materials do"
        why = why if laws else "there is no contact"
        reasons.append(f"contact compliance: none, {why}")
    elif "contact" not in kinds:
        reasons.append("contact compliance: not told, there was no time to vary it")
    return reasons


def _other_model(study: Study, method: Method) -> str:
    finest = min((p for p in study.points if p.method == method), key=lambda p: p.value)
    return (
        f"{method.name}: another model of the link, which moves otherwise than rods at any "
        f"setting; at {method.set_to(finest.value)} it is {finest.errors.largest:.1e} m off"
    )


def _of_rods(study: Study, doubled: bool) -> list[str]:
    links = flexible(study.scene)
    if not links:
        return ["number of rods: no flexible body"]
    lines = [_fixed(name, body) for name, body in links.items() if body.hinges.stiffness != "beam"]
    if beams(study.scene) and not doubled:
        lines.append("number of rods: not told, there was no time (or no room) to double it")
    return lines


def _fixed(name: str, body: FlexibleBody) -> str:
    rule = body.hinges.stiffness
    hinges = f"'{rule}' hinges" if isinstance(rule, str) else f"hinges of {rule:.4g} N m/rad"
    return (
        f"number of rods: {name} with {hinges} tends to no beam as rods are added; "
        f"n = {body.rods} is part of the model, not an error"
    )


def dominance(study: Study) -> str:
    """Return which source of error is the largest."""
    largest = dominating(study.sources)
    if largest is None:
        return "There is only one known source of error" if study.sources else ""
    others = [s for s in study.sources if s is not largest]
    next_one = max(others, key=lambda s: s.errors.largest)
    name, other = NAMES[largest.kind], NAMES[next_one.kind]
    verb = "dominate" if largest.kind == "time" else "dominates"
    if next_one.errors.largest == 0:
        return f"The {name} {verb}"
    ratio = largest.errors.largest / next_one.errors.largest
    return f"The {name} {verb}: {ratio:.2g} times the error of the {other}"


def recommendation(study: Study) -> str:
    """Return one sentence: the best choice for the target, and its limit."""
    if study.still and len(study.judged_by) == 1:
        still = f"{study.judged_by[0]} does not move and judges nothing: watch another point"
        return f"Recommendation: {still}."
    if study.still:
        return "Recommendation: nothing moves, so that any setting will do."
    advice = advise(study)
    return f"Recommendation: {_choice(study, advice)}{_limit(study, advice)}."


def _how_accurate(study: Study, command: str) -> list[str]:
    """Return the command with the advised setting; the setting replaces whole sections."""
    choice = None if study.still else advise(study).choice
    if choice is None:
        return []
    method, value = choice.method, choice.value
    solver = method.at(study.scene, value).solver
    options = ["--engine " + method.engine] if method.engine != EXUDYN else []
    options.append(f'--set "accuracy={{{method.knob}: {value:.3g}}}"')
    if solver != study.scene.solver:
        keys = ", ".join(f"{key}: {x}" for key, x in solver.model_dump(exclude_unset=True).items())
        options.append(f'--set "solver={{{keys}}}"')
    return [f"That is: {' '.join([command, *options])}"]


def _choice(study: Study, advice: Advice) -> str:
    goal = f"for {study.target:.2g} m"
    if advice.choice is not None:
        point = advice.choice
        error = f"{'below ' if point.below_floor else ''}{point.claimed:.1e} m"
        return f"{goal} choose {point.label} ({error}, {point.processor:.2g} s)"
    if advice.below_floor:
        return (
            f"{goal} nothing can be said: the references agree to {study.floor:.2g} m only; "
            "raise --budget, or --target"
        )
    if advice.best is None:
        return f"{goal} nothing can be said"
    best = advice.best
    return (
        f"{goal} no setting tried is accurate enough; the best is {best.label} "
        f"({best.claimed:.1e} m, {best.processor:.2g} s): raise --budget, or --target"
    )


def _limit(study: Study, advice: Advice) -> str:
    source = advice.limit
    if source is None:
        return ""
    error = f"{source.errors.largest:.1e} m"
    if source.kind == "rods":
        return f"; but the rods, not the steps, limit you: {error}, {_more_rods(study, source)}"
    stiffer = needed(1.0, source, study.target)
    return (
        "; but the contact's compliance, not the steps, limits you if it stands for a rigid one: "
        f"{error}, which would take some {stiffer:.3g} times the stiffness of a linear law"
    )


def _more_rods(study: Study, source: Source) -> str:
    links = beams(study.scene).values()
    count = max(rods_needed(body.rods, source, study.target) for body in links)
    advice = f"more than {MOST_RODS}" if count > MOST_RODS else f"about {float(f'{count:.2g}'):.0f}"
    equal = any(body.layout == "equal" for body in links)
    other = "; 'layout: half_ends' takes fewer" if equal else ""
    return f"a beam to {study.target:.2g} m takes {advice} rods{other}"


def accuracy_document(study: Study) -> Document:
    """Return the document of a study: all settings that were run, causes of error, advice."""
    runs, largest, advice = study.runs, dominating(study.sources), advise(study)
    columns, causes = _point_columns(study), _source_columns(study)
    points = [entries(columns, point) for point in study.points]
    names = [key for key in points[0] if key != "settings"]
    data = {
        "title": study.scene.title,
        "completed": not runs.interrupted,
        "judged_by": list(study.judged_by),
        "target_m": study.target,
        "reference": {
            "run": study.reference.label,
            "processor_time_s": study.reference.processor,
        },
        "check": {
            "run": study.check.label if study.check else "",
            "independent": study.independent,
        },
        "floor_m": study.floor,
        "floor_force_relative": study.force_floor,
        "end_s": study.end,
        "judged_until_s": study.until,
        "horizon": study.horizon,
        "points": points,
        "own": study.model_point and study.model_point.label,
        "sources": [entries(causes, source) for source in study.sources],
        "dominating": largest and largest.kind,
        "still": study.still,
        "advice": {
            "choice": advice.choice and entries(columns, advice.choice),
            "limited_by": advice.limit and advice.limit.kind,
            "target_below_floor": advice.below_floor,
        },
        "left_out": runs.left_out,
        "interrupted": runs.interrupted,
        "wall_time_s": runs.spent,
        "scene": study.scene.to_data(),
        "recommendation": recommendation(study),
    }
    return Document(data, {"accuracy.csv": {key: [row[key] for row in points] for key in names}})


WORDS = {
    1: "neighbours part",
    0: "whether neighbours part or approach can't be told",
    -1: "neighbours approach each other",
}
LONGEST = 100  # longest reason, in characters


def stability_text(study: Stability) -> str:
    """Return the behaviour of a motion, the growth of distances, and the range of each number."""
    exponent, rhythm = study.exponent, study.rhythm
    laps = round(float(study.run.time[-1]) / rhythm.lap)
    first = (
        f"{study.point} over {laps} laps of {number(rhythm.lap)} s, from lap "
        f"{round(study.after / rhythm.lap) + 1} on: {study.behaviour}."
    )
    section, limit = study.section, f"{study.limit:.2g} m"
    places, count = section.distinct(study.limit), len(section.time)
    of_lap, of_turn = f"{section.phase:.3g} of a lap", f"crank angle {section.phase:.4g} rad"
    section_text = f"at {of_turn if section.by_crank else of_lap}"
    rows = [
        ["largest Lyapunov exponent", f"{exponent_text(exponent)} (95 %): {WORDS[exponent.sign]}"],
        ["does the tolerance matter?", _tolerance_text(study)],
        ["known instant by instant", _horizon_text(study)],
        *_laps(study),
        [f"places {section_text}", f"{places} in {count} laps; nearer than {limit} count as one"],
        *_lines(study.vibration),
    ]
    return "\n".join([first, "", *table(rows)])


def exponent_text(exponent: Exponent) -> str:
    """Return an exponent with its uncertainty and unit."""
    return f"{doubted_text(exponent.value, exponent.uncertainty)} 1/s"


def doubted_text(value: float, uncertainty: float) -> str:
    """Return a number with its uncertainty; the uncertainty has two digits."""
    digits = max(0, 1 - int(f"{uncertainty:.1e}".partition("e")[2]))
    return f"{value:.{digits}f} +- {uncertainty:.{digits}f}"


def _tolerance_text(study: Stability) -> str:
    exponent = study.exponent
    moved = f"at {study.tolerance:.2g} m the solver may move it by {exponent.noise:.1g} 1/s"
    if study.tighter is None:
        return f"{'yes' if exponent.by_solver else 'no'}: {moved}"
    same = "the same sign" if study.tighter.sign == exponent.sign else "ANOTHER SIGN"
    return f"{moved}; at a tenth of it {exponent_text(study.tighter)}, {same}"


def _horizon_text(study: Stability) -> str:
    if not isfinite(study.horizon):
        return "throughout: errors do not grow"
    laps = study.horizon / study.rhythm.lap
    return f"for {study.horizon:.3g} s ({laps:.2g} laps) from any state: after that statistics only"


def _laps(study: Stability) -> list[list[str]]:
    laps = study.repeating
    if laps is None:
        return [["laps apart", "too few whole laps are known"]]
    before = "1 lap" if laps.nearest == 1 else f"{laps.nearest} laps"
    return [[f"from {before} before", f"{laps.least:.2g} m at most; own error {laps.error:.2g} m"]]


def _lines(vibration: Vibration) -> list[list[str]]:
    off = "off its ideal place" if vibration.off_ideal else "of its motion"
    return [
        [
            f"lines {off}, {axis}, +-{spectrum.resolution / 2:.2g} Hz",
            ", ".join(f"{line:.3g} Hz" for line in spectrum.lines) or "none",
        ]
        for axis, spectrum in (("x", vibration.x), ("y", vibration.y))
    ]


def stability_document(study: Stability) -> Document:
    """Return the document of a motion, with tables of growth, laps, section and spectra."""
    laps, exponent = study.laps, study.exponent
    repeating, spectra = study.repeating, {"x": study.vibration.x, "y": study.vibration.y}
    counts = np.arange(len(exponent.rates)) >= exponent.settled  # neighbours settle first
    before = zip(laps.before.tolist(), laps.largest, strict=True)
    data = {
        "title": study.run.scene.title,
        "completed": True,
        "engine": study.run.engine,
        "point": study.point,
        "lap_s": study.rhythm.lap,
        "laps_of_a_cycle": study.rhythm.laps,
        "after_s": study.after,
        "end_s": float(study.run.time[-1]),
        "tolerance_m": study.tolerance,
        "exponent": entries(EXPONENT, exponent),
        "exponent_at_a_tenth_of_the_tolerance": study.tighter and entries(EXPONENT, study.tighter),
        "horizon_s": study.horizon,
        "repeats_after_laps": repeating and repeating.laps,
        "settles_by_factor": repeating and repeating.settles,
        "laps_apart_m": repeating and repeating.least,
        "laps_before": repeating and repeating.nearest,
        "laps_known_until_s": repeating and repeating.until,
        "places_of_section": study.section.distinct(study.limit),
        "places_apart_by_m": study.limit,
        "lines_Hz": {axis: spectrum.lines for axis, spectrum in spectra.items()},
        "lines_off_ideal_place": study.vibration.off_ideal,
        "scene": study.run.scene.to_data(),
        "told": stability_text(study),
    }
    growth = {
        "begin_s": exponent.times[:-1],
        "end_s": exponent.times[1:],
        "growth_per_s": exponent.rates,
        "counts": counts.astype(float),
    }
    apart = {f"from_{shift}_before_m": row for shift, row in before}
    tables = {
        "growth.csv": growth,
        "laps.csv": {"lap": laps.laps.astype(float), "end_s": laps.end} | apart,
        "section.csv": section_columns(study.section),
    }
    for axis, spectrum in spectra.items():
        columns = {"frequency_Hz": spectrum.frequency, "power_m2_per_Hz": spectrum.power}
        tables[f"spectrum_{axis}.csv"] = columns
    return Document(data, tables)


EXPONENT: Sequence[Column[Exponent]] = (
    Column(None, "value", key="value_per_s"),
    Column(None, "uncertainty", key="uncertainty_per_s"),
    Column(None, "noise", key="solver_per_s"),
    Column(None, "sign", key="sign"),
    Column(None, "distance", key="neighbours_apart_m"),
    Column(None, lambda exponent: exponent.means.tolist(), key="batch_means_per_s"),
)


def sweep_text(sweep: SweepTable) -> str:
    """Return the summary of a sweep: rows, varied values, ranges of observables, reasons."""
    why = (_why(sweep, kind) for kind in (FAILED, DOUBTFUL))
    return in_blocks([_rows_made(sweep), _ranges(sweep), *why])


def _rows_made(sweep: SweepTable) -> list[str]:
    missing = sweep.points - len(sweep.rows)
    counts = [f"{sweep.count(kind)} {kind}" for kind in (FAILED, DOUBTFUL) if sweep.count(kind)]
    counts += [f"{missing} missing"] if missing else []
    wall = sum(row.wall for row in sweep.rows)
    rows = [["rows", ", ".join([f"{len(sweep.rows)} of {sweep.points}", *counts])]]
    rows += [["runs took", f"{wall:.1f} s together"]]
    return [f"Sweep: {sweep.title}", *table(rows)]


def _ranges(sweep: SweepTable) -> list[str]:
    """Return the least and greatest value of every number that does not look equal in all rows."""
    columns = sweep.columns()
    varied = [varied_path.column for varied_path in sweep.varied]
    rows = [["", "from", "to"]]
    for name in (*varied, *sweep.observables):
        values = [float(value) for value in columns[name] if isinstance(value, float | int)]
        ends = [number(end(values)) for end in (min, max)] if values else ["", ""]
        if values and (name in varied or ends[0] != ends[1]):
            rows.append([name, *ends])
    return table(rows) if len(rows) > 1 else []


def _why(sweep: SweepTable, kind: str) -> list[str]:
    """Return the reasons of failed or doubtful rows; the most frequent come first."""
    reasons = Counter(row.reason for row in sweep.rows if row.status == kind)
    first = {row.reason: row.number for row in reversed(sweep.rows) if row.status == kind}
    rows = [
        [str(count), f"run {first[reason]}", shortened(reason, LONGEST)]
        for reason, count in reasons.most_common(MOST_ROWS)
    ]
    more = len(reasons) - MOST_ROWS
    note = f"and {more} reasons more" if more > 0 else ""
    return lines_of(Table(f"{kind.capitalize()}: rows, the first of them, why", rows, note=note))


def sensitivity_text(rows: Sequence[Sensitivity]) -> str:
    """Return a table for each quantity: its changes for 1 % of each parameter."""
    tables = []
    for quantity in dict.fromkeys(row.quantity for row in rows):
        changes = [row for row in rows if row.quantity == quantity]
        changes.sort(key=lambda row: -float(f"{abs(row.relative):.3g}"))  # equal ones keep order
        cells = [
            [
                row.parameter,
                f"{row.derivative:.5g}",
                f"+- {row.error:.2g}",
                row.unit,
                f"{row.relative:.3g} %",
            ]
            for row in changes
        ]
        head = ["", "derivative", "", "", "for 1 %"]
        tables.append(lines_of(Table(f"{quantity}, {changes[0].value:.6g}", cells, head)))
    return in_blocks(tables)


NUMBERS: Sequence[Column[Compared]] = (
    Column("number", "name"),
    Column("published", lambda number: f"{number.published:.10g} {number.unit}"),
    Column("computed", "computed", lambda x: f"{x:.10g}" if isfinite(x) else "none"),
    Column(
        "difference",
        "difference",
        lambda apart: f"{apart:.1e}" if isfinite(apart) else "",
        key="difference",
    ),
    Column("allowed", "allowed", "{:.1e}".format),
    Column("verdict", "fine", lambda fine: "ok" if fine else "OFF", key="fine"),
)
"""Columns on a published number; files also have the fields of its class."""


def verification_text(runs: Sequence[VerifiedRun]) -> str:
    """Return a table for each run, and a sentence on all of them."""
    blocks = []
    for run in runs:
        about = f"{run.benchmark}, {run.run}: {run.steps} steps, {run.seconds:.2g} s"
        lines = [about] if run.engine == EXUDYN else [f"{about}, {run.engine}"]
        lines += [f"  {run.stopped}"] if run.stopped else []
        lines += lines_of(table_of_items("", NUMBERS, run.numbers))
        blocks.append("\n".join(lines))
    return "\n\n".join([*blocks, _summary(runs), *_reasons(runs)])


def verification_markdown(runs: Sequence[VerifiedRun]) -> str:
    """Return one table of all numbers, with the steps and the time of each run."""
    *names, last = (str(column.head) for column in NUMBERS)
    head = ["benchmark", "run", *names, "steps", "time", last]
    rows = [head, ["---"] * len(head)]
    for run in runs:
        cost = (str(run.steps), f"{run.seconds:.1f} s")
        for *cells, verdict in table_of_items("", NUMBERS, run.numbers).rows:
            rows.append([f"`{run.benchmark}`", run.run, *cells, *cost, verdict])
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def verification_data(runs: Sequence[VerifiedRun]) -> list[dict[str, Any]]:
    """Return plain data; null stands for a number that the run did not reach."""
    return [
        {
            **asdict(run),
            "fine": run.fine,
            "numbers": [asdict(each) | entries(NUMBERS, each) for each in run.numbers],
        }
        for run in runs
    ]


def _summary(runs: Sequence[VerifiedRun]) -> str:
    numbers = [number for run in runs for number in run.numbers]
    off = sum(not number.fine for number in numbers)
    end = "all are as near as allowed" if not off else f"{off} {'is' if off == 1 else 'are'} off"
    many = f"{len(numbers)} numbers" if len(numbers) != 1 else "1 number"
    return f"{many}: {end}"


def _reasons(runs: Sequence[VerifiedRun]) -> Iterator[str]:
    """Yield the source and the allowed difference of each number that is off."""
    for run in runs:
        for each in run.numbers:
            if not each.fine:
                name = f"{run.benchmark}, {run.run}, {each.name}"
                yield f"{name}\n  allowed because: {each.because}\n  source: {each.source}"

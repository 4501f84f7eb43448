"""What the program says of studies: how stable a motion is, a sweep, benchmarks.

What the program says of a work-precision study: table, causes of error, advice.

What the program says of a run beside a measured series, and of a fit.

What the program says of two runs of one scene: deviations, strikes, errors, cost.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
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
from exudyn_flexlink.comparison import Comparison, Seen, StrikePair
from exudyn_flexlink.fitting import Against, Fit
from exudyn_flexlink.observables import Deviation, Strike, Vibration, measures, name_of
from exudyn_flexlink.report.run import contact_rows, force_error_table
from exudyn_flexlink.report.text import Table, in_blocks, left_out, lines_of, listed, number, table
from exudyn_flexlink.scene import FlexibleBody, ImpulseLaw
from exudyn_flexlink.shipped import EXUDYN
from exudyn_flexlink.stability import Exponent, Stability
from exudyn_flexlink.sweeps import DOUBTFUL, FAILED, SweepTable, shortened
from exudyn_flexlink.verification import Compared, VerifiedRun

NAMES = {"time": "time steps", "rods": "number of rods", "contact": "contact compliance"}


def accuracy_text(study: Study, command: str) -> str:
    """Return the whole report of a study; `command` simulates its scene, as it was studied."""
    blocks = [
        [f"What accuracy costs: {study.scene.title}"],
        judged_by(study),
        _points(study),
        _sources(study),
        _left_out(study),
        [recommendation(study), *_how_accurate(study, command)],
    ]
    return in_blocks(blocks)


def judged_by(study: Study) -> list[str]:
    """Say what errors are measured against, how well that is known, and up to when."""
    lines = [f"Errors of {name_of(study.judged_by)}, against {study.reference.told}"]
    if study.check is not None:
        what = "independent" if study.independent else "not independent: the same equations"
        lines.append(
            f"Cross-check ({what}): {study.check.told} is {study.floor:.2g} m from it at most; "
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


def _points(study: Study) -> list[str]:
    rows, method = [["", "steps", "rms", "largest", "of", "forces", "processor time"]], ""
    for point in study.points:
        if point.method.name != method:
            method = point.method.name
            rows.append([f"{method}: {point.method.knob}"])
        rows.append(_accuracy_row(study, point))
    what = "" if len(study.judged_by) == 1 else " of the point that is farthest off"
    return [
        f"Errors (m){what}, errors of forces as parts of the force (of the one that is worst), "
        "and processor time (s) of the solve, best of those run",
        *table(rows),
    ]


def _accuracy_row(study: Study, point: Point) -> list[str]:
    errors = point.errors
    sizes = [_told_accuracy(error, study.floor) for error in (errors.rms, errors.largest)]
    force = _told_accuracy(errors.force, study.force_floor)
    whose = " (model's own)" if point is study.own else ""
    setting = f"  {point.method.amount(point.value)}{whose}"
    cost = f"{point.processor:.3g} (of {point.repeats})"
    worst = errors.worst if errors.largest >= study.floor else ""
    return [setting, str(point.steps), *sizes, worst, force, cost]


def _told_accuracy(error: float, floor: float) -> str:
    """Return an error, or what it is known to be less than."""
    return f"{error:.1e}" if error >= floor else f"< {floor:.1e}"


def _sources(study: Study) -> list[str]:
    if study.still:
        return ["Nothing that is judged moves: there is no error to take apart"]
    setting = study.own.told if study.own is not None else ""
    caption = (
        f"Where the error comes from, at the model's own settings{setting and f' ({setting})'}"
    )
    rows = [_source(study, source) for source in study.sources]
    lines = lines_of(Table(caption, rows, ["", "rms", "largest", "of", "forces", ""])) or [caption]
    return [*lines, *(f"  {note}" for note in notes(study)), dominance(study)]


def _source(study: Study, source: Source) -> list[str]:
    errors = source.errors
    numbers = [f"{errors.rms:.1e} m", f"{errors.largest:.1e} m", f"{errors.force:.1e}"]
    if source.at_most:
        numbers = [f"<~ {number}" for number in numbers]
    rms, largest, force = numbers
    return [NAMES[source.kind], rms, largest, errors.worst, force, _about(study, source)]


def _about(study: Study, source: Source) -> str:
    """Say what a source's error was told from."""
    if source.kind == "time":
        is_known = study.own is not None
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
    """Say which causes of error the scene does not have, and which were not looked at, and why."""
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


def _of_rods(study: Study, any_told: bool) -> list[str]:
    links = flexible(study.scene)
    if not links:
        return ["number of rods: no flexible body"]
    links_told = [
        _fixed(name, body) for name, body in links.items() if body.hinges.stiffness != "beam"
    ]
    if beams(study.scene) and not any_told:
        links_told.append("number of rods: not told, there was no time (or no room) to double it")
    return links_told


def _fixed(name: str, body: FlexibleBody) -> str:
    rule = body.hinges.stiffness
    hinges = f"'{rule}' hinges" if isinstance(rule, str) else f"hinges of {rule:.4g} N m/rad"
    return (
        f"number of rods: {name} with {hinges} tends to no beam as rods are added; "
        f"n = {body.rods} is part of the model, not an error"
    )


def dominance(study: Study) -> str:
    """Say which source of error is the largest."""
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
    """Say in one sentence what to choose for the target, and what limits."""
    if study.still and len(study.judged_by) == 1:
        still = f"{study.judged_by[0]} does not move and judges nothing: watch another point"
        return f"Recommendation: {still}."
    if study.still:
        return "Recommendation: nothing moves, so that any setting will do."
    advice = advise(study)
    return f"Recommendation: {_choice(study, advice)}{_limit(study, advice)}."


def _how_accurate(study: Study, command: str) -> list[str]:
    """Say which command simulates by the setting that is advised; it replaces whole sections."""
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
        return f"{goal} choose {point.told} ({error}, {point.processor:.2g} s)"
    if advice.below_floor:
        return (
            f"{goal} nothing can be said: the references agree to {study.floor:.2g} m only; "
            "raise --budget, or --target"
        )
    if advice.best is None:
        return f"{goal} nothing can be said"
    best = advice.best
    return (
        f"{goal} no setting tried is accurate enough; the best is {best.told} "
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


def _left_out(study: Study) -> list[str]:
    lines = [f"  {name}: {why}" for name, why in study.runs.left_out.items()]
    return ["Left out", *lines] if lines else []


WORDS = {
    1: "neighbours part",
    0: "whether neighbours part or approach can't be told",
    -1: "neighbours approach each other",
}
MOST_REASONS = 5
LONGEST = 100  # characters of a reason
HEAD = ("number", "published", "computed", "difference", "allowed", "verdict")


def stability_text(study: Stability) -> str:
    """Say what a motion does, how fast neighbours part, and how far each number goes."""
    exponent, rhythm = study.exponent, study.rhythm
    laps = round(float(study.run.time[-1]) / rhythm.lap)
    first = (
        f"{study.point} over {laps} laps of {number(rhythm.lap)} s, from lap "
        f"{round(study.after / rhythm.lap) + 1} on: {study.told}."
    )
    section, limit = study.section, f"{study.limit:.2g} m"
    places, count = section.distinct(study.limit), len(section.time)
    of_lap, of_turn = f"{section.phase:.3g} of a lap", f"crank angle {section.phase:.4g} rad"
    at = f"at {of_turn if section.by_crank else of_lap}"
    rows = [
        ["largest Lyapunov exponent", f"{exponent_text(exponent)} (95 %): {WORDS[exponent.sign]}"],
        ["does the tolerance matter?", _tolerance_text(study)],
        ["known instant by instant", _horizon_text(study)],
        *_laps(study),
        [f"places {at}", f"{places} in {count} laps; nearer than {limit} count as one"],
        *_lines(study.vibration),
    ]
    return "\n".join([first, "", *table(rows)])


def exponent_text(exponent: Exponent) -> str:
    """Return an exponent with its uncertainty, and the unit."""
    return f"{doubted_text(exponent.value, exponent.uncertainty)} 1/s"


def doubted_text(value: float, uncertainty: float) -> str:
    """Return a number with its uncertainty, which has two digits."""
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


def sweep_text(sweep: SweepTable) -> str:
    """Return the summary of a sweep: its rows, what varied, ranges of observables, reasons."""
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
    """Least and largest value of every number that is not printed alike in all rows."""
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
    """Why rows are as they are, the most frequent reasons first."""
    reasons = Counter(row.reason for row in sweep.rows if row.status == kind)
    first = {row.reason: row.number for row in reversed(sweep.rows) if row.status == kind}
    rows = [
        [str(count), f"run {first[reason]}", shortened(reason, LONGEST)]
        for reason, count in reasons.most_common(MOST_REASONS)
    ]
    more = len(reasons) - MOST_REASONS
    note = f"and {more} reasons more" if more > 0 else ""
    return lines_of(Table(f"{kind.capitalize()}: rows, the first of them, why", rows, note=note))


def verification_text(runs: Sequence[VerifiedRun]) -> str:
    """Return a table of each run, and a sentence on all of them."""
    blocks = []
    for run in runs:
        about = f"{run.benchmark}, {run.run}: {run.steps} steps, {run.seconds:.2g} s"
        lines = [about] if run.engine == EXUDYN else [f"{about}, {run.engine}"]
        lines += [f"  {run.stopped}"] if run.stopped else []
        lines += table([HEAD, *(_row(number) for number in run.numbers)])
        blocks.append("\n".join(lines))
    return "\n\n".join([*blocks, _summary(runs), *_reasons(runs)])


def verification_markdown(runs: Sequence[VerifiedRun]) -> str:
    """Return one table of all numbers, with the steps and the time of each run."""
    head = ("benchmark", "run", *HEAD[:-1], "steps", "time", HEAD[-1])
    rows = [head, ("---",) * len(head)]
    for run in runs:
        for each in run.numbers:
            *cells, verdict = _row(each)
            cost = (str(run.steps), f"{run.seconds:.1f} s")
            rows.append((f"`{run.benchmark}`", run.run, *cells, *cost, verdict))
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def verification_data(runs: Sequence[VerifiedRun]) -> list[dict[str, Any]]:
    """Return plain data; null stands for a number that the run did not come to."""
    return [
        {
            **asdict(run),
            "fine": run.fine,
            "numbers": [
                {**asdict(each), "difference": each.difference, "fine": each.fine}
                for each in run.numbers
            ],
        }
        for run in runs
    ]


def _row(number: Compared) -> tuple[str, ...]:
    published = f"{number.published:.10g} {number.unit}"
    allowed, verdict = f"{number.allowed:.1e}", "ok" if number.fine else "OFF"
    if not isfinite(number.computed):
        return number.name, published, "none", "", allowed, verdict
    computed = f"{number.computed:.10g}"
    return number.name, published, computed, f"{number.difference:.1e}", allowed, verdict


def _summary(runs: Sequence[VerifiedRun]) -> str:
    numbers = [number for run in runs for number in run.numbers]
    off = sum(not number.fine for number in numbers)
    end = "all are as near as allowed" if not off else f"{off} {'is' if off == 1 else 'are'} off"
    many = f"{len(numbers)} numbers" if len(numbers) != 1 else "1 number"
    return f"{many}: {end}"


def _reasons(runs: Sequence[VerifiedRun]) -> Iterator[str]:
    """Who published the numbers that are off, and what was allowed to them."""
    for run in runs:
        for each in run.numbers:
            if not each.fine:
                name = f"{run.benchmark}, {run.run}, {each.name}"
                yield f"{name}\n  allowed because: {each.because}\n  source: {each.source}"


DIGITS = 10  # of a fitted value


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
    """Tell instants, the shift, what was left out, and how far the run itself is off."""
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


MOST_STRIKES = 12  # more than that scroll the rest of the table away


def comparison_text(comparison: Comparison) -> str:
    """Return the table of a comparison."""
    both = comparison.both
    contacts = dict.fromkeys(pair.contact for pair in comparison.strikes)
    blocks = [
        [f"Comparison {_of(both[0])} and {both[1].name}: {both[1].result.scene.title}"],
        _deviations(comparison),
        [horizon_text(comparison)],
        _forces(comparison),
        _beyond(comparison),
        _levers(comparison),
        *(_strikes(comparison, contact) for contact in contacts),
        _clearances(comparison),
        _runs(comparison),
    ]
    return in_blocks(blocks)


def horizon_text(comparison: Comparison) -> str:
    """Say up to when the runs can be compared instant by instant."""
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
    at = judged.time[int(judged.distance.argmax())]
    return (
        f"{comparison.farthest(float(at))} deviates by {judged.largest:.3g} m at t = {at:.5g} s, "
        f"more than the {tolerance:.3g} m allowed"
    )


def _of(seen: Seen) -> str:
    """Return 'of exudyn' for an engine; 'with clearance', the name of a scene, as it stands."""
    return seen.name if seen.name.startswith("with") else f"of {seen.name}"


def _deviations(comparison: Comparison) -> list[str]:
    strike, horizon = comparison.first_strike, comparison.horizon
    parts = {"whole run": comparison.deviation}
    if horizon is not None:
        parts = {f"up to the horizon, {horizon:.5f} s": comparison.judged} | parts
    if strike is not None and comparison.before_strike is not None:
        parts = {f"up to the first strike, {strike:.5f} s": comparison.before_strike} | parts
    rows = [_deviation(comparison, when, part) for when, part in parts.items()]
    what = name_of(comparison.judged_by)
    farthest = ", of the one that is farthest" if len(comparison.judged_by) > 1 else ""
    return [f"Deviation of {what}{farthest}", *table([["", "largest", "of", "at", "rms"], *rows])]


def _deviation(comparison: Comparison, when: str, part: Deviation) -> list[str]:
    if not len(part.time):
        return [when, "no samples", "", "", ""]
    at = float(part.time[int(part.distance.argmax())])
    point = comparison.farthest(at)
    return [when, f"{part.largest:.3g} m", point, f"{at:.5f} s", f"{part.rms:.3g} m"]


def _forces(comparison: Comparison) -> list[str]:
    until = "" if comparison.horizon is None else " up to the horizon"
    return lines_of(force_error_table(comparison.forces, f"Forces, difference{until}"))


def _beyond(comparison: Comparison) -> list[str]:
    if comparison.beyond is None:
        return []
    one, other = comparison.beyond
    rows = [["", comparison.first.name, comparison.second.name]]
    for i, axis in enumerate("xy"):
        for what in ("mean", "rms", "least", "greatest"):
            values = (f"{getattr(part, what)[i]:+.6f} m" for part in (one, other))
            rows.append([f"{axis}, {what}", *values])
    for body, measure in comparison.measures.items():
        for k, what in enumerate(("least", "greatest")):
            rows.append(
                [
                    f"{measure.word} of {body}, {what}",
                    *(measure.text(part.levers[body][k]) for part in (one, other)),
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
            (one, t1), (other, t2) = (getattr(seen.levers[body], what) for seen in comparison.both)
            values = [f"{measure.text(x)} at {t:.4f} s" for x, t in ((one, t1), (other, t2))]
            rows.append([f"{named}, {what}", *values, f"{one - other:+.2g} {unit}"])
        largest = f"{abs(apart).max():.2g} {unit}"
        rows.append([f"{named}, largest difference at one instant", "", "", largest])
    names = ["", comparison.first.name, comparison.second.name, "difference"]
    return lines_of(Table("Struck bodies", rows, names))


def _strikes(comparison: Comparison, contact: str) -> list[str]:
    pairs = [pair for pair in comparison.strikes if pair.contact == contact]
    turns = any(pair.lap is not None for pair in pairs)
    rows = [["lap" if turns else "", "", *(run.name for run in comparison.both), "difference"]]
    for pair in pairs[:MOST_STRIKES]:
        rows += [row if turns else ["", *row[1:]] for row in _strike(pair, comparison.both)]
    note = left_out(len(pairs), MOST_STRIKES)
    return lines_of(Table(f"Strikes of contact '{contact}'", rows, note=note))


def _clearances(comparison: Comparison) -> list[str]:
    """How links stood in guides and journals in bearings, up to the end of the shorter run."""
    one, other = comparison.both
    rows = [
        row
        for joint in comparison.with_clearance
        for row in contact_rows(joint, one.contact.get(joint), other.contact.get(joint))
    ]
    return lines_of(Table("Joints with clearance", rows, ["", one.name, other.name]))


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
        shown = ["no strike" if x is None else _told(x, digits, unit) for x in values]
        one, other = values
        apart = "" if one is None or other is None else _told(one - other, "+.2g", unit, "")
        rows.append([str(pair.lap or "") if what == "time" else "", what, *shown, apart])
    return rows


def _told(value: float, digits: str, unit: str, unknown: str = "not known") -> str:
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

"""What the program says of studies: how stable a motion is, a sweep, benchmarks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from math import isfinite
from typing import Any

from exudyn_flexlink.observables import Vibration
from exudyn_flexlink.report.text import Table, in_blocks, lines_of, number, table
from exudyn_flexlink.stability import Exponent, Stability
from exudyn_flexlink.sweeps import DOUBTFUL, FAILED, SweepTable, shortened
from exudyn_flexlink.verification import Compared, VerifiedRun

WORDS = {
    1: "neighbours part",
    0: "whether neighbours part or approach can't be told",
    -1: "neighbours approach each other",
}
MOST_REASONS = 5
LONGEST = 100  # characters of a reason
HEAD = ("number", "published", "computed", "difference", "allowed", "verdict")


def stability_text(found: Stability) -> str:
    """Say what a motion does, how fast neighbours part, and how far each number goes."""
    exponent, rhythm = found.exponent, found.rhythm
    laps = round(float(found.run.time[-1]) / rhythm.lap)
    first = (
        f"{found.point} over {laps} laps of {number(rhythm.lap)} s, from lap "
        f"{round(found.after / rhythm.lap) + 1} on: {found.told}."
    )
    section, limit = found.section, f"{found.limit:.2g} m"
    places, count = section.distinct(found.limit), len(section.time)
    of_lap, of_turn = f"{section.phase:.3g} of a lap", f"crank angle {section.phase:.4g} rad"
    at = f"at {of_turn if section.by_crank else of_lap}"
    rows = [
        ["largest Lyapunov exponent", f"{exponent_text(exponent)} (95 %): {WORDS[exponent.sign]}"],
        ["does the tolerance matter?", _tolerance_text(found)],
        ["known instant by instant", _horizon_text(found)],
        *_laps(found),
        [f"places {at}", f"{places} in {count} laps; nearer than {limit} count as one"],
        *_lines(found.vibration),
    ]
    return "\n".join([first, "", *table(rows)])


def exponent_text(exponent: Exponent) -> str:
    """Return an exponent with its uncertainty, and the unit."""
    return f"{doubted_text(exponent.value, exponent.uncertainty)} 1/s"


def doubted_text(value: float, uncertainty: float) -> str:
    """Return a number with its uncertainty, which has two digits."""
    digits = max(0, 1 - int(f"{uncertainty:.1e}".partition("e")[2]))
    return f"{value:.{digits}f} +- {uncertainty:.{digits}f}"


def _tolerance_text(found: Stability) -> str:
    exponent = found.exponent
    own = f"at {found.tolerance:.2g} m the solver may move it by {exponent.noise:.1g} 1/s"
    if found.tighter is None:
        return f"{'yes' if exponent.by_solver else 'no'}: {own}"
    same = "the same sign" if found.tighter.sign == exponent.sign else "ANOTHER SIGN"
    return f"{own}; at a tenth of it {exponent_text(found.tighter)}, {same}"


def _horizon_text(found: Stability) -> str:
    if not isfinite(found.horizon):
        return "throughout: errors do not grow"
    laps = found.horizon / found.rhythm.lap
    return f"for {found.horizon:.3g} s ({laps:.2g} laps) from any state: after that statistics only"


def _laps(found: Stability) -> list[list[str]]:
    laps = found.repeating
    if laps is None:
        return [["laps apart", "too few whole laps are known"]]
    before = "1 lap" if laps.nearest == 1 else f"{laps.nearest} laps"
    return [[f"from {before} before", f"{laps.least:.2g} m at most; own error {laps.error:.2g} m"]]


def _lines(vibration: Vibration) -> list[list[str]]:
    off = "off its ideal place" if vibration.off_ideal else "of its motion"
    return [
        [
            f"lines {off}, {axis}, +-{own.resolution / 2:.2g} Hz",
            ", ".join(f"{line:.3g} Hz" for line in own.lines) or "none",
        ]
        for axis, own in (("x", vibration.x), ("y", vibration.y))
    ]


def sweep_text(found: SweepTable) -> str:
    """Return the summary of a sweep: its rows, what varied, ranges of observables, reasons."""
    why = (_why(found, kind) for kind in (FAILED, DOUBTFUL))
    return in_blocks([_rows_made(found), _ranges(found), *why])


def _rows_made(found: SweepTable) -> list[str]:
    missing = found.points - len(found.rows)
    told = [f"{found.count(kind)} {kind}" for kind in (FAILED, DOUBTFUL) if found.count(kind)]
    told += [f"{missing} missing"] if missing else []
    wall = sum(row.wall for row in found.rows)
    rows = [["rows", ", ".join([f"{len(found.rows)} of {found.points}", *told])]]
    rows += [["runs took", f"{wall:.1f} s together"]]
    return [f"Sweep: {found.title}", *table(rows)]


def _ranges(found: SweepTable) -> list[str]:
    """Least and largest value of every number that is not printed alike in all rows."""
    columns = found.columns()
    varied = [one.column for one in found.varied]
    rows = [["", "from", "to"]]
    for name in (*varied, *found.observables):
        values = [float(value) for value in columns[name] if isinstance(value, float | int)]
        ends = [number(end(values)) for end in (min, max)] if values else ["", ""]
        if values and (name in varied or ends[0] != ends[1]):
            rows.append([name, *ends])
    return table(rows) if len(rows) > 1 else []


def _why(found: SweepTable, kind: str) -> list[str]:
    """Why rows are as they are, the most frequent reasons first."""
    reasons = Counter(row.reason for row in found.rows if row.status == kind)
    first = {row.reason: row.number for row in reversed(found.rows) if row.status == kind}
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
    for one in runs:
        about = f"{one.benchmark}, {one.run}: {one.steps} steps, {one.seconds:.2g} s"
        lines = [about] if one.engine == "exudyn" else [f"{about}, {one.engine}"]
        lines += [f"  {one.stopped}"] if one.stopped else []
        lines += table([HEAD, *(_row(number) for number in one.numbers)])
        blocks.append("\n".join(lines))
    return "\n\n".join([*blocks, _summary(runs), *_reasons(runs)])


def verification_markdown(runs: Sequence[VerifiedRun]) -> str:
    """Return one table of all numbers, with the steps and the time of each run."""
    head = ("benchmark", "run", *HEAD[:-1], "steps", "time", HEAD[-1])
    rows = [head, ("---",) * len(head)]
    for one in runs:
        for own in one.numbers:
            *cells, verdict = _row(own)
            cost = (str(one.steps), f"{one.seconds:.1f} s")
            rows.append((f"`{one.benchmark}`", one.run, *cells, *cost, verdict))
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def verification_data(runs: Sequence[VerifiedRun]) -> list[dict[str, Any]]:
    """Return plain data; null stands for a number that the run did not come to."""
    return [
        {
            **asdict(one),
            "fine": one.fine,
            "numbers": [
                {**asdict(own), "difference": own.difference, "fine": own.fine}
                for own in one.numbers
            ],
        }
        for one in runs
    ]


def _row(number: Compared) -> tuple[str, ...]:
    published = f"{number.published:.10g} {number.unit}"
    allowed, verdict = f"{number.allowed:.1e}", "ok" if number.fine else "OFF"
    if not isfinite(number.computed):
        return number.name, published, "none", "", allowed, verdict
    computed = f"{number.computed:.10g}"
    return number.name, published, computed, f"{number.difference:.1e}", allowed, verdict


def _summary(runs: Sequence[VerifiedRun]) -> str:
    numbers = [number for one in runs for number in one.numbers]
    off = sum(not number.fine for number in numbers)
    end = "all are as near as allowed" if not off else f"{off} {'is' if off == 1 else 'are'} off"
    many = f"{len(numbers)} numbers" if len(numbers) != 1 else "1 number"
    return f"{many}: {end}"


def _reasons(runs: Sequence[VerifiedRun]) -> Iterator[str]:
    """Who published the numbers that are off, and what was allowed to them."""
    for one in runs:
        for own in one.numbers:
            if not own.fine:
                name = f"{one.benchmark}, {one.run}, {own.name}"
                yield f"{name}\n  allowed because: {own.because}\n  source: {own.source}"

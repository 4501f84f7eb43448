"""What the program says of two runs of one scene: deviations, strikes, errors, cost."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite

from exudyn_flexlink.comparison import Comparison, Seen, StrikePair
from exudyn_flexlink.observables import Deviation, Strike, name_of
from exudyn_flexlink.report.contacts import contact_rows, force_error_table
from exudyn_flexlink.report.text import Table, in_blocks, left_out, lines_of, number, table

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
    told = [seen for seen in comparison.both if not seen.result.error.missing]
    if parted is None:
        to_end = f"Compared instant by instant to t = {end:.5g} s, the end"
        off = [f"{seen.name} within {seen.result.error.largest:.2g} m" for seen in told]
        return f"{to_end}: {', '.join(off)}" if off else f"{to_end}; no horizon was looked for"
    first = min(told, key=lambda seen: seen.result.error.known_until)
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
                    *(measure.told(part.levers[body][k]) for part in (one, other)),
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
            values = [f"{measure.told(x)} at {t:.4f} s" for x, t in ((one, t1), (other, t2))]
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
        energy = f"{checks.energy_residual:.2g} J ({100 * checks.relative_energy_residual:.2g} %)"
        time = f"{result.timings['solve']:.2f} s" if "solve" in result.timings else "not known"
        columns.append([result.engine, seen.accuracy, energy, number(checks.steps), time])
    names = ["", *(seen.name for seen in comparison.both)]
    return lines_of(Table("Runs", list(zip(*columns, strict=True)), names))

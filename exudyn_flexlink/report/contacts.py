"""What the program says of a link with clearance in its guide: of one run, and of two."""

from __future__ import annotations

from itertools import islice

from exudyn_flexlink.observables import (
    ContactTotals,
    State,
    contact_totals,
    crank_joint,
    deepest,
    lap_contacts,
    pair_totals,
)
from exudyn_flexlink.report.tables import Table, left_out
from exudyn_flexlink.report.text import lines_of, table
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import RevoluteJoint, SleeveJoint

UNITS = {
    **dict.fromkeys((state.told for state in State), "%"),
    "touches": "",
    "impacts": "",
    "impulse": "N s",
    "energy lost": "J",
}
MOST_LAPS = 12
MOST_PAIRS = 3
NO_PLAY = "no clearance"


def guide_lines(result: Result, joint: str) -> list[str]:
    """How the link stood in its guide, lap by lap and in all, and where it touched longest."""
    whole, facts = (
        lines_of(guide_table(result, joint), units_above=True),
        guide_facts(result, joint),
    )
    return [*whole, *table([*facts.rows, *_longest_pairs(result, joint)])]


def guide_table(result: Result, joint: str) -> Table:
    """Return how a link stood in its guide, or a journal in its bearing: by lap, and in all."""
    whole = contact_totals(result, joint)
    laps = lap_contacts(result, joint) if crank_joint(result.scene) is not None else []
    rows = [[str(i), *_numbers(lap)] for i, lap in enumerate(laps[:MOST_LAPS], start=1)]
    if len(laps) != 1:
        rows.append(["all", *_numbers(whole)])
    more = len(laps) - MOST_LAPS
    if joint in result.bearings:
        what = f"Journal in '{joint}': time free, on one point; touches and impacts"
    else:
        what = f"Link in '{joint}': time free, on one point, on two; touches of all points; impacts"
        what += " of the free link"
    return Table(
        what,
        rows,
        ["lap" if laps else "", *UNITS],
        ["", *UNITS.values()],
        f"'all' includes {more} laps more" if more > 0 else "",
    )


def guide_facts(result: Result, joint: str) -> Table:
    """Return how deep the link was in the walls of its guide, and its longest touch, if any."""
    rows = [_depth(result, joint)]
    if len(result.intervals[joint]):
        rows.append(["longest touch", f"{contact_totals(result, joint).longest:.3g} s"])
    return Table("", rows)


def pair_table(result: Result, joint: str, most: int) -> Table:
    """Return what can touch in a joint and did, those that touched longest in all first."""
    found = pair_totals(result, joint)
    columns = {"": "", "touches": "", "in all": "s", "impulse": "N s", "energy lost": "J",
               "peak force": "N"}  # fmt: skip
    rows = [
        [
            pair.pair.removeprefix(f"{joint}: "),
            str(pair.touches),
            *(f"{value:.3g}" for value in (pair.time, pair.impulse, pair.energy_lost)),
            f"{pair.peak_force:.4g}",
        ]
        for pair in found[:most]
    ]
    caption = f"What touched in '{joint}', the longest first"
    note = left_out(len(found), most)
    return Table(caption, rows, list(columns), list(columns.values()), note)


def touch_table(result: Result, joint: str, most: int) -> Table:
    """Return the first touches of a joint with clearance, one by one."""
    found, last = result.intervals[joint], float(result.time[-1])
    pairs = result.sleeves[joint].pairs if joint in result.sleeves else ("journal",)
    columns = {"begins": "s", "lasts": "s", "": "", "approach": "m/s", "impulse": "N s",
               "energy lost": "J", "peak force": "N"}  # fmt: skip
    rows = [
        [
            f"{touch.begin:.5f}",
            f"{min(touch.end, last) - touch.begin:.3g}",
            pairs[touch.pair].removeprefix(f"{joint}: "),
            f"{touch.approach_speed:.4f}",
            *(f"{value:.3g}" for value in (touch.impulse, touch.energy_lost)),
            "" if touch.impact else f"{touch.peak_force:.4g}",
        ]
        for touch in islice(found, most)
    ]
    caption, note = f"Touches in '{joint}'", left_out(len(found), most)
    return Table(caption, rows, list(columns), list(columns.values()), note)


def contact_rows(
    joint: str, one: ContactTotals | None, other: ContactTotals | None
) -> list[list[str]]:
    """Rows of a table: contacts of a link with its guide in two runs; one may have no clearance."""
    first, second = ({} if totals is None else _told(totals) for totals in (one, other))
    return [
        [f"{joint}: {name}", first.get(name, NO_PLAY), second.get(name, NO_PLAY)]
        for name in first or second
    ]


def _numbers(totals: ContactTotals) -> list[str]:
    """All that is told, without units, which stand above."""
    return [value.removesuffix(f" {UNITS[name]}") for name, value in _told(totals).items()]


def _told(totals: ContactTotals) -> dict[str, str]:
    """All that is told of a stretch of time, by name."""
    parts = {state.told: f"{100 * totals.fractions[state]:.1f} %" for state in State}
    return parts | {
        "touches": str(totals.touches),
        "impacts": str(totals.impacts),
        "impulse": f"{totals.impulse:.3g} N s",
        "energy lost": f"{totals.energy_lost:.2g} J",
    }


def _depth(result: Result, joint: str) -> list[str]:
    """Penetration against clearance: where it is no small part, the walls are too soft."""
    own, depth = result.scene.joints[joint], deepest(result, joint)
    assert isinstance(own, (SleeveJoint, RevoluteJoint))
    part = f"{100 * depth / own.clearance:.3g} % of the clearance"
    return ["deepest in a wall", f"{depth:.2g} m, {part}"]


def _longest_pairs(result: Result, joint: str) -> list[list[str]]:
    """The pairs that touch longest in all, if any does."""
    rows = []
    for i, pair in enumerate(pair_totals(result, joint)[:MOST_PAIRS]):
        name = pair.pair.removeprefix(f"{joint}: ")
        times = f"{pair.touches} touch{'es' if pair.touches > 1 else ''}"
        rows.append(["" if i else "longest in all", f"{name}: {pair.time:.3g} s in {times}"])
    return rows

"""What the program says of a link with clearance in its guide: of one run, and of two."""

from __future__ import annotations

from itertools import islice

from exudyn_flexlink.intervals import Interval
from exudyn_flexlink.observables import (
    ContactTotals,
    PairTotals,
    State,
    contact_totals,
    crank_joint,
    deepest,
    lap_contacts,
    pair_totals,
)
from exudyn_flexlink.report.tables import Column, Table, table_of_items
from exudyn_flexlink.report.text import lines_of, table
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import RevoluteJoint, SleeveJoint

MOST_LAPS = 12
MOST_PAIRS = 3
NO_PLAY = "no clearance"


def _part_of_time(state: State) -> Column[ContactTotals]:
    return "%", lambda totals: f"{100 * totals.fractions[state]:.1f}"


_COLUMNS: dict[str, Column[ContactTotals]] = {
    **{state.told: _part_of_time(state) for state in State},
    "touches": ("", lambda totals: str(totals.touches)),
    "impacts": ("", lambda totals: str(totals.impacts)),
    "impulse": ("N s", lambda totals: f"{totals.impulse:.3g}"),
    "energy lost": ("J", lambda totals: f"{totals.energy_lost:.2g}"),
}
"""All that is told of a stretch of time."""


def guide_lines(result: Result, joint: str) -> list[str]:
    """How the link stood in its guide, lap by lap and in all, and where it touched longest."""
    whole = lines_of(guide_table(result, joint), units_above=True)
    return [*whole, *table([*guide_facts(result, joint).rows, *_longest_pairs(result, joint)])]


def guide_table(result: Result, joint: str) -> Table:
    """Return how a link stood in its guide, or a journal in its bearing: by lap, and in all."""
    whole = contact_totals(result, joint)
    laps = lap_contacts(result, joint) if crank_joint(result.scene) is not None else []
    rows = [[str(i), *_cells(lap)] for i, lap in enumerate(laps[:MOST_LAPS], start=1)]
    if len(laps) != 1:
        rows.append(["all", *_cells(whole)])
    more = len(laps) - MOST_LAPS
    if joint in result.bearings:
        what = f"Journal in '{joint}': time free, on one point; touches and impacts"
    else:
        what = f"Link in '{joint}': time free, on one point, on two; touches of all points; impacts"
        what += " of the free link"
    return Table(
        what,
        rows,
        ["lap" if laps else "", *_COLUMNS],
        ["", *(unit for unit, _ in _COLUMNS.values())],
        f"'all' includes {more} laps more" if more > 0 else "",
    )


def guide_facts(result: Result, joint: str) -> Table:
    """Return how deep the link was in the walls of its guide, and its longest touch, if any."""
    own, depth = result.scene.joints[joint], deepest(result, joint)
    assert isinstance(own, (SleeveJoint, RevoluteJoint))
    # Where it is no small part of the clearance, the walls are too soft.
    part = f"{100 * depth / own.clearance:.3g} % of the clearance"
    rows = [["deepest in a wall", f"{depth:.2g} m, {part}"]]
    if len(result.intervals[joint]):
        rows.append(["longest touch", f"{contact_totals(result, joint).longest:.3g} s"])
    return Table("", rows)


def pair_table(result: Result, joint: str, most: int) -> Table:
    """Return what can touch in a joint and did, those that touched longest in all first."""
    found = pair_totals(result, joint)
    columns: dict[str, Column[PairTotals]] = {
        "": ("", lambda pair: pair.pair.removeprefix(f"{joint}: ")),
        "touches": ("", lambda pair: str(pair.touches)),
        "in all": ("s", lambda pair: f"{pair.time:.3g}"),
        "impulse": ("N s", lambda pair: f"{pair.impulse:.3g}"),
        "energy lost": ("J", lambda pair: f"{pair.energy_lost:.3g}"),
        "peak force": ("N", lambda pair: f"{pair.peak_force:.4g}"),
    }
    caption = f"What touched in '{joint}', the longest first"
    return table_of_items(caption, columns, found[:most], len(found))


def touch_table(result: Result, joint: str, most: int) -> Table:
    """Return the first touches of a joint with clearance, one by one."""
    last = float(result.time[-1])
    pairs = result.sleeves[joint].pairs if joint in result.sleeves else ("journal",)
    columns: dict[str, Column[Interval]] = {
        "begins": ("s", lambda touch: f"{touch.begin:.5f}"),
        "lasts": ("s", lambda touch: f"{min(touch.end, last) - touch.begin:.3g}"),
        "": ("", lambda touch: pairs[touch.pair].removeprefix(f"{joint}: ")),
        "approach": ("m/s", lambda touch: f"{touch.approach_speed:.4f}"),
        "impulse": ("N s", lambda touch: f"{touch.impulse:.3g}"),
        "energy lost": ("J", lambda touch: f"{touch.energy_lost:.3g}"),
        "peak force": ("N", lambda touch: "" if touch.impact else f"{touch.peak_force:.4g}"),
    }
    touches = result.intervals[joint]
    first = list(islice(touches, most))
    return table_of_items(f"Touches in '{joint}'", columns, first, len(touches))


def contact_rows(
    joint: str, one: ContactTotals | None, other: ContactTotals | None
) -> list[list[str]]:
    """Rows of a table: contacts of a link with its guide in two runs; one may have no clearance."""
    return [
        [
            f"{joint}: {name}",
            *(NO_PLAY if own is None else f"{cell(own)} {unit}".rstrip() for own in (one, other)),
        ]
        for name, (unit, cell) in _COLUMNS.items()
    ]


def _cells(totals: ContactTotals) -> list[str]:
    return [cell(totals) for _, cell in _COLUMNS.values()]


def _longest_pairs(result: Result, joint: str) -> list[list[str]]:
    """The pairs that touch longest in all, if any does."""
    rows = []
    for i, pair in enumerate(pair_totals(result, joint)[:MOST_PAIRS]):
        name = pair.pair.removeprefix(f"{joint}: ")
        times = f"{pair.touches} touch{'es' if pair.touches > 1 else ''}"
        rows.append(["" if i else "longest in all", f"{name}: {pair.time:.3g} s in {times}"])
    return rows

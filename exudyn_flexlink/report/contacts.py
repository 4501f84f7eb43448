"""What the program says of a link with clearance in its guide: of one run, and of two."""

from __future__ import annotations

from exudyn_flexlink.observables import (
    ContactTotals,
    State,
    contact_totals,
    crank_joint,
    deepest,
    lap_contacts,
    pair_totals,
)
from exudyn_flexlink.report.text import table
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import RevoluteJoint, SleeveJoint

STATE_NAMES = {
    State.FREE: "free",
    State.ONE_POINT: "one point",
    State.SAME_SIDE: "two, same side",
    State.OPPOSITE_SIDES: "two, opposite",
}
UNITS = {
    **dict.fromkeys(STATE_NAMES.values(), "%"),
    "touches": "",
    "impacts": "",
    "impulse": "N s",
    "energy lost": "J",
}
MOST_LAPS = 12
MOST_PAIRS = 3
NO_PLAY = "no clearance"


def sleeve_lines(result: Result, joint: str) -> list[str]:
    """How the link stood in its guide, lap by lap and in all, and where it touched longest."""
    whole = contact_totals(result, joint)
    laps = lap_contacts(result, joint) if crank_joint(result.scene) is not None else []
    rows = [[str(lap.lap), *_numbers(lap)] for lap in laps[:MOST_LAPS]]
    if len(laps) != 1:
        rows.append(["all", *_numbers(whole)])
    more = len(laps) - MOST_LAPS
    if joint in result.bearings:
        what = f"Journal in '{joint}': time free, on one point; touches and impacts"
    else:
        what = f"Link in '{joint}': time free, on one point, on two; touches of all points; impacts"
        what += " of the free link"
    return [
        what,
        *table(
            [
                [
                    "lap" if laps else "",
                    *(f"{name}{f', {unit}' if unit else ''}" for name, unit in UNITS.items()),
                ],
                *rows,
            ]
        ),
        *([f"  'all' includes {more} laps more"] if more > 0 else []),
        *table([_depth(result, joint), *_longest(result, joint, whole)]),
    ]


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
    parts = {name: f"{100 * totals.fractions[state]:.1f} %" for state, name in STATE_NAMES.items()}
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


def _longest(result: Result, joint: str, whole: ContactTotals) -> list[list[str]]:
    """The longest touch, and the pairs that touch longest in all."""
    pairs = pair_totals(result, joint)
    if not pairs:
        return []
    rows = [["longest touch", f"{whole.longest:.3g} s"]]
    for i, pair in enumerate(pairs[:MOST_PAIRS]):
        name = pair.pair.removeprefix(f"{joint}: ")
        times = f"{pair.touches} touch{'es' if pair.touches > 1 else ''}"
        rows.append(["" if i else "longest in all", f"{name}: {pair.time:.3g} s in {times}"])
    return rows

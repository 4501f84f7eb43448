"""Our engines and a peer's at the same errors, as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from benchmarks.measuring import Measured, Table

COLUMNS = ("error", "by", "setting", "its error", "steps", "processor time", "ratio")


def against(
    peer: str,
    title: str,
    found: Mapping[tuple[str, float], Measured],
    errors: Sequence[float],
    duration: float,
) -> Table:
    """The cheapest runs by name and error (m); those of the peer begin with its name in lower case.

    A ratio is the peer's best time over that of a row. `duration` (s) is that of the motion.
    """
    rows, told, missed = [], [], []
    for error in errors:
        here = {name: point for (name, at), point in found.items() if at == error}
        theirs = [point for name, point in here.items() if name.startswith(peer.lower())]
        own = {name: p for name, p in here.items() if not name.startswith(peer.lower())}
        best = min(theirs, key=lambda point: point.cost, default=None)
        for name, point in here.items():
            rows.append(_row(error, name, point, f"{best.cost / point.cost:.2f}" if best else ""))
        if own and best:
            ours = min(own, key=lambda name: own[name].cost)
            told.append(f"{best.cost / own[ours].cost:.2g} at {error:.0e} m ({ours})")
        elif not best:
            missed.append(f"{error:.0e} m")
    conclusion = f"Over {duration} s, {peer}'s best time over our best: {', '.join(told)}."
    if missed:
        conclusion += f" {peer} does not reach {', '.join(missed)}."
    return Table(title, COLUMNS, tuple(rows), conclusion)


def _row(error: float, name: str, point: Measured, ratio: str) -> tuple[str, ...]:
    told = (f"{point.setting:g}", f"{point.error:.1e} m", f"{point.steps}", f"{point.cost:.3f} s")
    return (f"{error:.0e} m", name, *told, ratio)

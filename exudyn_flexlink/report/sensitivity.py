"""What the program says of how long a run can be trusted."""

from __future__ import annotations

from math import log

from exudyn_flexlink.report.text import STATE_NAMES, number, table
from exudyn_flexlink.sensitivity import RunStatistics, Sensitivity


def sensitivity_text(found: Sensitivity) -> str:
    """Say up to when the watched point can be trusted, how fast runs part, and what both share."""
    lines = [_trusted(found)]
    if found.growth is not None:
        lines.append(
            f"Neighbouring runs part like exp({found.growth:.3g} t): "
            f"tenfold every {log(10) / found.growth:.2g} s."
        )
    if found.horizon is None:
        return "\n".join(lines)
    rows = [["Whole run", "this run", "the other"]]
    rows += [list(row) for row in _statistics(found.first, found.second, found.point)]
    return "\n".join([*lines, "", *table(rows)])


def _trusted(found: Sensitivity) -> str:
    other = "a run at half the tolerance or step"
    if found.horizon is None:
        return (
            f"{found.point} can be trusted to {found.largest:.2g} m throughout, to t = "
            f"{found.end:.5g} s: {other} differs by no more."
        )
    return (
        f"{found.point} can be trusted pointwise up to t = {found.horizon:.5g} s: there {other} is "
        f"{found.limit:.2g} m off. Beyond it trust statistics only."
    )


def _statistics(one: RunStatistics, other: RunStatistics, point: str) -> list[tuple[str, str, str]]:
    rows = []
    for i, axis in enumerate("xy"):
        pair = (one.rms[i], other.rms[i])
        rows.append((f"ripple of {point} in {axis}, rms", *(f"{x:.3g} m" for x in pair)))
    for i, axis in enumerate("xy"):
        pair = (one.strongest[i], other.strongest[i])
        rows.append((f"strongest line in {axis}", *(f"{x:.3g} Hz" for x in pair)))
    for body in one.levers:
        for i, word in enumerate(("least", "greatest")):
            pair = (one.levers[body][i], other.levers[body][i])
            rows.append((f"{word} angle of {body}", *(f"{number(x)} rad" for x in pair)))
    for joint, parts in one.contact.items():
        for state, name in STATE_NAMES.items():
            pair = (parts[state], other.contact[joint][state])
            rows.append((f"{joint}: {name}", *(f"{100 * x:.1f} %" for x in pair)))
    return [(str(a), str(b), str(c)) for a, b, c in rows]

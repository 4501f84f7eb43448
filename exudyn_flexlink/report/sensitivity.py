"""What the program says of how long a run can be trusted."""

from __future__ import annotations

from math import log

from exudyn_flexlink.report.contacts import contact_rows
from exudyn_flexlink.report.text import number, table
from exudyn_flexlink.sensitivity import Perturbed, RunStatistics, Sensitivity


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
    rows = [[f"Up to t = {found.end:.5g} s", "this run", "the other"]]
    rows += _statistics(found.first, found.second, found.point)
    return "\n".join([*lines, "", *table(rows)])


def _trusted(found: Sensitivity) -> str:
    other = "a neighbouring run"
    if found.horizon is None:
        angles = "".join(
            f", the angle of {body} to {apart:.2g} rad" for body, apart in found.angles.items()
        )
        return (
            f"{found.point} can be trusted to {found.largest:.2g} m{angles} throughout, to t = "
            f"{found.end:.5g} s: {other} differs by no more."
        )
    if found.largest <= found.limit:
        return (
            f"{found.point} can be trusted to {found.largest:.2g} m up to t = {found.horizon:.5g} s"
            f", where a run stopped: until there {other} differs by no more."
        )
    return (
        f"{found.point} can be trusted pointwise up to t = {found.horizon:.5g} s: there {other} is "
        f"{found.limit:.2g} m off. Beyond it trust statistics only."
    )


def _statistics(one: RunStatistics, other: RunStatistics, point: str) -> list[list[str]]:
    rows = []
    if one.perturbed is not None and other.perturbed is not None:
        rows += _perturbed(one.perturbed, other.perturbed, point)
    for body in [body for body in one.levers if body in other.levers]:
        for i, word in enumerate(("least", "greatest")):
            pair = (one.levers[body][i], other.levers[body][i])
            rows.append([f"{word} angle of {body}", *(f"{number(x)} rad" for x in pair)])
    for joint, totals in one.contact.items():
        rows += contact_rows(joint, totals, other.contact.get(joint))
    return rows


def _perturbed(one: Perturbed, other: Perturbed, point: str) -> list[list[str]]:
    rows = []
    for i, axis in enumerate("xy"):
        off = f"{point} off its ideal path, {axis}"
        both = (one, other)
        rows.append([f"{off}, rms", *(f"{p.rms[i]:.3g} m" for p in both)])
        rows.append([f"{off}, largest", *(f"{p.peak[i]:.3g} m" for p in both)])
        lines = [", ".join(f"{f:.3g}" for f in p.lines[i]) or "none" for p in both]
        rows.append([f"strongest lines in {axis}, +-{one.resolution / 2:.2g} Hz", *lines])
    return rows

"""What the program says of how long a run can be trusted."""

from __future__ import annotations

from math import log

from exudyn_flexlink.observables import STILL, name_of
from exudyn_flexlink.report.contacts import contact_rows
from exudyn_flexlink.report.text import number, table
from exudyn_flexlink.sensitivity import Perturbed, Sensitivity


def sensitivity_text(found: Sensitivity) -> str:
    """Say up to when points can be trusted, how fast runs part, and what both share."""
    lines = [_trusted(found)]
    if found.growth is not None:
        lines.append(
            f"Neighbouring runs part like exp({found.growth:.3g} t): "
            f"tenfold every {log(10) / found.growth:.2g} s."
        )
    if found.horizon is None:
        return "\n".join(lines)
    rows = [[f"Up to t = {found.end:.5g} s", "this run", "the other"]]
    rows += _statistics(found)
    return "\n".join([*lines, "", *table(rows)])


def _trusted(found: Sensitivity) -> str:
    points = name_of(found.points)
    if found.room <= STILL:
        return f"Nothing is told of {points}, which stand{'s' * (len(found.points) == 1)} still."
    trusted = f"{points[0].upper() if ' ' in points else points[0]}{points[1:]} can be trusted"
    where = f" in {found.worst}" if len(found.points) > 1 else ""
    at_most = f"differs by {found.largest:.2g} m at most{where}"
    if found.horizon is None:
        told = found.measures
        answers = "".join(
            f", by {apart:.2g} {told[body].unit} in the {told[body].word} of {body}"
            for body, apart in found.answers.items()
        )
        return (
            f"{trusted} to the end, t = {found.end:.5g} s: a neighbouring run {at_most}{answers}."
        )
    if found.largest <= found.limit:
        return (
            f"{trusted} up to t = {found.horizon:.5g} s, where a run stopped: until there a "
            f"neighbouring run {at_most}."
        )
    return (
        f"{trusted} instant by instant up to t = {found.horizon:.5g} s. From there on a "
        f"neighbouring run differs by more than {found.limit:.2g} m, {found.largest:.2g} m at most"
        f"{where}: trust statistics only."
    )


def _statistics(found: Sensitivity) -> list[list[str]]:
    one, other = found.first, found.second
    rows = []
    if one.perturbed is not None and other.perturbed is not None:
        rows += _perturbed(one.perturbed, other.perturbed, found.point)
    for body in [body for body in one.levers if body in other.levers]:
        measure = found.measures[body]
        for i, word in enumerate(("least", "greatest")):
            pair = (one.levers[body][i], other.levers[body][i])
            told = (f"{number(x)} {measure.unit}" for x in pair)
            rows.append([f"{word} {measure.word} of {body}", *told])
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

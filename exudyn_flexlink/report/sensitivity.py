"""What the program says of how long a run can be trusted."""

from __future__ import annotations

from math import log

from exudyn_flexlink.comparison import Comparison
from exudyn_flexlink.observables import STILL, Vibration, name_of
from exudyn_flexlink.report.contacts import contact_rows
from exudyn_flexlink.report.text import number, table
from exudyn_flexlink.sensitivity import Sensitivity


def sensitivity_text(found: Sensitivity) -> str:
    """Say up to when points can be trusted, how fast runs part, and what both share."""
    compared = found.compared
    if found.room <= STILL:
        many = compared.judged_by
        return f"Nothing is told of {name_of(many)}, which stand{'s' * (len(many) == 1)} still."
    lines = [_trusted(compared, found.limit)]
    if found.growth is not None:
        lines.append(
            f"Neighbouring runs part like exp({found.growth:.3g} t): "
            f"tenfold every {log(10) / found.growth:.2g} s."
        )
    if compared.horizon is None:
        return "\n".join(lines)
    names = compared.first.name, compared.second.name
    rows = [[f"Up to t = {compared.time[-1]:.5g} s", *names]]
    if all(own.off_ideal for own in found.vibrations):
        rows += _vibrations(found.vibrations, compared.point)
    rows += _statistics(compared)
    return "\n".join([*lines, "", *table(rows)])


def _trusted(found: Comparison, limit: float) -> str:
    points, largest = name_of(found.judged_by), float(found.distances.max())
    trusted = f"{points[0].upper() if ' ' in points else points[0]}{points[1:]} can be trusted"
    where = f" in {found.worst}" if len(found.judged_by) > 1 else ""
    at_most = f"differs by {largest:.2g} m at most{where}"
    if found.horizon is None:
        told = found.measures
        answers = "".join(
            f", by {abs(apart).max():.2g} {told[body].unit} in the {told[body].word} of {body}"
            for body, apart in found.answer_differences.items()
        )
        end = f"{found.time[-1]:.5g} s"
        return f"{trusted} to the end, t = {end}: a neighbouring run {at_most}{answers}."
    if largest <= limit:
        return (
            f"{trusted} up to t = {found.horizon:.5g} s, where a run stopped: until there a "
            f"neighbouring run {at_most}."
        )
    return (
        f"{trusted} instant by instant up to t = {found.horizon:.5g} s. From there on a "
        f"neighbouring run differs by more than {limit:.2g} m, {largest:.2g} m at most"
        f"{where}: trust statistics only."
    )


def _statistics(found: Comparison) -> list[list[str]]:
    one, other = found.statistics()
    rows = []
    for body, measure in found.measures.items():
        for i, word in enumerate(("least", "greatest")):
            told = (f"{number(part.levers[body][i])} {measure.unit}" for part in (one, other))
            rows.append([f"{word} {measure.word} of {body}", *told])
    for joint, totals in found.first.contact.items():
        rows += contact_rows(joint, totals, found.second.contact.get(joint))
    return rows


def _vibrations(both: tuple[Vibration, Vibration], point: str) -> list[list[str]]:
    rows = []
    for i, axis in enumerate("xy"):
        off = f"{point} off its ideal path, {axis}"
        rows.append([f"{off}, rms", *(f"{own.rms[i]:.3g} m" for own in both)])
        rows.append([f"{off}, largest", *(f"{own.peak[i]:.3g} m" for own in both)])
        spectra = [(own.x, own.y)[i] for own in both]
        lines = [", ".join(f"{line:.3g}" for line in own.lines) or "none" for own in spectra]
        rows.append([f"strongest lines in {axis}, +-{spectra[0].resolution / 2:.2g} Hz", *lines])
    return rows

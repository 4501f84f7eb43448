"""What the program says of how stable a motion is."""

from __future__ import annotations

from math import isfinite

from exudyn_flexlink.observables import Vibration
from exudyn_flexlink.report.text import number, table
from exudyn_flexlink.stability import Exponent, Stability

WORDS = {
    1: "neighbours part",
    0: "whether neighbours part or approach can't be told",
    -1: "neighbours approach each other",
}


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

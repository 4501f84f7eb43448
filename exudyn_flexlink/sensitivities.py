"""How much numbers of a run change with numbers of its scene, by differences whose errors are told.

A parameter p is moved by h to both sides, for three h; each h is a quarter of the previous one:
``D(h) = (q(p + h) - q(p - h))/(2 h)``. D has two errors. The truncation error grows as h^2; it
is less than the distance from the D of the next larger h. The error by the runs grows as 1/h. A run
of the scene itself and a run at ten times its tolerance give the error of a run: three times their
distance, as everywhere. The h with the least sum of both errors is taken.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import inf, isnan, nan
from typing import Any

from exudyn_flexlink.fitting import Parameter
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.mechanism import least_tolerance
from exudyn_flexlink.observables.parting import FACTOR, TIGHTER
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.source import unknown
from exudyn_flexlink.sweeps import FAILED, Row, SweepTable, label_of

FARTHEST = 0.02  # of a parameter, or in its SI unit if the parameter is 0: the largest h
FINER = 0.25  # ratio of each h to the previous one
STEPS = 3


class NoSensitivityError(ValueError):
    """There is no derivative; the text says of what, and why."""


@dataclass(frozen=True)
class Sensitivity:
    """How a `quantity` changes with a `parameter`, whose value is `at`; SI units.

    `derivative` has the `unit` and may be off by `error`; it was taken over `step` to both sides.
    `relative` is by how many per cent the quantity, `value`, changes for one of the parameter.
    """

    quantity: str
    parameter: str
    at: float
    value: float
    derivative: float
    error: float
    unit: str
    step: float

    @property
    def relative(self) -> float:
        """``(dq/dp) p/q``; inf where q is 0 and changes."""
        change = self.derivative * self.at
        return change / self.value if self.value else (inf if change else 0.0)


def points_of(scene: Scene, parameters: Sequence[Parameter]) -> list[dict[str, Any]]:
    """Return the points of the sweep that tells sensitivities: the scene itself twice, then steps.

    Raises:
        NoSensitivityError: a parameter is at its bound, so that it can't be moved to both sides.

    """
    accuracy = scene.accuracy
    if accuracy.tolerance is not None:
        fine = max(TIGHTER * accuracy.tolerance, least_tolerance(assemble_scene(scene)))
        key, coarse = "accuracy.tolerance", fine / TIGHTER
    else:
        assert accuracy.step is not None  # the scene has a tolerance or a step
        key, coarse, fine = "accuracy.step", accuracy.step, TIGHTER * accuracy.step
    still: dict[str, Any] = {p.path: p.start for p in parameters}
    points = [still | {key: coarse}, still | {key: fine}]
    for p in parameters:
        for h in _steps(p):
            points += [still | {key: fine, p.path: p.start + change} for change in (-h, h)]
    return points


def _steps(p: Parameter) -> list[float]:
    room = min(p.start - p.low, p.high - p.start)
    if room == 0:
        raise NoSensitivityError(f"{p.path} is at its bound, {p.start:g}: move it off that")
    largest = min(FARTHEST * (abs(p.start) or 1.0), room / 2)
    return [largest * FINER**k for k in range(STEPS)]


def sensitivities_in(
    table: SweepTable, quantities: Sequence[str], parameters: Sequence[Parameter]
) -> Iterator[Sensitivity]:
    """Give the sensitivity of each quantity to each parameter, by the rows of all `points_of`.

    Raises:
        NoSensitivityError: there is no such column, or no number in it.

    """
    rows = iter(table.rows)
    coarse, fine = next(rows), next(rows)
    if fine.status == FAILED:
        raise NoSensitivityError(f"the run of the scene fails: {fine.reason}")
    for name in quantities:
        if name not in fine.numbers:
            raise NoSensitivityError(unknown("column", name, fine.numbers))
    pairs = {p: [(h, next(rows), next(rows)) for h in _steps(p)] for p in parameters}
    for name in quantities:
        value, other = _number(fine, name), _number(coarse, name)
        if isnan(value - other):
            raise NoSensitivityError(f"'{name}' is no number here, but {fine.numbers[name]}")
        for p, runs in pairs.items():
            slope, error, h = _slope(name, runs, FACTOR * abs(value - other))
            if isnan(slope):
                failed = [row.reason for _, *both in runs for row in both if row.status == FAILED]
                why = failed[0] if failed else "the quantity has no number beside it"
                raise NoSensitivityError(f"no derivative of '{name}' by {p.path}: {why}")
            yield Sensitivity(name, p.path, p.start, value, slope, error, _unit(name, p), h)


def _slope(
    name: str, runs: Sequence[tuple[float, Row, Row]], off: float
) -> tuple[float, float, float]:
    """Derivative with the least error, this error, and its h; nan if no two steps give any.

    `off` is how far the quantity of a run may be from the truth.
    """
    best, larger = (nan, inf, 0.0), nan
    for h, before, after in runs:
        slope = (_number(after, name) - _number(before, name)) / (2 * h)
        error = abs(slope - larger) + off / h
        if error < best[1]:
            best = slope, error, h
        larger = slope
    return best


def _unit(quantity: str, p: Parameter) -> str:
    """Unit of a derivative."""
    above, below = label_of(quantity)[1] or "1", p.unit
    if not below:
        return above
    return f"{above}/({below})" if {*" /"} & {*below} else f"{above}/{below}"


def _number(row: Row, name: str) -> float:
    """Return a number of a row; nan where there is none."""
    value = row.numbers.get(name)
    return float(value) if isinstance(value, float | int) else nan

"""One row of a sweep's table: results of the runs at one point, and the reason if it is doubtful.

The runs of one point, as every executor makes them, in any process.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from itertools import count
from math import isfinite, isnan
from time import perf_counter
from typing import Any

from exudyn_flexlink.arguments import instance_of, takes
from exudyn_flexlink.loading import document_of_data, scene_of
from exudyn_flexlink.observables import (
    ANGLE,
    DISPLACEMENT,
    State,
    Strike,
    bending,
    bent_links,
    contact_totals,
    joints_with_play,
    lever_response,
    strikes,
    struck_bodies,
)
from exudyn_flexlink.result import INTERRUPTED, Result
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.source import Document, SceneError, dotted
from exudyn_flexlink.sweeps.plan import Point, Sweep, column_of_contact

DONE, DOUBTFUL, FAILED = "done", "doubtful", "failed"

COLUMNS = {
    "run": "number",
    "id": "id",
    "status": "status",
    "reason": "reason",
    "warnings": "warnings",
    "wall_s": "wall",
}
"""Columns of every table, besides varied values and observables; fields of `Row`."""

OTHERWISE_TOLD = (
    *("force_N", "penetration_m", "torque_N_m", "penetration_rad"),
    *(ANGLE.name, DISPLACEMENT.name),
)
"""Extremes that have columns of their own."""

Scalar = float | int | bool | str | None
"""An entry of a table; None means that the number does not exist."""

RowFunction = Callable[[Result], Mapping[str, Scalar]]
"""Observables of one run, by the names of their columns, which end in their units."""


Simulate = Callable[[Scene], Result]
"""Runs a scene by the sweep's engine; a failed run is a Result, too."""

Observe = Callable[[Scene, Simulate], Mapping[str, Scalar]]
"""Observables of one point, perhaps from several runs, by its scene and a function that runs it."""


class RunFailedError(Exception):
    """A run stopped before its end, so it has no observables."""


@dataclass(frozen=True)
class Row:
    """The results of the point `number` (from 1) with the name `id`.

    `status` is done; doubtful, with the warnings of its runs as `reason`; or failed, with the cause
    as `reason` and without numbers. `wall` (s) is the wall time.
    """

    number: int
    id: str
    status: str
    reason: str
    warnings: int
    wall: float
    numbers: Mapping[str, Scalar] = field(default_factory=dict)


@dataclass(frozen=True)
class OneRun:
    """Observes one run by a function of its Result; can be pickled if the function can."""

    row: RowFunction

    def __call__(self, scene: Scene, simulate: Simulate) -> Mapping[str, Scalar]:
        """Run the scene, and return what the function tells.

        Raises:
            RunFailedError: the run did not come to its end.

        """
        result = simulate(scene)
        if not result.outcome.completed:
            raise RunFailedError(result.outcome.ending)
        return self.row(result)


@takes(result=instance_of(Result))
def standard_row(result: Result) -> dict[str, Scalar]:
    """Return what a sweep tells of a run that came to its end; units end the names.

    Of every contact: strikes, the time between the last two, energy lost, the largest force and
    speed of approach. Of struck bodies: the angle from where it stood at time 0, and its swing, the
    largest less the least; of one that does not turn on a hinge its displacement and its stroke. Of
    flexible links: the largest bending moment and stress. Of joints with clearance: touches,
    impacts, energy lost, largest force, part of the time without contact. Of joints with friction:
    the energy that it took. Of the watched point: where it went at most. Of the run: its end,
    energy dissipated and what the balance misses, the error that a second run tells (None where
    none was made), and the horizon, the instant from which on both part (None if they never do).
    """
    columns: dict[str, Scalar] = {}
    for contact in result.scene.all_contacts:
        columns |= _of_contact(result, contact)
    for body, contact in struck_bodies(result.scene).items():
        seen = lever_response(result, contact)
        measure, (least, _), (greatest, _) = seen.measure, seen.least, seen.greatest
        columns |= {
            f"{body}.{measure.span}_{measure.unit}": greatest - least,
            f"{body}.least_{measure.name}": least,
            f"{body}.greatest_{measure.name}": greatest,
        }
    for link in bent_links(result.scene):
        largest = bending(result, link).largest
        columns[f"{link}.greatest_bending_moment_N_m"] = abs(largest.moment)
        columns[f"{link}.greatest_bending_stress_Pa"] = largest.stress
    for joint in joints_with_play(result):
        columns |= _of_joint(result, joint)
    for joint, spec in result.scene.joints.items():
        rubbing = result.frictions.get(joint)
        if rubbing is not None or getattr(spec, "friction", None) is not None:
            columns[f"{joint}.friction_loss_J"] = 0.0 if rubbing is None else rubbing.lost[-1]
        if getattr(spec, "law", None) is not None:  # also of one whose clearance is 0
            columns.setdefault(f"{joint}.energy_lost_J", 0.0)
    columns |= _of_watched(result)
    return columns | {
        "energy_dissipated_J": float(result.energy.dissipated[-1]),
        "energy_residual_J": result.checks.energy_residual,
        "end_s": result.outcome.time,
        "error_m": None if result.error.missing else result.error.largest,
        "horizon_s": result.error.horizon,
    }


def _of_contact(result: Result, contact: str) -> dict[str, Scalar]:
    every_strike = strikes(result, contact)
    touches = result.contacts[contact].touches
    last: list[Strike] = every_strike[-2:]
    speed = column_of_contact(result.scene, contact, "greatest_approach_speed", "m/s")
    return {
        f"{contact}.strikes": len(every_strike),
        f"{contact}.last_period_s": last[1].begin - last[0].begin if len(last) > 1 else None,
        **_greatest_force(result, contact),
        f"{contact}.energy_lost_J": float(touches.energy_lost.sum()),
        f"{contact}.{speed}": float(touches.approach_speed.max(initial=0.0)),
    }


def _of_joint(result: Result, joint: str) -> dict[str, Scalar]:
    totals = contact_totals(result, joint)
    return {
        f"{joint}.touches": totals.touches,
        f"{joint}.impacts": totals.impacts,
        f"{joint}.energy_lost_J": totals.energy_lost,
        **_greatest_force(result, joint),
        f"{joint}.part_of_time_free": totals.fractions[State.FREE],
    }


def _greatest_force(result: Result, name: str) -> dict[str, Scalar]:
    """Largest normal force; None for impulses, which have no force; 0 without a touch."""
    column = column_of_contact(result.scene, name, "greatest_force", "N")
    force = float(result.intervals[name].peak_force.max(initial=0.0))
    return {f"{name}.{column}": force if isfinite(force) else None}


def _of_watched(result: Result) -> dict[str, Scalar]:
    """Extremes of the watched point, and speeds of struck bodies."""
    columns: dict[str, Scalar] = {}
    for name, extremes in result.extremes.items():
        owner, _, quantity = name.rpartition(".")
        if quantity in OTHERWISE_TOLD or not len(extremes.time):
            continue
        if quantity in ("x_m", "y_m"):
            columns[f"{owner}.least_{quantity}"] = extremes.least[0]
        columns[f"{owner}.greatest_{quantity}"] = extremes.greatest[0]
    return columns


LONGEST_REASON = 500  # characters: a row is read by people

Keep = Callable[[Result, str], None]
"""Saves a run under a name."""


@dataclass(frozen=True)
class Work:
    """The data common to all points; each process gets them once.

    `document` is the scene as plain data, with the points of its files in it. `simulate` runs a
    scene, `observe` returns the row's observables, and `keep`, if given, saves each run.
    """

    document: Document
    simulate: Simulate
    observe: Observe
    keep: Keep | None = None
    allow_outside: bool = False

    def row(self, point: Point) -> Row:
        """Make the runs of a point; the row reports all their errors."""
        began = perf_counter()
        warned: list[str] = []
        numbers: Mapping[str, Scalar] = {}
        names = (point.id if k == 1 else f"{point.id}-{k}" for k in count(1))

        def simulate(scene: Scene) -> Result:
            result = self.simulate(scene)
            if result.outcome.reason == INTERRUPTED:  # so is the sweep: there is no row
                raise KeyboardInterrupt
            end = [] if result.outcome.completed else [f"a run {result.outcome.ending}"]
            warned.extend([*result.warnings, *end])
            if self.keep is not None:
                self.keep(result, next(names))
            return result

        try:
            scene = scene_of(self.document, point.settings, self.allow_outside)
            numbers = _checked(self.observe(scene, simulate))
        except SceneError as error:
            first = error.mistakes[0]
            why = f"{dotted(first.path)}: {first.message}" if first.path else first.message
        except RunFailedError as error:
            why = str(error)
        except MemoryError:
            why = "not enough memory"
        except Exception as error:  # an engine refuses the scene, or the user's function fails
            why = f"{type(error).__name__}: {error}"
        else:
            why = ""
        status = FAILED if why else DOUBTFUL if warned else DONE
        text = shortened(why or "; ".join(dict.fromkeys(warned)), LONGEST_REASON)
        wall = perf_counter() - began
        return Row(point.number, point.id, status, text, len(warned), wall, numbers)


def work_of(sweep: Sweep, simulate: Simulate, observe: Observe, keep: Keep | None = None) -> Work:
    """Return the work of a sweep's processes at each point; see `Work`."""
    data = document_of_data(sweep.scene.to_data(), "the scene")
    document = replace(data, folder=sweep.scene.document.folder)  # where varied files are
    return Work(document, simulate, observe, keep, sweep.allow_outside)


def shortened(text: str, most: int) -> str:
    """Return a text of at most `most` characters; dots replace the rest."""
    return text if len(text) <= most else f"{text[: most - 4]} ..."


def _checked(observed: Mapping[str, Any]) -> Mapping[str, Scalar]:
    """Return observables as entries of a row; refuse names that are not texts, or are taken."""
    for name in observed:
        if not isinstance(name, str):
            raise TypeError(f"a column's name is a text, no {type(name).__name__}")
        if name in COLUMNS:
            raise ValueError(f"every sweep has a column '{name}': give yours another name")
    return {name: _plain(value) for name, value in observed.items()}


def _plain(value: Any) -> Scalar:
    """Return a number, text, bool or None (for nan); raise TypeError for other values."""
    if hasattr(value, "item"):  # of numpy
        value = value.item()
    if isinstance(value, float) and isnan(value):
        return None
    if value is None or isinstance(value, float | int | bool | str):
        return value
    raise TypeError(f"a row holds numbers and texts, no {type(value).__name__}")

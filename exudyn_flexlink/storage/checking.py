"""A summary of a run that is no summary: values of the wrong kind, names that its scene lacks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from exudyn_flexlink.observables import extreme_names
from exudyn_flexlink.result import MeasuredError, Result
from exudyn_flexlink.scene import Scene

BEYOND = 1e30  # SI: no number of a run is as large
ROUNDING = 1e-9  # of a run's end: as much may an event be told after it


def check_count(samples: Any) -> int:
    """Return the number of samples.

    Raises:
        ValueError: it is none.

    """
    if not isinstance(samples, int) or samples < 1:
        raise ValueError(f"'samples' is {samples!r}")
    return samples


def check_result(result: Result) -> None:
    """Look at what a summary said of a run.

    Raises:
        ValueError: that can't be; the message names the entry of the summary.

    """
    _check_kinds(result)
    _check_parts(result)
    _check_laps(result)


def _check_kinds(result: Result) -> None:
    outcome = result.outcome
    _require("outcome", isinstance(outcome.completed, bool) and _instant(outcome.time))
    _require("outcome", _texts((outcome.reason, outcome.advice)))
    _require("checks", _numbers(vars(result.checks)))
    _require("timings", _numbers(result.timings))
    settings = result.settings.values()
    _require("settings", all(isinstance(value, str) or _real(value) for value in settings))
    _require("settings", _real(result.settings.get("elements", 0)))
    _require("warnings", _texts(result.warnings))
    _require("engine", _texts((result.engine,)))
    _require("versions", _texts(result.versions.values()))
    _require("pairs", all(_instant(sleeve.deepest) for sleeve in result.sleeves.values()))
    if result.error is not None:
        _check_error(result.error)


def _check_error(error: MeasuredError) -> None:
    instants = (error.exceeds_from, error.stopped, error.forces_until)
    _require("error", all(instant is None or _instant(instant) for instant in instants))
    _require("error", _real(error.limit) and _real(error.largest) and error.limit > 0)
    _require("error", _texts((*error.points, error.missing)))
    parts = [part for own in error.forces.values() for part in (own.free, own.touching) if part]
    _require("error", all(_numbers(vars(part)) for part in parts))


def check_names(scene: Scene, names: Mapping[str, tuple[str, ...]]) -> None:
    """Look at names of arrays: hinges go by that of their body and a number, walls by their joint.

    Raises:
        KeyError: a kind of arrays has none.
        ValueError: they are not those of the scene.

    """
    owners = (*scene.bodies, *scene.joints)
    _require("names", names["contacts"] == tuple(scene.contacts))
    for kind in ("drive_torques", "drive_forces"):
        _require("names", set(names[kind]) <= set(scene.drives))
    _require("names", all(name.startswith(owners) for name in names["joint_forces"]))
    _require("names", names["extremes"] == extreme_names(scene))
    _require("names", set(names["spring_forces"]) <= set(scene.springs))
    for kind in ("slot_forces", "bearings", "sleeves"):
        _require("names", set(names[kind]) <= set(scene.joints))


def _check_parts(result: Result) -> None:
    """Parts go by the name of their body, and a number."""
    parts = result.part_names
    _require("part_names", len(set(parts)) == len(parts))
    _require("part_names", all(part.startswith(tuple(result.scene.bodies)) for part in parts))


def _check_laps(result: Result) -> None:
    end = max(float(result.time[-1]), result.outcome.time)
    for lap in result.laps:
        _require("laps", lap.kind == "lap" and lap.name in result.scene.joints)
        _require("laps", _instant(lap.time) and _numbers(lap.details))
        _require("laps", lap.time <= end * (1 + ROUNDING))


def _require(entry: str, holds: bool) -> None:
    if not holds:
        raise ValueError(f"'{entry}' holds what can't be")


def _texts(values: Iterable[Any]) -> bool:
    return all(isinstance(value, str) for value in values)


def _numbers(values: Mapping[str, Any]) -> bool:
    return all(map(_real, values.values()))


def _real(value: Any) -> bool:
    """Whether a value is a number that a float can hold; it may be infinite or nan."""
    return isinstance(value, float) or (isinstance(value, int) and abs(value) < BEYOND)


def _instant(value: Any) -> bool:
    return _real(value) and 0 <= value < BEYOND

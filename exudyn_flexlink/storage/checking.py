"""A summary of a run that is no summary: values that can't be, names that its scene lacks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from exudyn_flexlink.observables import extreme_names
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.storage.plain import LARGEST

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
    _check_numbers(result)
    _check_parts(result)
    _check_laps(result)


def _check_numbers(result: Result) -> None:
    _require("outcome", _instant(result.outcome.time))
    _require("settings", not isinstance(result.settings.get("elements"), str))
    _require("pairs", all(_instant(sleeve.deepest) for sleeve in result.sleeves.values()))
    error = result.error
    if error is not None:
        instants = (error.exceeds_from, error.stopped, error.forces_until)
        _require("error", all(instant is None or _instant(instant) for instant in instants))
        _require("error", error.limit > 0)


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
        _require("laps", _instant(lap.time))
        _require("laps", lap.time <= end * (1 + ROUNDING))


def _require(entry: str, holds: bool) -> None:
    if not holds:
        raise ValueError(f"'{entry}' holds what can't be")


def _instant(value: float) -> bool:
    return 0 <= value < LARGEST

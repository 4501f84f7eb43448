"""Models as seen in a mirror, and ten times as large: what physics says they must do is known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import yaml

from exudyn_flexlink.loading import scene_of
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.source import parse_document

_TURNED = {"angles", "guesses", "speeds"}  # maps of angles by body
_POINTS = {"at", "centre", "centre_of_mass", "gravity"}
# Powers of the length by which a quantity grows if material stays, and times grow as lengths do:
# masses then grow by 3, forces by 2, speeds by 0.
_LENGTHS = {
    "length": 1, "width": 1, "thickness": 1, "diameter": 1, "area": 2, "second_moment": 4,
    "mass": 3, "inertia": 5, "at": 1, "centre": 1, "centre_of_mass": 1, "semi_axes": 1,
    "radius": 1, "clearance": 1, "points": 1, "ramp": 1, "gravity": -1, "speeds": -1,
    "duration": 1, "at_most": 1, "sample": 1, "tolerance": 1, "step": 1, "frequency": -1,
    "damping": 4,
}  # fmt: skip


def from_data(data: Mapping[str, Any]) -> Scene:
    """Return the checked scene of plain data."""
    return scene_of(parse_document(yaml.safe_dump(dict(data), sort_keys=False), "made"))


def mirrored(scene: Scene) -> Scene:
    """Reflect a scene in the x-axis: what turned to the left turns to the right."""
    return from_data(_reflected(scene.to_data(), ()))


def _reflected(value: Any, where: tuple[str, ...]) -> Any:
    key = where[-1] if where else ""
    if isinstance(value, Mapping):
        changed = {k: _reflected(v, (*where, k)) for k, v in value.items()}
        if changed.get("type") in ("ellipse", "circle") and "from" in value:
            changed |= {"from": -value["to"], "to": -value["from"]}
        if changed.get("type") == "point_on_line":
            changed["side"] = "left" if value.get("side") == "right" else "right"
        if where[:1] == ("drives",) and "value" in changed:
            changed["value"] = -value["value"]
        return changed
    if key == "pieces":
        return [_reflected(piece, ()) for piece in reversed(value)]
    if key in ("rotation", "rest_angle") or (where[-2:-1] and where[-2] in _TURNED):
        return -value
    if _is_pair(value) and (key in _POINTS or where[-2:-1] in (("points",), ("velocities",))):
        return [value[0], -value[1]]
    if key == "points" and value and _is_pair(value[0]):
        return [[x, -y] for x, y in value]
    return value


def _is_pair(value: Any) -> bool:
    return (
        isinstance(value, Sequence)
        and len(value) == 2
        and all(isinstance(x, (int, float)) for x in value)
    )


def scaled(scene: Scene, factor: float) -> Scene:
    """Make everything `factor` times as large, of the same material, and as much slower."""
    return from_data(_grown(scene.to_data(), (), factor))


def _grown(value: Any, where: tuple[str, ...], factor: float) -> Any:
    if isinstance(value, Mapping):
        return {k: _grown(v, (*where, k), factor) for k, v in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_grown(item, where, factor) for item in value]
    power = _power(where)
    if power == 0 or isinstance(value, (str, bool)):
        return value
    return value * factor**power


def _power(where: tuple[str, ...]) -> int:
    key = where[-1]
    if where[0] == "materials":
        return 0
    if key == "stiffness":
        return 1 if "law" in where else 3
    if key == "value":
        return -1  # of a speed drive
    named = [_LENGTHS[name] for name in where if name in _LENGTHS]
    return named[0] if named else 0

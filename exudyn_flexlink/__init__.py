"""Slot-driven flexible mechanisms with impact: from a YAML model to numbers one can trust.

    from exudyn_flexlink import load_scene, simulate
    result = simulate(load_scene("models/no_clearance.yaml"))

The names below are imported when they are first used, so that the command line answers at once.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from exudyn_flexlink.engines import NotRepresentableError, simulate
    from exudyn_flexlink.loading import load_scene
    from exudyn_flexlink.result import Result
    from exudyn_flexlink.scene import Scene
    from exudyn_flexlink.source import SceneError

__all__ = ["NotRepresentableError", "Result", "Scene", "SceneError", "load_scene", "simulate"]

_HOMES = {
    "NotRepresentableError": "engines",
    "Result": "result",
    "Scene": "scene",
    "SceneError": "source",
    "load_scene": "loading",
    "simulate": "engines",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)

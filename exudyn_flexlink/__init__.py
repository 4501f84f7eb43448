"""Slot-driven flexible mechanisms with impact: from a YAML model to numbers one can trust.

>>> from exudyn_flexlink import load_scene, simulate  # doctest: +SKIP
>>> result = simulate(load_scene("models/no_clearance.yaml"))  # doctest: +SKIP
"""

from exudyn_flexlink.engines import NotRepresentableError, simulate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.source import SceneError

__all__ = ["NotRepresentableError", "Result", "Scene", "SceneError", "load_scene", "simulate"]

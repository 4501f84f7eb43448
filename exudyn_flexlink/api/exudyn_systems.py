"""Exudyn's own system of a scene, for users who go on with Exudyn itself."""

from __future__ import annotations

from exudyn_flexlink.api.scenes import given_scene
from exudyn_flexlink.arguments import takes
from exudyn_flexlink.engines.exudyn.redundant.opened import ExudynSystem, opened
from exudyn_flexlink.scene import Scene


@takes(scene=given_scene)
def exudyn_system(scene: Scene) -> ExudynSystem:
    """Return the Exudyn system of a scene in redundant coordinates, assembled, to go on with.

    Numbers of items are tuples: ``system.bodies["lever"]``, ``system.points["lever.end"]``. With
    ``formulation: beam`` there are beams. When Exudyn solves alone, the program does nothing
    between its steps; ``system.not_followed`` names what of this matters to the scene. Import
    exudyn before this package to have its checks of item numbers.

    Raises:
        NotRepresentableError: of contacts that Exudyn's own solver does not know, of a flexible
            body that can't be a beam, and of curves with laps; it tells the line.
        SceneError: the scene can't be put together.
        TypeError: it is no scene.

    """
    return opened(scene)

"""Run a scene in Exudyn, in the formulation that it asks for."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from types import ModuleType

from exudyn_flexlink.engines import NotRepresentableError
from exudyn_flexlink.engines.exudyn import redundant
from exudyn_flexlink.engines.exudyn.minimal import run as minimal
from exudyn_flexlink.engines.exudyn.redundant.beam import beams_of
from exudyn_flexlink.engines.interrupts import timed
from exudyn_flexlink.integrate.problem import order_of, stages_for
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.mechanism import beyond_redundant, fittest, formulation
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene

PACKAGES = "exudyn", "numpy"


def order(scene: Scene) -> int:
    """Return the order of the method that solves a scene."""
    if formulation(scene) != "minimal":
        return redundant.ORDER
    contacts = assemble_scene(scene).mechanism.contacts_and_pairs
    return order_of(stages_for(contacts, scene.accuracy.tolerance))


def run(
    scene: Scene,
    progress: Callable[[float], None] | None = None,
    limits: float = 1.0,
    *,
    seed: bool = False,
) -> Result:
    """Simulate a scene; a run that fails is a Result with ``outcome.completed`` False.

    `limits` scales all limits of steps, except the limit that follows from a step's error. With
    `seed` the start is off by rounding: see `finer`.

    Raises:
        NotRepresentableError: the formulation that the scene asks for can't represent it.
        SceneError: the scene can't be put together.

    """
    room: ModuleType = minimal if formulation(scene) == "minimal" else redundant

    def prepared() -> object:
        return room.prepare(scene, assemble_scene(scene), progress, limits, seed=seed)

    return timed(prepared, room.solve, room.finish)


def formulations(scene: Scene) -> tuple[str, ...]:
    """Formulations that can represent a scene, the one that `auto` means first.

    Raises:
        SceneError: the scene can't be put together.

    """
    mechanism = assemble_scene(scene).mechanism
    if beyond_redundant(scene):
        return ("minimal",)
    first = fittest(scene)
    names = (first, "redundant" if first == "minimal" else "minimal")
    with suppress(NotRepresentableError):
        if beams_of(scene, mechanism):
            return (*names, "beam")
    return names

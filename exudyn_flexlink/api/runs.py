"""Runs, as a notebook asks for them, and those that were saved."""

from __future__ import annotations

from collections.abc import Callable
from os import PathLike
from pathlib import Path

from exudyn_flexlink import engines, storage
from exudyn_flexlink.api.results import Result, own_result
from exudyn_flexlink.api.scenes import ENGINE, Scene, given_scene
from exudyn_flexlink.arguments import takes


@takes(scene=given_scene, engine=ENGINE)
def simulate(
    scene: Scene,
    engine: str = "exudyn",
    progress: Callable[[float], None] | None = None,
    *,
    measure: bool = True,
) -> Result:
    """Simulate a scene with ``"exudyn"`` or ``"lagrangian"``; a run that fails is a Result, too.

    Its `outcome` says whether it ran to its end. `progress` is called with the part that is done, 0
    to 1. With a tolerance two runs are made, of which the second is finer: it is the result, whose
    `error` is what their distance tells. ``measure=False`` makes one, of which no error is known. A
    run whose own numbers are doubtful warns.

    Ctrl-C ends it after the step under way: what was computed is returned, and `outcome` says that
    it was interrupted. After it the second run, if under way, is given up.

    Raises:
        KeyboardInterrupt: the user had enough before the first step.
        NotRepresentableError: the engine can't represent a part of the scene.

    """
    try:
        found = engines.simulate(scene, engine, progress, measure=measure, at_once=True)
    except engines.LateInterruptError as late:  # all that it has computed is there
        found = late.result
    return own_result(found)


@takes()
def load(folder: str | PathLike[str]) -> Result:
    """Read a saved run.

    Raises:
        StorageError: the folder holds no run, or a file of it is damaged.

    """
    return own_result(storage.load(Path(folder)))

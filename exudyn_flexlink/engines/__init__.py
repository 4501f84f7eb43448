"""Engines that turn a scene into a Result; each is imported only when it is asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from importlib import import_module
from types import ModuleType

from threadpoolctl import ThreadpoolController

from exudyn_flexlink.engines.diagnostics import diagnosed
from exudyn_flexlink.engines.diagnostics.neighbour import Measured, measured_by, unmeasured
from exudyn_flexlink.engines.diagnostics.retries import retried
from exudyn_flexlink.engines.interrupts import LateInterruptError, deferrable_interrupts
from exudyn_flexlink.raising import Sendable
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.versions import THIS, version_of

Progress = Callable[[float], None]
"""Called now and then with the part of the run that is done, 0 to 1."""

ENGINES = {
    "exudyn": "exudyn_flexlink.engines.exudyn.run",
    "lagrangian": "exudyn_flexlink.engines.lagrangian.run",
}


class NotRepresentableError(Sendable, ValueError):
    """An engine can't represent a part of the scene; `path` names it (``("joints", "pin")``)."""

    def __init__(self, path: tuple[str, ...], message: str) -> None:
        super().__init__(f"{'.'.join(path)}: {message}")
        self.path = path
        self.message = message


def simulate(
    scene: Scene,
    engine: str = "exudyn",
    progress: Progress | None = None,
    *,
    measure: bool = True,
    retries: int = 0,
) -> Result:
    """Simulate a scene. A run that fails is a Result too: see ``Result.outcome``.

    So is one that is asked to end while it is solved (see `interrupts`). A run whose own numbers
    are doubtful says so in its warnings, and is made again up to `retries` times, each time ten
    times as accurate. Where steps alone do not keep the tolerance, since errors multiply or the
    method only aims at it, a second run tells how large the error is (see `measured`), unless
    `measure` is False.

    Raises:
        LateInterruptError: that was asked after the solve; the result, which is whole, is in it.
        NotRepresentableError: the engine can't represent a part of the scene.
        SceneError: the scene can't be put together (never after `load_scene`).
        ValueError: there is no such engine.

    """
    if engine not in ENGINES:
        raise ValueError(f"no engine '{engine}'; there is: {', '.join(ENGINES)}")
    room, threads = _loaded(engine)
    # Matrices are small: numpy's threads would wait for one another most of the time.
    with deferrable_interrupts() as ctrl_c, threads.limit(limits=1, user_api="blas"):
        result, interrupted = retried(
            room.run(scene, progress), lambda x: room.run(x, progress), retries
        )
    result = unmeasured(diagnosed(result))
    result = replace(result, versions={THIS: version_of(THIS), **result.versions})
    if (ctrl_c.pending or interrupted) and result.outcome.completed:
        raise LateInterruptError(result)
    return measured(result, progress).result if measure and result.error else result


@cache
def _loaded(engine: str) -> tuple[ModuleType, ThreadpoolController]:
    """Import an engine and, once for all runs, find the threads of what is then loaded."""
    return import_module(ENGINES[engine]), ThreadpoolController()


def measured(result: Result, progress: Progress | None = None) -> Measured:
    """Make a neighbouring run, and tell by it how far a run is off: see ``Result.error``.

    Warnings say from when on that is more than the tolerance. A run that stopped is left as it is.

    Raises:
        LateInterruptError: the user did not wait; the run, which is whole and says so, is in it.

    """
    return measured_by(result, lambda near: simulate(near, result.engine, progress, measure=False))


def formulations(scene: Scene, engine: str) -> tuple[str, ...]:
    """Formulations in which an engine represents a scene, the one that `auto` means first.

    Empty where it offers no choice.

    Raises:
        SceneError: the scene can't be put together (never after `load_scene`).

    """
    offered = getattr(import_module(ENGINES[engine]), "formulations", None)
    return () if offered is None else tuple(offered(scene))

"""Engines that turn a scene into a Result; each is imported only when it is asked for."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from functools import cache, partial
from importlib import import_module
from platform import python_version
from types import ModuleType

from threadpoolctl import ThreadpoolController

from exudyn_flexlink.continuing import Progress, instant_of, through_stages
from exudyn_flexlink.engines.diagnostics import diagnosed
from exudyn_flexlink.engines.finer import given_up, measured_by, partner, retuned, unmeasured
from exudyn_flexlink.engines.interrupts import (
    Beside,
    LateInterruptError,
    aside,
    deferrable_interrupts,
)
from exudyn_flexlink.linear import LinearModel
from exudyn_flexlink.loading import rest_of_scene
from exudyn_flexlink.mechanism import Ramp
from exudyn_flexlink.raising import Sendable
from exudyn_flexlink.result import INTERRUPTED, Result
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.shipped import ENGINES, EXUDYN, THIS, version_of
from exudyn_flexlink.source import KeyPath, dotted

FIRST = 0.4  # of the progress of two runs: the part of the first run


class NotRepresentableError(Sendable, ValueError):
    """An engine can't represent a part of the scene; `path` names it (``("joints", "pin")``)."""

    def __init__(self, path: KeyPath, message: str) -> None:
        super().__init__(f"{dotted(path)}: {message}")
        self.path = path
        self.message = message


def simulate(
    scene: Scene,
    engine: str = EXUDYN,
    progress: Progress | None = None,
    *,
    measure: bool = False,
    first: bool = False,
) -> Result:
    """Simulate a scene once, or with `measure` twice: see `measured`.

    A single run is the `first` of two if `measured` shall make the second one later.

    A run that fails is a Result, too: see ``Result.outcome``. So is a run that is asked to end
    while it is solved (see `interrupts`). Warnings say if numbers of the run are doubtful.

    Raises:
        KeyboardInterrupt: the run was asked to end before the first step.
        LateInterruptError: it was asked to end after the solve; the error has the complete result.
        NotRepresentableError: the engine can't represent a part of the scene.
        SceneError: the scene can't be put together (never after `load_scene`).
        ValueError: there is no such engine.

    """
    made = _measured if measure else _first_run if first else _run
    result = aside(partial(made, scene, engine), progress)
    if progress is not None and result.outcome.reason != INTERRUPTED:
        try:
            progress(1.0)
        except KeyboardInterrupt:  # the run is complete
            raise LateInterruptError(result) from None
    return result


def linear_model(of: Scene | Result, at: float | None = None) -> LinearModel:
    """Linearise a scene at its rest, with drives held, or a run at its sample next to `at` (s).

    Without `at` the last sample of the run is taken.

    Raises:
        CannotContinueError: the run has no such instant.
        NotLinearError: see `linear`.
        SceneError: the scene has no rest.

    """
    if (of.scene if isinstance(of, Result) else of).solver.formulation == "beam":
        message = "a beam has no linear equations here, its rods have: take 'minimal'"
        raise NotRepresentableError(("solver", "formulation"), message)
    room = import_module("exudyn_flexlink.engines.exudyn.minimal.linear")
    if isinstance(of, Result):
        scene, (assembly, touching, time) = of.scene, instant_of(of, at)
    else:
        scene, rest, time = of, rest_of_scene(of), None
        mechanism = rest.assembly.mechanism
        held = tuple(replace(motor, speed=Ramp(0.0)) for motor in mechanism.speed_motors)
        assembly = replace(rest.assembly, mechanism=replace(mechanism, speed_motors=held))
        contacts = enumerate(mechanism.contacts_and_pairs)
        touching = {k: 0.0 for k, contact in contacts if contact.name in rest.presses}
    made: LinearModel = room.linear_model(scene, assembly, touching, time)
    return made


def _measured(scene: Scene, engine: str, progress: Progress | None) -> Result:
    """Make a run, and the second run, which measures it."""
    first = progress and (lambda done: progress(FIRST * done))
    then = progress and (lambda done: progress(FIRST + (1 - FIRST) * done))
    with Beside(scene, engine) as beside:
        try:
            result = _first_run(scene, engine, beside.watch(first))
        except LateInterruptError as error:
            raise LateInterruptError(given_up(error.result)) from None
        return measured(result, then, beside, first=True)


def measured(
    result: Result,
    progress: Progress | None = None,
    beside: Beside | None = None,
    *,
    first: bool = False,
) -> Result:
    """Make a second, finer run, and return the more accurate of both, with its error.

    See ``Result.error``. Warnings say from which instant on the error may exceed the tolerance. A
    run that stopped, or that was made with a given step, is returned as it is. If the second run
    has begun `beside` the first, it is waited for. The coarser run starts off by rounding (see
    `finer`) if the given run was made as the `first` of two; else the second one does.

    Raises:
        LateInterruptError: the user did not wait; the error has the complete run, and what is known
            of its error.

    """
    scene, engine = result.scene, result.engine

    def again(share: float) -> Result:
        seed = not first or _coarser(scene, engine, share)
        made = beside and beside.made(progress)
        return made or _run(scene, engine, progress, share, seed=seed)

    return measured_by(result, again)


def second_run(scene: Scene, engine: str, progress: Progress | None = None) -> Result:
    """Make the second run alone, in a process of its own: see `interrupts`.

    Raises:
        LateInterruptError: the user asked for the end after the solve; it has the result.

    """
    share = partner(scene, _loaded(engine)[0].order(scene))
    return _run(scene, engine, progress, share, seed=_coarser(scene, engine, share))


def _first_run(scene: Scene, engine: str, progress: Progress | None) -> Result:
    return _run(scene, engine, progress, seed=_coarser(scene, engine, 1.0))


def _coarser(scene: Scene, engine: str, share: float) -> bool:
    """Tell whether the run with `share` of the tolerance is the coarser of the two of a scene."""
    second = partner(scene, _loaded(engine)[0].order(scene))
    return second < 1 if share == 1 else share > 1


def _run(
    scene: Scene,
    engine: str,
    progress: Progress | None,
    share: float = 1.0,
    *,
    seed: bool = False,
) -> Result:
    """Make one run, with a tolerance `share` times that of the scene, and diagnose it.

    The other limits of steps are scaled so that their part of the error changes by the same factor.
    With `seed` the run starts off by rounding.
    """
    room, threads = _loaded(engine)
    limits = share ** (1 / room.order(scene)) if share != 1 else 1.0

    def of_stage(part: Scene, report: Progress | None) -> Result:
        made = room.run(retuned(part, share, limits), report, limits, seed=seed)
        return diagnosed(replace(made, scene=part))

    # Matrices are small: numpy's threads would mostly wait for each other.
    with deferrable_interrupts() as ctrl_c, threads.limit(limits=1, user_api="blas"):
        result = through_stages(scene, of_stage, progress)
    versions = {package: version_of(package) for package in (THIS, *room.PACKAGES)}
    versions["python"] = python_version()
    result = replace(result, versions=versions, error=unmeasured(result))
    if ctrl_c.pending and result.outcome.completed:
        raise LateInterruptError(result)
    return result


@cache
def _loaded(engine: str) -> tuple[ModuleType, ThreadpoolController]:
    """Import an engine, and control the threads of the libraries that it has loaded."""
    if engine not in ENGINES:
        raise ValueError(f"no engine '{engine}'; there is: {', '.join(ENGINES)}")
    return import_module(ENGINES[engine].module), ThreadpoolController()


def formulations(scene: Scene, engine: str) -> tuple[str, ...]:
    """Formulations in which an engine represents a scene, the one that `auto` means first.

    Empty where it offers no choice.

    Raises:
        SceneError: the scene can't be put together (never after `load_scene`).

    """
    offered = getattr(import_module(ENGINES[engine].module), "formulations", None)
    return () if offered is None else tuple(offered(scene))

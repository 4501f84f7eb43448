"""A neighbouring run tells how wrong a run is whose steps alone do not keep the tolerance.

It is of the same scene and engine, but more accurate: until both part the distance tells the error
of the run, after that it is the error. Two runs that bounced differently may come to rest alike by
chance, though both are wrong: see `alike_by_chance`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import inf, sqrt

from exudyn_flexlink.engines.diagnostics.amplification import aiming, multiplying
from exudyn_flexlink.engines.diagnostics.bursts import alike_by_chance
from exudyn_flexlink.engines.interrupts import LateInterruptError
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.mechanism import least_tolerance
from exudyn_flexlink.result import INTERRUPTED, NOT_MEASURED, MeasuredError, Result
from exudyn_flexlink.scene import FEWEST_STEPS_PER_CONTACT, Scene
from exudyn_flexlink.sensitivity import measured_error

# Errors of the neighbour's steps over those of the run's: a third more steps by a method of order
# 9, twice as many by one of order 2, whose errors a neighbour of a half told four times too small.
HIGH_ORDER, SECOND_ORDER = 0.1, 0.25
LOOSER = 10.0  # likewise, where the run is as accurate as rounding allows
MORE_STEPS = 1.15  # times those of the run, of a neighbour that is more accurate: 1.29 by order 9
MOST_AGAIN = 4  # tries of a neighbour that has them
NEAREST = 0.9  # ratio of steps' lengths: where they hardly differ, little is told of either run
NO_MEMORY = "there is not enough memory for a neighbouring run"
GAVE_UP = "the neighbouring run was interrupted"


@dataclass(frozen=True)
class Measured:
    """A run with its error; `neighbour` is what told it, None where the run had stopped."""

    result: Result
    neighbour: Result | None = None


def unmeasured(result: Result) -> Result:
    """Return a run that says so where only a neighbour can measure its error."""
    if not result.outcome.completed or not (multiplying(result) or aiming(result)):
        return result
    return replace(result, error=MeasuredError(missing=NOT_MEASURED))


def measured_by(result: Result, again: Callable[[Scene], Result]) -> Measured:
    """Measure the error of a run by a neighbour that `again` makes; one that stopped is left.

    Where the neighbour may be as wrong as the run, a second one is made, finer by as much again.

    Raises:
        LateInterruptError: the user interrupted the neighbour; the run, which is whole, is in it.

    """
    if not result.outcome.completed:
        return Measured(result)
    factor = neighbouring(result)
    try:
        neighbour, told = _measured(result, again, factor)
        if factor < 1 and alike_by_chance(result, neighbour, told):
            neighbour, told = _measured(result, again, factor**2)
    except KeyboardInterrupt as error:
        raise LateInterruptError(_with(result, MeasuredError(missing=GAVE_UP))) from error
    except MemoryError:
        return Measured(_with(result, MeasuredError(missing=NO_MEMORY)))
    return Measured(_with(result, told), neighbour)


def _measured(
    result: Result, again: Callable[[Scene], Result], factor: float
) -> tuple[Result, MeasuredError]:
    """Make a neighbour whose steps err `factor` times as much, and measure the error by it.

    Raises:
        KeyboardInterrupt: the user ended the neighbour.

    """
    neighbour = _finer(result, again, factor)
    if neighbour.outcome.reason == INTERRUPTED:
        raise KeyboardInterrupt
    of_forces = _of_forces(result, neighbour, factor)
    return neighbour, measured_error(result, neighbour, factor, of_forces)


def _finer(result: Result, again: Callable[[Scene], Result], factor: float) -> Result:
    """Make a neighbour by steps of its own.

    Where something else than errors bounds the steps, such as a turn or pieces of a curve, a
    tighter tolerance may leave them as they are. Then two runs agree, and tell nothing: another is
    made, ten times tighter. Such runs are short. Those that meet contacts have steps of their own.
    """
    asked = factor
    neighbour = again(retuned(result.scene, result, asked))
    if factor > 1 or "tolerance" not in result.settings or multiplying(result) or aiming(result):
        return neighbour
    for _ in range(MOST_AGAIN):
        more = neighbour.checks.steps >= MORE_STEPS * result.checks.steps
        if more or not neighbour.outcome.completed:
            break
        asked *= factor
        tighter = retuned(result.scene, result, asked)
        if tighter.accuracy == neighbour.scene.accuracy:
            break  # as accurate as rounding allows
        neighbour = again(tighter)
    return neighbour


def _of_forces(result: Result, neighbour: Result, factor: float) -> float:
    """Return the errors of the neighbour's forces over those of the run's.

    As those of steps; but by a method of order 2 forces of joints are of order 1 only, so that
    their errors are as the lengths of steps.
    """
    if not _second_order(result):
        return factor
    shorter = result.checks.steps / max(neighbour.checks.steps, 1)
    return min(shorter, NEAREST) if factor < 1 else max(shorter, 1 / NEAREST)


def _second_order(result: Result) -> bool:
    return bool({"steps_per_contact", "step"} & set(result.settings))


def neighbouring(result: Result) -> float:
    """Return the errors that a step of the neighbour may make, over those of the run's steps."""
    settings = result.settings
    finer = SECOND_ORDER if _second_order(result) else HIGH_ORDER
    least = least_tolerance(assemble_scene(result.scene))
    asked = float(settings.get("tolerance", inf))
    at_best = finer * asked < least * (1 - 1e-9)
    return LOOSER if at_best else finer


def retuned(scene: Scene, result: Result, factor: float) -> Scene:
    """Return the scene with steps that make errors `factor` times those of a run.

    Steps that are given, and those of a contact, are of a method of order 2, or better. A
    tolerance stays within what a scene may ask for.
    """
    settings = result.settings
    other: dict[str, float] = {}
    if "tolerance" in settings:
        least = least_tolerance(assemble_scene(scene))
        other["tolerance"] = max(least, factor * float(settings["tolerance"]))
    if "step" in settings:
        other["step"] = sqrt(factor) * float(settings["step"])
    given = scene.accuracy.model_dump(exclude_none=True)
    accuracy = type(scene.accuracy).model_validate(given | other)
    if "steps_per_contact" not in settings:
        return scene.changed(accuracy=accuracy)
    per_contact = round(float(settings["steps_per_contact"]) / sqrt(factor))
    steps = {"steps_per_contact": max(FEWEST_STEPS_PER_CONTACT, per_contact)}
    return scene.changed(accuracy=accuracy, solver=scene.solver.model_copy(update=steps))


def _with(result: Result, error: MeasuredError) -> Result:
    """Return a run with its error, and with warnings of what is too large, or not known."""
    told = [f"{text}{_why(result)}" for text in _told(error)]
    return replace(result, error=error, warnings=(*result.warnings, *told))


def _why(result: Result) -> str:
    if reason := multiplying(result):
        return f": errors multiply ({reason})"
    if reason := aiming(result):
        return f": its steps only aim at the tolerance ({reason})"
    return ""


def _told(error: MeasuredError) -> Iterator[str]:
    if error.missing:
        yield f"how far points are off was not measured: {error.missing}"
        return
    if error.exceeds_from is not None:
        yield (
            f"from t = {error.exceeds_from:.4g} s on points may be off by more than "
            f"{error.limit:.3g} m, {error.worst} in the end by {error.largest:.2g} m, as a "
            "neighbouring run shows"
        )
    if error.stopped is not None:
        yield (
            "how far points are off was measured up to "
            f"t = {error.stopped:.4g} s only, where the neighbouring run stopped"
        )

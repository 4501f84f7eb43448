"""A neighbouring run tells how wrong a run is whose steps alone do not keep the tolerance.

It is of the same scene and engine, but more accurate: until both part the distance tells the error
of the run, after that it is the error. Two runs that bounced differently may come to rest alike by
chance, though both are wrong: see `alike_by_chance`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import inf, sqrt

from exudyn_flexlink.engines.diagnostics.amplification import beyond_steps, rattled
from exudyn_flexlink.engines.diagnostics.bursts import alike_by_chance
from exudyn_flexlink.engines.interrupts import LateInterruptError
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.measured_error import NOT_MEASURED, MeasuredError
from exudyn_flexlink.mechanism import extent, least_tolerance
from exudyn_flexlink.result import INTERRUPTED, Result
from exudyn_flexlink.scene import FEWEST_STEPS_PER_CONTACT, Accuracy, Scene
from exudyn_flexlink.sensitivity import SCATTER, TOUCHED_SCATTER, measured_error

# Errors of the neighbour's steps over those of the run's: 1.8 times as many steps by order 9, twice
# as many by order 2, whose errors a neighbour of a half told four times too small. Where touches
# multiply them, errors are in proportion to those of steps only roughly: a tenth told 0.88 of 1.08
# tolerances, scene 289 of scripts/random_strikes.py --seed 11, which prints the least that is told.
HIGH_ORDER, SECOND_ORDER = 0.03, 0.25
# Of the mechanism's extent: error that is assumed of a run of given steps, for the tolerance of the
# neighbour that judges it. Where its error is smaller, what is told of it is at least as large.
CONTROLLED = 1e-6
LOOSER = 10.0  # likewise, where the run is as accurate as rounding allows
MORE_STEPS = 1.15  # times those of the run, of a neighbour that is more accurate
MOST_AGAIN = 3  # tries of a neighbour that has them: to a tolerance 1e-8 times as large
NEAREST = 0.9  # ratio of steps' lengths: where they hardly differ, little is told of either run
NO_MEMORY = "there is not enough memory for a neighbouring run"
GAVE_UP = "the neighbouring run was interrupted"
UNSURE = (
    "run and neighbouring run bounced differently before a point crept off its face, so that both "
    "may be equally wrong, and no finer run judged them"
)


@dataclass(frozen=True)
class Measured:
    """A run with its error; `neighbour` is what told it, None where the run had stopped."""

    result: Result
    neighbour: Result | None = None


def unmeasured(result: Result) -> Result:
    """Return a run that says so where only a neighbour can measure its error."""
    if not result.outcome.completed or not beyond_steps(result):
        return result
    return replace(result, error=MeasuredError(missing=NOT_MEASURED))


def measured_by(result: Result, again: Callable[[Scene], Result]) -> Measured:
    """Measure the error of a run by a neighbour that `again` makes; one that stopped is left.

    Where the neighbour may be as wrong as the run, a second one is made, finer by as much again.

    Raises:
        LateInterruptError: the user interrupted a neighbour; the run, which is whole, is in it,
            with what was measured before.

    """
    if not result.outcome.completed:
        return Measured(result)
    factor = neighbouring(result)
    neighbour: Result | None = None
    told: MeasuredError | None = None
    try:
        neighbour, asked = _finer(result, again, factor)
        told = _measured(result, neighbour, factor)
        if factor < 1 and alike_by_chance(result, neighbour, told):
            neighbour = _made(again, _judging(result, asked * factor))
            told = _measured(result, neighbour, factor**2)
    except KeyboardInterrupt as error:
        raise LateInterruptError(_broken_off(result, told, GAVE_UP)) from error
    except MemoryError:
        return Measured(_broken_off(result, told, NO_MEMORY), neighbour)
    return Measured(_with(result, told), neighbour)


def _measured(result: Result, neighbour: Result, factor: float) -> MeasuredError:
    """Measure the error by a neighbour whose steps err `factor` times as much."""
    scatter = TOUCHED_SCATTER if rattled(result) else SCATTER
    of_forces = _of_forces(result, neighbour, factor)
    return measured_error(result, neighbour, factor, of_forces, scatter)


def _finer(result: Result, again: Callable[[Scene], Result], factor: float) -> tuple[Result, float]:
    """Make a neighbour by steps of its own; also return what errors were asked of its steps.

    Where something else than errors bounds the steps, such as a turn or pieces of a curve, a
    tighter tolerance may leave them as they are. Then two runs agree, and tell nothing: others are
    made, each by the square of what was asked before, so that few are enough. They cost little
    more than the run itself. Runs that multiply errors have steps of their own.
    """
    asked, scene = factor, _judging(result, factor)
    neighbour = _made(again, scene)
    if factor > 1 or "tolerance" not in result.settings or beyond_steps(result):
        return neighbour, asked
    for _ in range(MOST_AGAIN):
        more = neighbour.checks.steps >= MORE_STEPS * result.checks.steps
        tighter = retuned(result.scene, result, asked**2)
        at_best = tighter.accuracy == scene.accuracy  # as accurate as rounding allows
        if more or at_best or not neighbour.outcome.completed:
            break
        asked, scene = asked**2, tighter
        neighbour = _made(again, scene)
    return neighbour, asked


def _made(again: Callable[[Scene], Result], scene: Scene) -> Result:
    """Make a run.

    Raises:
        KeyboardInterrupt: the user ended it.

    """
    run = again(scene)
    if run.outcome.reason == INTERRUPTED:
        raise KeyboardInterrupt
    return run


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
    return "steps_per_contact" in result.settings


def neighbouring(result: Result) -> float:
    """Return the errors that a step of the neighbour may make, over those of the run's steps."""
    settings = result.settings
    finer = SECOND_ORDER if _second_order(result) else HIGH_ORDER
    least = least_tolerance(assemble_scene(result.scene))
    asked = float(settings.get("tolerance", inf))
    at_best = finer * asked < least * (1 - 1e-9)
    return LOOSER if at_best else finer


def _judging(result: Result, factor: float) -> Scene:
    """Return the scene of a neighbour whose steps make errors `factor` times those of the run.

    Half of a step that is given may change nothing in minimal coordinates, where contacts, turns
    and pieces of curves bound steps, too: there it is error control that judges.
    """
    scene = result.scene
    if "step" not in result.settings or _second_order(result):
        return retuned(scene, result, factor)
    assembly = assemble_scene(scene)
    tolerance = max(least_tolerance(assembly), factor * CONTROLLED * extent(assembly))
    return scene.changed(accuracy=Accuracy(tolerance=tolerance))


def retuned(scene: Scene, result: Result, factor: float) -> Scene:
    """Return the scene with steps that make errors `factor` times those of a run.

    Steps that are given, and those of a contact, are of a method of order 2, or better. A
    tolerance stays within what a scene may ask for. It takes the place of a step that the run had
    no use for.
    """
    settings = result.settings
    other: dict[str, float] = {}
    if "tolerance" in settings:
        least = least_tolerance(assemble_scene(scene))
        other["tolerance"] = max(least, factor * float(settings["tolerance"]))
    if "step" in settings:
        other["step"] = sqrt(factor) * float(settings["step"])
    accuracy = Accuracy.model_validate(other) if other else scene.accuracy
    if "steps_per_contact" not in settings:
        return scene.changed(accuracy=accuracy)
    per_contact = round(float(settings["steps_per_contact"]) / sqrt(factor))
    steps = {"steps_per_contact": max(FEWEST_STEPS_PER_CONTACT, per_contact)}
    return scene.changed(accuracy=accuracy, solver=scene.solver.model_copy(update=steps))


def _broken_off(result: Result, told: MeasuredError | None, why: str) -> Result:
    """Return a run whose measuring ended early, with what a first neighbour `told`, if one did."""
    if told is None:
        return _with(result, MeasuredError(missing=why))
    measured = _with(result, told)
    return replace(measured, warnings=(*measured.warnings, f"{UNSURE}: {why}"))


def _with(result: Result, error: MeasuredError) -> Result:
    """Return a run with its error, and with warnings of what is too large, or not known."""
    why = beyond_steps(result)
    told = [f"{text}: {why}" if why else text for text in _told(error)]
    return replace(result, error=error, warnings=(*result.warnings, *told))


def _told(error: MeasuredError) -> Iterator[str]:
    if error.missing:
        yield f"how far points are off was not measured: {error.missing}"
        return
    if error.exceeds_from is not None:
        yield (
            f"from t = {error.exceeds_from:.4g} s on, points may be off by more than "
            f"{error.limit:.3g} m, and {error.worst} by up to {error.largest:.2g} m, as a "
            "neighbouring run with other steps shows"
        )
    if error.stopped is not None:
        yield (
            "how far points are off was measured up to "
            f"t = {error.stopped:.4g} s only, where the neighbouring run stopped"
        )

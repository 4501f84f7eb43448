"""A second, finer run tells how far the first one is off, and is the result.

Nothing predicts how a motion multiplies errors; two runs show it, whatever the reason is. They
can't show an error that both share, so the coarser one starts off by rounding. Without that, where
flights are exact, both runs round in the same way, and locate events equally late: their distance
is zero, while both leave the truth, tenfold from one round pin to the next.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.interrupts import LateInterruptError
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.mechanism import Assembly, extent, least_tolerance
from exudyn_flexlink.observables import error_between
from exudyn_flexlink.result import INTERRUPTED, NOT_ASKED, MeasuredError, Result
from exudyn_flexlink.rounding import UNIT_ROUNDING
from exudyn_flexlink.scene import FEWEST_STEPS_PER_CONTACT, Accuracy, Scene

SMALL = 1e-3  # of the largest length: a shorter one is not a lever arm
LATE = 1e-14  # s, about the error of an event's instant: events of the coarser run are later by it


def seeded(
    assembly: Assembly, start: tuple[FloatArray, FloatArray], lengths: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Coordinates and speeds (n,) at time 0, changed by rounding, with different signs and sizes.

    A unit of each coordinate moves a point by `lengths` (n,) m. A speed of zero stays zero.
    """
    q, v = start
    number = np.arange(len(q))
    sizes = 1 + number / (1 + len(q))
    ways = UNIT_ROUNDING * (-1.0) ** number * sizes
    lengths = np.maximum(lengths, SMALL * lengths.max(initial=1.0))
    return q + extent(assembly) * ways / lengths, v * (1 + ways)


# Tolerance of the finer run over that of the first. A method of order 2 would need three times as
# many steps for a tenth of the error; twice as many steps give a quarter of it.
FINER, SECOND_ORDER = 0.1, 0.25
STOPPED = "the run stopped before its end"
GIVEN_STEPS = "with 'accuracy.step' one run is made; 'accuracy.tolerance' measures its error"
NO_MEMORY = "there is not enough memory for a second run"
GAVE_UP = "the second run was interrupted"
AT_ONCE = "the second run stopped as it began"


def unmeasured(result: Result) -> MeasuredError:
    """Return a single run's error: not known, or `NOT_ASKED` if a second run may measure it."""
    if not result.outcome.completed:
        return MeasuredError(missing=STOPPED)
    given = result.scene.accuracy.tolerance is None
    return MeasuredError(missing=GIVEN_STEPS) if given else NOT_ASKED


def partner(scene: Scene, order: int) -> float:
    """Return the tolerance of the second run over that of the first, by a method of some order.

    The second run is the coarser one if rounding does not allow a finer one.
    """
    finer = SECOND_ORDER if order == 2 else FINER
    asked = scene.accuracy.tolerance or 0.0
    least = least_tolerance(assemble_scene(scene))
    return 1 / finer if finer * asked < least * (1 - 1e-9) else finer


def retuned(scene: Scene, share: float, limits: float) -> Scene:
    """Return a scene with a tolerance `share` times as large.

    Steps in contact, where their number is given, are `limits` times as long.
    """
    asked = scene.accuracy.tolerance
    if asked is None or share == 1:
        return scene
    steps = max(FEWEST_STEPS_PER_CONTACT, round(scene.solver.steps_per_contact / limits))
    solver = scene.solver.model_copy(update={"steps_per_contact": steps})
    return scene.changed(accuracy=Accuracy(tolerance=share * asked), solver=solver)


def measured_by(result: Result, again: Callable[[float], Result]) -> Result:
    """Return the more accurate of a run and a second one, with the error that both tell.

    `again` makes the second run, with a tolerance multiplied by its argument. If it stops before
    its end, the first one is measured up to there. A run that can't be measured is returned as it
    is.

    Raises:
        LateInterruptError: the user interrupted the second run; what is known is in it.

    """
    if result.error != NOT_ASKED:
        return result
    share, late = partner(result.scene, result.settings.integrator.order), False
    try:
        other = again(share)
    except LateInterruptError as error:  # the second run is complete
        other, late = error.result, True
    except KeyboardInterrupt as error:
        raise LateInterruptError(given_up(result)) from error
    except MemoryError:
        return _with_error(result, MeasuredError(missing=NO_MEMORY))
    best = _measured(result, other, share)
    if late or other.outcome.reason == INTERRUPTED:
        raise LateInterruptError(best)
    return best


def given_up(result: Result) -> Result:
    """Return a run without a known error, since the user did not wait for the second run."""
    return _with_error(result, MeasuredError(missing=GAVE_UP))


def _measured(first: Result, other: Result, share: float) -> Result:
    """Return the more accurate of two runs; `share` is the second's tolerance over the first's."""
    asked = first.scene.accuracy.tolerance
    assert asked is not None  # else nothing is measured
    if len(other.time) < 2:
        return _with_error(first, MeasuredError(missing=AT_ONCE))
    best, worse, tolerance = first, other, share * asked
    if share < 1 and other.outcome.completed:
        best, worse, tolerance = other, first, asked
    spent = {**best.timings, "second run": worse.timings.get("solve", 0.0)}
    error = error_between(best, worse, min(1.0, share) * asked, tolerance)
    return _with_error(replace(best, timings=spent), error)


def _with_error(result: Result, error: MeasuredError) -> Result:
    """Return a run with its error, and with warnings if it is too large or not known."""
    return replace(result, error=error, warnings=(*result.warnings, *_warnings(error)))


def _warnings(error: MeasuredError) -> Iterator[str]:
    if error.missing in (NO_MEMORY, GAVE_UP, AT_ONCE):
        yield f"how far points are off was not measured: {error.missing}"
    if error.exceeds_from is not None:
        horizon = error.horizon
        parted = "" if horizon is None else f"; after t = {horizon:.4g} s trust statistics only"
        yield (
            f"from t = {error.exceeds_from:.4g} s on, points may be off by more than "
            f"{error.limit:.3g} m, and {error.worst} by up to {error.largest:.2g} m, as a second "
            f"run with other steps shows{parted}"
        )
    if error.stopped is not None:
        yield (
            "how far points are off was measured up to "
            f"t = {error.stopped:.4g} s only, where the second run stopped"
        )

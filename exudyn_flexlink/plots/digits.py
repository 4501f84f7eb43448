"""Numbers in figures, with no more digits than are known."""

from __future__ import annotations

from math import ceil, floor, isfinite, log10

import numpy as np

from exudyn_flexlink.observables import path, watched_point
from exudyn_flexlink.result import Result

MOST = 4  # significant digits: more are never read off a figure
FINEST = 1e-4  # s: no instant is told finer in a figure
UNTOLD = 3  # significant digits where nothing tells the error


def told(value: float, error: float | None, *, signed: bool = False, most: int = MOST) -> str:
    """Return a number whose last digit is no smaller than `error`, in the same unit.

    At most `most` significant digits; three if the error is not known (None).
    """
    if value == 0:
        return "0"
    known = UNTOLD if error is None else most
    size = abs(value)
    place = known - 1 - floor(log10(size)) if size > 0 and isfinite(size) else known
    if error is not None and error > 0:
        place = min(place, floor(-log10(error)))
    place = max(place, 0)
    text = f"{round(value, place):{'+' if signed else ''}.{place}f}"
    if float(text) == 0:
        text = text.lstrip("+-")
    return text.replace("-", "\N{MINUS SIGN}")


def position_error(result: Result, time: float) -> float | None:
    """How far positions may be off at an instant, m; None where nothing tells.

    The largest error that a second run found up to then; without one the scene's tolerance.
    """
    error = result.error
    if error.missing:
        return result.scene.accuracy.tolerance
    if error.exceeds_from is not None and time < error.exceeds_from:
        return error.limit
    return error.largest if time < error.known_until else None


def told_time(result: Result, time: float) -> str:
    """Return an instant (s) as text: events near it are off by the error of positions over speed.

    To a tenth of a millisecond at best.
    """
    error = position_error(result, time)
    velocity = path(result, watched_point(result.scene)).velocity
    fastest = float(np.max(np.linalg.norm(velocity, axis=1)))
    if error is None or fastest == 0:
        return told(time, None)
    return told(time, max(error / fastest, FINEST), most=9)


def told_error(error: float) -> str:
    """Return an error as text: one significant digit, rounded up."""
    if not (error > 0 and isfinite(error)):
        return f"{error:g}"
    size = 10.0 ** floor(log10(error))
    most = ceil(error / size * (1 - 1e-9)) * size
    return f"{most:.0f}" if most >= 1 else f"{most:.1g}".replace("e-0", "e-")

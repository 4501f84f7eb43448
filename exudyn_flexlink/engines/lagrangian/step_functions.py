"""What steps ask of the mechanism: functions that the integration calls by address."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from exudyn_flexlink.engines.lagrangian.compiled import by_reference, compiled


class StepFunctions(NamedTuple):
    """Functions of these names, or where a mechanism has no such thing, what finds nothing."""

    rate_at: Callable[..., Any]
    slopes: Callable[..., Any]
    force_jumps: Callable[..., Any]
    before_step: Callable[..., Any]  # knots
    after_step: Callable[..., Any]
    change_within: Callable[..., Any]  # touches of link and guide
    uneventful: Callable[..., Any]


StepFunctionsByReference, step_functions_of = by_reference(
    StepFunctions, "StepFunctionsByReference", __name__
)


@compiled
def step_functions(  # noqa: PLR0913, PLR0917 - one of each
    rate_at: Callable[..., Any],
    slopes: Callable[..., Any],
    force_jumps: Callable[..., Any],
    before_step: Callable[..., Any],
    after_step: Callable[..., Any],
    change_within: Callable[..., Any],
    uneventful: Callable[..., Any],
) -> StepFunctions:
    """Record of functions, made once: handed over alone, each takes nine microseconds."""
    return step_functions_of(
        rate_at, slopes, force_jumps, before_step, after_step, change_within, uneventful
    )

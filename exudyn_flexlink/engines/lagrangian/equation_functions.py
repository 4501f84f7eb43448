"""What the equations call by address: functions that differ from mechanism to mechanism."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from exudyn_flexlink.engines.lagrangian.compiled import by_reference, compiled


class EquationFunctions(NamedTuple):
    """Functions of `equations` and `walls`, or where there are none, those of `absent`."""

    accelerations: Callable[..., Any]
    add_wall_forces: Callable[..., Any]
    take_wall_slopes: Callable[..., Any]
    add_wall_slopes: Callable[..., Any]
    depths_squared: Callable[..., Any]


EquationFunctionsByReference, equation_functions_of = by_reference(
    EquationFunctions, "EquationFunctionsByReference", __name__
)


@compiled
def equation_functions(
    accelerations: Callable[..., Any],
    add_wall_forces: Callable[..., Any],
    take_wall_slopes: Callable[..., Any],
    add_wall_slopes: Callable[..., Any],
    depths_squared: Callable[..., Any],
) -> EquationFunctions:
    """Record of functions: handed over as one, it takes a microsecond, and each alone nine."""
    return equation_functions_of(
        accelerations, add_wall_forces, take_wall_slopes, add_wall_slopes, depths_squared
    )

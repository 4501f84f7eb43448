"""Types of what is compiled before there are any values: each may be compiled by another process.

They are the same for all mechanisms.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from exudyn_flexlink.engines.lagrangian.compiled import numba, type_of
from exudyn_flexlink.engines.lagrangian.constants import Constants, ConstantsByReference
from exudyn_flexlink.engines.lagrangian.equation_functions import (
    EquationFunctions,
    EquationFunctionsByReference,
)
from exudyn_flexlink.engines.lagrangian.equations import Drive, State
from exudyn_flexlink.engines.lagrangian.event_functions import EventData
from exudyn_flexlink.engines.lagrangian.lengths import Scale, ScaleByReference
from exudyn_flexlink.engines.lagrangian.mode import Equations, Instant, Mode, ModeByReference
from exudyn_flexlink.engines.lagrangian.radau import work_for
from exudyn_flexlink.engines.lagrangian.step_control import Buffer, Control
from exudyn_flexlink.engines.lagrangian.step_functions import (
    StepFunctions,
    StepFunctionsByReference,
)
from exudyn_flexlink.engines.lagrangian.wall_events import Step
from exudyn_flexlink.integrate.collocation import RADAU


class _Arrays(NamedTuple):
    """Types of a number, of arrays of them by dimensions, and of integers in one."""

    number: Any
    line: Any
    square: Any
    cube: Any
    numbers: Any


@cache
def equation_signatures() -> EquationFunctions:
    """Signatures of the functions of equations of motion."""
    number, line, square, _, numbers = _arrays()
    point = _types().UniTuple(number, 6)
    placed, chain = _tuple(line, line, point), _tuple(line, number, line, line)
    forces = number(placed, numbers, chain, line)
    return EquationFunctions(
        _tuple(line, number, line, line, number)(
            _record(State, line, line, point),
            _record(Drive, _types().int64, number, line),
            _tuple(numbers, numbers, _types().FunctionType(forces)),
            _constants(),
        ),
        forces,
        _types().none(placed, numbers, chain, square),
        _types().none(placed, square, chain, _types().UniTuple(square, 2)),
        number(line, line, point, numbers, chain),
    )


@cache
def step_signatures() -> StepFunctions:
    """Signatures of the functions that steps ask of a mechanism."""
    number, line, square, _, numbers = _arrays()
    equations, instant = _equations(), _instant()
    changed = _tuple(number, _types().int64)
    scale = _by_reference(ScaleByReference, Scale, line, line, line, line, numbers, line)
    at_knots = (
        number,
        _tuple(line, number, line),
        _tuple(equations, scale),
        _tuple(line, square),
    )
    squares = _types().UniTuple(square, 2)
    return StepFunctions(
        changed(instant, equations, line, line),
        squares(instant, square, equations),
        _tuple(square, line)(
            instant, number, square, equations, _tuple(square, line, line, square, square)
        ),
        number(instant, *at_knots),
        number(_types().UniTuple(instant, 2), *at_knots),
        changed(_types().int64, _record(Step, instant, number, square, square), equations),
        _types().boolean(instant, instant, squares, equations, _event_data()),
    )


def advance_arguments() -> tuple[Any, ...]:
    """Types of the arguments of `advance`."""
    number, line, square, cube, _ = _arrays()
    return (
        number,
        _mode(),
        _tuple(
            type_of(RADAU),
            _record(Control, *[number] * 5, line, number),
            type_of(work_for(len(RADAU.nodes), 2, 1)),
        ),
        _event_data(),
        _record(Buffer, line, square, cube, line, line),
        _functions(StepFunctionsByReference, step_signatures()),
    )


def motions_arguments() -> tuple[Any, ...]:
    """Types of the arguments of `motions_at`."""
    _, line, square, _, _ = _arrays()
    return line, square, line, _mode(), _types().boolean


def _equations() -> Any:
    return _record(Equations, _mode(), _constants())


def _mode() -> Any:
    _, line, square, _, numbers = _arrays()
    functions = _functions(EquationFunctionsByReference, equation_signatures())
    fields = (line, line, line, line, square, numbers, numbers, functions)
    return _by_reference(ModeByReference, Mode, *fields)


def _constants() -> Any:
    number, line, square, _, _ = _arrays()
    fields = Constants(
        couplings=square,
        firsts=line,
        mass=number,
        inertias=line,
        stiffness=square,
        damping=square,
        preload=line,
        moments=square,
        gravity=line,
        faces=square,
        arms=square,
        rods=line,
        track_coordinate=number,
        lengths=line,
        channel=line,
    )
    return _by_reference(ConstantsByReference, Constants, *fields)


def _event_data() -> Any:
    _, line, square, _, numbers = _arrays()
    return _record(EventData, numbers, line, line, line, square)


def _instant() -> Any:
    number, line, _, _, _ = _arrays()
    return _record(Instant, number, line, number)


def _functions(kind: Any, signatures: EquationFunctions | StepFunctions) -> Any:
    pointers = [_types().FunctionType(signature) for signature in signatures]
    return _by_reference(kind, type(signatures), *pointers)


def _by_reference(kind: Any, record: Callable[..., Any], *fields: Any) -> Any:
    return kind(list(zip(record._fields, fields, strict=True)))  # type: ignore[attr-defined]


def _record(record: Callable[..., Any], *fields: Any) -> Any:
    return _types().NamedTuple(fields, record)


def _tuple(*fields: Any) -> Any:
    return _types().Tuple(fields)


@cache
def _arrays() -> _Arrays:
    line, square, cube = (type_of(np.zeros((1,) * dimensions)) for dimensions in (1, 2, 3))
    return _Arrays(line.dtype, line, square, cube, type_of(np.zeros(1, np.int64)))


def _types() -> Any:
    assert numba is not None
    return numba.types

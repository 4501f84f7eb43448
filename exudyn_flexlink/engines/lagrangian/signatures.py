"""Types of what is compiled before there are any values: each may be compiled by another process.

They are the same for all mechanisms.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from exudyn_flexlink.engines.lagrangian.advance import Means, MeansByReference
from exudyn_flexlink.engines.lagrangian.compiled import numba
from exudyn_flexlink.engines.lagrangian.constants import Constants, ConstantsByReference
from exudyn_flexlink.engines.lagrangian.equations import Drive, State
from exudyn_flexlink.engines.lagrangian.event_functions import EventData, Step
from exudyn_flexlink.engines.lagrangian.lengths import Scale, ScaleByReference
from exudyn_flexlink.engines.lagrangian.mode import Instant, Mode, ModeByReference
from exudyn_flexlink.engines.lagrangian.radau import Aim
from exudyn_flexlink.engines.lagrangian.step_arrays import (
    MethodByReference,
    Work,
    WorkByReference,
    work_for,
)
from exudyn_flexlink.engines.lagrangian.step_control import Buffer, Control
from exudyn_flexlink.integrate.collocation import RADAU, Collocation


@cache
def equation_signatures() -> tuple[Any, ...]:
    """Signatures of the functions of equations of motion, the last fields of a `Mode`."""
    number, line, square, _, numbers = _arrays()
    point = numba.types.UniTuple(number, 6)
    placed, constants = _tuple(line, line, point), _constants()
    forces = number(placed, numbers, constants, line)
    return (
        _tuple(number, point, numba.types.int64)(
            line, numba.types.UniTuple(number, 2), number, number
        ),
        _tuple(line, number, line, line, number)(
            _record(State, line, line, point),
            _record(Drive, numba.types.int64, number, line),
            _tuple(numbers, numbers, numba.types.FunctionType(forces)),
            constants,
        ),
        forces,
        numba.types.none(placed, numbers, constants, square),
        numba.types.none(placed, square, constants, numba.types.UniTuple(square, 2)),
        number(line, line, point, numbers, constants),
    )


@cache
def step_signatures() -> tuple[Any, ...]:
    """Signatures of the functions that steps of a mechanism call, the last fields of `Means`."""
    number, line, square, _, numbers = _arrays()
    mode, instant, method, work = _mode(), _instant(), _method(), _work()
    whole = numba.types.int64
    changed = _tuple(number, whole)
    rate_at = changed(instant, mode, line, line)
    scale = _by_reference(ScaleByReference, Scale, line, line, line, line, numbers, line)
    step = _record(Step, instant, number, square, square)
    return (
        changed(whole, step, mode),
        numba.types.none(number, square, square, method, work),
        _tuple(whole, whole, number)(
            instant,
            number,
            numba.typeof(Aim(0.0, 0.0, 0.0)),
            mode,
            _tuple(method, scale, work, numba.types.FunctionType(rate_at)),
        ),
        rate_at,
        numba.types.UniTuple(square, 2)(instant, square, mode),
        _tuple(square, line)(instant, number, square, mode, _tuple(method, work)),
        number(
            numba.types.UniTuple(instant, 2),
            number,
            _tuple(line, number, line),
            _tuple(mode, scale),
            method,
        ),
        numba.types.boolean(step, instant, mode, _event_data()),
    )


def advance_arguments() -> tuple[Any, ...]:
    """Types of the arguments of `advance`."""
    number, line, square, cube, _ = _arrays()
    buffer = _record(Buffer, line, square, cube, line)
    return number, _mode(), _means(), _event_data(), buffer


def motions_arguments() -> tuple[Any, ...]:
    """Types of the arguments of `motions_at`."""
    _, line, square, _, _ = _arrays()
    return line, square, line, _mode(), numba.types.boolean


def wall_arguments() -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """Types of the arguments of `wall_forces` and of `wall_work`."""
    _, _, square, _, numbers = _arrays()
    motion = square, square, square
    return (*motion, _constants()), (*motion, numbers, _constants())


def _mode() -> Any:
    _, line, square, _, numbers = _arrays()
    fields = (_constants(), line, line, line, square, numbers, numbers)
    return _by_reference(ModeByReference, Mode, *fields, *_pointers(equation_signatures()))


def _means() -> Any:
    number, line, _, _, _ = _arrays()
    control = _record(Control, *[number] * 4, line, number)
    fields = (_method(), control, _work(), line)
    return _by_reference(MeansByReference, Means, *fields, *_pointers(step_signatures()))


def _method() -> Any:
    return _by_reference(MethodByReference, Collocation, *map(numba.typeof, RADAU))


def _work() -> Any:
    return _by_reference(
        WorkByReference, Work, *map(numba.typeof, work_for(len(RADAU.nodes), 2, 1))
    )


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
    return _record(EventData, numbers, numbers, line, line, square)


def _instant() -> Any:
    number, line, _, _, _ = _arrays()
    return _record(Instant, number, line, number)


def _pointers(signatures: tuple[Any, ...]) -> list[Any]:
    return [numba.types.FunctionType(signature) for signature in signatures]


def _by_reference(kind: Any, record: Callable[..., Any], *fields: Any) -> Any:
    return kind(list(zip(record._fields, fields, strict=True)))  # type: ignore[attr-defined]


def _record(record: Callable[..., Any], *fields: Any) -> Any:
    return numba.types.NamedTuple(fields, record)


def _tuple(*fields: Any) -> Any:
    return numba.types.Tuple(fields)


@cache
def _arrays() -> tuple[Any, ...]:
    """Types of a number, of arrays of them by dimensions (1, 2, 3), and of integers in one."""
    line, square, cube = (numba.typeof(np.zeros((1,) * dimensions)) for dimensions in (1, 2, 3))
    return line.dtype, line, square, cube, numba.typeof(np.zeros(1, np.int64))

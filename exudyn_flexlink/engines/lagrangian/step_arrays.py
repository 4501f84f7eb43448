"""What a step is made by and in, handed on as addresses: the method's numbers, and arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray, IntArray
from exudyn_flexlink.engines.lagrangian.compiled import (
    borrowed,
    by_reference,
    compiled,
    for_python,
)
from exudyn_flexlink.integrate.collocation import Collocation as Method


class Work(NamedTuple):
    """Arrays of a step of s stages from a state of `size` numbers, f of them coordinates."""

    speeds: FloatArray  # W, (s, f)
    states: FloatArray  # (s, size)
    rates: FloatArray  # (s, size)
    begin: FloatArray  # (size,): rate at the step's start
    real: FloatArray  # (f, f) factors
    pairs: ComplexArray  # ((s - 1)/2, f, f) factors
    rows: IntArray  # (1 + (s - 1)/2, f)
    near: FloatArray  # (s,): places of P at the stages
    way: FloatArray  # (1 + s, 4): P and its velocity at the step's start and at the stages


WorkByReference, work_of = by_reference(Work, "WorkByReference", __name__)
MethodByReference, method_of = by_reference(Method, "MethodByReference", __name__)


@compiled
def _work_given(fields: tuple[Any, ...]) -> Work:
    return work_of(*borrowed(fields))


@compiled
def _method_given(fields: tuple[Any, ...]) -> Method:
    return method_of(*borrowed(fields))


work_made, method_made = for_python(_work_given), for_python(_method_given)


def work_for(stages: int, size: int, free: int) -> Work:
    """Fresh arrays."""
    pairs = (stages - 1) // 2
    return Work(
        np.zeros((stages, free)),
        np.zeros((stages, size)),
        np.zeros((stages, size)),
        np.zeros(size),
        np.zeros((free, free)),
        np.zeros((pairs, free, free), dtype=np.complex128),
        np.zeros((1 + pairs, free), dtype=np.int64),
        np.zeros(stages),
        np.zeros((1 + stages, 4)),
    )

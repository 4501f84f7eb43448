"""Steps in which nothing happens, such that the run goes on before all is known of them.

To find the coordinates that follow others takes nearly as long for one instant as for a hundred:
samples in such steps, and in closed loops their ends, too, wait, and are found together.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeState
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.integrate.within import Within

AT_ONCE = 128  # instants that are found together: more take memory, and little less time


class _Waiting(NamedTuple):
    """A step, of this number in its block, samples (n,) in it, s, and whether its end waits."""

    row: int
    step: Step
    t: FloatArray
    with_end: bool


class Found(NamedTuple):
    """Steps of a block by their numbers, with their `ends`; samples `t` (n,), s, within steps.

    `rows` (n,) are the steps in which samples are, `parts` (n,) those after which they are, and
    `within` their coordinates.
    """

    steps: IndexArray
    ends: TreeState
    t: FloatArray
    rows: IndexArray
    parts: FloatArray
    within: TreeState


class QuietSteps:
    """Those that wait."""

    def __init__(self, model: MinimalModel) -> None:
        self._model = model
        self._waiting: list[_Waiting] = []
        self._count = 0

    def add(self, row: int, step: Step, samples: FloatArray, with_end: bool) -> None:
        """Let samples (n,), s, in a step wait, and its end if asked; `row` is its number."""
        instants = np.append(samples, step.end) if with_end else samples
        if len(instants):
            instants = self._model.window.all_inside(instants)
            self._waiting.append(_Waiting(row, step, instants, with_end))
            self._count += len(instants)

    @property
    def full(self) -> bool:
        """Whether there are enough."""
        return self._count > AT_ONCE

    def find(self) -> Found | None:
        """Find all of them, which no longer wait then; None if there are none."""
        if not self._waiting:
            return None
        rows, steps, instants, with_end = zip(*self._waiting, strict=True)
        self._waiting, self._count = [], 0
        counts = np.array([len(own) for own in instants])
        at = Within(steps, np.repeat(np.arange(len(steps)), counts), np.concatenate(instants))
        state = self._model.coordinates.states_within(at)
        last = (np.cumsum(counts) - 1)[list(with_end)]
        ends = np.zeros(len(at.t), dtype=bool)
        ends[last] = True
        of, inner = np.array(rows)[at.which], ~ends
        return Found(
            of[ends], state.pick(ends), at.t[inner], of[inner], at.parts[inner], state.pick(inner)
        )

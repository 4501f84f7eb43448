"""The state at the end of one step, as the solver's loop hands it on."""

from __future__ import annotations

from dataclasses import dataclass

from exudyn_flexlink.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class StepEnd:
    """Time (s), length of the step that ended there (s), coordinates and velocities.

    `q` and `v` are the solver's coordinates; `q_list` and `v_list` those of all parts, one after
    the other: plain lists are faster where a few numbers are needed.
    """

    time: float
    step: float
    q: FloatArray
    v: FloatArray
    q_list: list[float]
    v_list: list[float]

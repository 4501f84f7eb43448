"""What the runs of a study leave behind, and what makes them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import log

from exudyn_flexlink.accuracy.methods import Method, own_method, own_value
from exudyn_flexlink.accuracy.sources import Finer
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene

SAME = 1e-6  # between logarithms of settings: rounding


class RefusedError(Exception):
    """A method can't represent the scene; the message says why."""


@dataclass(frozen=True)
class Solved:
    """One run, and processor time of the solve, s; `given_up`: stopped after the time allowed."""

    result: Result
    processor: float
    given_up: bool = False


Solve = Callable[[Scene, str, str, float], Solved]
"""Runs a scene in an engine; a label says what is run, the number is the time (s) it may take.

Raises RefusedError, and KeyboardInterrupt when the user has had enough.
"""


@dataclass
class Trial:
    """A method at one value of its knob: its first result, processor times (s) of all runs."""

    method: Method
    value: float
    result: Result
    times: list[float]

    @property
    def told(self) -> str:
        """The trial in words."""
        return self.method.told(self.value)

    @property
    def processor(self) -> float:
        """The least processor time, s."""
        return min(self.times)


@dataclass(frozen=True)
class Varied:
    """A run of the scene made finer in one source of error, and that of the scene itself."""

    finer: Finer
    result: Result
    base: Trial
    processor: float


@dataclass
class Runs:
    """All that was run: `trials` of methods, `varied` in sources of error.

    `left_out` says of what did not come to its end why: it was refused, failed, or took too long.
    """

    scene: Scene
    target: float
    methods: list[Method]
    trials: list[Trial] = field(default_factory=list)
    reference: Trial | None = None
    varied: list[Varied] = field(default_factory=list)
    left_out: dict[str, str] = field(default_factory=dict)
    interrupted: bool = False
    spent: float = 0.0

    def of(self, method: Method) -> list[Trial]:
        """Trials of a method, finest first."""
        return sorted((t for t in self.trials if t.method == method), key=lambda t: t.value)

    def has(self, method: Method, value: float) -> bool:
        """Whether a method was run at a value, or one equal to it but for rounding."""
        return any(abs(log(value / trial.value)) < SAME for trial in self.of(method))

    @property
    def own(self) -> Trial | None:
        """The trial at the model's own settings; None if it could not be made."""
        method = own_method(self.scene, self.methods)
        value = own_value(self.scene, method)
        return next((t for t in self.of(method) if t.value == value), None)

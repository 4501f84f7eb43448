"""What the runs of a study leave behind, and what makes them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import log
from typing import Protocol

from exudyn_flexlink.accuracy.methods import Method, own_method, own_value
from exudyn_flexlink.accuracy.sources import Finer
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene

SLOPES = {"tolerance": 0.5, "step": 1.0}
"""How cost grows as a knob is turned down, before two runs show it: a second-order method."""
STEEPEST = 1.0
SAME = 1e-6  # between logarithms of settings: rounding


class RefusedError(Exception):
    """A method can't represent the scene; the message says why."""


@dataclass(frozen=True)
class Solved:
    """One run: processor time of the solve and wall time of all of it, s.

    `given_up`: stopped because it would have taken longer than allowed; `wall` is then the estimate
    of what it would have taken.
    """

    result: Result
    processor: float
    wall: float
    given_up: bool = False


class Solve(Protocol):
    """Runs a scene in an engine; `label` says what is run, `allowed` (s) is the time it may take.

    Raises RefusedError, and KeyboardInterrupt when the user has had enough.
    """

    def __call__(self, scene: Scene, engine: str, label: str, allowed: float) -> Solved:
        """Return the run."""
        ...


@dataclass
class Trial:
    """A method at one value of its knob: its first result, processor times (s) of all runs."""

    method: Method
    value: float
    scene: Scene
    result: Result
    wall: float
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
    """All that was run: `trials` of methods, `varied` in sources of error; what was not, why."""

    scene: Scene
    target: float
    methods: list[Method]
    trials: list[Trial] = field(default_factory=list)
    reference: Trial | None = None
    varied: list[Varied] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    refused: dict[str, str] = field(default_factory=dict)
    failed: dict[str, str] = field(default_factory=dict)
    interrupted: bool = False
    spent: float = 0.0

    def of(self, method: Method) -> list[Trial]:
        """Trials of a method, finest first."""
        return sorted((t for t in self.trials if t.method == method), key=lambda t: t.value)

    def costs(self, method: Method) -> dict[float, float]:
        """Processor times (s) of a method's runs, by the value of its knob."""
        return {trial.value: trial.processor for trial in self.of(method)}

    def has(self, method: Method, value: float) -> bool:
        """Whether a method was run at a value, or one equal to it but for rounding."""
        return any(abs(log(value / other)) < SAME for other in self.costs(method))

    @property
    def slowness(self) -> float:
        """Wall time over processor time so far: a machine may be shared."""
        used = sum(trial.times[0] for trial in self.trials)
        return max(sum(trial.wall for trial in self.trials) / used, 1.0) if used > 0 else 1.0

    @property
    def own(self) -> Trial | None:
        """The trial at the model's own settings; None if it could not be made."""
        method = own_method(self.scene, self.methods)
        value = own_value(self.scene, method)
        return next((t for t in self.of(method) if t.value == value), None)


def predict(costs: Mapping[float, float], value: float, knob: str = "tolerance") -> float:
    """Cost (s) at a knob's value from costs at other values: a power law through the two finest.

    A coarser run costs no more than a finer one; the nearest is taken for it.
    """
    slope = SLOPES[knob]
    if len(costs) > 1:
        fine, coarse = sorted(costs)[:2]
        found = log(costs[fine] / costs[coarse]) / log(coarse / fine)
        slope = min(max(found, 0.0), STEEPEST)
    nearest = min(costs, key=lambda known: abs(log(known / value)))
    return float(costs[nearest] * max(nearest / value, 1.0) ** slope)

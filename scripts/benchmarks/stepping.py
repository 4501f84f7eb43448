"""Processor time of one step: of a long run less that of a short one, over the steps between."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import count

from benchmarks.measuring import timed
from exudyn_flexlink import Result, Scene, simulate
from exudyn_flexlink.scene import Run

SHORT = 0.1  # of the long run: what is left is preparing and finishing
# s of processor time of each long run: the best of less is noise if one takes 0.05 s.
ENOUGH = 2.0


@dataclass(frozen=True)
class Stepped:
    """What one step costs (s), and the steps of the long run."""

    cost: float
    steps: int


def lasting(scene: Scene, duration: float) -> Scene:
    """The scene for another duration (s), sampled coarsely."""
    return scene.changed(run=Run(duration=duration, sample=duration / 10))


def completed(result: Result) -> Result:
    """The result of a run that reached its end.

    Raises:
        RuntimeError: it stopped early.

    """
    if not result.outcome.completed:
        raise RuntimeError(f"{result.engine}: {result.outcome.reason}")
    return result


def cost_per_step(
    cases: Mapping[str, tuple[str, Scene]], durations: Mapping[str, float], repeat: int
) -> dict[str, Stepped]:
    """Cost of a step of each case, an engine and a scene, measured in turn.

    `durations` (s) are those of the long runs, by case. The best of `repeat` rounds counts, or of
    more until the quickest long run has taken `ENOUGH`: all runs in each, since quiet spells of a
    machine must serve all.
    """
    runs: dict[str, Callable[[], Result]] = {}
    for name, (engine, scene) in cases.items():
        for which, part in (("long", 1.0), ("short", SHORT)):
            short = lasting(scene, part * durations[name])
            # Steps of a second run, which measures errors, are not counted.
            runs[f"{name}/{which}"] = partial(simulate, short, engine, measure=False)
    best: dict[str, float] = {}
    steps: dict[str, int] = {}
    for made in count():
        if made >= repeat and made * min(best[f"{name}/long"] for name in cases) > ENOUGH:
            break
        for name, run in runs.items():
            result, cost = timed(run)
            best[name] = min(best.get(name, cost), cost)
            steps[name] = completed(result).checks.steps
    return {
        name: Stepped(
            (best[f"{name}/long"] - best[f"{name}/short"])
            / max(1, steps[f"{name}/long"] - steps[f"{name}/short"]),
            steps[f"{name}/long"],
        )
        for name in cases
    }

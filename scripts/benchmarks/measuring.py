"""Processor times measured interleaved, ladders of settings, and ratios at the same error."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import ceil, exp, floor, log, log10
from time import process_time
from typing import TypeVar

import numpy as np

Value = TypeVar("Value")
Key = TypeVar("Key", bound=Hashable)
Run = Callable[[float], tuple[float, int]]
"""Error (m) and number of steps of a run at a setting."""

LONG = 8.0  # s: a run this long averages over disturbances by itself, and is not repeated


@dataclass(frozen=True)
class Measured:
    """One run: what it was set to, the error it made (m) and what it cost (processor time, s)."""

    setting: float
    error: float
    cost: float
    steps: int = 0


@dataclass(frozen=True)
class Table:
    """Rows of text under a title, and what they say in one sentence."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    conclusion: str

    def __str__(self) -> str:
        """The table as Markdown, its title and its conclusion in bold."""
        rows = (self.columns, ("---",) * len(self.columns), *self.rows)
        lines = [f"**{self.title}**", "", *(f"| {' | '.join(row)} |" for row in rows), ""]
        return "\n".join([*lines, f"**{self.conclusion}**", ""] if self.conclusion else lines)


def timed(run: Callable[[], Value]) -> tuple[Value, float]:
    """What a run returns, and its processor time in s."""
    began = process_time()
    value = run()
    return value, process_time() - began


def interleaved(
    runs: Mapping[Key, Callable[[], object]],
    repeat: int,
    known: Mapping[Key, float] | None = None,
) -> dict[Key, float]:
    """Least processor time (s) of each run, measured in turn: A B A B and so on.

    So what disturbs the machine for a while disturbs all of them. `known` are times measured
    before; runs longer than `LONG` that are known already are not repeated.
    """
    best = dict(known or {})
    for _ in range(repeat):
        for name, run in runs.items():
            if best.get(name, 0.0) < LONG:
                best[name] = min(best.get(name, float("inf")), timed(run)[1])
    return best


def ladder(first: float, last: float = 1e-13) -> Iterator[float]:
    """Settings 1, 5, 2 of each decade from `first` down to `last`: 1e-3, 5e-4, 2e-4, 1e-4 ..."""
    for decade in range(ceil(log10(first)), floor(log10(last)) - 1, -1):
        for mantissa in (1.0, 0.5, 0.2):
            rung = float(f"{mantissa * 10.0**decade:.1e}")
            if last * (1 - 1e-9) <= rung <= first * (1 + 1e-9):
                yield rung


def loosest(points: Sequence[Measured], error: float) -> Measured | None:
    """The cheapest run whose error is at most `error`; None if there is none.

    That is the one of the fewest steps: the time of a single run is noise.
    """
    good = [point for point in points if point.error <= error]
    return min(good, key=lambda point: (point.steps, point.cost)) if good else None


def climb(run: Run, rungs: Iterable[float], error: float, budget: float) -> list[Measured]:
    """Measure rung by rung until one makes at most `error` (m), or takes more than `budget` (s)."""
    points: list[Measured] = []
    for rung in rungs:
        (made, steps), cost = timed(partial(run, rung))
        points.append(Measured(rung, made, cost, steps))
        if made <= error or cost > budget:
            break
    return points


def cheapest(
    runs: Mapping[str, Run],
    rungs: Mapping[str, Iterable[float]],
    errors: Sequence[float],
    budget: float,
) -> dict[tuple[str, float], Measured]:
    """The cheapest run at each of some errors (m), by name and error; without those not reached.

    `budget` (s) ends the climb of a ladder, see `climb`.
    """
    climbed = {name: climb(run, rungs[name], min(errors), budget) for name, run in runs.items()}
    found = {(name, e): loosest(points, e) for name, points in climbed.items() for e in errors}
    return {key: point for key, point in found.items() if point}


def repeated(
    runs: Mapping[str, Callable[[float], object]],
    points: Mapping[tuple[str, float], Measured],
    repeat: int,
) -> dict[tuple[str, float], Measured]:
    """Points, by the name of their run and what else they are told by, with their least costs.

    Each setting of a run is measured again in turn with all others, see `interleaved`.
    """
    known = {(name, point.setting): point.cost for (name, _), point in points.items()}
    again = {(name, setting): partial(runs[name], setting) for name, setting in known}
    best = interleaved(again, repeat, known)
    return {
        (name, what): replace(point, cost=best[name, point.setting])
        for (name, what), point in points.items()
    }


def cost_at(points: Sequence[Measured], error: float) -> tuple[float, bool]:
    """Cost (s) at an error, on straight lines through the points in log-log; whether it is beyond.

    Beyond the points the line of the two nearest goes on.

    Raises:
        ValueError: there are fewer than two points.

    """
    if len(points) < 2:
        raise ValueError("a line needs two points")
    ranked = sorted(points, key=lambda point: -point.error)
    inside = [i for i, point in enumerate(ranked) if point.error <= error]
    after = min(max(inside[0] if inside else len(ranked) - 1, 1), len(ranked) - 1)
    one, other = ranked[after - 1], ranked[after]
    beyond = not ranked[-1].error <= error <= ranked[0].error
    part = (log(error) - log(one.error)) / (log(other.error) - log(one.error))
    return exp(log(one.cost) + part * (log(other.cost) - log(one.cost))), beyond


def exponent(sizes: Sequence[float], costs: Sequence[float]) -> float:
    """Exponent p of the least-squares fit ``cost ~ size^p``."""
    return float(np.polyfit(np.log(sizes), np.log(costs), 1)[0])

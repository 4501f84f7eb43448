"""What a hard case is: a model, in which variants and ways it is run, and what must come out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from exudyn_flexlink.result import Result

MODELS = Path(__file__).parents[2] / "models" / "hard"

MINIMAL, REDUNDANT, LAGRANGIAN = "minimal", "redundant", "lagrangian"
BOTH = (MINIMAL, LAGRANGIAN)
EXUDYN = (MINIMAL, REDUNDANT)
ALL = (MINIMAL, REDUNDANT, LAGRANGIAN)


@dataclass(frozen=True)
class Variant:
    """One setting of a hard case.

    `refused` are parts of documented reasons where the run has to end early or not to begin;
    `told` parts of the warnings of which one has to be there where the answer is not right. Those
    not `quick` take long.
    """

    label: str
    settings: tuple[str, ...] = ()
    refused: tuple[str, ...] = ()
    told: tuple[str, ...] = ()
    quick: bool = False
    ways: tuple[str, ...] = ()  # in place of the case's
    points: int = 0  # of a spline, written anew


@dataclass(frozen=True)
class Case:
    """One hard case.

    `truth` returns the deviation (m) of a result from a closed form; None: the other engine at a
    tight tolerance judges. `properties` are tried with the first variant: mirror, scale, again,
    finer.
    """

    name: str
    says: str
    variants: tuple[Variant, ...]
    ways: tuple[str, ...] = BOTH
    truth: Callable[[Result], float] | None = None
    properties: tuple[str, ...] = ()


def over(
    key: str, values: tuple[str, ...], quick: tuple[str, ...] = (), **other: object
) -> tuple[Variant, ...]:
    """Variants of a case, one for each value of a key; `quick` are some of the values."""
    short = key.rsplit(".", maxsplit=1)[-1]
    return tuple(
        Variant(f"{short} {value}", (f"{key}={value}",), quick=value in quick, **other)  # type: ignore[arg-type]
        for value in values
    )


PLAIN = (Variant("", quick=True),)

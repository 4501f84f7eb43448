"""A scene drawn at random, with the closed form of its motion; what to draw again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from string import Template
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray

Rng = np.random.Generator
HEAD = "title: $title\nrun: {duration: $end}\naccuracy: {tolerance: $tolerance}\noutputs: {watch: $at}"


class GrazeError(Exception):
    """A draw that passes what it may touch, or all but turns back, nearer than can be told."""


@dataclass(frozen=True)
class Drawn:
    """A model file, and where its point `at` is: complex places (n,), m, at instants (n,), s.

    Up to the instant `quiet` (s) nothing may be told of errors.
    """

    model: str
    at: str
    right: Callable[[FloatArray], ComplexArray]
    quiet: float = 0.0


def drawn(
    template: str, at: str, right: Callable[[FloatArray], ComplexArray], quiet: float = 0.0, **names: Any
) -> Drawn:
    """Write a model file by its template and the names in it."""
    return Drawn(Template(HEAD + template).substitute(names, at=at), at, right, quiet)


def until_clear(draw: Callable[[Rng], Drawn], rng: Rng) -> Drawn:
    """Draw again what is a graze."""
    while True:
        try:
            return draw(rng)
        except GrazeError:
            continue

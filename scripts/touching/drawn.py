"""A scene drawn at random, with the closed form of its motion; what to draw again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from string import Template
from typing import Any

import numpy as np
from drawing.parts import spread, within

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


def pair(place: complex) -> list[float]:
    """Return coordinates, as a model file has them."""
    return [float(place.real), float(place.imag)]


def turned(angle: float) -> complex:
    """Return the unit vector at an angle (rad)."""
    return complex(np.exp(1j * angle))


def just_off(rng: Rng) -> float:
    """Draw a part, of what two have from each other as they touch: they all but do, or just."""
    return float(1 + rng.choice([-1, 1]) * spread(rng, 1e-4, 0.9))


def returned(rng: Rng, least: float = 0.0) -> float:
    """Draw how much of its speed a strike gives back: all of it, or a part."""
    return float(rng.choice([1, within(rng, least, 1)]))

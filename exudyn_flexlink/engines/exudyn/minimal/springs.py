"""All springs and dampers of a tree: at its joints, across several of them, and between points.

Of a spring between two points let d be from its first to its second end (complex, global axes), d'
its rate, J its derivatives by the coordinates. With stiffness k, damping c and length L it pulls
its second end by

    F = -T n,  T = k (|d| - L) + c (n . d'),  n = d / |d|;      L = 0:  F = -k d - c d',

so that Q = J . F. Along a slide n is the direction of its line, which turns with the first part,
and |d| is n . d.
"""

from __future__ import annotations

from cmath import rect
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.engines.exudyn.minimal.kinematics import LinkKinematics, Places, Points, falls
from exudyn_flexlink.mechanism import Anchor, LinearSpring, Mechanism, RotarySpring, Slide
from exudyn_flexlink.mechanism.tree import TreeLayout

MEETING = 1e-300  # m: where both ends meet there is no direction, no derivative, and no force


class Stretched(NamedTuple):
    """Pairs of points at some instants, (..., pairs) each: `between` them is a vector, m.

    `size` (m) is how far they are apart in the direction `along`, and `moved` (..., pairs, links)
    are the derivatives J of `between`.
    """

    between: ComplexArray
    along: ComplexArray
    size: FloatArray
    moved: ComplexArray


class Stretches:
    """Pairs of points, and how far they are apart; along a slide that has a sign."""

    def __init__(
        self,
        layout: TreeLayout,
        kinematics: LinkKinematics,
        pairs: Sequence[tuple[Anchor, Anchor, Slide | None]],
    ) -> None:
        self._kinematics = kinematics
        self.first = Points(layout, [first for first, _, _ in pairs])
        self.second = Points(layout, [second for _, second, _ in pairs])
        self._line = np.array([_line_of(layout, slide) for _, _, slide in pairs], dtype=complex)
        self.slides = self._line != 0

    def look(self, at: Places) -> Stretched:
        """Look at links (..., links + 1)."""
        between = self.second.places(at) - self.first.places(at)
        moved = self._kinematics.moves(at, self.second) - self._kinematics.moves(at, self.first)
        size = np.abs(between)
        along = between / np.maximum(size, MEETING)
        if self.slides.any():
            line = at.axis.take(self.first.links, axis=-1) * self._line
            along = np.where(self.slides, line, along)
            size = np.where(self.slides, (line.conj() * between).real, size)
        return Stretched(between, along, size, moved)


def _line_of(layout: TreeLayout, slide: Slide | None) -> complex:
    """Direction of a slide in the axes of the link that carries its line; 0 without."""
    if slide is None:
        return 0j
    return rect(1.0, slide.direction + layout.frame(slide.first.part).angle)


class LinearSprings:
    """Springs between points that are carried by links, or of the ground."""

    def __init__(
        self, layout: TreeLayout, kinematics: LinkKinematics, springs: Sequence[LinearSpring]
    ) -> None:
        self._kinematics = kinematics
        pairs = [(spring.first, spring.second, spring.slide) for spring in springs]
        self._stretches = Stretches(layout, kinematics, pairs)
        self._stiffness = np.array([spring.stiffness for spring in springs])
        self._damping = np.array([spring.damping for spring in springs])
        self._length = np.array([spring.length for spring in springs], dtype=float)
        self._drawn = (self._length == 0) & ~self._stretches.slides

    def pull_and_lost(self, x: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Generalised forces (..., links) at coordinates and speeds (..., links); power lost, W."""
        at, ends = self._kinematics.places(x), self._stretches
        rates = self._kinematics.rates(at, x, v)
        between, along, size, moved = ends.look(at)
        moving = ends.second.rates(at, rates) - ends.first.rates(at, rates)
        rate = (along.conj() * moving).real
        pulled = (self._stiffness * (size - self._length) + self._damping * rate) * along
        drawn = self._stiffness * between + self._damping * moving
        force = -np.where(self._drawn, drawn, pulled)
        square = np.where(self._drawn, np.abs(moving) ** 2, rate**2)
        pull = (force.conj()[..., None] * moved).real.sum(-2)
        return np.asarray(pull), np.asarray((self._damping * square).sum(-1))


class Springs:
    """Springs of a mechanism, each where it costs least.

    Exudyn's tree has one on every coordinate, of `stiffness` and `damping` (links,), without force
    at `rest` (links,). `straight` tells that all forces are linear in the coordinates, `pulls` that
    the tree does not have all of them.
    """

    def __init__(
        self, layout: TreeLayout, kinematics: LinkKinematics, mechanism: Mechanism
    ) -> None:
        self.stiffness, self.damping, self.rest = np.zeros((3, len(layout.links)))
        # Of springs that act across several coordinates: matrices, and forces where all are 0.
        self._stiffness, self._damping = np.zeros((2, len(layout.links), len(layout.links)))
        self._preload = np.zeros(len(layout.links))
        self.pulls = False
        for spring in mechanism.springs:
            first, second = spring.first, spring.second
            rest = (spring.rest_angle or 0.0) - layout.turn(first, second)
            self._add(layout.turning_row(first, second), spring, rest)
        between = []
        for own in mechanism.linear_springs:
            row = None if own.slide is None else layout.sliding_row(own.slide)
            if row is None:
                between.append(own)
            else:
                self._add(row, own, own.length or 0.0)
        self._between = LinearSprings(layout, kinematics, between)
        self.straight = not between
        self.pulls = self.pulls or not self.straight
        self._slopes = (
            np.diag(self.stiffness) + self._stiffness,
            np.diag(self.damping) + self._damping,
        )

    def _add(self, row: FloatArray, spring: RotarySpring | LinearSpring, rest: float) -> None:
        """Add a spring whose angle or length is ``row @ x``, without force at `rest`."""
        moved = np.flatnonzero(row)
        if len(moved) == 1 and not (self.stiffness[moved] or self.damping[moved]):
            self.stiffness[moved], self.damping[moved] = spring.stiffness, spring.damping
            self.rest[moved] = row[moved] * rest
            return
        square = np.outer(row, row)
        self._stiffness += spring.stiffness * square
        self._damping += spring.damping * square
        self._preload += spring.stiffness * rest * row
        self.pulls = True

    def pull(self, x: FloatArray, v: FloatArray) -> FloatArray:
        """Generalised forces (instants, links) beside those of the tree's own springs."""
        across = self._preload - x @ self._stiffness - v @ self._damping
        return across if self.straight else across + self._between.pull_and_lost(x, v)[0]

    def slopes(
        self, x: FloatArray, v: FloatArray, lengths: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping matrix (links, links) of all springs at one state: see `falls`."""
        if self.straight:
            return self._slopes
        stiffness, damping = falls(lambda x, v: self._between.pull_and_lost(x, v)[0], x, v, lengths)
        return self._slopes[0] + stiffness, self._slopes[1] + damping

    def lost(self, x: FloatArray, v: FloatArray) -> FloatArray:
        """Power that dampers take (instants,), W, at coordinates and speeds (instants, links)."""
        lost = (v * v) @ self.damping + np.sum((v @ self._damping) * v, axis=1)
        return np.asarray(lost if self.straight else lost + self._between.pull_and_lost(x, v)[1])

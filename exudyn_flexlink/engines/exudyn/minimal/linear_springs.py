"""Linear springs and dampers on a tree's coordinates: forces, and how they give way.

With d from the first to the second end (complex, global axes), its rate d' and its derivatives by
the coordinates J, a spring of stiffness k, damping c and length L pulls its second end by

    F = -T n,  T = k (|d| - L) + c (n . d'),  n = d / |d|;      L = 0:  F = -k d - c d',

so that Q = J . F. Along a slide n is the direction of its line, which turns with the first part,
and |d| is n . d. The stiffness is ``J . (-dF/dd) J - F . dJ``, the damping ``J . (-dF/dd') J``;
that the damper's line turns is left to the iteration. The second derivative of a point by two
coordinates is i times its derivative by the outer one if the inner one is a hinge, else zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.engines.exudyn.minimal.kinematics import LinkKinematics, Points
from exudyn_flexlink.mechanism import LinearSpring
from exudyn_flexlink.mechanism.tree import TreeLayout

MEETING = 1e-300  # m: where both ends meet, a spring with a length has no direction, and no force


class _Stretched(NamedTuple):
    """Springs at some instants, (..., springs) each; `moved` (..., springs, links) is J."""

    along: ComplexArray
    size: FloatArray
    rate: FloatArray
    force: ComplexArray
    moving: ComplexArray
    moved: ComplexArray


class LinearSprings:
    """Springs between points that are carried by links, or of the ground."""

    def __init__(
        self, layout: TreeLayout, kinematics: LinkKinematics, springs: Sequence[LinearSpring]
    ) -> None:
        self._kinematics = kinematics
        self._first = Points(layout, [spring.first for spring in springs])
        self._second = Points(layout, [spring.second for spring in springs])
        self.stiffness = np.array([spring.stiffness for spring in springs])
        self.damping = np.array([spring.damping for spring in springs])
        self._length = np.array([spring.length for spring in springs], dtype=float)
        self._line = np.array([_line_of(layout, spring) for spring in springs], dtype=complex)
        self._slides = self._line != 0
        self._drawn = (self._length == 0) & ~self._slides
        self._turning = kinematics.turning.T[self._first.links]  # of first parts, by the hinges
        count = len(layout.links)
        above = kinematics.moved_by[:count]  # (links, links): what carries each
        self._turned = above.T & kinematics.hinge[:, None]  # inner hinge, outer coordinate

    def _look(self, x: FloatArray, v: FloatArray) -> _Stretched:
        at = self._kinematics.places(x)
        rates = self._kinematics.rates(at, x, v)
        first, second = self._first.places(at), self._second.places(at)
        between = second - first
        moving = self._second.rates(at, rates) - self._first.rates(at, rates)
        moved = self._kinematics.moves(at, self._second.links, second)
        moved = moved - self._kinematics.moves(at, self._first.links, first)
        size = np.abs(between)
        along = between / np.maximum(size, MEETING)
        if self._slides.any():
            line = at.axis.take(self._first.links, axis=-1) * self._line
            along = np.where(self._slides, line, along)
            size = np.where(self._slides, (line.conj() * between).real, size)
        rate = (along.conj() * moving).real
        pulled = (self.stiffness * (size - self._length) + self.damping * rate) * along
        drawn = self.stiffness * between + self.damping * moving
        force = -np.where(self._drawn, drawn, pulled)
        return _Stretched(along, size, rate, force, moving, moved)

    def pull(self, x: FloatArray, v: FloatArray) -> FloatArray:
        """Generalised forces (..., links) at coordinates and speeds (..., links)."""
        now = self._look(x, v)
        return np.asarray((now.force.conj()[..., None] * now.moved).real.sum(-2))

    def lost(self, x: FloatArray, v: FloatArray) -> FloatArray:
        """Power that the dampers take (instants,), W."""
        now = self._look(x, v)
        square = np.where(self._drawn, np.abs(now.moving) ** 2, now.rate**2)
        return np.asarray((self.damping * square).sum(-1))

    def slopes(self, x: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping matrix (links, links) at one state."""
        now = self._look(x, v)
        by = now.along.conj()[:, None] * now.moved  # along the spring, and across it
        stretch, across = by.real, by.imag
        tension = -(now.along.conj() * now.force).real
        size = np.maximum(now.size, MEETING)[:, None]
        turning = np.where(self._slides[:, None], self._turning, across / size)
        turned = tension[:, None] * turning
        turned = np.where(self._drawn[:, None], self.stiffness[:, None] * across, turned)
        stiffness = (stretch.T * self.stiffness) @ stretch + across.T @ turned
        sideways = np.where(self._drawn, self.damping, 0.0)
        damping = (stretch.T * self.damping) @ stretch + (across.T * sideways) @ across
        return stiffness + self._of_turning(now), damping

    def _of_turning(self, now: _Stretched) -> FloatArray:
        """Stiffness (links, links) by which the ends' paths are bent."""
        pushed = (now.force.conj() @ (1j * now.moved)).real  # by outer coordinates
        upper = -np.where(self._turned, pushed, 0.0)
        return np.asarray(upper + upper.T - np.diag(np.diag(upper)))


def _line_of(layout: TreeLayout, spring: LinearSpring) -> complex:
    """Direction of a spring's slide in the axes of the link that carries its line; 0 without."""
    if spring.slide is None:
        return 0j
    angle = spring.slide.direction + layout.frame(spring.slide.first.part).angle
    return complex(cos(angle), sin(angle))

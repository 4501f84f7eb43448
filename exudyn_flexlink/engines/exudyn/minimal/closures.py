"""Joints that close loops: by how much they are open, and the derivatives of that.

All of them hold parts of the same vector, the gap from a joint's first point to its second in axes
e that its first part carries, or the angle between both parts:

    w = e* (p_2 - p_1) - gamma(u),      theta = theta_2 - theta_1

Pins hold w at zero, and so do slots, with gamma(u) the place on the curve. Slides have e along
their line, and hold the imaginary part of w, and theta. Motors that move no coordinate of the tree
prescribe theta, or along a slide the real part. Gears hold sums of the tree's own coordinates. The
coordinates y are those of the tree, then the slots' places u. Rows are the real parts (m), then the
imaginary ones (m), then the angles (rad), then the gears (m; rad without pitch circles).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.engines.exudyn.minimal.guided import TrackPoint
from exudyn_flexlink.engines.exudyn.minimal.kinematics import LinkKinematics, Places, Points
from exudyn_flexlink.mechanism import Anchor, Gear, Motor, Pin, Slide, Slot
from exudyn_flexlink.mechanism.tree import TreeLayout


class Track(NamedTuple):
    """Slots' curves at their places: points and derivatives by the parameter (n, slots)."""

    point: ComplexArray
    tangent: ComplexArray
    bend: ComplexArray


class Where(NamedTuple):
    """Where everything is at coordinates x of the tree (n, links).

    `points` (n, 2 gaps) are the first of all gaps, then the second, `between` (n, gaps) the vectors
    between them; `axes` (n, gaps) those in which gaps are seen.
    """

    x: FloatArray
    places: Places
    points: ComplexArray
    between: ComplexArray
    axes: ComplexArray
    track: Track | None  # without slots


class Closures:
    """Residuals of a layout's closures, their Jacobian, and their second derivatives.

    `joints` are all closures but motors and gears, `parts` the first and the second part of each.
    `motors` and `gears` have the number of their row, `angles` (rows,) tells which rows are angles.
    """

    def __init__(
        self,
        layout: TreeLayout,
        kinematics: LinkKinematics,
        start: FloatArray,
        followed: Sequence[TrackPoint],
    ) -> None:
        """`start` are the coordinates at time 0."""
        self._kinematics, self._followed = kinematics, followed
        self._links = len(layout.links)
        self.joints = [joint for joint in layout.closures if not isinstance(joint, Gear | Motor)]
        gears = [gear for gear in layout.closures if isinstance(gear, Gear)]
        motors = [motor for motor in layout.closures if isinstance(motor, Motor)]
        slides = [joint for joint in self.joints if isinstance(joint, Slide)]
        sliding = [(motor, motor.slide) for motor in motors if motor.slide]
        turning = [motor for motor in motors if not motor.slide]

        self._lay_gaps(layout, [*self.joints, *(slide for _, slide in sliding)])
        turned = [(slide.first.part, slide.second.part) for slide in slides]
        turned += [(motor.first, motor.second) for motor in turning]
        turns = [layout.turning_row(*pair) for pair in turned]
        turns += [_geared_row(layout, gear) for gear in gears]
        self._turning = np.array(turns).reshape(-1, self._links)

        # Real parts of pins, slots and motors; imaginary parts of all joints; slides, then motors.
        held = [i for i, joint in enumerate(self.joints) if not isinstance(joint, Slide)]
        prescribed = range(len(self.joints), len(self.joints) + len(sliding))
        self._real = np.array([*held, *prescribed], dtype=int)
        lengths = len(self._real) + len(self.joints)
        slots = [self.rows_of_slot(k) for k in range(len(followed))]
        self._slot_rows = np.array(slots, dtype=int).reshape(-1, 2).T
        self._by_places = self._links + np.arange(len(followed))
        meshed = lengths + len(turned)
        self.count = meshed + len(gears)
        self.gears = list(enumerate(gears, start=meshed))
        self.angles = np.arange(self.count) >= lengths
        self.angles[[row for row, gear in self.gears if gear.in_newtons]] = False
        rows = [*range(len(held), len(self._real)), *range(lengths + len(slides), meshed)]
        self.motors = list(zip(rows, [*(m for m, _ in sliding), *turning], strict=True))

        self._rest = np.zeros(self.count)
        for row, slide in enumerate(slides, start=lengths):
            self._rest[row] = slide.angle - layout.turn(slide.first.part, slide.second.part)
        # Motors turn and slide on from where they start, and gears mesh as they do there.
        at_start = np.append(start, [point.u for point in followed])
        moved = self.residual(np.zeros(1), self.where(at_start[None]))[0]
        self._rest[rows] = moved[rows]
        self._rest[meshed:] = moved[meshed:]

    def _lay_gaps(self, layout: TreeLayout, joints: Sequence[Pin | Slide | Slot]) -> None:
        """Find what carries the points and the axes of each joint's gap."""
        ends = [_ends(joint) for joint in joints]
        self.parts = [(first.part, second.part) for first, second in ends]
        self._points = Points(layout, [*(first for first, _ in ends), *(end for _, end in ends)])
        self._gaps = len(ends)
        self._bases = self._points.links[: self._gaps]
        along = [joint.direction if isinstance(joint, Slide) else 0.0 for joint in joints]
        turned = [layout.frame(first).angle for first, _ in self.parts]
        self._axes = np.exp(1j * (np.array(turned) + along))
        self._spun_by = 1j * self._kinematics.turning.T[self._bases]  # (gaps, links)
        self._moved = self._kinematics.moved_by[self._points.links].astype(float)
        numbers = {joint.name: i for i, joint in enumerate(self.joints)}
        self._tracked = [numbers[point.slot.name] for point in self._followed]

    def rows_of_slot(self, k: int) -> list[int]:
        """Rows of both parts of slot k's gap."""
        gap = self._tracked[k]
        return [int(np.searchsorted(self._real, gap)), len(self._real) + gap]

    # --- at instants --------------------------------------------------------------------------

    def where(self, y: FloatArray) -> Where:
        """Where everything is at coordinates (n, coordinates), slots on their present pieces."""
        if not self._tracked:
            return self.where_on(y, None)
        track = np.empty((3, len(y), len(self._followed)), dtype=complex)
        for k, point in enumerate(self._followed):
            track[:, :, k] = point.together(y[:, self._links + k])
        return self.where_on(y[:, : self._links], Track(*track))

    def where_on(self, x: FloatArray, track: Track | None) -> Where:
        """As `where`, at coordinates of the tree (n, links) and with slots so on their curves."""
        places = self._kinematics.places(x)
        points = self._points.places(places)
        axes = places.axis.take(self._bases, axis=1) * self._axes
        return Where(x, places, points, self._between(points), axes, track)

    def _between(self, points: ComplexArray) -> ComplexArray:
        return np.asarray(points[:, self._gaps :] - points[:, : self._gaps])

    def _rows(self, gaps: ComplexArray, turns: FloatArray) -> FloatArray:
        """Rows (n, rows, ...) of what is known of gaps (n, gaps, ...) and angles."""
        real, imaginary = gaps.real.take(self._real, axis=1), gaps.imag[:, : len(self.joints)]
        return np.concatenate([real, imaginary, turns], axis=1)

    def residual(self, t: FloatArray, at: Where) -> FloatArray:
        """By how much closures are open at instants (n,) s: (n, rows)."""
        gaps = at.axes.conj() * at.between
        if at.track is not None:
            gaps[:, self._tracked] -= at.track.point
        found = self._rows(gaps, at.x @ self._turning.T) - self._rest
        for row, motor in self.motors:
            found[:, row] -= motor.speed.integrals(t)
        return found

    def jacobian(self, at: Where) -> FloatArray:
        """Derivatives of the residuals by the coordinates (n, rows, coordinates)."""
        moves = self._kinematics.carries(at.places, at.points) * self._moved
        moved = self._between(moves)
        moved -= at.between[:, :, None] * self._spun_by
        moved *= at.axes.conj()[:, :, None]
        real, lengths = len(self._real), len(self._real) + len(self.joints)
        found = np.zeros((len(at.x), self.count, self._links + len(self._tracked)))
        by_tree = found[:, :, : self._links]
        by_tree[:, :real] = moved.real.take(self._real, axis=1)
        by_tree[:, real:lengths] = moved.imag[:, : len(self.joints)]
        by_tree[:, lengths:] = self._turning
        if at.track is not None:
            along, across = self._slot_rows
            found[:, along, self._by_places] = -at.track.tangent.real
            found[:, across, self._by_places] = -at.track.tangent.imag
        return found

    def rates(self, t: FloatArray) -> FloatArray:
        """Derivatives of the residuals by time alone (n, rows)."""
        found = np.zeros((len(t), self.count))
        for row, motor in self.motors:
            found[:, row] = -motor.speed.values(t)
        return found

    def bends(self, t: FloatArray, at: Where, v: FloatArray, a: FloatArray) -> FloatArray:
        """Second derivatives of the residuals (n, rows), at speeds and accelerations."""
        tree, places = slice(0, self._links), at.places
        rates = self._kinematics.rates(places, at.x, v[:, tree])
        bends = self._kinematics.bends(places, rates, at.x, v[:, tree], a[:, tree])
        moving = self._between(self._points.rates(places, rates))
        gaps = self._between(self._points.bends(places, rates, bends))
        omega, alpha = (own.angle.take(self._bases, axis=1) for own in (rates, bends))
        gaps -= (1j * alpha + omega * omega) * at.between + 2j * omega * moving
        gaps *= at.axes.conj()
        if at.track is not None:
            place_rate, place_acceleration = v[:, self._links :], a[:, self._links :]
            gaps[:, self._tracked] -= (
                at.track.bend * place_rate**2 + at.track.tangent * place_acceleration
            )
        found = self._rows(gaps, a[:, tree] @ self._turning.T)
        for row, motor in self.motors:
            found[:, row] -= motor.speed.rates(t)
        return found

    def forces(self, at: Where, multipliers: FloatArray) -> ComplexArray:
        """Forces (n, joints) of joints on their second points, N, by multipliers (n, rows)."""
        real, joints = len(self._real), len(self.joints)
        gaps = np.zeros(at.axes.shape, dtype=complex)
        gaps[:, self._real] = multipliers[:, :real]
        gaps[:, :joints] += 1j * multipliers[:, real : real + joints]
        return np.asarray((at.axes * gaps)[:, :joints])


def _geared_row(layout: TreeLayout, gear: Gear) -> FloatArray:
    """How a gear's sum (links,) grows with the coordinates."""
    row = np.zeros(len(layout.links))
    for tie, weight in zip(gear.ties, gear.weights, strict=True):
        if tie.slide is None:
            row += weight * layout.turning_row(*tie.parts)
        else:
            own = layout.sliding_row(tie.slide)
            assert own is not None  # gears are of the tree's own joints
            row += weight * own
    return row


def _ends(joint: Pin | Slide | Slot) -> tuple[Anchor, Anchor]:
    """First and second point of a joint; of a slot the origin of its curve's axes, and its own."""
    if isinstance(joint, Slot):
        return Anchor(joint.carrier, 0.0, 0.0), joint.anchor
    return joint.first, joint.second

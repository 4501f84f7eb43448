"""Joints that close loops: by how much they are open, and the derivatives of that.

Pins and slots give two rows each (x and y, m), slides two (across the guide, m, and the angle,
rad), motors that move no coordinate of the tree one (rad, or m along a slide that closes a loop).
The coordinates y are those of the tree, then the slots' places on their curves: a slot's point is
where its curve is, ``p = c + A gamma(u)`` for a curve in the axes A of a part at c.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from exudyn_flexlink.arrays import BoolArray, ComplexArray, FloatArray
from exudyn_flexlink.engines.exudyn.minimal.kinematics import LinkKinematics, Places, Points
from exudyn_flexlink.engines.exudyn.minimal.track_point import TrackPoint
from exudyn_flexlink.mechanism import Anchor, Motor, Pin, Slide, Slot
from exudyn_flexlink.mechanism.tree import Closure, TreeLayout
from exudyn_flexlink.mechanism.weld_groups import Frame


class Track(NamedTuple):
    """Slots' curves at their places: points and derivatives by the parameter (instants, slots)."""

    point: ComplexArray
    tangent: ComplexArray
    bend: ComplexArray


class Closing(NamedTuple):
    """Where everything is at some instants, with the residuals (instants, rows) of the closures."""

    x: FloatArray
    places: Places
    points: ComplexArray
    track: Track
    residual: FloatArray


class Closures:
    """Residuals of a layout's closures, their Jacobian, and their second derivatives."""

    def __init__(
        self,
        layout: TreeLayout,
        kinematics: LinkKinematics,
        start: FloatArray,
        followed: Sequence[TrackPoint],
    ) -> None:
        self.kinematics, self._followed = kinematics, followed
        self._links = len(layout.links)
        self._slots = {point.slot.name: k for k, point in enumerate(followed)}
        anchors: list[Anchor] = []
        self.rows: list[tuple[Closure, slice]] = []
        self._first: dict[str, int] = {}  # of each closure, its first point
        count = 0
        for closure in layout.closures:
            if not isinstance(closure, Motor):
                self._first[closure.name] = len(anchors)
                anchors += _anchors(closure)
            size = 1 if isinstance(closure, Motor) else 2
            self.rows.append((closure, slice(count, count + size)))
            count += size
        self.count = count
        self._points = Points(layout, anchors)
        turned = [c for c in layout.closures if isinstance(c, Slide | Motor)]
        self._turns = {_key(c): layout.turning_row(*_parts(c)) for c in turned}
        self._bases = {
            c.name: layout.frame(c.first.part if isinstance(c, Slide) else c.carrier)
            for c in layout.closures
            if isinstance(c, Slide | Slot)
        }
        at = kinematics.places(start)
        self._rest = {
            c.name: self._along(c.slide, at, self._points.places(at))
            if c.slide
            else float(self._turns[_key(c)] @ start)
            for c in layout.closures
            if isinstance(c, Motor)
        }
        self._constant = {
            c.name: _fixed_turn(layout, c) for c in layout.closures if isinstance(c, Slide)
        }

    def angles(self) -> BoolArray:
        """Tell which rows (rows,) are angles."""
        found = np.zeros(self.count, dtype=bool)
        for closure, rows in self.rows:
            if isinstance(closure, Slide) or (isinstance(closure, Motor) and not closure.slide):
                found[rows.stop - 1] = True
        return found

    def at(self, t: FloatArray, y: FloatArray, track: Track | None = None) -> Closing:
        """Return residuals at instants (n,) and coordinates (n, coordinates)."""
        x = y[:, : self._links]
        places = self.kinematics.places(x)
        points = self._points.places(places)
        if track is None:
            track = self._track(y[:, self._links :])
        residual = np.zeros((len(y), self.count))
        for closure, rows in self.rows:
            if isinstance(closure, Motor):
                if closure.slide:
                    moved = self._along(closure.slide, places, points)
                else:
                    moved = x @ self._turns[_key(closure)]
                driven = [closure.speed.integral(a) for a in t.tolist()]
                residual[:, rows.start] = moved - self._rest[closure.name] - driven
                continue
            first = self._first[closure.name]
            if isinstance(closure, Slide):
                across = self.axis(closure, places).conj() * (
                    points[:, first + 1] - points[:, first]
                )
                residual[:, rows.start] = across.imag
                turned = x @ self._turns[_key(closure)] + self._constant[closure.name]
                residual[:, rows.start + 1] = turned
                continue
            if isinstance(closure, Slot):
                on = self.axis(closure, places) * track.point[:, self._slots[closure.name]]
                gap = points[:, first] - points[:, first + 1] - on
            else:
                gap = points[:, first + 1] - points[:, first]
            residual[:, rows.start], residual[:, rows.start + 1] = gap.real, gap.imag
        return Closing(x, places, points, track, residual)

    def _along(self, slide: Slide, places: Places, points: ComplexArray) -> Any:
        """How far a slide is out (...), m."""
        first = self._first[slide.name]
        between = points[..., first + 1] - points[..., first]
        return (self.axis(slide, places).conj() * between).real

    def axis(self, joint: Slide | Slot, places: Places) -> ComplexArray:
        """Direction of a slide, or of a slot's carrier (instants,), as complex numbers."""
        frame: Frame = self._bases[joint.name]
        turn = frame.angle + (joint.direction if isinstance(joint, Slide) else 0.0)
        return np.asarray(places.axis[..., frame.link] * np.exp(1j * turn))

    def _track(self, u: FloatArray) -> Track:
        shape = u.shape
        found = np.array([
            [self._followed[k].at(place) for k, place in enumerate(row)] for row in u.tolist()
        ]).reshape(*shape, 6)  # fmt: skip
        vectors = found[..., 0::2] + 1j * found[..., 1::2]
        return Track(vectors[..., 0], vectors[..., 1], vectors[..., 2])

    def jacobian(self, at: Closing) -> FloatArray:
        """Derivatives of the residuals by the coordinates (instants, rows, coordinates)."""
        moved = self.kinematics.moves(at.places, self._points.links, at.points)
        matrix = np.zeros((len(at.x), self.count, self._links + len(self._slots)))
        for closure, rows in self.rows:
            tree = matrix[:, rows, : self._links]
            slide = closure.slide if isinstance(closure, Motor) else closure
            if isinstance(slide, Slide):
                by = self._slid(slide, at, moved)
                tree[:, 0] = by.imag if slide is closure else by.real
            if isinstance(closure, Slide):
                tree[:, 1] = self._turns[_key(closure)]
                continue
            if isinstance(closure, Motor):
                if not closure.slide:
                    tree[:, 0] = self._turns[_key(closure)]
                continue
            first = self._first[closure.name]
            if isinstance(closure, Slot):
                k = self._slots[closure.name]
                axis = self.axis(closure, at.places)
                turning = self.kinematics.turning[:, self._bases[closure.name].link]
                spun = 1j * (axis * at.track.point[:, k])[:, None] * turning
                by = moved[:, first] - moved[:, first + 1] - spun
                tangent = axis * at.track.tangent[:, k]
                matrix[:, rows.start, self._links + k] = -tangent.real
                matrix[:, rows.start + 1, self._links + k] = -tangent.imag
            else:
                by = moved[:, first + 1] - moved[:, first]
            tree[:, 0], tree[:, 1] = by.real, by.imag
        return matrix

    def _slid(self, slide: Slide, at: Closing, moved: ComplexArray) -> ComplexArray:
        """Derivatives (instants, links) of a slide's second end against the first, in its axes."""
        first = self._first[slide.name]
        back = self.axis(slide, at.places).conj()
        between = at.points[:, first + 1] - at.points[:, first]
        turning = self.kinematics.turning[:, self._bases[slide.name].link]
        by = moved[:, first + 1] - moved[:, first]
        return np.asarray(back[:, None] * (by - 1j * between[:, None] * turning))

    def rates(self, t: FloatArray) -> FloatArray:
        """Derivatives of the residuals by time alone (instants, rows)."""
        found = np.zeros((len(t), self.count))
        for closure, rows in self._motors():
            found[:, rows.start] = [-closure.speed.at(a) for a in t.tolist()]
        return found

    def bends(self, t: FloatArray, at: Closing, v: FloatArray, a: FloatArray) -> FloatArray:
        """Second derivatives of the residuals (instants, rows), at speeds and accelerations."""
        count = self._links
        rates = self.kinematics.rates(at.places, at.x, v[:, :count])
        bends = self.kinematics.bends(at.places, rates, at.x, v[:, :count], a[:, :count])
        speeds = self._points.rates(at.places, rates)
        pushes = self._points.bends(at.places, rates, bends)
        along, along_rate = v[:, count:], a[:, count:]
        found = np.zeros((len(t), self.count))
        for closure, rows in self.rows:
            slide = closure.slide if isinstance(closure, Motor) else closure
            if isinstance(slide, Slide):
                first, link = self._first[slide.name], self._bases[slide.name].link
                back = self.axis(slide, at.places).conj()
                between, moving, pushed = (
                    values[:, first + 1] - values[:, first]
                    for values in (at.points, speeds, pushes)
                )
                omega, alpha = rates.angle[:, link], bends.angle[:, link]
                spun = (-1j * alpha - omega**2) * between - 2j * omega * moving + pushed
                own = back * spun
                found[:, rows.start] = own.imag if slide is closure else own.real
            if isinstance(closure, Slide):
                found[:, rows.start + 1] = a[:, :count] @ self._turns[_key(closure)]
                continue
            if isinstance(closure, Motor):
                if not closure.slide:
                    found[:, rows.start] = a[:, :count] @ self._turns[_key(closure)]
                found[:, rows.start] -= [closure.speed.rate(b) for b in t.tolist()]
                continue
            first = self._first[closure.name]
            if isinstance(closure, Slot):
                k, link = self._slots[closure.name], self._bases[closure.name].link
                omega, alpha = rates.angle[:, link], bends.angle[:, link]
                u, du, ddu = at.track.point[:, k], along[:, k], along_rate[:, k]
                tangent, bend = at.track.tangent[:, k], at.track.bend[:, k]
                own = bend * du**2 + tangent * ddu + 2j * omega * tangent * du
                own += (1j * alpha - omega**2) * u
                on = self.axis(closure, at.places) * own
                gap = pushes[:, first] - pushes[:, first + 1] - on
            else:
                gap = pushes[:, first + 1] - pushes[:, first]
            found[:, rows.start], found[:, rows.start + 1] = gap.real, gap.imag
        return found

    def _motors(self) -> Iterator[tuple[Motor, slice]]:
        for closure, rows in self.rows:
            if isinstance(closure, Motor):
                yield closure, rows


def _key(closure: Slide | Motor) -> tuple[bool, str]:
    """A drive may have the name of a joint."""
    return isinstance(closure, Motor), closure.name


def _anchors(closure: Pin | Slide | Slot) -> list[Anchor]:
    if isinstance(closure, Pin | Slide):
        return [closure.first, closure.second]
    return [closure.anchor, Anchor(closure.carrier, 0.0, 0.0)]


def _parts(closure: Slide | Motor) -> tuple[int, int]:
    """Parts whose angle against one another a closure holds."""
    if isinstance(closure, Motor):
        return closure.first, closure.second
    return closure.first.part, closure.second.part


def _fixed_turn(layout: TreeLayout, closure: Slide) -> float:
    """Angle that a slide's second part misses where all coordinates are 0, rad."""
    return layout.turn(closure.second.part) - layout.turn(closure.first.part) - closure.angle

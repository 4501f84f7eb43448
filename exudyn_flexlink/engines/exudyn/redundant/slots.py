"""The slot joint: a point of a part moves along a curve, piece by piece.

A piece that is a line, a circle or an ellipse along the axes is a native quadratic constraint of
Exudyn on the part's node. Every other piece (splines, turned ellipses, a point that is not the
part's origin, a curve that a body carries) is a constraint whose foot point is computed in Python.
Only the present piece is active. Steps end where pieces meet; then the next piece becomes active.

Steps end on events: jumps of a track's curvature, begins of contacts, the end of the run. Across a
jump of the forces a method of order 2 is only of order 1, so the step before an event is shortened
to end on it. After a kink of torques or forces by the state, steps are short: a second run may pass
the kink with the same steps, and would not show the error of long ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, hypot, inf, sin, sqrt
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves import Arc, Curve, Evaluator, LineSegment, evaluator, foot
from exudyn_flexlink.engines.exudyn.engine import items
from exudyn_flexlink.engines.exudyn.redundant.system import System
from exudyn_flexlink.engines.track_follower import TrackFollower
from exudyn_flexlink.integrate.problem import Window
from exudyn_flexlink.mechanism import (
    GROUND,
    Mechanism,
    anchor_position,
    joint_speed,
    sensed,
    turned,
)
from exudyn_flexlink.mechanism.prescribed import Formula
from exudyn_flexlink.result import Event
from exudyn_flexlink.rounding import NEGLIGIBLE, PLACE_ROUNDING, TINY

# Of a step: an event nearer than this counts as reached. An index-3 method divides multipliers by
# the square of its step, so in so short a step they would be rounding.
REACHED = 1e-2
# Of the largest value so far, and at least of 1 in its SI unit: the solver's error of a zero value.
REST = 1e-10
STEEP = 10.0  # slip speeds: friction of a joint is its bound, to 4e-9


@dataclass(frozen=True, slots=True)
class StepEnd:
    """Time (s), length of the step that ended there (s), coordinates and velocities.

    `q` and `v` are the solver's coordinates; `q_list` and `v_list` are those of all parts in a row:
    plain lists are faster if few numbers are needed.
    """

    time: float
    step: float
    q: FloatArray
    v: FloatArray
    q_list: list[float]
    v_list: list[float]


def end_on(step: float, until: float) -> float:
    """Shorten `step` (s) so that a whole number of steps ends on an event `until` seconds ahead.

    An event between one and two steps ahead is reached by two equal steps, so that none is tiny.
    """
    if until <= step * (1 + REACHED):
        return max(until, REACHED * step)
    if until < 2 * step:
        return until / 2
    return step


def first_zero(value: float, rate: float, curvature: float) -> float:
    """Time until ``value + rate t + curvature t^2/2`` falls to 0 from above, s; inf if it does not.

    `value` must be positive.
    """
    if abs(curvature) * value < 1e-12 * rate * rate or curvature == 0:
        return -value / rate if rate < 0 else inf
    discriminant = rate * rate - 2 * curvature * value
    if discriminant < 0:
        return inf
    root = sqrt(discriminant)
    # The smaller positive root, in the form without cancellation.
    if rate < 0:
        return 2 * value / (-rate + root)
    return (rate + root) / -curvature if curvature < 0 else inf


class Kinks:
    """Follows the kinks of max, min and abs in formulas of the state, from step to step.

    It also follows friction of joints, which is smooth but steep, at the ends of its steep range.
    """

    def __init__(self, mechanism: Mechanism, window: Window) -> None:
        formulas = [(size.value, size.senses) for _, size in mechanism.sizes]
        self._bent = [(f, s) for f, s in formulas if isinstance(f, Formula) and f.expression.kinks]
        self._frictions = mechanism.frictions
        self._window = window
        self._last, self._rates, self._step = np.zeros(0), np.zeros(0), 0.0
        self._largest = np.zeros(1)

    def after_step(self, now: StepEnd, step: float) -> tuple[float, bool]:
        """Shorten the next step (s) to end on a kink; tell whether the last step passed one."""
        if not (self._bent or self._frictions):
            return step, False
        values, last, h = self._values(now), self._last, now.step
        self._largest = np.maximum(self._largest, np.abs(values))
        values[np.abs(values) <= REST * np.maximum(self._largest, 1.0)] = 0.0
        self._last = values
        if h == 0:  # the run begins
            self._rates, self._step = 0 * values, 0.0
            return step, False
        rates = (values - last) / h
        bends = 2 * (rates - self._rates) / (h + self._step) if self._step > 0 else 0 * rates
        self._rates, self._step = rates, h
        signs = np.sign(values) * np.array([values, rates + bends * h / 2, bends])
        for value, rate, bend in signs.T.tolist():
            step = end_on(step, first_zero(value, rate, bend)) if value > 0 else step
        # A value that is zero may stay zero, or pass through.
        passed = bool((np.sign(values) != np.sign(last)).any())
        return step, passed

    def _values(self, now: StepEnd) -> FloatArray:
        q, v = (np.reshape(x, (1, -1, 3)) for x in (now.q_list, now.v_list))
        time = np.array([self._window.inside(now.time)])
        switches = [
            formula.expression.switches(time + formula.clock, [sensed(s, q, v) for s in senses])
            for formula, senses in self._bent
        ]
        speeds = [
            joint_speed(friction.joint, q, v) / friction.slip_speed for friction in self._frictions
        ]
        steep = [speed + side for speed in speeds for side in (-STEEP, STEEP)]
        return np.concatenate([*(values[:, 0] for values in switches), *steep])


PART_OF_PIECE = 0.1  # of a piece: longest path of a step, or Newton may find another foot


@dataclass(frozen=True)
class Quadratic:
    """``linear . P + quadratic . P^2 = constant``, scaled so that its gradient is about 1."""

    linear: tuple[float, float]
    quadratic: tuple[float, float]
    constant: float


def quadratic_of(piece: Curve) -> Quadratic | None:
    """Return the native constraint of a piece; None if it has none."""
    if isinstance(piece, LineSegment):
        (x0, y0), (x1, y1) = piece.a, piece.b
        length = hypot(x1 - x0, y1 - y0)
        nx, ny = -(y1 - y0) / length, (x1 - x0) / length
        return Quadratic((nx, ny), (0.0, 0.0), nx * x0 + ny * y0)
    if not isinstance(piece, Arc):
        return None
    (cx, cy), first, second = (vector.tolist() for vector in piece.conic)
    a, b = hypot(*first), hypot(*second)
    slant = abs(first[0] * first[1]) + abs(second[0] * second[1])
    if slant > 1e-15 * a * b:
        if abs(a - b) > 1e-15 * a:
            return None  # a turned ellipse has a term x y, which the native item lacks
        along_x, along_y = a, a
    else:
        along_x, along_y = (a, b) if abs(first[0]) > abs(first[1]) else (b, a)
    scale = min(a, b) / 2
    qx, qy = scale / along_x**2, scale / along_y**2
    constant = scale - qx * cx * cx - qy * cy * cy
    return Quadratic((-2 * qx * cx, -2 * qy * cy), (qx, qy), constant)


class SlotItems(TrackFollower):
    """Items of a slot joint, its active piece, and the place of the point on it."""

    def __init__(self, system: System, index: int, events: list[Event], limits: float) -> None:
        """Limits of steps are `limits` times as long as usual."""
        slot, state = system.mechanism.slots[index], system.assembly.state
        super().__init__(slot, float(state.places[index]), state.laps[index], events)
        self.system = system
        self.at: list[Evaluator] = [evaluator(piece) for piece in self.curve.pieces]
        self.row = 3 * self.slot.anchor.part
        self._carried = self.slot.carrier != GROUND
        self._at_origin = self.slot.anchor.x == self.slot.anchor.y == 0.0
        # Coordinates of the node: x, y and the angle; or the slope if it is the start of a beam.
        self._width = 4 if self.slot.anchor.part in system.in_beams else 3
        self._others = (0.0,) * (self._width - 2)
        self._native: dict[Quadratic, int] = {}
        self._general: int | None = None
        self.item_of_piece = [self._create(piece) for piece in self.curve.pieces]
        self._activate(self.piece)
        self._longest = [
            limits * PART_OF_PIECE * float(piece.length()) for piece in self.curve.pieces
        ]
        self._along = 0.0
        self._u_rate = 0.0  # 1/s, of the parameter u
        # Whether the acceleration along the curve jumped at the last step's end, by a new piece.
        self.jumped = False
        self.at_end = False  # end of an open curve: the run can't go on

    # --- items ------------------------------------------------------------------------------

    @property
    def native(self) -> bool:
        """Whether all pieces are Exudyn's own items, without a search of the place."""
        return self._general is None

    def _create(self, piece: Curve) -> int:
        native = self._at_origin and not self._carried
        quadratic = quadratic_of(piece) if native else None
        if quadratic is None:
            if self._general is None:
                self._general = self._add(
                    scalingMarker0=np.zeros((1, 3 if self._carried else 1)),
                    scalingMarker1=np.zeros((1, self._width)),
                    offset=[0.0],
                    constraintUserFunction=self._distance,
                    jacobianUserFunction=self._gradient,
                )
            return self._general
        if quadratic not in self._native:
            self._native[quadratic] = self._add(
                scalingMarker0=[],
                quadraticTermMarker0=[],
                scalingMarker1=np.array([[*quadratic.linear, *self._others]]),
                quadraticTermMarker1=np.array([[*quadratic.quadratic, *self._others]]),
                offset=[quadratic.constant],
            )
        return self._native[quadratic]

    def _add(self, **constraint: Any) -> int:
        """Add a constraint on the coordinates of the carrier, or the ground, and of the part."""
        system, carrier = self.system, self.slot.carrier
        base = system.nodes[carrier] if self._carried else system.ground_node
        markers = [
            system.mbs.AddMarker(items.MarkerNodeCoordinates(nodeNumber=node))
            for node in (base, system.nodes[self.slot.anchor.part])
        ]
        item = items.ObjectConnectorCoordinateVector(
            markerNumbers=markers, activeConnector=False, **constraint
        )
        return int(system.mbs.AddObject(item))

    def _activate(self, piece: int) -> None:
        for item in {*self.item_of_piece}:
            active = item == self.item_of_piece[piece]
            self.system.mbs.SetObjectParameter(item, "activeConnector", active)

    # --- the general constraint: signed distance from the curve's foot point -------------------

    def _arm(self, angle: float) -> tuple[float, float]:
        if self._at_origin:
            return 0.0, 0.0
        c, s = cos(angle), sin(angle)
        anchor = self.slot.anchor
        return c * anchor.x - s * anchor.y, s * anchor.x + c * anchor.y

    def _foot(self, q: Sequence[float]) -> tuple[float, float, float, float, float]:
        """Signed distance, unit normal and arm of the point, all in the axes of the curve.

        `q` are the coordinates of the carrier, if any, and of the point's part.
        """
        rx, ry = self._arm(q[-self._width + 2])
        x, y = q[-self._width] + rx, q[-self._width + 1] + ry
        if self._carried:
            c, s = cos(q[2]), sin(q[2])
            x, y = x - q[0], y - q[1]
            x, y, rx, ry = c * x + s * y, c * y - s * x, c * rx + s * ry, c * ry - s * rx
        evaluator = self.at[self.piece]
        px, py, dx, dy, _, _ = evaluator(foot(evaluator, x, y, self.u))
        speed = hypot(dx, dy)
        nx, ny = -dy / speed, dx / speed
        return nx * (x - px) + ny * (y - py), nx, ny, rx, ry

    def _distance(
        self, _mbs: Any, _t: float, _i: int, q: Sequence[float], _v: Sequence[float], _level: bool
    ) -> list[float]:
        return [self._foot(q)[0]]

    def _gradient(
        self, _mbs: Any, _t: float, _i: int, q: Sequence[float], _v: Sequence[float], _level: bool
    ) -> list[list[float]]:
        _, nx, ny, rx, ry = self._foot(q)
        turn = ny * rx - nx * ry
        if not self._carried:
            return [[0.0] * (len(q) - self._width) + [nx, ny, turn, 0.0][: self._width]]
        c, s = cos(q[2]), sin(q[2])
        nx, ny = c * nx - s * ny, s * nx + c * ny
        rx, ry = self._arm(q[5])
        x, y = q[3] + rx - q[0], q[4] + ry - q[1]
        return [[-nx, -ny, nx * y - ny * x, *[nx, ny, turn, 0.0][: self._width]]]

    # --- stepping ----------------------------------------------------------------------------

    def after_step(self, now: StepEnd, step: float) -> float:
        """Follow the point, change the piece at its end; return the next step (s)."""
        self.jumped = False
        x, y, vx, vy = self._motion(now.q_list, now.v_list)
        # Two Newton iterations from the extrapolated place are exact to rounding.
        evaluator = self.at[self.piece]
        self.u = foot(evaluator, x, y, self.u + self._u_rate * now.step, 2)
        _, _, dx, dy, _, _ = evaluator(self.u)
        square = dx * dx + dy * dy
        self._u_rate = (vx * dx + vy * dy) / square
        speed = sqrt(square)
        along = self._u_rate * speed  # m/s: positive in the direction of the curve
        rising = (along - self._along) / now.step if now.step > 0 else 0.0
        self._along = along
        if len(self.curve.pieces) == 1 and self.curve.closed:  # a smooth loop
            self._pass_seam(now.time)
            return self._limit(step, inf, along)
        until = self._until_end(speed, along, rising)
        if until > REACHED * now.step:
            return self._limit(step, until, along)
        if abs(along) * now.step <= PLACE_ROUNDING:  # at rest it changes no piece
            return step
        self._change_piece(1 if along > 0 else -1, now.time)
        return self._limit(step / 20, inf, along)

    def _motion(self, q: list[float], v: list[float]) -> tuple[float, float, float, float]:
        """Place (m) and velocity of the point in the axes of the curve."""
        i = self.row
        rx, ry = self._arm(q[i + 2])
        x, y, vx, vy = q[i] + rx, q[i + 1] + ry, v[i] - ry * v[i + 2], v[i + 1] + rx * v[i + 2]
        if not self._carried:
            return x, y, vx, vy
        k = 3 * self.slot.carrier
        c, s, omega = cos(q[k + 2]), sin(q[k + 2]), v[k + 2]
        x, y = x - q[k], y - q[k + 1]
        vx, vy = vx - v[k] + omega * y, vy - v[k + 1] - omega * x
        return c * x + s * y, c * y - s * x, c * vx + s * vy, c * vy - s * vx

    def _pass_seam(self, time: float) -> None:
        """Go on into another lap of a smooth closed piece; a point at rest on the seam stays."""
        piece = self.curve.pieces[0]
        beyond = NEGLIGIBLE * piece.period  # nearer to its seam, rounding decides on the side
        way = 1 if self.u >= piece.end + beyond else -1 if self.u < piece.start - beyond else 0
        if way:
            u = self.u - way * piece.period
            self.next_piece(way, time)
            self.u = u

    def _until_end(self, speed: float, along: float, rising: float) -> float:
        """Time (s) until the point reaches the end of the present piece; inf at rest."""
        if along == 0:
            return inf
        left = self.left(self.u)[0 if along > 0 else 1] * speed
        if left <= 0:
            return 0.0
        return first_zero(left, -abs(along), -rising if along > 0 else rising)

    def _change_piece(self, way: int, time: float) -> None:
        before = self.item_of_piece[self.piece]
        if not self.next_piece(way, time):
            self.at_end = True
            return
        item = self.item_of_piece[self.piece]
        self.jumped = item != before or item == self._general
        self._u_rate = 0.0
        self._activate(self.piece)

    def _limit(self, step: float, until: float, along: float) -> float:
        """Limit a step to a part of the piece, and let it end at the end of the piece."""
        longest = self._longest[self.piece] / max(abs(along), TINY)
        return end_on(min(step, longest), until)

    # --- forces ------------------------------------------------------------------------------

    def force(self, multipliers: FloatArray, poses: FloatArray, places: FloatArray) -> FloatArray:
        """Force (N, global axes) of the slot on its point, (samples, 2).

        `multipliers` (samples, rows) are those of the system, `poses` (samples, parts, 3) those of
        the parts, and `places` (samples,) those of the point. The multiplier of an inactive item is
        zero, so the items are summed.
        """
        positions = anchor_position(self.slot.anchor, poses)
        force = np.zeros_like(positions)
        for quadratic, item in self._native.items():
            row = self.system.multipliers(item)[0]
            gradient = np.array(quadratic.linear) + 2 * np.array(quadratic.quadratic) * positions
            force -= multipliers[:, row, None] * gradient
        if self._general is not None:
            row = self.system.multipliers(self._general)[0]
            normal = self.curve.normal(places)
            if self._carried:
                normal = turned(normal, poses[:, self.slot.carrier, 2])
            force -= multipliers[:, row, None] * normal
        return force

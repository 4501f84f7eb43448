"""Joints that close loops of a tree: their residuals, and all coordinates by the independent ones.

All closures hold parts of the same vector, the gap from a joint's first point to its second in axes
e that its first part carries, or the angle between both parts:

    w = e* (p_2 - p_1) - gamma(u),      theta = theta_2 - theta_1

Pins hold w at zero, and so do slots, with gamma(u) the place on the curve. Slides have e along
their line, and hold the imaginary part of w, and theta. Motors that move no coordinate of the tree
prescribe theta, or along a slide the real part. Gears hold sums of the tree's own coordinates. The
coordinates y are those of the tree, then the slots' places u. Rows are the real parts (m), then the
imaginary ones (m), then the angles (rad), then the gears (m; rad without pitch circles).

Generalised coordinate partitioning (R. A. Wehage and E. J. Haug, J. Mech. Des. 104 (1982) 247)
tells which coordinates depend on others. With residuals c(y, t) of the closures, pivoting their
Jacobian splits the coordinates y into dependent ones w, for which Newton's method solves c = 0, and
independent ones z:

    w' = -(c_w)^-1 (c_z z' + c_t),      w'' = -(c_w)^-1 (c_z z'' + gamma)

with gamma the second derivative of c without accelerations of z and w. Rows of c that others imply
are left out, and only checked.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from typing import NamedTuple

import numpy as np
from scipy.linalg import qr

from exudyn_flexlink.arrays import BoolArray, ComplexArray, FloatArray, IndexArray
from exudyn_flexlink.curves import Evaluator
from exudyn_flexlink.engines.exudyn.minimal.coordinates import LARGEST_TURN, TreeState
from exudyn_flexlink.engines.exudyn.minimal.kinematics import (
    LinkKinematics,
    Places,
    Points,
    TrackPoint,
    Transform,
)
from exudyn_flexlink.engines.track_follower import DeadCentreError
from exudyn_flexlink.integrate.collocation import collocation
from exudyn_flexlink.integrate.events import EVENT_TIME
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.integrate.stepper import OnSingularity
from exudyn_flexlink.mechanism import Anchor, Gear, Motor, Pin, Slide, Slot
from exudyn_flexlink.mechanism.tree import TreeLayout


class Track(NamedTuple):
    """Slots' curves at their places: points and derivatives by the parameter (n, slots)."""

    point: ComplexArray
    tangent: ComplexArray
    bend: ComplexArray


class Configuration(NamedTuple):
    """Places of links, and gaps of joints, at coordinates x of the tree (n, links).

    `points` (n, 2 gaps) are the first points of all gaps, then the second ones; `between` (n, gaps)
    are the vectors between them, and `axes` (n, gaps) those in which gaps are measured.
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
    `motors` and `gears` come with the number of their row; `angles` (rows,) is True for angles.
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
        moved = self.residual(np.zeros(1), self.configuration(at_start[None]))[0]
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

    def configuration(self, y: FloatArray) -> Configuration:
        """Configuration at coordinates (n, coordinates), slots on their present pieces."""
        if not self._tracked:
            return self.configuration_on(y, None)
        track = np.empty((3, len(y), len(self._followed)), dtype=complex)
        for k, point in enumerate(self._followed):
            track[:, :, k] = point.together(y[:, self._links + k])
        return self.configuration_on(y[:, : self._links], Track(*track))

    def configuration_on(self, x: FloatArray, track: Track | None) -> Configuration:
        """As `configuration`, at coordinates of the tree (n, links), with slots at `track`."""
        places = self._kinematics.places(x)
        points = self._points.places(places)
        axes = places.axis.take(self._bases, axis=1) * self._axes
        return Configuration(x, places, points, self._between(points), axes, track)

    def _between(self, points: ComplexArray) -> ComplexArray:
        return np.asarray(points[:, self._gaps :] - points[:, : self._gaps])

    def _rows(self, gaps: ComplexArray, turns: FloatArray) -> FloatArray:
        """Rows (n, rows, ...) by gaps (n, gaps, ...) and angles."""
        real, imaginary = gaps.real.take(self._real, axis=1), gaps.imag[:, : len(self.joints)]
        return np.concatenate([real, imaginary, turns], axis=1)

    def residual(self, t: FloatArray, at: Configuration) -> FloatArray:
        """By how much closures are open at instants (n,) s: (n, rows)."""
        gaps = at.axes.conj() * at.between
        if at.track is not None:
            gaps[:, self._tracked] -= at.track.point
        open_by = self._rows(gaps, at.x @ self._turning.T) - self._rest
        for row, motor in self.motors:
            open_by[:, row] -= motor.speed.integrals(t)
        return open_by

    def jacobian(self, at: Configuration) -> FloatArray:
        """Derivatives of the residuals by the coordinates (n, rows, coordinates)."""
        moves = self._kinematics.carries(at.places, at.points) * self._moved
        moved = self._between(moves)
        moved -= at.between[:, :, None] * self._spun_by
        moved *= at.axes.conj()[:, :, None]
        real, lengths = len(self._real), len(self._real) + len(self.joints)
        slopes = np.zeros((len(at.x), self.count, self._links + len(self._tracked)))
        by_tree = slopes[:, :, : self._links]
        by_tree[:, :real] = moved.real.take(self._real, axis=1)
        by_tree[:, real:lengths] = moved.imag[:, : len(self.joints)]
        by_tree[:, lengths:] = self._turning
        if at.track is not None:
            along, across = self._slot_rows
            slopes[:, along, self._by_places] = -at.track.tangent.real
            slopes[:, across, self._by_places] = -at.track.tangent.imag
        return slopes

    def rates(self, t: FloatArray) -> FloatArray:
        """Derivatives of the residuals by time alone (n, rows)."""
        columns = np.zeros((len(t), self.count))
        for row, motor in self.motors:
            columns[:, row] = -motor.speed.values(t)
        return columns

    def bends(self, t: FloatArray, at: Configuration, v: FloatArray, a: FloatArray) -> FloatArray:
        """Second derivatives of the residuals (n, rows), at speeds and accelerations."""
        tree, places = slice(0, self._links), at.places
        rates = self._kinematics.rates(places, at.x, v[:, tree])
        bends = self._kinematics.bends(places, rates, at.x, v[:, tree], a[:, tree])
        moving = self._between(self._points.rates(places, rates))
        gaps = self._between(self._points.bends(places, rates, bends))
        omega, alpha = (motion.angle.take(self._bases, axis=1) for motion in (rates, bends))
        gaps -= (1j * alpha + omega * omega) * at.between + 2j * omega * moving
        gaps *= at.axes.conj()
        if at.track is not None:
            place_rate, place_acceleration = v[:, self._links :], a[:, self._links :]
            gaps[:, self._tracked] -= (
                at.track.bend * place_rate**2 + at.track.tangent * place_acceleration
            )
        accelerated = self._rows(gaps, a[:, tree] @ self._turning.T)
        for row, motor in self.motors:
            accelerated[:, row] -= motor.speed.rates(t)
        return accelerated

    def forces(self, at: Configuration, multipliers: FloatArray) -> ComplexArray:
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
            sliding = layout.sliding_row(tie.slide)
            assert sliding is not None  # gears are of the tree's own joints
            row += weight * sliding
    return row


def _ends(joint: Pin | Slide | Slot) -> tuple[Anchor, Anchor]:
    """First and second point of a joint; of a slot the origin of its curve's axes, and its own."""
    if isinstance(joint, Slot):
        return Anchor(joint.carrier, 0.0, 0.0), joint.anchor
    return joint.first, joint.second


RANK = 1e-9  # of the largest pivot: a smaller one counts as zero
CLOSE = 1e-9  # of a step: instants so little before it are within
FARTHEST = 2.0  # lengths of a step: so far beyond its end its polynomial predicts coordinates
MOST_ITERATIONS = 12
# Of the mechanism's size: after so small a change Newton's method, which is quadratic except right
# at a dead centre, has converged.
QUADRATIC = 1e-9
OPEN = 1e-9  # m, or of the size for angles: redundant joints open by more contradict others
LENGTH_ROUNDING = 1e-14  # of the mechanism's size: rounding of sums of lengths

NOT_CLOSED = "the joints of a loop can't all stay closed"


class Partition(NamedTuple):
    """Indices of dependent and independent coordinates, and of the closures' rows in use."""

    dependent: IndexArray
    free: IndexArray
    rows: IndexArray


def partition(jacobian: FloatArray, known: IndexArray) -> Partition:
    """Choose by pivoting the closures' scaled Jacobian (rows, coordinates).

    The `known` coordinates are those of motors: neither independent nor dependent, and their
    columns are 0. Rows that others imply are left out.
    """
    upper, order = qr(jacobian, mode="r", pivoting=True)
    pivots = np.abs(np.diag(upper))
    rank = int(np.sum(pivots > RANK * pivots[0]))
    dependent = np.sort(order[:rank])
    rows = np.sort(qr(jacobian[:, dependent].T, mode="r", pivoting=True)[1][:rank])
    fixed = {*dependent.tolist(), *known.tolist()}
    free = np.array([i for i in range(jacobian.shape[1]) if i not in fixed], dtype=int)
    return Partition(dependent, free, rows)


class StepStages(NamedTuple):
    """Instants (stages,), s, independent coordinates z (stages, independent), and all y.

    `reach` (stages, all, independent) are the derivatives of y by z.
    """

    t: FloatArray
    z: FloatArray
    y: FloatArray
    reach: FloatArray

    def near(self, t: FloatArray, z: FloatArray) -> FloatArray | None:
        """Guess at all coordinates (n, all) at instants (n,), by the independent ones `z` there.

        None if an instant is far from the step: another way of closing the loops may be nearer.
        """
        if t is self.t or np.array_equal(t, self.t):
            return np.asarray(self.y + (self.reach @ (z - self.z)[:, :, None])[:, :, 0])
        method = collocation(len(self.t))
        h = max((self.t[-1] - self.t[0]) / (method.c[-1] - method.c[0]), EVENT_TIME)
        parts = 1 + (t - self.t[-1]) / h
        if parts.min() < -CLOSE or parts.max() > 1 + FARTHEST:
            return None
        weights = parts[:, None] ** method.degrees[:-1] @ method.by_stages
        _, coordinates, free = self.reach.shape
        reach = weights @ self.reach.reshape(len(self.t), coordinates * free)
        moved = reach.reshape(len(t), coordinates, free) @ (z - weights @ self.z)[:, :, None]
        return np.asarray(weights @ self.y + moved[:, :, 0])


class Placed(NamedTuple):
    """All coordinates y (n, all) at some instants, and how the dependent ones follow.

    `jacobian` (n, rows, all) is that of the rows in use, `inverse` that of its dependent columns;
    `reach` (n, all, independent) are the derivatives by the independent ones.
    """

    y: FloatArray
    at: Configuration
    jacobian: FloatArray
    inverse: FloatArray
    reach: FloatArray


class ClosureSolver:
    """Solves for the dependent coordinates of a mechanism of this `size` (m)."""

    def __init__(self, closures: Closures, size: float) -> None:
        self._closures, self._size = closures, size
        self.row_scale = np.where(closures.angles, size, 1.0)  # m by residuals

    def placed(self, t: FloatArray, y: FloatArray, split: Partition, lengths: FloatArray) -> Placed:
        """Close all loops, from coordinates `y` (n, all) on, which are overwritten.

        `lengths` (dependent,), m, are how far a unit of each dependent coordinate moves anything.

        Raises:
            DeadCentreError: there is no place near where all closures hold.

        """
        at, jacobian, inverse = self._closed(t, y, split, lengths)
        reach = np.zeros((*y.shape, len(split.free)))
        reach[:, split.free, np.arange(len(split.free))] = 1.0
        reach[:, split.dependent] = -inverse @ jacobian.take(split.free, axis=2)
        return Placed(y, at, jacobian, inverse, reach)

    def _closed(
        self, t: FloatArray, y: FloatArray, split: Partition, lengths: FloatArray
    ) -> tuple[Configuration, FloatArray, FloatArray]:
        """Configuration, Jacobian of the rows in use, and inverse of its dependent columns."""
        closures, size = self._closures, np.inf
        for rounds in count():
            at = closures.configuration(y)
            residual = closures.residual(t, at)
            jacobian = closures.jacobian(at).take(split.rows, axis=1)
            try:
                inverse = np.linalg.inv(jacobian.take(split.dependent, axis=2))
            except np.linalg.LinAlgError as error:
                raise DeadCentreError(NOT_CLOSED) from error
            if size <= QUADRATIC * self._size or rounds == MOST_ITERATIONS:
                break
            change = (inverse @ residual.take(split.rows, axis=1)[:, :, None])[:, :, 0]
            before, size = size, float(np.abs(change * lengths).max(initial=0.0))
            if not size < 2 * before or not np.isfinite(size):
                raise DeadCentreError(NOT_CLOSED)
            y[:, split.dependent] -= change
            if size <= LENGTH_ROUNDING * self._size:
                break
        if np.abs(residual * self.row_scale).max(initial=0.0) > OPEN * max(1.0, self._size):
            raise DeadCentreError(NOT_CLOSED)
        return at, jacobian, np.asarray(inverse)


LARGEST_GAIN = 3.0  # of dependent coordinates over independent ones, before others are chosen
# Gain from residuals to dependent coordinates: the relative error of accelerations grows with its
# square.
DEAD_CENTRE_GAIN = 1e2
JUMPED = 1e-2  # of the size: a step that ends so far from where its speeds lead took another way
UNSEEN = 1e-5  # as DEAD_CENTRE: below it accelerations have lost ten digits, and are not shown
CALM = 1e1  # as DEAD_CENTRE_GAIN: if all stages have less, no dead centre lies between them
DEAD_CENTRE = 1e-3  # smallest singular value of the scaled Jacobian: the mechanism is locked

AT_DEAD_CENTRE = "a loop of joints is at a dead centre, where it can move in more than one way"


class ClosedCoordinates:
    """Coordinates of a tree with loops; chosen anew where the dependent ones grow too fast."""

    def __init__(
        self,
        layout: TreeLayout,
        kinematics: LinkKinematics,
        start: tuple[FloatArray, FloatArray],
        points: Sequence[TrackPoint],
        lengths: FloatArray,
    ) -> None:
        """`lengths` (links,) are how far (m) a unit of each coordinate moves anything, at most."""
        self.points: Sequence[TrackPoint] = points
        self.closures = Closures(layout, kinematics, start[0], self.points)
        self._links, self._lengths = len(layout.links), lengths
        self._size = float(lengths.max())
        self._hinges = np.flatnonzero(kinematics.hinge)
        self._motors = [(link, *motor) for link, motor in layout.motors.items()]
        self._known = np.array(layout.known, dtype=int)
        self._prescribed = bool(layout.motors or self.closures.motors)
        self._start = start[0]
        self._solver = ClosureSolver(self.closures, self._size)
        self._pieces = [(point.changes, point.at) for point in self.points]
        self._time = 0.0
        self._y = np.concatenate([start[0], [point.u for point in self.points]])
        self._v = np.append(start[1], self._place_rates(start[1]))
        self._a = np.zeros(len(self._y))
        self._present_scale = self._scale(self._y)
        self._split = self._chosen()
        self._last: StepStages | None = None  # of the last step tried
        self._gains = np.zeros(1)  # m by residuals of 1 m, at those stages
        free = self._split.free
        start_state = self.states(np.zeros(1), self._y[None, free], self._v[None, free]).pick(0)
        self.settle(0.0, start_state, np.zeros(len(free)))

    def _place_rates(self, v: FloatArray) -> FloatArray:
        """Rates of the slots' places at time 0, from the tree's speeds (links,)."""
        jacobian = self.closures.jacobian(self.closures.configuration(self._y[None]))[0]
        passing = jacobian[:, : self._links] @ v + self.closures.rates(np.zeros(1))[0]
        return np.asarray(np.linalg.lstsq(jacobian[:, self._links :], -passing, rcond=None)[0])

    # --- which are independent ----------------------------------------------------------------

    def _scale(self, y: FloatArray) -> FloatArray:
        """How far (m) a unit of every coordinate moves anything."""
        places = zip(self.points, y[self._links :].tolist(), strict=True)
        return np.concatenate([self._lengths, [_stretch(point.at, u) for point, u in places]])

    def _jacobian(self, y: FloatArray) -> FloatArray:
        """Scaled Jacobian (rows, coordinates) of the unknown ones; columns of known ones are 0."""
        matrix = self.closures.jacobian(self.closures.configuration(y[None]))[0]
        matrix *= self._solver.row_scale[:, None] / self._scale(y)
        matrix[:, self._known] = 0.0
        return np.asarray(matrix)

    def _chosen(self) -> Partition:
        """Split the coordinates where the mechanism is now."""
        return partition(self._jacobian(self._y), self._known)

    def repartition_due(self) -> bool:
        """Tell whether other coordinates should be the independent ones."""
        return self._gain > LARGEST_GAIN and self._gain > 1.5 * self._gain_chosen

    def resume(self) -> None:
        """Choose the independent coordinates anew, and go on to the slots' present pieces."""
        for k, point in enumerate(self.points):
            changes, at = self._pieces[k]
            if changes == point.changes:
                continue
            i = self._links + k
            self._v[i] *= _stretch(at, self._y[i]) / _stretch(point.at, point.u)
            self._pieces[k], self._y[i] = (point.changes, point.at), point.u
        self._present_scale = self._scale(self._y)
        rank = len(self._split.dependent)
        split = self._chosen()
        # At a singular position the Jacobian has less rank than elsewhere.
        self._split = split if len(split.dependent) == rank else self._split
        self._last = None
        self._gain_chosen = self._gain = self._gain_at_end()

    def _gain_at_end(self) -> float:
        """How much more dependent coordinates move than independent ones where the tree is now."""
        split, scale = self._split, self._present_scale
        if not len(split.free):
            return 0.0
        if self._last is not None:
            reach = self._last.reach[-1, split.dependent]
        else:
            at = self.closures.configuration(self._y[None])
            matrix = self.closures.jacobian(at)[0, split.rows]
            reach = np.linalg.solve(matrix[:, split.dependent], matrix[:, split.free])
        gains = np.abs(reach * scale[split.dependent, None] / scale[split.free])
        return float(gains.max(initial=0.0))

    def independent(self) -> tuple[FloatArray, FloatArray]:
        """Independent coordinates and speeds where the last step ended."""
        return self._y[self._split.free], self._v[self._split.free]

    # --- all of them --------------------------------------------------------------------------

    def states(self, t: FloatArray, z: FloatArray, v: FloatArray) -> TreeState:
        """All coordinates at instants, from the independent ones and their speeds."""
        return self._moving(t, v, self._placed(t, self._guess(t, z)))

    def states_at_stages(self, t: FloatArray, z: FloatArray, v: FloatArray) -> TreeState:
        """As `states`, at the stages of a step that is tried: later searches begin near them."""
        try:
            placed = self._placed(t, self._guess(t, z))
        except DeadCentreError:
            self._last = None  # a shorter step, guessed from this one, would fail likewise
            raise
        self._last = StepStages(t, z, placed.y, placed.reach)
        lengths = self._present_scale[self._split.dependent]
        self._gains = np.abs(placed.inverse * lengths[:, None]).max((1, 2), initial=0.0)
        return self._moving(t, v, placed)

    def _placed(self, t: FloatArray, near: FloatArray) -> Placed:
        """All coordinates, searched from those `near` (n, all) on, which are overwritten."""
        return self._solver.placed(t, near, self._split, self._present_scale[self._split.dependent])

    def _moving(self, t: FloatArray, v: FloatArray, placed: Placed) -> TreeState:
        """Speeds, and accelerations that the independent coordinates do not cause."""
        dependent, rows, links = self._split.dependent, self._split.rows, self._links
        y, at, jacobian, inverse, reach = placed
        speeds, accelerations = (reach @ v[:, :, None])[:, :, 0], np.zeros(y.shape)
        if self._prescribed:
            given = np.zeros(y.shape)
            for link, motor, sign in self._motors:
                given[:, link] = sign * motor.speed.values(t)
                accelerations[:, link] = sign * motor.speed.rates(t)
            driven = (jacobian @ given[:, :, None])[:, :, 0] + self.closures.rates(t)[:, rows]
            given[:, dependent] -= (inverse @ driven[:, :, None])[:, :, 0]
            speeds += given
        bends = self.closures.bends(t, at, speeds, accelerations).take(rows, axis=1)
        accelerations[:, dependent] = -(inverse @ bends[:, :, None])[:, :, 0]
        return TreeState(
            y[:, :links],
            speeds[:, :links],
            accelerations[:, :links],
            y[:, links:],
            speeds[:, links:],
            Transform(reach[:, :links]),
        )

    def _guess(self, t: FloatArray, z: FloatArray) -> FloatArray:
        """Guess at all coordinates (n, all) by the independent ones `z`.

        By the stages of the last step tried, which may be the last round of this one; or, without
        those, by the state and the accelerations at the end of the last step.
        """
        y = None if self._last is None else self._last.near(t, z)
        if y is None:
            ahead = (t - self._time)[:, None]
            y = self._y + ahead * (self._v + 0.5 * ahead * self._a)
        y[:, self._split.free] = z
        for link, motor, sign in self._motors:
            y[:, link] = self._start[link] + sign * motor.speed.integrals(t)
        return y

    # --- steps --------------------------------------------------------------------------------

    def settle(self, time: float, end: TreeState, a: FloatArray) -> None:
        """Keep the end of a step, with the accelerations `a` of the independent coordinates."""
        self._time = time
        self._a = np.zeros(len(self._y))
        self._a[: self._links] = end.b + end.transform.expanded(a)
        self._y = np.concatenate([end.x, end.places])
        self._v = np.concatenate([end.v, end.place_rates])
        self._present_scale = self._scale(self._y)
        self._gain = self._gain_at_end()
        if time == 0.0:
            self._gain_chosen = self._gain

    def longest(self, at: TreeState) -> float:
        """Limit of a step, s: links turn by LARGEST_TURN at most."""
        fastest = float(np.abs(at.v[self._hinges]).max(initial=0.0))
        return LARGEST_TURN / fastest if fastest > 0 else np.inf

    def slipped(self, h: float, weights: FloatArray, stages: TreeState, start: TreeState) -> float:
        """How far (m) dependent and driven coordinates ended from where their speeds take them.

        They jumped to another way of closing the loops, or went round a bend that the step does not
        resolve: neither shows in the error of the independent coordinates.
        """
        before, after = (np.append(at.x, at.places) for at in (start, stages.pick(-1)))
        speeds = np.hstack([stages.v, stages.place_rates])
        off = np.abs(after - before - h * (weights @ speeds)) * self._present_scale
        # Near a dead centre rounding blurs dependent coordinates by this much.
        blur = LENGTH_ROUNDING * self._size * float(self._gains.max())
        followed = np.concatenate([self._split.dependent, self._known])
        slip = max(0.0, float(off[followed].max(initial=0.0)) - blur)
        if slip > JUMPED * self._size:
            self._last = None  # shorter steps, guessed from this one, would go the same way
        return slip

    def pushed(self, k: int, at: TreeState) -> FloatArray:
        """Accelerations (links, ways) where the curve pushes slot k's point by 1 m/s^2."""
        y, split = np.append(at.x, at.places), self._split
        push = np.zeros((self.closures.count, 2))
        push[self.closures.rows_of_slot(k)] = np.eye(2)
        matrix = self.closures.jacobian(self.closures.configuration(y[None]))[0]
        square = matrix[np.ix_(split.rows, split.dependent)]
        moved = np.zeros((len(y), 2))
        moved[split.dependent] = np.linalg.lstsq(square, push[split.rows], rcond=None)[0]
        return moved[: self._links]

    def held_by_loops(self, at: TreeState, forces: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Split `forces` (n, k, links) of constraints into those of closures and the rest.

        Returns the rest, and the forces (n, k, joints, 2) on the second points of joints that close
        loops.
        """
        y, split = np.hstack([at.x, at.places]), self._split
        at_state = self.closures.configuration(y)
        jacobian = self.closures.jacobian(at_state)
        square = jacobian[:, split.rows][:, :, split.dependent]
        whole = np.pad(forces, [(0, 0), (0, 0), (0, y.shape[1] - self._links)])
        multipliers = np.zeros((*forces.shape[:2], self.closures.count))
        # F = J^T of the closures times multipliers, on the dependent coordinates.
        multipliers[:, :, split.rows] = whole[:, :, split.dependent] @ np.linalg.inv(square)
        left = forces - multipliers @ jacobian[:, :, : self._links]
        forces_of_joints = [
            self.closures.forces(at_state, multipliers[:, k]) for k in range(forces.shape[1])
        ]
        return left, np.stack(
            [np.real(forces_of_joints), np.imag(forces_of_joints)], axis=-1
        ).swapaxes(0, 1)

    def on_dead_centre(self, at_stop: bool) -> OnSingularity:
        """Tell where the last step tried was all but at a dead centre."""
        most = 1 / UNSEEN if at_stop else DEAD_CENTRE_GAIN
        near = bool(self._gains.max() > DEAD_CENTRE_GAIN)
        return OnSingularity(near, bool(self._gains[-1] > most), near and self._turned_over())

    def _turned_over(self) -> bool:
        """Tell whether the determinant of the Jacobian changed its sign within the last step."""
        y = np.vstack([self._y, *([] if self._last is None else [self._last.y])])
        matrix = self.closures.jacobian(self.closures.configuration(y))[:, self._split.rows]
        return len(np.unique(np.linalg.slogdet(matrix[:, :, self._split.dependent])[0])) > 1

    def near_dead_centre(self, step: Step, t: FloatArray) -> BoolArray:
        """Tell at which instants (n,) within the last step two ways of closing the loops meet.

        There no speed follows from another, and no force from the motion.
        """
        if self._gains.max() < CALM:
            return np.zeros(len(t), dtype=bool)
        dependent = self._split.dependent
        matrix = self.closures.jacobian(self.closures.configuration(self._guess(t, step.at(t)[0])))
        square = matrix[:, self._split.rows][:, :, dependent] / self._present_scale[dependent]
        return np.asarray(np.linalg.svd(square, compute_uv=False).min(1, initial=np.inf) < UNSEEN)

    def locked(self, at: TreeState) -> str:
        """Say that the mechanism is all but at a dead centre; empty if it is not."""
        values = np.linalg.svd(self._jacobian(np.append(at.x, at.places)), compute_uv=False)
        locked = values[len(self._split.dependent) - 1] < DEAD_CENTRE
        return AT_DEAD_CENTRE if locked else ""


def _stretch(at: Evaluator, u: float) -> float:
    """Length (m) of a piece's curve per unit of its parameter."""
    return abs(complex(*at(u)[2:4]))

"""Joints that close loops of a tree: their residuals, and all coordinates by the independent ones.

All closures hold parts of the same vector, the gap from a joint's first point to its second in axes
e that its first part carries, or the angle between both parts:

    w = e* (p_2 - p_1) - gamma(u),      theta = theta_2 - theta_1

Pins hold w at zero, and so do slots, with gamma(u) the place on the curve. Slides have e along
their line, and hold the imaginary part of w, and theta. Motors that move no coordinate of the tree
prescribe theta, or along a slide the real part, as the way d of their drive. Gears hold sums of the
tree's own coordinates. The coordinates y are those of the tree, then the slots' places u, then the
ways d. Rows are the real parts (m), then the imaginary ones (m), then the angles (rad), then the
gears (m; rad without pitch circles). All of them are sums of the terms of `closure_terms`.

Generalised coordinate partitioning (R. A. Wehage and E. J. Haug, J. Mech. Des. 104 (1982) 247)
tells which coordinates depend on others. With residuals c(y) of the closures, pivoting their
Jacobian splits the coordinates y into dependent ones w, for which Newton's method solves c = 0,
independent ones z, and those k that motors prescribe:

    w' = -(c_w)^-1 (c_z z' + c_k k'),      w'' = -(c_w)^-1 (c_z z'' + c_k k'' + gamma)

with gamma the second derivative of c without accelerations. Rows of c that others imply are left
out, and only checked.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from typing import NamedTuple

import numpy as np
from scipy.linalg import qr

from exudyn_flexlink.arrays import BoolArray, ComplexArray, FloatArray, IndexArray
from exudyn_flexlink.curves import Evaluator
from exudyn_flexlink.engines.exudyn.minimal.closure_terms import Curves, Table, Terms
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeState
from exudyn_flexlink.engines.exudyn.minimal.kinematics import TrackPoint, Transform
from exudyn_flexlink.engines.track_follower import DeadCentreError
from exudyn_flexlink.integrate.events import EVENT_TIME
from exudyn_flexlink.integrate.radau import Step, collocation
from exudyn_flexlink.integrate.stepper import OnSingularity
from exudyn_flexlink.mechanism import GROUND, Anchor, Gear, Motor, Pin, Slide, Slot
from exudyn_flexlink.mechanism.tree import TreeLayout
from exudyn_flexlink.rounding import NEGLIGIBLE, SUM_ROUNDING


class Closures:
    """A layout's closures: what their rows are, and the terms that those are sums of.

    `joints` are all closures but motors and gears, `parts` the first and second part of each.
    `motors` and `gears` come with the number of their row; `scale` (rows,) tells how many metres a
    unit of a row counts. `rows` (rows, terms) are the weights of terms. The coordinates `known` are
    those that motors prescribe or that are held, then the ways of motors and gears. At time 0 they
    have the values `start`; `prescribed` motors then move them, each a tuple of the coordinate's
    number among the known ones, the motor, and a sign.
    """

    def __init__(
        self,
        layout: TreeLayout,
        start: FloatArray,
        followed: Sequence[TrackPoint],
        size: float,
    ) -> None:
        """`start` are the coordinates at time 0, `size` (m) is that of the mechanism."""
        self._followed = followed
        links, closures = len(layout.links), layout.closures
        joints = [joint for joint in closures if not isinstance(joint, Gear | Motor)]
        motors = [motor for motor in closures if isinstance(motor, Motor)]
        gears = [gear for gear in closures if isinstance(gear, Gear)]
        slides = [joint for joint in joints if isinstance(joint, Slide)]
        ends = [_ends(gap) for gap in [*joints, *(motor.slide for motor in motors if motor.slide)]]
        self._tracked = [k for k, joint in enumerate(joints) if isinstance(joint, Slot)]
        self.terms = Terms(layout, ends, self._tracked, len(motors) + len(gears))
        self.joints = joints
        self.parts = [(first.part, second.part) for first, second, _ in ends[: len(joints)]]
        turns = [layout.turning_row(GROUND, first) for first, _ in self.parts]
        self._turning = np.reshape(turns, (-1, links))
        self._axes = np.array([layout.turn(GROUND, first.part) + along for first, _, along in ends])

        # What each row holds of gaps and of angles, and how many metres a unit of it counts.
        real = np.eye(len(ends), dtype=complex)
        no_gap, no_turn = np.zeros(len(ends)), np.zeros(links)
        held = [
            gap for gap, joint in zip(real, joints, strict=False) if not isinstance(joint, Slide)
        ]
        rows = [(gap, no_turn, 1.0) for gap in [*held, *(1j * real[: len(joints)])]]
        turned = [(slide.first.part, slide.second.part) for slide in slides]
        rows += [(no_gap, layout.turning_row(*pair), size) for pair in turned]
        driven, slid = len(rows), iter(real[len(joints) :])
        for motor in motors:
            turned_by = no_gap, layout.turning_row(motor.first, motor.second), size
            rows.append((next(slid), no_turn, 1.0) if motor.slide else turned_by)
        for gear in gears:
            summed = layout.summed_row(gear.ties, gear.weights)
            rows.append((no_gap, summed, 1.0 if gear.in_newtons else size))
        self.motors = list(enumerate(motors, start=driven))
        self.gears = list(enumerate(gears, start=driven + len(motors)))
        self._held, turning, self.scale = (np.array(column) for column in zip(*rows, strict=True))
        self.rows = np.real(self._held.conj() @ self.terms.gaps)
        self.rows[:, :links] += turning
        count = self.terms.coordinates  # of coordinates; the term 1 follows them
        angles = [
            slide.angle - layout.turn(*pair) for slide, pair in zip(slides, turned, strict=True)
        ]
        self.rows[driven - len(slides) : driven, count] = np.negative(angles)
        drives = np.arange(count - len(rows) + driven, count)
        self.rows[driven:, drives] = -np.eye(len(drives))
        self._table = Table(self.terms, self.rows, np.arange(count))
        # Motors turn and slide on from where they start, and gears mesh as they do there.
        f = self._table.values(
            self.joined(start, np.array([point.u for point in followed]))[None], self.curves
        )
        ways = self._table.slopes(f)[0, driven:, -1]
        self.known = np.array([*layout.known, *drives], dtype=int)
        self.start = np.append(start[layout.known], ways)
        moved = {link: k for k, link in enumerate(layout.known)}
        self.prescribed = [(moved[link], *motor) for link, motor in layout.motors.items()]
        self.prescribed += [(k, motor, 1.0) for k, motor in enumerate(motors, start=len(moved))]

    @property
    def curves(self) -> Curves:
        """The present pieces of the slots' curves."""
        return [point.together for point in self._followed]

    def given(self, t: FloatArray) -> FloatArray:
        """Known coordinates, their speeds and accelerations (3, n, known), at instants (n,) s."""
        given = np.zeros((3, len(t), len(self.known)))
        given[0] = self.start
        for k, motor, sign in self.prescribed:
            motion = motor.speed.integrals(t), motor.speed.values(t), motor.speed.rates(t)
            given[:, :, k] += sign * np.array(motion)
        return given

    def rows_of_slot(self, k: int) -> IndexArray:
        """Rows of both parts of slot k's gap."""
        return np.flatnonzero(self._held[:, self._tracked[k]])

    def joined(self, x: FloatArray, places: FloatArray) -> FloatArray:
        """Coordinates (..., coordinates): the tree's, then the slots' places, then 0 for drives."""
        drives = np.zeros((*x.shape[:-1], len(self.motors) + len(self.gears)))
        return np.concatenate([x, places, drives], axis=-1)

    def jacobian(self, y: FloatArray, curves: Curves | None = None) -> FloatArray:
        """Derivatives (n, rows, coordinates) of the residuals at coordinates (n, coordinates).

        Slots are on their present pieces if no other `curves` are given.
        """
        f = self._table.values(y, self.curves if curves is None else curves)
        return self._table.slopes(f)[:, :, :-1]

    def forces(self, x: FloatArray, multipliers: FloatArray) -> ComplexArray:
        """Forces (..., joints), N, of joints on their second points, by multipliers (..., rows)."""
        axes = np.exp(1j * (x @ self._turning.T + self._axes))
        return np.asarray((axes * (multipliers @ self._held))[..., : len(self.joints)])


def _ends(joint: Pin | Slide | Slot) -> tuple[Anchor, Anchor, float]:
    """Both points of a joint, and the angle of its axes; of a slot first its curve's origin."""
    if isinstance(joint, Slot):
        return Anchor(joint.carrier, 0.0, 0.0), joint.anchor, 0.0
    return joint.first, joint.second, joint.direction if isinstance(joint, Slide) else 0.0


FARTHEST = 2.0  # lengths of a step: up to there beyond its end its polynomial predicts coordinates
MOST_ITERATIONS = 12

NOT_CLOSED = "the joints of a loop can't all stay closed"


class Partition(NamedTuple):
    """Indices of dependent and independent coordinates, and of the closures' rows in use."""

    dependent: IndexArray
    free: IndexArray
    rows: IndexArray


def partition(jacobian: FloatArray, known: IndexArray) -> Partition:
    """Choose by pivoting the closures' scaled Jacobian (rows, coordinates).

    The `known` coordinates are neither independent nor dependent, and their columns are 0. Rows
    that others imply are left out.
    """
    upper, order = qr(jacobian, mode="r", pivoting=True)
    pivots = np.abs(np.diag(upper))
    rank = int(np.sum(pivots > NEGLIGIBLE * pivots[0]))
    dependent = np.sort(order[:rank])
    rows = np.sort(qr(jacobian[:, dependent].T, mode="r", pivoting=True)[1][:rank])
    free = np.setdiff1d(np.arange(jacobian.shape[1]), [*dependent, *known])
    return Partition(dependent, free, rows)


class LoopSolution(NamedTuple):
    """Coordinates y (n, all) that close all loops at instants t (n,), s, from independent z.

    They are in the order of the partition: dependent ones w, independent ones, known ones. `terms`
    (n, terms) are those of the closures, `inverse` (n, dependent, dependent) is that of their
    Jacobian by w, and `reach` (n, dependent, others) are the derivatives of w by the others.
    """

    t: FloatArray
    z: FloatArray
    y: FloatArray
    terms: FloatArray
    inverse: FloatArray
    reach: FloatArray

    def near(self, t: FloatArray, z: FloatArray) -> FloatArray | None:
        """Guess at dependent coordinates (n, dependent) at instants (n,), from `z` at them.

        It extends the polynomial of a step, at whose stages the present coordinates are. None if an
        instant is far from the step: there the guess may lie nearer to another way of closing the
        loops.
        """
        reach = self.reach[:, :, : z.shape[1]]
        w = self.y[:, : reach.shape[1]]
        if t is self.t or np.array_equal(t, self.t):
            return np.asarray(w + (reach @ (z - self.z)[:, :, None])[:, :, 0])
        method = collocation(len(self.t))
        h = max((self.t[-1] - self.t[0]) / (method.c[-1] - method.c[0]), EVENT_TIME)
        parts = 1 + (t - self.t[-1]) / h
        if parts.min() < -NEGLIGIBLE or parts.max() > 1 + FARTHEST:
            return None
        weights = parts[:, None] ** method.degrees[:-1] @ method.by_stages
        reach = (weights @ reach.reshape(len(self.t), -1)).reshape(len(t), *reach.shape[1:])
        return np.asarray(weights @ w + (reach @ (z - weights @ self.z)[:, :, None])[:, :, 0])


class ClosureSolver:
    """Solves for the dependent coordinates of a partition, in a mechanism of this `size` (m).

    All coordinates are in the `order` of the partition: dependent, free, known. The rows of the
    `table` are those in use, then those that they imply.
    """

    def __init__(self, closures: Closures, split: Partition, size: float) -> None:
        self._closures, self._size = closures, size
        self.order = np.concatenate([split.dependent, split.free, closures.known])
        implied = np.setdiff1d(np.arange(len(closures.rows)), split.rows)
        rows = np.append(split.rows, implied)
        self._scale, self._redundant = closures.scale[rows], len(implied) > 0
        self.table = Table(closures.terms, closures.rows[rows], self.order)

    def squares(self, y: FloatArray, dependent: int) -> FloatArray:
        """Jacobian (n, dependent, dependent) of the rows in use by the dependent coordinates."""
        f = self.table.values(y, self._closures.curves)
        return self.table.slopes(f)[:, :dependent, :dependent]

    def placed(
        self, t: FloatArray, z: FloatArray, y: FloatArray, lengths: FloatArray
    ) -> LoopSolution:
        """Close all loops, from coordinates `y` (n, all) on, which are overwritten.

        `lengths` (dependent,), m, are how far a unit of each dependent coordinate moves anything.

        Raises:
            DeadCentreError: there is no place near where all closures hold.

        """
        curves, dependent, size = self._closures.curves, len(lengths), np.inf
        for rounds in count():
            f = self.table.values(y, curves)
            slopes = self.table.slopes(f)
            try:
                inverse = np.linalg.inv(slopes[:, :dependent, :dependent])
            except np.linalg.LinAlgError as error:
                raise DeadCentreError(NOT_CLOSED) from error
            # By free and known coordinates, and by how much the rows are open.
            solved = inverse @ slopes[:, :dependent, dependent:]
            # Newton's method, quadratic but right at a dead centre, has converged.
            if size <= NEGLIGIBLE * self._size or rounds == MOST_ITERATIONS:
                break
            change = solved[:, :, -1]
            moved = change * lengths
            before, size = size, float(np.sqrt(np.vdot(moved, moved)))
            if not size < 2 * before:
                raise DeadCentreError(NOT_CLOSED)
            y[:, :dependent] -= change
            if size <= SUM_ROUNDING * self._size:
                break
        if self._redundant or rounds == MOST_ITERATIONS:
            open_by = np.abs(slopes[:, :, -1] * self._scale).max(initial=0.0)
            if open_by > NEGLIGIBLE * max(1.0, self._size):  # they contradict others
                raise DeadCentreError(NOT_CLOSED)
        return LoopSolution(t, z, y, f, np.asarray(inverse), -solved[:, :, :-1])


LARGEST_GAIN = 3.0  # of dependent coordinates over independent ones, before others are chosen
# Gain from residuals to dependent coordinates: the relative error of accelerations grows with its
# square.
DEAD_CENTRE_GAIN = 1e2
JUMPED = 1e-2  # of the size: a step that ends farther from where its speeds lead has jumped
UNSEEN = 1e-5  # as DEAD_CENTRE: below it accelerations have lost ten digits, and are not shown
CALM = 1e1  # as DEAD_CENTRE_GAIN: if all stages have less, no dead centre lies between them
DEAD_CENTRE = 1e-3  # smallest singular value of the scaled Jacobian: the mechanism is locked

AT_DEAD_CENTRE = "a loop of joints is at a dead centre, where it can move in more than one way"


class ClosedCoordinates:
    """Coordinates of a tree with loops; chosen anew where the dependent ones grow too fast."""

    def __init__(
        self,
        layout: TreeLayout,
        start: tuple[FloatArray, FloatArray],
        points: Sequence[TrackPoint],
        lengths: FloatArray,
    ) -> None:
        """`lengths` (links,) are how far (m) a unit of each coordinate moves anything, at most."""
        self.points: Sequence[TrackPoint] = points
        self._links, self._lengths = len(layout.links), lengths
        self._size = float(lengths.max())
        self._slots = slice(self._links, self._links + len(points))
        self.closures = Closures(layout, start[0], self.points, self._size)
        self._pieces = [(point.changes, point.at) for point in self.points]
        self._time = 0.0
        self._y = self.closures.joined(start[0], np.array([point.u for point in self.points]))
        self._v = self._speeds(start[1])
        self._a = np.zeros(len(self._y))
        self._present_scale = self._scale(self._y)
        self._choose(partition(self._jacobian(self._y), self.closures.known))
        z, v = self.independent()
        state = self.states_at_stages(np.zeros(1), z[None], v[None])
        self._last: LoopSolution | None = None  # of the last step tried; none was yet
        if self._gains.max() > 1 / UNSEEN:  # independent coordinates determine no speeds, no forces
            raise DeadCentreError(AT_DEAD_CENTRE)
        self.settle(0.0, state.pick(0), np.zeros(len(z)))

    def _speeds(self, v: FloatArray) -> FloatArray:
        """Speeds of all coordinates at time 0, from those of the tree (links,)."""
        speeds = self.closures.joined(v, np.zeros(len(self.points)))
        speeds[self.closures.known] = self.closures.given(np.zeros(1))[1, 0]
        jacobian = self.closures.jacobian(self._y[None])[0]
        by_places, open_by = jacobian[:, self._slots], jacobian @ speeds
        speeds[self._slots] = -np.linalg.lstsq(by_places, open_by, rcond=None)[0]
        return speeds

    # --- which are independent ----------------------------------------------------------------

    def _scale(self, y: FloatArray) -> FloatArray:
        """How far (m) a unit of every coordinate moves anything."""
        places = zip(self.points, y[self._slots].tolist(), strict=True)
        stretches = np.array([_stretch(point.at, u) for point, u in places])
        return self.closures.joined(self._lengths, stretches)

    def _jacobian(self, y: FloatArray) -> FloatArray:
        """Scaled Jacobian (rows, coordinates); the columns of known coordinates are 0."""
        scale = self._scale(y)
        scale[self.closures.known] = np.inf
        return np.asarray(self.closures.jacobian(y[None])[0] * self.closures.scale[:, None] / scale)

    def _choose(self, split: Partition) -> None:
        """Take these coordinates as the independent ones."""
        self._split = split
        self._solver = ClosureSolver(self.closures, split, self._size)
        self._last = None
        # Where the coordinates of the tree and of slots are among those of the solver.
        self._place = np.argsort(self._solver.order)[: self._slots.stop]
        self._picked = np.eye(len(split.free))

    def repartition_due(self) -> bool:
        """Tell whether other coordinates should be the independent ones."""
        return self._gain > LARGEST_GAIN and self._gain > 1.5 * self._gain_chosen

    def resume(self) -> None:
        """Choose the independent coordinates anew, and go on to the slots' present pieces."""
        for k, point in enumerate(self.points):
            changes, before = self._pieces[k]
            if changes == point.changes:
                continue
            i = self._links + k
            self._v[i] *= _stretch(before, self._y[i]) / _stretch(point.at, point.u)
            self._pieces[k], self._y[i] = (point.changes, point.at), point.u
        self._present_scale = self._scale(self._y)
        split = partition(self._jacobian(self._y), self.closures.known)
        # At a singular position the Jacobian has less rank than elsewhere.
        full_rank = len(split.dependent) == len(self._split.dependent)
        self._choose(split if full_rank else self._split)
        self._gain_chosen = self._gain = self._gain_at_end()

    def _gain_at_end(self) -> float:
        """Largest ratio of motions of dependent and independent coordinates, in this state."""
        (dependent, free, rows), scale = self._split, self._present_scale
        if self._last is not None:
            reach = self._last.reach[-1, :, : len(free)]
            gains = reach * scale[dependent, None] / scale[free]
        else:
            matrix = self._jacobian(self._y)[rows]
            gains = np.asarray(np.linalg.solve(matrix[:, dependent], matrix[:, free]))
        return float(np.abs(gains).max(initial=0.0))

    @property
    def numbers(self) -> IndexArray:
        """Numbers of the independent coordinates: links come first, then points."""
        return self._split.free

    def independent(self) -> tuple[FloatArray, FloatArray]:
        """Independent coordinates and speeds where the last step ended."""
        return self._y[self._split.free], self._v[self._split.free]

    # --- all of them --------------------------------------------------------------------------

    def states(self, t: FloatArray, z: FloatArray, v: FloatArray) -> TreeState:
        """All coordinates at instants, from the independent ones and their speeds."""
        given = self.closures.given(t)
        return self._moving(t, v, given, self._placed(t, z, given))

    def states_at_stages(self, t: FloatArray, z: FloatArray, v: FloatArray) -> TreeState:
        """As `states`, at the stages of a step that is tried; later guesses start from them."""
        given = self.closures.given(t)
        try:
            self._last = self._placed(t, z, given)
        except DeadCentreError:
            self._last = None  # a shorter step, guessed from this one, would fail likewise
            raise
        # How far (m) residuals of 1 m move dependent coordinates (n,).
        moved = self._last.inverse * self._present_scale[self._split.dependent, None]
        self._gains = np.asarray(np.abs(moved).reshape(len(t), -1).max(1, initial=0.0))
        return self._moving(t, v, given, self._last)

    def _placed(self, t: FloatArray, z: FloatArray, given: FloatArray) -> LoopSolution:
        """All coordinates at instants, from the independent and the known ones."""
        lengths = self._present_scale[self._split.dependent]
        return self._solver.placed(t, z, self._guess(t, z, given), lengths)

    def _moving(
        self, t: FloatArray, v: FloatArray, given: FloatArray, placed: LoopSolution
    ) -> TreeState:
        """Speeds, and accelerations that the independent coordinates do not cause."""
        (instants, dependent, _), free = placed.reach.shape, v.shape[1]
        known, links = dependent + free, self._links  # index of the first known coordinate
        # Coordinates, speeds, accelerations, and derivatives by each independent coordinate.
        columns = np.zeros((instants, placed.y.shape[1], 3 + free))
        columns[:, :, 0], columns[:, dependent:known, 1] = placed.y, v
        columns[:, known:, 1:3] = given[1:].transpose(1, 2, 0)
        columns[:, dependent:known, 3:] = self._picked
        columns[:, :dependent, 1:] = placed.reach @ columns[:, dependent:, 1:]
        bends = self._solver.table.bends(placed.terms, columns[:, :, 1])[:, :dependent, None]
        columns[:, :dependent, 2] -= (placed.inverse @ bends)[:, :, 0]
        columns = columns.take(self._place, axis=1)
        x, speeds, accelerations = columns[:, :links, :3].transpose(2, 0, 1)
        places, place_rates = columns[:, links:, :2].transpose(2, 0, 1)
        transform = Transform(columns[:, :links, 3:])
        return TreeState(x, speeds, accelerations, places, place_rates, transform, t)

    def _guess(self, t: FloatArray, z: FloatArray, given: FloatArray) -> FloatArray:
        """Guess at all coordinates (n, all) by the independent and the known ones.

        It starts from the stages of the last step tried, which may be an earlier round of the same
        step. Without them it starts from the state and the accelerations at the end of the last
        step.
        """
        near = None if self._last is None else self._last.near(t, z)
        if near is None:
            ahead = (t - self._time)[:, None]
            near = self._y + ahead * (self._v + 0.5 * ahead * self._a)
            near = near[:, self._split.dependent]
        return np.concatenate([near, z, given[0]], axis=1)

    # --- steps --------------------------------------------------------------------------------

    def settle(self, time: float, end: TreeState, a: FloatArray) -> None:
        """Keep the end of a step, with the accelerations `a` of the independent coordinates."""
        self._time = time
        self._a[: self._links] = end.b + end.transform.expanded(a)
        self._y = self.closures.joined(end.x, end.places)
        self._v = self.closures.joined(end.v, end.place_rates)
        self._present_scale = self._scale(self._y)
        self._gain = self._gain_at_end()
        if time == 0.0:
            self._gain_chosen = self._gain

    def slipped(self, h: float, weights: FloatArray, stages: TreeState, start: TreeState) -> float:
        """How far (m) dependent and driven coordinates ended from where their speeds take them.

        Such coordinates jumped to another way of closing the loops, or went round a bend that the
        step does not resolve. The error of the independent coordinates shows neither.
        """
        joined, split = self.closures.joined, self._split
        before, after = (joined(state.x, state.places) for state in (start, stages.pick(-1)))
        speeds = joined(stages.v, stages.place_rates)
        off = np.abs(after - before - h * (weights @ speeds)) * self._present_scale
        # Near a dead centre rounding blurs dependent coordinates by this much.
        blur = SUM_ROUNDING * self._size * float(self._gains.max())
        off[split.free] = 0.0
        slip = max(0.0, float(off.max(initial=0.0)) - blur)
        if slip > JUMPED * self._size:
            self._last = None  # shorter steps, guessed from this one, would go the same way
        return slip

    def pushed(self, k: int, state: TreeState) -> FloatArray:
        """Accelerations (links, 2) if the curve moves slot k's point by 1 m/s^2 in x, or in y."""
        y, (dependent, _, rows) = self.closures.joined(state.x, state.places), self._split
        push = np.zeros((len(self.closures.rows), 2))
        push[self.closures.rows_of_slot(k)] = np.eye(2)
        square = self.closures.jacobian(y[None])[0][np.ix_(rows, dependent)]
        moved = np.zeros((len(y), 2))
        moved[dependent] = np.linalg.lstsq(square, push[rows], rcond=None)[0]
        return moved[: self._links]

    def held_by_loops(self, state: TreeState, forces: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Split `forces` (n, k, links) of constraints into those of closures and the rest.

        Returns the rest, and the forces (n, k, joints, 2) on the second points of joints that close
        loops.
        """
        y, (dependent, _, rows) = self.closures.joined(state.x, state.places), self._split
        jacobian = self.closures.jacobian(y)
        square = jacobian[:, rows][:, :, dependent]
        whole = np.pad(forces, [(0, 0), (0, 0), (0, y.shape[1] - self._links)])
        multipliers = np.zeros((*forces.shape[:2], len(self.closures.rows)))
        # F = J^T of the closures times multipliers, on the dependent coordinates.
        multipliers[:, :, rows] = whole[:, :, dependent] @ np.linalg.inv(square)
        rest = forces - multipliers @ jacobian[:, :, : self._links]
        held = self.closures.forces(state.x[:, None], multipliers)
        return rest, np.stack([held.real, held.imag], axis=-1)

    def on_dead_centre(self, at_stop: bool) -> OnSingularity:
        """Tell where the last step tried came close to a dead centre."""
        most, gains = 1 / UNSEEN if at_stop else DEAD_CENTRE_GAIN, self._gains
        near = bool(gains.max() > DEAD_CENTRE_GAIN)
        return OnSingularity(near, bool(gains[-1] > most), near and self._turned_over())

    def _turned_over(self) -> bool:
        """Tell whether the determinant of the Jacobian changed its sign within the last step."""
        y = self._y[None, self._solver.order]
        y = y if self._last is None else np.vstack([y, self._last.y])
        squares = self._solver.squares(y, len(self._split.dependent))
        return len(np.unique(np.linalg.slogdet(squares)[0])) > 1

    def near_dead_centre(self, step: Step, t: FloatArray) -> BoolArray:
        """Tell at which instants (n,) of the last step the mechanism is close to a dead centre.

        There two ways of closing the loops meet: independent coordinates determine neither the
        other speeds nor the forces.
        """
        if self._gains.max() < CALM:
            return np.zeros(len(t), dtype=bool)
        lengths = self._present_scale[self._split.dependent]
        y = self._guess(t, step.at(t)[0], self.closures.given(t))
        square = self._solver.squares(y, len(lengths)) / lengths
        return np.asarray(np.linalg.svd(square, compute_uv=False).min(1, initial=np.inf) < UNSEEN)

    def locked(self, state: TreeState) -> str:
        """Say that the mechanism is close to a dead centre; empty if it is not."""
        y = self.closures.joined(state.x, state.places)
        values = np.linalg.svd(self._jacobian(y), compute_uv=False)
        locked = values[len(self._split.dependent) - 1] < DEAD_CENTRE
        return AT_DEAD_CENTRE if locked else ""


def _stretch(evaluator: Evaluator, u: float) -> float:
    """Length (m) of a piece's curve per unit of its parameter."""
    return abs(complex(*evaluator(u)[2:4]))

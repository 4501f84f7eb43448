"""All coordinates of a tree whose loops are closed, from the independent ones.

Generalised coordinate partitioning (R. A. Wehage and E. J. Haug, J. Mech. Des. 104 (1982) 247):
with residuals c(y, t) of the closures, pivoting their Jacobian splits the coordinates y, those of
the tree and the slots' places, into dependent ones w, for which c = 0 is solved by Newton's method,
and independent ones z:

    w' = -(c_w)^-1 (c_z z' + c_t),      w'' = -(c_w)^-1 (c_z z'' + gamma)

with gamma the second derivative of c without accelerations of z and w. Rows of c that others imply
are left out, and only checked.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray
from exudyn_flexlink.curves import Evaluator
from exudyn_flexlink.engines.exudyn.minimal.closure_solver import (
    ROUNDING,
    ClosureSolver,
    Partition,
    Placed,
    StepStages,
    partition,
)
from exudyn_flexlink.engines.exudyn.minimal.closures import Closures
from exudyn_flexlink.engines.exudyn.minimal.coordinates import LARGEST_TURN, TreeState
from exudyn_flexlink.engines.exudyn.minimal.guided import TrackPoint
from exudyn_flexlink.engines.exudyn.minimal.kinematics import LinkKinematics, Transform
from exudyn_flexlink.engines.track_follower import DeadCentreError
from exudyn_flexlink.integrate.collocation import STAGES
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.mechanism.tree import TreeLayout

LARGEST_GAIN = 3.0  # of dependent coordinates over independent ones, before others are chosen
SINGULAR = 1e2  # of residuals in dependent coordinates: accelerations lose its square in digits
JUMPED = 1e-2  # of the size: a step that ends so far from where its speeds lead took another way
UNSEEN = 1e-5  # as DEAD_CENTRE: nearer to one accelerations have lost ten digits, and are not shown
CALM = 1e1  # likewise: where all stages have less, no dead centre lies between them
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
        self._scale_here = self._scale(self._y)
        self._split = self._chosen()
        self._last: StepStages | None = None  # of the last step tried
        self._gains = np.zeros(1)  # m by residuals of 1 m, at those stages
        free = self._split.free
        start_of = self.states(np.zeros(1), self._y[None, free], self._v[None, free]).pick(0)
        self.settle(0.0, start_of, np.zeros(len(free)))

    def _place_rates(self, v: FloatArray) -> FloatArray:
        """Rates of the slots' places at time 0, from the tree's speeds (links,)."""
        jacobian = self.closures.jacobian(self.closures.where(self._y[None]))[0]
        passing = jacobian[:, : self._links] @ v + self.closures.rates(np.zeros(1))[0]
        return np.asarray(np.linalg.lstsq(jacobian[:, self._links :], -passing, rcond=None)[0])

    # --- which are independent ----------------------------------------------------------------

    def _scale(self, y: FloatArray) -> FloatArray:
        """How far (m) a unit of every coordinate moves anything."""
        places = zip(self.points, y[self._links :].tolist(), strict=True)
        return np.concatenate([self._lengths, [_stretch(point.at, u) for point, u in places]])

    def _jacobian(self, y: FloatArray) -> FloatArray:
        """Scaled Jacobian (rows, coordinates) of the unknown ones; columns of known ones are 0."""
        matrix = self.closures.jacobian(self.closures.where(y[None]))[0]
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
        self._scale_here = self._scale(self._y)
        rank = len(self._split.dependent)
        split = self._chosen()
        # At a singular position the Jacobian has less rank than elsewhere.
        self._split = split if len(split.dependent) == rank else self._split
        self._last = None
        self._gain_chosen = self._gain = self._gain_at_end()

    def _gain_at_end(self) -> float:
        """How much more dependent coordinates move than independent ones where the tree is now."""
        split, scale = self._split, self._scale_here
        if not len(split.free):
            return 0.0
        if self._last is not None:
            reach = self._last.reach[-1, split.dependent]
        else:
            matrix = self.closures.jacobian(self.closures.where(self._y[None]))[0, split.rows]
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
        own = slice(STAGES)  # the stages, without what lies beside one
        self._last = StepStages(t[own], z[own], placed.y[own], placed.reach[own])
        lengths = self._scale_here[self._split.dependent]
        self._gains = np.abs(placed.inverse[own] * lengths[:, None]).max((1, 2), initial=0.0)
        return self._moving(t, v, placed)

    def _placed(self, t: FloatArray, near: FloatArray) -> Placed:
        """All coordinates, searched from those `near` (n, all) on, which are overwritten."""
        return self._solver.placed(t, near, self._split, self._scale_here[self._split.dependent])

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
        """Coordinates near those at the independent ones.

        From the last round of the same step, by the stages of the last step tried, or ahead of
        where the last one ended.
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
        """A step ended here, with these accelerations of the independent coordinates."""
        self._time = time
        self._a = np.zeros(len(self._y))
        self._a[: self._links] = end.b + end.transform.expanded(a)
        self._y = np.concatenate([end.x, end.places])
        self._v = np.concatenate([end.v, end.place_rates])
        self._scale_here = self._scale(self._y)
        self._gain = self._gain_at_end()
        if time == 0.0:
            self._gain_chosen = self._gain

    def longest(self, at: TreeState) -> float:
        """Limit of a step, s: links turn a little."""
        fastest = float(np.abs(at.v[self._hinges]).max(initial=0.0))
        return LARGEST_TURN / fastest if fastest > 0 else np.inf

    def slipped(self, h: float, weights: FloatArray, stages: TreeState, start: TreeState) -> float:
        """How far what follows others, or a motor, ended a step from where its speeds take it.

        It jumped to another way of closing the loops, or went round a bend that the step does not
        resolve: neither shows in the error of the coordinates solved for.
        """
        before, after = (np.append(at.x, at.places) for at in (start, stages.pick(-1)))
        speeds = np.hstack([stages.v, stages.place_rates])
        off = np.abs(after - before - h * (weights @ speeds)) * self._scale_here
        # Near a dead centre dependent coordinates are known to so much only.
        blur = ROUNDING * self._size * float(self._gains.max())
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
        matrix = self.closures.jacobian(self.closures.where(y[None]))[0]
        square = matrix[np.ix_(split.rows, split.dependent)]
        moved = np.zeros((len(y), 2))
        moved[split.dependent] = np.linalg.lstsq(square, push[split.rows], rcond=None)[0]
        return moved[: self._links]

    def held_by_loops(self, at: TreeState, forces: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What `forces` (n, k, links) of constraints leave on coordinates but for the closures'.

        Those are told as well: (n, k, joints, 2) on the second points of joints that close loops.
        """
        y, split = np.hstack([at.x, at.places]), self._split
        where = self.closures.where(y)
        jacobian = self.closures.jacobian(where)
        square = jacobian[:, split.rows][:, :, split.dependent]
        whole = np.pad(forces, [(0, 0), (0, 0), (0, y.shape[1] - self._links)])
        multipliers = np.zeros((*forces.shape[:2], self.closures.count))
        # F = J^T of the closures times multipliers, on the dependent coordinates.
        multipliers[:, :, split.rows] = whole[:, :, split.dependent] @ np.linalg.inv(square)
        left = forces - multipliers @ jacobian[:, :, : self._links]
        own = [self.closures.forces(where, multipliers[:, k]) for k in range(forces.shape[1])]
        return left, np.stack([np.real(own), np.imag(own)], axis=-1).swapaxes(0, 1)

    def on_dead_centre(self, at_stop: bool) -> tuple[bool, bool, bool]:
        """Tell whether a stage, and whether the end, of the last step tried all but fell on one."""
        most = 1 / UNSEEN if at_stop else SINGULAR
        near = bool(self._gains.max() > SINGULAR)
        return near, bool(self._gains[-1] > most), near and self._turned_over()

    def _turned_over(self) -> bool:
        """Tell whether the determinant of the Jacobian changed its sign within the last step."""
        y = np.vstack([self._y, *([] if self._last is None else [self._last.y])])
        matrix = self.closures.jacobian(self.closures.where(y))[:, self._split.rows]
        return len(np.unique(np.linalg.slogdet(matrix[:, :, self._split.dependent])[0])) > 1

    def near_dead_centre(self, step: Step, t: FloatArray) -> BoolArray:
        """Tell at which instants (n,) within the last step two ways of closing the loops meet.

        There no speed follows from another, and no force from the motion.
        """
        if self._gains.max() < CALM:
            return np.zeros(len(t), dtype=bool)
        dependent = self._split.dependent
        matrix = self.closures.jacobian(self.closures.where(self._guess(t, step.at(t)[0])))
        square = matrix[:, self._split.rows][:, :, dependent] / self._scale_here[dependent]
        return np.asarray(np.linalg.svd(square, compute_uv=False).min(1, initial=np.inf) < UNSEEN)

    def locked(self, at: TreeState) -> str:
        """Say that the mechanism is all but at a dead centre; empty if it is not."""
        values = np.linalg.svd(self._jacobian(np.append(at.x, at.places)), compute_uv=False)
        locked = values[len(self._split.dependent) - 1] < DEAD_CENTRE
        return AT_DEAD_CENTRE if locked else ""


def _stretch(at: Evaluator, u: float) -> float:
    """Length (m) of a piece's curve per unit of its parameter."""
    return abs(complex(*at(u)[2:4]))

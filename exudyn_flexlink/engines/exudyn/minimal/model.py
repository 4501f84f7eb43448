"""The tree as one Exudyn item, whose mass matrix and forces are reduced to free coordinates.

Exudyn evaluates the tree's mass matrix, its inertial forces, springs, dampers and weight. Here the
coordinates that motors, slots and loops tie to others are eliminated. With ``x'' = T z'' + b`` the
independent coordinates z obey ``T^T M T z'' = T^T (f - M b)``. The residual ``M x'' - f`` of the
full equations are the constraint forces of motors, slots and loops.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.engines.exudyn.engine import Engine, items
from exudyn_flexlink.engines.exudyn.minimal.closures import ClosedCoordinates
from exudyn_flexlink.engines.exudyn.minimal.contacts import ContactPush, TreeContacts
from exudyn_flexlink.engines.exudyn.minimal.coordinates import (
    OpenCoordinates,
    TreeCoordinates,
    TreeState,
    tree_item,
)
from exudyn_flexlink.engines.exudyn.minimal.friction import JointFrictions, LockedError
from exudyn_flexlink.engines.exudyn.minimal.kinematics import (
    LinkKinematics,
    Points,
    SlotGuide,
    TrackPoint,
    Transform,
    Which,
    falls,
    picked,
    start_coordinates,
)
from exudyn_flexlink.engines.exudyn.minimal.loads import Loads, Springs
from exudyn_flexlink.engines.exudyn.minimal.rigid import JammedError, Projector, RigidContacts
from exudyn_flexlink.engines.finer import seeded
from exudyn_flexlink.engines.touching import Touches, press_by
from exudyn_flexlink.expressions import NoValueError
from exudyn_flexlink.integrate.problem import Evaluation, Press, Window
from exudyn_flexlink.mechanism import Anchor, Assembly
from exudyn_flexlink.mechanism.tree import TreeLayout
from exudyn_flexlink.result import Event

TROUBLES = NoValueError, LockedError, JammedError
"""Errors of equations without a solution; each has an `advice`."""

States = Callable[[FloatArray, FloatArray, FloatArray], TreeState]
"""Returns all coordinates for instants, independent coordinates and their speeds."""


class TreeForces(NamedTuple):
    """Mass matrix and forces of the tree at one instant; for several, with one more, first axis."""

    t: FloatArray
    state: TreeState
    mass: FloatArray  # (links, links)
    force: FloatArray  # (links,)
    pushes: FloatArray  # (contacts and pairs, 2): pressing force, N, and the power it takes, W
    friction: FloatArray  # (joints, 4): torque or force of friction, bound, press, 1 if it rests
    push: ContactPush | None  # of the contacts and pairs of link and guide that press
    supply: FloatArray  # power of torques and forces, W

    def pick(self, which: Which) -> TreeForces:
        """Return the forces at one of several instants, or at some: see `coordinates.TreeState`."""
        return TreeForces._make(picked(column, which) for column in self)


class MinimalModel:
    """An Exudyn system with one tree. It evaluates equations, and solves none."""

    def __init__(
        self, assembly: Assembly, layout: TreeLayout, events: list[Event], *, seed: bool = False
    ) -> None:
        self.assembly, self.layout, self.events = assembly, layout, events
        mechanism = assembly.mechanism
        self.start = start_coordinates(layout, assembly)
        self.kinematics = LinkKinematics(layout)
        # A part may turn about any of its points, so that an angle can move every point.
        outlines = [((0.0, 0.0), *part.points) for part in mechanism.parts]
        self._points = Points(
            layout, [Anchor(i, *anchor) for i, points in enumerate(outlines) for anchor in points]
        )
        # How far (m) a unit of each coordinate moves a point.
        lengths = np.abs(self._moves_of_points(self.start[0])).max(0, initial=0.0)
        self._lengths = np.maximum(lengths, 1e-3 * lengths.max(initial=1.0))
        if seed:
            self.start = seeded(assembly, self.start, self._lengths)
        self.coordinates = self._coordinates(events)
        self.all_springs = Springs(layout, self.kinematics, mechanism)
        self.loads = Loads(layout, self.kinematics, mechanism)
        self.window = Window()
        self.trouble: tuple[float, Any] | None = (
            None  # instant (s) and error of the last evaluation that failed
        )
        self.contacts = TreeContacts(layout, self.kinematics, mechanism, events)
        self.touches = Touches(self.contacts.all, self.contacts.count)
        self.rigid = RigidContacts(self.contacts, self.touches)
        self.frictions = JointFrictions(layout, mechanism.frictions, self.coordinates, self.rigid)
        self._build()

    # --- building -----------------------------------------------------------------------------

    def _coordinates(self, events: list[Event]) -> TreeCoordinates:
        layout, slots, state = self.layout, self.assembly.mechanism.slots, self.assembly.state
        starts = zip(slots, state.places.tolist(), state.laps, strict=True)
        begun: dict[str, tuple[float, int]] = {s.name: (place, lap) for s, place, lap in starts}
        if not layout.closures:
            guides = [
                SlotGuide(g, *begun[g.slot.name], float(self.start[0][g.turning]), events)
                for g in layout.slots
            ]
            riders = [TrackPoint(r.slot, *begun[r.slot.name], events) for r in layout.rides]
            return OpenCoordinates(layout, self.start, guides, riders, self._lengths)
        points = [TrackPoint(slot, *begun[slot.name], events) for slot in slots]
        return ClosedCoordinates(layout, self.start, points, self._lengths)

    def _build(self) -> None:
        self._container = Engine.SystemContainer()
        self._mbs = self._container.AddSystem()
        (x, v), count = self.start, len(self.layout.links)
        if not count:  # all is welded to the ground: Exudyn has no system without coordinates
            return
        node = self._mbs.AddNode(
            items.NodeGenericODE2(
                numberOfODE2Coordinates=count,
                referenceCoordinates=np.zeros(count),
                initialCoordinates=x,
                initialCoordinates_t=v,
            )
        )
        springs = self.all_springs.stiffness, self.all_springs.damping, self.all_springs.rest
        item = tree_item(self.assembly.mechanism, self.layout, springs)
        self._mbs.AddObject(items.ObjectKinematicTree(nodeNumber=node, **item))
        self._mbs.Assemble()
        settings = Engine.SimulationSettings()
        settings.timeIntegration.verboseMode = 0
        settings.solution.file.write = False
        settings.linearSolver.solverType = Engine.LinearSolverType.EXUdense
        self._solver = Engine.MainSolverImplicitSecondOrder()
        self._solver.InitializeSolver(self._mbs, settings)
        self._data = self._mbs.systemData

    # --- coordinates --------------------------------------------------------------------------

    def state(self, t: float, z: FloatArray, v: FloatArray) -> TreeState:
        """All coordinates and speeds, and accelerations b if independent ones do not accelerate."""
        return self.states(np.array([t]), z[None], v[None]).pick(0)

    def states(self, t: FloatArray, z: FloatArray, v: FloatArray) -> TreeState:
        """As `state`, at instants (n,) together."""
        return self.coordinates.states(self.window.all_inside(t), z, v)

    # --- equations ----------------------------------------------------------------------------

    def evaluate(self, t: float, q: FloatArray, v: FloatArray) -> Evaluation:
        """Mass matrix and force of the independent coordinates."""
        states = self.coordinates.states
        return self._evaluation(states, np.array([t]), q[None], v[None]).pick(0)

    def evaluate_stages(self, t: FloatArray, q: FloatArray, v: FloatArray) -> Evaluation:
        """As `evaluate`, at the stages (n,) of a step that is tried."""
        return self._evaluation(self.coordinates.states_at_stages, t, q, v)

    def _evaluation(
        self, states: States, t: FloatArray, q: FloatArray, v: FloatArray
    ) -> Evaluation:
        t = self.window.all_inside(t)
        try:
            return self.forces_at(t, states(t, q, v))
        except TROUBLES as error:
            self.trouble = float(t[0]), error
            raise

    def forces_at(self, t: FloatArray, state: TreeState) -> Evaluation:
        """As `evaluate`, at instants (n,) at which all coordinates are known."""
        free = self.without_reactions(t, state)
        if self.frictions.all:
            free = self.frictions.act(free)
        return self.rigid.with_reactions(free) if self.rigid.closed() else free

    def without_reactions(self, t: FloatArray, state: TreeState) -> Evaluation:
        """As `forces_at`, without contacts that are rigid, and without friction in joints."""
        mass, force = self._ask(state.x, state.v)
        if self.all_springs.pulls:
            force += self.all_springs.pull(state.x, state.v)
        supply = np.zeros(len(t))
        if self.loads.any:
            applied, supply = self.loads.push_and_supply(t, state.x, state.v)
            force += applied
        pushes = np.zeros((len(t), len(self.touches.pressed), 2))
        touching = np.zeros((len(t), 0, 2))
        acting, push = self.contacts.acting(self.touches.pressing), None
        if acting is not None:
            approach = self.touches.approach[acting.which]
            push = acting.push(self.kinematics.moving(state.x, state.v, t), approach)
            force += push.force
            supply = supply + push.supply
            pushes[:, acting.which, 0], pushes[:, acting.which, 1] = push.press, push.power
            touching = np.empty((len(t), acting.scene_count, 2))
            touching[..., 0] = push.look.gap[:, : acting.scene_count]
            touching[..., 1] = push.look.gap_rate[:, : acting.scene_count]
        rubbed = np.zeros((len(t), len(self.frictions.all), 4))
        kept = TreeForces(t, state, mass, force, pushes, rubbed, push, supply)
        rest = force - (mass @ state.b[:, :, None])[:, :, 0]
        mass, force = state.transform.reduced(mass), state.transform.reduced_rows(rest)
        return Evaluation(mass, force, kept, touching)

    def _ask(self, x: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mass matrices (n, links, links) and forces (n, links) from Exudyn."""
        mass, force = np.empty((*x.shape, x.shape[1])), np.empty(x.shape)
        if not x.size:
            return mass, force
        data, solver, mbs = self._data, self._solver, self._mbs
        # Exudyn takes lists faster than arrays.
        for i, (places, speeds) in enumerate(zip(x.tolist(), v.tolist(), strict=True)):
            data.SetODE2Coordinates(places)
            data.SetODE2Coordinates_t(speeds)
            solver.ComputeMassMatrix(mbs)
            solver.ComputeODE2RHS(mbs)
            mass[i], force[i] = solver.GetSystemMassMatrix(), solver.GetSystemResidual()
        return mass, force

    def jacobians(self, evaluation: Evaluation) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping matrix of springs, dampers, loads, walls, friction, round contacts.

        Rigid contacts, and joints that rest, take a part of these forces. Other slopes, such as
        those of directions that turn with the mechanism, are left out; the iteration converges
        anyway.
        """
        giving, projector = self._giving(evaluation), self._projector(evaluation)
        return giving if projector is None else projector.slopes(*giving)

    def _projector(self, evaluation: Evaluation) -> Projector | None:
        """Projector past closed gaps and joints that rest, at one state; None without them."""
        joints = self.frictions.held_rows(evaluation)
        if not self.rigid.closed():
            return Projector.past(evaluation.mass, joints, joints) if len(joints) else None
        gaps, pushed = self.rigid.held(evaluation)
        if not len(joints):
            return Projector.past(evaluation.mass, gaps, pushed)
        return Projector.past(
            evaluation.mass, np.vstack([gaps, joints]), np.vstack([pushed, joints])
        )

    def _giving(self, evaluation: Evaluation) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping matrix without rigid contacts."""
        stiffness, damping = self.springs(evaluation)
        whole: TreeForces = evaluation.kept
        transform = whole.state.transform
        for across in self._slopes(whole):
            stiffness = stiffness + transform.reduced(across[0])
            damping = damping + transform.reduced(across[1])
        return stiffness, damping + self.rigid.slopes(evaluation)

    def _slopes(self, whole: TreeForces) -> list[tuple[FloatArray, FloatArray]]:
        """Stiffness and damping (links, links) of loads, friction and round contacts that act."""
        x, v = whole.state.x, whole.state.v
        matrices, acting = [], self.contacts.acting(self.touches.pressing)
        if acting is not None and whole.push is not None:
            moving, approach = self.kinematics.moving(x, v), self.touches.approach[acting.which]
            matrices.append(acting.slopes(whole.push, moving, approach))
        if self.loads.stiff:
            push = partial(self.loads.push, np.full(4 * len(x), float(whole.t)))
            matrices.append(falls(push, x, v, self._lengths))
        return [slopes for slopes in matrices if slopes is not None]

    def springs(self, evaluation: Evaluation) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping matrix of springs and dampers alone."""
        state: TreeState = evaluation.kept.state
        stiffness, damping = self.all_springs.slopes(state.x, state.v, self._lengths)
        return state.transform.reduced(stiffness), state.transform.reduced(damping)

    def contacts_at(self, evaluation: Evaluation) -> tuple[FloatArray, Press] | None:
        """Gradients (c, independent) of the gaps of the contacts that act, and their forces."""
        acting, push = self.contacts.acting(self.touches.pressing), evaluation.kept.push
        if acting is None or not acting.scene_count:
            return None
        state: TreeState = evaluation.kept.state
        rows = state.transform.reduced_rows(push.rows.across[: acting.scene_count])
        # Rigid contacts that are closed allow the same motions to a gap and to the gap's force.
        projector = self._projector(evaluation)
        rows = rows if projector is None else rows @ projector.free.T
        which = acting.which[: acting.scene_count]
        return rows, press_by(acting.laws[: acting.scene_count], self.touches.approach[which])

    def size(self, change: FloatArray) -> float:
        """Largest distance (m) by which changes (..., independent) move any point."""
        moved = (change @ self._moves).view(complex)
        return float(np.abs(moved).max(initial=0.0))

    def look(self, x: FloatArray, transform: Transform) -> None:
        """Let `size` measure changes of coordinates by the points that they move at present."""
        moves: Any = self._moves_of_points(x)
        # Real and imaginary parts side by side: real numbers are multiplied faster.
        self._moves = np.ascontiguousarray(transform.reduced_rows(moves).T).view(float)

    def _moves_of_points(self, x: FloatArray) -> ComplexArray:
        """Derivatives (points, links) of points of parts by the coordinates (links,)."""
        return self.kinematics.moves(self.kinematics.places(x), self._points)

    # --- places on curves ---------------------------------------------------------------------

    def knots(self) -> Sequence[tuple[FloatArray, FloatArray]]:
        """Knots and jumps of the slots' present pieces."""
        return [point.knots for point in self.coordinates.points]

    def places(self, evaluation: Evaluation) -> Sequence[float]:
        """Places of the slots' points on their present pieces."""
        places: list[float] = evaluation.kept.state.places.tolist()
        return places

    def moved_by_point(self, k: int, evaluation: Evaluation) -> float:
        """Largest acceleration (m/s^2) of a point if a curve moves slot k's point by 1 m/s^2."""
        if not len(evaluation.force):
            return 0.0
        state: TreeState = evaluation.kept.state
        pushed = evaluation.kept.mass @ self.coordinates.pushed(k, state)
        along = state.transform.reduced_rows(pushed.T)
        return self.size(np.linalg.solve(evaluation.mass, along.T).T)

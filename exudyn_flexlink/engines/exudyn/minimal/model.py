"""The tree as one Exudyn item: mass matrix and forces come from it, reduced to free coordinates.

Exudyn evaluates the tree's mass matrix, its inertial forces, springs, dampers and weight; here
those coordinates that motors, slots and loops tie to others are eliminated: with
``x'' = T z'' + b`` the independent coordinates z obey ``T^T M T z'' = T^T (f - M b)``, and what is
left over in the other rows are the forces of motors, slots and loops.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.exudyn.engine import Engine, items
from exudyn_flexlink.engines.exudyn.minimal.closed import ClosedCoordinates
from exudyn_flexlink.engines.exudyn.minimal.contacts import MinimalContact, press_by
from exudyn_flexlink.engines.exudyn.minimal.coordinates import Coordinates, Held, OpenCoordinates
from exudyn_flexlink.engines.exudyn.minimal.guided import SlotGuide
from exudyn_flexlink.engines.exudyn.minimal.kinematics import (
    LinkKinematics,
    Reaches,
    start_coordinates,
)
from exudyn_flexlink.engines.exudyn.minimal.springs import Springs
from exudyn_flexlink.engines.exudyn.minimal.track_point import TrackPoint
from exudyn_flexlink.engines.exudyn.minimal.walls import WallPush, Walls
from exudyn_flexlink.integrate.problem import Evaluation, Press
from exudyn_flexlink.mechanism import Assembly, Mechanism
from exudyn_flexlink.mechanism.tree import ALONG_X, ALONG_Y, HINGE, TreeLayout
from exudyn_flexlink.result import Event

FloatArray = NDArray[np.float64]


class Whole(NamedTuple):
    """What Exudyn says of the tree at one instant, or at several: then with one axis more."""

    t: FloatArray
    held: Held
    mass: FloatArray  # (links, links)
    force: FloatArray  # (links,)
    pushes: FloatArray  # (contacts, 2): pressing force, N, and the power it takes, W
    wall: WallPush | None  # what pairs of link and guide do that press

    def pick(self, which: int | slice | None) -> Whole:
        """Return one of several instants, or some of them: see `coordinates.Held`."""
        wall = None if self.wall is None else self.wall.pick(which)
        return Whole(
            self.t[which],
            self.held.pick(which),
            self.mass[which],
            self.force[which],
            self.pushes[which],
            wall,
        )


class MinimalModel:
    """An Exudyn system with one tree; it solves nothing, only evaluates."""

    def __init__(self, assembly: Assembly, layout: TreeLayout, events: list[Event]) -> None:
        self.assembly, self.layout = assembly, layout
        mechanism = assembly.mechanism
        count = len(layout.links)
        self.start = start_coordinates(layout, assembly)
        self.kinematics = LinkKinematics(layout)
        self._reaches = Reaches(layout, self.kinematics, [part.reach for part in mechanism.parts])
        self.coordinates = self._coordinates(events)
        self.all_springs = Springs(layout, self.kinematics, mechanism)
        self.torques = [
            (motor, layout.turning_row(motor.first, motor.second))
            for motor in mechanism.torque_motors
        ]
        self._springy: tuple[FloatArray, FloatArray] | None = None
        self.contacts = [MinimalContact(layout, contact) for contact in mechanism.contacts]
        self.walls = Walls(layout, self.kinematics, mechanism.channels)
        self._build(count)

    # --- building -----------------------------------------------------------------------------

    def _coordinates(self, events: list[Event]) -> Coordinates:
        layout, slots = self.layout, self.assembly.mechanism.slots
        places = {s.name: float(p) for s, p in zip(slots, self.assembly.state.places, strict=True)}
        if not layout.closures:
            guides = [
                SlotGuide(g, places[g.slot.name], float(self.start[0][g.turning]), events)
                for g in layout.slots
            ]
            riders = [TrackPoint(r.slot, places[r.slot.name], events) for r in layout.rides]
            return OpenCoordinates(layout, self.start, guides, riders)
        points = [TrackPoint(slot, places[slot.name], events) for slot in slots]
        moves = self._reaches.moves(self.start[0])
        ends = moves.reshape(len(moves), 2, -1)
        lengths = np.sqrt((ends * ends).sum(1)).max(1, initial=0.0)
        lengths = np.maximum(lengths, 1e-3 * lengths.max(initial=1.0))
        return ClosedCoordinates(layout, self.kinematics, self.start, points, lengths)

    def _build(self, count: int) -> None:
        self._container = Engine.SystemContainer()
        self._mbs = self._container.AddSystem()
        x, v = self.start
        node = self._mbs.AddNode(
            items.NodeGenericODE2(
                numberOfODE2Coordinates=count,
                referenceCoordinates=np.zeros(count),
                initialCoordinates=x,
                initialCoordinates_t=v,
            )
        )
        self._mbs.AddObject(items.ObjectKinematicTree(nodeNumber=node, **self._tree(count)))
        self._mbs.Assemble()
        settings = Engine.SimulationSettings()
        settings.timeIntegration.verboseMode = 0
        settings.solution.file.write = False
        settings.linearSolver.solverType = Engine.LinearSolverType.EXUdense
        self._solver = Engine.MainSolverImplicitSecondOrder()
        self._solver.InitializeSolver(self._mbs, settings)
        self._data = self._mbs.systemData

    def _tree(self, count: int) -> dict[str, Any]:
        types = {
            HINGE: Engine.JointType.RevoluteZ,
            ALONG_X: Engine.JointType.PrismaticX,
            ALONG_Y: Engine.JointType.PrismaticY,
        }
        links = self.layout.links
        bodies = [_body_of(self.assembly.mechanism, self.layout, link.parts) for link in links]
        return {
            "jointTypes": [types[link.kind] for link in links],
            "linkParents": [link.parent for link in links],
            "jointTransformations": Engine.Matrix3DList([_turned(link.turn) for link in links]),
            "jointOffsets": Engine.Vector3DList([[*link.offset, 0.0] for link in links]),
            "linkInertiasCOM": Engine.Matrix3DList(
                [np.diag([0.0, 0.0, body.inertia]) for body in bodies]
            ),
            "linkCOMs": Engine.Vector3DList([[*body.centre, 0.0] for body in bodies]),
            "linkMasses": [body.mass for body in bodies],
            "gravity": [*self.assembly.mechanism.gravity, 0.0],
            "jointPControlVector": self.all_springs.stiffness,
            "jointDControlVector": self.all_springs.damping,
            "jointPositionOffsetVector": self.all_springs.rest,
            "jointVelocityOffsetVector": np.zeros(count),
        }

    # --- coordinates --------------------------------------------------------------------------

    def whole(self, t: float, z: FloatArray, v: FloatArray) -> Held:
        """All coordinates, speeds, and accelerations but for those of the independent ones."""
        return self.coordinates.hold(np.array([t]), z[None], v[None]).pick(0)

    # --- equations ----------------------------------------------------------------------------

    def evaluate(self, t: float, q: FloatArray, v: FloatArray) -> Evaluation:
        """Mass matrix and force of the independent coordinates."""
        return self.evaluate_all(np.array([t]), q[None], v[None]).pick(0)

    def evaluate_all(self, t: FloatArray, q: FloatArray, v: FloatArray) -> Evaluation:
        """As `evaluate`, at instants (n,) together: coordinates and speeds (n, independent)."""
        held = self.coordinates.hold(t, q, v)
        mass, force = self._ask(held.x, held.v)
        if self.all_springs.pulls:
            force += self.all_springs.pull(held.x, held.v)
        for motor, row in self.torques:
            force += np.outer([motor.ramp.at(at) for at in t.tolist()], row)
        pushes, touching = self._push(held.x, held.v, force)
        wall = self.walls.push(held.x, held.v)
        if wall is not None:
            force += wall.force
        kept = Whole(t, held, mass, force, pushes, wall)
        left = force - (mass @ held.b[:, :, None])[:, :, 0]
        return Evaluation(*self._reduced(held.reach, mass, left), kept, touching)

    def _ask(self, x: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mass matrices (n, links, links) and forces (n, links), as Exudyn has them."""
        data, solver, mbs = self._data, self._solver, self._mbs
        mass, force = np.empty((*x.shape, x.shape[1])), np.empty(x.shape)
        for i in range(len(x)):
            data.SetODE2Coordinates(x[i])
            data.SetODE2Coordinates_t(v[i])
            solver.ComputeMassMatrix(mbs)
            solver.ComputeODE2RHS(mbs)
            mass[i], force[i] = solver.GetSystemMassMatrix(), solver.GetSystemResidual()
        return mass, force

    def _reduced(
        self, reach: FloatArray | None, mass: FloatArray, left: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Mass matrices and forces of the independent coordinates."""
        if reach is not None:
            turned = reach.transpose(0, 2, 1)
            return turned @ mass @ reach, (turned @ left[:, :, None])[:, :, 0]
        chosen = self._picked
        if isinstance(chosen, slice):
            return mass[:, chosen, chosen], left[:, chosen]
        return mass[:, chosen[:, None], chosen], left[:, chosen]

    @property
    def _picked(self) -> slice | NDArray[np.intp]:
        """Independent coordinates where they are some of the tree's, and nothing follows them."""
        assert isinstance(self.coordinates, OpenCoordinates)
        return self.coordinates.chosen

    def _push(
        self, x: FloatArray, v: FloatArray, onto: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Add the contacts' forces.

        Return force and power of each (n, contacts, 2), and gaps and rates of those that act
        (n, c, 2).
        """
        pushes = np.zeros((len(x), len(self.contacts), 2))
        acting = [k for k, contact in enumerate(self.contacts) if contact.acts]
        touching = np.empty((len(x), len(acting), 2))
        for c, k in enumerate(acting):
            for i in range(len(x)):
                pushes[i, k], touching[i, c] = self.contacts[k].push(x[i], v[i], onto[i])
        return pushes, touching

    def jacobians(self, at: Evaluation) -> tuple[FloatArray, FloatArray]:
        """Springs, dampers and walls; what turns with the mechanism is left to the iteration."""
        stiffness, damping = self.springs(at)
        whole: Whole = at.kept
        if whole.wall is None:
            return stiffness, damping
        reach = whole.held.reach
        if reach is None:
            reach = np.eye(len(whole.held.x))[:, self._picked]
        of_walls = self.walls.slopes(whole.wall, reach)
        return stiffness + of_walls[0], damping + of_walls[1]

    def springs(self, at: Evaluation) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping matrix of springs and dampers alone."""
        held: Held = at.kept.held
        reach = held.reach
        if reach is None and self._springy is not None:
            return self._springy
        stiffness, damping = self.all_springs.slopes(held.x, held.v)
        if reach is not None:
            return reach.T @ stiffness @ reach, reach.T @ damping @ reach
        picked = self._picked
        found = stiffness[picked][:, picked], damping[picked][:, picked]
        self._springy = found if self.all_springs.straight else None
        return found

    def contacts_at(self, at: Evaluation) -> tuple[FloatArray, Press] | None:
        """Gradients (c, independent) of the gaps of the contacts that act, and their forces."""
        acting = [contact for contact in self.contacts if contact.acts]
        if not acting:
            return None
        held: Held = at.kept.held
        rows = np.array([contact.gradient(held.x, held.v) for contact in acting])
        rows = rows[:, self._picked] if held.reach is None else rows @ held.reach
        return rows, press_by([contact.law for contact in acting])

    def size(self, change: FloatArray) -> float:
        """How far (m) changes (..., independent) move the end of any part, at most."""
        moved = change @ self._moves
        return float(
            np.sqrt((moved * moved).reshape(*moved.shape[:-1], 2, -1).sum(-2)).max(initial=0.0)
        )

    def moved_by_point(self, k: int, at: Evaluation) -> float:
        """How much (m/s^2) parts accelerate if a curve pushes slot k's point by 1 m/s^2."""
        if not len(at.force):
            return 0.0
        held: Held = at.kept.held
        pushed = at.kept.mass @ self.coordinates.pushed(k, held)
        along = pushed[self._picked] if held.reach is None else held.reach.T @ pushed
        return self.size(np.linalg.solve(at.mass, along).T)

    def look(self, x: FloatArray, reach: FloatArray | None = None) -> None:
        """Measure changes of coordinates by what they move where the tree is now."""
        moves = self._reaches.moves(x)
        self._moves = reach.T @ moves if reach is not None else moves[self._picked]

    def accelerations(self, at: Evaluation) -> FloatArray:
        """Those of the independent coordinates."""
        if not len(at.force):
            return np.zeros(0)
        return np.asarray(np.linalg.solve(at.mass, at.force))

    def whole_accelerations(self, held: Held, free: FloatArray) -> FloatArray:
        """Accelerations of all coordinates (n, links), by the independent ones (n, independent)."""
        if held.reach is not None:
            return np.asarray(held.b + (held.reach @ free[:, :, None])[:, :, 0])
        whole: FloatArray = held.b.copy()
        whole[:, self._picked] += free
        return whole

    def left_over(self, instants: Sequence[Whole], accelerations: FloatArray) -> FloatArray:
        """Forces (n, links) that motors, slots and loops add where all coordinates move so.

        The instants (n,) are several of each `Whole`, in a row.
        """
        mass = np.concatenate([whole.mass for whole in instants])
        force = np.concatenate([whole.force for whole in instants])
        return np.asarray((mass @ accelerations[:, :, None])[:, :, 0] - force)


class _Body(NamedTuple):
    """Mass (kg), centre of mass (m, in the link's axes) and inertia about it (kg m^2)."""

    mass: float
    centre: tuple[float, float]
    inertia: float


def _body_of(mechanism: Mechanism, layout: TreeLayout, parts: tuple[int, ...]) -> _Body:
    """Rigid parts that move as one."""
    masses = [mechanism.parts[part].mass for part in parts]
    total = sum(masses)
    if total == 0:
        return _Body(0.0, (0.0, 0.0), 0.0)
    centres = [layout.frames[part].place(*mechanism.parts[part].centre) for part in parts]
    weighted = list(zip(masses, centres, strict=True))
    x = sum(m * c[0] for m, c in weighted) / total
    y = sum(m * c[1] for m, c in weighted) / total
    inertia = sum(mechanism.parts[part].inertia for part in parts)
    inertia += sum(m * ((c[0] - x) ** 2 + (c[1] - y) ** 2) for m, c in weighted)
    return _Body(total, (x, y), inertia)


def _turned(angle: float) -> FloatArray:
    """Rotation (3, 3) about z."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

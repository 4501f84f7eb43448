"""The tree as one Exudyn item: mass matrix and forces come from it, reduced to free coordinates.

Exudyn evaluates the tree's mass matrix, its inertial forces, springs, dampers and weight; here
those coordinates that a motor or a slot fixes are eliminated: with ``x'' = T z'' + b`` the free
coordinates z obey ``T^T M T z'' = T^T (f - M b)``, and what is left over in the other rows are the
forces of motors and slots.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.exudyn.engine import Engine, items
from exudyn_flexlink.engines.exudyn.tree.contact_share import Press
from exudyn_flexlink.engines.exudyn.tree.contacts import TreeContact, press_by
from exudyn_flexlink.engines.exudyn.tree.guided import SlotGuide
from exudyn_flexlink.engines.exudyn.tree.kinematics import Reaches, start_coordinates
from exudyn_flexlink.engines.exudyn.tree.radau import NOT_TOUCHING, Evaluation
from exudyn_flexlink.mechanism import Assembly
from exudyn_flexlink.mechanism.tree import (
    ALONG_X,
    ALONG_Y,
    HINGE,
    TreeLayout,
    hinge_between,
)
from exudyn_flexlink.result import Event

FloatArray = NDArray[np.float64]


class Held(NamedTuple):
    """All coordinates of the tree at one instant (links,), and the slots' places on their pieces.

    `b` are accelerations that the free ones do not cause.
    """

    x: FloatArray
    v: FloatArray
    b: FloatArray
    places: tuple[float, ...]


class Whole(NamedTuple):
    """What Exudyn says of the tree at one instant."""

    t: float
    x: FloatArray
    v: FloatArray
    b: FloatArray
    places: tuple[float, ...]
    mass: FloatArray
    force: FloatArray
    pushes: list[tuple[float, float]]  # of contacts: pressing force, N, and the power it takes, W


KEPT_TIMES = 64
NO_PUSHES: list[tuple[float, float]] = []


class TreeModel:
    """An Exudyn system with one tree; it solves nothing, only evaluates."""

    def __init__(self, assembly: Assembly, layout: TreeLayout, events: list[Event]) -> None:
        self.assembly, self.layout = assembly, layout
        mechanism = assembly.mechanism
        count = len(layout.links)
        self.start = start_coordinates(layout, assembly)
        self.free = np.array(layout.free, dtype=int)
        last = int(self.free[-1]) + 1 if len(self.free) else 0
        together = len(self.free) == last - (int(self.free[0]) if len(self.free) else 0)
        self._span = slice(last - len(self.free), last) if together else None
        self._chosen: Any = self.free if self._span is None else self._span
        self._at_times: dict[float, Held] = {}
        self.guides = [
            SlotGuide(
                guided,
                float(assembly.state.places[k]),
                float(self.start[0][guided.turning]),
                events,
            )
            for k, guided in enumerate(layout.slots)
        ]
        self._motors = [(link, *motor) for link, motor in layout.motors.items()]
        self.turning = any(slot.turning not in layout.motors for slot in layout.slots)
        self.stiffness, self.damping, self._rest = self._springs(count)
        self._springy = np.diag(self.stiffness[self.free]), np.diag(self.damping[self.free])
        self.torques = [
            (motor, self._hinge(motor.first, motor.second)) for motor in mechanism.torque_motors
        ]
        self._reaches = Reaches(layout, [part.reach for part in mechanism.parts])
        self.look(self.start[0])
        self.contacts = [TreeContact(layout, contact) for contact in mechanism.contacts]
        self._build(count)

    # --- building -----------------------------------------------------------------------------

    def _hinge(self, first: int, second: int) -> tuple[int, float]:
        found = hinge_between(self.layout, first, second)
        assert found is not None  # `tree_layout` refuses others
        return found

    def _springs(self, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Stiffness, damping and rest angle of every coordinate, (links,)."""
        stiffness, damping, rest = np.zeros(count), np.zeros(count), np.zeros(count)
        pull = np.zeros(count)
        for spring in self.assembly.mechanism.springs:
            link, sign = self._hinge(spring.first, spring.second)
            stiffness[link] += spring.stiffness
            damping[link] += spring.damping
            pull[link] += sign * spring.stiffness * (spring.rest_angle or 0.0)
        np.divide(pull, stiffness, out=rest, where=stiffness > 0)
        return stiffness, damping, rest

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
        mechanism = self.assembly.mechanism
        types = {
            HINGE: Engine.JointType.RevoluteZ,
            ALONG_X: Engine.JointType.PrismaticX,
            ALONG_Y: Engine.JointType.PrismaticY,
        }
        masses, centres, inertias = [], [], []
        for link in self.layout.links:
            part = None if link.part is None else mechanism.parts[link.part]
            x, y = (0.0, 0.0) if part is None else part.centre
            masses.append(0.0 if part is None else part.mass)
            inertias.append(np.diag([0.0, 0.0, 0.0 if part is None else part.inertia]))
            centres.append([x - link.origin[0], y - link.origin[1], 0.0])
        return {
            "jointTypes": [types[link.kind] for link in self.layout.links],
            "linkParents": [link.parent for link in self.layout.links],
            "jointTransformations": Engine.Matrix3DList([np.eye(3)] * count),
            "jointOffsets": Engine.Vector3DList(
                [[*link.offset, 0.0] for link in self.layout.links]
            ),
            "linkInertiasCOM": Engine.Matrix3DList(inertias),
            "linkCOMs": Engine.Vector3DList(centres),
            "linkMasses": masses,
            "gravity": [*mechanism.gravity, 0.0],
            "jointPControlVector": self.stiffness,
            "jointDControlVector": self.damping,
            "jointPositionOffsetVector": self._rest,
            "jointVelocityOffsetVector": np.zeros(count),
        }

    # --- coordinates --------------------------------------------------------------------------

    def whole(self, t: float, z: FloatArray, v: FloatArray) -> Held:
        """All coordinates, speeds, and accelerations but for those of the free ones."""
        if self.turning:
            return self._hold(t, z, v)
        # What motors hold depends on time alone, and stages come back to the same instants.
        held = self._at_times.get(t)
        if held is None:
            if len(self._at_times) >= KEPT_TIMES:
                self._at_times.clear()
            held = self._at_times[t] = self._hold(t, z, v)
        x, speed = held.x.copy(), held.v.copy()
        x[self._chosen], speed[self._chosen] = z, v
        return Held(x, speed, held.b, held.places)

    def _hold(self, t: float, z: FloatArray, v: FloatArray) -> Held:
        x, speed, b = np.zeros((3, len(self.layout.links)))
        x[self._chosen], speed[self._chosen] = z, v
        for link, motor, sign in self._motors:
            ramp = motor.ramp
            x[link] = self.start[0][link] + sign * ramp.integral(t)
            speed[link], b[link] = sign * ramp.at(t), sign * ramp.rate(t)
        for guide in self.guides:
            turning, sliding = guide.guided.turning, guide.guided.sliding
            place, rate, bend = guide.slide(float(x[turning]))
            omega = speed[turning]
            x[sliding], speed[sliding] = place, rate * omega
            b[sliding] = bend * omega * omega + rate * b[turning]
        return Held(x, speed, b, tuple(guide.u for guide in self.guides))

    def forget(self) -> None:
        """The slots' points have gone on, or on to other pieces."""
        self._at_times.clear()

    def _reach(self, whole: FloatArray) -> FloatArray:
        """Matrix T (links, free), where it does more than pick coordinates."""
        chosen = np.zeros((len(whole), len(self.free)))
        chosen[self.free, np.arange(len(self.free))] = 1.0
        for guide in self.guides:
            rate = guide.slide(float(whole[guide.guided.turning]))[1]
            chosen[guide.guided.sliding] += rate * chosen[guide.guided.turning]
        return chosen

    # --- equations ----------------------------------------------------------------------------

    def evaluate(self, t: float, q: FloatArray, v: FloatArray) -> Evaluation:
        """Mass matrix and force of the free coordinates."""
        x, speed, b, places = self.whole(t, q, v)
        data, solver, mbs = self._data, self._solver, self._mbs
        data.SetODE2Coordinates(x)
        data.SetODE2Coordinates_t(speed)
        solver.ComputeMassMatrix(mbs)
        solver.ComputeODE2RHS(mbs)
        mass, force = solver.GetSystemMassMatrix(), solver.GetSystemResidual()
        for motor, (link, sign) in self.torques:
            force[link] += sign * motor.ramp.at(t)
        pushes, touching = NO_PUSHES, NOT_TOUCHING
        if self.contacts:
            pushes, touching = self._push(x, speed, force)
        kept = Whole(t, x, speed, b, places, mass, force, pushes)
        left = force - mass @ b
        if self.turning:
            reach = self._reach(x)
            return Evaluation(reach.T @ mass @ reach, reach.T @ left, kept, touching)
        if self._span is not None:
            span = self._span
            return Evaluation(mass[span, span], left[span], kept, touching)
        return Evaluation(mass[np.ix_(self.free, self.free)], left[self.free], kept, touching)

    def _push(
        self, x: FloatArray, v: FloatArray, onto: FloatArray
    ) -> tuple[list[tuple[float, float]], FloatArray]:
        """Add the contacts' forces.

        Return force and power of each, and gaps and rates (c, 2) of those that act.
        """
        pushes, touching = [], []
        for contact in self.contacts:
            if not contact.acts:
                pushes.append((0.0, 0.0))
                continue
            push, touch = contact.push(x, v, onto)
            pushes.append(push)
            touching.append(touch)
        return pushes, np.array(touching) if touching else NOT_TOUCHING

    def jacobians(self, at: Evaluation) -> tuple[FloatArray, FloatArray]:
        """Springs and dampers; what turns with the mechanism is left to the iteration."""
        if not self.turning:
            return self._springy
        reach = self._reach(at.kept.x)
        return reach.T @ np.diag(self.stiffness) @ reach, reach.T @ np.diag(self.damping) @ reach

    def contacts_at(self, at: Evaluation) -> tuple[FloatArray, Press] | None:
        """Gradients (c, free) of the gaps of the contacts that act, and their forces."""
        acting = [contact for contact in self.contacts if contact.acts]
        if not acting:
            return None
        whole: Whole = at.kept
        rows = np.array([contact.gradient(whole.x, whole.v) for contact in acting])
        rows = rows @ self._reach(whole.x) if self.turning else rows[:, self._chosen]
        return rows, press_by([contact.law for contact in acting])

    def size(self, change: FloatArray) -> float:
        """How far (m) changes (..., free) of the coordinates move the end of any part, at most."""
        moved = change @ self._moves
        return float(
            np.sqrt((moved * moved).reshape(*moved.shape[:-1], 2, -1).sum(-2)).max(initial=0.0)
        )

    def moved_by_point(self, k: int, at: Evaluation) -> float:
        """How much (m/s^2) parts accelerate if the track pushes slot k's point aside by 1 m/s^2.

        Pushed aside, the point slides along the guide by 1 / sine of the angle between the two.
        """
        guided, whole = self.guides[k].guided, at.kept
        slid = whole.mass[:, guided.sliding]
        along = self._reach(whole.x).T @ slid if self.turning else slid[self._chosen]
        sine = self.guides[k].sine(float(whole.x[guided.turning]), whole.places[k])
        return self.size(np.linalg.solve(at.mass, along)) / max(abs(sine), 1e-9)

    def look(self, x: FloatArray) -> None:
        """Measure changes of coordinates by what they move where the tree is now."""
        self._moves = self._reaches.moves(x)[self.free]

    def accelerations(self, at: Evaluation) -> FloatArray:
        """Those of the free coordinates."""
        if not len(self.free):
            return np.zeros(0)
        return np.asarray(np.linalg.solve(at.mass, at.force))

    def whole_accelerations(self, instants: Sequence[Held | Whole], free: FloatArray) -> FloatArray:
        """Accelerations of all coordinates (instants, links), by the free ones (instants, free)."""
        shape = (len(instants), len(self.layout.links))
        whole = np.array([instant.b for instant in instants]).reshape(shape)
        if self.turning:
            moved = [self._reach(at.x) @ a for at, a in zip(instants, free, strict=True)]
            return np.asarray(whole + np.array(moved).reshape(shape))
        whole[:, self._chosen] += free
        return whole

    def left_over(self, instants: Sequence[Whole], free: FloatArray) -> FloatArray:
        """Forces (instants, links) that motors and slots add where the free ones move so."""
        mass = np.array([instant.mass for instant in instants])
        force = np.array([instant.force for instant in instants])
        whole = self.whole_accelerations(instants, free)
        return np.asarray((mass @ whole[:, :, None])[:, :, 0] - force)

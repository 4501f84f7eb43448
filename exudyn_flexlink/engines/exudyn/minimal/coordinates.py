"""A tree as Exudyn's item, and all its coordinates by the independent ones, without loops.

Motors prescribe their coordinates, and a guided slot's slide follows its guide: ``x'' = T z'' + b``
for the independent coordinates z, with T the velocity transformation (E. J. Haug, *Computer Aided
Kinematics and Dynamics*, 1989, ch. 7).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray, IndexArray
from exudyn_flexlink.engines.exudyn.engine import Engine
from exudyn_flexlink.engines.exudyn.minimal.kinematics import (
    AT_DEAD_CENTRE,
    SlotGuide,
    TrackPoint,
    Transform,
    Which,
)
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.integrate.stepper import OnSingularity
from exudyn_flexlink.mechanism import Mechanism
from exudyn_flexlink.mechanism.tree import ALONG_X, ALONG_Y, HINGE, TreeLayout
from exudyn_flexlink.rounding import NEGLIGIBLE


def tree_item(
    mechanism: Mechanism, layout: TreeLayout, springs: tuple[FloatArray, FloatArray, FloatArray]
) -> dict[str, Any]:
    """Arguments of the item without its node; `springs` are stiffness, damping, rest by link."""
    types = {
        HINGE: Engine.JointType.RevoluteZ,
        ALONG_X: Engine.JointType.PrismaticX,
        ALONG_Y: Engine.JointType.PrismaticY,
    }
    links = layout.links
    bodies = (_body_of(mechanism, layout, link.parts) for link in links)
    masses, centres, inertias = zip(*bodies, strict=True)
    return {
        "jointTypes": [types[link.kind] for link in links],
        "linkParents": [link.parent for link in links],
        "jointTransformations": Engine.Matrix3DList([_turned(link.turn) for link in links]),
        "jointOffsets": Engine.Vector3DList([[*link.offset, 0.0] for link in links]),
        "linkInertiasCOM": Engine.Matrix3DList(
            [np.diag([0.0, 0.0, inertia]) for inertia in inertias]
        ),
        "linkCOMs": Engine.Vector3DList([[*centre, 0.0] for centre in centres]),
        "linkMasses": list(masses),
        "gravity": [*mechanism.gravity, 0.0],
        "jointPControlVector": springs[0],
        "jointDControlVector": springs[1],
        "jointPositionOffsetVector": springs[2],
        "jointVelocityOffsetVector": np.zeros(len(links)),
    }


def _body_of(
    mechanism: Mechanism, layout: TreeLayout, parts: tuple[int, ...]
) -> tuple[float, tuple[float, float], float]:
    """Mass (kg), centre (m, in the link's axes) and inertia about it (kg m^2) of parts as one."""
    masses = [mechanism.parts[part].mass for part in parts]
    total = sum(masses)
    if total == 0:
        return 0.0, (0.0, 0.0), 0.0
    centres = [layout.frames[part].place(*mechanism.parts[part].centre) for part in parts]
    weighted = list(zip(masses, centres, strict=True))
    x = sum(m * c[0] for m, c in weighted) / total
    y = sum(m * c[1] for m, c in weighted) / total
    inertia = sum(mechanism.parts[part].inertia for part in parts)
    inertia += sum(m * ((c[0] - x) ** 2 + (c[1] - y) ** 2) for m, c in weighted)
    return total, (x, y), inertia


def _turned(angle: float) -> FloatArray:
    """Rotation (3, 3) about z."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


class TreeState(NamedTuple):
    """All coordinates of the tree at one instant (links,), and the slots' places on their pieces.

    `b` are accelerations if independent coordinates do not accelerate; `transform` has the effect
    of these. `place_rates` are those of `places`, `t` (s) is the instant. For several instants all
    arrays have one more, first axis.
    """

    x: FloatArray
    v: FloatArray
    b: FloatArray
    places: FloatArray
    place_rates: FloatArray
    transform: Transform
    t: FloatArray

    def pick(self, which: Which) -> TreeState:
        """Return one of several instants, or some; None puts an axis of length 1 before a state."""
        return TreeState._make(column[which] for column in self)


class TreeCoordinates(Protocol):
    """How the coordinates of a tree follow from the independent ones.

    The defaults of methods hold if no joint closes a loop.
    """

    points: Sequence[TrackPoint]
    """The followers of the slots' points."""

    @property
    def numbers(self) -> IndexArray:
        """Numbers of the independent coordinates: links come first, then `points`."""

    def independent(self) -> tuple[FloatArray, FloatArray]:
        """Independent coordinates and speeds where the last step ended."""

    def states(self, t: FloatArray, z: FloatArray, v: FloatArray) -> TreeState:
        """All coordinates at instants (n,), from the independent ones and their speeds (n, count).

        Raises:
            DeadCentreError: the independent coordinates do not determine the others.

        """

    def states_at_stages(self, t: FloatArray, z: FloatArray, v: FloatArray) -> TreeState:
        """As `states`, at the stages of a step that is tried; later searches start from them."""
        return self.states(t, z, v)

    def settle(self, time: float, end: TreeState, a: FloatArray) -> None:
        """Take the end of a step, with accelerations `a` of the independent coordinates."""

    def resume(self) -> None:
        """Choose other independent coordinates, if that is better, before a fresh step."""

    def repartition_due(self) -> bool:
        """Tell whether other coordinates should be the independent ones."""
        return False

    def slipped(self, h: float, weights: FloatArray, stages: TreeState, start: TreeState) -> float:
        """How far (m) a dependent coordinate ended a step from where its speeds take it."""

    def pushed(self, k: int, state: TreeState) -> FloatArray:
        """Accelerations (links, ways) if the curve moves slot k's point by 1 m/s^2."""

    def on_dead_centre(self, at_stop: bool) -> OnSingularity:  # noqa: ARG002
        """Tell where the last step tried came close to a dead centre.

        A step whose end is prescribed, `at_stop`, may end nearer to it.
        """
        return OnSingularity()

    def near_dead_centre(self, step: Step, t: FloatArray) -> BoolArray:  # noqa: ARG002
        """Tell at which instants (n,) of the last step a loop is close to a dead centre."""
        return np.zeros(len(t), dtype=bool)

    def locked(self, state: TreeState) -> str:
        """Say that the mechanism is close to a dead centre; empty if it is not."""


class OpenCoordinates(TreeCoordinates):
    """Coordinates of a tree without loops.

    The independent coordinates are those of the tree that nothing fixes, then the places of rides
    on their curves.
    """

    def __init__(
        self,
        layout: TreeLayout,
        start: tuple[FloatArray, FloatArray],
        guides: Sequence[SlotGuide],
        riders: Sequence[TrackPoint],
        lengths: FloatArray,
    ) -> None:
        """`riders` are the points of the layout's rides, `guides` those of its guided slots.

        `lengths` (links,) are how far (m) a unit of each coordinate moves anything, at most.
        """
        self.free = np.array(layout.free, dtype=int)
        self._guides, self._riders = list(guides), list(riders)
        self.points: Sequence[TrackPoint] = [*self._guides, *self._riders]
        # The slide along y is the link after the one along x.
        self._rides = [slice(ride.along[0], ride.along[1] + 1) for ride in layout.rides]
        self._slots = len(self._guides) + len(self._riders)
        self._start = start
        self._links = len(layout.links)
        in_a_row = len(self.free) > 0 and np.ptp(self.free) + 1 == len(self.free)
        self._chosen: slice | IndexArray = self.free
        if in_a_row:
            self._chosen = slice(int(self.free[0]), int(self.free[-1]) + 1)
        self._picked = Transform(np.eye(self._links)[:, self._chosen], self._chosen)
        self._motors = [(link, *motor) for link, motor in layout.motors.items()]
        self._followed = np.zeros(self._links)  # m per unit of dependent coordinates
        self._followed[list(layout.motors)] = lengths[list(layout.motors)]
        self._followed[[slot.sliding for slot in layout.slots]] = 1.0
        turning = any(slot.turning not in layout.motors for slot in layout.slots)
        self._follows = turning or bool(self._riders)
        self._picks = np.zeros((self._links, len(self.free) + len(self._riders)))
        self._picks[self.free, np.arange(len(self.free))] = 1.0
        self._driven: tuple[FloatArray, TreeState] | None = (
            None  # by the last instants that were asked
        )
        self._end = start
        self._speeds = [self._speed_along(k) for k in range(len(self._riders))]

    def _speed_along(self, k: int) -> float:
        """Speed of a rider's place on its curve, from that of its slides."""
        _, _, dx, dy, _, _ = self._riders[k].at(self._riders[k].u)
        along, across = self._end[1][self._rides[k]].tolist()
        return float((along * dx + across * dy) / (dx * dx + dy * dy))

    @property
    def numbers(self) -> IndexArray:
        """Numbers of the independent coordinates: links come first, then points."""
        first = self._links + len(self._guides)
        return np.append(self.free, np.arange(first, first + len(self._riders)))

    def independent(self) -> tuple[FloatArray, FloatArray]:
        """Independent coordinates and speeds where the last step ended."""
        x, v = self._end
        places = [rider.u for rider in self._riders]
        return np.append(x[self.free], places), np.append(v[self.free], self._speeds)

    def states(self, t: FloatArray, z: FloatArray, v: FloatArray) -> TreeState:
        """All coordinates at instants, from the independent ones and their speeds."""
        free, known = len(self.free), self._known(t)
        x, speed = known.x.copy(), known.v.copy()
        x[:, self._chosen], speed[:, self._chosen] = z[:, :free], v[:, :free]
        state = TreeState(x, speed, *known[2:])
        if not self._follows:
            return state
        reach = np.empty((len(t), *self._picks.shape))
        reach[:] = self._picks
        places, rates = np.zeros((2, len(t), self._slots))
        state = TreeState(state.x, state.v, state.b.copy(), places, rates, Transform(reach), t)
        self._slide(state)
        self._ride(state, z[:, free:], v[:, free:])
        return state

    def _known(self, t: FloatArray) -> TreeState:
        """Coordinates that depend on time alone: of motors, and of slides whose guides motors turn.

        The rounds of an iteration ask for the same instants, in the same array.
        """
        if self._driven is not None and self._driven[0] is t:
            return self._driven[1]
        x, speed, b = np.zeros((3, len(t), self._links))
        for link, motor, sign in self._motors:
            x[:, link] = self._start[0][link] + sign * motor.speed.integrals(t)
            speed[:, link], b[:, link] = sign * motor.speed.values(t), sign * motor.speed.rates(t)
        places, rates = np.zeros((2, len(t), self._slots))
        state = TreeState(x, speed, b, places, rates, self._picked, t)
        if not self._follows:
            self._slide(state)
        self._driven = t, state
        return state

    def _slide(self, state: TreeState) -> None:
        """Fill in the slides that follow their guides, and the places of their points."""
        x, speed, b, places, _, transform, _ = state
        for k, guide in enumerate(self._guides):
            turning, sliding = guide.guided.turning, guide.guided.sliding
            angles = x[:, turning].tolist()
            slides = np.array([(*guide.slide(angle), guide.u) for angle in angles])
            place, rate, bend, places[:, k] = slides.T
            omega = speed[:, turning]
            x[:, sliding], speed[:, sliding] = place, rate * omega
            b[:, sliding] = bend * omega * omega + rate * b[:, turning]
            if self._follows:
                transform.matrix[:, sliding] += rate[:, None] * transform.matrix[:, turning]

    def _ride(self, state: TreeState, u: FloatArray, rate: FloatArray) -> None:
        """Fill in the slides of points that ride on curves, from their places and speeds."""
        x, speed, b, places, place_rates, transform, _ = state
        first = len(self._guides)
        places[:, first:], place_rates[:, first:] = u, rate
        for k, (rider, slides) in enumerate(zip(self._riders, self._rides, strict=True)):
            # At a few instants numbers are faster than arrays.
            values = np.array([rider.at(place) for place in u[:, k].tolist()])
            along = rate[:, k, None]
            x[:, slides], transform.matrix[:, slides, len(self.free) + k] = (
                values[:, :2],
                values[:, 2:4],
            )
            speed[:, slides], b[:, slides] = values[:, 2:4] * along, values[:, 4:] * along * along

    def settle(self, time: float, end: TreeState, a: FloatArray) -> None:  # noqa: ARG002
        """Take the end of a step; neither time nor accelerations are needed."""
        self._end = end.x, end.v
        first = len(self._guides)
        for guide, place in zip(self._guides, end.places.tolist(), strict=False):
            guide.settle(place, float(end.x[guide.guided.turning]))
        for rider, place in zip(self._riders, end.places[first:].tolist(), strict=True):
            rider.u = place
        self._speeds = end.place_rates[first:].tolist()
        self._driven = None

    def resume(self) -> None:
        """Take the speeds of points that have gone on to other pieces."""
        self._speeds = [self._speed_along(k) for k in range(len(self._riders))]
        self._driven = None

    def slipped(self, h: float, weights: FloatArray, stages: TreeState, start: TreeState) -> float:
        """How far (m) a slide, or a driven coordinate, ended a step from where its speeds take it.

        Such a slide jumped to another place where the guide's axis crosses the track, or the motion
        has a bend that the step does not resolve. The error of the independent coordinates shows
        neither.
        """
        off = stages.x[-1] - start.x - h * (weights @ stages.v)
        return float((self._followed * np.abs(off)).max(initial=0.0))

    def pushed(self, k: int, state: TreeState) -> FloatArray:
        """Accelerations (links, ways) if the curve moves slot k's point by 1 m/s^2.

        A guided point that moves across the track slides by 1 / sine of the angle between both.
        """
        moved = np.zeros((self._links, 1 if k < len(self._guides) else 2))
        if k < len(self._guides):
            guide = self._guides[k]
            sine = guide.sine(float(state.x[guide.guided.turning]), float(state.places[k]))
            # A guide along the track is locked there: no number, however large, is right.
            moved[guide.guided.sliding, 0] = 1.0 / max(abs(sine), NEGLIGIBLE)
        else:
            moved[self._rides[k - len(self._guides)]] = np.eye(2)
        return moved

    def locked(self, state: TreeState) -> str:
        """Say that a guide's axis almost touches its track; empty if none does."""
        places = zip(self._guides, state.places.tolist(), strict=False)
        grazing = any(g.grazes(float(state.x[g.guided.turning]), u) for g, u in places)
        return AT_DEAD_CENTRE if grazing else ""

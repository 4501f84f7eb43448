"""Masses, applied forces, accelerations that satisfy every joint, and energies.

`Bodies` has the parts of every body, hinges within flexible ones, and named points as anchors.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import atan2, degrees, hypot, isclose, pi, sqrt

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.chain import Beam, Chain, Hinge, discretise
from exudyn_flexlink.mechanism.constraints import (
    Constraints,
    anchor_jacobian,
    anchor_position,
    anchor_velocity,
    constraint_rows,
    force_at,
    joint_speed,
    left_of,
    length_along,
    line_of,
    places_near,
    sensed,
    size_at,
    speed_along,
    turned,
    turning,
)
from exudyn_flexlink.mechanism.contacts import gradient
from exudyn_flexlink.mechanism.joints import (
    GROUND,
    Anchor,
    Channel,
    Contact,
    Pin,
    RopeContact,
    Slide,
    SumStop,
)
from exudyn_flexlink.mechanism.least_motion import LeastMotion
from exudyn_flexlink.mechanism.model import LinearSpring, Mechanism, RigidPart, RotarySpring
from exudyn_flexlink.rounding import TINY
from exudyn_flexlink.scene import GROUND as GROUND_NAME
from exudyn_flexlink.scene import (
    FlexibleBody,
    LineOnCurve,
    PointOnLine,
    PointsJoint,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    RodBody,
    Scene,
    SleeveJoint,
    split_point,
    stays_a_point,
)
from exudyn_flexlink.scene.names import Parts
from exudyn_flexlink.source import Mistake

POINT = 1e-6  # of its reach: radius of gyration of a point mass; the equations need some inertia
STEEL = 7850.0  # kg/m^3: density assumed for a body of which only the mass is known


def chain_of(scene: Scene, body: FlexibleBody) -> Chain:
    """Rods and hinges of a flexible body."""
    return discretise(
        beam_of(scene, body), body.rods, body.layout, body.hinges.stiffness, body.hinges.damping
    )


def beam_of(scene: Scene, body: FlexibleBody | RodBody) -> Beam:
    """Length, mass per length, bending stiffness and thickness of a uniform body.

    The thickness is that of a rectangle with the second moment and the area of the section.
    """
    material, section = scene.materials[body.material], body.section
    return Beam(
        body.length,
        material.density * section.area,
        material.youngs_modulus * section.second_moment,
        0.0 if body.slender else sqrt(12 * section.second_moment / section.area),
    )


def _station(lengths: Sequence[float], place: float) -> tuple[int, float]:
    """Rod at a distance (m) from the start of a row of rods, and the place along it (m).

    On a hinge, within rounding, it is the rod before the hinge.
    """
    rod = 0
    while rod < len(lengths) - 1 and place > lengths[rod] * (1 + 1e-9):
        place -= lengths[rod]
        rod += 1
    return rod, min(place, lengths[rod])


class Bodies:
    """All parts, in the order of the scene's bodies, with the joints and springs within bodies."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.parts: list[RigidPart] = []
        self.pins: list[Pin] = []
        self.slides: list[Slide] = []
        self.springs: list[RotarySpring] = []
        self.linear_springs: list[LinearSpring] = []
        self.mistakes: list[Mistake] = []
        self.points: dict[str, Anchor] = {}  # by 'body.point'
        self._first: dict[str, int] = {}
        for name in scene.bodies:
            self._first[name] = len(self.parts)
            numbers = self._add_body(name)
            self.points |= {f"{name}.{point}": anchor for point, anchor in numbers.items()}

    def first_part(self, body: str) -> int:
        """Index of the first part of a body."""
        return self._first[body]

    def anchor(self, point: str, place: tuple[float, float] | None = None) -> Anchor:
        """Anchor of 'body.point', or of a `place` (m) on the ground."""
        if point == GROUND_NAME:
            return Anchor(GROUND, *(place or (0.0, 0.0)))
        return self.points[point]

    def _on_one_rod(self, first: Anchor, second: Anchor) -> tuple[Anchor, Anchor]:
        """Two points of a body; if one is on a hinge, both as points of one rod where possible."""
        for pin in self.pins:
            parts = pin.first.part, pin.second.part
            if (first.part, second.part) == parts and isclose(first.x, pin.first.x):
                return pin.second, second
            if (second.part, first.part) == parts and isclose(second.x, pin.first.x):
                return first, pin.second
        return first, second

    def face(self, contact: PointOnLine | LineOnCurve) -> tuple[Anchor, Anchor]:
        """Both ends of a straight face, on one part if possible."""
        start, end = (self.anchor(point) for point in contact.line)
        return self._on_one_rod(start, end)

    def bent_faces(self) -> Iterator[Mistake]:
        """Refuse lines of contacts that can bend, or have no length."""
        for name, contact in self.scene.contacts.items():
            if not isinstance(contact, PointOnLine | LineOnCurve):
                continue
            path = ("contacts", name, "line")
            start, end = self.face(contact)
            if start.part != end.part:
                body = split_point(contact.line[0])[0]
                rods_between = range(self.first_part(body), min(start.part, end.part) + 1)
                place = sum(self.parts[part].reach for part in rods_between)
                message = f"'{body}' gives way at {place:g} m, between the two points"
                hint = "a face is straight: take both on one side of that place"
                yield Mistake(path, message, hint)
            elif (start.x, start.y) == (end.x, end.y):
                yield Mistake(path, "both points are at one place: a line needs a length")

    def carrier(self, curve: str) -> int:
        """Index of the part that carries a curve, or GROUND."""
        on = self.scene.curves[curve].on
        return GROUND if on is None else self.first_part(on)

    def ends(self, joint: PointsJoint) -> tuple[Anchor, Anchor]:
        """First and second point of a joint of the scene."""
        first, second = (self.anchor(point, joint.at) for point in joint.points)
        return first, second

    def joint_parts(self, joint: str) -> tuple[int, int]:
        """Parts that a revolute joint of the scene connects, first and second."""
        sliding = self.scene.joints[joint]
        assert isinstance(sliding, RevoluteJoint)  # the scene's names are checked
        first, second = self.ends(sliding)
        return first.part, second.part

    def slide(self, joint: str) -> Slide:
        """Line and anchors of a prismatic joint, or of a sleeve, of the scene."""
        sliding = self.scene.joints[joint]
        if isinstance(sliding, SleeveJoint):
            ends = (self.anchor(f"{sliding.guide}.start"), self.anchor(f"{sliding.link}.start"))
            return Slide(joint, *ends)
        assert isinstance(sliding, PrismaticJoint)  # the scene's names are checked
        x, y = sliding.axis
        return Slide(joint, *self.ends(sliding), atan2(y, x), sliding.angle or 0.0)

    def _add_body(self, name: str) -> dict[str, Anchor]:
        """Add the parts of a body; return its named points."""
        body = self.scene.bodies[name]
        if isinstance(body, FlexibleBody):
            return self._add_chain(name, body)
        if isinstance(body, RodBody):
            return self._add_rod(name, body)
        return self._add_rigid(name, body)

    def _add_chain(self, name: str, body: FlexibleBody) -> dict[str, Anchor]:
        chain, beam = chain_of(self.scene, body), beam_of(self.scene, body)
        first, rods = len(self.parts), chain.rods
        if body.stretch:  # the two halves of each rod slide on each other
            rods = tuple(beam.rod(rod.length / 2) for rod in rods for _ in range(2))
        for i, rod in enumerate(rods, start=1):
            centre, end = (rod.length / 2, 0.0), ((rod.length, 0.0),)
            label = f"{name} {i}"
            self.parts.append(RigidPart(label, name, rod.mass, rod.inertia, centre, end))
        axial = self.scene.materials[body.material].youngs_modulus * body.section.area
        count = len(rods) // len(chain.rods)  # parts of each rod
        for i, rod in enumerate(rods[:-1]):
            before, after = Anchor(first + i, rod.length, 0.0), Anchor(first + i + 1, 0.0, 0.0)
            k = i // count
            if (i + 1) % count:
                label = f"{name} stretch {k + 1}"
                self._add_stretch(label, before, after, axial / chain.rods[k].length)
            else:
                self._add_hinge(f"{name} hinge {k + 1}", before, after, chain.hinges[k])
        lengths, last = [rod.length for rod in rods], first + len(rods) - 1
        points = {"start": Anchor(first, 0.0, 0.0), "end": Anchor(last, lengths[-1], 0.0)}
        for key, along in body.points.items():
            part, place = _station(lengths, along)
            points[key] = Anchor(first + part, place, 0.0)
        return points

    def _add_hinge(self, label: str, before: Anchor, after: Anchor, hinge: Hinge) -> None:
        self.pins.append(Pin(label, before, after))
        ends = before.part, after.part
        self.springs.append(RotarySpring(label, *ends, hinge.stiffness, hinge.damping, 0.0))

    def _add_stretch(self, label: str, before: Anchor, after: Anchor, stiffness: float) -> None:
        """Let one half of a rod slide on the other, against the axial stiffness (N/m)."""
        slide = Slide(label, before, after)
        self.slides.append(slide)
        self.linear_springs.append(LinearSpring(label, before, after, stiffness, 0.0, 0.0, slide))

    def _add_rod(self, name: str, body: RodBody) -> dict[str, Anchor]:
        rod, half = beam_of(self.scene, body).rod(body.length), body.length / 2
        end, places = ((body.length, 0.0),), {"start": 0.0, "end": body.length, "centre": half}
        places |= body.points
        points = {key: Anchor(len(self.parts), place, 0.0) for key, place in places.items()}
        self.parts.append(RigidPart(name, name, rod.mass, rod.inertia, (half, 0.0), end))
        return points

    def _add_rigid(self, name: str, body: RigidBody) -> dict[str, Anchor]:
        x, y = body.centre_of_mass
        places = {"centre": (x, y), **body.points}
        points = {key: Anchor(len(self.parts), *place) for key, place in places.items()}
        apart = [place for place in places.values() if any(place)]
        if not apart:
            # A body without points off its origin still needs a size, as the weight of its angle.
            size = max((body.inertia / body.mass) ** 0.5, (body.mass / STEEL) ** (1 / 3))
            apart = [(size, 0.0)]
        # The inertia of a point mass that nothing turns is arbitrary: it follows from the size. If
        # other bodies turn with the mass, its inertia must be negligible.
        alone = stays_a_point(Parts(dict(self.scene)), name, body)
        reach = max(hypot(*point) for point in apart)
        least = body.mass * (POINT * reach) ** 2
        if 0 < body.inertia < least:  # rounding removes it, against a mass off the origin
            message = f"{body.inertia:g} kg m^2 is lost by rounding beside {body.mass:g} kg"
            hint = f"0 for a point mass, else at least {least:.2g} kg m^2"
            self.mistakes.append(Mistake(("bodies", name, "inertia"), message, hint))
        inertia = body.inertia or (body.mass * reach**2 if alone else least)
        self.parts.append(RigidPart(name, name, body.mass, inertia, (x, y), tuple(apart)))
        return points


HALF_A_TURN = pi + 1e-6  # rad: rounding puts no joint beyond half a turn


def mass_blocks(mechanism: Mechanism, q: FloatArray) -> FloatArray:
    """Mass matrix of every part by itself, (parts, 3, 3): kg, kg m, kg m^2."""
    blocks = np.zeros((len(q), 3, 3))
    for block, part, angle in zip(blocks, mechanism.parts, q[:, 2], strict=True):
        block[0, 0] = block[1, 1] = part.mass
        block[:2, 2] = block[2, :2] = part.mass * left_of(turned(np.array(part.centre), angle))
        block[2, 2] = part.inertia_about_origin
    return blocks


def applied_forces(mechanism: Mechanism, q: FloatArray, v: FloatArray, time: float) -> FloatArray:
    """Generalised forces without those of constraints and contacts, (3 parts,): N, N m.

    Weight, centrifugal terms of parts whose origin is not their centre, springs, torques and forces
    of drives, regularised friction of joints.
    """
    forces = np.zeros((len(q), 3))
    gravity = np.asarray(mechanism.gravity)
    for i, part in enumerate(mechanism.parts):
        arm = turned(np.array(part.centre), q[i, 2])
        forces[i, :2] += part.mass * (gravity + v[i, 2] ** 2 * arm)
        forces[i, 2] += part.mass * (arm[0] * gravity[1] - arm[1] * gravity[0])
    for spring in mechanism.springs:
        angle = turning(spring.first, spring.second, q)
        rate = turning(spring.first, spring.second, v)
        if spring.law is not None:
            _add_torque(forces, spring.first, spring.second, -float(spring.law.at(angle, rate)))
        torque = -spring.stiffness * (angle - (spring.rest_angle or 0.0)) - spring.damping * rate
        _add_torque(forces, spring.first, spring.second, float(torque))
    for linear in mechanism.linear_springs:
        stretched = anchor_jacobian(linear.second, q) - anchor_jacobian(linear.first, q)
        forces += (stretched.T @ spring_force(linear, q, v)).reshape(forces.shape)
    for friction in mechanism.frictions:
        joint, size = friction.joint, float(friction.regularised(joint_speed(friction.joint, q, v)))
        if isinstance(joint, Slide):
            stretched = anchor_jacobian(joint.second, q) - anchor_jacobian(joint.first, q)
            forces += (stretched.T @ (size * line_of(joint, q))).reshape(forces.shape)
        else:
            _add_torque(forces, joint.first.part, joint.second.part, size)
    for motor in mechanism.torque_motors:
        _add_torque(forces, motor.first, motor.second, size_at(motor.size, time, q, v))
    for force in mechanism.forces:
        push = force_at(force, np.array([time]), q[None], v[None])[0]
        forces += (anchor_jacobian(force.point, q).T @ push).reshape(forces.shape)
    return forces.ravel()


def _add_torque(forces: FloatArray, first: int, second: int, torque: float) -> None:
    if second != GROUND:
        forces[second, 2] += torque
    if first != GROUND:
        forces[first, 2] -= torque


def constraints_at(mechanism: Mechanism, q: FloatArray, places: FloatArray) -> Constraints:
    """All constraints with the motors', slots at their foot points, searched from `places`."""
    feet = places_near(mechanism, q, places)
    return constraint_rows(mechanism, q, feet)


def demanded_accelerations(
    mechanism: Mechanism,
    speeds_at: Callable[[FloatArray], FloatArray],
    q: FloatArray,
    v: FloatArray,
    time: float,
) -> FloatArray:
    """Value of ``J a`` that joints and motors demand, (rows,): ``-dJ/dt v - c_tt``.

    `speeds_at` gives ``J v`` with the velocities `v` at given coordinates. Its rate is a central
    difference along the motion, exact to second order in 1e-6 s.
    """
    dt = 1e-6
    right = -(speeds_at(q + dt * v) - speeds_at(q - dt * v)) / (2 * dt)
    motors = [motor.speed.rates(np.array([time]))[0] for motor in mechanism.speed_motors]
    if motors:
        right[-len(motors) :] += motors
    return right


def accelerations(
    mechanism: Mechanism, q: FloatArray, v: FloatArray, places: FloatArray, time: float
) -> FloatArray:
    """Accelerations (parts, 3) that satisfy equations of motion and joints, without contacts.

    The solution of ``M a = f`` is changed as little as ``J a = -dJ/dt v - c_tt`` demands, measured
    by the mass matrix. Joints may be redundant.
    """
    right = demanded_accelerations(
        mechanism, lambda pose: constraints_at(mechanism, pose, places).times(v), q, v, time
    )
    forces = applied_forces(mechanism, q, v, time)
    return motions_by_mass(mechanism, q, places, right).nearest(forces)


def started(mechanism: Mechanism, q: FloatArray, places: FloatArray) -> FloatArray:
    """Accelerations (parts, 3) that drives cause at time 0 if all other forces are in balance."""
    right = demanded_accelerations(
        mechanism,
        lambda pose: np.zeros(len(constraints_at(mechanism, pose, places))),
        q,
        0 * q,
        0.0,
    )
    return motions_by_mass(mechanism, q, places, right).nearest()


def motions_by_mass(
    mechanism: Mechanism, q: FloatArray, places: FloatArray, right: FloatArray | None = None
) -> LeastMotion:
    """Nearest motions, measured by the masses; without `right` joints demand ``J a = 0``."""
    constraints = constraints_at(mechanism, q, places)
    right = np.zeros(len(constraints)) if right is None else right
    roots = np.asarray(np.linalg.cholesky(mass_blocks(mechanism, q)), dtype=np.float64)
    return LeastMotion(mechanism, constraints, roots, right)


def pushed(
    mechanism: Mechanism, q: FloatArray, places: FloatArray, forces: FloatArray
) -> FloatArray:
    """Accelerations (parts, 3) by generalised forces (3 parts,) alone, from rest."""
    return motions_by_mass(mechanism, q, places).nearest(forces)


def contact_mass(
    mechanism: Mechanism, contact: Contact | Channel, q: FloatArray, places: FloatArray
) -> float:
    """Least mass (kg) that the two bodies oppose to a contact, at any place and in any direction.

    It is ``1 / (largest mobility of the first body's anchors + that of the second's)``, with every
    joint closed. It bounds the duration of an impact from below, and so the step. At a hinge's stop
    or a gear's flank it is the inertia (kg m^2) that the bodies oppose to a torque.
    """
    if isinstance(contact, SumStop):
        row = gradient(contact, q)
        moves = motions_by_mass(mechanism, q, places).nearest(row)
        return 1.0 / max(float(row @ moves.ravel()), TINY)
    first, second = contact.anchors
    if isinstance(contact, RopeContact):
        first, second = contact.over, ()
    rows = np.array([anchor_jacobian(anchor, q) for anchor in (*first, *second)])
    moved = motions_by_mass(mechanism, q, places).nearest(rows.reshape(-1, q.size).T)
    by_anchor = np.einsum("aik,kaj->aij", rows, moved.reshape(q.size, len(rows), 2))
    mobilities = np.linalg.eigvalsh(by_anchor).max(axis=1)  # m/s^2 per N
    if isinstance(contact, RopeContact):
        return 1.0 / max(float(contact.weights**2 @ mobilities), TINY)
    largest = float(mobilities[: len(first)].max() + mobilities[len(first) :].max())
    return 1.0 / max(largest, TINY)


# --- springs ------------------------------------------------------------


def spring_force(spring: LinearSpring, q: FloatArray, v: FloatArray) -> FloatArray:
    """Force (..., 2) on the second anchor, N, at coordinates and velocities (..., parts, 3)."""
    if _draws_to_a_point(spring):
        between, moving = _between(spring, q, v)
        return np.asarray(-spring.stiffness * between - spring.damping * moving)
    stretched, rate, along = _stretched(spring, q, v)
    tension = spring.stiffness * stretched + spring.damping * rate
    if spring.law is not None:
        tension = tension + spring.law.at(stretched + (spring.length or 0.0), rate)
    return np.asarray(-tension[..., None] * along)


def length_of(spring: LinearSpring, q: FloatArray) -> float:
    """Distance (m) of a spring's anchors, or stroke of its slide, at coordinates (parts, 3)."""
    return float(_stretched(spring, q, q)[0]) + (spring.length or 0.0)


def damping_power(spring: LinearSpring, q: FloatArray, v: FloatArray) -> FloatArray:
    """Power (...,), W, that the damper dissipates at coordinates and velocities (..., parts, 3)."""
    if _draws_to_a_point(spring):
        _, moving = _between(spring, q, v)
        return np.asarray(spring.damping * np.sum(moving**2, axis=-1))
    _, rate, _ = _stretched(spring, q, v)
    return np.asarray(spring.damping * rate**2)


def _draws_to_a_point(spring: LinearSpring) -> bool:
    """Tell whether a spring draws one anchor to the other from any direction (free length 0)."""
    return spring.slide is None and spring.length == 0


def _stretched(
    spring: LinearSpring, q: FloatArray, v: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Stretch (...,) of a spring, m, the rate of it, and the direction (..., 2)."""
    rest = spring.length or 0.0
    if spring.slide is not None:
        slide = spring.slide
        return length_along(slide, q) - rest, speed_along(slide, q, v), line_of(slide, q)
    between, moving = _between(spring, q, v)
    size = np.hypot(between[..., 0], between[..., 1])
    along = between / np.maximum(size, TINY)[..., None]
    return size - rest, np.sum(along * moving, axis=-1), along


def _between(spring: LinearSpring, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Vector (..., 2) from the first to the second anchor, m, and its rate, m/s."""
    between = anchor_position(spring.second, q) - anchor_position(spring.first, q)
    moving = anchor_velocity(spring.second, q, v) - anchor_velocity(spring.first, q, v)
    return between, moving


def wound_at_start(mechanism: Mechanism, q: FloatArray) -> Iterator[str]:
    """Warn of springs wound by more than half a turn at coordinates (parts, 3) of time 0.

    This may be intended, as for the mainspring of a clock. But 170 deg and -190 deg are the same
    pose of a body, and different states of a spring.
    """
    for spring in mechanism.springs:
        wound = float(turning(spring.first, spring.second, q)) - (spring.rest_angle or 0.0)
        if spring.stiffness > 0 and abs(wound) > HALF_A_TURN:
            yield (
                f"'{spring.name}' starts wound by {degrees(wound):.4g} deg: whole turns count; "
                "where they are not meant, give an angle in 'initial' 360 deg more or less"
            )


# --- energies ------------------------------------------------------------


class EnergyMeter:
    """Energies (J) and powers (W) of states `q`, `v` of shape (instants, parts, 3)."""

    def __init__(self, mechanism: Mechanism) -> None:
        parts, springs = mechanism.parts, mechanism.springs
        self._linear = mechanism.linear_springs
        self._laws = [(law, sense) for law, sense in mechanism.spring_laws if law.stores]
        self._mass = np.array([part.mass for part in parts])
        self._inertia = np.array([part.inertia_about_origin for part in parts])
        self._centre = np.array([part.centre for part in parts])
        self._gravity = np.asarray(mechanism.gravity, dtype=float)
        self._first = np.array([spring.first for spring in springs], dtype=int)
        self._second = np.array([spring.second for spring in springs], dtype=int)
        self._stiffness = np.array([spring.stiffness for spring in springs])
        self._damping = np.array([spring.damping for spring in springs])
        self._rest = np.array([spring.rest_angle or 0.0 for spring in springs])

    def kinetic(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Kinetic energy, (instants,)."""
        arms = turned(self._centre, q[..., 2])
        linear = np.sum(v[..., :2] ** 2, axis=-1)
        coupled = v[..., 2] * (v[..., 1] * arms[..., 0] - v[..., 0] * arms[..., 1])
        rotary = self._inertia * v[..., 2] ** 2
        return np.asarray(0.5 * np.sum(self._mass * (linear + 2 * coupled) + rotary, axis=-1))

    def potential(self, q: FloatArray) -> FloatArray:
        """Energy of springs and weight, zero weight at the coordinate origin, (instants,)."""
        height = (q[..., :2] + turned(self._centre, q[..., 2])) @ self._gravity
        stored = 0.5 * np.sum(self._stiffness * (self._turned(q) - self._rest) ** 2, axis=-1)
        for spring in self._linear:
            stored = stored + 0.5 * spring.stiffness * _stretched(spring, q, q)[0] ** 2
        for law, sense in self._laws:
            stored = stored + law.energy(sensed(sense, q, q))
        return np.asarray(stored - np.sum(self._mass * height, axis=-1))

    def damping_power(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Power lost in the dampers of hinges and springs, never negative, (instants,)."""
        lost = np.sum(self._damping * self._turned(v) ** 2, axis=-1)
        for spring in self._linear:
            lost = lost + damping_power(spring, q, v)
        return np.asarray(lost)

    def _turned(self, x: FloatArray) -> FloatArray:
        """Angle, or speed, of the second part relative to the first, (instants, springs)."""
        ground = np.zeros((*x.shape[:-2], 1))  # index -1: the ground does not turn
        angles = np.concatenate([x[..., 2], ground], axis=-1)
        return np.asarray(angles[..., self._second] - angles[..., self._first])

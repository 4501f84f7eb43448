"""The hand-written equations of motion: the scenes they cover, and their constants.

Such a scene has one guide pinned to the ground, one link in its sleeve that starts in a slot, and
any number of levers pinned to the ground. Anything else in a scene is refused by name.

The equations are the paper's eq. 1, ``M q'' + h = Q``. Coordinates are angles: the guide's theta,
which is also that of rod 1, the absolute angles of the other rods, and those of the levers.
With ``e`` the unit vector of an angle, a point of the link is at

    r = gamma(theta) + sum_j a_j e(Theta_j)

``gamma`` is the place of P, which the guide's angle determines (see `track`). a_j is the length of
each rod before the point, and on the point's own rod its distance from the rod's start. With r_k
the derivatives of r by the coordinates, the point's velocity is ``sum_k r_k q_k'``. Without q'' its
acceleration is ``b = gamma'' theta'^2 - sum_j a_j e(Theta_j) Theta_j'^2``. Summed over the centres
of the rods, of masses m, Lagrange's equations then have

    M_jk = sum m r_j . r_k + J_j delta_jk,    h_j = sum m r_j . b

J are moments of inertia: of rods about their centres, of guide and levers about their pivots.

With play between link and guide, the angles of all rods and of the guide are coordinates, and so is
P's place u on its track: P is at ``gamma(u)``. With play between P and its slot, the last
coordinate is the distance rho of P along the guide: P is at ``C + rho e(theta)``, with C the
guide's pivot. With both kinds of play, x and y of P are the last two coordinates.

Vectors are complex numbers, x + i y. The first axis of all arrays counts instants, such as stages.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from types import UnionType
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.curves import Places, evaluator
from exudyn_flexlink.engines import NotRepresentableError
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.mechanism import (
    GROUND,
    Anchor,
    Applied,
    Assembly,
    Contact,
    CurveContact,
    FaceContact,
    Mechanism,
    Motor,
    Pin,
    Ramp,
    TorqueMotor,
    runs_for_minimal,
)
from exudyn_flexlink.rounding import PLACE_ROUNDING
from exudyn_flexlink.scene import (
    BeltJoint,
    FlexibleBody,
    GearJoint,
    PrismaticJoint,
    RevoluteJoint,
    Scene,
    SleeveJoint,
    SlotJoint,
    SpeedDrive,
    WeldJoint,
)
from exudyn_flexlink.source import KeyPath


@dataclass(frozen=True)
class Pivot:
    """A part hinged to the ground: its joint, and the hinge on the ground and in the part's axes.

    `second` tells whether the part is the joint's second body.
    """

    joint: str
    part: int
    at: tuple[float, float]
    pin: tuple[float, float]
    second: bool


@dataclass(frozen=True)
class Layout:
    """The parts that are guide, link (its rods in order) and levers; the drives; the struck faces.

    With `play` between link and guide, the angle of rod 1 and P's place on its track (the last
    coordinate) are coordinates. Without it, the guide's angle determines both. If P `slides`, with
    play in its slot, the last coordinate is its place along the guide; with both kinds of play the
    last two are P's x and y.
    """

    guide: Pivot
    rods: tuple[int, ...]
    levers: tuple[Pivot, ...]
    motor: Motor | None
    ramp: Ramp | None  # of that motor
    torques: tuple[tuple[TorqueMotor, Ramp], ...]
    play: bool
    slides: bool
    faces: tuple[FaceContact, ...]

    @property
    def track_coordinate(self) -> int:
        """First coordinate that determines P's place."""
        if self.play or self.slides:
            return len(self.rods) + len(self.levers) + self.play
        return 0

    @property
    def way(self) -> float:
        """Sense in which the motor turns the guide: -1 if the guide is the joint's first part."""
        return -1.0 if self.motor is not None and self.motor.second == GROUND else 1.0

    @property
    def count(self) -> int:
        """Number of coordinates."""
        return len(self.rods) + len(self.levers) + 2 * self.play + self.slides

    def coordinate(self, part: int) -> int:
        """Coordinate that is the angle of a part; -1 for the ground."""
        if part == GROUND:
            return -1
        if part == self.guide.part:
            return 0
        first = 1 if self.play else 0
        if part in self.rods:
            return first + self.rods.index(part)
        return first + len(self.rods) + [lever.part for lever in self.levers].index(part)


def layout_of(scene: Scene, mechanism: Mechanism) -> Layout:
    """Find guide, link and levers.

    Raises:
        NotRepresentableError: the scene has something else, or lacks one of them.

    """
    for path, lacks in _lacking(scene, mechanism):
        raise NotRepresentableError(path, f"the Lagrangian engine has {lacks}")
    pivots = {name: _pivot(mechanism, name) for name in _joints(scene, RevoluteJoint)}
    sleeve = _only(scene, SleeveJoint, "sleeve", "a link that slides in a guide")
    slot = _only(scene, SlotJoint, "slot", "a link whose start runs along a curve")
    needs = ("joints", slot), "the Lagrangian engine needs"
    if mechanism.all_slots[0].carrier != GROUND:
        raise NotRepresentableError(needs[0], f"{needs[1]} a track that stands still")
    joint = scene.joints[sleeve]
    assert isinstance(joint, SleeveJoint)
    rods = mechanism.bodies[joint.link]
    if mechanism.all_slots[0].anchor != Anchor(rods[0], 0.0, 0.0):
        raise NotRepresentableError(needs[0], f"{needs[1]} '{joint.link}.start' in the slot")
    guide = _guide(mechanism, joint.guide, sleeve, pivots)
    levers = _levers(mechanism, (guide.part, *rods), pivots, guide)
    motor = _motor(scene, mechanism, guide)
    ramp = None if motor is None else _ramp(motor.name, motor.speed)
    torques = tuple(
        (torque, _ramp(torque.name, torque.size.value)) for torque in mechanism.torque_motors
    )
    faces = tuple(_face(contact, rods, levers) for contact in mechanism.contacts)
    play = any(channel.clearance > 0 for channel in mechanism.channels)
    slides = bool(mechanism.grooves)
    return Layout(guide, rods, levers, motor, ramp, torques, play, slides, faces)


def _lacking(scene: Scene, mechanism: Mechanism) -> Iterator[tuple[KeyPath, str]]:
    """Paths of a scene's items that this engine does not cover, and a message for each."""
    for bearing in mechanism.bearings:
        yield ("joints", bearing.name, "clearance"), "no journals in bearings"
    for stop in scene.stops.values():
        yield stop.path, f"no {stop.noun}"
    for kind, lacks in (
        (WeldJoint, "no welds"),
        (GearJoint | BeltJoint, "no gears"),
        (PrismaticJoint, "no such joints"),
    ):
        for name in _joints(scene, kind):
            yield ("joints", name), lacks
    for friction in mechanism.frictions:
        key = "freewheel" if friction.one_way else "friction"
        yield ("joints", friction.name, key), f"no {key} in joints"
    for name, body in scene.bodies.items():
        if isinstance(body, FlexibleBody) and body.stretch:
            yield ("bodies", name, "stretch"), "rods that do not stretch"
    for force in mechanism.forces:
        yield ("drives", force.name), "no forces at points"
    yield from runs_for_minimal(scene)
    yield from _other_springs(scene, mechanism)
    yield from _rough_impacts(mechanism)


def _rough_impacts(mechanism: Mechanism) -> Iterator[tuple[tuple[str, ...], str]]:
    """Slots with friction in impacts, and a message for each."""
    for groove in mechanism.grooves:
        if isinstance(groove.law, Impulse) and groove.friction is not None:
            yield ("joints", groove.name, "law", "friction"), "no friction in impacts"


def _other_springs(scene: Scene, mechanism: Mechanism) -> Iterator[tuple[tuple[str, ...], str]]:
    """Springs that this engine does not cover, and a message for each."""
    for name in (*scene.ropes, *(spring.name for spring in mechanism.linear_springs)):
        yield ("springs", name), "torsional springs alone"
    for turning in (spring for spring in mechanism.springs if spring.law):
        yield ("springs", turning.name, "torque"), "springs of one stiffness"


def _joints(scene: Scene, kind: type | UnionType) -> list[str]:
    return [name for name, joint in scene.joints.items() if isinstance(joint, kind)]


def _only(scene: Scene, kind: type, word: str, meaning: str) -> str:
    names = _joints(scene, kind)
    if not names:
        message = f"the Lagrangian engine needs a {word} joint: {meaning}"
        raise NotRepresentableError(("joints",), message)
    for name in names[1:]:
        raise NotRepresentableError(("joints", name), f"a second {word}: the engine knows one")
    return names[0]


def _pivot(mechanism: Mechanism, name: str) -> Pivot:
    """Read a revolute joint as the hinge of a part on the ground."""
    joint: Pin = next(pin for pin in mechanism.pins if pin.name == name)
    ground, moving = joint.first, joint.second
    if joint.second.part == GROUND:
        ground, moving = moving, ground
    if ground.part != GROUND:
        message = "joins two moving bodies: the Lagrangian engine has pins to the ground"
        raise NotRepresentableError(("joints", name), message)
    second = moving is joint.second
    return Pivot(name, moving.part, (ground.x, ground.y), (moving.x, moving.y), second)


def _guide(mechanism: Mechanism, body: str, sleeve: str, pivots: dict[str, Pivot]) -> Pivot:
    parts = mechanism.bodies[body]
    if len(parts) > 1:
        raise NotRepresentableError(("bodies", body), "a guide must be rigid: rod or rigid")
    guides = [pivot for pivot in pivots.values() if pivot.part == parts[0]]
    if not guides:
        message = "a guide must turn about a point on the ground"
        raise NotRepresentableError(("bodies", body), message)
    guide = guides[0]
    if mechanism.slides and abs(guide.pin[1] - mechanism.slides[0].first.y) > PLACE_ROUNDING:
        message = f"must lie on the axis of the sleeve '{sleeve}'"
        raise NotRepresentableError(("joints", guide.joint), message)
    return guide


def _levers(
    mechanism: Mechanism, taken: tuple[int, ...], pivots: dict[str, Pivot], guide: Pivot
) -> tuple[Pivot, ...]:
    levers: list[Pivot] = []
    used = {guide.part}
    for name, pivot in pivots.items():
        if pivot is guide:
            continue
        if pivot.part in used or pivot.part in taken:
            raise NotRepresentableError(("joints", name), "its body is held by another joint")
        used.add(pivot.part)
        levers.append(pivot)
    for index, part in enumerate(mechanism.parts):
        several = len(mechanism.bodies[part.body]) > 1
        if index not in taken and (several or index not in used):
            message = "neither guide nor link nor a rigid body on a pin"
            raise NotRepresentableError(("bodies", part.body), message)
    return tuple(levers)


def _ramp(drive: str, value: Applied) -> Ramp:
    if not isinstance(value, Ramp):
        message = "the Lagrangian engine has numbers, with a ramp, alone"
        raise NotRepresentableError(("drives", drive, "value"), message)
    return value


def _motor(scene: Scene, mechanism: Mechanism, guide: Pivot) -> Motor | None:
    """Motor that prescribes the guide's speed, if any."""
    for k, motor in enumerate(mechanism.speed_motors):
        drive = scene.drives[motor.name]
        if k > 0 or not (isinstance(drive, SpeedDrive) and drive.joint == guide.joint):
            message = "only the speed of the guide can be prescribed, once"
            raise NotRepresentableError(("drives", motor.name), message)
    return next(iter(mechanism.speed_motors), None)


def _face(contact: Contact, rods: tuple[int, ...], levers: tuple[Pivot, ...]) -> FaceContact:
    """Read a contact as a point of the link and a face of a lever."""
    path = ("contacts", contact.name)
    if not isinstance(contact, FaceContact):
        raise NotRepresentableError(path, "the Lagrangian engine has points on lines alone")
    if contact.point.part not in rods or contact.point.y != 0.0:
        raise NotRepresentableError((*path, "point"), "must be a point of the link")
    if contact.start.part not in [lever.part for lever in levers]:
        raise NotRepresentableError((*path, "line"), "must be on a body pinned to the ground")
    if isinstance(contact.law, Impulse) and contact.friction is not None:
        message = "the Lagrangian engine has no friction in impacts"
        raise NotRepresentableError((*path, "law", "friction"), message)
    return contact


@dataclass(frozen=True)
class Numbers:
    """Constants of the equations, for N coordinates and n rods.

    Points of the link are the ends of its rods from P on, the rods' centres, and the points of its
    contacts.
    """

    arms: FloatArray  # (points, n): a_j of each point, m
    masses: FloatArray  # (n,) of rods, kg
    inertias: FloatArray  # (N,): of each coordinate, kg m^2
    stiffness: FloatArray  # (N, N) of hinges and springs, N m/rad
    damping: FloatArray  # (N, N), N m s/rad
    preload: FloatArray  # (N,): torques of springs at q = 0, N m
    moments: ComplexArray  # (N,): mass times centre from the pivot, of guide and levers, kg m
    gravity: complex  # m/s^2
    reaches: FloatArray  # (N,): of guide and levers from their pivots, m
    rods: slice  # the rods' coordinates
    track: int  # the coordinate that determines P's place
    pivot: complex | None  # m: of the guide along which P slides; None if P does not slide
    free: bool  # whether P has two coordinates

    @property
    def ends(self) -> slice:
        """Points that are ends of rods."""
        return slice(len(self.masses) + 1)

    @property
    def centres(self) -> slice:
        """Points that are centres of rods."""
        return slice(len(self.masses) + 1, 2 * len(self.masses) + 1)


class Frame(NamedTuple):
    """Places and velocities of guide and link at instants (m,).

    `axes` (m, N) are unit vectors of the coordinates' angles. `points` (m, points) are those of the
    link, `going` their velocities, `by` (m, points, N) their derivatives by the coordinates, and
    `bends` (m, points) their accelerations without those of the coordinates.
    """

    q: FloatArray
    v: FloatArray
    axes: ComplexArray
    points: ComplexArray
    going: ComplexArray
    by: ComplexArray
    bends: ComplexArray

    def pick(self, which: int | slice | None) -> Frame:
        """Return the frame at one of several instants, at some, or (None) with an axis added."""
        return Frame._make(column[which] for column in self)


def frame_of(numbers: Numbers, q: FloatArray, v: FloatArray, track: Places) -> Frame:
    """Return the frame for all coordinates and speeds (m, N), with P's place `track`.

    The derivatives of `track` are by the first coordinate that determines P. If P slides along the
    guide, the guide's angle moves P, too.
    """
    rod_rows, p, (place, first, second) = numbers.rods, numbers.track, track
    axes = np.exp(1j * q)
    rods, to_points = axes[:, rod_rows], numbers.arms.T
    by = np.zeros((len(q), *numbers.arms.shape[:1], q.shape[1]), dtype=np.complex128)
    by[:, :, rod_rows] = numbers.arms * (1j * rods)[:, None, :]
    by[:, :, p] += first[:, None]
    if numbers.free:
        by[:, :, p + 1] += 1j
    points = place[:, None] + rods @ to_points
    bends = (second * v[:, p] ** 2)[:, None] - (rods * v[:, rod_rows] ** 2) @ to_points
    if numbers.pivot is not None:
        across = 1j * (place - numbers.pivot)
        by[:, :, 0] += across[:, None]
        turning = v[:, 0]
        turned = 1j * turning * (2 * first * v[:, p] + across * turning)
        bends = bends + turned[:, None]
    going = np.asarray((by @ v[:, :, None])[:, :, 0], dtype=np.complex128)
    return Frame(q, v, axes, points, going, by, bends)


def mass_and_force(numbers: Numbers, frame: Frame) -> tuple[FloatArray, FloatArray]:
    """Mass matrices M (m, N, N) and forces ``Q - h`` (m, N), of springs, dampers and weight."""
    by, bends = frame.by[:, numbers.centres], frame.bends[:, numbers.centres] - numbers.gravity
    moved = np.concatenate([by, bends[:, :, None]], axis=2) * numbers.masses[:, None]
    summed = (by.conj().swapaxes(1, 2) @ moved).real
    force = (
        numbers.preload - frame.q @ numbers.stiffness - frame.v @ numbers.damping - summed[:, :, -1]
    )
    if numbers.gravity:
        force += ((numbers.moments * frame.axes).conj() * numbers.gravity * -1j).real
    return summed[:, :, :-1] + np.diag(numbers.inertias), force


def momentum_rate(numbers: Numbers, frame: Frame, a: FloatArray) -> ComplexArray:
    """Rate (m,) of the link's momentum at accelerations (m, N), N."""
    middles = numbers.centres
    moving = (frame.by[:, middles] @ a[:, :, None])[:, :, 0] + frame.bends[:, middles]
    return np.asarray(moving @ numbers.masses)


def moved_by(numbers: Numbers, frame: Frame) -> ComplexArray:
    """Derivatives (points, N) of ends of rods, guide and levers by the coordinates.

    They are those at the first instant.
    """
    return np.concatenate([frame.by[0, numbers.ends], np.diag(numbers.reaches)])


@dataclass(frozen=True)
class Model:
    """The mechanism, its parts' roles, the constants of its equations.

    `contacts` are those of levers, then walls of P's slot, then pairs of link and guide. `struck`
    has the numbers of the link's points that are in contacts.
    """

    assembly: Assembly
    layout: Layout
    numbers: Numbers
    contacts: tuple[FaceContact | CurveContact, ...]
    struck: dict[Anchor, int]

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism of the assembly."""
        return self.assembly.mechanism

    @property
    def first(self) -> int:
        """First free coordinate: a speed drive prescribes the guide's angle, which is number 0."""
        return 0 if self.layout.motor is None else 1

    @cached_property
    def start(self) -> tuple[FloatArray, FloatArray]:
        """All coordinates and speeds (N,) at time 0."""
        state, layout = self.assembly.state, self.layout
        q, v = np.zeros(layout.count), np.zeros(layout.count)
        for part in (*layout.rods, layout.guide.part, *(lever.part for lever in layout.levers)):
            k = layout.coordinate(part)
            q[k], v[k] = state.q[part, 2], state.v[part, 2]
        start = layout.rods[0]
        if layout.slides and layout.play:
            q[-2:] = state.q[start, :2]
            v[-2:] = state.v[start, :2]
        elif layout.slides:
            along = np.array([np.cos(q[0]), np.sin(q[0])])
            q[-1] = (state.q[start, :2] - layout.guide.at) @ along
            v[-1] = state.v[start, :2] @ along
        elif layout.play:
            curve = self.mechanism.slots[0].curve
            piece, q[layout.track_coordinate] = curve.locate(float(state.places[0]))
            tangent = np.array(evaluator(curve.pieces[piece])(q[layout.track_coordinate])[2:4])
            v[layout.track_coordinate] = state.v[start, :2] @ tangent / (tangent @ tangent)
        return q, v

    def poses(self, frame: Frame) -> tuple[FloatArray, FloatArray]:
        """Poses and rates (instants, parts, 3) of all parts."""
        shape = (len(frame.q), len(self.mechanism.parts), 3)
        poses, rates, layout = np.empty(shape), np.empty(shape), self.layout
        for pivot in (layout.guide, *layout.levers):
            i, part = layout.coordinate(pivot.part), pivot.part
            arm = complex(*pivot.pin) * frame.axes[:, i]
            _fill(poses[:, part], complex(*pivot.at) - arm, frame.q[:, i])
            _fill(rates[:, part], -1j * frame.v[:, i] * arm, frame.v[:, i])
        for k, part in enumerate(layout.rods):
            i = layout.coordinate(part)
            _fill(poses[:, part], frame.points[:, k], frame.q[:, i])
            _fill(rates[:, part], frame.going[:, k], frame.v[:, i])
        return poses, rates


def _fill(rows: FloatArray, place: ComplexArray, angle: FloatArray) -> None:
    rows[:, 0], rows[:, 1], rows[:, 2] = place.real, place.imag, angle


def build_model(scene: Scene, assembly: Assembly) -> Model:
    """Recognise the scene and compute the constants of its equations.

    Raises:
        NotRepresentableError: the scene is not guide, link and levers.

    """
    mechanism = assembly.mechanism
    layout = layout_of(scene, mechanism)
    parts, rods = mechanism.parts, layout.rods
    pairs = tuple(pair for channel in mechanism.channels for pair in channel.contacts)
    walls = tuple(wall for groove in mechanism.grooves for wall in groove.contacts)
    arms, struck = _arms(mechanism, rods, (*layout.faces, *pairs))
    inertias, reaches = np.zeros(layout.count), np.zeros(layout.count)
    moments = np.zeros(layout.count, dtype=np.complex128)
    for part in rods:
        inertias[layout.coordinate(part)] += parts[part].inertia
    for pivot in (layout.guide, *layout.levers):
        k = layout.coordinate(pivot.part)
        moments[k], inertia = _about_pin(mechanism, pivot)
        inertias[k] += inertia
        reaches[k] = parts[pivot.part].reach
    stiffness, damping, preload = _springs(mechanism, layout)
    begin = layout.coordinate(rods[0])
    numbers = Numbers(
        arms=arms,
        masses=np.array([parts[part].mass for part in rods]),
        inertias=inertias,
        stiffness=stiffness,
        damping=damping,
        preload=preload,
        moments=moments,
        gravity=complex(*mechanism.gravity),
        reaches=reaches,
        rods=slice(begin, begin + len(rods)),
        track=layout.track_coordinate,
        pivot=complex(*layout.guide.at) if layout.slides and not layout.play else None,
        free=layout.slides and layout.play,
    )
    return Model(assembly, layout, numbers, (*layout.faces, *walls, *pairs), struck)


def _arms(
    mechanism: Mechanism, rods: tuple[int, ...], contacts: tuple[FaceContact, ...]
) -> tuple[FloatArray, dict[Anchor, int]]:
    """Arms (points, n) of the link's points, see `Numbers`, and numbers of points in contacts.

    All points lie on the rods' axes.
    """
    joined = {pin.first.part: pin.first.x for pin in mechanism.pins if pin.first.part in rods}
    lengths = [joined.get(part, mechanism.parts[part].reach) for part in rods]
    before = np.tri(len(rods) + 1, len(rods), k=-1) * lengths
    along = np.eye(len(rods))
    centres = [mechanism.parts[part].centre[0] for part in rods]
    arms = [*before, *(before[:-1] + along * centres)]
    struck = {Anchor(part, 0.0, 0.0): i for i, part in enumerate(rods)}
    for point in [contact.point for contact in contacts if contact.point.part in rods]:
        if point not in struck:
            struck[point] = len(arms)
            rod = rods.index(point.part)
            arms.append(before[rod] + along[rod] * point.x)
    return np.array(arms), struck


def _about_pin(mechanism: Mechanism, pivot: Pivot) -> tuple[complex, float]:
    """Mass times centre from the hinge, in the part's axes, and inertia about the hinge."""
    part = mechanism.parts[pivot.part]
    arm = complex(*part.centre) - complex(*pivot.pin)
    return part.mass * arm, part.inertia + part.mass * abs(arm) ** 2


def turning_row(layout: Layout, first: int, second: int) -> FloatArray:
    """Derivative of the second part's angle relative to the first's by the coordinates."""
    row = np.zeros(layout.count)
    for part, sign in ((second, 1.0), (first, -1.0)):
        if part != GROUND:
            row[layout.coordinate(part)] += sign
    return row


def _springs(mechanism: Mechanism, layout: Layout) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Stiffness and damping matrix of hinges and springs, and their torques at q = 0."""
    stiffness, damping = np.zeros((2, layout.count, layout.count))
    preload = np.zeros(layout.count)
    for spring in mechanism.springs:
        row = turning_row(layout, spring.first, spring.second)
        stiffness += spring.stiffness * np.outer(row, row)
        damping += spring.damping * np.outer(row, row)
        preload += spring.stiffness * (spring.rest_angle or 0.0) * row
    return stiffness, damping, preload

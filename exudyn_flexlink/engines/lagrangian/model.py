"""A recognised mechanism in numbers: constants of its equations, and coordinates to poses."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves import evaluator
from exudyn_flexlink.engines.lagrangian.constants import Constants, constants_made
from exudyn_flexlink.engines.lagrangian.layout import (
    Layout,
    Pivot,
    face_angle,
    face_offsets,
    layout_of,
)
from exudyn_flexlink.laws import RestitutionPenalty
from exudyn_flexlink.mechanism import GROUND, Assembly, FaceContact, Mechanism
from exudyn_flexlink.scene import Scene

# Coordinates (samples times N) that poses are made of in one block: an array of 64 kB, which fits
# into a core's cache.
BLOCK_COORDINATES = 8192


@dataclass(frozen=True)
class Model:
    """The mechanism, its parts' roles, the constants of its equations."""

    assembly: Assembly
    layout: Layout
    constants: Constants

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism behind the numbers."""
        return self.assembly.mechanism

    @property
    def first(self) -> int:
        """First free coordinate: the guide's angle is not, under a speed drive."""
        return 0 if self.layout.motor is None else 1

    @cached_property
    def start(self) -> tuple[FloatArray, FloatArray]:
        """Coordinates and speeds at time 0."""
        state, layout = self.assembly.state, self.layout
        q, v = np.zeros(layout.count), np.zeros(layout.count)
        for part in (*layout.rods, layout.guide.part, *(lever.part for lever in layout.levers)):
            k = layout.coordinate(part)
            q[k], v[k] = state.q[part, 2], state.v[part, 2]
        if layout.play:
            curve = self.mechanism.slots[0].curve
            piece, q[layout.track_coordinate] = curve.locate(float(state.places[0]))
            tangent = np.array(evaluator(curve.pieces[piece])(q[layout.track_coordinate])[2:4])
            v[layout.track_coordinate] = state.v[layout.rods[0], :2] @ tangent / (tangent @ tangent)
        return q, v

    @cached_property
    def machine_constants(self) -> Constants:
        """The constants as machine code takes them."""
        return constants_made(*self.constants)

    def poses(
        self, q: FloatArray, v: FloatArray, points: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Poses and rates (samples, parts, 3) of all parts.

        `q`, `v` are (samples, coordinates), `points` (samples, 6) as in `equations`.
        """
        shape = (len(self.mechanism.parts), 3, len(q))
        poses, rates = np.empty(shape), np.empty(shape)
        some = max(1, BLOCK_COORDINATES // q.shape[1])
        for first in range(0, len(q), some):
            now = slice(first, first + some)
            self._place(q[now].T, v[now].T, points[now].T, poses[..., now], rates[..., now])
        return poses.transpose(2, 0, 1), rates.transpose(2, 0, 1)

    def _place(
        self,
        q: FloatArray,
        v: FloatArray,
        points: FloatArray,
        poses: FloatArray,
        rates: FloatArray,
    ) -> None:
        """Fill in poses and rates (parts, 3, samples): a coordinate at all samples is one row."""
        layout = self.layout
        for pivot in (layout.guide, *layout.levers):
            i, part = layout.coordinate(pivot.part), pivot.part
            arm_x, arm_y = _turned(pivot.pin, q[i])
            poses[part] = pivot.at[0] - arm_x, pivot.at[1] - arm_y, q[i]
            rates[part] = v[i] * arm_y, -v[i] * arm_x, v[i]
        rods, own = list(layout.rods), [layout.coordinate(part) for part in layout.rods]
        angles, speeds = q[own], v[own]
        poses[rods, 2], rates[rods, 2] = angles, speeds
        lengths, before = self.constants.lengths[:, None], np.tri(len(rods), k=-1)
        x, y = lengths * np.cos(angles), lengths * np.sin(angles)
        going = points[2:4] * v[layout.track_coordinate]
        for axis, arm, speed in ((0, x, -speeds * y), (1, y, speeds * x)):
            poses[rods, axis] = points[axis] + before @ arm
            rates[rods, axis] = going[axis] + before @ speed


def _turned(point: tuple[float, float], angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How far from its part's origin a point of a turning part is, along x and y, (samples,)."""
    c, s = np.cos(angle), np.sin(angle)
    return c * point[0] - s * point[1], s * point[0] + c * point[1]


def build_model(scene: Scene, assembly: Assembly) -> Model:
    """Recognise the scene and compute the constants of its equations.

    Raises:
        NotRepresentableError: it is not guide, link and levers.

    """
    mechanism = assembly.mechanism
    layout = layout_of(scene, mechanism)
    masses = np.array([mechanism.parts[part].mass for part in layout.rods])
    lengths = _rod_lengths(mechanism, layout)
    arms = np.tri(len(masses), k=-1) * lengths
    arms += np.diag([mechanism.parts[part].centre[0] for part in layout.rods])
    stiffness, damping, preload = _springs(mechanism, layout)
    constants = Constants(
        couplings=np.ascontiguousarray((arms.T * masses) @ arms),
        firsts=masses @ arms,
        mass=float(masses.sum()),
        inertias=_inertias(mechanism, layout),
        stiffness=stiffness,
        damping=damping,
        preload=preload,
        moments=_moments(mechanism, layout),
        gravity=np.array(mechanism.gravity, dtype=float),
        faces=np.array([_face(c, layout) for c in layout.faces]).reshape(-1, 12),
        arms=np.array([_contact_arms(c, layout, lengths) for c in layout.faces]).reshape(
            -1, len(masses)
        ),
        rods=np.array([layout.coordinate(part) for part in layout.rods], dtype=float),
        track_coordinate=float(layout.track_coordinate),
        lengths=lengths,
        channel=_channel(mechanism, layout),
    )
    return Model(assembly, layout, constants)


def _rod_lengths(mechanism: Mechanism, layout: Layout) -> FloatArray:
    """Distances from each rod's start to the next one's; that of the last reaches its end."""
    ends = {pin.first.part: pin.first.x for pin in mechanism.pins if pin.first.part in layout.rods}
    return np.array([ends.get(part, mechanism.parts[part].reach) for part in layout.rods])


def _about_pin(mechanism: Mechanism, pivot: Pivot) -> tuple[float, float, float]:
    """Mass times centre (x, y) from the hinge, in the part's axes, and inertia about the hinge."""
    part = mechanism.parts[pivot.part]
    x, y = part.centre[0] - pivot.pin[0], part.centre[1] - pivot.pin[1]
    return part.mass * x, part.mass * y, part.inertia + part.mass * (x * x + y * y)


def _inertias(mechanism: Mechanism, layout: Layout) -> FloatArray:
    inertias = np.zeros(layout.count)
    for part in layout.rods:
        inertias[layout.coordinate(part)] += mechanism.parts[part].inertia
    for pivot in (layout.guide, *layout.levers):
        inertias[layout.coordinate(pivot.part)] += _about_pin(mechanism, pivot)[2]
    return inertias


def _moments(mechanism: Mechanism, layout: Layout) -> FloatArray:
    moments = np.zeros((layout.count, 2))
    for pivot in (layout.guide, *layout.levers):
        moments[layout.coordinate(pivot.part)] = _about_pin(mechanism, pivot)[:2]
    return moments


def _channel(mechanism: Mechanism, layout: Layout) -> FloatArray:
    """Row of `Constants.channel`; the start of the guide counts from its pivot."""
    if not mechanism.channels:
        return np.zeros(0)
    channel, guide = mechanism.channels[0], layout.guide
    law, friction = channel.law, channel.friction
    return np.array(
        [
            *guide.at,
            channel.guide.x - guide.pin[0],
            channel.guide.y - guide.pin[1],
            channel.length,
            channel.clearance,
            law.stiffness,
            law.restitution,
            law.transition_speed,
            friction.coefficient if friction else 0.0,
            friction.slip_speed if friction else 1.0,
        ]
    )


def turning_row(layout: Layout, first: int, second: int) -> FloatArray:
    """Derivative of the second part's angle relative to the first's by the coordinates."""
    row = np.zeros(layout.count)
    for part, sign in ((second, 1.0), (first, -1.0)):
        if part != GROUND:
            row[layout.coordinate(part)] += sign
    return row


def _springs(mechanism: Mechanism, layout: Layout) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Stiffness and damping matrix of hinges and springs, and their torques at q = 0."""
    count = layout.count
    stiffness, damping, preload = (
        np.zeros((count, count)),
        np.zeros((count, count)),
        np.zeros(count),
    )
    for spring in mechanism.springs:
        row = turning_row(layout, spring.first, spring.second)
        stiffness += spring.stiffness * np.outer(row, row)
        damping += spring.damping * np.outer(row, row)
        preload += spring.stiffness * (spring.rest_angle or 0.0) * row
    return stiffness, damping, preload


def _face(contact: FaceContact, layout: Layout) -> list[float]:
    coordinate = layout.coordinate(contact.start.part)
    pivot = next(lever for lever in layout.levers if lever.part == contact.start.part)
    law = contact.law
    stiffness, transition = 0.0, 1.0
    if isinstance(law, RestitutionPenalty):
        stiffness, transition = law.stiffness, law.transition_speed
    offsets = face_offsets(contact, pivot)
    angle, restitution = face_angle(contact), law.restitution
    return [
        coordinate,
        *pivot.at,
        angle,
        contact.side,
        *offsets,
        stiffness,
        restitution,
        transition,
        contact.friction.coefficient if contact.friction else 0.0,
        contact.friction.slip_speed if contact.friction else 1.0,
    ]


def _contact_arms(contact: FaceContact, layout: Layout, lengths: FloatArray) -> FloatArray:
    rod = layout.rods.index(contact.point.part)
    arms = np.where(np.arange(len(lengths)) < rod, lengths, 0.0)
    arms[rod] = contact.point.x
    return arms

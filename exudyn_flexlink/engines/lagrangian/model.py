"""A recognised mechanism in numbers: constants of its equations, and coordinates to poses."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.curves import evaluator
from exudyn_flexlink.engines.lagrangian.equations import Frame, Numbers
from exudyn_flexlink.engines.lagrangian.layout import Layout, Pivot, layout_of
from exudyn_flexlink.mechanism import GROUND, Anchor, Assembly, FaceContact, Mechanism, pairs
from exudyn_flexlink.scene import Scene


@dataclass(frozen=True)
class Model:
    """The mechanism, its parts' roles, the constants of its equations.

    Of all `contacts` the first are those of levers, the others the pairs of link and guide;
    `struck` are the points of the link that some of them have.
    """

    assembly: Assembly
    layout: Layout
    numbers: Numbers
    contacts: tuple[FaceContact, ...]
    struck: dict[Anchor, int]

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
        """All coordinates and speeds (N,) at time 0."""
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

    def poses(self, at: Frame) -> tuple[FloatArray, FloatArray]:
        """Poses and rates (instants, parts, 3) of all parts."""
        shape = (len(at.q), len(self.mechanism.parts), 3)
        poses, rates, layout = np.empty(shape), np.empty(shape), self.layout
        for pivot in (layout.guide, *layout.levers):
            i, part = layout.coordinate(pivot.part), pivot.part
            arm = complex(*pivot.pin) * at.axes[:, i]
            _fill(poses[:, part], complex(*pivot.at) - arm, at.q[:, i])
            _fill(rates[:, part], -1j * at.v[:, i] * arm, at.v[:, i])
        for k, part in enumerate(layout.rods):
            i = layout.coordinate(part)
            _fill(poses[:, part], at.points[:, k], at.q[:, i])
            _fill(rates[:, part], at.going[:, k], at.v[:, i])
        return poses, rates


def _fill(rows: FloatArray, place: ComplexArray, angle: FloatArray) -> None:
    rows[:, 0], rows[:, 1], rows[:, 2] = place.real, place.imag, angle


def build_model(scene: Scene, assembly: Assembly) -> Model:
    """Recognise the scene and compute the constants of its equations.

    Raises:
        NotRepresentableError: it is not guide, link and levers.

    """
    mechanism = assembly.mechanism
    layout = layout_of(scene, mechanism)
    parts, rods = mechanism.parts, layout.rods
    contacts = (*layout.faces, *(pair for own in mechanism.channels for pair in pairs(own)))
    arms, struck = _arms(mechanism, rods, contacts)
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
    )
    return Model(assembly, layout, numbers, contacts, struck)


def _arms(
    mechanism: Mechanism, rods: tuple[int, ...], contacts: tuple[FaceContact, ...]
) -> tuple[FloatArray, dict[Anchor, int]]:
    """Arms (points, n) of ends and centres of rods and of what else is struck, and which those are.

    All lie on the rods' axes.
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

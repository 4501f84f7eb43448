"""Forces in joints of a tree, and torques of drives, at instants at which its motion is known.

The force of a joint of the tree follows from Newton's law for all parts that it holds. Forces of
slots, closed loops and motors follow from the constraint forces of the equations of motion.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.engines.exudyn.minimal.closures import ClosedCoordinates
from exudyn_flexlink.engines.exudyn.minimal.kinematics import Motions, Points, motions
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.engines.exudyn.minimal.recording import Leaps, TreeKept
from exudyn_flexlink.engines.recording import Kept, push_of
from exudyn_flexlink.mechanism import (
    GROUND,
    Contact,
    LinearSpring,
    RopeContact,
    ToothPush,
    approach,
    flank_pushes,
    force_at,
    left_of,
    line_of,
    sizes_at,
    spring_force,
    tooth_pushes,
    turned,
    without_teeth,
)
from exudyn_flexlink.mechanism.tree import GuidedSlot, hanging_on
from exudyn_flexlink.rounding import NEGLIGIBLE


@dataclass
class Reactions:
    """Forces (instants, 2) of joints by name, N, and torques (instants,) of drives by name, N m.

    `torques` of drives along a slide are forces along its line, N. `gears` are as in the Result.
    `on_parts` has forces (instants, 2) on parts by number.
    """

    forces: dict[str, FloatArray] = field(default_factory=dict)
    torques: dict[str, FloatArray] = field(default_factory=dict)
    gears: dict[str, FloatArray] = field(default_factory=dict)
    on_parts: list[tuple[int, FloatArray]] = field(default_factory=list)


class Constrained(NamedTuple):
    """Coordinates x (n, links), places of slots (n, slots), constraint forces (n, links) on them.

    The forces are those of motors, slots and loops, or their impulses.
    """

    x: FloatArray
    places: FloatArray
    forces: FloatArray


def reactions_of(
    model: MinimalModel, state: Constrained, poses: FloatArray, flanks: Sequence[ToothPush]
) -> Reactions:
    """Reactions at instants (n,), with the parts at `poses` (n, parts, 3).

    Of redundant joints many forces satisfy the equations: these are the smallest. `flanks` are the
    pushes of gears with play.
    """
    if isinstance(model.coordinates, ClosedCoordinates):
        return _of_closures(model, state, poses, flanks)
    x, places, forces = state
    reactions = Reactions(on_parts=[(push.part, push.force) for push in flanks])
    number = {slot.name: k for k, slot in enumerate(model.assembly.mechanism.slots)}
    for guided in model.layout.slots:
        force = _guided(guided, x, places[:, number[guided.slot.name]], forces)
        reactions.forces[guided.slot.name] = force
        reactions.on_parts.append((guided.slot.anchor.part, force))
    for ride in model.layout.rides:
        force = forces[:, ride.along]
        reactions.forces[ride.slot.name] = force
        reactions.on_parts.append((ride.slot.anchor.part, force))
    for link, (motor, sign) in model.layout.motors.items():
        torque = forces[:, link].copy()
        for guided in model.layout.slots:
            if guided.turning == link:
                torque -= _moment(model, guided, x, reactions.forces[guided.slot.name])
        reactions.torques[motor.name] = sign * torque
    return reactions


def _guided(
    guided: GuidedSlot, x: FloatArray, places: FloatArray, forces: FloatArray
) -> FloatArray:
    """Force of a slot on its point: along the curve's normal, and what holds the slide."""
    normal = guided.slot.curve.normal(places)
    angle = x[:, guided.turning]
    along = normal[:, 0] * np.cos(angle) + normal[:, 1] * np.sin(angle)
    return np.asarray((forces[:, guided.sliding] / along)[:, None] * normal)


def _moment(
    model: MinimalModel, guided: GuidedSlot, x: FloatArray, force: FloatArray
) -> FloatArray:
    """Moment of a slot's force about the guide's pivot, N m."""
    point = Points(model.layout, [guided.slot.anchor]).places(model.kinematics.places(x))[:, 0]
    arm = point - complex(*guided.pivot)
    return np.asarray(arm.real * force[:, 1] - arm.imag * force[:, 0])


def _of_closures(
    model: MinimalModel, state: Constrained, poses: FloatArray, flanks: Sequence[ToothPush]
) -> Reactions:
    x, places, forces = state
    coordinates = model.coordinates
    assert isinstance(coordinates, ClosedCoordinates)
    closures, motors = coordinates.closures, model.layout.motors
    # Places count along the whole curves, not on their present pieces.
    curves = [point.slot.curve.places for point in coordinates.points]
    jacobian = closures.jacobian(closures.joined(x, places), curves)
    multipliers, rest = _multipliers(jacobian, closures.known, forces)
    reactions = Reactions()
    reactions.gears = {gear.name: multipliers[:, row] for row, gear in closures.gears}
    teeth = [*flanks, *tooth_pushes((g for _, g in closures.gears), reactions.gears, poses)]
    reactions.on_parts += [(push.part, push.force) for push in teeth]
    in_joints = closures.forces(x, multipliers)
    # The gaps of joints come first; gaps of motors along slides follow, and are left out here.
    rows = zip(closures.joints, closures.parts, in_joints.T, strict=False)
    for joint, (first, second), reaction in rows:
        force = np.stack([reaction.real, reaction.imag], axis=-1)
        force = reactions.forces[joint.name] = without_teeth(joint.name, force, teeth)
        reactions.on_parts += [(second, force), (first, -force)]
    for row, motor in closures.motors:
        reactions.torques[motor.name] = multipliers[:, row]
    for link, (motor, sign) in motors.items():
        reactions.torques[motor.name] = sign * rest[:, link]
    return reactions


def _multipliers(
    jacobian: FloatArray, known: IndexArray, forces: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Multipliers (n, rows) of `forces` (n, links), and the forces (n, links) of motors, the rest.

    Of redundant joints the multipliers are the smallest ones. `known` are the coordinates that
    motors of the tree prescribe.
    """
    turned, links = jacobian.transpose(0, 2, 1), forces.shape[1]
    whole = np.zeros(turned.shape[:2])
    whole[:, :links] = forces
    unknown = np.setdiff1d(np.arange(turned.shape[1]), known)
    inverse = np.linalg.pinv(turned[:, unknown], rcond=NEGLIGIBLE)
    multipliers = (inverse @ whole[:, unknown, None])[:, :, 0]
    rest = whole - (turned @ multipliers[:, :, None])[:, :, 0]
    return np.asarray(multipliers), np.asarray(rest[:, :links])


class _InJoints:
    """Forces or impulses in joints at instants (n,), by Newton's law for the parts that they hold.

    `moved` has accelerations, or jumps of speeds; `reactions` are those of the same instants. Other
    forces (n, 2) are `pulls` of springs, `on_points` of contacts on their first parts, and `forces`
    by name, which act between two parts, `force_parts`. `gravity` (2,) is subtracted from
    accelerations.
    """

    def __init__(
        self, model: MinimalModel, time: FloatArray, moved: Motions, reactions: Reactions
    ) -> None:
        self.model, self.mechanism = model, model.assembly.mechanism
        self.time, self.moved, self.reactions = time, moved, reactions
        self.pulls: dict[LinearSpring, FloatArray] = {}
        self.on_points: list[tuple[Contact, FloatArray]] = []
        self.forces: dict[str, FloatArray] = {}
        self.force_parts: dict[str, tuple[int, int]] = {}
        self.gravity = np.zeros(2)
        for motor in self.mechanism.speed_motors:
            if motor.slide:
                line = line_of(motor.slide, moved.poses)
                self.forces[motor.name] = reactions.torques.pop(motor.name)[:, None] * line
                self.force_parts[motor.name] = motor.second, motor.first

    def in_joints(self, names: Iterable[str]) -> dict[str, FloatArray]:
        """Force (n, 2) of joints of two points, N, on the second point.

        It follows from Newton's law for the parts that the joint holds. Joints with clearance are
        left out.
        """
        applied = self._applied()
        forces = {}
        for name in names:
            hanging = hanging_on(self.mechanism, self.model.layout, name)
            if hanging is not None:
                held, sign = hanging
                force = sum((self._momentum_rate(part) - applied[part] for part in held),
                            np.zeros((len(self.time), 2)))  # fmt: skip
                forces[name] = sign * force
            elif name in self.reactions.forces:
                forces[name] = self.reactions.forces[name]
        return forces

    def _momentum_rate(self, part: int) -> FloatArray:
        """Mass times acceleration of a part's centre, less its weight, N."""
        body = self.mechanism.parts[part]
        pose, rate, bend = (
            m[:, part] for m in (self.moved.poses, self.moved.rates, self.moved.bends)
        )
        arm = turned(np.array(body.centre), pose[:, 2])
        acceleration = bend[:, :2] + bend[:, 2:] * left_of(arm) - rate[:, 2:] ** 2 * arm
        return np.asarray(body.mass * (acceleration - self.gravity))

    def _applied(self) -> list[FloatArray]:
        """Forces of slots, closed loops, springs, drives and contacts on each part, N."""
        applied = [np.zeros((len(self.time), 2)) for _ in self.mechanism.parts]
        between = [
            *((spring.second.part, spring.first.part, pull) for spring, pull in self.pulls.items()),
            *((*self.force_parts[name], force) for name, force in self.forces.items()),
            *((*contact.parts, force) for contact, force in self.on_points),
        ]
        pushed = [
            *self.reactions.on_parts,
            *((first, force) for first, _, force in between),
            *((second, -force) for _, second, force in between),
        ]
        for part, force in pushed:
            if part != GROUND:
                applied[part] += force
        return applied


class JointForces(_InJoints):
    """Forces and torques in joints at recorded instants (n,), with the forces of all `contacts`."""

    def __init__(self, model: MinimalModel, contacts: Sequence[Contact], kept: Kept) -> None:
        self.kept = kept
        tree: TreeKept = kept.of_engine
        moved = motions(model.layout, model.kinematics, tree.x, tree.v, tree.a)
        presses = {contact.name: kept.press[:, k] for k, contact in enumerate(contacts)}
        flanks = flank_pushes(contacts, presses, moved.poses)
        state = Constrained(tree.x, kept.places, tree.forces)
        reactions = reactions_of(model, state, moved.poses, flanks)
        super().__init__(model, kept.t, moved, reactions)
        self.gravity = np.asarray(self.mechanism.gravity)
        self.pulls = {
            spring: spring_force(spring, moved.poses, moved.rates)
            for spring in self.mechanism.linear_springs
        }
        self.on_points = self._pressing(contacts)
        for force in self.mechanism.forces:
            self.forces[force.name] = force_at(force, self.time, moved.poses, moved.rates)
            self.force_parts[force.name] = force.point.part, GROUND

    def _pressing(self, contacts: Sequence[Contact]) -> list[tuple[Contact, FloatArray]]:
        """Forces (n, 2) of contacts on the first parts, N."""
        points, pressed = [], self.kept.pressed
        for k in np.flatnonzero(pressed.any(axis=0)).tolist():
            contact, rows = contacts[k], pressed[:, k]
            motion = self.moved.poses[rows], self.moved.rates[rows]
            for piece in contact.pieces if isinstance(contact, RopeContact) else (contact,):
                push = np.zeros((len(rows), 2))
                push[rows] = push_of(piece, *motion, self.kept.press[rows, k])
                points.append((piece, push))
        return points

    def torques(self) -> dict[str, FloatArray]:
        """Torque of each drive that has one on its joint's second part, N m."""
        torques = dict(self.reactions.torques)
        state = self.time, self.moved.poses, self.moved.rates
        for motor in self.mechanism.torque_motors:
            torques[motor.name] = sizes_at(motor.size, *state)
        return torques


class JointImpulses(_InJoints):
    """Impulses in joints, N s, at instants (K,) at which speeds jump.

    They follow as forces do, with jumps of speeds in place of accelerations. Springs, weight and
    prescribed forces have no impulse at a single instant.
    """

    def __init__(self, model: MinimalModel, contacts: Sequence[Contact], leaps: Leaps) -> None:
        still = np.zeros_like(leaps.x)
        moved = motions(model.layout, model.kinematics, leaps.x, still, leaps.rates)
        pushes = {contact.name: leaps.push[:, k] for k, contact in enumerate(contacts)}
        flanks = flank_pushes(contacts, pushes, moved.poses)
        state = Constrained(leaps.x, leaps.places, leaps.held)
        reactions = reactions_of(model, state, moved.poses, flanks)
        super().__init__(model, leaps.t, moved, reactions)
        for k in np.flatnonzero(leaps.push.any(axis=0)).tolist():
            contact, push, rub = contacts[k], leaps.push[:, k, None], leaps.rub[:, k]
            look = approach(contact, moved.poses, moved.rates, leaps.t)
            impulse = push * look.normal + (look.grip * rub)[:, None] * look.along
            self.on_points.append((contact, impulse))

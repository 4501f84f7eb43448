"""Forces of slots, loops and motors, from what the equations of motion leave over."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.minimal.closed import ClosedCoordinates
from exudyn_flexlink.engines.exudyn.minimal.closure_solver import RANK
from exudyn_flexlink.engines.exudyn.minimal.closures import Track
from exudyn_flexlink.engines.exudyn.minimal.kinematics import Points
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.mechanism.tree import GuidedSlot


@dataclass
class Reactions:
    """Forces (instants, 2) by joint, N, and on parts; by drive its torque (instants,), N m.

    `torques` of drives along a slide are forces along that, N.
    """

    forces: dict[str, FloatArray] = field(default_factory=dict)
    torques: dict[str, FloatArray] = field(default_factory=dict)
    on_parts: list[tuple[int, FloatArray]] = field(default_factory=list)


def reactions_of(
    model: MinimalModel, x: FloatArray, places: FloatArray, forces: FloatArray
) -> Reactions:
    """Reactions at instants (n,) with coordinates x (n, links) and slots' places (n, slots).

    `forces` (n, links) are the constraint forces of motors, slots and loops. Where joints are
    redundant their forces are the least of those that are possible.
    """
    if isinstance(model.coordinates, ClosedCoordinates):
        return _of_closures(model, model.coordinates, x, places, forces)
    found = Reactions()
    number = {slot.name: k for k, slot in enumerate(model.assembly.mechanism.slots)}
    for guided in model.layout.slots:
        force = _guided(guided, x, places[:, number[guided.slot.name]], forces)
        found.forces[guided.slot.name] = force
        found.on_parts.append((guided.slot.anchor.part, force))
    for ride in model.layout.rides:
        force = forces[:, ride.along]
        found.forces[ride.slot.name] = force
        found.on_parts.append((ride.slot.anchor.part, force))
    for link, (motor, sign) in model.layout.motors.items():
        torque = forces[:, link].copy()
        for guided in model.layout.slots:
            if guided.turning == link:
                torque -= _moment(model, guided, x, found.forces[guided.slot.name])
        found.torques[motor.name] = sign * torque
    return found


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
    at = Points(model.layout, [guided.slot.anchor]).places(model.kinematics.places(x))[:, 0]
    arm = at - complex(*guided.pivot)
    return np.asarray(arm.real * force[:, 1] - arm.imag * force[:, 0])


def _of_closures(
    model: MinimalModel,
    coordinates: ClosedCoordinates,
    x: FloatArray,
    places: FloatArray,
    forces: FloatArray,
) -> Reactions:
    closures, motors = coordinates.closures, model.layout.motors
    at = closures.where_on(x, _track(coordinates, places))
    multipliers, rest = _multipliers(closures.jacobian(at), sorted(motors), forces)
    found = Reactions()
    in_joints = closures.forces(at, multipliers)
    # Of the gaps those of joints are the first; motors along slides have some, too.
    rows = zip(closures.joints, closures.parts, in_joints.T, strict=False)
    for joint, (first, second), own in rows:
        force = found.forces[joint.name] = np.stack([own.real, own.imag], axis=-1)
        found.on_parts += [(second, force), (first, -force)]
    for row, motor in closures.motors:
        found.torques[motor.name] = multipliers[:, row]
    for link, (motor, sign) in motors.items():
        found.torques[motor.name] = sign * rest[:, link]
    return found


def _track(coordinates: ClosedCoordinates, places: FloatArray) -> Track | None:
    """Slots' curves at places (n, slots) on the whole of them."""
    if not coordinates.points:
        return None
    found = np.zeros((3, *places.shape), dtype=complex)
    for k, point in enumerate(coordinates.points):
        vectors = np.array(point.slot.curve.derivatives(places[:, k]))
        found[:, :, k] = vectors[..., 0] + 1j * vectors[..., 1]
    return Track(*found)


def _multipliers(
    jacobian: FloatArray, known: list[int], forces: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Multipliers (n, rows) of `forces` (n, links), and what is left of those for motors.

    Where joints are redundant, those multipliers that are least. The coordinates `known` are those
    of motors of the tree.
    """
    turned, links = jacobian.transpose(0, 2, 1), forces.shape[1]
    whole = np.zeros(turned.shape[:2])
    whole[:, :links] = forces
    unknown = np.setdiff1d(np.arange(turned.shape[1]), known)
    inverse = np.linalg.pinv(turned[:, unknown], rcond=RANK)
    multipliers = (inverse @ whole[:, unknown, None])[:, :, 0]
    rest = whole - (turned @ multipliers[:, :, None])[:, :, 0]
    return np.asarray(multipliers), np.asarray(rest[:, :links])

"""Forces of slots, loops and motors, from what the equations of motion leave over."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.minimal.closed import ClosedCoordinates
from exudyn_flexlink.engines.exudyn.minimal.closures import Closing, Track
from exudyn_flexlink.engines.exudyn.minimal.kinematics import Points
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.mechanism import Motor, Slide, Slot
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
    model: MinimalModel, time: FloatArray, x: FloatArray, places: FloatArray, left: FloatArray
) -> Reactions:
    """Reactions at instants (n,) with coordinates x (n, links) and slots' places (n, slots).

    `left` (n, links) are the forces that motors, slots and loops add to the coordinates. Where
    joints are redundant their forces are the least of those that are possible.
    """
    if isinstance(model.coordinates, ClosedCoordinates):
        at = _closing(model.coordinates, time, x, places)
        return _of_closures(model, model.coordinates, at, left)
    found = Reactions()
    number = {slot.name: k for k, slot in enumerate(model.assembly.mechanism.slots)}
    for guided in model.layout.slots:
        force = _guided(guided, x, places[:, number[guided.slot.name]], left)
        found.forces[guided.slot.name] = force
        found.on_parts.append((guided.slot.anchor.part, force))
    for ride in model.layout.rides:
        force = left[:, ride.along]
        found.forces[ride.slot.name] = force
        found.on_parts.append((ride.slot.anchor.part, force))
    for link, (motor, sign) in model.layout.motors.items():
        torque = left[:, link].copy()
        for guided in model.layout.slots:
            if guided.turning == link:
                torque -= _moment(model, guided, x, found.forces[guided.slot.name])
        found.torques[motor.name] = sign * torque
    return found


def _guided(guided: GuidedSlot, x: FloatArray, places: FloatArray, left: FloatArray) -> FloatArray:
    """Force of a slot on its point: along the curve's normal, and what holds the slide."""
    normal = guided.slot.curve.normal(places)
    angle = x[:, guided.turning]
    along = normal[:, 0] * np.cos(angle) + normal[:, 1] * np.sin(angle)
    return np.asarray((left[:, guided.sliding] / along)[:, None] * normal)


def _moment(
    model: MinimalModel, guided: GuidedSlot, x: FloatArray, force: FloatArray
) -> FloatArray:
    """Moment of a slot's force about the guide's pivot, N m."""
    at = Points(model.layout, [guided.slot.anchor]).places(model.kinematics.places(x))[:, 0]
    arm = at - complex(*guided.pivot)
    return np.asarray(arm.real * force[:, 1] - arm.imag * force[:, 0])


def _of_closures(
    model: MinimalModel, coordinates: ClosedCoordinates, at: Closing, left: FloatArray
) -> Reactions:
    multipliers, rest = coordinates.reactions(at, left)
    found = Reactions()
    for closure, rows in coordinates.closures.rows:
        own = multipliers[:, rows]
        if isinstance(closure, Motor):
            found.torques[closure.name] = own[:, 0]
            continue
        force = _across(coordinates, closure, at, own[:, 0]) if isinstance(closure, Slide) else own
        if isinstance(closure, Slot):
            second, first = closure.anchor.part, closure.carrier
        else:
            second, first = closure.second.part, closure.first.part
        found.forces[closure.name] = force
        found.on_parts += [(second, force), (first, -force)]
    for link, (motor, sign) in model.layout.motors.items():
        found.torques[motor.name] = sign * rest[:, link]
    return found


def _closing(
    coordinates: ClosedCoordinates, time: FloatArray, x: FloatArray, places: FloatArray
) -> Closing:
    """Where everything is at instants, with places on the whole curves."""
    slots = [point.slot for point in coordinates.points]
    curves = [slot.curve.derivatives(places[:, k]) for k, slot in enumerate(slots)]
    vectors = [np.array([curve[i] for curve in curves]) for i in range(3)]  # (slots, n, 2) each
    track = Track(*(np.asarray(v[..., 0].T + 1j * v[..., 1].T) if len(slots) else
                    np.zeros((len(x), 0), dtype=complex) for v in vectors))  # fmt: skip
    return coordinates.closures.at(time, np.hstack([x, places]), track)


def _across(
    coordinates: ClosedCoordinates, slide: Slide, at: Closing, size: FloatArray
) -> FloatArray:
    """Force of a slide on its second part, across its line."""
    normal = 1j * coordinates.closures.axis(slide, at.places)
    return np.asarray(size[:, None] * np.stack([normal.real, normal.imag], axis=-1))

"""Forces of a run by quantity and name, in joints and in bent links, their errors; its energies.

N is the number of samples. A hinge with angle phi, stiffness k and damping c has the moment
``M = k phi + c phi'``. In a section with the second moment I, the outermost fibre is h/2 from the
bending axis. Its stress is ``M h / (2 I)``, and its strain ``M h / (2 E I)``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf, nan
from typing import Annotated

import numpy as np

from exudyn_flexlink.arrays import FloatArray, Variable
from exudyn_flexlink.mechanism import build_mechanism
from exudyn_flexlink.observables.instants import OverTime
from exudyn_flexlink.observables.levers import extremes_of
from exudyn_flexlink.observables.points import RATE, TURNED, joint_turning, samples_text
from exudyn_flexlink.observables.touching import sleeves_with_play, touching
from exudyn_flexlink.result import Result
from exudyn_flexlink.rounding import NEGLIGIBLE
from exudyn_flexlink.scene import (
    FlexibleBody,
    PrismaticJoint,
    RevoluteJoint,
    Scene,
    SlotJoint,
    WeldJoint,
)
from exudyn_flexlink.source import unknown

WEAK_FORCE = 1e-6  # of the largest force of its unit: a smaller one has no relative error
BENDING = "bending moment"
KINDS = {"N": "force", "N m": "torque"}
NO_FORCE = 1e-12  # N or N m: a smaller force is rounding, and has no relative error either


@dataclass(frozen=True)
class Force(OverTime):
    """A force at samples `time` (N,) s: `values` (N,), or (N, 2) of a vector, in `unit`, N or N m.

    Of the bending moments of a link `values` (N, P) are those of all its places. `error` (N,)
    bounds how far they are off, see `force_error`; None where nobody asked for it.
    """

    quantity: str
    name: str
    unit: str
    time: FloatArray
    values: Annotated[FloatArray, Variable("time", None, "force or torque")]
    error: Annotated[
        FloatArray | None, Variable("time", None, "error of the values", bound=True)
    ] = None

    def __repr__(self) -> str:
        sizes = np.abs(self.size)
        largest = np.nanmax(sizes, initial=0.0)
        return (
            f"<Force, {self.quantity} of {self.name}: to {largest:.5g} {self.unit}; "
            f"{samples_text(self.time)}>"
        )

    @property
    def size(self) -> FloatArray:
        """Length of the vector (N,), or the largest moment along a link; else with its sign."""
        if self.values.ndim == np.ndim(self.time):
            return self.values
        return self.lengths(np.atleast_2d(self.values)).reshape(np.shape(self.time))

    def lengths(self, values: FloatArray) -> FloatArray:
        """Sizes (n,) of forces (n, k) of this kind, or of their differences."""
        order = np.inf if self.quantity == BENDING else 2
        return np.asarray(np.linalg.norm(values.reshape(len(values), -1), order, axis=1))


@dataclass(frozen=True)
class ForcePeak:
    """The largest of a force in `unit`, N or N m, and its instant `at` (s)."""

    value: float
    unit: str
    at: float


def forces_of(result: Result) -> dict[str, Force]:
    """Torques and forces of drives; forces of slots, joints, springs, gears, walls and contacts.

    Also forces and torques of dry friction in joints. A hinge inside a flexible body has no force
    here; its bending moment is.
    """
    joints = {n: force for n, force in result.joint_forces.items() if n in result.scene.joints}
    kinds: tuple[tuple[str, str, Mapping[str, FloatArray]], ...] = (
        ("drive torque", "N m", result.drive_torques),
        ("drive force", "N", result.drive_forces),
        ("slot force", "N", result.slot_forces),
        ("joint force", "N", joints),
        ("spring force", "N", result.spring_forces),
        ("gear force", "N", result.gear_forces),
        ("gear torque", "N m", result.gear_torques),
        (BENDING, "N m", {link: moments(result, link) for link in bent_links(result.scene)}),
        ("wall force", "N", _wall_forces(result)),
        *(
            (f"contact {KINDS[unit]}", unit, {name: contact.force})
            for name, contact in result.contacts.items()
            for unit in [result.scene.unit_of(name, "N")]
        ),
        *(
            (f"friction {KINDS[unit]}", unit, {name: friction.torque})
            for name, friction in result.frictions.items()
            for unit in [friction_unit(result.scene, name)]
        ),
    )
    return {
        f"{quantity} of {name}": Force(quantity, name, unit, result.time, values)
        for quantity, unit, by_name in kinds
        for name, values in by_name.items()
    }


def friction_unit(scene: Scene, joint: str) -> str:
    """Unit of a joint's dry friction: N for a slide, else N m."""
    return "N" if isinstance(scene.joints[joint], PrismaticJoint) else "N m"


def bent_links(scene: Scene) -> dict[str, FlexibleBody]:
    """Return the flexible bodies that have hinges, by name."""
    bodies = scene.bodies.items()
    return {n: body for n, body in bodies if isinstance(body, FlexibleBody) and body.rods > 1}


def hinge_places(body: FlexibleBody) -> FloatArray:
    """Places (H,) m of a link's hinges, from its start."""
    cell = body.length / body.rods
    if body.layout == "half_ends":
        return np.asarray((np.arange(body.rods) + 0.5) * cell)
    return np.asarray(np.arange(1, body.rods) * cell)


def bending_places(scene: Scene, link: str) -> FloatArray:
    """Places (P,) m on a link, from its start, of which bending moments are told.

    These are its hinges, its stations, and its welded ends.
    """
    body = bent_links(scene)[link]
    joints = (joint for joint in scene.joints.values() if isinstance(joint, WeldJoint))
    welded = {point for joint in joints for point in joint.points}
    ends = {f"{link}.start": 0.0, f"{link}.end": body.length}
    others = [place for point, place in ends.items() if point in welded]
    hinges = hinge_places(body)
    for place in (*others, *body.points.values()):
        if np.abs(hinges - place).min() > NEGLIGIBLE * body.length:
            hinges = np.append(hinges, place)
    return np.sort(hinges)


def moments(result: Result, link: str) -> FloatArray:
    """Bending moments (N, P) N m of a link at `bending_places`, positive where it bends left.

    Between two hinges the moment is interpolated linearly, which is exact without a load there.
    Beyond the first and the last hinge it is extrapolated linearly.

    If the link was solved as a beam, its rods are chords of the beam. Between two chords it bends
    over the distance of their middles: 3/4 of a cell beside a half rod.
    """
    mechanism = build_mechanism(result.scene)
    parts = set(mechanism.bodies[link])
    hinges = [s for s in mechanism.springs if s.first in parts and s.second in parts]
    first, second = np.array([(hinge.first, hinge.second) for hinge in hinges]).T
    stiffness, damping = np.array([(hinge.stiffness, hinge.damping) for hinge in hinges]).T
    if result.settings.formulation == "beam" and bent_links(result.scene)[link].layout != "equal":
        stiffness[[0, -1]] *= 4 / 3
        damping[[0, -1]] *= 4 / 3
    angle, rate = (
        motion[:, second, 2] - motion[:, first, 2] for motion in (result.poses, result.rates)
    )
    moment = np.asarray(stiffness * angle + damping * rate)
    known = hinge_places(bent_links(result.scene)[link])
    places = bending_places(result.scene, link)
    if len(known) == 1:
        return np.repeat(moment, len(places), axis=1)
    k = np.clip(np.searchsorted(known, places) - 1, 0, len(known) - 2)
    part = (places - known[k]) / (known[k + 1] - known[k])
    before, after = moment[:, k], moment[:, k + 1]
    return np.asarray((1 - part) * before + part * after)


def momentary_forces(result: Result) -> set[str]:
    """Names of contact forces and torques that are impulses alone: between these they are zero."""
    return {
        name
        for name, force in forces_of(result).items()
        if force.quantity.startswith("contact")
        and np.isinf(result.contacts[force.name].touches.peak_force).any()
        and not force.values.any()
    }


def _wall_forces(result: Result) -> dict[str, FloatArray]:
    """Force of each wall on the link or pin: the sum over its contacts, for joints with play."""
    pushes = {}
    for joint in sleeves_with_play(result):
        history, slot = result.sleeves[joint], isinstance(result.scene.joints[joint], SlotJoint)
        names = ("left", "right") if slot else ("upper", "lower")
        for side, wall in zip((1.0, -1.0), names, strict=True):
            on_side = np.array(history.sides) == side
            pushes[f"{joint}, {wall} wall"] = history.force[:, on_side].sum(axis=1)
    return pushes


def force_peaks(result: Result) -> dict[str, ForcePeak]:
    """Largest of every force of a run, by its name: of contacts at any time, of others at samples.

    A contact with impulses is left out: their force has no bound.
    """
    unbound = {
        name
        for name, contact in result.contacts.items()
        if not np.isfinite(contact.touches.peak_force).all()
    }
    peaks = {name: result.extremes[extremes_of(result.scene, name)[0]] for name in result.contacts}
    exact = {name: peak.greatest for name, peak in peaks.items() if len(peak.time)}
    by_force = {}
    for name, force in forces_of(result).items():
        largest = int(np.argmax(np.abs(force.size)))
        contact_name = force.name if force.quantity.startswith("contact") else ""
        value, instant = exact.get(
            contact_name, (float(force.size[largest]), float(result.time[largest]))
        )
        if contact_name not in unbound:
            by_force[name] = ForcePeak(value, force.unit, instant)
    return by_force


@dataclass(frozen=True)
class BendingPeak:
    """The largest bending of a link: `moment` (N m, of either sign), its `place` (m) and `at` (s).

    `stress` (Pa) and `strain` are the largest in size; None of a section whose height is not known.
    """

    moment: float
    place: float
    at: float
    stress: float | None
    strain: float | None


@dataclass(frozen=True)
class Bending(OverTime):
    """How a flexible link is bent at hinges, stations and welded ends, at samples `time` (N,) s.

    `place` (H,) m is that of each of these on the straight link, from its start. `moment` (N, H)
    N m is positive where the link bends to its left; beside hinges it is that of the straight line
    through two of them, see `moments`. `stress` (N, H) Pa and `strain` (N, H) are those
    of the surface on its right, positive where that is stretched; None of a section whose height is
    not known. `error` (N,) N m bounds how far moments are off, as `force_error` has it.
    """

    link: str
    time: FloatArray
    place: FloatArray
    moment: Annotated[FloatArray, Variable("time .place", "N m", "bending moment")]
    stress: Annotated[FloatArray | None, Variable("time .place", "Pa", "stress of the surface")]
    strain: Annotated[FloatArray | None, Variable("time .place", "1", "strain of the surface")]
    error: Annotated[FloatArray, Variable("time", "N m", "error of the moment", bound=True)]

    @property
    def largest(self) -> BendingPeak:
        """Where and when the moment is largest in size, with the largest stress and strain."""
        moment, time = np.atleast_2d(self.moment), np.atleast_1d(self.time)
        size = np.abs(moment)
        n, hinge = np.unravel_index(int(size.argmax()), size.shape)
        stress, strain = (
            None if values is None else float(np.abs(values).max())
            for values in (self.stress, self.strain)
        )
        peak = float(moment[n, hinge])
        return BendingPeak(peak, float(self.place[hinge]), float(time[n]), stress, strain)

    def __repr__(self) -> str:
        largest = self.largest
        return (
            f"<Bending of {self.link}: to {largest.moment:.5g} N m at {largest.place:.4g} m, "
            f"{len(self.place)} places; {samples_text(self.time)}>"
        )


def bending(result: Result, link: str) -> Bending:
    """Return how a flexible link is bent.

    Raises:
        ValueError: the link has no hinges.

    """
    scene, known = result.scene, bent_links(result.scene)
    if link not in known:
        names = ", ".join(known) or "none"
        raise ValueError(f"'{link}' has no hinges that bend; there are: {names}")
    body = known[link]
    moment, stress, strain = moments(result, link), None, None
    if (half := body.section.half_height) is not None:
        stress = moment * half / body.section.second_moment
        strain = stress / scene.materials[body.material].youngs_modulus
    error = force_error(result, f"{BENDING} of {link}")
    return Bending(link, result.time, bending_places(scene, link), moment, stress, strain, error)


@dataclass(frozen=True)
class JointForce(OverTime):
    """What acts in a joint at samples `time` (N,) s, in the ground's axes.

    `force` (N, 2) N acts on the body of the joint's second point, in a slot on the point that runs
    in it. `torque` (N,) N m is what drives put on that body at the joint; None where no drive
    does. `error` (N,) N and `torque_error` (N,) N m bound how far these are off, see
    `force_error`. Of a revolute joint `angle` (N,) rad is that of the second body relative to the
    first, continuous, and `rate` (N,) rad/s its speed; None of others.
    """

    joint: str
    time: FloatArray
    force: Annotated[FloatArray, Variable("time", "N", "force")]
    error: Annotated[FloatArray, Variable("time", "N", "error of the force", bound=True)]
    torque: Annotated[FloatArray | None, Variable("time", "N m", "torque of drives")]
    torque_error: Annotated[
        FloatArray | None, Variable("time", "N m", "error of the torque", bound=True)
    ]
    angle: Annotated[FloatArray | None, TURNED] = None
    rate: Annotated[FloatArray | None, RATE] = None

    def __repr__(self) -> str:
        sizes = np.linalg.norm(self.force, axis=-1)
        largest = np.nanmax(sizes, initial=0.0)
        turned = ""
        if self.torque is not None:
            torque = np.nanmax(np.abs(self.torque), initial=0.0)
            turned = f", torque to {torque:.5g} N m"
        return (
            f"<JointForce of {self.joint}: to {largest:.5g} N{turned}; {samples_text(self.time)}>"
        )


def joint_force(result: Result, joint: str) -> JointForce:
    """Force in a joint (of any kind), the torque of its drives, and how far they are off.

    Raises:
        ValueError: no force of such a joint is kept.

    """
    forces = {**result.joint_forces, **result.slot_forces}
    known = [name for name in result.scene.joints if name in forces]
    if joint not in known:
        others = ("sleeves", "gear_forces", "gear_torques")
        elsewhere = "".join(
            f", but {key}['{joint}']" for key in others if joint in getattr(result, key)
        )
        raise ValueError(
            f"no force of '{joint}' is kept{elsewhere}; of: {', '.join(known) or 'none'}"
        )
    kind = "joint" if joint in result.joint_forces else "slot"
    scene, torque = result.scene, result.drive_torques
    drives = [name for name in scene.drives_of(joint) if name in torque]
    torques = [torque[name] for name in drives]
    errors = [force_error(result, f"drive torque of {name}") for name in drives]
    revolute = isinstance(scene.joints[joint], RevoluteJoint)
    angle, rate = joint_turning(result, joint) if revolute else (None, None)
    return JointForce(
        joint,
        result.time,
        forces[joint],
        force_error(result, f"{kind} force of {joint}"),
        np.sum(torques, axis=0) if drives else None,
        np.sum(errors, axis=0) if drives else None,
        angle,
        rate,
    )


def force_of(result: Result, name: str) -> Force:
    """Return a force or torque by what `forces_of` calls it, with its error.

    Raises:
        ValueError: the run has no such force.

    """
    forces = forces_of(result)
    if name not in forces:
        raise ValueError(unknown("force", name, forces))
    return replace(forces[name], error=force_error(result, name))


def force_error(result: Result, name: str) -> FloatArray:
    """How far a force may be off at each sample (N,), by what `forces_of` calls it; N or N m.

    It is the largest error that a second run gives while nothing touches, or while something does.
    It is inf beyond the instant up to which errors are known, and nan where nothing was measured.
    The begin and the end of a touch are off in time, too: a force that jumps there jumps earlier or
    later by that.
    """
    deviation = result.error.forces.get(name)
    if deviation is None:
        return np.full(len(result.time), np.nan)
    free, touched = (
        nan if part is None else part.largest for part in (deviation.free, deviation.touching)
    )
    error = np.where(touching(result, result.time), touched, free)
    return np.where(result.time < result.error.known_until, error, inf)


@dataclass(frozen=True)
class Energies(OverTime):
    """Energies in J at samples `time` (N,) s: those of `EnergyHistory`, and its `residual`."""

    time: FloatArray
    kinetic: Annotated[FloatArray, Variable("time", "J", "kinetic energy")]
    stored: Annotated[FloatArray, Variable("time", "J", "energy in springs, weight, contacts")]
    dissipated: Annotated[FloatArray, Variable("time", "J", "energy dissipated")]
    supplied: Annotated[FloatArray, Variable("time", "J", "energy supplied by drives")]
    residual: Annotated[FloatArray, Variable("time", "J", "what the balance misses")]


def energies(result: Result) -> Energies:
    """Energies of a run."""
    energy = result.energy
    return Energies(result.time, **vars(energy), residual=energy.residual)

"""The state at time 0: poses of parts, their velocities, and the rest positions of springs.

Also the items of a scene that Exudyn's solver of redundant coordinates, or of beams, lacks.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import isnan

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism.closing import (
    CannotAssembleError,
    Start,
    closest,
    least_speeds,
    neighbouring,
    place_in,
    positions,
    slides_named,
)
from exudyn_flexlink.mechanism.constraints import (
    Constraints,
    along_slides,
    along_slots,
    constraint_rows,
    summed,
    turning,
)
from exudyn_flexlink.mechanism.contacts import approach
from exudyn_flexlink.mechanism.dynamics import (
    accelerations,
    constraints_at,
    length_of,
    mass_blocks,
    motions_by_mass,
    started,
)
from exudyn_flexlink.mechanism.joints import Contact, Pin, RopeContact, Slide, SumStop
from exudyn_flexlink.mechanism.least_motion import LeastMotion, scale_roots
from exudyn_flexlink.mechanism.model import LinearSpring, Mechanism, RotarySpring
from exudyn_flexlink.mechanism.prescribed import Ramp
from exudyn_flexlink.raising import Sendable
from exudyn_flexlink.scene import (
    Flank,
    HertzLaw,
    ImpulseLaw,
    LineOnCurve,
    PinFriction,
    PointOnCurve,
    PrismaticJoint,
    RevoluteJoint,
    RopeSpring,
    Scene,
    SlideFriction,
    SlotJoint,
    TorsionalSpring,
)
from exudyn_flexlink.source import KeyPath, Mistake


@dataclass(frozen=True)
class State:
    """Coordinates (parts, 3), velocities, accelerations; the slots' curve parameters and laps.

    Many objects share a state, so its arrays are read-only.
    """

    q: FloatArray
    v: FloatArray
    a: FloatArray
    places: FloatArray
    laps: tuple[int, ...]

    def __post_init__(self) -> None:
        for array in (self.q, self.v, self.a, self.places):
            array.setflags(write=False)


@dataclass(frozen=True)
class Assembly:
    """A mechanism put together: its state at time 0, degrees of freedom, redundant constraints.

    `surplus` has the number of redundant constraints of each joint or drive: those that the joints
    before it, in the mechanism's order, already imply.
    """

    mechanism: Mechanism
    state: State
    degrees_of_freedom: int
    surplus: Mapping[str, int]


class CannotMoveError(Sendable, ValueError):
    """A drive, or a speed at the start, contradicts the joints, or drives and speeds before it.

    `path` is its place in the scene.
    """

    def __init__(self, *path: str) -> None:
        super().__init__(f"the mechanism can't follow {'.'.join(path)}")
        self.path = path


def assemble(mechanism: Mechanism, start: Start) -> Assembly:
    """Put the mechanism together at time 0.

    A link with clearance starts on its guide's axis, unless its angle is given, and moves as
    without clearance, unless its motion is given. A journal starts in the middle of its bearing and
    moves with it, unless given values do not allow it; a pin in a slot with play likewise. Angles
    in `start.angles` and those of motor-driven parts are held. All other coordinates start from
    `start.guesses` (0 by default) and change as little as the joints demand. A flexible body starts
    straight and with a single angular speed, unless the joints do not allow it. If `start.states`
    gives the state of every part, it only changes as much as joints and drives demand.

    Raises:
        CannotAssembleError: a joint can't close.
        CannotMoveError: a drive or a given speed contradicts the joints.

    """
    if start.states is not None:
        q, places = closest(mechanism, start.states[:, :3], start.laps)
    else:
        q, places = _places(without_play(mechanism, set(start.angles)), start)
    mechanism = replace(
        mechanism,
        springs=tuple(_turned_at_rest(spring, q) for spring in mechanism.springs),
        linear_springs=tuple(_long_at_rest(spring, q) for spring in mechanism.linear_springs),
        contacts=tuple(_meshed(_spanned(contact, q), q) for contact in mechanism.contacts),
    )
    if start.states is not None:
        v = _closest_speeds(mechanism, q, places, start.states[:, 3:])
    else:
        moved = {*start.speeds, *start.velocities}
        v = _speeds(without_play(mechanism, moved), q, places, start)
    a = accelerations(mechanism, q, v, places, 0.0)
    laps = tuple(start.laps.get(slot.name, 1) for slot in mechanism.slots)
    return _assembled(mechanism, State(q, v, a, places, laps))


def standing_at(
    mechanism: Mechanism, q: FloatArray, places: FloatArray, laps: tuple[int, ...]
) -> Assembly:
    """Return a mechanism at rest at coordinates (parts, 3); only its drives accelerate it."""
    a = started(mechanism, q, places)
    return _assembled(mechanism, State(q, np.zeros_like(q), a, places, laps))


def _assembled(mechanism: Mechanism, state: State) -> Assembly:
    joints = constraint_rows(mechanism, state.q, state.places)
    surplus = _surplus(mechanism, joints)
    rank = len(joints) - sum(surplus.values())
    return Assembly(mechanism, state, state.q.size - rank, surplus)


def _turned_at_rest(spring: RotarySpring, q: FloatArray) -> RotarySpring:
    """Set the rest angle of a spring that has no torque as assembled."""
    turned = float(turning(spring.first, spring.second, q))
    law = None if spring.law is None else replace(spring.law, start=turned)
    rest = turned if spring.rest_angle is None else spring.rest_angle
    return replace(spring, rest_angle=rest, law=law)


def _long_at_rest(spring: LinearSpring, q: FloatArray) -> LinearSpring:
    """Set the free length of a spring that has no force as assembled."""
    length = length_of(spring, q)
    law = None if spring.law is None else replace(spring.law, start=length)
    return replace(spring, length=length if spring.length is None else spring.length, law=law)


def _spanned(contact: Contact, q: FloatArray) -> Contact:
    """Set the length of a rope over points that is taut and without force as assembled."""
    if not isinstance(contact, RopeContact) or not isnan(contact.free_length.at(0.0)):
        return contact
    gaps = [approach(piece, q, np.zeros_like(q), 0.0).gap for piece in contact.pieces]
    return replace(contact, free_length=Ramp(-float(sum(gaps))))


def _meshed(contact: Contact, q: FloatArray) -> Contact:
    """Measure the bound of a gear's flank from the assembled pose of the gear."""
    if not isinstance(contact, SumStop) or contact.gear is None:
        return contact
    return replace(contact, bound=contact.bound + float(summed(contact, q)))


def without_play(mechanism: Mechanism, given: set[int]) -> Mechanism:
    """Put links with clearance on the axes of their guides, except links with `given` parts."""
    slides = tuple(
        Slide(channel.name, channel.guide, channel.nodes[0])
        for channel in mechanism.channels
        if channel.clearance > 0 and not given & set(channel.rods)
    )
    return replace(mechanism, slides=mechanism.slides + slides)


def _concentric(mechanism: Mechanism) -> tuple[Pin, ...]:
    """Bearings as hinges without clearance."""
    return tuple(Pin(bearing.name, bearing.first, bearing.second) for bearing in mechanism.bearings)


def _places(mechanism: Mechanism, start: Start) -> tuple[FloatArray, FloatArray]:
    """Coordinates and slot places, with journals and pins in or near the middle of their play."""
    pins, played = _concentric(mechanism), [groove.slot for groove in mechanism.grooves]
    ideal = replace(mechanism, pins=mechanism.pins + pins, slots=mechanism.all_slots)
    try:
        q, places = positions(ideal, start)
        return q, places[: len(mechanism.slots)]
    except CannotAssembleError as error:
        if not pins and not played:
            raise
        try:
            return positions(mechanism, start, laid_out_by=(*pins, *played))
        except CannotAssembleError:
            raise error from None


def _speeds(mechanism: Mechanism, q: FloatArray, places: FloatArray, start: Start) -> FloatArray:
    """Velocities: journals and pins move with their bearings and slots if possible."""
    pinned = replace(
        mechanism,
        pins=mechanism.pins + _concentric(mechanism),
        slots=mechanism.all_slots,
        grooves=(),
    )
    played = [place_in(groove.slot, groove.lap, q) for groove in mechanism.grooves]
    try:
        return _velocities(pinned, q, np.append(places, played), start)
    except CannotMoveError:
        if not mechanism.bearings and not mechanism.grooves:
            raise
        return _velocities(mechanism, q, places, start)


# --- velocities -----------------------------------------------------------------------------


def _velocities(
    mechanism: Mechanism, q: FloatArray, places: FloatArray, start: Start
) -> FloatArray:
    """Least velocities that satisfy joints, motors and given speeds.

    A flexible body moves as a rigid one, unless the joints do not allow it.
    """
    joints = constraints_at(mechanism, q, places)
    rows, wanted = _with_speeds(mechanism, joints, q, places, start)
    free = len(rows) - len(wanted)  # rows of joints: their speed is 0
    right = np.append(np.zeros(free), [speed for speed, _ in wanted])
    for rigid in (True, False):
        v = least_speeds(mechanism, rows, right, q, rigid)
        if _follows(rows, v, right):
            return v

    def contradicted(last: int) -> bool:
        some = np.where(np.arange(len(rows)) <= free + last, right, np.nan)
        return not _follows(rows, least_speeds(mechanism, rows, some, q), some)

    # The first contradiction: the parts can follow all speeds before it, but not this one.
    raise wanted[bisect_left(range(len(wanted)), True, key=contradicted)][1]


def _with_speeds(
    mechanism: Mechanism, joints: Constraints, q: FloatArray, places: FloatArray, start: Start
) -> tuple[Constraints, list[tuple[float, CannotMoveError]]]:
    """Add a row for each given speed; list speeds of motors and given ones, with their errors."""
    every = mechanism.all_slots
    places = np.append(places, [place_in(slot, 1, q) for slot in every[len(places) :]])
    slotted = [k for k, slot in enumerate(every) if slot.name in start.speeds_along]
    slots = [every[k] for k in slotted]
    in_slots = [slot.name for slot in slots]
    sliding = [name for name in start.speeds_along if name not in in_slots]
    slides = slides_named(mechanism, sliding)
    of_parts = {(part, 2): speed for part, speed in start.speeds.items()}
    for part, velocity in start.velocities.items():
        of_parts |= {(part, axis): velocity[axis] for axis in (0, 1)}
    keys = ("velocities", "velocities", "speeds")  # by axis
    rows = (
        joints.with_fixed(list(of_parts))
        .with_rows(*along_slides(slides, np.zeros(len(slides)), q))
        .with_rows(*along_slots(slots, q, places[slotted]))
    )
    wanted = [
        (motor.speed.at(0.0), CannotMoveError("drives", motor.name))
        for motor in mechanism.speed_motors
    ]
    wanted += [
        (speed, CannotMoveError("initial", keys[axis], mechanism.parts[part].body))
        for (part, axis), speed in of_parts.items()
    ]
    wanted += [
        (start.speeds_along[name], CannotMoveError("initial", "speeds_along", name))
        for name in (*sliding, *in_slots)
    ]
    return rows, wanted


def _follows(rows: Constraints, v: FloatArray, right: FloatArray) -> bool:
    violated = np.nanmax(np.abs(rows.times(v) - right), initial=0.0)
    return bool(violated <= 1e-9 * max(1.0, np.nanmax(np.abs(right), initial=0.0)))


def _closest_speeds(
    mechanism: Mechanism, q: FloatArray, places: FloatArray, given: FloatArray
) -> FloatArray:
    """Velocities (parts, 3) that joints and motors allow, after the given ones.

    If the joints do not allow the given velocities, for example at a weld that closes, they act by
    an impulse: ``M (v - given) = J^T impulse``. So the lost kinetic energy is that of ``v - given``
    (Carnot), and the momentum of free parts is kept.
    """
    right, motors = np.zeros(len(constraints_at(mechanism, q, places))), mechanism.speed_motors
    right[len(right) - len(motors) :] = [motor.speed.at(0.0) for motor in motors]
    momenta = np.einsum("pij,pj->pi", mass_blocks(mechanism, q), given)
    return motions_by_mass(mechanism, q, places, right).nearest(momenta)


# --- redundant constraints --------------------------------------------------------------------


def always_redundant(assembly: Assembly) -> bool:
    """Tell whether surplus constraints are redundant in other poses, too: no dead centre."""
    mechanism = assembly.mechanism
    try:
        q, places = neighbouring(mechanism, assembly.state.q)
    except CannotAssembleError:
        return False
    return _surplus(mechanism, constraint_rows(mechanism, q, places)) == assembly.surplus


def _surplus(mechanism: Mechanism, joints: Constraints) -> dict[str, int]:
    """Redundant constraints of each joint or drive: those before it imply them."""
    motion = LeastMotion(mechanism, joints, scale_roots(mechanism), np.zeros(len(joints)))
    return {joints.names[joint]: count for joint, count in motion.surplus().items()}


NO_JUMPS = (
    "redundant coordinates need a penalty law; speeds that jump are for the formulation 'minimal' "
    "and for the engine 'lagrangian'"
)


def rubbing_joints(scene: Scene) -> Iterator[tuple[str, PinFriction | SlideFriction]]:
    """Joints with dry friction, by name."""
    for name, joint in scene.joints.items():
        friction = joint.friction if isinstance(joint, (RevoluteJoint, PrismaticJoint)) else None
        if friction is not None and friction.acts:
            yield name, friction


def beyond_redundant(scene: Scene) -> list[Mistake]:
    """Return the items that Exudyn's own solver lacks, as mistakes.

    It has redundant coordinates, with or without beams. It lacks contacts on curves, jumps of
    speeds, formulas of cylinders, stops of hinges or with a damper, ropes, springs by tables or
    formulas, and friction by the force in a joint.
    """
    rubbing = "friction by the force in a joint is for 'formulation: minimal'; or give a {}"
    reasons = [
        Mistake(
            ("joints", name, "friction", "coefficient"),
            rubbing.format("'torque'" if isinstance(friction, PinFriction) else "'force'"),
        )
        for name, friction in rubbing_joints(scene)
        if friction.coefficient > 0
    ]
    laws = {scene.law_path(name): law for name, law in scene.laws.items()}
    reasons += [
        Mistake(path, NO_JUMPS) for path, law in laws.items() if isinstance(law, ImpulseLaw)
    ]
    if scene.initial.at_rest and scene.solver.formulation == "beam":
        message = "a beam bends otherwise than the rods whose rest is known: take 'redundant'"
        reasons.append(Mistake(("initial", "at_rest"), message))
    minimal = "Exudyn's own solver has {}: take 'formulation: minimal'"
    return reasons + [Mistake(path, minimal.format(what)) for path, what in _for_minimal(scene)]


def _joints_for_minimal(scene: Scene) -> Iterator[tuple[KeyPath, str]]:
    """Items of joints that only minimal coordinates have, and a message each."""
    for name, joint in scene.joints.items():
        if isinstance(joint, SlotJoint) and joint.acting:
            yield ("joints", name, "clearance"), "no slots with play"
        elif isinstance(joint, RevoluteJoint) and joint.freewheel is not None:
            yield ("joints", name, "freewheel"), "no freewheels"


def runs_for_minimal(scene: Scene) -> Iterator[tuple[KeyPath, str]]:
    """Begins and ends of runs that only minimal coordinates have, and a message each."""
    path, until = scene.ending
    if until is not None:
        yield path, "no end at a formula"
    if scene.initial.pressing:
        yield ("initial", "pressing"), "no start that presses"


def _for_minimal(scene: Scene) -> Iterator[tuple[KeyPath, str]]:
    """Items of a scene that only minimal coordinates have, and a message each."""
    for name, law in scene.laws.items():
        if isinstance(law, HertzLaw) and law.length is not None:
            yield (*scene.law_path(name), "formula"), f"no formula '{law.formula}', but 'sphere'"
    curved = [
        n
        for n, contact in scene.contacts.items()
        if isinstance(contact, PointOnCurve | LineOnCurve)
    ]
    yield from ((("contacts", name), "no contacts on curves") for name in curved)
    yield from _joints_for_minimal(scene)
    yield from runs_for_minimal(scene)
    for name, spring in scene.springs.items():
        key = "torque" if isinstance(spring, TorsionalSpring) else "force"
        if name in scene.ropes:
            key = "type" if isinstance(spring, RopeSpring) else "acts"
            yield ("springs", name, key), "no springs of one side"
        elif getattr(spring, key) is not None:
            yield ("springs", name, key), "linear springs alone"
    for stop in scene.stops.values():
        if isinstance(stop, Flank):
            yield stop.path, "no gears with backlash"
        elif stop.turns or getattr(stop.law, "restitution", None) is None:
            yield stop.path, f"no stops {'of hinges' if stop.turns else 'with a damper'}"

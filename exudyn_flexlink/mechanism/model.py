"""A mechanism as rigid parts in the plane and what holds and drives them: plain numbers, in SI.

Every part has three coordinates: position x, y of its own origin and its angle (the origin of a
rod is its start, its x-axis points to its end). Both engines, and the checks that need none, read
this one description.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import hypot

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.integrate.problem import instant
from exudyn_flexlink.mechanism.joints import (
    Anchor,
    Channel,
    CircleContact,
    Contact,
    Gear,
    Groove,
    JointFriction,
    Pin,
    RopeContact,
    Slide,
    Slot,
    SumStop,
    Weld,
)
from exudyn_flexlink.mechanism.prescribed import Applied, Formula, Prescribed, Ramp, SpringLaw
from exudyn_flexlink.rounding import KNOT_TIME


@dataclass(frozen=True)
class RigidPart:
    """A rigid part: mass in kg, inertia about the centre of mass in kg m^2, lengths in m.

    `points` (x, y) are those that anything refers to, beside the origin.
    """

    name: str
    body: str
    mass: float
    inertia: float
    centre: tuple[float, float]
    points: tuple[tuple[float, float], ...]

    @cached_property
    def reach(self) -> float:
        """How far the farthest of its points is from its origin, m."""
        return max(hypot(x, y) for x, y in self.points)

    @property
    def inertia_about_origin(self) -> float:
        """Moment of inertia about the part's origin, kg m^2 (Steiner)."""
        return self.inertia + self.mass * (self.centre[0] ** 2 + self.centre[1] ** 2)


@dataclass(frozen=True)
class RotarySpring:
    """Torsional spring and damper between two parts: N m/rad, N m s/rad.

    `rest_angle` (rad) is that of the second part relative to the first; None: as assembled. A
    `law` adds a torque by the angle and its rate.
    """

    name: str
    first: int
    second: int
    stiffness: float
    damping: float
    rest_angle: float | None
    law: SpringLaw | None = None


@dataclass(frozen=True)
class LinearSpring:
    """Spring and damper between two anchors: N/m, N s/m.

    It acts along the line between them, without force at `length` (m); None: as assembled. One of
    length 0 draws the second anchor to the first in every direction, as does its damper. Along a
    `slide` it acts on how far that is out: then its length has a sign, and its anchors are those of
    the slide. A `law` adds a force by the length and its rate.
    """

    name: str
    first: Anchor
    second: Anchor
    stiffness: float
    damping: float
    length: float | None
    slide: Slide | None = None
    law: SpringLaw | None = None


@dataclass(frozen=True)
class Motor:
    """Prescribes how fast the angle of the second part against the first grows: rad/s.

    With a `slide` it is the length along that: m/s. `start` (rad or m) is the angle or length at
    time 0 where the drive prescribes it too; None: as assembled.
    """

    name: str
    first: int
    second: int
    speed: Prescribed
    start: float | None = None
    slide: Slide | None = None


@dataclass(frozen=True)
class Turning:
    """Senses the angle (rad) of the second part against the first, or its speed (rad/s)."""

    first: int
    second: int
    is_speed: bool


@dataclass(frozen=True)
class Placed:
    """Senses where a point is along x or y (axis 0, 1) of the ground, m."""

    point: Anchor
    axis: int


@dataclass(frozen=True)
class Sliding:
    """Senses how far (m) a slide is out, or its speed (m/s)."""

    slide: Slide
    is_speed: bool


@dataclass(frozen=True)
class Apart:
    """Senses how far apart two anchors are, m, or how fast that grows, m/s."""

    first: Anchor
    second: Anchor
    is_speed: bool


Stretch = Turning | Sliding | Apart
"""Angle or length of a spring."""
Sense = Stretch | Placed


def _length_sense(spring: LinearSpring) -> Sliding | Apart:
    if spring.slide is not None:
        return Sliding(spring.slide, is_speed=False)
    return Apart(spring.first, spring.second, is_speed=False)


@dataclass(frozen=True)
class Size:
    """Size of a torque (N m) or of a force's component (N), a function of time and of `senses`."""

    value: Applied
    senses: tuple[Sense, ...] = ()


@dataclass(frozen=True)
class Held:
    """Senses the magnitude of the force (N) in a joint, or the torque (N m) on its second part.

    The torque is that of the joint's friction, and of the drives with the names `drives`; that of
    a weld is told as a drive's, see `opened`.
    """

    joint: str
    is_torque: bool
    drives: tuple[str, ...] = ()


@dataclass(frozen=True)
class Until:
    """A formula of time and of `senses` that ends a run as it rises through 0."""

    value: Formula
    senses: tuple[Sense | Held, ...] = ()

    @property
    def by_forces(self) -> bool:
        """Whether the formula senses forces, and not the motion alone."""
        return any(isinstance(sense, Held) for sense in self.senses)

    def size(self, time: FloatArray, sensed: Sequence[FloatArray]) -> float:
        """Largest absolute value of the formula's terms at instants (n,) s, to tell rounding."""
        addends, clock = self.value.expression.addends, self.value.clock
        terms = [term.values(time + clock, sensed) for term in addends]
        values = [*terms, self.value.values(time, sensed)]
        return float(np.nanmax(np.abs(values)))


@dataclass(frozen=True)
class TorqueMotor:
    """Turns the second part, and the first back."""

    name: str
    first: int
    second: int
    size: Size


@dataclass(frozen=True)
class PointForce:
    """Pushes at a point, along x and y of the part `axes`, or of the ground."""

    name: str
    point: Anchor
    axes: int
    sizes: tuple[Size, Size]


@dataclass(frozen=True)
class Mechanism:
    """All of it. Order of the constraints: pins, welds, slides, slots, gears, speed motors."""

    parts: tuple[RigidPart, ...]
    points: Mapping[str, Anchor]  # of all bodies, by 'body.point'
    pins: tuple[Pin, ...]
    welds: tuple[Weld, ...]
    slides: tuple[Slide, ...]
    slots: tuple[Slot, ...]
    springs: tuple[RotarySpring, ...]
    linear_springs: tuple[LinearSpring, ...]
    speed_motors: tuple[Motor, ...]
    torque_motors: tuple[TorqueMotor, ...]
    forces: tuple[PointForce, ...]
    contacts: tuple[Contact, ...]
    bearings: tuple[CircleContact, ...]
    channels: tuple[Channel, ...]
    gravity: tuple[float, float]
    frictions: tuple[JointFriction, ...] = ()
    gears: tuple[Gear, ...] = ()
    grooves: tuple[Groove, ...] = ()
    until: Until | None = None
    pulses: tuple[float, ...] = ()  # instants (s) within short pulses of drives
    unfound: tuple[str, ...] = ()  # where such pulses were not looked for, in words

    @property
    def hinges(self) -> tuple[Pin | CircleContact, ...]:
        """Joints that parts turn about, without clearance and with."""
        return (*self.pins, *self.bearings)

    @property
    def all_slots(self) -> tuple[Slot, ...]:
        """Slots, those with play as if they had none at the end."""
        return (*self.slots, *(groove.slot for groove in self.grooves))

    @property
    def all_gears(self) -> tuple[Gear, ...]:
        """Gears, those with play at the end."""
        flanks = [contact for contact in self.contacts if isinstance(contact, SumStop)]
        loose = {flank.gear.name: flank.gear for flank in flanks if flank.gear is not None}
        return (*self.gears, *loose.values())

    @property
    def attachments(self) -> tuple[Pin | Weld, ...]:
        """Pins and welds, in the order of their constraints."""
        return (*self.pins, *self.welds)

    def opened(self) -> Mechanism:
        """Return it with a pin in place of each weld whose torque `until` senses.

        A motor holds the pin still, so that its torque is that of the weld.
        """
        senses = () if self.until is None else self.until.senses
        names = {s.joint: s.drives[0] for s in senses if isinstance(s, Held) and s.drives}
        welds, pins, motors = list[Weld](), list(self.pins), list(self.speed_motors)
        for weld in self.welds:
            if weld.name in names:
                first, second = weld.first, weld.second
                pins.append(Pin(weld.name, first, second))
                motors.append(Motor(names[weld.name], first.part, second.part, Ramp(0.0)))
            else:
                welds.append(weld)
        return replace(self, pins=tuple(pins), welds=tuple(welds), speed_motors=tuple(motors))

    @property
    def sizes(self) -> list[tuple[str, Size]]:
        """Sizes of torques and of components of forces, each with the name of its drive."""
        return [
            *((motor.name, motor.size) for motor in self.torque_motors),
            *((force.name, size) for force in self.forces for size in force.sizes),
        ]

    def knots(self, end: float) -> list[float]:
        """Instants before `end` (s) at which steps end, in order.

        A drive, or a derivative of it, jumps there, or is within a pulse.
        """
        applied = [size.value for _, size in self.sizes]
        functions = [*(motor.speed for motor in self.speed_motors), *applied]
        functions += [rope.free_length for rope in self.ropes]
        functions += [] if self.until is None else [self.until.value]
        jumps = {knot for function in functions for knot in function.knots(end)}
        instants = list[float]()
        for knot in sorted(jumps.union(self.pulses)):
            if 0 < knot < end and knot - (instants or [0.0])[-1] > instant(knot, KNOT_TIME):
                instants.append(knot)
        return instants

    @property
    def touching(self) -> tuple[Contact, ...]:
        """Contacts of the scene, then those of its joints with clearance: the order of arrays."""
        walls = (wall for groove in self.grooves for wall in groove.contacts)
        return (*self.contacts, *self.bearings, *walls)

    @property
    def ropes(self) -> list[RopeContact]:
        """Ropes over points."""
        return [contact for contact in self.contacts if isinstance(contact, RopeContact)]

    @property
    def first_walls(self) -> list[int]:
        """Number of the first wall of each groove in that order."""
        firsts, first = [], len(self.contacts) + len(self.bearings)
        for groove in self.grooves:
            firsts.append(first)
            first += len(groove.contacts)
        return firsts

    @property
    def idle_walls(self) -> set[int]:
        """Numbers there of the walls of laps in which no pin starts."""
        idle = set[int]()
        for first, groove in zip(self.first_walls, self.grooves, strict=True):
            walls = groove.walls(groove.lap)
            idle.update(first + k for k in range(len(groove.contacts)) if k not in walls)
        return idle

    @property
    def numbers(self) -> dict[str, int]:
        """Numbers of contacts, and of the first pairs of joints, among all, by their names."""
        numbers = {contact.name: k for k, contact in enumerate(self.touching)}
        count = len(self.touching)
        for channel in self.channels:
            numbers[channel.name] = count
            count += len(channel.contacts)
        firsts = zip(self.grooves, self.first_walls, strict=True)
        return numbers | {groove.name: first for groove, first in firsts}

    @cached_property
    def contacts_and_pairs(self) -> tuple[Contact, ...]:
        """Those, then the pairs of links and guides: the order of all arrays of contacts."""
        return (*self.touching, *(pair for channel in self.channels for pair in channel.contacts))

    @property
    def all_springs(self) -> tuple[RotarySpring | LinearSpring, ...]:
        """Springs at angles, then those between anchors."""
        return (*self.springs, *self.linear_springs)

    @property
    def spring_laws(self) -> list[tuple[SpringLaw, Stretch]]:
        """Springs by a table or a formula, and the length or angle of each."""
        laws: list[tuple[SpringLaw | None, Stretch]] = [
            *((s.law, Turning(s.first, s.second, is_speed=False)) for s in self.springs),
            *((s.law, _length_sense(s)) for s in self.linear_springs),
        ]
        return [(law, sense) for law, sense in laws if law is not None]

    @property
    def turned_by_drives(self) -> list[tuple[int, int]]:
        """First and second part of every drive at a joint that turns."""
        by_speed = [(motor.first, motor.second) for motor in self.speed_motors if not motor.slide]
        return [*by_speed, *((motor.first, motor.second) for motor in self.torque_motors)]

    @cached_property
    def bodies(self) -> Mapping[str, tuple[int, ...]]:
        """Indices of the parts of every body of the scene, in order."""
        numbers: dict[str, list[int]] = {}
        for i, part in enumerate(self.parts):
            numbers.setdefault(part.body, []).append(i)
        return {body: tuple(parts) for body, parts in numbers.items()}

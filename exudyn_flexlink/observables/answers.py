"""By what quantity the motion of a struck body is told: it turns on a hinge, slides, or is free."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import (
    GROUND,
    Anchor,
    CircleContact,
    Contact,
    Mechanism,
    Pin,
    Slide,
    anchor_position,
    anchor_velocity,
    approach,
    build_mechanism,
    length_along,
    speed_along,
    turning,
)
from exudyn_flexlink.scene import Scene, SleeveJoint

Carrying = Pin | CircleContact | Slide
Motion = tuple[FloatArray, FloatArray]


@dataclass(frozen=True)
class Measure:
    """A quantity, by its word and SI unit, and what its greatest less its least is called.

    `digits` is how Python writes its numbers.
    """

    word: str
    unit: str
    span: str
    digits: str

    @property
    def name(self) -> str:
        """The quantity with its unit, as columns are named."""
        return f"{self.word}_{self.unit}"

    @property
    def rate_name(self) -> str:
        """Its rate with the unit."""
        return f"rate_{self.unit}_per_s"

    def number(self, value: float) -> str:
        """Write a value without its unit."""
        return f"{value:{self.digits}}"

    def told(self, value: float) -> str:
        """Write a value with its unit."""
        return f"{self.number(value)} {self.unit}"


ANGLE = Measure("angle", "rad", "swing", "+.5f")
DISPLACEMENT = Measure("displacement", "m", "stroke", "+.5g")


@dataclass(frozen=True)
class Turned:
    """The part turns on `carrier`: its angle, counter-clockwise. `hinge` is on the struck body."""

    measure: ClassVar[Measure] = ANGLE
    carrier: int
    part: int
    hinge: Anchor

    def motion(self, q: FloatArray, v: FloatArray) -> Motion:
        """Angle (...), rad, and its rate, rad/s, at poses and rates (..., parts, 3)."""
        return turning(self.carrier, self.part, q), turning(self.carrier, self.part, v)


@dataclass(frozen=True)
class Slid:
    """The body slides along the line of a joint: how far, along the joint's axis.

    `sign` is -1 if the body carries the line, so that the other part goes the opposite way.
    """

    measure: ClassVar[Measure] = DISPLACEMENT
    slide: Slide
    sign: float

    def motion(self, q: FloatArray, v: FloatArray) -> Motion:
        """Place (...) along the line, m, and its rate, m/s, at poses and rates (..., parts, 3)."""
        slide = self.slide
        return self.sign * length_along(slide, q), self.sign * speed_along(slide, q, v)


@dataclass(frozen=True)
class Moved:
    """No one joint says how the body moves: how far an anchor goes along a `normal` (2,)."""

    measure: ClassVar[Measure] = DISPLACEMENT
    anchor: Anchor
    normal: tuple[float, float]

    def motion(self, q: FloatArray, v: FloatArray) -> Motion:
        """Place (...) along the normal, m, and its rate, m/s: see `Slid.motion`."""
        at, going = anchor_position(self.anchor, q), anchor_velocity(self.anchor, q, v)
        return np.dot(at, self.normal), np.dot(going, self.normal)


Answer = Turned | Slid | Moved


def answer_of(scene: Scene, mechanism: Mechanism, contact: Contact, start: FloatArray) -> Answer:
    """By what the motion of the body is told that a contact strikes.

    `start` (parts, 3) are the poses at time 0. What is free is told by the last anchor of what is
    struck, along the normal at time 0.
    """
    part = contact.parts[1]
    body = mechanism.parts[part].body
    joint = carrying_joint(scene, mechanism, body)
    if joint is None:
        x, y = approach(contact, start, np.zeros_like(start)).normal.tolist()
        return Moved(contact.anchors[1][-1], (x, y))
    second = joint.second.part in _moving_as_one(mechanism, body)
    if isinstance(joint, Slide):
        return Slid(joint, 1.0 if second else -1.0)
    hinge, other = (joint.second, joint.first) if second else (joint.first, joint.second)
    return Turned(other.part, part, hinge)


def rest_of(answer: Answer, mechanism: Mechanism) -> float | None:
    """Angle (rad), or place (m), at which the spring of what a body moves on is at rest, if any."""
    if isinstance(answer, Turned):
        ends = answer.carrier, answer.part
        for spring in mechanism.springs:
            if spring.rest_angle is not None and {spring.first, spring.second} == set(ends):
                return spring.rest_angle * (1.0 if spring.second == answer.part else -1.0)
    if isinstance(answer, Slid):
        found = (own for own in mechanism.linear_springs if own.slide is answer.slide)
        return next((answer.sign * own.length for own in found if own.length is not None), None)
    return None


def measures(scene: Scene) -> dict[str, Measure]:
    """By what the motion of every struck body is told."""
    mechanism, found = build_mechanism(scene), {}
    for contact in scene.contacts.values():
        body = contact.struck
        if body is not None:
            hinged = isinstance(carrying_joint(scene, mechanism, body), (Pin, CircleContact))
            found[body] = ANGLE if hinged else DISPLACEMENT
    return found


def carrying_joint(scene: Scene, mechanism: Mechanism, body: str) -> Carrying | None:
    """Return the joint on which a body, with what is welded to it, turns or slides.

    One that holds it on the ground, else the first of the scene; None without one.
    """
    own = _moving_as_one(mechanism, body)
    found = [
        joint
        for joint in _joints(scene, mechanism, own)
        if (joint.first.part in own) != (joint.second.part in own)
    ]
    grounded = (joint for joint in found if GROUND in (joint.first.part, joint.second.part))
    return next(grounded, found[0] if found else None)


def _moving_as_one(mechanism: Mechanism, body: str) -> set[int]:
    """Parts of a body, and those welded to them; none if they are welded to the ground."""
    welds = [{weld.first.part, weld.second.part} for weld in mechanism.welds]
    own, reached = set[int](), set(mechanism.bodies[body])
    while reached > own:
        own = reached
        reached = own.union(*(weld for weld in welds if weld & own))
    return set() if GROUND in own else own


def _joints(scene: Scene, mechanism: Mechanism, own: set[int]) -> Iterator[Carrying]:
    """Hinges and slides of the scene's joints, in its order; a guide is not carried by its link."""
    found = {joint.name: joint for joint in (*mechanism.hinges, *mechanism.slides)}
    for name, joint in scene.joints.items():
        if name in found and not (isinstance(joint, SleeveJoint) and found[name].first.part in own):
            yield found[name]

"""The response of struck bodies, and the quantities whose extremes a run keeps.

A struck body turns on a hinge, slides, or is free: its response is an angle or a displacement. An
engine evaluates the quantities at the nodes of its steps, so extremes do not depend on samples.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np

from exudyn_flexlink.arguments import number, takes
from exudyn_flexlink.arrays import FloatArray, Variable
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
from exudyn_flexlink.observables.instants import OverTime
from exudyn_flexlink.observables.points import point_anchor, samples_text, watched_point
from exudyn_flexlink.quantities import Dimension
from exudyn_flexlink.result import Extremes, Result
from exudyn_flexlink.scene import Scene, SleeveJoint

Carrying = Pin | CircleContact | Slide
Motion = tuple[FloatArray, FloatArray]


@dataclass(frozen=True)
class Measure:
    """A quantity: its word, its SI unit, and the word for its range (`span`).

    `digits` is the Python format of its numbers.
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
        """Name of its rate, with the unit."""
        return f"rate_{self.unit}_per_s"

    def number(self, value: float) -> str:
        """Write a value without its unit."""
        return f"{value:{self.digits}}"

    def text(self, value: float) -> str:
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
    """The body slides along the line of a joint: its displacement along the joint's axis.

    `sign` is -1 if the body carries the line and the other part slides.
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
    """No single joint determines the motion: displacement of an anchor along a `normal` (2,)."""

    measure: ClassVar[Measure] = DISPLACEMENT
    anchor: Anchor
    normal: tuple[float, float]

    def motion(self, q: FloatArray, v: FloatArray) -> Motion:
        """Place (...) along the normal, m, and its rate, m/s: see `Slid.motion`."""
        place, going = anchor_position(self.anchor, q), anchor_velocity(self.anchor, q, v)
        return np.dot(place, self.normal), np.dot(going, self.normal)


Answer = Turned | Slid | Moved


def answer_of(scene: Scene, mechanism: Mechanism, contact: Contact, start: FloatArray) -> Answer:
    """Return the measure of the motion of the body that a contact strikes.

    `start` (parts, 3) are the poses at time 0. A free body is measured by the displacement of the
    last anchor of the struck face, along the normal at time 0.
    """
    part = contact.parts[1]
    body = mechanism.parts[part].body
    joint = carrying_joint(scene, mechanism, body)
    if joint is None:
        x, y = approach(contact, start, np.zeros_like(start), 0.0).normal.tolist()
        return Moved(contact.anchors[1][-1], (x, y))
    second = joint.second.part in _rigid_group(mechanism, body)
    if isinstance(joint, Slide):
        return Slid(joint, 1.0 if second else -1.0)
    hinge, other = (joint.second, joint.first) if second else (joint.first, joint.second)
    return Turned(other.part, part, hinge)


def rest_of(answer: Answer, mechanism: Mechanism) -> float | None:
    """Rest angle (rad), or rest place (m), of the spring at a struck body's joint, if any."""
    if isinstance(answer, Turned):
        ends = answer.carrier, answer.part
        for spring in mechanism.springs:
            if spring.rest_angle is not None and {spring.first, spring.second} == set(ends):
                return spring.rest_angle * (1.0 if spring.second == answer.part else -1.0)
    if isinstance(answer, Slid):
        springs = (spring for spring in mechanism.linear_springs if spring.slide is answer.slide)
        return next(
            (answer.sign * spring.length for spring in springs if spring.length is not None), None
        )
    return None


def measures(scene: Scene) -> dict[str, Measure]:
    """The measure of the motion of every struck body."""
    mechanism, by_body = build_mechanism(scene), {}
    for contact in scene.contacts.values():
        body = contact.struck
        if body is not None:
            hinged = isinstance(carrying_joint(scene, mechanism, body), (Pin, CircleContact))
            by_body[body] = ANGLE if hinged else DISPLACEMENT
    return by_body


def carrying_joint(scene: Scene, mechanism: Mechanism, body: str) -> Carrying | None:
    """Return the joint on which a body, with bodies welded to it, turns or slides.

    A joint to the ground comes first, else the first joint of the scene; None without a joint.
    """
    fixed = _rigid_group(mechanism, body)
    joints = [
        joint
        for joint in _joints(scene, mechanism, fixed)
        if (joint.first.part in fixed) != (joint.second.part in fixed)
    ]
    grounded = (joint for joint in joints if GROUND in (joint.first.part, joint.second.part))
    return next(grounded, joints[0] if joints else None)


def _rigid_group(mechanism: Mechanism, body: str) -> set[int]:
    """Parts of a body and parts welded to them; no parts if they are welded to the ground."""
    welds = [{weld.first.part, weld.second.part} for weld in mechanism.welds]
    fixed, reached = set[int](), set(mechanism.bodies[body])
    while reached > fixed:
        fixed = reached
        reached = fixed.union(*(weld for weld in welds if weld & fixed))
    return set() if GROUND in fixed else fixed


def _joints(scene: Scene, mechanism: Mechanism, fixed: set[int]) -> Iterator[Carrying]:
    """Hinges and slides of the scene, in order, without sleeves whose guide is in `fixed`."""
    joints = {joint.name: joint for joint in (*mechanism.hinges, *mechanism.slides)}
    for name, joint in scene.joints.items():
        if name in joints and not (
            isinstance(joint, SleeveJoint) and joints[name].first.part in fixed
        ):
            yield joints[name]


@dataclass(frozen=True)
class LeverResponse(OverTime):
    """Motion of a struck body, (N,) each.

    `measure` says what `value` is, from where the body stood at time 0, or in a run that goes on
    from another where its spring is at rest, and in what unit: the angle (rad, counter-clockwise)
    of a body that turns on another, or the displacement (m) along the joint's axis of one that
    slides, both relative to the body that carries it; of a free one it is the displacement of its
    tip. `rate` is that of the value, per s.
    `tip_displacement` (m) is that of the end of the struck line farther from the body's hinge, or
    of the struck circle's centre, along the normal at time 0, positive to the free side.
    `extremes` are those of the value, whatever is sampled, also of what `at` gives.
    """

    body: str
    measure: Measure
    time: FloatArray
    value: Annotated[FloatArray, Variable("time", None, "angle or displacement", rate="rate")]
    rate: Annotated[FloatArray, Variable("time", None, "rate of the value")]
    tip_displacement: Annotated[FloatArray, Variable("time", "m", "displacement of the tip")]
    extremes: Extremes

    def __repr__(self) -> str:
        if not np.size(self.time):
            return f"<LeverResponse of {self.body}: no samples>"
        (least, instant), (greatest, then) = self.least, self.greatest
        unit = self.measure.unit
        return (
            f"<LeverResponse of {self.body}: from {least:+.5g} {unit} at {instant:.5g} s to "
            f"{greatest:+.5g} {unit} at {then:.5g} s; {samples_text(self.time)}>"
        )

    @takes(begin=number(Dimension.TIME, endless=True), end=number(Dimension.TIME, endless=True))
    def between(self, begin: float, end: float) -> LeverResponse:
        """The part from `begin` (s) to before `end` (s); it may be empty."""
        inside = (self.time >= begin) & (self.time < end)
        names = ("time", "value", "rate", "tip_displacement")
        arrays = {name: getattr(self, name)[inside] for name in names}
        extremes = self.extremes.between(begin, np.nextafter(end, -np.inf))
        return replace(self, **arrays, extremes=extremes)

    @property
    def least(self) -> tuple[float, float]:
        """Smallest value and its instant (s)."""
        return self._all.least

    @property
    def greatest(self) -> tuple[float, float]:
        """Largest value and its instant (s)."""
        return self._all.greatest

    @property
    def farthest(self) -> float:
        """Value farthest from that at time 0; 0 of an empty part of a run."""
        values = self._all
        return max(values.least[0], values.greatest[0], key=abs) if len(values.time) else 0.0

    @property
    def moves(self) -> bool:
        """Whether the body moves; a body that is welded to the ground does not."""
        return self.least[0] < self.greatest[0]

    @property
    def _all(self) -> Extremes:
        """Extremes and samples; only samples have the values at the ends of a part of a run."""
        extremes = self.extremes
        return Extremes(np.append(extremes.time, self.time), np.append(extremes.value, self.value))


def struck_bodies(scene: Scene) -> dict[str, str]:
    """Struck bodies, each with the first contact that strikes it."""
    contacts: dict[str, str] = {}
    for name, contact in scene.contacts.items():
        if contact.struck is not None:
            contacts.setdefault(contact.struck, name)
    return contacts


def lever_response(result: Result, contact: str) -> LeverResponse:
    """Motion of the body that the contact strikes."""
    mechanism = build_mechanism(result.scene)
    struck = struck_by(mechanism, contact)
    part = struck.parts[1]
    if part == GROUND:
        raise ValueError(f"the contact '{contact}' strikes the ground")
    body, start = mechanism.parts[part].body, result.poses[0]
    # A body has one measure for all contacts that strike it; the run's extremes belong to it.
    first = struck_by(mechanism, struck_bodies(result.scene)[body])
    answer = answer_of(result.scene, mechanism, first, start)
    value, rate = answer.motion(result.poses, result.rates)
    zero = float(value[0])
    hinge = answer.hinge if isinstance(answer, Turned) else None
    if result.scene.initial.states and (rest := rest_of(answer, mechanism)) is not None:
        start, zero = _set_back(start, answer, part, zero - rest), rest
    anchor = _farthest(struck.anchors[1], hinge, start)
    tip, at_rest = anchor_position(anchor, result.poses), anchor_position(anchor, start)
    normal = approach(struck, start, result.rates[0], 0.0).normal
    turns = result.extremes[f"{body}.{answer.measure.name}"]
    return LeverResponse(
        body,
        answer.measure,
        result.time,
        value - zero,
        rate,
        (tip - at_rest) @ normal,
        Extremes(turns.time, turns.value - zero),
    )


def _set_back(q: FloatArray, answer: Turned | Slid | Moved, part: int, by: float) -> FloatArray:
    """Poses (parts, 3) with the struck part turned back by an angle (rad) about its hinge, if any.

    This is the pose at rest, for a run that continues another run with the part displaced.
    """
    if not isinstance(answer, Turned):
        return q
    back, pivot = q.copy(), anchor_position(answer.hinge, q)
    back[part, 2] -= by
    back[part, :2] += pivot - anchor_position(answer.hinge, back)
    return np.asarray(back)


def struck_by(mechanism: Mechanism, contact: str) -> Contact:
    """Find a contact of the scene."""
    for candidate in mechanism.contacts:
        if candidate.name == contact:
            return candidate
    raise ValueError(f"the scene has no contact '{contact}'")


def _farthest(anchors: Sequence[Anchor], hinge: Anchor | None, q: FloatArray) -> Anchor:
    """Anchor of the struck body with the largest motion; the last one of equal anchors."""
    if hinge is None:
        return anchors[-1]
    place = anchor_position(hinge, q)
    return max(
        anchors[::-1], key=lambda anchor: float(np.linalg.norm(anchor_position(anchor, q) - place))
    )


def extremes_of(scene: Scene, contact: str) -> tuple[str, str]:
    """Names of force and penetration of a contact, or of torque and angle of a hinge's stop."""
    turns = scene.unit_of(contact, "m") == "rad"
    names = ("torque_N_m", "penetration_rad") if turns else ("force_N", "penetration_m")
    return f"{contact}.{names[0]}", f"{contact}.{names[1]}"


class Watched:
    """The watched quantities of a scene, whose parts are at `start` (parts, 3) at time 0.

    For every struck body: its angle or displacement, and the rate. For the watched point: x, y,
    distance from O, and speed. For `contacts`, also in joints with clearance: force and
    penetration; an engine finds these by itself. `names` (k,) tell quantity and unit.
    """

    def __init__(self, scene: Scene, mechanism: Mechanism, start: FloatArray) -> None:
        self._scene, point, by_body = scene, watched_point(scene), measures(scene).items()
        self._anchor = point_anchor(scene, mechanism, point)
        self._answers = [
            answer_of(scene, mechanism, struck_by(mechanism, contact), start)
            for contact in struck_bodies(scene).values()
        ]
        places = [f"{body}.{measure.name}" for body, measure in by_body]
        places += [f"{point}.x_m", f"{point}.y_m", f"{point}.distance_m"]
        speeds = [f"{body}.{measure.rate_name}" for body, measure in by_body]
        self.names = (*places, *speeds, f"{point}.speed_m_per_s")
        watched = (*mechanism.contacts, *mechanism.bearings)
        self.contacts = tuple(contact.name for contact in watched)
        # Distance and speed are watched as squares, which are smooth even where they are 0.
        self._squared = (len(places) - 1, len(self.names) - 1)

    def of_contact(self, name: str) -> tuple[str, str]:
        """Names of a contact's force and penetration: see `extremes_of`."""
        return extremes_of(self._scene, name)

    def of(
        self, poses: FloatArray, rates: FloatArray, slopes: Callable[[FloatArray], FloatArray]
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Values at poses and rates (m, n, parts, 3): places, their rates, speeds, their slopes.

        Shapes are twice (m, n, places) and twice (m, n, speeds), in the order of `names`. Values
        are squares where `unsquared` takes the root. `slopes` differentiates velocities (m, n, c)
        within a step.
        """
        place = anchor_position(self._anchor, poses)
        going = anchor_velocity(self._anchor, poses, rates)
        motions = [answer.motion(poses, rates) for answer in self._answers]
        answers, moving = [column[0] for column in motions], [column[1] for column in motions]
        distance, growing = np.sum(place * place, axis=-1), 2 * np.sum(place * going, axis=-1)
        velocities = np.stack([*moving, going[..., 0], going[..., 1]], axis=-1)
        slope = slopes(velocities)
        # The square has twice the degree of the velocity, so its values don't determine its slope.
        square = np.sum(going * going, axis=-1)
        bend = 2 * np.sum(going * slope[..., -2:], axis=-1)
        return (
            np.stack([*answers, place[..., 0], place[..., 1], distance], axis=-1),
            np.stack([*moving, going[..., 0], going[..., 1], growing], axis=-1),
            np.concatenate([velocities[..., :-2], square[..., None]], axis=-1),
            np.concatenate([slope[..., :-2], bend[..., None]], axis=-1),
        )

    def sizes(self, poses: FloatArray) -> FloatArray:
        """Sizes (places,) of the numbers behind the places, at poses (m, n, parts, 3).

        They determine the rounding of places: for a length the farthest coordinate counts, for an
        angle the largest angle, but at least 1 rad, the size in sines and cosines.
        """
        ends = poses[..., :2], anchor_position(self._anchor, poses)
        far = max(float(np.abs(end).max()) for end in ends)
        angle = max(float(np.abs(poses[..., 2]).max()), 1.0)
        answers = [angle if answer.measure is ANGLE else far for answer in self._answers]
        return np.array([*answers, far, far, far**2])

    def unsquared(self, which: int, values: FloatArray) -> FloatArray:
        """Values in the unit of their name, as roots of squares."""
        return np.sqrt(np.maximum(values, 0.0)) if which in self._squared else values

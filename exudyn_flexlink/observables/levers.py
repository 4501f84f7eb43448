"""How a struck body answers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.mechanism import (
    GROUND,
    Anchor,
    FaceContact,
    Mechanism,
    anchor_position,
    approach,
    build_mechanism,
    turning,
)
from exudyn_flexlink.observables.interpolation import between_samples
from exudyn_flexlink.observables.points import part_of_point, point_anchor
from exudyn_flexlink.result import Extremes, Result
from exudyn_flexlink.scene import RevoluteJoint, Scene, split_point

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class LeverResponse:
    """Motion of a struck body, (N,) each.

    `angle` (rad, from where it stood at time 0, counter-clockwise) and `rate` (rad/s) are relative
    to the body that carries it. `tip_displacement` (m) is that of the end of the struck line
    farther from the body's joint, along the face's normal at time 0, positive to the free side.
    `extremes` are those of the angle, whatever is sampled.
    """

    body: str
    time: FloatArray
    angle: FloatArray
    rate: FloatArray
    tip_displacement: FloatArray
    extremes: Extremes

    def __repr__(self) -> str:
        if not len(self.time):
            return f"<LeverResponse of {self.body}: no samples>"
        (least, at), (greatest, then) = self.least, self.greatest
        return (
            f"<LeverResponse of {self.body}: from {least:+.5g} rad at {at:.5g} s to "
            f"{greatest:+.5g} rad at {then:.5g} s, {len(self.time)} samples>"
        )

    def angle_at(self, time: FloatArray) -> FloatArray:
        """Angle at any instants, rad, between samples too: see `between_samples`."""
        return between_samples(self.time, self.angle, self.rate, time)

    def between(self, begin: float, end: float) -> LeverResponse:
        """The part from `begin` to before `end` (s) alone; may be nothing."""
        inside = (self.time >= begin) & (self.time < end)
        names = ("time", "angle", "rate", "tip_displacement")
        arrays = {name: getattr(self, name)[inside] for name in names}
        extremes = self.extremes.between(begin, np.nextafter(end, -np.inf))
        return replace(self, **arrays, extremes=extremes)

    @property
    def least(self) -> tuple[float, float]:
        """Smallest angle (rad) and its instant (s)."""
        return self._all.least

    @property
    def greatest(self) -> tuple[float, float]:
        """Largest angle (rad) and its instant (s)."""
        return self._all.greatest

    @property
    def farthest(self) -> float:
        """Angle (rad) farthest from where it stood at time 0; 0 of no part of a run."""
        own = self._all
        return max(own.least[0], own.greatest[0], key=abs) if len(own.time) else 0.0

    @property
    def _all(self) -> Extremes:
        """Extremes and samples: at the ends of a part of a run only these tell the angle."""
        extremes = self.extremes
        return Extremes(
            np.concatenate([extremes.time, self.time]), np.concatenate([extremes.value, self.angle])
        )


def angle_name(body: str) -> str:
    """Name of a struck body's angle, relative to what carries it, among a run's extremes."""
    return f"{body}.angle_rad"


def struck_bodies(scene: Scene) -> dict[str, str]:
    """Bodies that a contact's line belongs to, each with the first contact that strikes it."""
    found: dict[str, str] = {}
    for name, contact in scene.contacts.items():
        found.setdefault(split_point(contact.line[0])[0], name)
    return found


def lever_response(result: Result, contact: str) -> LeverResponse:
    """Motion of the body that the contact strikes.

    Raises:
        ValueError: the scene has no such contact.

    """
    mechanism = build_mechanism(result.scene)
    face = struck_face(mechanism, contact)
    body = mechanism.parts[face.start.part].body
    carrier, hinge = carrier_of(result.scene, mechanism, body)
    angle, rate = (turning(carrier, face.start.part, x) for x in (result.poses, result.rates))
    tip = anchor_position(_farther(face, hinge, result.poses[0]), result.poses)
    normal = approach(face, result.poses[0], result.rates[0]).normal
    turned = result.extremes[angle_name(body)]
    return LeverResponse(
        body,
        result.time,
        angle - angle[0],
        rate,
        (tip - tip[0]) @ normal,
        Extremes(turned.time, turned.value - angle[0]),
    )


def struck_face(mechanism: Mechanism, contact: str) -> FaceContact:
    """Find the face of a contact.

    Raises:
        ValueError: the scene has no such contact.

    """
    for face in mechanism.contacts:
        if face.name == contact:
            return face
    raise ValueError(f"the scene has no contact '{contact}'")


def carrier_of(scene: Scene, mechanism: Mechanism, body: str) -> tuple[int, Anchor | None]:
    """Part that the body is hinged to, and the hinge on the body; ground and None without one."""
    for joint in scene.joints.values():
        if not isinstance(joint, RevoluteJoint):
            continue
        for own, other in (joint.points, joint.points[::-1]):
            if split_point(own)[0] == body:
                anchor = point_anchor(scene, mechanism, own)
                return part_of_point(scene, mechanism, other), anchor
    return GROUND, None


def _farther(face: FaceContact, hinge: Anchor | None, q: FloatArray) -> Anchor:
    if hinge is None:
        return face.end
    at = anchor_position(hinge, q)
    start, end = (
        float(np.linalg.norm(anchor_position(anchor, q) - at)) for anchor in (face.start, face.end)
    )
    return face.start if start > end else face.end

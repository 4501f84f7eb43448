"""How a struck body answers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.mechanism import (
    GROUND,
    Anchor,
    Contact,
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
    farther from the body's joint, or of the struck circle's centre, along the normal at time 0,
    positive to the free side.
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
    """Bodies that are struck, each with the first contact that strikes it."""
    found: dict[str, str] = {}
    for name, contact in scene.contacts.items():
        if contact.struck is not None:
            found.setdefault(contact.struck, name)
    return found


def lever_response(result: Result, contact: str) -> LeverResponse:
    """Motion of the body that the contact strikes.

    Raises:
        ValueError: the scene has no such contact, or it strikes the ground.

    """
    mechanism = build_mechanism(result.scene)
    own = struck_by(mechanism, contact)
    part = own.parts[1]
    if part == GROUND:
        raise ValueError(f"the contact '{contact}' strikes the ground")
    body = mechanism.parts[part].body
    carrier, hinge = carrier_of(result.scene, mechanism, body)
    angle, rate = (turning(carrier, part, x) for x in (result.poses, result.rates))
    tip = anchor_position(_farthest(own.anchors[1], hinge, result.poses[0]), result.poses)
    normal = approach(own, result.poses[0], result.rates[0]).normal
    turned = result.extremes[angle_name(body)]
    return LeverResponse(
        body,
        result.time,
        angle - angle[0],
        rate,
        (tip - tip[0]) @ normal,
        Extremes(turned.time, turned.value - angle[0]),
    )


def struck_by(mechanism: Mechanism, contact: str) -> Contact:
    """Find a contact of the scene.

    Raises:
        ValueError: the scene has no such contact.

    """
    for own in mechanism.contacts:
        if own.name == contact:
            return own
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


def _farthest(anchors: Sequence[Anchor], hinge: Anchor | None, q: FloatArray) -> Anchor:
    """Anchor of the struck body that moves most as it swings, the last of several alike."""
    if hinge is None:
        return anchors[-1]
    at = anchor_position(hinge, q)
    return max(anchors[::-1], key=lambda own: float(np.linalg.norm(anchor_position(own, q) - at)))

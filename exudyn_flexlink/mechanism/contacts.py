"""Geometry of a contact: gap and place, their rates, and the directions in which it acts.

Pressing forces and impulses of the laws that a scene gives, also by materials and radii.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import e, exp, inf, pi, sqrt

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.laws import (
    Impulse,
    LineContact,
    Penalty,
    PowerPenalty,
    PressingLaw,
    RestitutionPenalty,
    SpringDamper,
)
from exudyn_flexlink.mechanism.constraints import (
    anchor_position,
    anchor_velocity,
    angle_of,
    inertia_with_welded,
    left_of,
    length_along,
    seen_from,
    turned,
    turning,
    welded_to,
)
from exudyn_flexlink.mechanism.model import (
    GROUND,
    Anchor,
    CircleContact,
    Contact,
    CurveContact,
    FaceContact,
    FlatContact,
    Mechanism,
    Slide,
    TurnStop,
)
from exudyn_flexlink.scene import (
    ContactLaw,
    DampedLaw,
    HertzLaw,
    ImpulseLaw,
    PenaltyLaw,
    RubbingImpulse,
    Scene,
    SleeveJoint,
    StopLaw,
)


def pressing_law(
    scene: Scene, law: PenaltyLaw | StopLaw, radii: tuple[float, float] | None = None
) -> PressingLaw:
    """As `penalty_of`, also of stops of joints, and of impulses."""
    if isinstance(law, ImpulseLaw):
        slip = law.tangential_restitution if isinstance(law, RubbingImpulse) else 0.0
        return Impulse(law.restitution, slip)
    if isinstance(law, PenaltyLaw):
        return penalty_of(scene, law, radii)
    if law.restitution is None:
        return SpringDamper(law.stiffness, law.damping or 0.0)
    slow = law.transition_speed or RestitutionPenalty.transition_speed
    return RestitutionPenalty(law.stiffness, law.restitution, slow)


def penalty_of(scene: Scene, law: PenaltyLaw, radii: tuple[float, float] | None = None) -> Penalty:
    """Return the pressing force of a law; `radii` (m) are those that the contact itself has.

    That of a hollow is negative.
    """
    if isinstance(law, ContactLaw):
        return RestitutionPenalty(law.stiffness, law.restitution, law.transition_speed)
    if isinstance(law, DampedLaw):
        return PowerPenalty(law.stiffness, law.exponent, law.factor, law.transition_speed)
    if law.stiffness is not None:
        return PowerPenalty(law.stiffness, law.exponent or 1.5)
    return _by_materials(scene, law, law.radii or radii or ())


def _by_materials(scene: Scene, law: HertzLaw, radii: tuple[float, ...]) -> Penalty:
    """Force of elastic bodies: ``4/3 E sqrt(R) d^1.5``, or that of parallel cylinders.

    Spheres by H. Hertz (1882), which H. M. Lankarani and P. E. Nikravesh use for a pin in a bore,
    too. Cylinders by K. L. Johnson (1985), ``d = q/(pi E) [ln(4 pi E D/q) - 1]``, and by
    E. I. Radzimovsky (1953), ``d = q/(pi E) [2/3 + ln(16 R1 R2/b^2)]`` with the width
    ``b = 1.6 sqrt(2 q R1 R2/(D E))``; D is the sum of the radii, in a hollow their difference.
    """
    assert law.materials is not None  # the scene checks that there is one of both
    modulus = 1 / sum(_compliance(scene, name) for name in law.materials)
    if law.formula not in ("johnson", "radzimovsky"):
        return PowerPenalty(4 / 3 * modulus / sqrt(sum(1 / radius for radius in radii)))
    assert law.length is not None  # the scene checks it
    apart = abs(sum(radii))
    johnson = law.formula == "johnson"
    bound = modulus * apart * (4 * pi / e if johnson else 8 / 1.6**2 * exp(2 / 3))
    return LineContact(modulus, law.length, bound)


def _compliance(scene: Scene, name: str) -> float:
    """(1 - nu^2)/E of a material, 1/Pa."""
    material = scene.materials[name]
    assert material.poissons_ratio is not None  # the scene checks it
    return (1 - material.poissons_ratio**2) / material.youngs_modulus


TOUCHING = 1e-12  # m: a gap smaller than rounding is contact without penetration
HEAVY = 1e3  # times all the rest: a lever that stands still as it is struck


@dataclass(frozen=True)
class Approach:
    """How near a contact is; arrays of one shape.

    `gap` (m; rad of a hinge's stop) is positive while apart, `gap_rate` (m/s) its derivative by
    time. `place` (m) counts along the face or the curve from its start, or around the second circle
    from the x-axis of its part. `slip` (m/s) is the speed of the first part's material against that
    of the second.
    `normal` (..., 2) is the direction in which the contact pushes the first part, `along` (..., 2)
    that of places and slip.

    Friction of round parts acts where the distance of their centres is divided as their radii are:
    what rolls there has rims of one speed, however deep. In a hollow that is outside the rims: with
    the part `grip` of mu F, and of slip, friction turns nothing by more than mu F times its radius.
    """

    gap: FloatArray
    place: FloatArray
    gap_rate: FloatArray
    slip: FloatArray
    normal: FloatArray
    along: FloatArray
    grip: FloatArray | float = 1.0


def on_the_contact(contact: Contact, place: float) -> bool:
    """Tell whether a place is one where the contact can act: what is closed has no ends."""
    length = contact.length
    return length == inf or 0 <= place <= length


def far_behind(contact: Contact, at: Approach) -> bool:
    """Tell whether a point is behind a face or a curve, and farther from it than that is long.

    There it counts as one that came beside the face, if it can: the contact lets it pass.
    """
    if isinstance(contact, FaceContact) and contact.across:
        return False
    opposite = on_the_contact(contact, float(at.place))
    return opposite and float(at.gap) <= -contact.length


def pressed_at(contact: Contact, at: Approach) -> bool:
    """Tell whether a contact that looks so is pressed: with penetration, opposite its face."""
    pressed = at.gap < -TOUCHING and on_the_contact(contact, float(at.place))
    return bool(pressed) and not far_behind(contact, at)


def pressed_among(contacts: Sequence[Contact], q: FloatArray) -> list[int]:
    """Numbers of the contacts that are pressed at coordinates (parts, 3), as at a rest."""
    still = np.zeros_like(q)
    return [k for k, own in enumerate(contacts) if pressed_at(own, approach(own, q, still))]


def idle_at_start(
    mechanism: Mechanism, q: FloatArray, v: FloatArray
) -> Iterator[tuple[Contact, str]]:
    """Give the contacts that do not act at first, though the point is opposite their face.

    At coordinates and velocities (parts, 3) of time 0; with a sentence for each.
    """
    for contact in mechanism.contacts:
        at = approach(contact, q, v)
        if far_behind(contact, at):
            what = "line" if isinstance(contact, FaceContact) else "curve"
            yield (
                contact,
                f"'{contact.name}' starts {-float(at.gap):.3g} m behind its {what}, which is "
                f"{contact.length:.3g} m long: it does not act until the point has come "
                "round an end; if that side is the free one, choose the other 'side'",
            )


def in_guides(
    scene: Scene, mechanism: Mechanism, q: FloatArray
) -> Iterator[tuple[str, FloatArray, FloatArray]]:
    """Give the name of every sleeve, and from where to where (...) its link is along its guide.

    In lengths of the guide: 0 and 1 are its mouths. `q` has shape (..., parts, 3).
    """
    points = mechanism.points
    for name, sleeve in scene.joints.items():
        if isinstance(sleeve, SleeveJoint):
            start, end = points[f"{sleeve.guide}.start"], points[f"{sleeve.guide}.end"]
            nodes = [Anchor(part, 0.0, 0.0) for part in mechanism.bodies[sleeve.link]]
            nodes.append(points[f"{sleeve.link}.end"])
            along = np.stack([length_along(Slide(name, start, node), q) for node in nodes])
            yield name, *(end_of(along, axis=0) / (end.x - start.x) for end_of in (np.min, np.max))


def swings(mechanism: Mechanism) -> list[float]:
    """How long struck levers, with all that is welded to them, turn an error of speed into angles.

    That is 1/omega (s) on their springs, infinite without a spring. A contact with what has no
    pivot of its own, or is so heavy that a strike hardly moves it, has none.
    """
    found, all_mass = [], sum(part.mass for part in mechanism.parts)
    for contact in mechanism.contacts:
        lever = contact.parts[1]
        pivot = _pivot(mechanism, lever)
        if pivot is None:
            continue
        inertia = inertia_with_welded(pivot, mechanism.parts, mechanism.welds)
        welded = welded_to(lever, mechanism.welds)
        mass = sum(mechanism.parts[part].mass for part in welded if part != GROUND)
        if inertia > HEAVY * (all_mass - mass) * mechanism.parts[lever].reach ** 2:
            continue
        held = {lever, GROUND}
        stiffness = sum(s.stiffness for s in mechanism.springs if {s.first, s.second} == held)
        found.append(float(np.sqrt(inertia / stiffness)) if stiffness > 0 else inf)
    return found


def _pivot(mechanism: Mechanism, part: int) -> Anchor | None:
    """Point of a part that is pinned to the ground."""
    for pin in mechanism.pins:
        for mine, other in ((pin.first, pin.second), (pin.second, pin.first)):
            if part == mine.part != GROUND == other.part:
                return mine
    return None


def approach(contact: Contact, q: FloatArray, v: FloatArray) -> Approach:
    """Gap, place, rates and directions at coordinates and velocities (..., parts, 3)."""
    if isinstance(contact, CircleContact):
        return _of_circles(contact, q, v)
    if isinstance(contact, CurveContact):
        return _of_curve(contact, q, v)
    if isinstance(contact, FlatContact):
        return _of_flat(contact, q, v)
    if isinstance(contact, TurnStop):
        return _of_stop(contact, q, v)
    return _of_face(contact, q, v)


def _of_stop(contact: TurnStop, q: FloatArray, v: FloatArray) -> Approach:
    """The gap is an angle; a torque has no direction and no place."""
    parts = contact.first.part, contact.second.part
    gap = contact.way * (turning(*parts, q) - contact.bound)
    none = np.zeros_like(gap)
    aside = np.zeros((*gap.shape, 2))
    return Approach(gap, none, contact.way * turning(*parts, v), none, aside, aside)


def _of_face(contact: FaceContact, q: FloatArray, v: FloatArray) -> Approach:
    """Where the point is held on the line, the gap is minus its distance from it."""
    start, end = anchor_position(contact.start, q), anchor_position(contact.end, q)
    along = (end - start) / contact.length
    left = left_of(along)
    between = anchor_position(contact.point, q) - start
    side = _side(contact, np.sum(left * between, axis=-1))
    normal = side[..., None] * left
    relative = anchor_velocity(contact.point, q, v) - anchor_velocity(contact.start, q, v)
    gap, place = np.sum(normal * between, axis=-1), np.sum(along * between, axis=-1)
    turning = angle_of(contact.start.part, v)
    # The face turns under the point: what is along it becomes normal to it and the reverse.
    gap_rate = np.sum(normal * relative, axis=-1) - side * turning * place
    slip = np.sum(along * relative, axis=-1) + side * turning * gap
    return Approach(gap, place, gap_rate, slip, normal, along)


def _side(contact: FaceContact, lateral: FloatArray) -> FloatArray:
    """Side to which the contact pushes: the free one, or from where the point is to the line."""
    if contact.side != 0:
        return np.full_like(lateral, contact.side)
    return np.where(lateral > 0, -1.0, 1.0)


def _of_circles(contact: CircleContact, q: FloatArray, v: FloatArray) -> Approach:
    """The circles touch on the line through their centres."""
    between = anchor_position(contact.first, q) - anchor_position(contact.second, q)
    relative = anchor_velocity(contact.first, q, v) - anchor_velocity(contact.second, q, v)
    outward, far = _direction(between, relative)
    along = left_of(outward)
    way = -1.0 if contact.inside else 1.0
    gap = way * (far - contact.distance)
    gap_rate = way * np.sum(outward * relative, axis=-1)
    radius, edge = contact.radii
    first, second = (angle_of(part, v) for part in contact.parts)
    pressed = contact.distance + way * np.minimum(gap, 0.0)
    grip, arm = _grips(-way * radius, contact.distance, pressed)
    slip = grip * (np.sum(along * relative, axis=-1) - second * far) + arm * (first - second)
    turned = np.arctan2(outward[..., 1], outward[..., 0]) - angle_of(contact.second.part, q)
    place = edge * np.mod(turned, 2 * np.pi)
    return Approach(gap, place, gap_rate, slip, way * outward, along, grip)


def grip_of(radius: float, touching: float, pressed: float) -> tuple[float, float]:
    """Return the grip, and the friction's arm (m) about the first part's centre.

    `pressed` is in proportion to how far that is from the second part's centre of curvature, and
    `touching` what it is without penetration.
    """
    farthest = max(touching, pressed, 0.0) or 1.0  # at the centre of curvature: no friction
    return max(touching, 0.0) / farthest, radius * max(pressed, 0.0) / farthest


_grips = np.vectorize(grip_of, otypes=[float, float])


def _of_curve(contact: CurveContact, q: FloatArray, v: FloatArray) -> Approach:
    """The gap is the distance from the closest place; an open curve goes on straight on."""
    curve, carrier, side = contact.curve, contact.carrier, contact.side
    position = anchor_position(contact.point, q)
    point = seen_from(carrier, position, q)
    u = curve.closest(point)
    tangent = curve.tangent(u)
    between = point - curve.point(u)
    left = left_of(tangent)
    gap = side * np.sum(left * between, axis=-1) - contact.radius
    place = curve.arc_length.to(u) + np.sum(tangent * between, axis=-1)
    angle = angle_of(carrier, q)
    along, normal = turned(tangent, angle), side * turned(left, angle)
    relative = anchor_velocity(contact.point, q, v) - _carried(carrier, position, q, v)
    first, second = (angle_of(part, v) for part in contact.parts)
    bend = -side * curve.curvature(u)
    touching, pressed = (1 + bend * (contact.radius + off) for off in (0.0, np.minimum(gap, 0.0)))
    grip, arm = _grips(side * contact.radius, touching, pressed)
    slip = grip * np.sum(along * relative, axis=-1) + arm * (first - second)
    return Approach(gap, place, np.sum(normal * relative, axis=-1), slip, normal, along, grip)


def _of_flat(contact: FlatContact, q: FloatArray, v: FloatArray) -> Approach:
    """The face touches, or would first, where the curve reaches farthest towards it."""
    start, end = anchor_position(contact.start, q), anchor_position(contact.end, q)
    along = (end - start) / contact.width
    normal = -contact.side * left_of(along)
    carrier, angle = contact.carrier, angle_of(contact.carrier, q)
    u = contact.search.parameters(turned(normal, -angle))
    position = turned(contact.curve.point(u), angle)
    if carrier != GROUND:
        position = position + q[..., carrier, :2]
    beside = position - start
    mine, other = (_carried(part, position, q, v) for part in contact.parts)
    return Approach(
        -np.sum(normal * beside, axis=-1),
        np.sum(along * beside, axis=-1),
        np.sum(normal * (mine - other), axis=-1),
        np.sum(along * (mine - other), axis=-1),
        normal,
        along,
    )


def _carried(part: int, position: FloatArray, q: FloatArray, v: FloatArray) -> FloatArray:
    """Velocity (..., 2) of a part's material at places (..., 2) of the ground."""
    if part == GROUND:
        return np.zeros_like(position)
    arm, pose_rate = position - q[..., part, :2], v[..., part, :]
    return np.asarray(pose_rate[..., :2] + pose_rate[..., 2:] * left_of(arm))


def _direction(between: FloatArray, relative: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Unit vectors (..., 2) from the second centre to the first, and distances (...), m.

    Concentric circles part the way they move, or along x.
    """
    far = np.hypot(between[..., 0], between[..., 1])
    speed = np.hypot(relative[..., 0], relative[..., 1])
    ahead = np.where((speed > 0)[..., None], relative, np.array([1.0, 0.0]))
    ahead = ahead / np.where(speed > 0, speed, 1.0)[..., None]
    outward = between / np.where(far > 0, far, 1.0)[..., None]
    return np.where((far > 0)[..., None], outward, ahead), far

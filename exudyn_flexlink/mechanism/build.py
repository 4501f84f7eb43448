"""A scene as a mechanism: bodies become rigid parts, names become indices.

Gears, racks and belts get pitch circles and forces of teeth. Stops of joints, ropes and buffers
become contacts; tables and formulas become spring laws; curves get their geometry.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import cos, hypot, nan, pi, sin
from typing import TypeVar

import numpy as np

from exudyn_flexlink import scene as specs
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves import (
    Arc,
    CornerArc,
    Curve,
    CurveError,
    Joined,
    Laps,
    LineSegment,
    Spline,
    Superellipse,
    circle_arc,
    closing,
    curves_of_laps,
    is_convex,
    polygon,
    reach,
    rounded,
)
from exudyn_flexlink.expressions import OF_JOINTS, Expression, Sensed, parse_expression
from exudyn_flexlink.laws import Friction, PressingLaw, SpringDamper, SpringTable
from exudyn_flexlink.mechanism.constraints import (
    anchor_position,
    inertia_with_welded,
    left_of,
    line_of,
)
from exudyn_flexlink.mechanism.contacts import penalty_of, pressing_law
from exudyn_flexlink.mechanism.dynamics import Bodies
from exudyn_flexlink.mechanism.joints import (
    GROUND,
    Anchor,
    Channel,
    CircleContact,
    Contact,
    CurveContact,
    FaceContact,
    FlatContact,
    Gear,
    Geared,
    Groove,
    JointFriction,
    Pin,
    RopeContact,
    Slide,
    Slot,
    SumStop,
    Weld,
)
from exudyn_flexlink.mechanism.model import (
    Held,
    LinearSpring,
    Mechanism,
    Motor,
    Placed,
    PointForce,
    RotarySpring,
    Sense,
    Size,
    Sliding,
    TorqueMotor,
    Turning,
    Until,
)
from exudyn_flexlink.mechanism.prescribed import (
    Formula,
    PlaceTable,
    Ramp,
    SpeedOf,
    SpringLaw,
    Tabled,
)
from exudyn_flexlink.once import once_for_each
from exudyn_flexlink.rounding import NEGLIGIBLE
from exudyn_flexlink.scene import (
    BeltJoint,
    CircleSpec,
    CurveSpec,
    EllipseSpec,
    ForceTable,
    GearJoint,
    JoinedSpec,
    LapsSpec,
    LineOnCurve,
    LineSpec,
    Mesh,
    Piece,
    PointOnCurve,
    PointsJoint,
    PolygonSpec,
    PrismaticJoint,
    RevoluteJoint,
    Scene,
    SlotJoint,
    SplineSpec,
    SuperellipseSpec,
    ends_of,
    meshes_of,
)
from exudyn_flexlink.source import KeyPath, Mistake, SceneError


def build_gears(bodies: Bodies) -> Iterator[Gear]:
    """Return the gears, racks and belts of a scene, in its order; those with play are stops."""
    for name, spec in bodies.scene.joints.items():
        if isinstance(spec, GearJoint | BeltJoint) and not getattr(spec, "backlash", 0.0):
            yield _gear(bodies, name, spec)


def _gear(bodies: Bodies, name: str, spec: GearJoint | BeltJoint) -> Gear:
    joints = bodies.scene.joints
    arm, meshes = meshes_of(joints, spec)
    first_tie, second_tie = (_geared(bodies, arm, mesh) for mesh in meshes)
    first, second = spec.weights((joints[spec.joints[0]], joints[spec.joints[1]]))
    first, second = first * first_tie.side, second * second_tie.side
    if isinstance(spec, BeltJoint):
        return Gear(name, (first_tie, second_tie), (first, second), spec.radii, meshes=False)
    radii, beyond = _radii(spec, first_tie, second_tie), 1.0
    if spec.radius is None and radii[0]:
        first, second = radii[0] * first, radii[0] * second
        beyond = -1.0 if spec.internal and spec.turns > 1 else 1.0
    return Gear(name, (first_tie, second_tie), (first, second), radii, beyond=beyond)


def _geared(bodies: Bodies, arm: str, mesh: Mesh) -> Geared:
    joints = bodies.scene.joints
    near, far = _end(bodies, mesh.hinges[-1], arm), _end(bodies, mesh.joint, mesh.body)
    if isinstance(joints[mesh.joint], PrismaticJoint):
        return Geared(near, far, bodies.slide(mesh.joint), ())
    hinges = tuple((name, _on_second(joints[name], arm, mesh)) for name in mesh.hinges)
    return Geared(near, far, None, hinges)


def _on_second(joint: object, arm: str, mesh: Mesh) -> bool:
    """Whether the second part of a hinge is on the side of the gear."""
    assert isinstance(joint, PointsJoint)  # the scene's names are checked
    first, second = ends_of(joint)
    return first == arm if arm in (first, second) else second == mesh.body


def _end(bodies: Bodies, joint: str, body: str) -> Anchor:
    """Anchor by which a joint holds a body, or the ground."""
    spec = bodies.scene.joints[joint]
    assert isinstance(spec, PointsJoint)  # the scene's names are checked
    return bodies.ends(spec)[ends_of(spec).index(body)]


def _radii(spec: GearJoint, first: Geared, second: Geared) -> tuple[float | None, float | None]:
    """Radii (m) of pitch circles: as given for a pinion, by the distance of axes for gears.

    Gears about the same axis, or on an arm that bends, have none, and neither have racks.
    """
    if first.slide is not None or second.slide is not None:
        return None if first.slide else spec.radius, None if second.slide else spec.radius
    near, beside = first.near, second.near
    apart = hypot(beside.x - near.x, beside.y - near.y)
    both = abs(1.0 - spec.turns) if spec.internal else 1.0 + spec.turns
    size = max(hypot(near.x, near.y), hypot(beside.x, beside.y))
    if near.part != beside.part or apart <= NEGLIGIBLE * size or both == 0:
        return None, None
    return apart / both, apart / both * spec.turns


@dataclass(frozen=True)
class ToothPush:
    """Force (n, 2) of teeth on a part, N, and the hinges from the part to the arm."""

    force: FloatArray
    part: int
    hinges: tuple[tuple[str, bool], ...]


def tooth_pushes(
    gears: Iterable[Gear], forces: Mapping[str, FloatArray], q: FloatArray
) -> list[ToothPush]:
    """Forces of teeth by tangential forces (n,), N, at coordinates (n, parts, 3).

    Belts have none, since their pull on a wheel depends on their tension; gears without a pitch
    circle have none either.
    """
    all_pushes = []
    for gear in gears:
        if not (gear.meshes and gear.in_newtons):
            continue
        force = forces[gear.name][:, None]
        first, second = (
            None if tie.slide is None else weight * tie.side * force * line_of(tie.slide, q)
            for tie, weight in zip(gear.ties, gear.weights, strict=True)
        )
        if first is None:
            first = gear.beyond * force * _across(gear, q) if second is None else -second
        pushes = first, -first if second is None else second
        all_pushes += [
            ToothPush(push, tie.far.part, tie.hinges)
            for push, tie in zip(pushes, gear.ties, strict=True)
        ]
    return all_pushes


def flank_pushes(
    contacts: Iterable[Contact], presses: Mapping[str, FloatArray], q: FloatArray
) -> list[ToothPush]:
    """As `tooth_pushes`, for flanks of gears with play that press with forces `presses` (n,)."""
    pushes = []
    for flank in contacts:
        if isinstance(flank, SumStop) and flank.gear is not None and flank.name in presses:
            forces = {flank.gear.name: flank.tooth_force(presses[flank.name])}
            pushes += tooth_pushes([flank.gear], forces, q)
    return pushes


def _across(gear: Gear, q: FloatArray) -> FloatArray:
    """Directions (n, 2) left of the line from the first gear's axis to the second's."""
    first, second = (anchor_position(tie.far, q) for tie in gear.ties)
    return left_of((second - first) / np.linalg.norm(second - first, axis=-1, keepdims=True))


def without_teeth(joint: str, force: FloatArray, teeth: Iterable[ToothPush]) -> FloatArray:
    """Force (n, 2), N, of a joint on its second point, with forces of teeth on the held part.

    `force` is the force if gears only exert torques.
    """
    for push in teeth:
        for name, on_second in push.hinges:
            if name == joint:
                force = force - push.force if on_second else force + push.force
    return force


FACE = 0.2  # of the longest part: width of a face across a slide in drawings


def stop(bodies: Bodies, name: str, spec: specs.Stop) -> Contact:
    """Return a hinge's stop, a gear's flank, or a face across a slide at a given stroke."""
    way, law = 1.0 if spec.end == "from" else -1.0, pressing_law(bodies.scene, spec.law)
    joint = bodies.scene.joints[spec.joint]
    if isinstance(joint, GearJoint):
        gear = _gear(bodies, spec.joint, joint)
        first, second = gear.weights
        side = gear.ties[-1].side
        weights = first / second * side, side
        return SumStop(name, gear.ties, weights, spec.at - joint.start, way, law, gear)
    if isinstance(joint, RevoluteJoint):
        tie = Geared(*bodies.ends(joint), None, ())
        return SumStop(name, (tie,), (1.0,), spec.at, way, law)
    face = _face_across(bodies, bodies.slide(spec.joint), spec.at)
    return FaceContact(name, *face, -way, law, across=True)


def rope(bodies: Bodies, name: str, spec: specs.LinearSpring | specs.RopeSpring) -> Contact:
    """Return a rope or a buffer: a point in or outside a circle, or a face across a slide."""
    if isinstance(spec, specs.RopeSpring):
        return _rope_over(bodies, name, spec)
    pulls, length = spec.acts == "tension", spec.length or 0.0
    law: PressingLaw = SpringDamper(spec.stiffness, spec.damping, spec.preload)
    if isinstance(spec.force, ForceTable):
        rows = sorted((abs(place - length), abs(force)) for place, force in spec.force.points or ())
        depths, forces = zip(*rows, strict=True)
        law = SpringTable(depths, forces, spec.damping)
    if spec.joint is not None:
        face = _face_across(bodies, bodies.slide(spec.joint), length)
        return FaceContact(name, *face, 1.0 if pulls else -1.0, law, across=True)
    assert spec.points is not None  # the scene checks that one of both is given
    first, second = (bodies.anchor(point, spec.at) for point in spec.points)
    return CircleContact(name, first, second, (0.0, length), pulls, law)


def _rope_over(bodies: Bodies, name: str, spec: specs.RopeSpring) -> RopeContact:
    """Return a rope over points; a length as assembled is not yet known."""
    over = (
        bodies.anchor(entry) if isinstance(entry, str) else Anchor(GROUND, *entry)
        for entry in spec.over
    )
    given = nan if spec.length is None else spec.length
    length = _ramp_or_function(given, 0.0, bodies.scene.initial.clock)
    return RopeContact(name, tuple(over), length, SpringDamper(spec.stiffness, spec.damping))


def _face_across(bodies: Bodies, slide: Slide, place: float) -> tuple[Anchor, Anchor, Anchor]:
    """Return the sliding point, and a face across its line at a length (m), longer to its right."""
    half = FACE / 2 * max(part.reach for part in bodies.parts) or FACE
    along_x, along_y = cos(slide.direction), sin(slide.direction)
    x, y = slide.first.x + place * along_x, slide.first.y + place * along_y
    start, end = (
        Anchor(slide.first.part, x - side * along_y, y + side * along_x) for side in (-half, half)
    )
    return slide.second, start, end


def spring_law(name: str, given: specs.ForceLaw | specs.TorqueLaw | None) -> SpringLaw | None:
    """Return the force of a spring by a table or a formula."""
    if given is None:
        return None
    if isinstance(given, Expression):
        return SpringLaw(Formula(given))
    return SpringLaw(PlaceTable(name, given.points or (), given.rule))


def build_curves(
    specs: Mapping[str, CurveSpec | None],
) -> tuple[dict[str, Curve], list[Mistake]]:
    """Build every named curve; curves that can't be built are left out, with a mistake each.

    Only mistakes of geometry are reported. A curve that contains an invalid (None), unknown or
    cyclic curve, or one that can't be built, is left out without a mistake.
    """
    builder = _CurveBuilder(specs)
    built = {name: builder.named(name) for name in specs}
    return {name: curve for name, curve in built.items() if curve is not None}, builder.mistakes


def hollow_mistakes(scene: Scene, curves: Mapping[str, Curve]) -> Iterator[Mistake]:
    """Refuse curves that a straight face, or a roller in a corner, touches at several places."""
    for name, contact in scene.contacts.items():
        if isinstance(contact, PointOnCurve) and contact.curve in curves:
            side = 1.0 if contact.side == "left" else -1.0
            hollows = [
                piece.radius
                for piece in curves[contact.curve].pieces
                if isinstance(piece, CornerArc) and piece.way == side
            ]
            if hollows and contact.radius >= min(hollows):
                message = f"no smaller than the corners in '{contact.curve}', {min(hollows):g} m"
                hint = "a roller of that radius would touch both sides at once"
                yield Mistake(("contacts", name, "radius"), message, hint)
        if isinstance(contact, LineOnCurve) and contact.curve in curves:
            path, curve = ("contacts", name, "curve"), curves[contact.curve]
            if not curve.closed:
                yield Mistake(path, f"'{contact.curve}' is open: a face lies on a closed curve")
            elif not is_convex(curve):
                message = f"'{contact.curve}' is not convex everywhere, or straight somewhere"
                hint = "a face touches hollows nowhere, and straight stretches all along"
                yield Mistake(path, message, f"{hint}; 'point_on_curve' is for them")


def slot_mistakes(scene: Scene, curves: Mapping[str, Curve]) -> Iterator[Mistake]:
    """Refuse slots with play whose walls have no room beside the curve."""
    for name, joint in scene.joints.items():
        if not isinstance(joint, SlotJoint) or not joint.acting or joint.curve not in curves:
            continue
        half, path = joint.radius + joint.clearance, ("joints", name, "clearance")
        for lap in curves_of_laps(curves[joint.curve]):
            if min(reach(lap, side, half) for side in (1.0, -1.0)) > 0:
                continue
            sharpest = float(np.abs(lap.curvature(lap.samples[0])).max())
            wall = f"a wall of the slot, {half:.6g} m from '{joint.curve}'"
            if half * sharpest >= 1:
                message = f"{wall}, is beyond its smallest radius, {1 / sharpest:.6g} m"
            else:
                message = f"{wall}, meets another one: the curve comes too near to itself there"
            yield Mistake(path, message, "less clearance, a thinner pin, or a wider curve")
            break


class _CurveBuilder:
    """Builds every curve once; a curve under construction counts as None, which ends a cycle."""

    def __init__(self, specs: Mapping[str, CurveSpec | None]) -> None:
        self.specs = specs
        self.built: dict[str, Curve | None] = {}
        self.mistakes: list[Mistake] = []

    def named(self, name: str) -> Curve | None:
        if name not in self.built:
            self.built[name] = None
            self.built[name] = self._build(("curves", name), self.specs.get(name))
        return self.built[name]

    def _inner(self, path: KeyPath, spec: CurveSpec | str) -> Curve | None:
        """Curve that is a piece or a lap of another, written there or named."""
        curve = self.named(spec) if isinstance(spec, str) else self._build(path, spec)
        return None if isinstance(curve, Laps) else curve  # laps have no inner laps

    def _build(self, path: KeyPath, spec: CurveSpec | None) -> Curve | None:
        if spec is None or (isinstance(spec, SplineSpec) and spec.points is None):
            return None  # invalid, or its file of points can't be read
        if not isinstance(spec, (JoinedSpec, LapsSpec)):
            return self._try(path, lambda: _simple(spec), "points")
        key = "pieces" if isinstance(spec, JoinedSpec) else "curves"
        inner = spec.pieces if isinstance(spec, JoinedSpec) else spec.curves
        curves = [self._inner((*path, key, i), piece) for i, piece in enumerate(inner)]
        whole = tuple(curve for curve in curves if curve is not None)
        if len(whole) < len(curves):
            return None
        if isinstance(spec, JoinedSpec):
            radius = spec.round
            return self._try(
                path, lambda: Joined(whole) if radius is None else rounded(whole, radius), key
            )
        return self._try(path, lambda: Laps(whole, meet=spec.meet), key)

    def _try(self, path: KeyPath, make: Callable[[], Curve], key: str = "") -> Curve | None:
        """Make a curve, or record its mistake, with the faulty entry of the list `key`."""
        try:
            return make()
        except CurveError as error:
            key_path = (*path, key, error.piece) if key and error.piece is not None else path
            key_path = (*path, error.key) if error.key else key_path
            self.mistakes.append(Mistake(key_path, error.message, error.hint))
            return None


def _simple(spec: Piece) -> Curve:
    """Build a curve that contains no other.

    Raises:
        CurveError: the curve can't be built.

    """
    if isinstance(spec, EllipseSpec):
        return Arc(spec.centre, spec.semi_axes, spec.rotation, *_angles(spec))
    if isinstance(spec, SuperellipseSpec):
        axes = spec.semi_axes, spec.exponent, spec.rotation
        return Superellipse(spec.centre, *axes, *_angles(spec))
    if isinstance(spec, CircleSpec):
        return circle_arc(spec.centre, spec.radius, *_angles(spec))
    if isinstance(spec, LineSpec):
        return LineSegment(spec.from_, spec.to)
    if isinstance(spec, PolygonSpec):
        return polygon(spec.points, spec.round, closed=spec.closed)
    points, closed = closing(np.reshape(np.array(spec.points, dtype=float), (-1, 2)), spec.closed)
    return Spline(points, closed=closed)


def _angles(spec: EllipseSpec | SuperellipseSpec | CircleSpec) -> tuple[float, float]:
    if spec.from_ is None or spec.to is None:
        return 0.0, 2 * pi
    return spec.from_, spec.to


Spec = TypeVar("Spec")


@once_for_each
def build_mechanism(scene: specs.Scene) -> Mechanism:
    """Turn a scene into rigid parts, joints, springs, drives and contacts.

    Each scene is built once: scene and mechanism are frozen, and every evaluation of a result needs
    the mechanism.

    Raises:
        SceneError: a curve of the scene, or the line of a contact, can't be built.

    """
    bodies = Bodies(scene)
    curves, mistakes = build_curves(scene.curves)
    mistakes += [*bodies.mistakes, *bodies.bent_faces()]
    mistakes += [*hollow_mistakes(scene, curves), *slot_mistakes(scene, curves)]
    if mistakes:
        raise SceneError(scene.document, mistakes)
    joints, springs, drives = scene.joints, scene.springs, scene.drives
    pinned, sleeves = _of(joints, specs.RevoluteJoint), _of(joints, specs.SleeveJoint)
    pins = [Pin(n, *bodies.ends(j)) for n, j in pinned.items() if j.clearance == 0]
    sliding = {n for n, j in sleeves.items() if j.clearance == 0}
    sliding |= set(_of(joints, specs.PrismaticJoint))
    welds = tuple(
        Weld(n, *bodies.ends(j), j.angle or 0.0) for n, j in _of(joints, specs.WeldJoint).items()
    )
    torsional, linear = _of(springs, specs.TorsionalSpring), _of(springs, specs.LinearSpring)
    slotted = _of(joints, specs.SlotJoint)
    slots = {
        n: Slot(n, bodies.anchor(j.point), curves[j.curve], bodies.carrier(j.curve))
        for n, j in slotted.items()
    }
    return Mechanism(
        parts=tuple(bodies.parts),
        points=bodies.points,
        pins=(*pins, *bodies.pins),
        welds=welds,
        slides=(*(bodies.slide(n) for n in joints if n in sliding), *bodies.slides),
        slots=tuple(slot for n, slot in slots.items() if not slotted[n].acting),
        springs=(
            *(_rotary_spring(bodies, n, s, welds) for n, s in torsional.items()),
            *bodies.springs,
        ),
        linear_springs=(
            *(_linear_spring(bodies, n, s) for n, s in linear.items() if n not in scene.ropes),
            *bodies.linear_springs,
        ),
        speed_motors=tuple(
            _motor(bodies, n, d)
            for n, d in drives.items()
            if isinstance(d, (specs.SpeedDrive, specs.MotionDrive))
        ),
        torque_motors=tuple(
            TorqueMotor(n, *bodies.joint_parts(d.joint), _size(bodies, d.value, d.ramp))
            for n, d in _of(drives, specs.TorqueDrive).items()
        ),
        forces=tuple(_force(bodies, n, d) for n, d in _of(drives, specs.ForceDrive).items()),
        contacts=(
            *(_contact(bodies, n, c, curves) for n, c in scene.contacts.items()),
            *(stop(bodies, n, limits) for n, limits in scene.stops.items()),
            *(rope(bodies, n, spec) for n, spec in scene.ropes.items()),
        ),
        bearings=tuple(_bearing(bodies, n, j, j.acting) for n, j in pinned.items() if j.acting),
        channels=tuple(_channel(bodies, n, j, j.acting) for n, j in sleeves.items() if j.acting),
        gravity=scene.gravity,
        frictions=tuple(_joint_frictions(bodies)),
        gears=tuple(build_gears(bodies)),
        grooves=tuple(
            _groove(scene, slots[n], j, j.acting) for n, j in slotted.items() if j.acting
        ),
        until=_until(bodies),
    )


def _of(named: Mapping[str, object], kind: type[Spec]) -> dict[str, Spec]:
    """The items of one kind, by name, in order."""
    return {name: item for name, item in named.items() if isinstance(item, kind)}


def _bearing(
    bodies: Bodies, name: str, joint: specs.RevoluteJoint, law: specs.PenaltyLaw
) -> CircleContact:
    """Return a journal in its bearing; without a radius the journal is a point."""
    radius = joint.radius or 0.0
    return CircleContact(
        name,
        *bodies.ends(joint),
        (radius, radius + joint.clearance),
        inside=True,
        law=penalty_of(bodies.scene, law, (radius, -radius - joint.clearance)),
        friction=_friction(law),
    )


def _channel(bodies: Bodies, name: str, joint: specs.SleeveJoint, law: specs.PenaltyLaw) -> Channel:
    start, end = bodies.anchor(f"{joint.guide}.start"), bodies.anchor(f"{joint.guide}.end")
    first, last = bodies.first_part(joint.link), bodies.anchor(f"{joint.link}.end")
    rods = tuple(range(first, last.part + 1))
    lengths = (*(bodies.parts[rod].reach for rod in rods[:-1]), last.x)
    return Channel(
        name,
        start,
        end.x - start.x,
        joint.clearance,
        rods,
        lengths,
        penalty_of(bodies.scene, law),
        _friction(law),
    )


def _groove(
    scene: specs.Scene, slot: Slot, joint: SlotJoint, law: specs.PenaltyLaw | specs.RubbingImpulse
) -> Groove:
    pressing, lap = pressing_law(scene, law), scene.initial.laps.get(slot.name, 1)
    return Groove(slot, joint.clearance, joint.radius, pressing, _friction(law), lap)


FREE_WAYS = {"forward": 1, "backward": -1}


def _joint_frictions(bodies: Bodies) -> Iterator[JointFriction]:
    """Yield the friction of pins and slides, and freewheels."""
    for name, joint in bodies.scene.joints.items():
        if isinstance(joint, specs.RevoluteJoint):
            friction = joint.friction or specs.PinFriction(torque=0.0)
            if friction.acts or joint.freewheel:
                share = friction.coefficient * (friction.radius or 0.0)
                one_way = 0 if joint.freewheel is None else FREE_WAYS[joint.freewheel]
                sizes = friction.torque, share, friction.slip_speed, one_way
                yield JointFriction(name, Pin(name, *bodies.ends(joint)), *sizes)
        elif isinstance(joint, specs.PrismaticJoint) and joint.friction and joint.friction.acts:
            along = joint.friction
            yield JointFriction(
                name, bodies.slide(name), along.force, along.coefficient, along.slip_speed
            )


# --- springs and contacts ------------------------------------------------------------


def _rotary_spring(
    bodies: Bodies, name: str, spring: specs.TorsionalSpring, welds: Sequence[Weld]
) -> RotarySpring:
    """Return a spring and damper at a revolute joint.

    A frequency or damping ratio is that of the body at the joint, with all bodies welded to it.
    """
    first, second = bodies.joint_parts(spring.joint)
    stiffness, damping = spring.stiffness or 0.0, spring.damping or 0.0
    if spring.frequency is not None or spring.damping_ratio is not None:
        inertia = inertia_with_welded(_moving_end(bodies, spring.joint), bodies.parts, welds)
        if spring.frequency is not None:
            stiffness = inertia * (2 * pi * spring.frequency) ** 2
        if spring.damping_ratio is not None:
            damping = 2 * spring.damping_ratio * (stiffness * inertia) ** 0.5
    law = spring_law(name, spring.torque)
    return RotarySpring(name, first, second, stiffness, damping, spring.rest_angle, law)


def _linear_spring(bodies: Bodies, name: str, spec: specs.LinearSpring) -> LinearSpring:
    """Return a spring and damper between two points, or along a prismatic joint."""
    stiffness, damping, length = spec.stiffness, spec.damping, spec.length
    law = spring_law(name, spec.force)
    if spec.joint is None:
        assert spec.points is not None  # the scene checks that one of both is given
        first, second = (bodies.anchor(point, spec.at) for point in spec.points)
        return LinearSpring(name, first, second, stiffness, damping, length, law=law)
    slide = bodies.slide(spec.joint)
    return LinearSpring(name, slide.first, slide.second, stiffness, damping, length, slide, law)


def _contact(
    bodies: Bodies, name: str, contact: specs.Contact, curves: Mapping[str, Curve]
) -> Contact:
    """Return a point and a face or a curve, or two circles, that may strike each other."""
    radii = contact.radii if isinstance(contact, specs.CircleOnCircle) else None
    laws = pressing_law(bodies.scene, contact.law, radii), _friction(contact.law)
    if isinstance(contact, specs.CircleOnCircle):
        first, second = contact.inner_and_outer
        return CircleContact(
            name,
            bodies.anchor(first.at, first.place),
            bodies.anchor(second.at, second.place),
            (first.radius, second.radius),
            second.inside,
            *laws,
        )
    side = 1.0 if contact.side == "left" else -1.0
    if isinstance(contact, specs.LineOnCurve):
        curve, carrier = curves[contact.curve], bodies.carrier(contact.curve)
        return FlatContact(name, *bodies.face(contact), side, curve, carrier, *laws)
    point = bodies.anchor(contact.point)
    if isinstance(contact, specs.PointOnCurve):
        curve, carrier = curves[contact.curve], bodies.carrier(contact.curve)
        return CurveContact(name, point, curve, carrier, side, contact.radius, *laws)
    return FaceContact(name, point, *bodies.face(contact), side, *laws)


def _friction(law: specs.PenaltyLaw | specs.RubbingImpulse) -> Friction | None:
    """Return the friction of a law; None if it has none."""
    if law.friction == 0:
        return None
    return Friction(law.friction, law.slip_speed)


def _moving_end(bodies: Bodies, joint: str) -> Anchor:
    """Point by which a joint of the scene holds a body on the ground."""
    end = bodies.scene.joints[joint]
    assert isinstance(end, specs.RevoluteJoint)
    return next(anchor for anchor in bodies.ends(end) if anchor.part != GROUND)


# --- drives ------------------------------------------------------------

TimeFunction = Formula | Tabled


def _motor(bodies: Bodies, name: str, drive: specs.SpeedDrive | specs.MotionDrive) -> Motor:
    """Return a drive that prescribes the motion of a joint."""
    slide, clock = None, bodies.scene.initial.clock
    if isinstance(bodies.scene.joints[drive.joint], specs.RevoluteJoint):
        first, second = bodies.joint_parts(drive.joint)
    else:
        slide = bodies.slide(drive.joint)
        first, second = slide.first.part, slide.second.part
    if isinstance(drive, specs.SpeedDrive):
        function = _ramp_or_function(drive.value, drive.ramp, clock)
        return Motor(name, first, second, function, slide=slide)
    value = drive.value
    motion = _function(parse_expression(repr(value)) if isinstance(value, float) else value, clock)
    return Motor(name, first, second, SpeedOf(motion), motion.at(0.0), slide)


def _force(bodies: Bodies, name: str, drive: specs.ForceDrive) -> PointForce:
    """Return a force at a point."""
    point = bodies.anchor(drive.point)
    axes = GROUND
    if drive.axes == specs.split_point(drive.point)[0]:
        axes = point.part
    elif drive.axes in bodies.scene.bodies:
        axes = bodies.first_part(drive.axes)
    x, y = (_size(bodies, value) for value in drive.value)
    return PointForce(name, point, axes, (x, y))


def _size(bodies: Bodies, value: specs.Value, ramp: float = 0.0) -> Size:
    sensed = value.sensed if isinstance(value, Expression) else ()
    function = _ramp_or_function(value, ramp, bodies.scene.initial.clock)
    return Size(function, tuple(_sense(bodies, sense) for sense in sensed))


def _until(bodies: Bodies) -> Until | None:
    """The formula that ends the run, if any."""
    _, formula = bodies.scene.ending
    if formula is None:
        return None
    senses = (
        _held(bodies, sensed) if sensed.kind in OF_JOINTS else _sense(bodies, sensed)
        for sensed in formula.sensed
    )
    return Until(Formula(formula, bodies.scene.initial.clock), tuple(senses))


def _held(bodies: Bodies, sensed: Sensed) -> Held:
    if sensed.kind == "force":
        return Held(sensed.of, is_torque=False)
    return Held(sensed.of, is_torque=True, drives=bodies.scene.drives_of(sensed.of))


def _ramp_or_function(value: specs.Value, ramp: float, clock: float) -> Ramp | TimeFunction:
    """Value of a drive by time; a run that goes on from another begins after the ramp."""
    if isinstance(value, float):
        return Ramp(value, 0.0 if clock > 0 else ramp)
    return _function(value, clock)


def _function(value: Expression | specs.Table, clock: float) -> TimeFunction:
    """Function of a drive; its t is `clock` (s) at the begin of the run."""
    if isinstance(value, Expression):
        return Formula(value, clock)
    assert value.points is not None  # its file was read
    return Tabled(value.points, value.rule, clock)


def _sense(bodies: Bodies, sensed: Sensed) -> Sense:
    if sensed.axis:
        return Placed(bodies.anchor(sensed.of), "xy".index(sensed.axis))
    if not isinstance(bodies.scene.joints[sensed.of], specs.RevoluteJoint):
        return Sliding(bodies.slide(sensed.of), sensed.kind == "speed")
    return Turning(*bodies.joint_parts(sensed.of), sensed.kind == "speed")

"""Lines and marks of a mechanism, and a sketch of a mechanism in some poses.

Lines and marks are points in the axes of parts, so they are equal at every instant. Figures and
animations draw a mechanism with these only. A `Sketch` draws bodies, the path of the point S and
named points into axes.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.mechanism import (
    GROUND,
    Anchor,
    Channel,
    CircleContact,
    Contact,
    CurveContact,
    FaceContact,
    FlatContact,
    Gear,
    Groove,
    Mechanism,
    RopeContact,
    Slot,
    SumStop,
    anchor_position,
    angle_of,
    build_mechanism,
    left_of,
    turned,
)
from exudyn_flexlink.observables import point_anchor, watched_point
from exudyn_flexlink.plots.frame import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, RED
from exudyn_flexlink.plots.panels import BAND, BEYOND_LINE, horizon, length_unit, sized
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import (
    FlexibleBody,
    ForceDrive,
    PointOnLine,
    PrismaticJoint,
    RigidBody,
    RodBody,
    Scene,
    SleeveJoint,
    TorsionalSpring,
    split_point,
)

ROUND = 73  # points of a circle; the last equals the first
COILS = 6  # coils of a linear spring
_BODY_COLOURS = ("#9A9A9A", BLUE, RED, GREEN, PURPLE, ORANGE)
RAY = 0.4  # of the reach of the turning part: length of the ray at a hinge's stop
MARGIN = 0.05  # of the larger side of the picture: margin
THINNEST = 0.3  # of its larger side: smallest height, for mechanisms that move along a line


@dataclass(frozen=True)
class Line:
    """A line through points of parts: `parts` (n,), `places` (n, 2) m in their axes.

    `name` is the name of its body, curve, joint or contact in the scene. The line of a spring has
    only the two ends.
    """

    name: str
    parts: IndexArray
    places: FloatArray

    def at(self, poses: FloatArray) -> FloatArray:
        """Return its points (..., n, 2) m, with the parts at `poses` (..., parts, 3)."""
        # The ground has the index -1: the row after all parts.
        pose = np.concatenate([poses, np.zeros_like(poses[..., :1, :])], axis=-2)
        posed = pose[..., self.parts, :]
        return np.asarray(posed[..., :2] + turned(self.places, posed[..., 2]))


@dataclass(frozen=True)
class Drawn:
    """A line and its `kind`, which decides its look in a `Sketch` or an animation."""

    kind: str
    colour: str
    line: Line


@dataclass(frozen=True)
class Mark:
    """A symbol at a point of a part; `kind` names what it stands for."""

    kind: str
    anchor: Anchor


@dataclass(frozen=True)
class Viewpoint:
    """Axes of a view: an origin, and the angle (rad) of the x-axis to that of the origin's part."""

    origin: Anchor
    angle: float = 0.0

    def seen(self, points: FloatArray, poses: FloatArray) -> FloatArray:
        """Transform points (..., n, 2) m of the ground into its axes, with the parts at `poses`."""
        away = points - anchor_position(self.origin, poses)[..., None, :]
        angle = self.angle + angle_of(self.origin.part, poses)
        return np.asarray(turned(away, -np.asarray(angle)[..., None]))


def through(name: str, *anchors: Anchor) -> Line:
    """Return the line through anchors."""
    parts = np.array([anchor.part for anchor in anchors], dtype=np.intp)
    return Line(name, parts, np.array([[anchor.x, anchor.y] for anchor in anchors]))


def on_part(name: str, part: int, places: FloatArray) -> Line:
    """Return a line through places (n, 2) m of one part."""
    return Line(name, np.full(len(places), part, dtype=np.intp), places)


def body_lines(scene: Scene, model: Mechanism, body: str) -> list[Line]:
    """Return the lines of a body: its rods, or rays from its centre to its points."""
    spec = scene.bodies[body]
    if isinstance(spec, RigidBody):
        centre = point_anchor(scene, model, f"{body}.centre")
        others = [point_anchor(scene, model, f"{body}.{name}") for name in spec.points]
        return [through(body, centre, other) for other in others] or [through(body, centre)]
    starts = [Anchor(part, 0.0, 0.0) for part in model.bodies[body]]
    return [through(body, *starts, point_anchor(scene, model, f"{body}.end"))]


def drawn_lines(scene: Scene, model: Mechanism) -> Iterator[Drawn]:
    """Yield all lines of the mechanism; bodies come last, in their order."""
    on_curves = [
        contact for contact in model.contacts if isinstance(contact, (CurveContact, FlatContact))
    ]
    tracks: list[Slot | CurveContact | FlatContact] = [*model.slots, *on_curves]
    for track in tracks:
        yield Drawn("curve", PURPLE, on_part(track.name, track.carrier, track.curve.samples[1]))
    for groove in model.grooves:
        yield from (Drawn("curve", PURPLE, wall) for wall in slot_walls(groove))
    yield from _drawn_faces(scene, model)
    way = np.linspace(0, 2 * np.pi, ROUND)
    around = np.stack([np.cos(way), np.sin(way)], axis=1)
    circular = [contact for contact in model.contacts if contact.name not in scene.ropes]
    circles = [(contact.name, *circle) for contact in circular for circle in circles_of(contact)]
    circles += [(gear.name, *circle) for gear in model.all_gears for circle in pitch_circles(gear)]
    circles += [(g.name, g.slot.anchor, g.radius) for g in model.grooves if g.radius > 0]
    for name, centre, radius in circles:
        ring = on_part(name, centre.part, [centre.x, centre.y] + radius * around)
        yield Drawn("ring", GREY, ring)
    for name, centre, radius in circles:
        if centre.part != GROUND:  # a radius shows that a circle turns
            edge = Anchor(centre.part, centre.x + radius, centre.y)
            yield Drawn("spoke", GREY, through(name, centre, edge))
    for gear in model.all_gears:
        yield from (Drawn("ring", GREY, strand) for strand in strands(gear))
    for spring in model.linear_springs:
        if spring.name in scene.springs:  # not springs in rods that stretch
            yield Drawn("spring", GREEN, through(spring.name, spring.first, spring.second))
    for body in scene.bodies:
        yield from _drawn_body(scene, model, body)


def _drawn_faces(scene: Scene, model: Mechanism) -> Iterator[Drawn]:
    """Yield the lines of faces, stops and ropes."""
    for contact in model.contacts:
        if isinstance(contact, (FaceContact, FlatContact)):
            kind = "face" if contact.name in scene.contacts else "stop"
            kind, colour = ("rope", GREEN) if contact.name in scene.ropes else (kind, RED)
            yield Drawn(kind, colour, through(contact.name, contact.start, contact.end))
        elif isinstance(contact, SumStop) and contact.gear is None:
            yield Drawn("stop", RED, through(contact.name, *stop_ray(model, contact)))
        elif contact.name in scene.ropes and isinstance(contact, CircleContact):
            yield Drawn("rope", GREEN, through(contact.name, contact.first, contact.second))
        elif isinstance(contact, RopeContact):
            yield Drawn("rope", GREEN, through(contact.name, *contact.over))


def _drawn_body(scene: Scene, model: Mechanism, body: str) -> Iterator[Drawn]:
    """Yield the lines of a body; a guide has its walls if it has clearance, else a pale line."""
    body_parts = model.bodies[body]
    walls = [w for c in walled(model) if c.guide.part in body_parts for w in wall_lines(model, c)]
    if walls:
        kind, colour = "wall", "#A9A9A9"
    elif is_guide(scene, body):
        kind, colour = "guide", "#C9C9C9"
    else:
        flexible = isinstance(scene.bodies[body], FlexibleBody)
        kind, colour = "link" if flexible else "bar", body_colour(scene, body)
    yield from (Drawn(kind, colour, line) for line in walls or body_lines(scene, model, body))


def body_colour(scene: Scene, body: str) -> str:
    """Return the colour of a body that is no guide."""
    return _BODY_COLOURS[list(scene.bodies).index(body) % len(_BODY_COLOURS)]


def is_guide(scene: Scene, body: str) -> bool:
    """Whether a body is the guide of a link."""
    joints = scene.joints.values()
    return any(isinstance(joint, SleeveJoint) and joint.guide == body for joint in joints)


def walled(model: Mechanism) -> list[Channel]:
    """Return the guides with clearance; figures show their two walls."""
    return [channel for channel in model.channels if channel.clearance > 0]


def wall_lines(model: Mechanism, channel: Channel) -> list[Line]:
    """Return both walls of a guide, the upper wall first."""
    anchor, body = channel.guide, model.parts[channel.guide.part].body
    return [
        through(
            body,
            Anchor(anchor.part, anchor.x, y),
            Anchor(anchor.part, anchor.x + channel.length, y),
        )
        for y in (anchor.y + channel.clearance, anchor.y - channel.clearance)
    ]


def slot_walls(groove: Groove) -> list[Line]:
    """Return the walls of a slot with play, left and right of each of its curves."""
    half, lines = groove.radius + groove.clearance, []
    for curve in groove.curves:
        u, middle = curve.samples
        for across in (half, -half):
            places = middle + across * curve.normal(u)
            lines.append(on_part(groove.name, groove.slot.carrier, places))
    return lines


def circles_of(contact: Contact) -> list[tuple[Anchor, float]]:
    """Return the centres and radii (m) of a contact's circles, or of its roller."""
    if isinstance(contact, CircleContact):
        return [(contact.first, contact.radii[0]), (contact.second, contact.radii[1])]
    if isinstance(contact, CurveContact) and contact.radius > 0:
        return [(contact.point, contact.radius)]
    return []


def pitch_circles(gear: Gear) -> list[tuple[Anchor, float]]:
    """Return centres and radii (m) of a gear's pitch circles, or of a belt's wheels, if known."""
    ties = zip(gear.ties, gear.radii, strict=True)
    return [(tie.far, radius) for tie, radius in ties if radius is not None]


def strands(gear: Gear) -> Iterator[Line]:
    """Yield both strands of a belt, tangents outside its wheels; nothing for gears in mesh."""
    (first, second), (first_radius, second_radius) = (tie.near for tie in gear.ties), gear.radii
    apart = complex(second.x - first.x, second.y - first.y)
    if (
        gear.meshes
        or first_radius is None
        or second_radius is None
        or abs(apart) <= abs(first_radius - second_radius)
    ):
        return
    lean = np.arccos((first_radius - second_radius) / abs(apart))
    for side in (1.0, -1.0):
        way = apart / abs(apart) * np.exp(1j * side * lean)
        ends = (
            complex(first.x, first.y) + first_radius * way,
            complex(second.x, second.y) + second_radius * way,
        )
        yield on_part(gear.name, first.part, np.array([[end.real, end.imag] for end in ends]))


def faces(model: Mechanism) -> list[FaceContact]:
    """Return the contacts of a point with a face."""
    return [contact for contact in model.contacts if isinstance(contact, FaceContact)]


def stop_ray(model: Mechanism, stop: SumStop) -> tuple[Anchor, Anchor]:
    """Return the ends of a short ray at a hinge's stop.

    The ray starts at the hinge. It shows where the centre of the turning part is at the stop, or
    where its x-axis points.
    """
    base, moving, angle = stop.ties[0].near, stop.point, stop.bound
    if moving.part == GROUND:
        base, moving, angle = moving, base, -angle
    part = model.parts[moving.part]
    away = complex(*part.centre) - complex(moving.x, moving.y)
    tip = RAY * part.reach * np.exp(1j * (angle + np.angle(away)))
    return base, Anchor(base.part, base.x + tip.real, base.y + tip.imag)


def coil(ends: FloatArray) -> FloatArray:
    """Return the zigzag (..., points, 2) m of a spring between its ends (..., 2, 2)."""
    along = np.concatenate([[0.0, 0.15], np.linspace(0.2, 0.8, 2 * COILS), [0.85, 1.0]])
    across = np.zeros(len(along))
    across[2:-2] = 0.06 * (-1.0) ** np.arange(2 * COILS)
    first, way = ends[..., :1, :], ends[..., 1:, :] - ends[..., :1, :]
    return np.asarray(first + along[:, None] * way + across[:, None] * left_of(way))


def pivots(model: Mechanism) -> list[Anchor]:
    """Return the points of the ground about which parts turn."""
    ends = [end for pin in model.hinges for end in (pin.first, pin.second)]
    return [end for end in ends if end.part == GROUND]


def joint_marks(scene: Scene, model: Mechanism) -> Iterator[Mark]:
    """Yield a mark for every joint."""
    for pin in model.hinges:
        grounded = GROUND in (pin.first.part, pin.second.part)
        if pin.name in scene.joints:  # not hinges of a flexible body
            yield Mark(f"revolute{', on the ground' * grounded}", pin.first)
    for weld in model.welds:
        grounded = GROUND in (weld.first.part, weld.second.part)
        yield Mark(f"weld{', to the ground' * grounded}", weld.first)
    for slide in model.slides:
        if isinstance(scene.joints.get(slide.name), PrismaticJoint):  # not rods that stretch
            yield Mark("prismatic", slide.second)
    for slot in model.all_slots:
        yield Mark("in a slot", slot.anchor)


def acting_marks(scene: Scene, model: Mechanism) -> Iterator[Mark]:
    """Yield a mark for every torsional spring, drive and point that may strike."""
    places = {hinge.name: hinge.first for hinge in model.hinges}
    places |= {slide.name: slide.second for slide in model.slides}
    for spring in scene.springs.values():
        if isinstance(spring, TorsionalSpring):
            yield Mark("torsional spring", places[spring.joint])
    for drive in scene.drives.values():
        if isinstance(drive, ForceDrive):
            yield Mark("force", point_anchor(scene, model, drive.point))
        else:
            yield Mark("drive", places[drive.joint])
    for face in faces(model):
        yield Mark("point that may strike", face.point)


def lettered(scene: Scene) -> dict[str, str]:
    """Return rods with the paper's letters: CD, the only guide, and BE, the only struck lever.

    Empty without a guide: then the paper's letters do not suit the mechanism.
    """
    guides = {joint.guide for joint in scene.joints.values() if isinstance(joint, SleeveJoint)}
    lines = [
        contact.line for contact in scene.contacts.values() if isinstance(contact, PointOnLine)
    ]
    levers = {split_point(end)[0] for line in lines for end in line} if guides else set()
    return {
        letters: name
        for letters, names in (("CD", guides), ("BE", levers))
        for name in names
        if len(names) == 1 and isinstance(scene.bodies[name], RodBody)
    }


def named_points(scene: Scene, model: Mechanism) -> dict[str, Anchor]:
    """Return points with the paper's names: S (watched), O, P in the only slot, ends of rods."""
    anchors = {"S": point_anchor(scene, model, watched_point(scene)), "O": Anchor(GROUND, 0.0, 0.0)}
    if len(model.all_slots) == 1 and model.all_slots[0].anchor != anchors["S"]:
        anchors["P"] = model.all_slots[0].anchor
    for letters, body in lettered(scene).items():
        for name, end in zip(letters, ("start", "end"), strict=True):
            anchors[name] = point_anchor(scene, model, f"{body}.{end}")
    return anchors


def together(places: Mapping[str, FloatArray], near: float) -> dict[str, list[str]]:
    """Group the names of places (2,) m nearer than `near` (m), by the first name of each group."""
    names: dict[str, list[str]] = {}
    for name, place in places.items():
        beside = (first for first in names if np.max(np.abs(places[first] - place)) < near)
        names.setdefault(next(beside, name), []).append(name)
    return names


def box_around(
    points: Iterable[FloatArray], below: float = MARGIN
) -> tuple[FloatArray, FloatArray]:
    """Return the lower left and upper right corner (2,) m of a box around points (..., 2) m.

    The box has a margin. The margin `below` may be larger; it is a part of the box's size.
    """
    all_points = np.concatenate([point.reshape(-1, 2) for point in points])
    low, high = all_points.min(axis=0), all_points.max(axis=0)
    size = float(np.max(high - low)) or 1.0
    thin = np.maximum(THINNEST * size - (high - low), 0.0) / 2
    return low - thin - np.array([MARGIN, below]) * size, high + thin + MARGIN * size


BODIES = ("wall", "guide", "bar", "link")  # kinds of the lines of bodies
SHOWN = ("curve", "ring", "rope", "stop", *BODIES)
LABELLED = {"curve": "", "stop": "stop", "rope": "rope or buffer"}
_MARKS = {"O": "+", "P": "s", "S": "o"}


@dataclass(frozen=True)
class Sketch:
    """A scene's mechanism in poses (N, parts, 3): x, y (m) and angle (rad) of every part.

    With a `result` it also has the path of the watched point S.
    """

    scene: Scene
    poses: FloatArray
    result: Result | None = None

    @cached_property
    def model(self) -> Mechanism:
        """Mechanism of the scene."""
        return build_mechanism(self.scene)

    @cached_property
    def track(self) -> FloatArray:
        """Path (N, 2) of the watched point S, m."""
        anchor = point_anchor(self.scene, self.model, watched_point(self.scene))
        return np.asarray(anchor_position(anchor, self.poses))

    @cached_property
    def box(self) -> tuple[FloatArray, FloatArray]:
        """Lower left and upper right corner (2,) m of the drawing, with a margin."""
        some = self.poses[:: max(1, len(self.poses) // 200)]
        points = [drawn.line.at(some) for drawn in self.shown]
        points += [np.array([anchor.x, anchor.y]) for anchor in pivots(self.model)]
        return box_around([self.track, *points])

    @cached_property
    def shown(self) -> list[Drawn]:
        """Lines of curves, bodies, circles, ropes and stops."""
        return self.drawn(SHOWN)

    def drawn(self, kinds: Collection[str]) -> list[Drawn]:
        """Return the lines of some kinds."""
        return [line for line in drawn_lines(self.scene, self.model) if line.kind in kinds]

    @cached_property
    def unit(self) -> tuple[float, str]:
        """Factor from m to the unit of lengths, and the unit's name."""
        low, high = self.box
        return length_unit(high - low)

    def window(self, axes: Axes, box: tuple[FloatArray, FloatArray]) -> None:
        """Set the limits of axes to a box, given by its corners (2,) m."""
        low, high = (self.unit[0] * corner for corner in box)
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        axes.set_aspect("equal")

    def lines(self, body: str, index: int) -> list[FloatArray]:
        """Return polylines (points, 2) m of a body at a sample: its rods, or rays to its points."""
        outline = body_lines(self.scene, self.model, body)
        return [line.at(self.poses[index]) for line in outline]

    def draw(self, axes: Axes, index: int, alpha: float = 1.0) -> None:
        """Draw curves, bodies and pivots on the ground at a sample."""
        factor, q = self.unit[0], self.poses[index]
        for path in self.shown:
            axes.plot(*(factor * path.line.at(q)).T, **_look(self.scene, path), alpha=alpha)
        for anchor in pivots(self.model):
            axes.plot(factor * anchor.x, factor * anchor.y, "^", color=BLACK, mfc="white",
                      markersize=sized(7), zorder=5)  # fmt: skip

    def body_legend(self, letters: Mapping[str, str] | None = None) -> list[Line2D]:
        """Return legend entries of bodies, guides and curves; `letters` follow names of bodies."""
        curve = "track" if self.model.all_slots else "curve"
        bodies, curves = {}, {}
        for path in self.shown:
            look, body = _look(self.scene, path), path.line.name
            if path.kind in BODIES:
                text = f"{body} {(letters or {}).get(body, '')}".rstrip()
                label = f"walls of {text}" if path.kind == "wall" else text
                bodies[body] = Line2D([], [], label=label, **look)
            elif path.kind in LABELLED:
                curves[path.kind] = Line2D([], [], label=LABELLED[path.kind] or curve, **look)
        return [*bodies.values(), *curves.values()]

    def draw_path(self, axes: Axes, done: slice) -> None:
        """Draw the path of S; the samples `done` are black."""
        factor, _ = self.unit
        axes.plot(*(factor * self.track).T, color=GREY, linewidth=sized(0.7), zorder=1)
        axes.plot(*(factor * self.track[done]).T, color=BLACK, linewidth=sized(1.0), zorder=2)
        if self.result is not None and (extent := horizon(self.result)) is not None:
            beyond = self.track[self.result.time >= extent[0]]
            axes.plot(*(factor * beyond).T, **BEYOND_LINE, linewidth=sized(BAND))

    def letters(self, index: int) -> dict[str, FloatArray]:
        """Return the places (2,) m at a sample of points with the paper's names, by name."""
        anchors = named_points(self.scene, self.model)
        return {
            name: anchor_position(anchor, self.poses[index]) for name, anchor in anchors.items()
        }

    def mark_points(self, axes: Axes, index: int) -> None:
        """Mark S, O and P at a sample; S lies in front."""
        for name, place in self.letters(index).items():
            if name in _MARKS:
                axes.plot(*self.unit[0] * place, **_mark(name), zorder=7 if name == "S" else 6)

    def legend(self) -> list[Line2D]:
        """Return legend entries of all that is drawn."""
        scene, model = self.scene, self.model
        handles = self.body_legend({body: pair for pair, body in lettered(scene).items()})
        labels = {"S": f"S: {watched_point(scene)}, path", "P": "P: in the slot", "O": "O: origin"}
        for name in (name for name in labels if name in named_points(scene, model)):
            line = "-" if name == "S" else ""
            look = {**_mark(name), "linestyle": line, "linewidth": 1.0}
            handles.append(Line2D([], [], label=labels[name], **look))
        if pivots(model):
            pivot: dict[str, Any] = {"marker": "^", "color": BLACK, "mfc": "white", "linestyle": ""}
            handles.append(Line2D([], [], label="pivot on the ground", **pivot))
        if self.result is not None and (beyond := horizon(self.result)) is not None:
            handles.append(Line2D([], [], label=beyond[1], **BEYOND_LINE, linewidth=sized(BAND)))
        return handles


def _mark(name: str) -> dict[str, Any]:
    """Return the look of a point's mark; P is open and larger, so that it never hides S."""
    open_or_full = {"mfc": "white", "markersize": sized(7)} if name == "P" else {}
    return {"marker": _MARKS[name], "color": BLACK, "markersize": sized(4), **open_or_full}


def _look(scene: Scene, line: Drawn) -> dict[str, Any]:
    """Return the look of a line; points of rigid bodies and hinges are dots."""
    looks: dict[str, dict[str, Any]] = {
        "curve": {"linewidth": 1.0, "zorder": 1},
        "wall": {"linewidth": 2.0, "zorder": 2},
        "guide": {"linewidth": sized(7), "solid_capstyle": "butt", "zorder": 2},
        "ring": {"linewidth": sized(1.2), "zorder": 3},
        "stop": {"linewidth": sized(2.2), "zorder": 3},
        "rope": {"linewidth": sized(1.2), "zorder": 3},
        "bar": {"linewidth": sized(2.2), "zorder": 4},
        "link": {"linewidth": 1.5, "marker": ".", "markersize": sized(3), "zorder": 4},
    }
    if line.kind == "bar" and isinstance(body := scene.bodies[line.line.name], RigidBody):
        looks["bar"] |= {"marker": "o", "markersize": sized(4)}
        if len(body.points) <= 1 and not np.ptp(line.line.places, axis=0).any():
            # The mark of a body without extent is larger than the mark of its point.
            looks["bar"] |= {"marker": "s", "markersize": sized(9)}
    return {"color": line.colour, **looks[line.kind]}

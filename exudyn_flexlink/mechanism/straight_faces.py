"""Straight faces of contacts: points that strike them, and curves on which they lie."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from exudyn_flexlink import scene as specs
from exudyn_flexlink.curves import Curve, is_convex
from exudyn_flexlink.mechanism.bodies import Bodies
from exudyn_flexlink.mechanism.parts import Anchor
from exudyn_flexlink.scene import split_point
from exudyn_flexlink.source import Mistake


def hollow_mistakes(scene: specs.Scene, curves: Mapping[str, Curve]) -> Iterator[Mistake]:
    """Refuse curves on which a straight face would have no one place, or an end."""
    for name, contact in scene.contacts.items():
        if isinstance(contact, specs.LineOnCurve) and contact.curve in curves:
            path, curve = ("contacts", name, "curve"), curves[contact.curve]
            if not curve.closed:
                yield Mistake(path, f"'{contact.curve}' is open: a face lies on a closed curve")
            elif not is_convex(curve):
                message = f"'{contact.curve}' is not convex everywhere, or straight somewhere"
                hint = "a face touches hollows nowhere, and straight stretches all along"
                yield Mistake(path, message, f"{hint}; 'point_on_curve' is for them")


def line_mistakes(bodies: Bodies) -> Iterator[Mistake]:
    """Refuse lines of contacts that are no straight faces: that bend, or have no length."""
    for name, contact in bodies.scene.contacts.items():
        if not isinstance(contact, (specs.PointOnLine, specs.LineOnCurve)):
            continue
        path = ("contacts", name, "line")
        start, end = ends_of(bodies, contact)
        if start.part != end.part:
            body = split_point(contact.line[0])[0]
            own = range(bodies.first_part(body), min(start.part, end.part) + 1)
            place = sum(bodies.parts[part].reach for part in own)
            message = f"'{body}' gives way at {place:g} m, between the two points"
            yield Mistake(path, message, "a face is straight: take both on one side of that place")
        elif (start.x, start.y) == (end.x, end.y):
            yield Mistake(path, "both points are at one place: a line needs a length")


def ends_of(
    bodies: Bodies, contact: specs.PointOnLine | specs.LineOnCurve
) -> tuple[Anchor, Anchor]:
    """Both ends of a face, on one part if there is one that has both."""
    start, end = (bodies.anchor(point) for point in contact.line)
    return bodies.on_one_rod(start, end)

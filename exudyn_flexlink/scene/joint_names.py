"""Whether the names in curves and joints lead to parts of the kind that is needed there."""

from __future__ import annotations

from collections.abc import Iterator

from exudyn_flexlink.scene.base import split_point
from exudyn_flexlink.scene.bodies import FlexibleBody, RigidBody
from exudyn_flexlink.scene.curve_specs import CurveSpec, JoinedSpec, LapsSpec
from exudyn_flexlink.scene.joints import PointsJoint, SleeveJoint, SlotJoint
from exudyn_flexlink.scene.lookup import Lookup, valid
from exudyn_flexlink.source import KeyPath, Mistake


def curves(look: Lookup) -> Iterator[Mistake]:
    """Refuse names in curves that lead nowhere."""
    for name, curve in valid(look.parts.curves):
        path = ("curves", name)
        yield from _carried(look, path, curve)
        for where, inner in _references(path, curve):
            yield from look.missing(where, "curves", inner)
            laps = isinstance(look.get("curves", inner), LapsSpec)
            if laps and inner != name:
                yield Mistake(where, f"'{inner}' is of type laps, no part of a curve")
        for where, inner in _references(path, curve):
            if name in _reachable(look, inner):
                yield Mistake(where, f"'{name}' would contain itself")


def _carried(look: Lookup, path: KeyPath, curve: CurveSpec) -> Iterator[Mistake]:
    """Refuse what can't carry a curve, and a part of a curve that is carried by itself."""
    if curve.on is not None:
        yield from look.missing((*path, "on"), "bodies", curve.on)
        if isinstance(look.get("bodies", curve.on), FlexibleBody):
            yield Mistake(
                (*path, "on"),
                f"'{curve.on}' is flexible: it can't carry a curve",
            )
    for where, inner in _pieces(look, path, curve):
        if inner is not None and inner.on is not None:
            hint = "say 'on' of the whole curve"
            yield Mistake(where, "a piece of a curve can't be carried by itself", hint)


def _pieces(
    look: Lookup, path: KeyPath, curve: CurveSpec
) -> Iterator[tuple[KeyPath, CurveSpec | None]]:
    """Curves of which another is made, written there or named, with their paths."""
    if isinstance(curve, (JoinedSpec, LapsSpec)):
        key = "pieces" if isinstance(curve, JoinedSpec) else "curves"
        for i, inner in enumerate(getattr(curve, key)):
            found = look.get("curves", inner) if isinstance(inner, str) else inner
            yield (*path, key, i), found


def _reachable(look: Lookup, name: str) -> set[str]:
    found: set[str] = set()
    queue = [name]
    while queue:
        here = queue.pop()
        if here not in found:
            found.add(here)
            queue += [inner for _, inner in _references((), look.get("curves", here))]
    return found


def _references(path: KeyPath, curve: CurveSpec | None) -> list[tuple[KeyPath, str]]:
    """Return the names of curves that a curve is made of, with their paths."""
    found: list[tuple[KeyPath, str]] = []
    if isinstance(curve, (JoinedSpec, LapsSpec)):
        key = "pieces" if isinstance(curve, JoinedSpec) else "curves"
        for i, inner in enumerate(getattr(curve, key)):
            here = (*path, key, i)
            found += [(here, inner)] if isinstance(inner, str) else _references(here, inner)
    return found


def joints(look: Lookup) -> Iterator[Mistake]:
    """Refuse names in joints that lead nowhere, or to the wrong kind of part."""
    for name, joint in valid(look.parts.joints):
        path = ("joints", name)
        if isinstance(joint, PointsJoint):
            for i, text in enumerate(joint.points):
                yield from look.point((*path, "points", i), text)
            one, other = (split_point(text)[0] for text in joint.points)
            if one == other:
                yield Mistake((*path, "points"), f"joins the body '{one}' to itself")
        elif isinstance(joint, SlotJoint):
            yield from look.point((*path, "point"), joint.point)
            yield from look.missing((*path, "curve"), "curves", joint.curve)
            curve = look.get("curves", joint.curve)
            if curve is not None and curve.on == split_point(joint.point)[0]:
                yield Mistake((*path, "point"), f"is on '{curve.on}', which carries the curve")
        elif isinstance(joint, SleeveJoint):
            yield from _sleeve(look, path, joint)


def _sleeve(look: Lookup, path: KeyPath, joint: SleeveJoint) -> Iterator[Mistake]:
    yield from look.missing((*path, "guide"), "bodies", joint.guide)
    yield from look.missing((*path, "link"), "bodies", joint.link)
    guide, link = look.get("bodies", joint.guide), look.get("bodies", joint.link)
    if joint.guide == joint.link:
        yield Mistake((*path, "link"), "the link must be another body than the guide")
    elif isinstance(link, RigidBody):
        yield Mistake((*path, "link"), f"'{joint.link}' must be of type rod or flexible")
    if isinstance(guide, FlexibleBody):
        hint = "a guide is straight; a link that bends slides in one"
        message = f"'{joint.guide}' must be of type rod or rigid"
        yield Mistake((*path, "guide"), message, hint)
    elif guide is not None and not {"start", "end"} <= set(guide.point_names):
        hint = "the link slides along the line from start to end"
        yield Mistake((*path, "guide"), f"'{joint.guide}' needs points start and end", hint)
    elif isinstance(guide, RigidBody):
        (x0, y0), (x1, y1) = guide.points["start"], guide.points["end"]
        if x1 <= x0 or abs(y1 - y0) > 1e-12:
            message = f"the line from start to end of '{joint.guide}' must run along its x-axis"
            hint = "give both points the same y, and the end the larger x"
            yield Mistake((*path, "guide"), message, hint)

"""What of a run is drawn at every instant: lines and marks of its mechanism, each with its look."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from exudyn_flexlink.animation.film import Take
from exudyn_flexlink.mechanism import GROUND, Anchor
from exudyn_flexlink.plots.outline import (
    Line,
    Mark,
    body_lines,
    curve_line,
    curved,
    face_line,
    faces,
    guides,
    is_flexible,
    joint_marks,
    rings,
    spokes,
    spring_lines,
    wall_lines,
    walled,
)
from exudyn_flexlink.plots.sketch import body_colour
from exudyn_flexlink.plots.style import GREEN, GREY, PURPLE, RED

WALL_COLOUR, GUIDE_COLOUR = "#A9A9A9", "#C9C9C9"


@dataclass(frozen=True)
class Drawn:
    """A line and its look: `kind` is curve, face, guide, wall, bar, link, ring, spoke or spring."""

    kind: str
    colour: str
    line: Line


def drawn_lines(take: Take) -> list[Drawn]:
    """Lines of a take, those in front last."""
    found = [Drawn(kind, take.colour or own, line) for kind, own, line in _lines(take)]
    order = ("curve", "face", "wall", "guide", "spring", "ring", "spoke", "bar", "link")
    return sorted(found, key=lambda drawn: order.index(drawn.kind))


def _lines(take: Take) -> Iterator[tuple[str, str, Line]]:
    """Kind, colour of its own and line of everything that is drawn."""
    scene, model = take.result.scene, take.model
    simple = (
        ("curve", PURPLE, [curve_line(track) for track in curved(model)]),
        ("face", RED, [face_line(face) for face in faces(model)]),
        ("ring", GREY, rings(model)),
        ("spoke", GREY, spokes(model)),
        ("spring", GREEN, spring_lines(scene, model)),
    )
    for kind, colour, lines in simple:
        yield from ((kind, colour, line) for line in lines)
    walls = [wall for channel in walled(model) for wall in wall_lines(model, channel)]
    yield from (("wall", WALL_COLOUR, wall) for wall in walls)
    with_walls = {wall.name for wall in walls}
    for i, body in enumerate(scene.bodies):
        if body in with_walls:
            continue
        colour, kind = body_colour(i), "link" if is_flexible(scene, body) else "bar"
        if body in guides(scene):
            colour, kind = GUIDE_COLOUR, "guide"
        yield from ((kind, colour, line) for line in body_lines(scene, model, body))


def drawn_marks(take: Take) -> list[Mark]:
    """Marks of the joints; those of the ground first."""
    return sorted(
        joint_marks(take.result.scene, take.model), key=lambda mark: "ground" not in mark.kind
    )


def named_points(take: Take) -> dict[str, Anchor]:
    """Points that the paper names: the origin O, P in the one slot, and S, the watched one."""
    found = {"O": Anchor(GROUND, 0.0, 0.0)} if take.model.slots else {}
    if len(take.model.slots) == 1:
        found["P"] = take.model.slots[0].anchor
    return {**found, "S": take.watched}

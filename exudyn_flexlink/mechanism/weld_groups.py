"""Parts that are welded together, and where each is in the axes of its group."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin

from exudyn_flexlink.mechanism.model import Mechanism, Weld
from exudyn_flexlink.mechanism.parts import GROUND, Anchor, RigidPart

ROOT = -1


@dataclass(frozen=True)
class Frame:
    """Axes at a place (m) of a link's axes, turned by `angle` (rad); link ROOT is the ground."""

    link: int
    x: float = 0.0
    y: float = 0.0
    angle: float = 0.0

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Return a point of the frame in the link's axes."""
        c, s = cos(self.angle), sin(self.angle)
        return self.x + c * x - s * y, self.y + s * x + c * y


def with_at_origin(at: tuple[float, float], link: int, angle: float) -> Frame:
    """Axes, turned by `angle` in those of a link, whose point `at` is the link's origin."""
    x, y = Frame(link, 0.0, 0.0, angle).place(*at)
    return Frame(link, -x, -y, angle)


def weld_groups(mechanism: Mechanism) -> list[dict[int, Frame]]:
    """Parts that are welded together, with frames in the axes of the first; the ground's first."""
    left = [GROUND, *range(len(mechanism.parts))]
    groups = []
    while left:
        groups.append(welded_to(left[0], mechanism.welds))
        left = [part for part in left if part not in groups[-1]]
    return groups


def welded_to(part: int, welds: Sequence[Weld]) -> dict[int, Frame]:
    """A part and all that is welded to it, with frames in its axes."""
    group = {part: Frame(ROOT)}
    while out := [
        own for own in welds if len({own.first.part, own.second.part} & group.keys()) == 1
    ]:
        weld = out[0]
        near = weld.first.part in group
        here, there = (weld.first, weld.second) if near else (weld.second, weld.first)
        angle = group[here.part].angle + (weld.angle if near else -weld.angle)
        x, y = group[here.part].place(here.x, here.y)
        back = with_at_origin((there.x, there.y), ROOT, angle)
        group[there.part] = Frame(ROOT, x + back.x, y + back.y, angle)
    return group


def inertia_with_welded(at: Anchor, parts: Sequence[RigidPart], welds: Sequence[Weld]) -> float:
    """Moment of inertia (kg m^2) about a point of a part, with all that is welded to the part."""
    total = 0.0
    for part, frame in welded_to(at.part, welds).items():
        if part != GROUND:
            x, y = frame.place(*parts[part].centre)
            total += parts[part].inertia + parts[part].mass * ((x - at.x) ** 2 + (y - at.y) ** 2)
    return total

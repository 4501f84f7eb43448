"""Which joint each part hangs on when as many joints as can be form no loop: a spanning tree.

Joints of a spanning tree never contradict each other. What is left, the joints that close loops,
slots and drives, is few rows however many rods a link has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from exudyn_flexlink.mechanism.model import Mechanism
from exudyn_flexlink.mechanism.parts import GROUND

NOTHING = -1


@dataclass(frozen=True)
class Spanning:
    """By part: what it hangs on (GROUND too if free) and by which joint (NOTHING if free).

    `order` has parents before what hangs on them. Joints are counted as in `constraint_rows`.
    """

    order: tuple[int, ...]
    parents: tuple[int, ...]
    joints: tuple[int, ...]


def spanning_tree(mechanism: Mechanism) -> Spanning:
    """Find a spanning tree of pins, welds and slides.

    A body's own hinges come first: it is the joints of the scene that close its loops.
    """
    ends = [
        *((joint.first.part, joint.second.part) for joint in mechanism.attachments),
        *((slide.first.part, slide.second.part) for slide in mechanism.slides),
    ]
    neighbours = _neighbours(_without_loops(mechanism, ends), ends)
    count = len(mechanism.parts)
    parents, joints, order = [GROUND] * count, [NOTHING] * count, list[int]()
    seen = {GROUND}
    for start in (GROUND, *range(count)):
        waiting = [start] if start == GROUND or start not in seen else []
        while waiting:
            part = waiting.pop()
            if part != GROUND:
                order.append(part)
            seen.add(part)
            for joint, other in neighbours.get(part, []):
                if other not in seen:
                    parents[other], joints[other] = part, joint
                    waiting.append(other)
    return Spanning(tuple(order), tuple(parents), tuple(joints))


def within_body(mechanism: Mechanism, first: int, second: int) -> bool:
    """Tell whether two parts are of one body."""
    parts = mechanism.parts
    return GROUND not in (first, second) and parts[first].body == parts[second].body


def _without_loops(mechanism: Mechanism, ends: Sequence[tuple[int, int]]) -> list[int]:
    """Joints that connect what is not connected yet, those within bodies first."""
    hinges = [joint for joint, pair in enumerate(ends) if within_body(mechanism, *pair)]
    leader = {part: part for part in range(GROUND, len(mechanism.parts))}

    def leader_of(part: int) -> int:
        while leader[part] != part:
            leader[part] = part = leader[leader[part]]
        return part

    kept = []
    for joint in dict.fromkeys((*hinges, *range(len(ends)))):
        first, second = (leader_of(part) for part in ends[joint])
        if first != second:
            leader[first] = second
            kept.append(joint)
    return kept


def _neighbours(
    kept: Sequence[int], ends: Sequence[tuple[int, int]]
) -> dict[int, list[tuple[int, int]]]:
    """By part, the joints kept and the parts they lead to."""
    found: dict[int, list[tuple[int, int]]] = {}
    for joint in kept:
        first, second = ends[joint]
        found.setdefault(first, []).append((joint, second))
        found.setdefault(second, []).append((joint, first))
    return found

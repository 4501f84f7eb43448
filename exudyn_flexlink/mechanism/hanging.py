"""Which parts hang on a joint of the tree, or on a weld: Newton's law for them tells its force."""

from __future__ import annotations

from collections.abc import Sequence

from exudyn_flexlink.mechanism.model import Mechanism, Pin, Slide, Weld
from exudyn_flexlink.mechanism.parts import GROUND
from exudyn_flexlink.mechanism.tree import TreeLayout


def hanging_on(
    mechanism: Mechanism, layout: TreeLayout, name: str
) -> tuple[list[int], float] | None:
    """Parts that a joint holds, and 1 if its second point is on them, -1 if its first is.

    None if it is no joint of the tree, and no weld.
    """
    if name in layout.joints:
        link, sign = layout.joints[name]
        return [part for part, own in layout.frames.items() if link in layout.path(own.link)], sign
    weld = next((weld for weld in mechanism.welds if weld.name == name), None)
    return None if weld is None else _on_weld(mechanism, layout, weld)


def _on_weld(mechanism: Mechanism, layout: TreeLayout, weld: Weld) -> tuple[list[int], float]:
    """As `hanging_on`: what is on that side of a weld which the ground is not on."""
    others: list[Pin | Slide | Weld] = [other for other in mechanism.welds if other is not weld]
    pins_and_slides: tuple[Pin | Slide, ...] = (*mechanism.pins, *mechanism.slides)
    others += [joint for joint in pins_and_slides if joint.name in layout.joints]
    far = _reached(weld.second.part, others)
    if GROUND not in far:
        return sorted(far), 1.0
    return sorted(_reached(weld.first.part, others)), -1.0


def _reached(part: int, joints: Sequence[Pin | Slide | Weld]) -> set[int]:
    """Parts that joints hold together with one, and that one."""
    found, more = {part}, {part}
    while more:
        ends = [{joint.first.part, joint.second.part} for joint in joints]
        more = set().union(*(pair for pair in ends if pair & found)) - found
        found |= more
    return found

"""Torsional springs that begin wound by whole turns, which may not be meant."""

from __future__ import annotations

from collections.abc import Iterator

from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.mechanism import wound_at_start
from exudyn_flexlink.result import Result


def wound_springs(result: Result) -> Iterator[str]:
    """Say which springs start wound by more than half a turn; a continued run may well be."""
    if len(result.time) and not result.scene.initial.states:
        yield from wound_at_start(assemble_scene(result.scene).mechanism, result.poses[0])

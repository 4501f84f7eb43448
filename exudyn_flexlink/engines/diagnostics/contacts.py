"""Strikes that a run resolves badly: with too few steps, or at the edge of the face."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from exudyn_flexlink.mechanism import FaceContact, build_mechanism, face_length
from exudyn_flexlink.result import Event, Result

FEWEST_STEPS = 5  # in half a period of a contact: with fewer no restitution is right
ENOUGH_STEPS = 30  # likewise: the restitution is right to 1 %
THIN = 0.25  # of the overlap of point and face: a deeper strike depends on how soft the face is


def struck(result: Result) -> bool:
    """Tell whether any contact of the scene closed."""
    return any(event.kind == "contact begins" for event in result.events)


def too_long(given: float, half_period: float) -> bool:
    """Tell whether a given step (s) is too long for a contact of half a period (s)."""
    return half_period < FEWEST_STEPS * given


def shortened(given: float, half_period: float, step: float) -> str:
    """Warn that contacts were resolved by steps (s) shorter than the given one."""
    return (
        f"steps of {given:.3g} s would leave {half_period / given:.2g} for a contact, where an "
        f"impact takes {FEWEST_STEPS} at least: in contact they were {step:.3g} s"
    )


def few_steps(result: Result) -> Iterator[str]:
    """Say that contacts were resolved by few steps."""
    steps = result.checks.steps_per_contact
    touched = any(len(sleeve.touches.end) for sleeve in result.sleeves.values())
    if steps < ENOUGH_STEPS * (1 - 1e-9) and (touched or struck(result)):
        yield (
            f"{steps:.3g} steps per contact: below {ENOUGH_STEPS} the restitution is off by more "
            "than 1 %; take smaller steps, or give a tolerance instead of a step"
        )


def thin_overlaps(result: Result) -> Iterator[str]:
    """Say of each contact where it went deepest against the overlap of its point and its face."""
    if not struck(result):
        return
    worst: dict[str, tuple[float, float, float, float]] = {}
    for face, begin, end in _strikes(result):
        depth = end.details.get("peak_force", 0.0) / getattr(face.law, "stiffness", np.inf)
        places = (event.details["place"] for event in (begin, end))
        overlap = max(min(place, face_length(face) - place) for place in places)
        found = (depth / max(overlap, 1e-300), depth, overlap, begin.time)
        worst[face.name] = max(worst.get(face.name, found), found)
    for name, (share, depth, overlap, at) in worst.items():
        if share > THIN:
            yield (
                f"contact '{name}' is {depth:.2g} m deep after {at:.6g} s, {share:.2g} of the "
                f"{overlap:.2g} m by which the point overlaps the face: the face's stiffness "
                "decides there, not the mechanism; raise it and compare"
            )


def _strikes(result: Result) -> Iterator[tuple[FaceContact, Event, Event]]:
    """The face of every contact that ended, with the events of its begin and its end."""
    faces = {face.name: face for face in build_mechanism(result.scene).contacts}
    begun: dict[str, Event] = {}
    for event in result.events:
        if event.kind == "contact begins":
            begun[event.name] = event
        elif event.name in begun:
            yield faces[event.name], begun.pop(event.name), event

"""Strikes that a run resolves badly, by few steps or at a face's edge, and contacts that idle."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from exudyn_flexlink.mechanism import (
    FaceContact,
    approach,
    build_mechanism,
    idle_at_start,
)
from exudyn_flexlink.result import Result

ENOUGH_STEPS = 30  # in half a period of a contact: the restitution is right to 1 %
THIN = 0.25  # of the overlap of point and face: a deeper strike depends on how soft the face is


def struck(result: Result) -> bool:
    """Tell whether any contact of the scene closed."""
    return any(len(contact.touches) for contact in result.contacts.values())


def shortened(given: float, half_period: float, step: float) -> str:
    """Warn that contacts of half a period (s) were resolved by steps (s) of their own."""
    return (
        f"a step of {given:.3g} s is too long for a contact, which would be over after "
        f"{half_period / given:.2g} of it: in contact steps were {step:.3g} s"
    )


def few_steps(result: Result) -> Iterator[str]:
    """Say that contacts were resolved by few steps."""
    steps = result.checks.steps_per_contact
    touched = any(len(touches) for touches in result.intervals.values())
    if steps < ENOUGH_STEPS * (1 - 1e-9) and touched:
        yield (
            f"{steps:.3g} steps per contact: below {ENOUGH_STEPS} the restitution is off by more "
            "than 1 %; raise 'solver.steps_per_contact'"
        )


def thin_overlaps(result: Result) -> Iterator[str]:
    """Say of each contact where it sank deepest, against the overlap of its point and its face."""
    for face in build_mechanism(result.scene).contacts:
        if not isinstance(face, FaceContact):  # circles overlap all around
            continue
        length, worst = face.length, (0.0, 0.0, 0.0, 0.0)
        for touch in result.contacts[face.name].touches:
            if not touch.lasts:
                overlap = max(min(x, length - x) for x in (touch.place, touch.end_place))
                share = touch.penetration / max(overlap, 1e-300)
                worst = max(worst, (share, touch.penetration, overlap, touch.begin))
        share, depth, overlap, at = worst
        if share > THIN:
            yield (
                f"after t = {at:.6g} s the point of '{face.name}' sinks {depth:.2g} m "
                f"into the face, {share:.2g} of the {overlap:.2g} m by which it overlaps the face: "
                "how long it stays there depends on the contact's stiffness; raise it and compare"
            )


def idle_contacts(result: Result) -> Iterator[str]:
    """Say which contacts never acted: their points stayed behind the face that they began behind.

    Those that come round an end need no warning: so do the slots and hollows of a Geneva wheel.
    """
    if len(result.time):
        mechanism = build_mechanism(result.scene)
        for contact, told in idle_at_start(mechanism, result.poses[0], result.rates[0]):
            if np.all(approach(contact, result.poses, result.rates).gap < 0):
                yield told

"""Strikes that a run resolves badly, by few steps or at an edge; what begins idle or wound."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import inf

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.mechanism import (
    TOUCHING,
    CircleContact,
    Contact,
    CurveContact,
    FaceContact,
    FlatContact,
    approach,
    build_mechanism,
    idle_at_start,
    wound_at_start,
)
from exudyn_flexlink.result import Result

ENOUGH_STEPS = 30  # in half a period of a contact: the restitution is right to 1 %
# Of the overlap of point and face, or of the radius of what is round: what a deeper strike does
# depends on how soft the contact is.
THIN = 0.25


def shortened(given: float | None, touched: Iterable[tuple[float, float]]) -> Iterator[str]:
    """Warn that contacts asked for steps shorter than the user's own (s), if there is one.

    `touched` are half periods of contacts, and the steps (s) that they asked for.
    """
    shorter = [own for own in touched if given is not None and own[1] < given]
    for half_period, step in sorted(shorter, key=lambda own: own[1])[:1]:
        yield (
            f"a step of {given:.3g} s is too long for a contact, which lasts {half_period:.2g} s: "
            f"in contact steps were {step:.3g} s"
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
    # Circles overlap all around, and slides their stops.
    for face in build_mechanism(result.scene).contacts:
        if not isinstance(face, FaceContact) or face.name not in result.scene.contacts:
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


def deep_strikes(result: Result) -> Iterator[str]:
    """Say of each round contact when it was deepest, against the radius of what is round there.

    At that depth no direction is the nearest way out any more.
    """
    for contact in build_mechanism(result.scene).contacts:
        if contact.name not in result.scene.contacts:  # a stop, a rope or a buffer has no radius
            continue
        history = result.contacts[contact.name]
        radius = _round(contact, history.place)
        depth = np.where(history.force > 0, -history.gap, 0.0)
        share = depth / radius
        if share.max(initial=0.0) <= THIN:
            continue
        k = int(np.argmax(share))
        yield (
            f"at t = {result.time[k]:.6g} s contact '{contact.name}' is {depth[k]:.2g} m deep, "
            f"{share[k]:.2g} of the radius of {radius[k]:.2g} m there: what follows depends on the "
            "contact's stiffness; raise it and compare"
        )


def beside_faces(result: Result) -> Iterator[str]:
    """Say which faces on curves were touched beside the two points that they are given by."""
    for contact in build_mechanism(result.scene).contacts:
        if isinstance(contact, FlatContact):
            history, width = result.contacts[contact.name], contact.width
            beside = np.maximum(-history.place, history.place - width) * (history.force > 0)
            if beside.max(initial=0.0) > TOUCHING:
                yield (
                    f"at t = {result.time[np.argmax(beside)]:.6g} s contact '{contact.name}' "
                    f"touches {beside.max():.3g} m beside the points of its line: the face counts "
                    "as going on there; take points farther apart if it does"
                )


def _round(contact: Contact, places: FloatArray) -> FloatArray:
    """Radius (n,) of what is pressed from outside at places (n,) m, infinite of what is not round.

    Of a curve where it bends away from the point, with the radius of the roller.
    """
    if isinstance(contact, CurveContact):
        curve = contact.curve
        bend = -contact.side * curve.curvature(curve.arc_length.place(places))
        radius = np.divide(1.0, bend, out=np.full(len(bend), inf), where=bend > 0)
        return np.asarray(contact.radius + radius)
    if isinstance(contact, CircleContact) and not contact.inside:
        return np.full(len(places), min(radius for radius in contact.radii if radius > 0))
    return np.full(len(places), inf)


def idle_contacts(result: Result) -> Iterator[str]:
    """Say which contacts never acted: their points stayed behind the face that they began behind.

    Those that come round an end need no warning: so do the slots and hollows of a Geneva wheel.
    """
    if len(result.time):
        mechanism = build_mechanism(result.scene)
        for contact, told in idle_at_start(mechanism, result.poses[0], result.rates[0]):
            if np.all(approach(contact, result.poses, result.rates).gap < 0):
                yield told


def wound_springs(result: Result) -> Iterator[str]:
    """Say which springs start wound by more than half a turn; a continued run may well be."""
    if len(result.time) and not result.scene.initial.states:
        yield from wound_at_start(assemble_scene(result.scene).mechanism, result.poses[0])

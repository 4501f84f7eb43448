"""Points that slid off the end of a face: how much larger errors are after it than before."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from exudyn_flexlink.mechanism import (
    FaceContact,
    Mechanism,
    anchor_position,
    approach,
    build_mechanism,
    swings,
)
from exudyn_flexlink.observables.answers import ANGLE, Turned, answer_of
from exudyn_flexlink.result import Result

NO_SPEED = 1e-300  # m/s: a point that stands as it slides off; only divided by
# Of a touch: a sample so near to its end tells the force of that instant; else the peak bounds it.
JUST_BEFORE = 0.1


@dataclass(frozen=True)
class Release:
    """A point that slid off the end of a face, and what was bent or pushed went free.

    At `time` (s) it crept along the face at `creep` (m/s); the gap then opened at up to
    `spring_back` (m/s), by the face or the point. `push` (m/s) is what the force of that instant
    would have changed the speed of a lever's end by in 1/omega of the lever, or to the run's end.
    """

    contact: str
    time: float
    creep: float
    spring_back: float
    push: float = 0.0

    @property
    def growth(self) -> float:
        """Error of the places after the release, over that before.

        An error dx of the place along the face is one of the instant, dx / creep, for which what
        springs back is off by spring_back dx / creep. A lever that is pushed so much longer is off
        by that force in its speed, of which it makes push dx / creep within its swing. Where it
        was at rest before, both are the same; where a strike is cut off, push is the larger.
        """
        return max(self.spring_back, self.push) / max(self.creep, NO_SPEED)


def releases(result: Result) -> list[Release]:
    """Every release of a run, contact by contact."""
    mechanism = build_mechanism(result.scene)
    faces = (contact for contact in mechanism.contacts if isinstance(contact, FaceContact))
    return [found for face in faces for found in _of_contact(result, mechanism, face)]


def _of_contact(result: Result, mechanism: Mechanism, face: FaceContact) -> Iterator[Release]:
    history = result.contacts[face.name]
    touches = history.touches
    if not touches.slides_off.any():
        return
    at = approach(face, result.poses, result.rates)
    part = mechanism.parts[face.start.part].body if face.start.part >= 0 else ""
    swing, arm = result.extremes.get(f"{part}.{ANGLE.rate_name}"), _arm(result, mechanism, face)
    lever = swings(mechanism).get(face.name)
    nexts = [*touches.begin[1:], np.inf]
    for touch, following in zip(touches, nexts, strict=True):
        if not touch.slides_off or touch.lasts:
            continue
        last = int(np.searchsorted(result.time, touch.end)) - 1  # sample before the end
        length = touch.end - touch.begin
        creep = abs(touch.end_place - touch.place) / max(length, NO_SPEED)
        force = touch.peak_force
        if result.time[last] >= touch.begin:
            creep = abs(float(at.slip[last]))
        if result.time[last] >= touch.end - JUST_BEFORE * length:
            force = float(history.force[last])
        opening = at.gap_rate[last + 1 :][result.time[last + 1 :] < following]
        closing = np.flatnonzero(opening < 0)
        fastest = float(opening[: closing[0] if len(closing) else None].max(initial=0.0))
        if swing is not None:  # of steps, where samples may be too far apart to show the swing
            turns = swing.between(touch.end, following).value
            fastest = max(fastest, arm * float(np.abs(turns).max(initial=0.0)))
        left = float(result.time[-1]) - touch.end
        push = 0.0 if lever is None else force * arm**2 / lever.inertia * min(lever.time, left)
        yield Release(face.name, touch.end, creep, fastest, push)


def _arm(result: Result, mechanism: Mechanism, face: FaceContact) -> float:
    """Largest distance (m) of the face's ends from the hinge of its part; 0 without one."""
    if face.start.part < 0:
        return 0.0
    start = result.poses[0]
    answer = answer_of(result.scene, mechanism, face, start)
    if not isinstance(answer, Turned):
        return 0.0
    hinge = anchor_position(answer.hinge, start)
    ends = (anchor_position(end, start) for end in (face.start, face.end))
    return max(float(np.linalg.norm(end - hinge)) for end in ends)

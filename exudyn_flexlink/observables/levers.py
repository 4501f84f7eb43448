"""How a struck body answers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from exudyn_flexlink.arguments import instants, number, takes
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import (
    GROUND,
    Anchor,
    Contact,
    Mechanism,
    anchor_position,
    approach,
    build_mechanism,
)
from exudyn_flexlink.observables.answers import Measure, Moved, Slid, Turned, answer_of, rest_of
from exudyn_flexlink.observables.points import between_samples, require_inside
from exudyn_flexlink.result import Extremes, Result
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.units import Dimension


@dataclass(frozen=True)
class LeverResponse:
    """Motion of a struck body, (N,) each.

    `measure` says what `value` is, from where the body stood at time 0, or in a run that goes on
    from another where its spring is at rest, and in what unit: the angle (rad, counter-clockwise)
    of a body that turns on another, or the displacement (m) along the joint's axis of one that
    slides, both relative to the body that carries it; of a free one it is the displacement of its
    tip. `rate` is that of the value, per s.
    `tip_displacement` (m) is that of the end of the struck line farther from the body's hinge, or
    of the struck circle's centre, along the normal at time 0, positive to the free side.
    `extremes` are those of the value, whatever is sampled.
    """

    body: str
    measure: Measure
    time: FloatArray
    value: FloatArray
    rate: FloatArray
    tip_displacement: FloatArray
    extremes: Extremes

    def __repr__(self) -> str:
        if not len(self.time):
            return f"<LeverResponse of {self.body}: no samples>"
        (least, at), (greatest, then) = self.least, self.greatest
        unit = self.measure.unit
        return (
            f"<LeverResponse of {self.body}: from {least:+.5g} {unit} at {at:.5g} s to "
            f"{greatest:+.5g} {unit} at {then:.5g} s, {len(self.time)} samples>"
        )

    @takes(time=instants)
    def value_at(self, time: FloatArray) -> FloatArray:
        """Value at instants (s) of the run, between samples too: see `between_samples`.

        Raises:
            ValueError: one of them is not in the run.

        """
        require_inside(self.time, time)
        return between_samples(self.time, self.value, self.rate, time)

    @takes(begin=number(Dimension.TIME, endless=True), end=number(Dimension.TIME, endless=True))
    def between(self, begin: float, end: float) -> LeverResponse:
        """The part from `begin` to before `end` (s) alone; may be nothing."""
        inside = (self.time >= begin) & (self.time < end)
        names = ("time", "value", "rate", "tip_displacement")
        arrays = {name: getattr(self, name)[inside] for name in names}
        extremes = self.extremes.between(begin, np.nextafter(end, -np.inf))
        return replace(self, **arrays, extremes=extremes)

    @property
    def least(self) -> tuple[float, float]:
        """Smallest value and its instant (s)."""
        return self._all.least

    @property
    def greatest(self) -> tuple[float, float]:
        """Largest value and its instant (s)."""
        return self._all.greatest

    @property
    def farthest(self) -> float:
        """Value farthest from where the body stood at time 0; 0 of no part of a run."""
        own = self._all
        return max(own.least[0], own.greatest[0], key=abs) if len(own.time) else 0.0

    @property
    def _all(self) -> Extremes:
        """Extremes and samples: at the ends of a part of a run only these tell the value."""
        extremes = self.extremes
        return Extremes(
            np.concatenate([extremes.time, self.time]), np.concatenate([extremes.value, self.value])
        )


def struck_bodies(scene: Scene) -> dict[str, str]:
    """Bodies that are struck, each with the first contact that strikes it."""
    found: dict[str, str] = {}
    for name, contact in scene.contacts.items():
        if contact.struck is not None:
            found.setdefault(contact.struck, name)
    return found


def lever_response(result: Result, contact: str) -> LeverResponse:
    """Motion of the body that the contact strikes."""
    mechanism = build_mechanism(result.scene)
    own = struck_by(mechanism, contact)
    part = own.parts[1]
    if part == GROUND:
        raise ValueError(f"the contact '{contact}' strikes the ground")
    body, start = mechanism.parts[part].body, result.poses[0]
    # One answer for a body, whichever contact strikes it: the run's extremes are of that.
    first = struck_by(mechanism, struck_bodies(result.scene)[body])
    answer = answer_of(result.scene, mechanism, first, start)
    value, rate = answer.motion(result.poses, result.rates)
    zero = float(value[0])
    hinge = answer.hinge if isinstance(answer, Turned) else None
    if result.scene.initial.states and (rest := rest_of(answer, mechanism)) is not None:
        start, zero = _set_back(start, answer, part, zero - rest), rest
    anchor = _farthest(own.anchors[1], hinge, start)
    tip, at_rest = anchor_position(anchor, result.poses), anchor_position(anchor, start)
    normal = approach(own, start, result.rates[0]).normal
    turns = result.extremes[f"{body}.{answer.measure.name}"]
    return LeverResponse(
        body,
        answer.measure,
        result.time,
        value - zero,
        rate,
        (tip - at_rest) @ normal,
        Extremes(turns.time, turns.value - zero),
    )


def _set_back(q: FloatArray, answer: Turned | Slid | Moved, part: int, by: float) -> FloatArray:
    """Poses (parts, 3) with the struck part back by an angle (rad) about its hinge, if it has one.

    What it would be at rest, where a run goes on from one that bent it.
    """
    if not isinstance(answer, Turned):
        return q
    back, pivot = q.copy(), anchor_position(answer.hinge, q)
    back[part, 2] -= by
    back[part, :2] += pivot - anchor_position(answer.hinge, back)
    return np.asarray(back)


def struck_by(mechanism: Mechanism, contact: str) -> Contact:
    """Find a contact of the scene."""
    for own in mechanism.contacts:
        if own.name == contact:
            return own
    raise ValueError(f"the scene has no contact '{contact}'")


def _farthest(anchors: Sequence[Anchor], hinge: Anchor | None, q: FloatArray) -> Anchor:
    """Anchor of the struck body that moves most as it swings, the last of several alike."""
    if hinge is None:
        return anchors[-1]
    at = anchor_position(hinge, q)
    return max(anchors[::-1], key=lambda own: float(np.linalg.norm(anchor_position(own, q) - at)))

"""A scene that goes on from where a run was.

The state of a mechanism is where its parts are and how fast they move, in which lap the points in
slots are, and what time it is for its drives. Contact laws keep no history (see `laws`), but a
contact that presses has begun: when, where and how fast, and under an impulse law that it lasts. So
a run goes on from instants at which nothing presses.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves import Laps
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.mechanism import (
    Assembly,
    Mechanism,
    closest,
    laps_near,
    motor_place,
    slot_point,
)
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import (
    FrozenMapping,
    Initial,
    LapsSpec,
    LinearSpring,
    Scene,
    SlotJoint,
    Spring,
    TorsionalSpring,
)

ROUNDING = 1e-12  # s, of an instant: a lap that begins as a run goes on has begun
LOOKS = 64  # samples that tell by the way to the next which way round a point has run


class CannotContinueError(ValueError):
    """A run can't be continued from an instant; the text says why, and from which it can."""


def continued(result: Result, at: float | None = None) -> Scene:
    """Return the scene that begins with the state of a run at its sample next to `at` (s).

    Left out, `at` is the end. All else stays: accuracy, and how long it runs. Times of its runs
    count from its own begin, which drives know as ``initial.clock``; springs that were at rest as
    assembled stay at rest there.

    Raises:
        CannotContinueError: something presses at that instant, or a point has run backwards along
            a curve with laps, so that its lap does not tell where the curve goes on.

    """
    k = len(result.time) - 1 if at is None else result.sample_at(at)
    time = float(result.time[k])
    _require_free(result, time)
    mechanism = assemble_scene(result.scene).mechanism
    _require_forwards(result, mechanism, time)
    state = state_at(result, time)
    rows = {body: _rows(state[list(own)]) for body, own in mechanism.bodies.items()}
    initial = Initial(
        states=FrozenMapping(rows),
        laps=FrozenMapping(_laps(result, time)),
        clock=result.scene.initial.clock + time,
    )
    return result.scene.changed(initial=initial, springs=_as_they_were(result.scene))


def moved(scene: Scene, state: FloatArray) -> Scene:
    """Return a scene that goes on, from `continued`, with another state (parts, 6) at that time.

    Parts move as little as joints and drives demand: what a drive prescribes stays as it was, for
    a neighbour that were ahead of its drive would stay ahead for ever.

    Raises:
        CannotAssembleError: the joints do not close near that state.

    """
    given, assembly = scene.initial, assemble_scene(scene)
    mechanism, before = assembly.mechanism, assembly.state.q
    driven = tuple(
        replace(motor, start=float(motor_place(motor, before))) for motor in mechanism.speed_motors
    )
    q, _ = closest(replace(mechanism, speed_motors=driven), state[:, :3], given.laps)
    whole = np.concatenate([q, state[:, 3:]], axis=-1)
    states = {body: _rows(whole[list(own)]) for body, own in mechanism.bodies.items()}
    laps = laps_near(mechanism, q, assembly.state.places)
    update = {"states": FrozenMapping(states), "laps": FrozenMapping(laps)}
    return scene.changed(initial=given.model_copy(update=update))


def _rows(state: FloatArray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in state.tolist())


def state_at(result: Result, time: float) -> FloatArray:
    """State (parts, 6) at the sample next to an instant (s)."""
    k = result.sample_at(time)
    return np.concatenate([result.poses[k], result.rates[k]], axis=-1)


def free_spans(result: Result) -> FloatArray:
    """Begins and ends (K, 2) s of the spans in which nothing presses, up to the run's end."""
    last = float(result.time[-1])
    touches = [np.stack([own.begin, own.end]) for own in result.intervals.values()]
    begin, end = np.concatenate([np.zeros((2, 0)), *touches], axis=1)
    order = np.argsort(begin)
    until = np.maximum.accumulate(np.append(0.0, np.where(np.isfinite(end), end, last)[order]))
    spans = np.stack([until, np.append(begin[order], last)], axis=1)
    return spans[spans[:, 1] > spans[:, 0]]


def _require_free(result: Result, time: float) -> None:
    """Refuse an instant at which something presses; begins and ends of touches count as such."""
    pressing = [
        name
        for name, own in result.intervals.items()
        if np.any((own.begin <= time) & (own.end >= time))
    ]
    if not pressing:
        return
    spans = free_spans(result)
    before, after = spans[spans[:, 1] <= time], spans[spans[:, 0] >= time]
    near = [f"from {a:.6g} to {b:.6g} s" for a, b in (*before[-1:], *after[:1])]
    hint = f"; nothing does {' and '.join(near)}" if near else ""
    names = ", ".join(f"'{name}'" for name in pressing)
    raise CannotContinueError(f"{names} presses at {time:.9g} s{hint}")


def _require_forwards(result: Result, mechanism: Mechanism, time: float) -> None:
    """Refuse points that have run backwards along a curve with laps: laps count alike both ways."""
    last = result.sample_at(time)
    looks = np.linspace(0, last - 1, LOOKS).astype(int)
    for slot in mechanism.slots:
        if not isinstance(slot.curve, Laps) or last == 0:
            continue
        here, then = (slot_point(slot, result.poses[k]) for k in (looks, looks + 1))
        tangents = slot.curve.tangent(slot.curve.closest((here + then) / 2))
        if np.sum((then - here) * tangents) < 0:
            raise CannotContinueError(
                f"the point of slot '{slot.name}' has run backwards along a curve with laps: a run "
                "that goes on there would take them in another order"
            )


def _laps(result: Result, time: float) -> dict[str, int]:
    """Lap in which each slot's point is, of slots on curves with laps."""
    found, scene = {}, result.scene
    for name, joint in scene.joints.items():
        curve = scene.curves[joint.curve] if isinstance(joint, SlotJoint) else None
        if not isinstance(curve, LapsSpec):
            continue
        begun = [
            lap.details["lap"]
            for lap in result.laps
            if lap.name == name and lap.time <= time + ROUNDING
        ]
        lap = int(begun[-1]) if begun else scene.initial.laps.get(name, 1)
        found[name] = (lap - 1) % len(curve.curves) + 1
    return found


def _as_they_were(scene: Scene) -> dict[str, Spring]:
    """Springs with what was left to the assembly: the angle or length at which they rest."""
    assembly = assemble_scene(scene)
    return {name: _resting(spring, name, assembly) for name, spring in scene.springs.items()}


def _resting(spring: Spring, name: str, assembly: Assembly) -> Spring:
    mechanism = assembly.mechanism
    if isinstance(spring, TorsionalSpring):
        if spring.rest_angle is not None:
            return spring
        angle = next(own.rest_angle for own in mechanism.springs if own.name == name)
        return spring.model_copy(update={"rest_angle": angle})
    assert isinstance(spring, LinearSpring)
    if spring.length is not None:
        return spring
    length = next(own.length for own in mechanism.linear_springs if own.name == name)
    return spring.model_copy(update={"length": length})

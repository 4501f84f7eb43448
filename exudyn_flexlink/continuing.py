"""Scenes that continue a run from one of its instants, and one result of a run and its sequel.

The state of a mechanism is the poses and velocities of its parts, the laps of points in slots, the
time of its drives, and the history of each contact that presses: how fast its touch began, which
some laws need (see `laws`), and under an impulse law that it lasts. A run in minimal coordinates
can begin with all of that. Other runs can be continued only from instants at which nothing presses.
Each stage of a run begins with the state of the one before.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import is_dataclass, replace
from math import inf, pi
from typing import Any, NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray, Variable, members
from exudyn_flexlink.curves import Laps, ends_of_lap, next_lap
from exudyn_flexlink.loading import SHORTEST_RUN, assemble_scene, put_together
from exudyn_flexlink.mechanism import (
    CLOSED,
    Assembly,
    Slot,
    approach,
    build_mechanism,
    closest,
    formulation,
    motor_place,
    place_in,
    slot_point,
    turning,
)
from exudyn_flexlink.mechanism.closing import TYPED
from exudyn_flexlink.observables import carrying_joint, joint_angle, struck_bodies
from exudyn_flexlink.result import (
    STAGE,
    Checks,
    Event,
    FrictionHistory,
    Intervals,
    Outcome,
    Result,
    later,
)
from exudyn_flexlink.rounding import KNOT_TIME, ROUNDING
from exudyn_flexlink.scene import (
    Flank,
    FrozenMapping,
    Initial,
    Joint,
    PrismaticJoint,
    Run,
    Scene,
    Spring,
    WeldJoint,
    after_stage,
    first_stage,
    whole_scene,
)
from exudyn_flexlink.shipped import EXUDYN
from exudyn_flexlink.source import SceneError

Progress = Callable[[float], None]
"""Called now and then with the part of the run that is done, 0 to 1."""

Pressing = Mapping[str, tuple[tuple[int, float], ...]]
"""Of each contact that presses, its pairs that do, and the speeds (m/s) at which they touched."""

BESIDE = 1e-6  # of a curve's size: nearer to a seam, rounding decides on which side a point is
DT = 1e-6  # s, of central differences: their rounding is 1e-10 m/s


class CannotContinueError(ValueError):
    """A run can't be continued from an instant; the text says why, and which instants will do."""


def continued(result: Result, at: float | None = None) -> Scene:
    """Return the scene that begins with the state of a run at its sample next to `at` (s).

    If `at` is left out, that is the end. All other settings stay, such as accuracy and duration.
    Times of the new run begin at 0; drives add the time before it, ``initial.clock``. Contacts that
    press are in ``initial.pressing``. Springs that rest in the assembled position keep that rest
    position.

    Raises:
        CannotContinueError: the instant is not in the run; or something presses then, in a run of
            the Lagrangian or in redundant coordinates.

    """
    k = _sample(result, at)
    time = float(result.time[k])
    if result.engine != EXUDYN or formulation(result.scene) != "minimal":
        _require_free(result, time)
    return _with_pressing(_scene_from(result, k), result, time)


def _sample(result: Result, at: float | None) -> int:
    """Number of the sample next to an instant (s), or of the last sample if that is left out."""
    last = float(result.time[-1])
    if at is not None and not 0 <= at <= last:
        raise CannotContinueError(f"the run goes from 0 to {last:.9g} s; {at:.9g} s is not in it")
    return len(result.time) - 1 if at is None else result.sample_at(at)


def _scene_from(result: Result, k: int) -> Scene:
    """Return the scene that begins with the state of a run at its sample k."""
    time, clock = float(result.time[k]), result.scene.initial.clock
    result = replace(result, scene=first_stage(result.scene))
    for begin, _ in result.stages:
        if begin <= time:
            staged = _staged(result, result.sample_at(begin))
            initial = staged.initial.model_copy(update={"clock": clock})  # as the run began
            result = replace(result, scene=staged.changed(initial=initial))
    return _scene_within_stage(result, k)


def _scene_within_stage(result: Result, k: int) -> Scene:
    """As `_scene_from`, if the run's scene is already that of the stage in which sample k lies."""
    time = float(result.time[k])
    assembly = assemble_scene(result.scene)
    state, bodies = state_at(result, time), assembly.mechanism.bodies
    laps = {start.slot.name: _LapFinder(result, start, k).lap() for start in _lap_starts(assembly)}
    initial = Initial(
        states=FrozenMapping({body: _rows(state[list(parts)]) for body, parts in bodies.items()}),
        laps=FrozenMapping(laps),
        clock=result.scene.initial.clock + time,
    )
    joints = _joints_from(assembly, result.scene, state[:, :3])
    springs = springs_as_assembled(result.scene)
    return result.scene.changed(initial=initial, joints=joints, springs=springs)


def _joints_from(assembly: Assembly, scene: Scene, q: FloatArray) -> dict[str, Joint]:
    """Joints of a scene that shall start at coordinates `q` (parts, 3).

    Gears with play then start at the place in their play that follows from q; the `assembly` is
    that of the scene, with its present start.
    """
    joints = dict(scene.joints)
    for contact in assembly.mechanism.contacts:
        stop = scene.stops.get(contact.name)
        if isinstance(stop, Flank) and stop.end == "to":
            start = stop.at - float(approach(contact, q, np.zeros_like(q), 0.0).gap)
            joints[stop.joint] = joints[stop.joint].model_copy(update={"start": start})
    return joints


def instant_of(result: Result, at: float | None) -> tuple[Assembly, dict[int, float], float]:
    """Return the state of a run at its sample next to `at` (s), or its last one, and what presses.

    Returns the assembly, whose drives begin at that instant; the speeds (m/s) at which the touches
    began that last, by the numbers of their contacts among `Mechanism.contacts_and_pairs`; and the
    instant (s) of the sample.

    Raises:
        CannotContinueError: `at` is not in the run.

    """
    k = _sample(result, at)
    time, assembly = float(result.time[k]), put_together(_scene_from(result, k))
    numbers, pressing = assembly.mechanism.numbers, _pressing(result, time)
    touching = {
        numbers[name] + pair: speed for name, pairs in pressing.items() for pair, speed in pairs
    }
    return assembly, touching, time


def _pressing(result: Result, time: float) -> Pressing:
    """Pairs that press at an instant (s), by contact, with the speeds at which they touched.

    At the end of a run these are the touches that last.
    """
    pressing = {}
    for name, touches in result.intervals.items():
        lasting = touches.where((touches.begin <= time) & (time < touches.end))
        if len(lasting):
            pressing[name] = tuple((touch.pair, touch.approach_speed) for touch in lasting)
    return pressing


def _with_pressing(scene: Scene, result: Result, time: float) -> Scene:
    """Return a scene, that goes on from an instant (s) of a run, with what presses then."""
    names = {*scene.all_contacts, *scene.joints}
    pressing = {name: pairs for name, pairs in _pressing(result, time).items() if name in names}
    update = {"pressing": FrozenMapping(pressing)}
    return scene.changed(initial=scene.initial.model_copy(update=update))


# --- stages ---------------------------------------------------------------------------------------

STAGE_ADVICE = "another 'until' of the stage, or places that meet then"


def through_stages(
    scene: Scene, run: Callable[[Scene, Progress | None], Result], progress: Progress | None
) -> Result:
    """Run all stages of a scene, each by `run`, and return one result."""
    whole = result = run(first_stage(scene), progress)
    end = scene.run.duration or inf
    for number in range(1, len(scene.stages) + 1):
        begin = float(whole.time[-1])
        if not result.outcome.completed:
            break
        if not result.outcome.until:
            never = f"stage {number} never came: its 'until' did not rise through 0"
            whole = replace(whole, warnings=(*whole.warnings, never))
            break
        if end - begin < SHORTEST_RUN:
            break
        try:
            part = _next_stage(result)
            result = run(part, progress and _from(progress, begin / end))
        except (CannotContinueError, SceneError) as error:
            why, advice = str(error), STAGE_ADVICE
            if isinstance(error, SceneError):
                why, advice = error.mistakes[0].message, error.mistakes[0].hint or STAGE_ADVICE
            reason = f"stage {number} can't begin: {why}"
            whole = replace(whole, outcome=Outcome(False, begin, reason, advice))
            break
        whole = _with_stage(whole, result, f"stage {number}")
    return replace(whole, scene=whole_scene(scene)) if scene.stages else whole


def _from(progress: Progress, begin: float) -> Progress:
    """Progress of the rest of a run, which follows a part `begin` of it."""
    return lambda done: progress(begin + done * (1 - begin))


def _with_stage(whole: Result, result: Result, name: str) -> Result:
    """Return one result of a run and of its next stage."""
    begin = float(whole.time[-1])
    lost = _lost_between(whole, result)
    event = Event(begin, STAGE, name, {"energy_lost": lost})
    both = _series_of_both(whole, later(result, begin))
    outcome = replace(result.outcome, time=result.outcome.time + begin)
    return replace(both, laps=(*whole.laps, event, *both.laps[len(whole.laps) :]), outcome=outcome)


def _lost_between(first: Result, second: Result) -> float:
    """Kinetic energy (J) that impulses take between two runs; below zero if drives supply it."""
    before, after = float(first.energy.kinetic[-1]), float(second.energy.kinetic[0])
    return before - after if abs(before - after) > ROUNDING * max(before, after) else 0.0


def _next_stage(result: Result) -> Scene:
    """Return the scene with which a run goes on in its next stage.

    Contacts that press go on to press. A joint that closes while its two sides move at different
    speeds acts by an impulse.

    Raises:
        CannotContinueError: a joint can't close, since its two sides are apart.
        SceneError: the scene of the stage has mistakes, or can't be assembled.

    """
    time = float(result.time[-1])
    scene = _with_pressing(_staged(result, len(result.time) - 1), result, time)
    scene = scene.changed(
        run=scene.run.model_copy(update={"duration": (scene.run.duration or inf) - time}),
        solver=scene.solver.model_copy(update={"formulation": "minimal"}),
    )
    assembly = assemble_scene(scene)
    moves = np.hypot(*(assembly.state.q - result.poses[-1])[:, :2].T)
    parts = assembly.mechanism.parts
    far = moves / [part.reach for part in parts]
    k = int(np.argmax(far))
    if far[k] > TYPED:
        raise CannotContinueError(
            f"its joints can't close there: '{parts[k].body}' would have to move by "
            f"{moves[k]:.3g} m"
        )
    _require_walls_to_stay(result, assembly, scene.initial.pressing)
    return scene


def _require_walls_to_stay(result: Result, assembly: Assembly, pressing: Pressing) -> None:
    """Refuse a stage in which what presses at the end of a run is deeper, or less deep, at once.

    That would give or take energy; impulses would even push out what lies within a wall.
    """
    mechanisms = (assemble_scene(result.scene).mechanism, assembly.mechanism)
    state, times = (result.poses[-1], result.rates[-1]), (float(result.time[-1]), 0.0)
    allowed = TYPED * max(part.reach for part in assembly.mechanism.parts)
    for name, pairs in pressing.items():
        for pair, _ in pairs:
            numbers = [mechanism.numbers[name] + pair for mechanism in mechanisms]
            contacts = [m.contacts_and_pairs[k] for m, k in zip(mechanisms, numbers, strict=True)]
            before, after = (
                float(approach(contact, *state, t).gap)
                for contact, t in zip(contacts, times, strict=True)
            )
            if abs(after - before) > allowed:
                move = f"by {abs(after - before):.3g} (m or rad)"
                raise CannotContinueError(f"'{name}' presses, and its wall would move {move}")


def _staged(result: Result, k: int) -> Scene:
    """Return the scene from sample k of a run on, changed by the first of the scene's stages."""
    scene = _scene_within_stage(result, k)
    changed, added = after_stage(scene), scene.stages[0].add.joints
    mechanism = build_mechanism(changed)
    ends = {weld.name: (weld.first.part, weld.second.part) for weld in mechanism.welds}
    ends |= {slide.name: (slide.first.part, slide.second.part) for slide in mechanism.slides}
    angles = {
        name: float(turning(*ends[name], result.poses[k]))
        for name, joint in added.items()
        if isinstance(joint, WeldJoint | PrismaticJoint) and joint.angle is None
    }
    return after_stage(scene, angles) if angles else changed


def moved(scene: Scene, state: FloatArray) -> Scene:
    """Return a scene made by `continued` with another state (parts, 6) at its start.

    Joints are closed by the smallest motion from that state. Angles and lengths that drives
    prescribe stay as they were: a state ahead of its drive would stay ahead for ever.

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
    states = {body: _rows(whole[list(parts)]) for body, parts in mechanism.bodies.items()}
    laps = _laps_near(assembly, q)
    update = {"states": FrozenMapping(states), "laps": FrozenMapping(laps)}
    joints = _joints_from(assembly, scene, q)
    return scene.changed(initial=given.model_copy(update=update), joints=joints)


def _laps_near(assembly: Assembly, q: FloatArray) -> dict[str, int]:
    """Laps of slots on curves with laps, at coordinates near those of the assembly.

    A point just before the begin of a lap counts as at the end of the lap before.
    """
    laps = {}
    for slot, place, lap in _lap_starts(assembly):
        begin, end = ends_of_lap(slot.curve, lap)
        rounding = CLOSED / float(np.linalg.norm(slot.curve.derivative(begin)))
        nearest = slot.curve.nearest(slot_point(slot, q), near=place)
        way = int(nearest >= end - rounding) - int(nearest < begin - rounding)
        laps[slot.name] = next_lap(lap, way) if way else lap
    return laps


class _LapStart(NamedTuple):
    """A slot on a curve with laps; at time 0 the place of its point on the curve, and its lap."""

    slot: Slot
    place: float
    lap: int


def _lap_starts(assembly: Assembly) -> list[_LapStart]:
    """Slots on curves with laps, with play or without."""
    mechanism, state = assembly.mechanism, assembly.state
    slots = zip(mechanism.slots, state.places.tolist(), state.laps, strict=True)
    played = [(groove.slot, groove.lap) for groove in mechanism.grooves]
    middles = ((slot, place_in(slot, lap, state.q), lap) for slot, lap in played)
    return [_LapStart(*start) for start in (*slots, *middles) if isinstance(start[0].curve, Laps)]


def _rows(state: FloatArray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in state.tolist())


def state_at(result: Result, time: float) -> FloatArray:
    """State (parts, 6) at the sample next to an instant (s)."""
    k = result.sample_at(time)
    return np.concatenate([result.poses[k], result.rates[k]], axis=-1)


def free_spans(result: Result) -> FloatArray:
    """Begins and ends (K, 2) s of the spans in which nothing presses, up to the run's end."""
    last = float(result.time[-1])
    touches = [np.stack([interval.begin, interval.end]) for interval in result.intervals.values()]
    begin, end = np.concatenate([np.zeros((2, 0)), *touches], axis=1)
    order = np.argsort(begin)
    until = np.maximum.accumulate(np.append(0.0, np.where(np.isfinite(end), end, last)[order]))
    spans = np.stack([until, np.append(begin[order], last)], axis=1)
    return spans[spans[:, 1] > spans[:, 0]]


def _require_free(result: Result, time: float) -> None:
    """Refuse an instant at which something presses, also the begin and the end of a touch."""
    pressing = [
        name
        for name, interval in result.intervals.items()
        if np.any((interval.begin <= time) & (interval.end >= time))
    ]
    if not pressing:
        return
    spans = free_spans(result)
    before, after = spans[spans[:, 1] <= time], spans[spans[:, 0] >= time]
    near = [_span_text(float(a), float(b)) for a, b in (*before[-1:], *after[:1])]
    hint = f"; nothing does {' and '.join(near)}" if near else ""
    names = ", ".join(f"'{name}'" for name in pressing)
    raise CannotContinueError(f"{names} presses at {time:.9g} s{hint}")


def _span_text(begin: float, end: float) -> str:
    """Text of a span (s), with enough digits to tell its two ends apart."""
    texts = ((f"{begin:.{digits}g}", f"{end:.{digits}g}") for digits in range(6, 18))
    first, last = next(pair for pair in texts if pair[0] != pair[1])
    return f"from {first} to {last} s"


class _LapFinder:
    """Finds the lap of a slot's point on a curve with laps, at sample k of a run.

    Near the seam, rounding decides whether the engine counts the seam as passed. There the
    direction from which the point came tells which lap begins at this seam. The point is in that
    lap if it is on the seam or ahead of it, else in the lap before.
    """

    def __init__(self, result: Result, start: _LapStart, k: int) -> None:
        self.slot = start.slot
        self._time, self._poses, self._rates = (
            column[: k + 1] for column in (result.time, result.poses, result.rates)
        )
        self._place = start.place
        laps = (lap for lap in result.laps if lap.name == self.slot.name)
        self._passes = [lap for lap in laps if lap.time <= self._time[-1]]
        entered = (int(lap.details["lap"]) for lap in self._passes)
        self._laps = [start.lap, *entered]

    def lap(self) -> int:
        """Return the number of the lap."""
        ahead, off = self._from_seam(self._poses[-1])
        if off > self._beside:
            return self._laps[-1]
        begins = self._lap_at_seam()
        return begins if ahead > -CLOSED else next_lap(begins, -1)

    def _lap_at_seam(self) -> int:
        """Lap that begins at the seam next to the point."""
        lap, passed = self._laps[-1], self._passes[-1].time if self._passes else -inf
        since = int(np.searchsorted(self._time, passed, side="right"))
        ahead, off = self._from_seam(self._poses[since:])
        away = np.flatnonzero(off > self._beside)
        last = float(max(passed, *self._time[-2:-1], 0.0))
        if abs(self._speed()) * (self._time[-1] - last) > 2 * self._beside:
            # The point came here after the last sample, or the last pass, perhaps from half a lap
            # away.
            came_forwards = self._speed() > 0
        elif len(away):
            came_forwards = bool(ahead[away[-1]] < 0)
        elif self._passes:  # the point passed the seam and stayed near it
            return max(self._laps[-2:])
        else:  # the point has been near the seam since the start
            begin, end = ends_of_lap(self.slot.curve, lap)
            came_forwards = self._place - begin > end - self._place
        return next_lap(lap, 1) if came_forwards else lap

    @property
    def _beside(self) -> float:
        return BESIDE * self.slot.curve.size

    def _from_seam(self, poses: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How far (m) the point is ahead of the seam, and how far away, at poses (.., parts, 3)."""
        curve = self.slot.curve
        away = slot_point(self.slot, poses) - curve.point(curve.start)
        return away @ curve.tangent(curve.start), np.linalg.norm(away, axis=-1)

    def _speed(self) -> float:
        """Speed (m/s) along the curve at the seam."""
        way = DT * self._rates[-1]
        ahead, _ = self._from_seam(np.stack([self._poses[-1] - way, self._poses[-1] + way]))
        return float(ahead[1] - ahead[0]) / (2 * DT)


def springs_as_assembled(scene: Scene) -> dict[str, Spring]:
    """Return a scene's springs, all with the angle or length at which they rest.

    Where the scene does not give it, that is the angle or length in the assembled mechanism.
    """
    mechanism = assemble_scene(scene).mechanism
    # Ropes between two points, tables and formulas have a length, or need none.
    fields = {
        spring.name: ("rest_angle", spring.rest_angle)
        for spring in mechanism.springs
        if not spring.law
    }
    for pulled in mechanism.linear_springs:
        if not pulled.law:
            fields[pulled.name] = "length", pulled.length
    for rope in mechanism.ropes:
        fields[rope.name] = "length", rope.free_length.at(0.0)
    springs = dict(scene.springs)
    for name in springs.keys() & fields.keys():
        key, value = fields[name]
        if getattr(springs[name], key) is None:
            springs[name] = springs[name].model_copy(update={key: value})
    return springs


SERIES = (
    *("time", "poses", "rates", "drive_torques", "drive_forces", "joint_forces", "slot_forces"),
    *("spring_forces", "gear_forces", "gear_torques", "contacts", "bearings", "sleeves"),
    *("energy", "extremes", "joint_impulses"),
)
"""Fields of a result that are joined along time."""


def joined(first: Result, second: Result) -> Result:
    """Return one result of a run and of one that goes on from its end.

    Raises:
        CannotContinueError: the first run can't be continued from its end.
        ValueError: the second run does not go on from there, or can't be joined.

    """
    _require_following(first, second)
    end = float(first.time[-1])
    unknown = first.error.missing or first.error.stopped is not None
    whole = replace(
        _series_of_both(first, later(second, end)),
        outcome=replace(second.outcome, time=second.outcome.time + end),
        # How the first run's error grows in the second was not measured.
        error=first.error if unknown else replace(first.error, stopped=end),
    )
    scene = first_stage(first.scene).changed(run=_run(whole, second.scene.run))
    return replace(whole, scene=whole_scene(scene))


def _series_of_both(first: Result, second: Result) -> Result:
    """Join the histories of a run and of one that begins at its end, with times of the first."""
    seam = _Seam(float(first.time[-1]), (len(first.time), len(second.time)))
    fields: dict[str, Any] = {}
    for member in members(Result):
        if member.name in SERIES:
            before, after = getattr(first, member.name), getattr(second, member.name)
            fields[member.name] = _joined(before, after, member.variable, seam)
    energy, tail, lost = first.energy, second.energy, _lost_between(first, second)
    steps = {"stored": 0.0, "dissipated": max(0.0, lost), "supplied": max(0.0, -lost)}
    for name, step in steps.items():  # the second run counts these energies from its start
        values, more = getattr(energy, name), getattr(tail, name)
        both = np.concatenate([values, values[-1] + step + (more[1:] - more[0])])
        fields["energy"] = replace(fields["energy"], **{name: both})
    frictions: dict[str, FrictionHistory] = {}
    for name in {**first.frictions, **second.frictions}:
        histories = _both(first.frictions, second.frictions, name, None, seam)
        frictions[name] = _rubbed(*histories, seam.end)
    fields["frictions"] = frictions
    return replace(
        first,
        **fields,
        timings={key: x + second.timings.get(key, 0.0) for key, x in first.timings.items()},
        laps=(*first.laps, *second.laps),
        checks=_checks(first, second),
        warnings=tuple(dict.fromkeys([*first.warnings, *second.warnings])),
    )


def _require_following(first: Result, second: Result) -> None:
    """Refuse a second run that does not begin with the end of the first."""
    begin, end = second.scene.initial.clock - first.scene.initial.clock, float(first.time[-1])
    anew = not second.scene.initial.states
    reason = ""
    if first.engine != second.engine:
        reason = f"one is by {first.engine}, the other by {second.engine}"
    elif anew or abs(begin - end) > KNOT_TIME * max(1.0, end):
        why = "it starts anew" if anew else f"it begins at {begin:.9g} s"
        reason = f"{why}, the first ends at {end:.9g} s; see Result.continued"
    else:
        meant, scene = continued(first), second.scene
        keys = [key for key in Scene.model_fields if key != "run"]
        others = [key for key in keys if getattr(meant, key) != getattr(scene, key)]
        reason = f"they differ in {', '.join(others)}" if others else ""
        mechanism = build_mechanism(meant)
        for body in struck_bodies(meant):
            if not reason and carrying_joint(meant, mechanism, body) is None:
                reason = (
                    f"'{body}' is free, and its displacement is told from the start of each run"
                )
    if reason:
        raise ValueError(f"the second run does not go on from the first: {reason}")


class _Seam(NamedTuple):
    """Where two runs meet: the instant (s) on the clock of the first, and the samples of each."""

    end: float
    samples: tuple[int, int]


def _joined(first: Any, second: Any, variable: Variable | None, seam: _Seam) -> Any:
    """Join arrays over time, and columns of touches and extremes, in mappings and dataclasses.

    The sample at which both runs meet is that of the first.
    """
    if isinstance(first, Intervals):
        return _touching(first, second, seam.end)
    if isinstance(first, Mapping):
        return {
            name: _joined(*_both(first, second, name, variable, seam), variable, seam)
            for name in {**first, **second}
        }
    if is_dataclass(first) and not isinstance(first, type):
        parts = {
            m.name: _joined(getattr(first, m.name), getattr(second, m.name), m.variable, seam)
            for m in members(type(first))
        }
        return replace(first, **parts)
    assert variable is not None
    if not variable.dimensions:
        return max(first, second)  # the deepest penetration
    if not isinstance(first, np.ndarray):
        return first  # names
    return np.concatenate([first, second[1:] if variable.dimensions.startswith("time") else second])


def _both(
    first: Mapping[str, Any], second: Mapping[str, Any], name: str, variable: Any, seam: _Seam
) -> tuple[Any, Any]:
    """Entries of a name in both runs; a run without that part gets an entry without values."""
    before, after = first.get(name), second.get(name)
    if before is None:
        return _absent(after, variable, seam.samples[0]), after
    return before, _absent(before, variable, seam.samples[1]) if after is None else after


def _absent(value: Any, variable: Variable | None, samples: int) -> Any:
    """Return the entry of a part that a run does not have, in the form of the other's `value`."""
    if isinstance(value, Intervals):
        return Intervals.of()
    if is_dataclass(value) and not isinstance(value, type):
        parts = {
            m.name: _absent(getattr(value, m.name), m.variable, samples)
            for m in members(type(value))
        }
        return replace(value, **parts)
    assert variable is not None
    if not variable.dimensions:
        return 0.0
    if not isinstance(value, np.ndarray):
        return value  # names
    if variable.dimensions.startswith("time"):
        return np.full((samples, *value.shape[1:]), np.nan)
    return value[:0]


def _touching(first: Intervals, second: Intervals, end: float) -> Intervals:
    """Touches of both runs, which meet at an instant (s).

    A touch of the first run that lasts then is joined with its continuation in the second, if there
    is one; otherwise it ends.
    """
    before, after = list(first), list(second)
    for k, touch in enumerate(before):
        if not touch.lasts:
            continue
        goes_on = (x for x in after if x.begin == end and x.pair == touch.pair and not x.impact)
        last = next(goes_on, None)
        if last is None:
            before[k] = replace(touch, end=end)
            continue
        after.remove(last)
        impulse = touch.impulse + last.impulse
        lost = touch.energy_lost + last.energy_lost
        force = max(touch.peak_force, last.peak_force)
        depth = max(touch.penetration, last.penetration)
        last = replace(last, begin=touch.begin, place=touch.place, impulse=impulse)
        last = replace(last, approach_speed=touch.approach_speed, energy_lost=lost)
        before[k] = replace(last, peak_force=force, penetration=depth)
    return Intervals.of([*before, *after])


def _rubbed(first: FrictionHistory, second: FrictionHistory, seam: float) -> FrictionHistory:
    """Dry friction of both runs, which meet at an instant (s); a rest across it counts once."""
    begin = np.concatenate([first.begin, second.begin])
    end = np.concatenate([np.minimum(first.end, seam), second.end])
    lasting = np.flatnonzero((end[:-1] == seam) & (begin[1:] == seam))
    torque = np.concatenate([first.torque, second.torque[1:]])
    lost = np.nan_to_num(first.lost[-1]) + second.lost[1:]
    return FrictionHistory(
        torque,
        np.concatenate([first.lost, lost]),
        np.delete(begin, lasting + 1),
        np.delete(end, lasting),
    )


def _checks(first: Result, second: Result) -> Checks:
    """Checks of both runs: what the energy balance misses at the end of the first run adds up."""
    missed = abs(float(first.energy.residual[-1])) + second.checks.energy_residual
    both = {
        name: (value, getattr(second.checks, name)) for name, value in vars(first.checks).items()
    }
    largest = {name: max(pair) for name, pair in both.items()}
    largest |= {name: sum(both[name]) for name in ("steps", "newton_iterations")}
    largest |= {name: min(both[name]) for name in ("smallest_step", "steps_per_contact")}
    return Checks(**(largest | {"energy_residual": max(first.checks.energy_residual, missed)}))


def _run(whole: Result, tail: Run) -> Run:
    """Run section of both runs, as a duration or in turns, as the scene of the first has it.

    Its `until` is kept if both runs have the same.
    """
    run, end = whole.scene.run, float(whole.time[-1])
    kept = {"until": run.until if run.until == tail.until else None, "sample": run.sample}
    if run.of is not None and (turned := np.ptp(joint_angle(whole, run.of)[[0, -1]])) > 0:
        most = None if run.at_most is None else end
        return Run(turns=float(turned) / (2 * pi), of=run.of, at_most=most, **kept)
    return Run(duration=end, **kept)

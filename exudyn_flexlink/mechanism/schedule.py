"""The plan of a run: its end, coordinates, accuracy, samples, and the pulses of its drives.

Short pulses of drives by formulas of time are searched before a run, so that steps end within them.
A step and its error estimate only know a drive at the stages. The tolerance decides which pulses
matter: the area of the pulse, times the acceleration by a unit of force at the start, times the
remaining time; for a speed, the area times a length. `drive_mistakes` refuses drives without a
value, and drives that must not jump but do.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from math import ceil, copysign, floor, hypot, inf, isfinite, log10, pi, sqrt
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves import closing
from exudyn_flexlink.expressions import Addend, NoValueError, pole, pulses, resolved
from exudyn_flexlink.laws import Impulse, OneSided
from exudyn_flexlink.mechanism.assembly import Assembly, beyond_redundant, rubbing_joints
from exudyn_flexlink.mechanism.closing import CLOSED
from exudyn_flexlink.mechanism.constraints import anchor_jacobian, motor_place, motor_speed, turning
from exudyn_flexlink.mechanism.contacts import swings
from exudyn_flexlink.mechanism.dynamics import contact_mass, pushed
from exudyn_flexlink.mechanism.joints import GROUND, Channel, Contact, RopeContact
from exudyn_flexlink.mechanism.model import Mechanism, Motor, Size, Until
from exudyn_flexlink.mechanism.prescribed import Applied, Formula, Prescribed, Ramp, SpeedOf, Tabled
from exudyn_flexlink.rounding import NEGLIGIBLE
from exudyn_flexlink.scene import Scene, SpeedDrive, SplineSpec
from exudyn_flexlink.source import KeyPath, Mistake

SHARE = 0.1  # of the tolerance: largest effect of a hidden pulse, or unreported move of a place
WITHOUT_TOLERANCE = 1e-6  # of the mechanism's reach: the tolerance if the scene gives a step


def with_pulses(assembly: Assembly, tolerance: float | None, end: float) -> Assembly:
    """Add pulses up to `end` (s) to the mechanism of an assembly; `tolerance` is in m."""
    mechanism = assembly.mechanism
    if not isfinite(end):
        return assembly
    length = max(part.reach for part in mechanism.parts) or 1.0
    allowed = SHARE * (tolerance or WITHOUT_TOLERANCE * length)
    knots, texts, motors = list[FloatArray](), list[str](), list[Motor]()
    for motor in mechanism.speed_motors:
        formula = motor.speed.motion if isinstance(motor.speed, SpeedOf) else motor.speed
        if isinstance(formula, Formula):
            expression, clock = formula.expression, formula.clock
            terms = expression.addends if formula is motor.speed else expression.rate_addends
            cost = 1.0 if motor.slide else length
            edges, short, left = _parts(formula, terms, end, (cost, 0.0), allowed)
            knots.append(short)
            texts += _warnings(motor.name, left)
            if formula is motor.speed:
                speed = Formula(expression, clock, (clock + edges).tolist())
                motors.append(replace(motor, speed=speed))
                continue
        motors.append(motor)
    for rope in mechanism.ropes:
        if isinstance(rope.free_length, Formula):
            terms = rope.free_length.expression.rate_addends
            _, short, left = _parts(rope.free_length, terms, end, (1.0, 0.0), allowed)
            knots.append(short)
            texts += _warnings(rope.name, left)
    for name, size, rows, alone in _loads(assembly):
        if isinstance(size.value, Formula):
            terms = [term for term in size.value.expression.addends if term.of_time]
            mobility = max(alone, *(_moved(assembly, row) for row in rows))
            _, short, left = _parts(size.value, terms, end, (mobility * end, -mobility), allowed)
            knots.append(short)
            texts += _warnings(name, left)
    all_knots = np.unique(np.concatenate([np.zeros(0), *knots]))
    within, unfound = tuple(all_knots.tolist()), tuple(dict.fromkeys(texts))
    return replace(
        assembly,
        mechanism=replace(mechanism, speed_motors=tuple(motors), pulses=within, unfound=unfound),
    )


def _parts(
    formula: Formula,
    terms: list[Addend],
    end: float,
    cost: tuple[float, float],
    allowed: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Edges (s) of the parts of all terms, edges of pulses, and parts (n, 2) not searched.

    `cost` is the error (m) by an undetected unit of area: at time 0, and its change with time.
    """
    clock = formula.clock
    bends = np.array([0.0, *formula.knots(end), end]) + clock
    edges, short, left = [bends], [np.zeros(0)], [np.zeros((0, 2))]
    for term in terms:
        all_parts, rest = resolved(term, bends, lambda t: cost[0] + cost[1] * (t - clock), allowed)
        edges.append(all_parts)
        numbers = np.searchsorted(all_parts, bends).tolist()  # a step ends at every bend
        short += [pulses(all_parts[i : j + 1]) for i, j in pairwise(numbers) if j > i + 1]
        left.append(rest)
    of_pulses = np.unique(np.concatenate(short)) - clock
    return np.unique(np.concatenate(edges)) - clock, of_pulses, np.concatenate(left) - clock


def _warnings(name: str, left: FloatArray) -> Iterator[str]:
    if len(left):
        shortest = float((left[:, 1] - left[:, 0]).min())
        yield (
            f"drive '{name}' varies too fast to look for pulses shorter than {shortest:.2g} s from "
            f"{left[:, 0].min():.4g} to {left[:, 1].max():.4g} s: step control may miss one there"
        )


def _loads(assembly: Assembly) -> Iterator[tuple[str, Size, list[FloatArray], float]]:
    """Sizes of torques and forces, generalised forces by unit, and mobility without joints.

    The mobility is the acceleration (m/s^2) of the body by a unit, without joints. With joints the
    body may be in line with the force at the start, but not later.
    """
    mechanism, q = assembly.mechanism, assembly.state.q
    masses = {
        body: sum(mechanism.parts[part].mass for part in parts) or inf
        for body, parts in mechanism.bodies.items()
    }
    for motor in mechanism.torque_motors:
        row, alone = np.zeros(q.shape), 0.0
        for part, sign in ((motor.first, -1.0), (motor.second, 1.0)):
            if part != GROUND:
                row[part, 2] += sign
                rigid = mechanism.parts[part]
                alone = max(alone, 1.0 / (masses[rigid.body] * (rigid.reach or 1.0)))
        yield motor.name, motor.size, [row.ravel()], alone
    for force in mechanism.forces:
        rows = list(anchor_jacobian(force.point, q).reshape(2, -1))
        alone = 1.0 / masses[mechanism.parts[force.point.part].body]
        yield from ((force.name, size, rows, alone) for size in force.sizes)


def _moved(assembly: Assembly, force: FloatArray) -> float:
    """Largest acceleration (m/s^2) of a point at the start by a generalised force (3 parts,)."""
    state, mechanism = assembly.state, assembly.mechanism
    motion = pushed(mechanism, state.q, state.places, force)
    reach = np.array([part.reach or 1.0 for part in mechanism.parts])
    return float((np.hypot(motion[:, 0], motion[:, 1]) + reach * np.abs(motion[:, 2])).max())


FEWEST = 2000  # samples of a run, however short: enough for a figure
PER_TURN = 500  # samples per turn of a drive, or of a body that turns at the start
PER_SWING = 20  # samples per swing of a struck lever, or of a pendulum as long as a part
LOOKS = 100  # instants at which the largest speed of a drive is searched
UNKNOWN = 10  # times as many samples if turns end the run at an unknown time
KEPT_MEMORY = 1e9  # bytes of memory for samples if the scene does not give their number
BYTES_OF_SAMPLE, BYTES_OF_PART, BYTES_OF_PAIR, BYTES_OF_CONTACT = 1500, 250, 40, 100
WALL_SHARE = 0.5  # of the steps of a strike: touches of a wall last longer
ELASTIC = 0.99  # restitution from which on impacts must not lose energy by steps
ELASTIC_STEPS = 2.0  # times as many steps: 60 lose 1e-5 of the energy of an impact, 120 an eighth
# Roundings of a position at the mechanism's extent. Two turns of the paper's mechanism with its
# strikes by both engines differ by 1.5e-13 m, or 4000 roundings, however small the tolerance
# (`scripts/rounding.py`). Without a strike they differ by 4e-15 m; then steps can't be shorter.
ROUNDINGS = 5e3
NO_SMALL_PART = 0.1  # of the mechanism's extent: a larger error hides the motion


@dataclass(frozen=True)
class TurnGoal:
    """Ends a run when the second part has turned by `turned` (rad, positive) on the first.

    Either sense of rotation counts, from the angle `start` (rad) on.
    """

    first: int
    second: int
    start: float
    turned: float

    def left(self, q: list[float]) -> float:
        """Angle still to turn, rad, at coordinates of all parts in a row."""
        return self.turned - abs(self._relative(q) - self.start)

    def rate(self, q: list[float], v: list[float]) -> float:
        """Speed towards the goal, rad/s: away from the start, to the side where the part is."""
        speed, done = self._relative(v), self._relative(q) - self.start
        return copysign(1.0, done) * speed if done else abs(speed)

    def _relative(self, x: list[float]) -> float:
        second = x[3 * self.second + 2] if self.second != GROUND else 0.0
        return second - (x[3 * self.first + 2] if self.first != GROUND else 0.0)


def end_of_run(scene: Scene, mechanism: Mechanism) -> float:
    """Latest end of a run, s: its duration, or the time at which a drive has made its turns.

    Turns of a joint without a speed drive, or with a varying or zero speed, end at `at_most`.
    """
    run = scene.run
    if run.duration is not None:
        return run.duration
    return min(_turns_made(scene, mechanism), run.at_most or inf)


def steady_drive(scene: Scene, mechanism: Mechanism) -> Ramp | None:
    """Ramp of a constant speed of the joint whose turns end a run: their end is known before.

    None without such a drive: the turns may never be made.
    """
    for motor in mechanism.speed_motors:
        drive = scene.drives.get(motor.name)
        if isinstance(drive, SpeedDrive) and drive.joint == scene.run.of:
            return motor.speed if isinstance(motor.speed, Ramp) else None
    return None


def cut_off(scene: Scene, mechanism: Mechanism) -> float:
    """Angle, rad, that a steady speed drive still has to turn when `at_most` ends the run."""
    run, ramp = scene.run, steady_drive(scene, mechanism)
    if ramp is None or run.at_most is None:
        return 0.0
    if run.at_most >= _turns_made(scene, mechanism) * (1 - 1e-12):
        return 0.0
    return 2 * pi * (run.turns or 0.0) - abs(ramp.integral(run.at_most))


def _turns_made(scene: Scene, mechanism: Mechanism) -> float:
    """Time, s, at which a speed drive has made the turns; inf if it never does."""
    turned = 2 * pi * (scene.run.turns or 0.0)
    ramp = steady_drive(scene, mechanism)
    if ramp is None or not ramp.value:
        return inf
    return ramp.time_of(turned if ramp.value > 0 else -turned)


def turn_goal(scene: Scene, assembly: Assembly) -> TurnGoal | None:
    """Turns that end a run at an unknown time; None if the time is known before."""
    run, mechanism = scene.run, assembly.mechanism
    if run.turns is None or steady_drive(scene, mechanism) is not None:
        return None
    pin = next(pin for pin in mechanism.hinges if pin.name == run.of)
    first, second = pin.first.part, pin.second.part
    start = float(turning(first, second, assembly.state.q))
    return TurnGoal(first, second, start, 2 * pi * run.turns)


def until_mistakes(until: Until, sensed: Sequence[FloatArray], path: KeyPath) -> list[Mistake]:
    """Refuse a run that is over at its start, by the senses (1,) of its `until` at time 0.

    Raises:
        NoValueError: the formula has no value at time 0.

    """
    start = np.zeros(1)
    value = float(until.value.values(start, sensed)[0])
    if value < -NEGLIGIBLE * until.size(start, sensed):
        return []
    message = f"is {value:.4g} as the run begins: it must be below 0, and ends the run as it rises"
    return [Mistake(path, message, "turn its sign, or begin elsewhere")]


def formulation(scene: Scene) -> str:
    """Formulation of the scene for Exudyn: the requested one, or the fastest.

    Minimal coordinates are faster; error control chooses their steps. A fixed step is for redundant
    coordinates. These have no impulses and no points on curves, and friction of joints does not
    hold there.
    """
    asked = scene.solver.formulation
    return asked if asked != "auto" else fittest(scene)


def fittest(scene: Scene) -> str:
    """Formulation that 'auto' means."""
    holds = scene.accuracy.step is None or any(rubbing_joints(scene)) or beyond_redundant(scene)
    return "minimal" if holds else "redundant"


def sample_times(scene: Scene, mechanism: Mechanism, end: float) -> FloatArray:
    """Evenly spaced instants, s, from 0 to the end, with the end."""
    interval = scene.run.sample or kept_interval(scene, mechanism, end)
    count = int(end / interval * (1 + 1e-12))
    grid = interval * np.arange(count + 1)
    # If the end is on the grid within rounding, it replaces the grid's last instant.
    return np.append(grid if end - grid[-1] > 1e-9 * interval else grid[:-1], end)


def sample_bytes(mechanism: Mechanism) -> int:
    """Memory of a sample until the run is saved, bytes: the larger one of both engines.

    It was measured with 10 to 40 rods, with and without walls, by runs of different sample counts.
    """
    walls = len(mechanism.contacts_and_pairs) - len(mechanism.touching)
    kept = BYTES_OF_PART * len(mechanism.parts) + BYTES_OF_PAIR * walls
    return BYTES_OF_SAMPLE + kept + BYTES_OF_CONTACT * len(mechanism.touching)


def kept_interval(scene: Scene, mechanism: Mechanism, end: float) -> float:
    """Time between samples, s, a round number: it shows the motion, unless memory is short."""
    wanted = _round(wanted_interval(scene, mechanism, end), down=True)
    least = end * sample_bytes(mechanism) / KEPT_MEMORY
    return wanted if wanted >= least else _round(least, down=False)


def wanted_interval(scene: Scene, mechanism: Mechanism, end: float) -> float:
    """Time between samples, s, that shows the motion, as far as it is known before a run."""
    turns = scene.run.turns is not None and steady_drive(scene, mechanism) is None
    unknown = turns or scene.ending[1] is not None
    needs = [end / (FEWEST * (UNKNOWN if unknown else 1)), *_needs(scene, mechanism, end)]
    return min(needs)


def _needs(scene: Scene, mechanism: Mechanism, end: float) -> Iterator[float]:
    looks = np.linspace(0.0, end, LOOKS)
    speeds = [
        float(np.abs(motor.speed.values(looks)).max())
        for motor in mechanism.speed_motors
        if motor.slide is None
    ]
    for speed in (*speeds, *scene.initial.speeds.values()):
        if speed:
            yield 2 * pi / abs(speed) / PER_TURN
    for time in swings(mechanism):
        if isfinite(time):
            yield 2 * pi * time / PER_SWING
    weight = hypot(*mechanism.gravity)
    reach = min((part.reach for part in mechanism.parts if part.reach > 0), default=inf)
    if weight > 0 and isfinite(reach):
        yield 2 * pi * sqrt(reach / weight) / PER_SWING


def _round(interval: float, *, down: bool) -> float:
    """Round an interval (s) down or up to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** floor(log10(interval))
    steps = [float(f"{factor * power:.0e}") for factor in (1, 2, 5, 10)]
    fit = [step for step in steps if (step <= interval * (1 + 1e-9)) == down or step == interval]
    return max(fit) if down else min(fit)


# --- resolution ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class Resolution:
    """Half the period of a contact's stiffness with the least mass, and the step, s."""

    half_period: float
    step: float

    def steps(self, given: float | None) -> float:
        """Number of steps in a touch, with a `given` step (s), if any and if it is shorter."""
        return self.half_period / min(self.step, given or inf)


def resolutions(
    scene: Scene,
    assembly: Assembly,
    half_period_of: Callable[[Contact | Channel], float] | None = None,
) -> list[Resolution]:
    """Resolutions of contacts and bearings, then of sleeves; instantaneous contacts have none.

    `half_period_of` returns half the period (s) of a contact; `half_period` by default.
    """
    half_period_of = half_period_of or partial(half_period, assembly)
    asked, by_contact = scene.solver.steps_per_contact, []
    for contact in assembly.mechanism.touching:
        if not isinstance(contact.law, Impulse | OneSided):
            half = half_period_of(contact)
            steps = asked * (ELASTIC_STEPS if contact.law.restitution > ELASTIC else 1.0)
            by_contact.append(Resolution(half, half / steps))
    for channel in assembly.mechanism.channels:
        half = half_period_of(channel)
        by_contact.append(Resolution(half, half / (WALL_SHARE * asked)))
    return by_contact


def half_period(assembly: Assembly, contact: Contact | Channel) -> float:
    """Half the period, s, of a contact's stiffness with the least mass; inf if it is rigid."""
    if isinstance(contact.law, Impulse):
        return inf
    state = assembly.state
    mass = contact_mass(assembly.mechanism, contact, state.q, state.places)
    return contact.law.half_period(mass)


def half_periods(assembly: Assembly) -> list[float]:
    """Half periods (s) of all contacts and bearings, then of all pairs of link and guide."""
    mechanism = assembly.mechanism
    halves = [half_period(assembly, contact) for contact in mechanism.touching]
    for channel in mechanism.channels:
        halves += [half_period(assembly, channel)] * len(channel.contacts)
    return halves


def extent(assembly: Assembly) -> float:
    """Distance (m) from the origin of coordinates to the farthest point, at the start."""
    q = assembly.state.q
    reaches = [part.reach for part in assembly.mechanism.parts]
    return float((np.hypot(q[:, 0], q[:, 1]) + reaches).max())


def least_tolerance(assembly: Assembly) -> float:
    """Least tolerance of positions (m) that a run can keep, rounded up to one digit."""
    least = ROUNDINGS * float(np.finfo(float).eps) * extent(assembly)
    power = floor(log10(least))
    return float(f"{ceil(least / 10.0**power)}e{power}")


def coarse_tolerance(scene: Scene, assembly: Assembly) -> Iterator[str]:
    """Warn if the tolerance of a scene is large against its mechanism."""
    asked = scene.accuracy.tolerance
    if asked is not None and asked > NO_SMALL_PART * extent(assembly):
        yield (
            f"the tolerance of {asked:.3g} m is more than {NO_SMALL_PART:.0%} of the size of the "
            f"mechanism, {extent(assembly):.3g} m; is a unit missing, as in '1 um'?"
        )


PARTS_LOOKED_AT = (
    200  # parts of a run; values are checked at their ends, which include halves and tenths
)
BESIDE = 1e-9  # s: values are checked at this distance on both sides of a knot
JUMP = 1e-6  # of the largest value: a larger difference is no rounding
LEAP = 1e-3  # of the fastest part: three times the error of coarse runs by redundant coordinates
STILL = 1e-2  # rad/s, m/s or m: smaller values may be errors of a run


def drive_mistakes(mechanism: Mechanism, end: float) -> list[Mistake]:
    """Refuse drives by time that have no value before `end` (s), or that jump but must not.

    `end` is the latest end of the run.
    """
    mistakes: list[Mistake] = []
    for motor in mechanism.speed_motors:
        path = ("drives", motor.name, "value")
        missing = list(_missing(path, motor.speed, end, motor.speed.rates))
        mistakes += missing or _jumps(path, motor.speed, end)
    for rope in mechanism.ropes:
        path = ("springs", rope.name, "length")
        missing = list(_missing(path, rope.free_length, end, rope.free_length.rates))
        mistakes += missing or [*_jumps(path, rope.free_length, end), *_used_up(path, rope, end)]
    for torque in mechanism.torque_motors:
        if not torque.size.senses:
            mistakes += _missing(("drives", torque.name, "value"), torque.size.value, end)
    for force in mechanism.forces:
        for i, size in enumerate(force.sizes):
            if not size.senses:
                mistakes += _missing(("drives", force.name, "value", i), size.value, end)
    return mistakes


def _missing(
    path: KeyPath, function: Applied, end: float, *others: Callable[[FloatArray], FloatArray]
) -> Iterator[Mistake]:
    """Refuse a function of time without a value, or without a value of its `others`."""
    if isinstance(function, Ramp) or end == inf:
        return
    table = function.motion if isinstance(function, SpeedOf) else function
    if isinstance(table, Tabled):
        last = table.times[-1]
        if last < end * (1 - 1e-12):
            message = f"the table ends at {last:g} s, the run at {end:g} s"
            yield Mistake(path, message, "more rows, or a shorter run")
        return
    try:
        looks = np.concatenate([_looks(end), *_sides(function, end)]).clip(0.0, end)
        for values in (function.values, *others):
            values(looks)
        if isinstance(function, SpeedOf):
            function.integrals(looks)
        if isinstance(table, Formula):
            _require_bounds(table, end)
    except NoValueError as error:
        yield Mistake(path, str(error), "where(t < 1, one, other) takes other formulas elsewhere")


def _require_bounds(formula: Formula, end: float) -> None:
    """Refuse a formula of time that has a pole, which values on both sides do not show.

    Raises:
        NoValueError: the formula grows without bound.

    """
    for addend in formula.expression.addends:
        time = pole(addend, formula.clock, formula.clock + end)
        if time is not None:
            raise NoValueError(formula.expression.text, time)


def _looks(end: float) -> FloatArray:
    """Instants (n,), s, of a run up to `end` at which values are checked."""
    return np.linspace(0.0, end, PARTS_LOOKED_AT + 1)


def _sides(function: Applied, end: float) -> tuple[FloatArray, FloatArray]:
    """Instants (knots,) s just before and just after every knot."""
    knots = np.array(function.knots(end))
    beside = np.maximum(BESIDE, BESIDE * knots)
    return knots - beside, knots + beside


def _jumps(path: KeyPath, speed: Prescribed, end: float) -> Iterator[Mistake]:
    """Refuse jumps of a speed, an angle or a length: they would need an infinite force."""
    if isinstance(speed, (Ramp, Tabled)):
        return
    name = "value" if path[0] == "springs" else "speed"
    kinds = [(name, speed.values, speed.rates)]
    if isinstance(speed, SpeedOf):
        kinds = [("value", speed.motion.values, speed.values), *kinds]
    first, last = _sides(speed, end)
    for name, values, rates in kinds:
        before, after = values(first), values(last)
        steep = np.maximum(np.abs(rates(first)), np.abs(rates(last)))
        least = 2 * (last - first) * steep + JUMP * np.abs(values(_looks(end))).max()
        jumps = np.flatnonzero(np.abs(after - before) > least)
        if len(jumps):
            k = jumps[0]
            time = (first[k] + last[k]) / 2
            yield Mistake(
                path,
                f"the {name} jumps from {before[k]:.6g} to {after[k]:.6g} at t = {time:.6g} s",
                "formulas must meet where one follows the other",
            )
            return


def _used_up(path: KeyPath, rope: RopeContact, end: float) -> Iterator[Mistake]:
    """Refuse a rope whose length falls to zero."""
    looks = _looks(end)
    lengths = rope.free_length.values(looks)
    if lengths.min() <= 0:
        k = int(np.argmax(lengths <= 0))
        message = f"is {lengths[k]:.4g} m at t = {looks[k]:.4g} s: a rope's length is above 0"
        yield Mistake(path, message, "end the run, or the winding, before")


def input_notes(scene: Scene, assembly: Assembly) -> Iterator[str]:
    """Notes on splines that their last point closes, on places moved, and on drives that jump."""
    mechanism = assembly.mechanism
    for name, curve in scene.curves.items():
        for gap in _repeats(curve):
            about = "closes the curve, and is left out"
            yield f"curves.{name}: the last point, {gap:.3g} m from the first, {about}"
    if scene.initial.states:
        yield from list(_set_otherwise(scene, mechanism)) or _closed_otherwise(scene, assembly)
    held = (
        {} if scene.initial.at_rest else scene.initial.positions
    )  # at a rest they are only the start of a search
    for body, given in held.items():
        place = assembly.state.q[mechanism.bodies[body][0], :2]
        away = float(np.hypot(*(place - given)))
        if away > SHARE * (scene.accuracy.tolerance or CLOSED):
            yield (
                f"initial.positions.{body}: moved by {away:.2g} m, to [{place[0]:.12g}, "
                f"{place[1]:.12g}], which its joints allow"
            )


def _set_otherwise(scene: Scene, mechanism: Mechanism) -> Iterator[str]:
    """Note drives whose place or speed differs from the end of the run that the scene continues."""
    q, v = _states(scene, mechanism)
    for motor in mechanism.speed_motors:
        unit, axes = ("m", slice(0, 2)) if motor.slide else ("rad", slice(2, 3))
        largest = np.abs(v[:, axes]).max(), np.abs(q[:, :2]).max() if motor.slide else 1.0
        speeds = f"{unit}/s", motor_speed(motor, q, v), motor.speed.at(0.0), largest[0]
        places = unit, motor_place(motor, q), motor.start, largest[1]
        for of, was, now, size in (speeds, places):
            if now is not None and abs(now - was) > LEAP * max(abs(now), size, STILL):
                yield (
                    f"drives.{motor.name}: sets {now:.6g} {of} where the run that this one goes on "
                    f"from had {was:.6g} {of}: it jumps as it begins"
                )


def _closed_otherwise(scene: Scene, assembly: Assembly) -> Iterator[str]:
    """Note bodies that joints move away from the end of the run that the scene continues."""
    mechanism = assembly.mechanism
    given, _ = _states(scene, mechanism)
    moves = np.hypot(*(assembly.state.q - given)[:, :2].T)
    of_bodies = {body: moves[list(parts)].max() for body, parts in mechanism.bodies.items()}
    farthest, away = max(of_bodies.items(), key=lambda item: item[1])
    if away > SHARE * (scene.accuracy.tolerance or CLOSED):
        yield (
            f"initial.states: joints are not where the run that this one goes on from had them: "
            f"{farthest} is moved by {away:.2g} m as it begins"
        )


def _states(scene: Scene, mechanism: Mechanism) -> tuple[FloatArray, FloatArray]:
    """Coordinates and velocities (parts, 3) from which a scene goes on."""
    rows = [row for name in mechanism.bodies for row in scene.initial.states[name]]
    q, v = np.split(np.array(rows, dtype=float), 2, axis=1)
    return q, v


def _repeats(curve: Any) -> Iterator[float]:
    """Distances, m, of first and last points of splines in a curve that drop the last point."""
    if isinstance(curve, SplineSpec):
        points = np.array(curve.points)
        if len(closing(points, curve.closed)[0]) < len(points):
            yield float(np.linalg.norm(points[-1] - points[0]))
    for inner in (*getattr(curve, "pieces", ()), *getattr(curve, "curves", ())):
        yield from _repeats(inner)

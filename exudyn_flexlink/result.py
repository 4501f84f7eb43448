"""The result of a run: sampled motion, forces, energies, events, checks, errors, and outcome.

Contacts are intervals, each from the first touch to the separation; so are rests of joints. Errors
of points and forces are measured by a second run.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cached_property
from math import inf, isfinite
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.arguments import number, takes
from exudyn_flexlink.arrays import BoolArray, FloatArray, IntArray, Variable, members
from exudyn_flexlink.quantities import Dimension
from exudyn_flexlink.scene import FrozenMapping, Scene


@dataclass(frozen=True)
class Interval:
    """One contact of a point and a face, from the first touch to the separation.

    `begin` and `end` are in s. If the contact still touches at the end of the run, `end` is inf,
    and impulse and energy count up to the end of the run. `place` and `end_place` (m) are along the
    face from its start. `approach_speed` and `separation_speed` (m/s) are those along its normal at
    begin and end. `impulse` (N s) is that of the normal force; `energy_lost` (J) includes friction.
    `peak_force` (N) and `penetration` (m) are the largest. An impact, under an impulse law, begins
    and ends at one instant: its force is inf, `motor_work` (J) is the work of a speed drive in it,
    and `tangential_impulse` (N s) that of friction on the striking point, positive in the direction
    of growing places. Both are 0 in a touch that takes time. `slides_off` tells that the point slid
    off an end of the face while it pressed. `pair` is an index into the `pairs` of a sleeve; 0 for
    a contact of the scene.
    """

    begin: float
    end: float = inf
    place: float = 0.0
    end_place: float = 0.0
    approach_speed: float = 0.0
    separation_speed: float = 0.0
    impulse: float = 0.0
    energy_lost: float = 0.0
    peak_force: float = 0.0
    penetration: float = 0.0
    motor_work: float = 0.0
    slides_off: bool = False
    pair: int = 0
    tangential_impulse: float = 0.0

    @property
    def lasts(self) -> bool:
        """Whether the contact has no end within the run."""
        return not isfinite(self.end)

    @property
    def impact(self) -> bool:
        """Whether the contact is an impulse without duration."""
        return not isfinite(self.peak_force)


@dataclass(frozen=True)
class Intervals:
    """Every touch of a contact of the scene, or of all pairs of a sleeve.

    Columns (K,) of the fields of `Interval`, in order of `begin`. Events, strikes, tables, figures
    and warnings are made from them.
    """

    begin: Annotated[FloatArray, Variable(".", "s", "first touch")]
    end: Annotated[FloatArray, Variable(".", "s", "separation; inf: lasts")]
    place: Annotated[FloatArray, Variable(".", "m", "place along the face at begin")]
    end_place: Annotated[FloatArray, Variable(".", "m", "place along the face at end")]
    approach_speed: Annotated[FloatArray, Variable(".", "m/s", "normal speed at begin")]
    separation_speed: Annotated[FloatArray, Variable(".", "m/s", "normal speed at end")]
    impulse: Annotated[FloatArray, Variable(".", "N s", "impulse of the normal force")]
    energy_lost: Annotated[FloatArray, Variable(".", "J", "energy lost, friction included")]
    peak_force: Annotated[FloatArray, Variable(".", "N", "largest force; inf: an impact")]
    penetration: Annotated[FloatArray, Variable(".", "m", "largest penetration")]
    motor_work: Annotated[FloatArray, Variable(".", "J", "work of a drive in an impact")]
    slides_off: Annotated[BoolArray, Variable(".", "", "slid off an end of the face", kind=bool)]
    pair: Annotated[IntArray, Variable(".", "1", "pair of a sleeve, from 0", kind=int)]
    tangential_impulse: Annotated[
        FloatArray, Variable(".", "N s", "impulse of friction in an impact")
    ]

    @classmethod
    def of(cls, intervals: Iterable[Interval] = ()) -> Intervals:
        """Return intervals as columns, in order of their begins."""
        rows = sorted(intervals, key=lambda row: (row.begin, row.pair))
        kinds = {member.name: member.variable.kind for member in members(cls) if member.variable}
        columns: dict[str, NDArray[Any]] = {
            name: np.array([getattr(row, name) for row in rows], kind)
            for name, kind in kinds.items()
        }
        return cls(**columns)

    def __len__(self) -> int:
        return len(self.begin)

    def __iter__(self) -> Iterator[Interval]:
        columns = [getattr(self, column.name).tolist() for column in fields(Interval)]
        return (Interval(*row) for row in zip(*columns, strict=True))

    def where(self, chosen: NDArray[Any]) -> Intervals:
        """Return the intervals that `chosen`, a mask or indices, selects."""
        return Intervals(**{c.name: getattr(self, c.name)[chosen] for c in fields(Intervals)})

    def lasting(self, time: FloatArray) -> IntArray:
        """Number of intervals that contain instants (N,), s; begin and end belong to them."""
        begun = np.searchsorted(np.sort(self.begin), time, side="right")
        return np.asarray(begun - np.searchsorted(np.sort(self.end), time, side="left"))

    def until(self, last: float) -> FloatArray:
        """Ends (K,), s; `last` if an interval lasts longer."""
        return np.minimum(self.end, last)


@dataclass(frozen=True)
class FrictionHistory:
    """Dry friction in a joint: on its second body (N m, along a slide N), with the energy lost.

    The joint rests from `begin` to `end` (s); inf if it still rests at the end of the run. In
    redundant coordinates friction does not hold: the joint creeps and never rests.
    """

    torque: Annotated[FloatArray, Variable("time", "N m", "friction in a joint")]
    lost: Annotated[FloatArray, Variable("time", "J", "energy lost by friction in a joint")]
    begin: Annotated[FloatArray, Variable(".", "s", "begin of a rest")]
    end: Annotated[FloatArray, Variable(".", "s", "end of a rest")]

    def rest_until(self, end: float) -> float:
        """Time (s) at rest up to the end (s) of a run."""
        return float(np.sum(np.minimum(self.end, end) - self.begin))


@dataclass(frozen=True)
class ForceSpread:
    """Deviation of a force from a reference at some instants; N, or N m of a torque.

    `largest`, at the instant `at` (s); `rms`, the root of the mean square; `size`, the largest
    value of the force itself.
    """

    largest: float
    at: float
    rms: float
    size: float

    @property
    def relative(self) -> float:
        """The largest deviation as a part of the force's size; 0 if both are zero."""
        return self.largest / self.size if self.size > 0 else 0.0

    def times(self, factor: float, least: float = 0.0) -> ForceSpread:
        """Return the deviation times `factor`, and no less than a part `least` of the size."""
        largest, rms = (max(factor * x, least * self.size) for x in (self.largest, self.rms))
        return ForceSpread(largest, self.at, rms, self.size)


@dataclass(frozen=True)
class ForceDeviation:
    """Deviation of a force in `unit`, N or N m, from that of another run, or from the truth.

    `free` is that without contact, `touching` that with contact, in both runs; None without such an
    instant. The force of a contact is a steep function of time. So each of its touches is compared
    as if it began at the same instant in both runs, and `instants` (s) is the difference of begins
    and ends of touches.
    """

    unit: str
    free: ForceSpread | None
    touching: ForceSpread | None
    instants: float | None = None

    def times(self, factor: float, least: float = 0.0) -> ForceDeviation:
        """Return the deviation times `factor`, and no less than a part `least` of the force."""
        free, touching = (part and part.times(factor, least) for part in (self.free, self.touching))
        instants = None if self.instants is None else factor * self.instants
        return ForceDeviation(self.unit, free, touching, instants)


@dataclass(frozen=True)
class MeasuredError:
    """Error of a run, measured by the distance from a second run of the scene.

    `largest` (m) is the largest error of the `points`, at the point `worst`, up to `known_until`;
    `limit` (m) is the tolerance that was asked for. From `exceeds_from` (s) on an error may be
    larger than the limit. From `horizon` (s) on both runs are different, and only statistics hold.
    Both are None without such an instant. `stopped` (s) is the end of a second run that stopped
    before the end of the first, else None; `other` (m) is its tolerance. `forces` are by name, see
    `observables.forces`, up to the same instant. `missing` is the reason if nothing was measured,
    else empty.
    """

    points: tuple[str, ...] = ()
    worst: str = ""
    limit: float = inf
    largest: float = inf
    exceeds_from: float | None = None
    horizon: float | None = None
    stopped: float | None = None
    other: float = inf
    forces: Mapping[str, ForceDeviation] = field(default_factory=dict)
    missing: str = ""

    @property
    def known_until(self) -> float:
        """Instant (s) up to which errors are known: the horizon, or where a run stopped; inf."""
        return min(inf if end is None else end for end in (self.horizon, self.stopped))

    def later(self, by: float) -> MeasuredError:
        """Return the error with its instants `by` (s) later."""
        instants = (self.exceeds_from, self.horizon, self.stopped)
        exceeds, horizon, stopped = (t if t is None else t + by for t in instants)
        return replace(self, exceeds_from=exceeds, horizon=horizon, stopped=stopped)


NOT_ASKED = MeasuredError(missing="no second run was made")
"""The error of a single run, which a second run may still measure."""


INTERRUPTED = "interrupted"
"""Reason of an outcome that the user ended with Ctrl-C."""

POSES = {"x": "m", "y": "m", "angle": "rad"}
RATES = {"x": "m/s", "y": "m/s", "angle": "rad/s"}
FORCES = {"x": "N", "y": "N"}
IMPULSES = {"x": "N s", "y": "N s"}
"""Components of arrays and their units, in the order of the last axis."""

Series = Mapping[str, FloatArray]
NO_SERIES: Series = FrozenMapping()


@dataclass(frozen=True)
class Event:
    """An event at an instant: begin or end of a contact, an impact, a lap, or a stage.

    `kind` is one of ``contact begins``, ``contact ends``, ``leaves the face`` (the point slides off
    an end of the face while pressed to it), ``impact`` (speeds jump, under an impulse law), ``lap``
    (a slot's point passes the seam of its closed curve, see `curves.laps`), ``stage`` (a stage of
    the run begins). `name` is that of the contact or joint in the scene. `details` are SI numbers
    by name: place and approach_speed at the begin of a contact; place, separation_speed, impulse,
    energy_lost and peak_force at its end; all of these except peak_force, and motor_work and
    tangential_impulse, of an impact; the number of the lap that begins.
    """

    time: float
    kind: str
    name: str
    details: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Outcome:
    """How a run ended: completed, or stopped at `time` (s) for a reason, with advice.

    `until` tells whether the formula `run.until` reached 0; None without a formula.
    """

    completed: bool
    time: float
    reason: str = ""
    advice: str = ""
    until: bool | None = None

    @property
    def ending(self) -> str:
        """The end of the run in words."""
        if self.completed:
            return "completed"
        return f"stopped at t = {self.time:.4g} s: {self.reason}"


@dataclass(frozen=True)
class Integrator:
    """The method that made a run's steps, and its order.

    `tolerance` (m) is that of this run, `step` (s) the one that the scene gives; None if steps do
    not follow it. `spectral_radius` is the numerical damping of a method that has one.
    """

    method: str
    order: int
    tolerance: float | None = None
    step: float | None = None
    spectral_radius: float | None = None


@dataclass(frozen=True)
class EngineSettings:
    """Settings by which an engine solved a scene; None if it does not use a setting.

    `formulation` is that of Exudyn, `elements` is the number of each beam. `steps_per_contact` is
    the requested number in half a period; `contact_step` (s) follows from the shortest half period.
    """

    integrator: Integrator
    formulation: str | None = None
    elements: int | None = None
    steps_per_contact: int | None = None
    contact_step: float | None = None


@dataclass(frozen=True)
class ContactHistory:
    """A contact of a point and a face, or of two circles: its touches, and samples.

    For a hinge's stop gaps are angles (rad) and forces are torques (N m), also in its touches.

    Gap (m, positive when apart), place along the face, or around the second circle, (m) and force
    (N) at the samples.
    """

    gap: Annotated[FloatArray, Variable("time", "m", "gap of what may touch")]
    place: Annotated[FloatArray, Variable("time", "m", "place along the face or the circle")]
    force: Annotated[FloatArray, Variable("time", "N", "normal force")]
    touches: Intervals


@dataclass(frozen=True)
class SleeveHistory:
    """Contacts of a link with the walls of its guide, or of a pin with those of its slot.

    `pairs` are names of pairs that can touch, `sides` the side of the link on which it does (+1
    upper, -1 lower, 0 both), or of the slot's curve (+1 left, -1 right). `force` (samples, pairs)
    holds the normal forces in N, `deepest` is the largest penetration of any pair in m. A sleeve
    without clearance that supports its rods holds them all the time: it has forces and no touches.
    """

    pairs: Annotated[tuple[str, ...], Variable(".pairs", "", "what can touch", kind=str)]
    sides: Annotated[tuple[float, ...], Variable(".pairs", "1", "side of the link")]
    force: Annotated[FloatArray, Variable("time .pairs", "N", "normal force")]
    touches: Intervals
    deepest: Annotated[float, Variable("", "m", "largest penetration")]


@dataclass(frozen=True)
class Extremes:
    """Extremes of a quantity: instants `time` (K,), s, in order, and the `value` (K,) at each.

    They come from the polynomials of the run's steps and do not depend on samples.
    """

    time: Annotated[FloatArray, Variable(".", "s", "instant of a turn")]
    value: Annotated[FloatArray, Variable(".", None, "value at a turn")]

    def between(self, begin: float, end: float) -> Extremes:
        """Extremes from `begin` to `end` (s), perhaps none."""
        first = np.searchsorted(self.time, begin, side="left")
        last = np.searchsorted(self.time, end, side="right")
        return Extremes(self.time[first:last], self.value[first:last])

    @property
    def least(self) -> tuple[float, float]:
        """Smallest value and its instant (s).

        Raises:
            ValueError: the quantity has no extremes.

        """
        return self._at(int(np.argmin(self.value)))

    @property
    def greatest(self) -> tuple[float, float]:
        """Largest value and its instant (s).

        Raises:
            ValueError: the quantity has no extremes.

        """
        return self._at(int(np.argmax(self.value)))

    def _at(self, k: int) -> tuple[float, float]:
        return float(self.value[k]), float(self.time[k])


@dataclass(frozen=True)
class JumpHistory:
    """Impulses in a joint when impacts make speeds jump: `time` (K,), s, `impulse` (K, 2), N s.

    They are in global axes and act on the same body as the joint's force. Contacts that close at
    the same instant make a single jump.
    """

    time: Annotated[FloatArray, Variable(".", "s", "instant of a jump")]
    impulse: Annotated[FloatArray, Variable(".", None, "impulse in a joint", components=IMPULSES)]

    @property
    def size(self) -> FloatArray:
        """Magnitudes (K,), N s."""
        return np.asarray(np.linalg.norm(self.impulse, axis=-1))


@dataclass(frozen=True)
class EnergyHistory:
    """Energies in J at the samples.

    `kinetic`; `stored` in springs, weight and contacts; `dissipated` and `supplied` since time 0.
    """

    kinetic: Annotated[FloatArray, Variable("time", "J", "kinetic energy")]
    stored: Annotated[FloatArray, Variable("time", "J", "energy in springs, weight, contacts")]
    dissipated: Annotated[FloatArray, Variable("time", "J", "energy dissipated")]
    supplied: Annotated[FloatArray, Variable("time", "J", "energy supplied by drives")]

    @property
    def residual(self) -> FloatArray:
        """Error of the balance, J: change of (kinetic + stored) plus dissipated minus supplied."""
        total = self.kinetic + self.stored
        return np.asarray(total - total[0] + self.dissipated - self.supplied)


@dataclass(frozen=True)
class Checks:
    """Checks of a run at the ends of all steps; samples within steps may have larger errors."""

    energy_residual: float  # J, largest absolute value of the energy balance
    largest_kinetic_energy: float  # J
    constraint_error: float  # m or rad, largest residual of any joint
    steps: int
    newton_iterations: int
    smallest_step: float  # s
    largest_step: float  # s
    steps_per_contact: float  # in the shortest half period; inf: no contact, or steps by error
    largest_penetration: float  # m

    @property
    def relative_energy_residual(self) -> float:
        """Largest error of the balance over the largest kinetic energy; 0 if nothing moved."""
        kinetic = self.largest_kinetic_energy
        return self.energy_residual / kinetic if kinetic else 0.0


@dataclass(frozen=True)
class Result:
    """A run, with its scene: post-processing needs nothing else.

    Samples are even in time, as many as the motion needs, with further ones at events and within
    every contact (`time`, (N,), s, increasing). At a jump of a contact's force, or of speeds, a
    sample is at the instant, after the jump, and another one just before, by a rounding of the
    clock. In minimal coordinates a dead centre of a loop has no sample, since the state is not
    determined there. `poses` (N, parts, 3) are x, y (m) and angle (rad) of every rigid part's
    origin, `rates` their time derivatives; `part_names` names the parts, a flexible body's rods in
    order. `drive_torques` (N m, on the second part of each drive's joint), `drive_forces` (N, (N,
    2), global axes, at the point of each drive that has one, or on the second part of its joint),
    `joint_forces` (N, (N, 2), global axes, on the second point's body of a revolute joint, also
    with clearance, of a prismatic one, or of a weld), `slot_forces` (N, (N, 2), global axes, on the
    point in the slot, also with clearance) and `spring_forces` (N, (N, 2), global axes, of linear
    springs with their dampers on the second point; springs that only pull or push, such as ropes,
    are among `contacts`) are by the scene's names. So are `gear_forces` (N, (N,), tangential, of
    the second wheel on the first, positive if it turns the first counter-clockwise; for a belt the
    difference of its pulls; for a rack the force on it, positive along its axis) and `gear_torques`
    (N m, on the first gear, if the pitch circles are not known). `extremes` are by name and unit,
    such as ``lever.angle_rad``. For angles, places and speeds they have both ends of the run and
    every extreme in between; for a contact the largest ``force_N`` and ``penetration_m`` of each
    step in which it pressed. `laps` are events of laps, of every slot on a closed curve, and begins
    of stages. Items that exist in some stages only have no values (nan) in the others.
    `joint_impulses` are those of joints and slots without play, by name, if contacts by impulse
    made speeds jump in minimal coordinates; forces at samples do not include them. `scene` is the
    requested scene, with the parts of all its stages, if any. A measured run is the more accurate
    one of two; its tolerance is in its `settings`. `error` is measured by the distance of both, or
    has the reason for which it is missing.
    """

    scene: Scene
    engine: str
    settings: EngineSettings
    versions: Mapping[str, str]
    timings: Mapping[str, float]  # s of wall time: prepare, solve, process
    part_names: Annotated[
        tuple[str, ...], Variable("part", "", "rigid part", kind=str, name="part")
    ]
    time: Annotated[FloatArray, Variable("time", "s", "time")]
    poses: Annotated[FloatArray, Variable("time part", None, "pose", components=POSES)]
    rates: Annotated[FloatArray, Variable("time part", None, "rate of the pose", components=RATES)]
    drive_torques: Annotated[Series, Variable("time", "N m", "torque of a drive")]
    drive_forces: Annotated[Series, Variable("time", None, "force of a drive", components=FORCES)]
    joint_forces: Annotated[Series, Variable("time", None, "force in a joint", components=FORCES)]
    slot_forces: Annotated[Series, Variable("time", None, "force of a slot", components=FORCES)]
    spring_forces: Annotated[Series, Variable("time", None, "force of a spring", components=FORCES)]
    contacts: Mapping[str, ContactHistory]
    bearings: Mapping[str, ContactHistory]  # of the revolute joints with clearance
    sleeves: Mapping[str, SleeveHistory]  # of sleeves and slots whose walls or axis press
    energy: EnergyHistory
    extremes: Mapping[str, Extremes]
    laps: tuple[Event, ...]
    checks: Checks
    warnings: tuple[str, ...]
    outcome: Outcome
    error: MeasuredError = NOT_ASKED
    frictions: Mapping[str, FrictionHistory] = field(default_factory=dict)  # of joints with any
    gear_forces: Annotated[Series, Variable("time", "N", "force of a gear")] = NO_SERIES
    gear_torques: Annotated[Series, Variable("time", "N m", "torque of a gear")] = NO_SERIES
    joint_impulses: Mapping[str, JumpHistory] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Make arrays read-only, since changes would be saved with the run."""
        _lock(self)

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Make arrays read-only again: NumPy makes them writable when it reads a pickle."""
        self.__dict__.update(state)
        _lock(self)

    @takes(time=number(Dimension.TIME, at_least=0.0))
    def sample_at(self, time: float) -> int:
        """Index of the sample nearest to an instant (s)."""
        return int(np.abs(self.time - time).argmin())

    @property
    def intervals(self) -> dict[str, Intervals]:
        """Touches by the names of the scene's contacts, then of its joints."""
        histories = (self.contacts, self.bearings, self.sleeves)
        return {name: history.touches for kind in histories for name, history in kind.items()}

    @property
    def stages(self) -> list[tuple[float, str]]:
        """Instants (s) at which stages of the run began, and their names."""
        return [(event.time, event.name) for event in self.laps if event.kind == STAGE]

    @cached_property
    def events(self) -> tuple[Event, ...]:
        """Events of the scene's contacts, laps and stages, in order of time."""
        changes = [
            event
            for name, contact in self.contacts.items()
            for interval in contact.touches
            for event in _events_of(interval, name)
        ]
        return tuple(sorted([*self.laps, *changes], key=lambda event: event.time))


STAGE = "stage"
"""Kind of the event at which a stage of a run begins."""


def later(result: Result, by: float) -> Result:
    """Return a run with its instants `by` (s) later, by the clock of the run that it continues."""
    if by == 0:
        return result

    def moved(touches: Intervals) -> Intervals:
        return replace(touches, begin=touches.begin + by, end=touches.end + by)

    kinds = ("contacts", "bearings", "sleeves")
    histories: dict[str, Any] = {
        kind: {k: replace(x, touches=moved(x.touches)) for k, x in getattr(result, kind).items()}
        for kind in kinds
    }
    histories["frictions"] = {
        k: replace(x, begin=x.begin + by, end=x.end + by) for k, x in result.frictions.items()
    }
    extremes = {k: replace(x, time=x.time + by) for k, x in result.extremes.items()}
    histories["joint_impulses"] = {
        k: replace(x, time=x.time + by) for k, x in result.joint_impulses.items()
    }
    laps = tuple(replace(lap, time=lap.time + by) for lap in result.laps)
    time, error = result.time + by, result.error.later(by)
    return replace(result, time=time, extremes=extremes, laps=laps, error=error, **histories)


def _lock(record: Any) -> None:
    """Make the arrays of a dataclass read-only, also in its members and mappings."""
    for name in record.__dataclass_fields__:
        value = getattr(record, name)
        for item in value.values() if isinstance(value, Mapping) else (value,):
            if isinstance(item, np.ndarray):
                item.setflags(write=False)
            elif is_dataclass(item) and not isinstance(item, type):
                _lock(item)


def _events_of(interval: Interval, name: str) -> Iterator[Event]:
    begun = {"approach_speed": interval.approach_speed, "place": interval.place}
    ended = {
        "separation_speed": interval.separation_speed,
        "impulse": interval.impulse,
        "energy_lost": interval.energy_lost,
    }
    if interval.impact:
        only = ("motor_work", "tangential_impulse")
        details = {**begun, **ended, **{key: getattr(interval, key) for key in only}}
        yield Event(interval.begin, "impact", name, details)
        return
    yield Event(interval.begin, "contact begins", name, begun)
    if not interval.lasts:
        kind = "leaves the face" if interval.slides_off else "contact ends"
        details = {"place": interval.end_place, **ended, "peak_force": interval.peak_force}
        yield Event(interval.end, kind, name, details)

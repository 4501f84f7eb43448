"""When a run ends, by which coordinates, how finely it is solved, and which instants are kept."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from math import ceil, copysign, floor, hypot, inf, isfinite, log10, pi, sqrt

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.laws import Impulse, OneSided
from exudyn_flexlink.mechanism.assembly import Assembly
from exudyn_flexlink.mechanism.contact_pairs import Channel, Contact, pairs
from exudyn_flexlink.mechanism.contacts import swings
from exudyn_flexlink.mechanism.dynamics import contact_mass
from exudyn_flexlink.mechanism.kinematics import turning
from exudyn_flexlink.mechanism.model import Mechanism
from exudyn_flexlink.mechanism.parts import GROUND
from exudyn_flexlink.mechanism.prescribed import Ramp
from exudyn_flexlink.mechanism.unknown_to_exudyn import beyond_redundant, rubbing_joints
from exudyn_flexlink.scene import Scene, SpeedDrive

FEWEST = 2000  # of a run, however short: enough for any figure
PER_TURN = 500  # of a drive, or of what turns as the run starts
PER_SWING = 20  # of a struck lever on its springs, and of a pendulum as long as a part
LOOKS = 100  # at the speed of a drive, for its largest
UNKNOWN = 10  # times as many in a run that turns end before its time, nobody knows when
KEPT_MEMORY = 1e9  # bytes that samples may take where the scene does not say how many
BYTES_OF_SAMPLE, BYTES_OF_PART, BYTES_OF_PAIR, BYTES_OF_CONTACT = 1500, 250, 40, 100
WALL_SHARE = 0.5  # of the steps of a strike: a wall presses longer than it strikes
ELASTIC = 0.99  # restitution of an impact that must not lose energy by its steps either
ELASTIC_STEPS = 2.0  # times the steps there: 60 lose 1e-5 of the energy in an impact, 120 an eighth
# Roundings of a position at the mechanism's extent. Over two turns of the paper's mechanism with
# its strikes, tree and Lagrangian stay 1.5e-13 m apart however small the tolerance, 4000 of them
# (`scripts/rounding.py`); without a strike 4e-15 m, from where on steps are as short as can be.
ROUNDINGS = 5e3
NO_SMALL_PART = 0.1  # of what a mechanism reaches: an error that hides how it moves


@dataclass(frozen=True)
class TurnGoal:
    """Ends a run when the second part has turned by `turned` (rad, positive) on the first.

    Either way counts, from where it was at the start: the angle `start` (rad).
    """

    first: int
    second: int
    start: float
    turned: float

    def left(self, q: list[float]) -> float:
        """Angle still to turn, rad, at coordinates of all parts one after the other."""
        return self.turned - abs(self._relative(q) - self.start)

    def rate(self, q: list[float], v: list[float]) -> float:
        """Speed towards the goal, rad/s: away from the start, to the side where the part is."""
        speed, done = self._relative(v), self._relative(q) - self.start
        return copysign(1.0, done) * speed if done else abs(speed)

    def _relative(self, x: list[float]) -> float:
        second = x[3 * self.second + 2] if self.second != GROUND else 0.0
        return second - (x[3 * self.first + 2] if self.first != GROUND else 0.0)


def end_of_run(scene: Scene, mechanism: Mechanism) -> float:
    """Time at which a run ends at the latest, s: its duration, or when a drive has made its turns.

    Turns of a joint without speed drive, or with one that varies or is at rest, end at `at_most`.
    """
    run = scene.run
    if run.duration is not None:
        return run.duration
    return min(_turns_made(scene, mechanism), run.at_most or inf)


def steady_drive(scene: Scene, mechanism: Mechanism) -> Ramp | None:
    """What brings the joint whose turns end a run to one speed: they end at a time known before.

    None if nothing does: any other drive may never make them.
    """
    for motor in mechanism.speed_motors:
        drive = scene.drives[motor.name]
        if isinstance(drive, SpeedDrive) and drive.joint == scene.run.of:
            return motor.speed if isinstance(motor.speed, Ramp) else None
    return None


def cut_off(scene: Scene, mechanism: Mechanism) -> float:
    """Angle that a steady speed drive has still to turn when `at_most` ends the run, rad."""
    run, ramp = scene.run, steady_drive(scene, mechanism)
    if ramp is None or run.at_most is None:
        return 0.0
    if run.at_most >= _turns_made(scene, mechanism) * (1 - 1e-12):
        return 0.0
    return 2 * pi * (run.turns or 0.0) - abs(ramp.integral(run.at_most))


def _turns_made(scene: Scene, mechanism: Mechanism) -> float:
    """Time at which a speed drive has made the turns, s; inf if none ever has."""
    turned = 2 * pi * (scene.run.turns or 0.0)
    ramp = steady_drive(scene, mechanism)
    if ramp is None or not ramp.value:
        return inf
    return ramp.time_of(turned if ramp.value > 0 else -turned)


def turn_goal(scene: Scene, assembly: Assembly) -> TurnGoal | None:
    """Turns that end a run at a time nobody knows before; None if it is known."""
    run, mechanism = scene.run, assembly.mechanism
    if run.turns is None or steady_drive(scene, mechanism) is not None:
        return None
    pin = next(pin for pin in mechanism.hinges if pin.name == run.of)
    first, second = pin.first.part, pin.second.part
    start = float(turning(first, second, assembly.state.q))
    return TurnGoal(first, second, start, 2 * pi * run.turns)


def formulation(scene: Scene) -> str:
    """How Exudyn represents the scene: what it asks for, or the fastest.

    Minimal coordinates are faster, but have their steps chosen by error control; a fixed step is
    for redundant ones, which know no impulses and no points on curves, and in which friction of
    joints holds nothing.
    """
    asked = scene.solver.formulation
    return asked if asked != "auto" else fittest(scene)


def fittest(scene: Scene) -> str:
    """Formulation that 'auto' means."""
    holds = scene.accuracy.step is None or any(rubbing_joints(scene)) or beyond_redundant(scene)
    return "minimal" if holds else "redundant"


def sample_times(scene: Scene, mechanism: Mechanism, end: float) -> FloatArray:
    """Even instants from 0 to the end, which is one of them, s."""
    interval = scene.run.sample or kept_interval(scene, mechanism, end)
    count = int(end / interval * (1 + 1e-12))
    grid = interval * np.arange(count + 1)
    # An end that is on the grid but for rounding takes the grid's place.
    return np.append(grid if end - grid[-1] > 1e-9 * interval else grid[:-1], end)


def sample_bytes(mechanism: Mechanism) -> int:
    """Memory that a sample takes until the run is saved, bytes: what both engines need at most.

    Measured from 10 to 40 rods, with and without walls, from one count of samples to another.
    """
    walls = sum(len(pairs(channel)) for channel in mechanism.channels)
    kept = BYTES_OF_PART * len(mechanism.parts) + BYTES_OF_PAIR * walls
    return BYTES_OF_SAMPLE + kept + BYTES_OF_CONTACT * len(mechanism.touching)


def kept_interval(scene: Scene, mechanism: Mechanism, end: float) -> float:
    """Time between samples, s, round: what the motion needs, or more if those were too many."""
    wanted = _round(wanted_interval(scene, mechanism, end), down=True)
    least = end * sample_bytes(mechanism) / KEPT_MEMORY
    return wanted if wanted >= least else _round(least, down=False)


def wanted_interval(scene: Scene, mechanism: Mechanism, end: float) -> float:
    """Time between samples, s, that shows the motion, as far as one knows before a run."""
    unknown = scene.run.turns is not None and steady_drive(scene, mechanism) is None
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
    """Return 1, 2 or 5 times a power of ten, next to an interval (s)."""
    power = 10.0 ** floor(log10(interval))
    steps = [float(f"{factor * power:.0e}") for factor in (1, 2, 5, 10)]
    fit = [step for step in steps if (step <= interval * (1 + 1e-9)) == down or step == interval]
    return max(fit) if down else min(fit)


# --- how finely ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class Resolution:
    """Half the period of a contact's stiffness with the least mass on it, and its step, s."""

    half_period: float
    step: float

    def steps(self, given: float | None) -> float:
        """Steps of the contact where the user gave a step (s), which may be shorter."""
        return self.half_period / min(self.step, given or inf)


def resolutions(
    scene: Scene,
    assembly: Assembly,
    half_of: Callable[[Contact | Channel], float] | None = None,
) -> list[Resolution]:
    """Resolutions of contacts and bearings, then of sleeves; none of contacts that take no time.

    `half_of` tells half the period (s) of each; left out, `half_period` does.
    """
    half_of = half_of or partial(half_period, assembly)
    asked, found = scene.solver.steps_per_contact, []
    for contact in assembly.mechanism.touching:
        if not isinstance(contact.law, Impulse | OneSided):
            half = half_of(contact)
            steps = asked * (ELASTIC_STEPS if contact.law.restitution > ELASTIC else 1.0)
            found.append(Resolution(half, half / steps))
    for channel in assembly.mechanism.channels:
        half = half_of(channel)
        found.append(Resolution(half, half / (WALL_SHARE * asked)))
    return found


def half_period(assembly: Assembly, contact: Contact | Channel) -> float:
    """Half the period of a stiffness with the least mass behind it, s; inf of a rigid contact."""
    if isinstance(contact.law, Impulse):
        return inf
    state = assembly.state
    mass = contact_mass(assembly.mechanism, contact, state.q, state.places)
    return contact.law.half_period(mass)


def half_periods(assembly: Assembly) -> list[float]:
    """Return those of all contacts and bearings, then of all pairs of links and guides."""
    mechanism = assembly.mechanism
    found = [half_period(assembly, contact) for contact in mechanism.touching]
    for channel in mechanism.channels:
        found += [half_period(assembly, channel)] * len(pairs(channel))
    return found


def extent(assembly: Assembly) -> float:
    """Distance (m) from the origin of coordinates to the farthest point, at the start."""
    q = assembly.state.q
    reaches = [part.reach for part in assembly.mechanism.parts]
    return float((np.hypot(q[:, 0], q[:, 1]) + reaches).max())


def least_tolerance(assembly: Assembly) -> float:
    """Least error in positions (m) that a run can be asked for, rounded up to one digit."""
    least = ROUNDINGS * float(np.finfo(float).eps) * extent(assembly)
    power = floor(log10(least))
    return float(f"{ceil(least / 10.0**power)}e{power}")


def coarse_tolerance(scene: Scene, assembly: Assembly) -> Iterator[str]:
    """Say that the tolerance that a scene asks for is large beside its mechanism."""
    asked = scene.accuracy.tolerance
    if asked is not None and asked > NO_SMALL_PART * extent(assembly):
        yield (
            f"the tolerance of {asked:.3g} m is more than {NO_SMALL_PART:.0%} of the size of the "
            f"mechanism, {extent(assembly):.3g} m; is a unit missing, as in '1 um'?"
        )

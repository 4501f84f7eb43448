"""Warnings and refusals of a run by its own numbers, whatever engine made it.

They are of bounces of rigid contacts (when these are over, never end, or pass on to others), of
strikes that few steps resolve, of much more work or fewer samples than the motion needs, of a
clearance that needs more accuracy, of links outside their guides, and of what mechanics forbids:
energy out of nothing, open joints.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf, isfinite, log, pi

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.loading import assemble_scene, rest_of_scene
from exudyn_flexlink.mechanism import (
    Channel,
    CircleContact,
    Contact,
    CurveContact,
    FaceContact,
    FlatContact,
    approach,
    build_mechanism,
    coarse_tolerance,
    end_of_run,
    idle_at_start,
    in_guides,
    input_notes,
    kept_interval,
    wanted_interval,
    wound_at_start,
)
from exudyn_flexlink.mechanism.prescribed import NO_ENERGY
from exudyn_flexlink.observables import crank_angle, crank_joint, deepest
from exudyn_flexlink.result import INTERRUPTED, Intervals, Outcome, Result
from exudyn_flexlink.rounding import NEGLIGIBLE, PLACE_ROUNDING, TINY
from exudyn_flexlink.scene import ImpulseLaw, RevoluteJoint, SleeveJoint, SlotJoint

REST_SPEED = 1e-6  # m/s: an approach slower than this is no impact any more
LEAST_FLIGHT = 1e-9  # s: a bounce that would be over sooner is none either
SUNK = 1e-2  # of the fastest approach of a contact: what slower ones do is no motion to be seen
MOST_SUNK = 1000  # sunk impacts in a row: some seconds of work
MOST_LEFT = 100_000  # that restitution may still need to end them: some minutes
LOSE_SPEED = "a smaller restitution, which ends the bounces, or a law with stiffness"


@dataclass
class Bounces:
    """Impacts of the contact `name`; `fastest` (m/s) is the approach of the fastest so far."""

    name: str
    restitution: float
    fastest: float = 0.0
    _sunk: int = 0  # impacts in a row far slower than that
    _since: float = 0.0  # time of the first of them

    def endless(self, time: float, approach_speed: float) -> str:
        """Take an impact; say so if the contact has bounced on the spot for long, without an end.

        The bounces of an elastic contact that is pressed get ever shorter but never end, since no
        speed is lost; those of restitution e end after ``ln(v / REST_SPEED) / ln(1 / e)`` more.
        """
        if approach_speed >= SUNK * self.fastest:
            self.fastest, self._sunk = max(self.fastest, approach_speed), 0
            return ""
        self._since = time if self._sunk == 0 else self._since
        self._sunk += 1
        left = log(max(approach_speed / REST_SPEED, 1.0))
        if self._sunk < MOST_SUNK or self.restitution == 0:
            return ""
        if left < -MOST_LEFT * log(self.restitution):
            return ""
        return (
            f"contact '{self.name}' bounces on the spot: {self._sunk} impacts within "
            f"{time - self._since:.2g} s, at {approach_speed:.2g} m/s, and a restitution of "
            f"{self.restitution:g} won't end them"
        )


def passed_on(together: Sequence[tuple[float, Sequence[str]]], law: str) -> list[str]:
    """Say that impacts went through several contacts, at instants (s), and how they are solved."""
    return [
        f"contacts {', '.join(map(repr, names))} took up one impact at {time:.4g} s, the first of "
        f"{len(together)} such: Newton's law of impact holds for {law}, and those that only touch "
        "do not bounce; in which order bodies that touch strike one another is not modelled, and "
        "changes their speeds: leave a little play, or give a law with stiffness, and compare"
        for time, names in together[:1]
    ]


def is_over(approach_speed: float, restitution: float, gap_acceleration: float) -> bool:
    """Tell whether the next bounce is so small that the contact lasts instead.

    `gap_acceleration` (m/s^2) is that without contact force: where it presses (negative), a bounce
    takes ``2 e v_a/|g''|``, and an endless sequence of them only a finite time.
    """
    if approach_speed < REST_SPEED:
        return True
    flight = 2 * restitution * approach_speed
    return 0 < flight < LEAST_FLIGHT * -gap_acceleration


ENOUGH_STEPS = 30  # in half a period of a contact: the restitution is right to 1 %
# Of the overlap of point and face, or of the radius of what is round: what a deeper strike does
# depends on how soft the contact is.
THIN = 0.25


def shortened(given: float | None, touched: Iterable[tuple[float, float]]) -> Iterator[str]:
    """Warn that contacts asked for steps shorter than the user's own (s), if there is one.

    `touched` are half periods of contacts, and the steps (s) that they asked for.
    """
    shorter = [touching for touching in touched if given is not None and touching[1] < given]
    for half_period, step in sorted(shorter, key=lambda touching: touching[1])[:1]:
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
                share = touch.penetration / max(overlap, TINY)
                worst = max(worst, (share, touch.penetration, overlap, touch.begin))
        share, depth, overlap, instant = worst
        if share > THIN:
            yield (
                f"after t = {instant:.6g} s the point of '{face.name}' sinks {depth:.2g} m "
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
            if beside.max(initial=0.0) > PLACE_ROUNDING:
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
        for contact, about in idle_at_start(mechanism, result.poses[0], result.rates[0]):
            if np.all(approach(contact, result.poses, result.rates).gap < 0):
                yield about


def wound_springs(result: Result) -> Iterator[str]:
    """Say which springs start wound by more than half a turn; a continued run may well be."""
    if len(result.time) and not result.scene.initial.states:
        yield from wound_at_start(assemble_scene(result.scene).mechanism, result.poses[0])


MANY_ITERATIONS = 10  # of Newton's method a step: an accepted attempt takes 2 to 4
FEW_SAMPLES = 100  # a turn: the chord between two is then 1/2000 of the radius off the circle
TINY_STEP = 1e-10  # s: ten thousand million steps for a second of motion lead nowhere soon


def many_iterations(result: Result) -> Iterator[str]:
    """Say that most steps were not solved at first: they were made shorter, and are no error."""
    checks = result.checks
    mean = checks.newton_iterations / max(checks.steps, 1)
    if mean > MANY_ITERATIONS:
        yield (
            f"Newton's method took {mean:.2g} iterations a step, where 2 to 4 are usual: most "
            "steps were not solved at first, and made shorter; look for a contact, a bend of the "
            "track or a dead centre that asks for it"
        )


def tiny_steps(result: Result) -> Iterator[str]:
    """Name the contacts that asked for tiny steps when the user ended a run.

    Contacts by impulse ask for none: they have no stiffness.
    """
    shortest = result.checks.smallest_step
    if result.outcome.reason != INTERRUPTED or shortest > TINY_STEP:
        return
    rigid = {
        n for n, contact in result.scene.all_contacts.items() if isinstance(contact.law, ImpulseLaw)
    }
    for name, history in {**result.contacts, **result.bearings}.items():
        if name not in rigid and len(history.force) and history.force[-1] != 0:
            what = "joint" if name in result.bearings else "contact"
            yield (
                f"{what} '{name}' acted as the run was ended, which had made steps as short as "
                f"{shortest:.2g} s: less stiffness or friction, or a larger "
                "'transition_speed', make them longer"
            )


def few_samples(result: Result) -> Iterator[str]:
    """Say where samples are fewer than the motion asks for, or than turns that nobody foresaw."""
    scene, mechanism = result.scene, build_mechanism(result.scene)
    if scene.run.sample is not None:
        return
    end = end_of_run(scene, mechanism)
    kept, wanted = (of(scene, mechanism, end) for of in (kept_interval, wanted_interval))
    angle = crank_angle(result) if crank_joint(scene) else np.zeros(1)
    made = abs(float(angle[-1] - angle[0])) / (2 * pi)
    apart = f"samples are {kept:.3g} s apart"
    less = "figures and tables may show less of it, though peaks are right; see 'run.sample'"
    if kept > wanted * (1 + 1e-9):
        yield f"{apart}, since the run is long, where its motion asks for {wanted:.3g} s: {less}"
    elif made > 1 and result.outcome.time / kept < FEW_SAMPLES * made:
        yield f"{apart}, which is {result.outcome.time / kept / made:.3g} a turn: {less}"


HARDLY_USED = 1 / 300  # of a guide's length: in metres for millimetres a thousandth is usual
RESOLVED = 0.1  # of the clearance: an error, or depth, that still lets the link touch where it does
BROKEN_WALL_ADVICE = "raise the stiffness of the sleeve's law, or run slower"
COARSE_WALL_ADVICE = f"shorten the step; else {BROKEN_WALL_ADVICE}"


def coarse_for_clearance(result: Result) -> Iterator[str]:
    """Say that a tolerance is large beside a clearance: touches may be missed."""
    asked = result.scene.accuracy.tolerance
    clearances = {name: gap for name, gap in _clearances(result).items() if gap > 0}
    if asked is None or not clearances:
        return
    name = min(clearances, key=clearances.__getitem__)
    if asked > RESOLVED * clearances[name]:
        yield (
            f"the tolerance of {asked:.3g} m is more than {RESOLVED:.0%} of the clearance of "
            f"'{name}', {clearances[name]:.3g} m: touches of its walls may be missed; ask for "
            f"{RESOLVED * clearances[name]:.1g} m or less"
        )


def soft_walls(result: Result) -> Iterator[str]:
    """Warn of walls and bearings into which something sinks deep beside its clearance."""
    for name, clearance in _clearances(result).items():
        depth = deepest(result, name)
        if depth <= RESOLVED * clearance or clearance == 0:
            continue
        deep = f"by {depth:.3g} m, {depth / clearance:.2g} of the clearance"
        if isinstance(result.scene.joints[name], SlotJoint):
            yield (
                f"the walls of '{name}' give way {deep}: where the pin runs depends on their "
                "stiffness there; raise the stiffness of the slot's law"
            )
        elif name in result.bearings:
            yield (
                f"the bearing of '{name}' gives way {deep}: where the journal runs depends on its "
                "stiffness there; raise the stiffness of the joint's law"
            )
        else:
            yield (
                f"the walls of '{name}' give way {deep}: how far the link tilts depends on their "
                "stiffness there; raise the stiffness of the sleeve's law"
            )


def out_of_guides(result: Result) -> Iterator[str]:
    """Say which links leave their guides, and which are inside a small part of them only."""
    for name, low, high in in_guides(result.scene, build_mechanism(result.scene), result.poses):
        away = np.maximum(low - 1, -high)
        if (out := away > NEGLIGIBLE).any():
            yield (
                f"the link of '{name}' leaves its guide at t = {result.time[np.argmax(out)]:.4g} s "
                f"and is up to {away.max():.2g} of its length away: nothing holds a link there"
            )
        elif len(away) and (used := high.max() - low.min()) < HARDLY_USED:
            yield (
                f"the link of '{name}' is inside only {used:.2g} of its guide's length: check units"
            )


def out_of_slots(result: Result) -> Iterator[str]:
    """Say which pins leave slots with play at open ends."""
    for groove in build_mechanism(result.scene).grooves:
        wall = groove.contacts[0]
        place = approach(wall, result.poses, result.rates).place
        away = np.maximum(-place, place - wall.length)
        if len(away) and away.max() > NEGLIGIBLE * groove.slot.curve.size:
            first = int(np.argmax(away > NEGLIGIBLE * groove.slot.curve.size))
            yield (
                f"the pin of '{groove.name}' leaves its slot at t = {result.time[first]:.4g} s, at "
                f"an open end, and is up to {away.max():.2g} m away: nothing holds it there"
            )


def broken_wall(channel: Channel) -> str:
    """Why a run stopped."""
    return f"the link broke through a wall of '{channel.name}'"


def _clearances(result: Result) -> dict[str, float]:
    """Clearance (m) of every joint of the scene that may have one."""
    joints = result.scene.joints.items()
    kinds = (SleeveJoint, RevoluteJoint, SlotJoint)
    return {name: joint.clearance for name, joint in joints if isinstance(joint, kinds)}


ENERGY = 1e-2  # of the largest kinetic energy, missing in the balance
GAIN = 1e-4  # of the largest kinetic energy, gained in one impact: more than rounding
OPEN = 1e-8  # m or rad, residual of a joint: more than a converged iteration leaves
GROSS = 0.1  # of all energy that moves: a run that misses more is no motion of the mechanism
STORED = 1e-10  # of the energy stored: so little beside it is rounding, too, as of what is at rest


def doubts(result: Result) -> list[str]:
    """Say what is wrong with the numbers of a run, and would be less so with smaller steps."""
    return [*_energy(result), *_joints(result), *_gains(result)]


def refusal(result: Result) -> Outcome | None:
    """Return how a run ended whose energy balance is grossly wrong; None if it is not."""
    energy = result.energy
    moved = np.abs(energy.stored - energy.stored[0]) + energy.kinetic + np.abs(energy.dissipated)
    all_of_it = max(float(moved.max()), kinetic(result))
    if result.checks.energy_residual <= GROSS * all_of_it:
        return None
    off = np.abs(energy.residual)
    instant = result.time[int(np.argmax(off > min(GROSS * all_of_it, 0.5 * off.max())))]
    return Outcome(
        False,
        float(instant),
        f"the energy balance misses {result.checks.energy_residual / all_of_it:.2g} of all energy",
        f"what follows is no motion of this mechanism; {_remedy(result)}, and look at it there",
    )


def kinetic(result: Result) -> float:
    """Largest kinetic energy of a run, J, by which its errors are measured; never 0."""
    stored = float(np.abs(result.energy.stored).max(initial=0.0))
    return max(result.checks.largest_kinetic_energy, NO_ENERGY, STORED * stored)


def _remedy(result: Result) -> str:
    return "shorten the step" if result.settings.integrator.step else "tighten the tolerance"


def _energy(result: Result) -> Iterator[str]:
    missing, largest = result.checks.energy_residual, kinetic(result)
    if missing > ENERGY * largest:
        yield (
            f"the energy balance misses {missing:.3g} J, {missing / largest:.2g} of the largest "
            f"kinetic energy: {_remedy(result)} and compare"
        )


def _joints(result: Result) -> Iterator[str]:
    gap = result.checks.constraint_error
    if gap > OPEN:
        yield f"a joint is violated by {gap:.3g} (m or rad): {_remedy(result)}"


def _gains(result: Result) -> Iterator[str]:
    """Strikes, and contacts with walls, that give more energy than they took.

    What still presses as the run ends is left out: what it stores is not given back yet.
    """
    largest = kinetic(result)
    gaining = [
        (-lost, end, name)
        for histories in (result.contacts, result.bearings, result.sleeves)
        for name, history in histories.items()
        for lost, end in _stays(history.touches)
        if lost < -GAIN * largest and isfinite(end)
    ]
    if not gaining:
        return
    gain, instant, name = max(gaining)
    about = "an impact gives more energy than it takes"
    if len(gaining) > 1:
        about = f"{len(gaining)} impacts give more energy than they take"
    more = ", or raise 'solver.steps_per_contact'" if result.settings.steps_per_contact else ""
    yield (
        f"{about}, that of '{name}' at {instant:.6g} s {gain:.3g} J, {gain / largest:.2g} of the "
        f"largest kinetic energy: {_remedy(result)}{more}"
    )


def _stays(touches: Intervals) -> Iterator[tuple[float, float]]:
    """Energy lost (J) and end (s) of contacts, of which touches that overlap in time are one.

    As a link slides in its guide, one pair takes over what another has pressed in: the energy that
    is stored there is lost in one and given in the other.
    """
    if not len(touches):
        return
    until = np.maximum.accumulate(touches.end)
    begins = np.flatnonzero(np.append(True, touches.begin[1:] > until[:-1]))
    lost = np.add.reduceat(touches.energy_lost, begins)
    yield from zip(lost.tolist(), np.maximum.reduceat(touches.end, begins).tolist(), strict=True)


def diagnosed(result: Result) -> Result:
    """Return a run with warnings of all that is doubtful; failed, where it is no motion at all."""
    assembly = assemble_scene(result.scene)
    warnings = (
        *result.warnings,
        *input_notes(result.scene, assembly),
        *unstable_start(result),
        *few_steps(result),
        *coarse_for_clearance(result),
        *soft_walls(result),
        *out_of_guides(result),
        *out_of_slots(result),
        *coarse_tolerance(result.scene, assembly),
        *doubts(result),
        *many_iterations(result),
        *tiny_steps(result),
        *assembly.mechanism.unfound,  # pulses of drives that vary too fast
        *few_samples(result),
        *thin_overlaps(result),
        *deep_strikes(result),
        *beside_faces(result),
        *idle_contacts(result),
        *wound_springs(result),
    )
    failed = refusal(result) if result.outcome.completed else None
    return replace(result, warnings=warnings, outcome=failed or result.outcome)


def unstable_start(result: Result) -> list[str]:
    """Say that what starts at rest does not stay there."""
    if not result.scene.initial.at_rest:
        return []
    rest = rest_of_scene(result.scene)
    grows = f"small motions grow by exp({rest.growth:.4g} t/s)"
    return [] if rest.stable else [f"the rest at which it starts is unstable: {grows}"]

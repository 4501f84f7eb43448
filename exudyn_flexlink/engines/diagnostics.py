"""Warnings and refusals of a run by its results, for all engines.

They are about bounces of rigid contacts (their end, or none, or impacts of several contacts),
strikes that few steps resolve, more work or fewer samples than the motion needs, a clearance that
needs more accuracy, links outside their guides, and violations of mechanics: a gain of energy, open
joints.
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
from exudyn_flexlink.observables import crank_angle, crank_joint, deepest
from exudyn_flexlink.result import INTERRUPTED, Intervals, Outcome, Result
from exudyn_flexlink.rounding import NEGLIGIBLE, NO_ENERGY, PLACE_ROUNDING, TINY
from exudyn_flexlink.scene import ImpulseLaw, RevoluteJoint, SleeveJoint, SlotJoint

REST_SPEED = 1e-6  # m/s: a slower approach is no impact
LEAST_FLIGHT = 1e-9  # s: a shorter bounce is no bounce
SUNK = 1e-2  # of the fastest approach of a contact: motion by slower impacts is invisible
MOST_SUNK = 1000  # such slow impacts in a row: some seconds of work
MOST_LEFT = 100_000  # further impacts until restitution ends them: some minutes
LOSE_SPEED = "a smaller restitution, which ends the bounces, or a law with stiffness"


@dataclass
class Bounces:
    """Impacts of the contact `name`; `fastest` (m/s) is the approach of the fastest so far."""

    name: str
    restitution: float
    fastest: float = 0.0
    _sunk: int = 0  # slow impacts in a row
    _since: float = 0.0  # time (s) of the first of them

    def endless(self, time: float, approach_speed: float) -> str:
        """Count an impact; return a message if the contact bounces on the spot without an end.

        The bounces of a pressed elastic contact get shorter but never end, since no speed is lost.
        With a restitution e they end after ``ln(v / REST_SPEED) / ln(1 / e)`` more.
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
    """Warn of impacts in several contacts at the same time; `law` says how they are solved."""
    return [
        f"contacts {', '.join(map(repr, names))} took up one impact at {time:.4g} s, the first of "
        f"{len(together)} such: Newton's law of impact holds for {law}, and those that only touch "
        "do not bounce; in which order bodies that touch strike one another is not modelled, and "
        "changes their speeds: leave a little play, or give a law with stiffness, and compare"
        for time, names in together[:1]
    ]


def is_over(approach_speed: float, restitution: float, gap_acceleration: float) -> bool:
    """Tell whether the next bounce is so small that the contact lasts instead.

    `gap_acceleration` (m/s^2) is that without contact force. If it closes the gap (negative), a
    bounce takes ``2 e v_a/|g''|``, and an endless sequence of bounces takes a finite time.
    """
    if approach_speed < REST_SPEED:
        return True
    flight = 2 * restitution * approach_speed
    return 0 < flight < LEAST_FLIGHT * -gap_acceleration


ENOUGH_STEPS = 30  # in half a period of a contact: the restitution is right to 1 %
# Of the overlap of point and face, or of the radius of a round face: the effect of a deeper strike
# depends on the contact's stiffness.
THIN = 0.25


def shortened(given: float | None, touched: Iterable[tuple[float, float]]) -> Iterator[str]:
    """Warn if contacts needed steps shorter than the user's (s), if given.

    `touched` are half periods of contacts, and the steps (s) that they need.
    """
    shorter = [touching for touching in touched if given is not None and touching[1] < given]
    for half_period, step in sorted(shorter, key=lambda touching: touching[1])[:1]:
        yield (
            f"a step of {given:.3g} s is too long for a contact, which lasts {half_period:.2g} s: "
            f"in contact steps were {step:.3g} s"
        )


def few_steps(result: Result) -> Iterator[str]:
    """Warn of contacts resolved by few steps."""
    steps = result.checks.steps_per_contact
    touched = any(len(touches) for touches in result.intervals.values())
    if steps < ENOUGH_STEPS * (1 - 1e-9) and touched:
        yield (
            f"{steps:.3g} steps per contact: below {ENOUGH_STEPS} the restitution is off by more "
            "than 1 %; raise 'solver.steps_per_contact'"
        )


def thin_overlaps(result: Result) -> Iterator[str]:
    """Warn of contacts whose penetration is large against the overlap of point and face."""
    # Circles overlap all around; so do stops of slides.
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
    """Warn of round contacts whose depth is large against the radius.

    At such a depth the direction out of the contact is not unique.
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
    """Warn of faces on curves that were touched beyond their two given points."""
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
    """Radius (n,) of a round face, pressed from outside at places (n,), m; else infinite.

    For a curve that bends away from the point, the radius of the roller is added.
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
    """Warn of contacts that never acted: their points started and stayed behind the face.

    Points that come round an end need no warning, for example in the slots of a Geneva wheel.
    """
    if len(result.time):
        mechanism = build_mechanism(result.scene)
        for contact, about in idle_at_start(mechanism, result.poses[0], result.rates[0]):
            if np.all(approach(contact, result.poses, result.rates, result.time).gap < 0):
                yield about


def wound_springs(result: Result) -> Iterator[str]:
    """Warn of springs that start wound by more than half a turn, except in a continued run."""
    if len(result.time) and not result.scene.initial.states:
        yield from wound_at_start(assemble_scene(result.scene).mechanism, result.poses[0])


MANY_ITERATIONS = 10  # Newton iterations a step: an accepted attempt takes 2 to 4
FEW_SAMPLES = 100  # a turn: a chord between two is then off the circle by 1/2000 of the radius
TINY_STEP = 1e-10  # s: a second of motion would need 10^10 steps


def many_iterations(result: Result) -> Iterator[str]:
    """Warn that most steps were made shorter since they had no solution; this is no error."""
    checks = result.checks
    mean = checks.newton_iterations / max(checks.steps, 1)
    if mean > MANY_ITERATIONS:
        yield (
            f"Newton's method took {mean:.2g} iterations a step, where 2 to 4 are usual: most "
            "steps were not solved at first, and made shorter; look for a contact, a bend of the "
            "track or a dead centre that asks for it"
        )


def tiny_steps(result: Result) -> Iterator[str]:
    """Name the contacts that needed tiny steps when the user ended a run.

    Contacts by impulse do not: they have no stiffness.
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
    """Warn of fewer samples than the motion, or the number of turns, needs."""
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


HARDLY_USED = 1 / 300  # of a guide's length: with metres in place of millimetres it is a thousandth
RESOLVED = 0.1  # of the clearance: with a smaller error, or depth, touches are found
BROKEN_WALL_ADVICE = "raise the stiffness of the sleeve's law, or run slower"
COARSE_WALL_ADVICE = f"shorten the step; else {BROKEN_WALL_ADVICE}"


def coarse_for_clearance(result: Result) -> Iterator[str]:
    """Warn if a tolerance is large against a clearance: touches may be missed."""
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
    """Warn of walls and bearings with a penetration that is large against the clearance."""
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
    """Warn of links that leave their guides, or use only a small part of them."""
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
    """Warn of pins that leave slots with play at open ends."""
    for groove in build_mechanism(result.scene).grooves:
        wall = groove.contacts[0]
        place = approach(wall, result.poses, result.rates, result.time).place
        away = np.maximum(-place, place - wall.length)
        if len(away) and away.max() > NEGLIGIBLE * groove.slot.curve.size:
            first = int(np.argmax(away > NEGLIGIBLE * groove.slot.curve.size))
            yield (
                f"the pin of '{groove.name}' leaves its slot at t = {result.time[first]:.4g} s, at "
                f"an open end, and is up to {away.max():.2g} m away: nothing holds it there"
            )


def broken_wall(channel: Channel) -> str:
    """Reason of a run that stopped."""
    return f"the link broke through a wall of '{channel.name}'"


def _clearances(result: Result) -> dict[str, float]:
    """Clearance (m) of every joint of a kind that may have one."""
    joints = result.scene.joints.items()
    kinds = (SleeveJoint, RevoluteJoint, SlotJoint)
    return {name: joint.clearance for name, joint in joints if isinstance(joint, kinds)}


ENERGY = 1e-2  # of the largest kinetic energy, missing in the balance
GAIN = 1e-4  # of the largest kinetic energy, gained in one impact: more than rounding
OPEN = 1e-8  # m or rad: a converged iteration leaves a smaller residual of a joint
GROSS = 0.1  # of all energy: a run that misses more is no motion of the mechanism
STORED = 1e-10  # of the stored energy: a smaller energy is rounding, too


def doubts(result: Result) -> list[str]:
    """Warnings of errors of a run that smaller steps would reduce."""
    return [*_energy(result), *_joints(result), *_gains(result)]


def refusal(result: Result) -> Outcome | None:
    """Return the outcome of a run with a grossly wrong energy balance, else None."""
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
    """Warn of strikes, and contacts with walls, that return more energy than they take.

    Contacts that press at the end of the run are left out: they still store energy.
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
    """Lost energy (J) and end (s) of touches; touches that overlap in time are merged.

    When a link slides in its guide, the force passes from pair to pair: stored energy is lost in
    one pair and gained in the other.
    """
    if not len(touches):
        return
    until = np.maximum.accumulate(touches.end)
    begins = np.flatnonzero(np.append(True, touches.begin[1:] > until[:-1]))
    lost = np.add.reduceat(touches.energy_lost, begins)
    yield from zip(lost.tolist(), np.maximum.reduceat(touches.end, begins).tolist(), strict=True)


def diagnosed(result: Result) -> Result:
    """Return a run with all its warnings; it has failed if it is no motion of the mechanism."""
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
    """Warn if the rest at which a run starts is unstable."""
    if not result.scene.initial.at_rest:
        return []
    rest = rest_of_scene(result.scene)
    grows = f"small motions grow by exp({rest.growth:.4g} t/s)"
    return [] if rest.stable else [f"the rest at which it starts is unstable: {grows}"]

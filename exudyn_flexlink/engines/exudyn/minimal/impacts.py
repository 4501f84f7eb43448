"""Impacts by impulse: what happens at the instant at which gaps of rigid contacts close.

The configuration stays, the speeds z' jump by impulses p along the gaps' gradients G:

    M (z'_s - z'_a) = G^T p,      0 <= p,   g'_s + e g'_a >= 0,   p (g'_s + e g'_a) = 0

with g' the rates of the gaps before (a) and after (s): Newton's law of impact for all contacts that
are closed at that instant, as complementarity (J. J. Moreau, in *Nonsmooth Mechanics and
Applications*, Springer 1988; F. Pfeiffer and Ch. Glocker, *Multibody Dynamics with Unilateral
Contacts*, Wiley 1996, ch. 8). The kinetic energy changes by ``p (g'_a + g'_s)/2`` of each, and by
what drives do that keep their speeds. Bounces get shorter and shorter; where the next one would be
too low to be seen, the contact lasts: which of those at rest press follows likewise from their
accelerations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray, IndexArray
from exudyn_flexlink.engines.diagnostics import REST_SPEED, Bounces, is_over
from exudyn_flexlink.engines.exudyn.minimal.contacts import Touch
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeState
from exudyn_flexlink.engines.exudyn.minimal.events import EventFinder
from exudyn_flexlink.engines.exudyn.minimal.friction import (
    MOST_ROUNDS,
    SEARCH_ROUNDING,
    Gaps,
    JointFrictions,
    LockedError,
    Meeting,
    RigidContact,
    impulses,
    mobility,
    turned_back,
    within_bounds,
)
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.engines.exudyn.minimal.recording import TreeRecorder
from exudyn_flexlink.engines.touching import Change, Moment
from exudyn_flexlink.integrate.complementarity import (
    RubbingImpact,
    complementary,
    gains_energy,
    rubbing_impact,
)
from exudyn_flexlink.integrate.events import EVENT_TIME
from exudyn_flexlink.integrate.problem import Evaluation, instant
from exudyn_flexlink.result import Interval

CLOSED_GAP = 1e-15  # m: a gap so small is closed, by rounding
SAME_INSTANT = 10.0  # instants: a gap that is zero within so little time is closed, too
# m/s, of a point that was struck as it went away: below this, treated as zero. It comes out of
# what a gap is off by, and nobody sees that.
INVISIBLE_SPEED = 1e-4
# Of the sizes of the parts that a gap's acceleration sums up: below this, treated as zero.
NO_ACCELERATION = 1e-9
# Of an impact's largest impulse, and of how far it moves a gap: less is not passed on.
NOTHING_PASSED_ON = 1e-6
TINY = float(np.finfo(float).tiny)
AMONG_OTHERS = "turns slip back, which is known of one contact alone, without friction in joints"
UNEVEN = "turns slip back where the bodies are not round about it: that would make energy"


def meets(touch: Touch, time: float) -> bool:
    """Tell whether a gap is closed at a time (s), as exactly as instants are known."""
    return abs(touch.gap) <= CLOSED_GAP + SAME_INSTANT * instant(time, EVENT_TIME) * abs(
        touch.gap_rate
    )


class Jump(NamedTuple):
    """Jump of the independent speeds, and of each contact (c,) what it does.

    Impulse (N s), rate of the gap before and after (m/s), energy lost, work of the drives that keep
    their speeds (J), and the impulse of friction (N s). Of each joint (joints,) what its friction
    loses (J); `motor_work` has those drives' work by that, too, at its end. `rates` (links,) are
    jumps of all speeds, `held` (links,) the impulses of motors, slots and loops.
    """

    speeds: FloatArray
    impulse: FloatArray
    before: FloatArray
    after: FloatArray
    lost: FloatArray
    motor_work: FloatArray
    rub: FloatArray
    joints_lost: FloatArray
    rates: FloatArray
    held: FloatArray


class Blow(NamedTuple):
    """Impulses of contacts (c,) across and along them, and in joints (j,); rates after.

    Of those in joints, `lock` is what freewheels hold; the rest is friction.
    """

    push: FloatArray
    rub: FloatArray
    joints: FloatArray
    lock: FloatArray
    after: FloatArray
    slip: FloatArray


def jump_of(
    at: Evaluation,
    gaps: Gaps,
    restitution: FloatArray,
    laws: Sequence[RigidContact],
    joints: JointFrictions,
) -> Jump:
    """Jump at one state, by contacts (c,) that are closed.

    Raises:
        ArithmeticError: drives press contacts together that nothing lets give way, or friction has
            no answer, or more than one.

    """
    state: TreeState = at.kept.state
    matrix, count = state.transform.matrix, len(laws)
    of_contacts = np.concatenate([gaps.rows, gaps.slides])
    struck = joints.struck(at)
    struck = struck[moved_by(of_contacts @ matrix, joints.rows[struck] @ matrix, at.mass)]
    rows = np.concatenate([of_contacts, joints.rows[struck]])
    free = rows @ matrix
    free[:count] = gaps.free
    mobility = free @ np.linalg.solve(at.mass, free.T)
    if len(struck):
        felt = joints.impulses_by(at, free, rows)[:, struck]
        speeds = joints.rows[struck] @ state.v
        none = np.zeros(len(struck))
        bounds = JointBounds(joints.shares[struck], felt, speeds, joints, struck, none)
        blow = _with_joints(mobility, gaps, restitution, laws, bounds)
    else:
        blow = _blow(mobility, gaps, restitution, laws)
        speeds = np.zeros(0)
    impulses = np.concatenate([blow.push, blow.rub, blow.joints])
    # Where Newton's law holds it does so exactly: a small bounce is not to be lost in rounding.
    before = gaps.touching[:, 1]
    jumps = np.linalg.solve(at.mass, free.T) * impulses
    rates = matrix @ jumps
    drives = at.kept.mass @ rates - rows.T * impulses
    work = drives.T @ state.v
    of_each, of_joints = work[:count] + work[count : 2 * count], work[2 * count :].sum()
    turned = speeds + speeds + mobility[2 * count :] @ impulses
    joints_lost = np.zeros(len(joints.all))
    joints_lost[struck] = -0.5 * (blow.joints - blow.lock) * turned
    # A freewheel locks once its speed has come to zero, and does no work by itself: what these
    # formulas say it does, contacts do that turn it.
    turns = np.abs(mobility[2 * count :, : 2 * count] * impulses[: 2 * count])
    turns = turns[:, :count] + turns[:, count:]
    whole = np.maximum(turns.sum(axis=1), TINY)  # 0 of a freewheel that none turns
    locked = (blow.lock * turned / whole) @ turns
    closed = blow.push * (before + blow.after) + locked
    slid = blow.rub * (gaps.slip + blow.slip)
    return Jump(
        jumps.sum(axis=1),
        blow.push,
        before,
        blow.after,
        -0.5 * (closed + slid),
        np.append(of_each, of_joints),
        blow.rub,
        joints_lost,
        rates.sum(axis=1),
        drives.sum(axis=1),
    )


def moved_by(rows: FloatArray, others: FloatArray, mass: FloatArray) -> BoolArray:
    """Tell which of `others` (k, n) impulses along some rows (m, n) move."""
    both = np.concatenate([rows, others])
    arms = np.linalg.solve(mass, both.T)
    sizes = np.sqrt(np.einsum("kn,nk->k", both, arms))
    moved = np.abs(others @ arms[:, : len(rows)])
    least = NOTHING_PASSED_ON * sizes[len(rows) :, None] * sizes[: len(rows)]
    return np.asarray((moved > least).any(axis=1))


def _blow(
    mobility: FloatArray, gaps: Gaps, restitution: FloatArray, laws: Sequence[RigidContact]
) -> Blow:
    """Impulses by speeds (2c, 2c) that units of them make, across and along all contacts."""
    before, count = gaps.touching[:, 1], len(laws)
    none = np.zeros(0)
    masses = mobility.reshape(2, count, 2, count)
    if coupled(masses, laws):
        hit = _all_at_once(mobility, gaps.speeds, restitution, laws)
        after = np.where(hit.across > 0, -restitution * before, hit.gap_rate)
        return Blow(hit.across, hit.along, none, none, after, hit.slip)
    across = mobility[:count, :count]
    push = complementary(across, (1 + restitution) * before)
    after = before + across @ push
    after = np.where(push > 0, -restitution * before, after)
    rub = np.zeros(count)
    slip = gaps.slip + mobility[count:, :count] @ push
    for c, law in enumerate(laws):
        if law.friction is None:
            continue
        meeting = _meeting(masses, gaps, c, law.name)
        push[c], rub[c] = _rubbed(meeting, law, float(restitution[c]))
        if not meeting.is_round:
            after[c] = before[c] + across[c, c] * push[c] + meeting.both * rub[c]
        slip[c] = meeting.slip + meeting.along * rub[c] + meeting.both * push[c]
    return Blow(push, rub, none, none, after, slip)


def _all_at_once(
    mobility: FloatArray,
    speeds: FloatArray,
    restitution: FloatArray,
    laws: Sequence[RigidContact],
    moved: FloatArray | None = None,
) -> RubbingImpact:
    """What contacts do, one or more of which rub; those without a law are smooth.

    Arguments are those of `rubbing_impact`, with the laws of the first contacts.
    """
    turned = [law.name for law in laws if law.tangential != 0]
    if turned:
        raise ArithmeticError(f"contact '{turned[0]}' {AMONG_OTHERS}")
    rough = np.zeros(len(restitution))
    rough[: len(laws)] = [0.0 if law.friction is None else law.friction.coefficient for law in laws]
    try:
        return rubbing_impact(mobility, speeds, restitution, rough, moved)
    except ArithmeticError as error:
        names = ", ".join(f"'{law.name}'" for law in laws)
        raise ArithmeticError(f"contacts {names} are closed at once: {error}") from None


class JointBounds(NamedTuple):
    """Joints (j,) that take an impulse: shares of the impulse in the joint, speeds before.

    `felt` (2c + j, j, 2) are impulses in them by units of those of contacts, across and along, and
    of their own friction; `which` are their numbers among all `joints`. `rub` (j,) are impulses of
    that friction as far as they are known.
    """

    shares: FloatArray
    felt: FloatArray
    speeds: FloatArray
    joints: JointFrictions
    which: IndexArray
    rub: FloatArray


def _with_joints(
    mobility: FloatArray,
    gaps: Gaps,
    restitution: FloatArray,
    laws: Sequence[RigidContact],
    joints: JointBounds,
) -> Blow:
    """Impulses of contacts, and of friction in joints, which is bounded by the joints' own.

    A joint that slides after is braked by all of its bound, as by Coulomb's law in contacts.

    Raises:
        LockedError: the bound grows with the friction itself.

    """
    contacts = 2 * len(laws)
    for _ in range(MOST_ROUNDS):
        blow = _beside_joints(mobility, gaps, restitution, laws, joints)
        impulses = np.concatenate([blow.push, blow.rub, blow.lock])
        free = joints.speeds + mobility[contacts:] @ impulses
        whole = np.append(impulses[:contacts], blow.lock + joints.rub)
        bound = joints.shares * np.linalg.norm(np.einsum("kji,k->ji", joints.felt, whole), axis=1)
        rub = within_bounds(mobility[contacts:, contacts:], free, (-bound, bound))
        change, joints = np.abs(rub - joints.rub), joints._replace(rub=rub)
        # Beside what would stop each joint: what is zero but for rounding never settles.
        moved = np.abs(joints.speeds) + np.abs(mobility[contacts:]) @ np.abs(impulses)
        if (change <= SEARCH_ROUNDING * moved / np.diag(mobility)[contacts:]).all():
            return blow._replace(joints=blow.lock + rub)
    raise LockedError(joints.joints.all[joints.which[0]].name)


def _beside_joints(
    mobility: FloatArray,
    gaps: Gaps,
    restitution: FloatArray,
    laws: Sequence[RigidContact],
    joints: JointBounds,
) -> Blow:
    """Impulses of contacts, and those (j,) with which freewheels lock, beside friction of joints.

    A freewheel is as one more contact, smooth and without a bounce; only its drag is friction.

    Raises:
        ArithmeticError: no impulses are known, or energy would be gained.

    """
    count, contacts = len(laws), 2 * len(laws)
    one_way = joints.joints.one_way[joints.which]
    wheels = np.flatnonzero(one_way)
    closing = count + len(wheels)
    numbers = np.r_[:count, contacts + wheels, count:contacts]
    signs = np.ones(len(numbers))
    signs[count:closing] = one_way[wheels]
    # Freewheels have no speed along themselves.
    system, speeds, moved = np.zeros((2 * closing,) * 2), *np.zeros((2, 2 * closing))
    used = slice(len(numbers))
    system[used, used] = mobility[np.ix_(numbers, numbers)] * signs[:, None] * signs
    speeds[used] = signs * np.append(gaps.speeds, joints.speeds)[numbers]
    moved[used] = signs * (mobility[numbers, contacts:] @ joints.rub)
    bounces = np.append(restitution, np.zeros(len(wheels)))
    if all(law.friction is None for law in laws):
        begin = speeds + moved
        across = complementary(
            system[:closing, :closing], begin[:closing] + bounces * speeds[:closing]
        )
        end = begin + system[:, :closing] @ across
        if gains_energy(across, begin[:closing], end[:closing]):
            names = ", ".join(f"'{law.name}'" for law in laws)
            raise ArithmeticError(f"restitution of {names} with a freewheel would gain energy")
        hit = RubbingImpact(across, np.zeros(closing), end[:closing], end[closing:])
    else:
        hit = _all_at_once(system, speeds, bounces, laws, moved)
    lock = np.zeros(len(joints.rub))
    lock[wheels] = one_way[wheels] * hit.across[count:]
    push = hit.across[:count]
    after = np.where(push > 0, -restitution * gaps.touching[:, 1], hit.gap_rate[:count])
    return Blow(push, hit.along[:count], lock, lock, after, hit.slip[:count])


def coupled(moved: FloatArray, laws: Sequence[RigidContact]) -> bool:
    """Tell whether one of some closed contacts that rubs moves others, or is moved by them.

    `moved` (2, c, 2, c) are speeds across and along contacts by 1 N s across and along each, 1/kg.
    """
    rough = [c for c, law in enumerate(laws) if law.friction is not None]
    sizes = np.sqrt(np.einsum("icic->ic", moved))
    felt = (np.abs(moved) > NOTHING_PASSED_ON * sizes[..., None, None] * sizes).any((0, 2))
    return any(np.count_nonzero(felt[c]) > 1 for c in rough)


def _meeting(moved: FloatArray, gaps: Gaps, c: int, name: str) -> Meeting:
    """What an impact of contact c moves, by `inverse_masses`."""
    mobilities = moved[1, c, 1, c], moved[0, c, 0, c], moved[0, c, 1, c]
    along, of_normal, both = map(float, mobilities)
    return Meeting(along, of_normal, both, float(gaps.slip[c]), float(gaps.touching[c, 1]), name)


def _rubbed(meeting: Meeting, law: RigidContact, restitution: float) -> tuple[float, float]:
    """Impulses (N s) of an impact across and along a contact that rubs."""
    assert law.friction is not None  # only those are asked for
    if meeting.rate >= 0:
        return 0.0, 0.0
    pressed, rub = impulses(meeting, law.friction.coefficient, restitution)
    if law.tangential == 0:
        return pressed, rub
    if not meeting.is_round:
        raise ArithmeticError(f"contact '{law.name}' {UNEVEN}")
    return pressed, turned_back(meeting, law.friction.coefficient, pressed, law.tangential)


@dataclass
class Impacts:
    """Changes of a model's rigid contacts, in a run."""

    model: MinimalModel
    finder: EventFinder
    recorder: TreeRecorder
    endless: str = ""

    def __post_init__(self) -> None:
        self.together: list[tuple[float, list[str]]] = []  # s, and contacts with one impact
        self._bounces = {
            k: Bounces(contact.name, contact.restitution) for k, contact in self._contacts.items()
        }

    @property
    def _contacts(self) -> dict[int, RigidContact]:
        return self.model.rigid.all

    def change(self, time: float, k: int) -> None:
        """Contact k closes, opens, or its point passes the face's line beside it."""
        touch = self.finder.touch(k)
        what = self.model.touches.crossing(k, touch.gap, touch.gap_rate, touch.inside)
        if what is Change.CLOSES:
            self._meet(time, k)
            return
        self._change(time, k, what)
        if what is not Change.PASSES:
            self._rest(time, self.model.rigid.closed(), None, {})

    # --- impacts ------------------------------------------------------------------------------

    def _meet(self, time: float, struck: int) -> None:
        """Let contacts that are closed bounce, or rest."""
        before = self.finder.seen
        which = [k for k in self._contacts if k == struck or self._is_closed(time, k)]
        at, gaps = self._look(time, which)
        restitution = np.array([self._contacts[k].restitution for k in which])
        free = gaps.free @ at.accelerations + gaps.bend
        over = np.array(
            [
                self.finder.presses(k) or is_over(-gaps.touching[c, 1], restitution[c], free[c])
                for c, k in enumerate(which)
            ]
        )
        restitution = np.where(over, 0.0, restitution)
        if gaps.touching[:, 1].min() < 0:
            laws = [self._contacts[k] for k in which]
            jump = jump_of(at, gaps, restitution, laws, self.model.frictions)
            self._jump(time, jump, which, over)
            hit = np.flatnonzero(jump.impulse > NOTHING_PASSED_ON * jump.impulse.max())
            moved = np.abs(mobility(gaps, at.mass)[1][np.ix_(hit, hit)])
            if restitution[hit].any() and np.triu(moved, 1).max() > NOTHING_PASSED_ON * moved.max():
                self.together.append((time, [self._bounces[which[c]].name for c in hit]))
        # The next bounce of one that was struck as it went away is lower than gaps are known to.
        slow = {k: INVISIBLE_SPEED if k == struck else REST_SPEED for k in which}
        resting = [
            k
            for k, e in zip(which, restitution.tolist(), strict=True)
            if e == 0 and self.finder.touch(k).gap_rate <= slow[k]
        ]
        for k in which:
            if self.finder.presses(k) and k not in resting:
                self._change(time, k, Change.OPENS)
        stopped = [k for k, ended in zip(which, over, strict=True) if ended]
        self._rest(
            time, resting, struck, {k: max(0.0, -float(before.gap_rate[k])) for k in stopped}
        )

    def _is_closed(self, time: float, k: int) -> bool:
        if self.finder.presses(k):
            return True
        touch = self.finder.touch(k)
        apart = (
            self.model.touches.crossing(k, touch.gap, touch.gap_rate, touch.inside) is Change.CLOSES
        )
        return apart and touch.gap_rate <= REST_SPEED and meets(touch, time)

    def _jump(self, time: float, jump: Jump, which: Sequence[int], over: BoolArray) -> None:
        """Let the speeds jump, and write down the impacts."""
        coordinates, before = self.model.coordinates, self.finder.seen
        z, v = coordinates.independent()
        end = self.model.state(time, z, v + jump.speeds)
        coordinates.settle(time, end, np.zeros(len(z)))
        self.finder.look_again(end)
        self.recorder.leap_of_joints(jump.joints_lost, float(jump.motor_work[-1]))
        impulses = np.zeros((2, len(self.model.contacts.all)))
        impulses[:, which] = jump.impulse, jump.rub
        self.recorder.jump(time, end, jump.rates, jump.held, impulses)
        for c, k in enumerate(which):
            totals = (jump.impulse[c], jump.lost[c], jump.motor_work[c])
            self.recorder.leap(k, *map(float, totals))
            if not over[c] and jump.impulse[c] > 0:
                hit = _interval(time, float(before.place[k]), jump, c)
                self.model.touches.bounce(k, hit)
                endless = self._bounces[k].endless(time, hit.approach_speed)
                self.endless = self.endless or endless

    # --- contacts that last -------------------------------------------------------------------

    def _rest(
        self, time: float, resting: Sequence[int], struck: int | None, approach: dict[int, float]
    ) -> None:
        """Let those of the contacts at rest press that have to, and open the others.

        The gap of `struck` falls; `approach` (m/s) are speeds at which contacts came to rest.
        """
        if not resting:
            return
        with self.model.touches.without(resting):
            self.finder.frictions.settle(time, *self.model.coordinates.independent())
            at, gaps = self._look(time, resting)
            soon = None if struck is None else self._free_soon(time, resting)
        now = at.accelerations
        free = gaps.free @ now + gaps.bend
        pushed = self.model.rigid.pushing(resting, gaps, at.kept.state)[1]
        smooth = pushed is gaps.free
        moved = self.model.rigid.opened(resting, gaps, mobility(gaps, at.mass)[0], pushed)
        count, known = len(resting), np.zeros(0)
        if self.model.frictions.all:
            answer = self.model.frictions.answer(at)
            moved, known = answer.moved(gaps.free, pushed, at.mass), answer.lock
            free = np.append(free, answer.away)
        acting = complementary(moved, free - moved[:, count:] @ known, even=smooth)
        press = acting[:count]
        # A gap that falls though nothing accelerates it yet will be pressed. Where a spring is just
        # unloaded, rounding alone tells what accelerates it now: a moment later the spring does.
        parts = np.abs(gaps.free) @ np.abs(now) + np.abs(gaps.bend)
        soonest = free[:count] if soon is None else np.minimum(free[:count], soon)
        answered = moved[:count] @ (acting - np.append(np.zeros(count), known))
        still = soonest + answered <= NO_ACCELERATION * parts
        pressed = (press > 0) | (still & (np.array(resting) == struck))
        for k, pressing in zip(resting, pressed.tolist(), strict=True):
            if pressing and not self.finder.presses(k):
                self._change(time, k, Change.CLOSES, -approach.get(k, 0.0))
            elif self.finder.presses(k) and not pressing:
                self._change(time, k, Change.OPENS)

    def _change(self, time: float, k: int, what: Change, rate: float | None = None) -> None:
        """Contact k begins or ends, with the `rate` of its gap (m/s) if that is not the present."""
        touch = self.finder.touch(k)
        rate = touch.gap_rate if rate is None else rate
        now = Moment(time, touch.place, rate, self.recorder.totals_of(k))
        self.model.touches.change(k, what, now)

    # --- the state now ------------------------------------------------------------------------

    def _look(
        self, time: float, which: Sequence[int], later: float = 0.0
    ) -> tuple[Evaluation, Gaps]:
        """Look at the state now, or a moment `later` (s), and at the gaps of some contacts then."""
        z, v = self.model.coordinates.independent()
        at = self.model.evaluate(time + later, z + later * v, v)
        gaps = self.model.rigid.gaps(which, at.kept.state.pick(None))
        return at, gaps.pick(0)

    def _free_soon(self, time: float, which: Sequence[int]) -> FloatArray:
        """Accelerations (m/s^2) of gaps without force, as late as counts as the same instant."""
        moment = SAME_INSTANT * instant(time, EVENT_TIME)
        at, gaps = self._look(time, which, moment)
        return np.asarray(gaps.free @ at.accelerations + gaps.bend)


def _interval(time: float, place: float, jump: Jump, c: int) -> Interval:
    """Impact number c of a jump, at a time (s) and a place on its face (m)."""
    return Interval(
        time,
        time,
        place,
        place,
        approach_speed=-float(jump.before[c]),
        separation_speed=float(jump.after[c]),
        impulse=float(jump.impulse[c]),
        energy_lost=float(jump.lost[c]),
        peak_force=inf,
        motor_work=float(jump.motor_work[c]),
        tangential_impulse=float(jump.rub[c]),
    )

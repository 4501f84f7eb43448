"""Impacts by impulse, at an instant at which gaps of rigid contacts close.

The configuration stays, the speeds z' jump by impulses p along the gaps' gradients G:

    M (z'_s - z'_a) = G^T p,      0 <= p,   g'_s + e g'_a >= 0,   p (g'_s + e g'_a) = 0

with g' the rates of the gaps before (a) and after (s): Newton's law of impact for all contacts that
are closed at that instant, as complementarity (J. J. Moreau, in *Nonsmooth Mechanics and
Applications*, Springer 1988; F. Pfeiffer and Ch. Glocker, *Multibody Dynamics with Unilateral
Contacts*, Wiley 1996, ch. 8). The kinetic energy changes by ``p (g'_a + g'_s)/2`` of each contact,
and by the work of drives that keep their speeds. Bounces get shorter and shorter; where the next
bounce would be too low to be seen, the contact rests. Which of the resting contacts press is again
a complementarity problem, of their accelerations.

In the impact of a single contact with Coulomb's friction both impulses grow together until it is
over. With the inverse masses k_t, k_n and k_tn at the contact, slip u and rate w of the gap follow

    u = u_a + k_t P_t + k_tn P_n,      w = w_a + k_n P_n + k_tn P_t

as P_n grows (E. J. Routh, *Dynamics of a System of Rigid Bodies*, part 1, 1897; Y. Wang and
M. T. Mason, J. Appl. Mech. 59 (1992) 635). While the contact slides dP_t = -mu sgn(u) dP_n. Where u
comes to zero, it sticks if friction is enough, and else slides back. The gap closes until w = 0, at
P_c, and the impact is over at (1 + e) P_c. This is Poisson's restitution, which never adds energy.
With k_tn = 0, as of a round body, it is the same as Newton's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import copysign, inf
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
    JointFrictions,
    LockedError,
    within_bounds,
)
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.engines.exudyn.minimal.recording import TreeRecorder
from exudyn_flexlink.engines.exudyn.minimal.rigid import Gaps, JammedError, RigidContact, mobility
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
from exudyn_flexlink.rounding import LEAST_LENGTH, NEGLIGIBLE, TINY

SAME_INSTANT = 10.0  # times the error of an instant: a gap that is zero so soon counts as closed
# m/s: a slower point that leaves a contact counts as at rest. Errors of gaps give it such speeds,
# and nobody sees that.
INVISIBLE_SPEED = 1e-4
# Of an impact's largest impulse, or of its largest effect on a gap: a smaller one is rounding. Of a
# rigid contact's largest reaction in the last step: a reaction above minus this counts as zero.
WEAK_PUSH = 1e-6
AMONG_OTHERS = "turns slip back, which is known of one contact alone, without friction in joints"
UNEVEN = "turns slip back where the bodies are not round about it: that would make energy"


class Meeting(NamedTuple):
    """Inverse masses k_t, k_n, k_tn (1/kg) of an impact; slip u_a and gap rate w_a before (m/s).

    `contact` is the name of the contact.
    """

    along: float
    across: float
    both: float
    slip: float
    rate: float
    contact: str = ""

    @property
    def is_round(self) -> bool:
        """Tell whether k_tn is zero: an impulse across does not change the slip, and vice versa."""
        return self.both**2 <= NEGLIGIBLE**2 * self.along * self.across


def impulses(meeting: Meeting, friction: float, restitution: float) -> tuple[float, float]:
    """Return P_n and P_t (N s) of an impact with a coefficient of friction and a restitution.

    Raises:
        JammedError: no impulse, however large, ends the approach.

    """
    both = 0.0 if meeting.is_round else meeting.both
    slides, then = _ways(meeting, both, friction)
    turning = both + meeting.along * slides
    stops = (
        -meeting.slip / turning if meeting.slip * turning < 0 else 0.0 if meeting.slip == 0 else inf
    )
    closing = meeting.across + both * slides
    squeezed = -meeting.rate / closing if closing > NEGLIGIBLE * meeting.across else inf
    if squeezed > stops:
        rate, closing = meeting.rate + closing * stops, meeting.across + both * then
        squeezed = stops - rate / closing if closing > NEGLIGIBLE * meeting.across else inf
    if squeezed == inf:
        raise JammedError(meeting.contact)
    pressed = (1 + restitution) * squeezed
    slid = min(pressed, stops)
    return pressed, slides * slid + then * (pressed - slid)


def _ways(meeting: Meeting, both: float, friction: float) -> tuple[float, float]:
    """Return dP_t/dP_n at first, and after the slip has come to zero."""
    sticks = meeting.along > 0 and abs(both) <= friction * meeting.along
    # Friction has no effect where nothing can move along the face, and needs no force at rest.
    then = -both / meeting.along if sticks else -copysign(friction, both) if both else 0.0
    return (-copysign(friction, meeting.slip) if meeting.slip else then), then


def turned_back(meeting: Meeting, friction: float, pressed: float, returns: float) -> float:
    """Return P_t (N s) of a round body, whose slip turns back by the part `returns`."""
    if meeting.along == 0:
        return 0.0
    bound = friction * pressed
    return max(-bound, min(bound, -(1 + returns) * meeting.slip / meeting.along))


def meets(touch: Touch, time: float) -> bool:
    """Tell whether a gap is closed at a time (s), but for the error of the instant."""
    return abs(touch.gap) <= LEAST_LENGTH + SAME_INSTANT * instant(time, EVENT_TIME) * abs(
        touch.gap_rate
    )


class Jump(NamedTuple):
    """Jump of the independent speeds in an impact, and the part of each contact (c,) in it.

    Of contacts: `impulse` and the impulse `rub` of friction (N s), rates of the gap `before` and
    `after` (m/s), energy `lost` (J), and `motor_work` (c + 1,), J, of the drives that keep their
    speeds; its last entry is their work against friction in joints. `joints_lost` (joints,), J, is
    the energy that friction in joints takes. `rates` (links,) are jumps of all speeds, `held`
    (links,) the impulses of motors, slots and loops.
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
    """Impulses `push` and `rub` of contacts (c,), and those in `joints` (j,), N s.

    Of the impulses in joints, `lock` is the part by which freewheels lock; the rest is friction.
    `after` and `slip` are the rates of the gaps and the slips after the impact, m/s.
    """

    push: FloatArray
    rub: FloatArray
    joints: FloatArray
    lock: FloatArray
    after: FloatArray
    slip: FloatArray


def jump_of(
    evaluation: Evaluation,
    gaps: Gaps,
    restitution: FloatArray,
    laws: Sequence[RigidContact],
    joints: JointFrictions,
) -> Jump:
    """Jump at one state, by contacts (c,) that are closed.

    Raises:
        ArithmeticError: drives press rigid contacts together, or friction has no solution, or
            several.

    """
    state: TreeState = evaluation.kept.state
    matrix, count = state.transform.matrix, len(laws)
    of_contacts = np.concatenate([gaps.rows, gaps.slides])
    struck = joints.struck(evaluation)
    struck = struck[moved_by(of_contacts @ matrix, joints.rows[struck] @ matrix, evaluation.mass)]
    rows = np.concatenate([of_contacts, joints.rows[struck]])
    free = rows @ matrix
    free[:count] = gaps.free
    mobility = free @ np.linalg.solve(evaluation.mass, free.T)
    if len(struck):
        felt = joints.impulses_by(evaluation, free, rows)[:, struck]
        speeds = joints.rows[struck] @ state.v
        none = np.zeros(len(struck))
        bounds = JointBounds(joints.shares[struck], felt, speeds, joints, struck, none)
        blow = _with_joints(mobility, gaps, restitution, laws, bounds)
    else:
        blow = _blow(mobility, gaps, restitution, laws)
        speeds = np.zeros(0)
    impulses = np.concatenate([blow.push, blow.rub, blow.joints])
    # `after` follows Newton's law exactly, so that a small bounce is not lost in rounding.
    before = gaps.touching[:, 1]
    jumps = np.linalg.solve(evaluation.mass, free.T) * impulses
    rates = matrix @ jumps
    drives = evaluation.kept.mass @ rates - rows.T * impulses
    work = drives.T @ state.v
    of_each, of_joints = work[:count] + work[count : 2 * count], work[2 * count :].sum()
    turned = speeds + speeds + mobility[2 * count :] @ impulses
    joints_lost = np.zeros(len(joints.all))
    joints_lost[struck] = -0.5 * (blow.joints - blow.lock) * turned
    # A freewheel locks when its speed is zero, and does no work. The work that these formulas give
    # it belongs to the contacts that turn it.
    turns = np.abs(mobility[2 * count :, : 2 * count] * impulses[: 2 * count])
    turns = turns[:, :count] + turns[:, count:]
    whole = np.maximum(turns.sum(axis=1), TINY)  # 0 if no contact turns a freewheel
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
    """Tell which of the rows `others` (k, n) impulses along `rows` (m, n) move."""
    both = np.concatenate([rows, others])
    arms = np.linalg.solve(mass, both.T)
    sizes = np.sqrt(np.einsum("kn,nk->k", both, arms))
    moved = np.abs(others @ arms[:, : len(rows)])
    least = WEAK_PUSH * sizes[len(rows) :, None] * sizes[: len(rows)]
    return np.asarray((moved > least).any(axis=1))


def _blow(
    mobility: FloatArray, gaps: Gaps, restitution: FloatArray, laws: Sequence[RigidContact]
) -> Blow:
    """Impulses of contacts; `mobility` (2c, 2c) has speeds, across and along, by unit impulses."""
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
    """Impact of contacts of which one or more rub; the arguments are those of `rubbing_impact`.

    `laws` are those of the first contacts; the others, without a law, are smooth.
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
    """Joints (j,) that act in an impact: shares of the impulse in the joint, and speeds before.

    `felt` (2c + j, j, 2) are impulses in these joints by unit impulses of contacts, across and
    along, and of the joints' friction; `which` are their numbers among all `joints`. `rub` (j,) are
    impulses of friction, as far as the iteration knows them.
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
    """Impulses of contacts, and of friction in joints, which the impulses in the joints bound.

    If a joint slides after the impact, its friction is at the bound, as by Coulomb's law.

    Raises:
        LockedError: the bound grows as fast as the friction itself.

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
        # A change counts beside what would stop each joint: an impulse that is zero but for
        # rounding never settles.
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
    """Impulses of contacts, and those (j,) by which freewheels lock, with given friction in joints.

    A freewheel is treated as one more contact, smooth and without bounce; its drag is friction.

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
    # Freewheels have speeds across, and none along.
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
    """Tell whether a closed contact that rubs moves other contacts, or is moved by them.

    `moved` (2, c, 2, c) are speeds across and along contacts by 1 N s across and along each, 1/kg.
    """
    rough = [c for c, law in enumerate(laws) if law.friction is not None]
    sizes = np.sqrt(np.einsum("icic->ic", moved))
    felt = (np.abs(moved) > WEAK_PUSH * sizes[..., None, None] * sizes).any((0, 2))
    return any(np.count_nonzero(felt[c]) > 1 for c in rough)


def _meeting(moved: FloatArray, gaps: Gaps, c: int, name: str) -> Meeting:
    """The impact of contact c alone; `moved` is that of `coupled`."""
    mobilities = moved[1, c, 1, c], moved[0, c, 0, c], moved[0, c, 1, c]
    along, of_normal, both = map(float, mobilities)
    return Meeting(along, of_normal, both, float(gaps.slip[c]), float(gaps.touching[c, 1]), name)


def _rubbed(meeting: Meeting, law: RigidContact, restitution: float) -> tuple[float, float]:
    """Impulses (N s) of an impact across and along a contact that rubs."""
    assert law.friction is not None  # only contacts that rub come here
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
        """Contact k closes or opens, or its point passes beside the face."""
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
        state, gaps = self._look(time, which)
        restitution = np.array([self._contacts[k].restitution for k in which])
        free = gaps.free @ state.accelerations + gaps.bend
        over = np.array(
            [
                self.finder.presses(k) or is_over(-gaps.touching[c, 1], restitution[c], free[c])
                for c, k in enumerate(which)
            ]
        )
        restitution = np.where(over, 0.0, restitution)
        if gaps.touching[:, 1].min() < 0:
            laws = [self._contacts[k] for k in which]
            jump = jump_of(state, gaps, restitution, laws, self.model.frictions)
            self._jump(time, jump, which, over)
            hit = np.flatnonzero(jump.impulse > WEAK_PUSH * jump.impulse.max())
            moved = np.abs(mobility(gaps, state.mass)[1][np.ix_(hit, hit)])
            if restitution[hit].any() and np.triu(moved, 1).max() > WEAK_PUSH * moved.max():
                self.together.append((time, [self._bounces[which[c]].name for c in hit]))
        # A point that leaves more slowly than this would bounce lower than the error of its gap.
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
        """Let the speeds jump, and record the impacts."""
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
        """Let those contacts at rest press that forces close, and open the others.

        The gap of contact `struck` has just come to zero; `approach` (m/s) are the speeds at which
        contacts came to rest.
        """
        if not resting:
            return
        with self.model.touches.without(resting):
            self.finder.frictions.settle(time, *self.model.coordinates.independent())
            state, gaps = self._look(time, resting)
            soon = None if struck is None else self._free_soon(time, resting)
        now = state.accelerations
        free = gaps.free @ now + gaps.bend
        pushed = self.model.rigid.pushing(resting, gaps, state.kept.state)[1]
        smooth = pushed is gaps.free
        moved = self.model.rigid.opened(resting, gaps, mobility(gaps, state.mass)[0], pushed)
        count, known = len(resting), np.zeros(0)
        if self.model.frictions.all:
            answer = self.model.frictions.answer(state)
            moved, known = answer.moved(gaps.free, pushed, state.mass), answer.lock
            free = np.append(free, answer.away)
        acting = complementary(moved, free - moved[:, count:] @ known, symmetric=smooth)
        press = acting[:count]
        # A gap that closes without any acceleration yet will be pressed soon. If a spring has just
        # no force, the present acceleration is rounding; a moment later it is the spring's.
        parts = np.abs(gaps.free) @ np.abs(now) + np.abs(gaps.bend)
        soonest = free[:count] if soon is None else np.minimum(free[:count], soon)
        answered = moved[:count] @ (acting - np.append(np.zeros(count), known))
        still = soonest + answered <= NEGLIGIBLE * parts
        pressed = (press > 0) | (still & (np.array(resting) == struck))
        for k, pressing in zip(resting, pressed.tolist(), strict=True):
            if pressing and not self.finder.presses(k):
                self._change(time, k, Change.CLOSES, -approach.get(k, 0.0))
            elif self.finder.presses(k) and not pressing:
                self._change(time, k, Change.OPENS)

    def _change(self, time: float, k: int, what: Change, rate: float | None = None) -> None:
        """Contact k begins or ends; `rate` (m/s) is that of its gap, if not the present one."""
        touch = self.finder.touch(k)
        rate = touch.gap_rate if rate is None else rate
        now = Moment(time, touch.place, rate, self.recorder.totals_of(k))
        self.model.touches.change(k, what, now)

    # --- the state now ------------------------------------------------------------------------

    def _look(
        self, time: float, which: Sequence[int], later: float = 0.0
    ) -> tuple[Evaluation, Gaps]:
        """Evaluate the present state, or that `later` by a time (s), with gaps of some contacts."""
        z, v = self.model.coordinates.independent()
        state = self.model.evaluate(time + later, z + later * v, v)
        gaps = self.model.rigid.gaps(which, state.kept.state.pick(None))
        return state, gaps.pick(0)

    def _free_soon(self, time: float, which: Sequence[int]) -> FloatArray:
        """Accelerations (m/s^2) of gaps without force, at the end of what counts as one instant."""
        moment = SAME_INSTANT * instant(time, EVENT_TIME)
        state, gaps = self._look(time, which, moment)
        return np.asarray(gaps.free @ state.accelerations + gaps.bend)


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

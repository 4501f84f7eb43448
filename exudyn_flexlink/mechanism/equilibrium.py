"""Where all forces balance while drives stand still, searched downhill from an assembled start.

With f the applied forces, J the slopes of the joints and l their multipliers, a rest has
``f + J^T l = 0``. Motions that joints allow are ``N z``, with ``N^T M N = 1``, so that
``K = -N^T d(f + J^T l)/dq N`` has the squares of the angular frequencies as its eigenvalues. Each
step is Newton's with the absolute values of these: where K is negative it leads away from what
balances there (Y. Dauphin et al., Adv. Neural Inf. Process. Syst. 27 (2014)). Where it still ends
on an unstable balance, it is pushed off that.

Told are where a mechanism rests, what its joints hold there, and small motions about that; which
bodies can move, what drives leave to forces, and other ways to close the joints.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import pi

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray, IndexArray
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.mechanism.assembly import Assembly, State, standing_at, without_play
from exudyn_flexlink.mechanism.build import flank_pushes, tooth_pushes, without_teeth
from exudyn_flexlink.mechanism.closing import (
    CLOSED,
    CannotAssembleError,
    Start,
    kept_in,
    shuffled,
    straight_positions,
)
from exudyn_flexlink.mechanism.constraints import (
    Constraints,
    anchor_position,
    constraint_rows,
    length_along,
    line_of,
    motor_place,
    places_near,
    slot_point,
    speed_along,
)
from exudyn_flexlink.mechanism.contacts import approach, gradient, pressed_among
from exudyn_flexlink.mechanism.dynamics import applied_forces, constraints_at, mass_blocks, pushed
from exudyn_flexlink.mechanism.least_motion import (
    NO_JOINT,
    LeastMotion,
    scale_roots,
    spanning_tree,
    within_body,
)
from exudyn_flexlink.mechanism.model import GROUND, Contact, Mechanism, RopeContact, Slide
from exudyn_flexlink.mechanism.prescribed import Ramp
from exudyn_flexlink.raising import Sendable


class NoRestError(Sendable, ValueError):
    """There is no rest near the start.

    Because of a `kind`: a "body", by its `name`, that a `force` (N) drives on and on; or a
    "contact" by impulse that would have to press.
    """

    def __init__(self, kind: str, name: str, force: float = 0.0) -> None:
        super().__init__(f"no rest is found: {kind} '{name}'")
        self.kind, self.name, self.force = kind, name, force


@dataclass(frozen=True)
class Rest:
    """Where all forces balance; SI units.

    `presses` (N; N m of a hinge's stop) are forces of the contacts that press, by name. Small
    motions go as exp(s t) with the `exponents` s (n,), undamped: purely imaginary where stable;
    with dampers they have those of `damped`. `stiffness` and `damping` (n, n) are by motions of
    unit mass. `left` are the rates (1/s) at which the unstable balances grow that were found on the
    way here, and left.
    """

    assembly: Assembly
    joints: Constraints
    multipliers: FloatArray
    presses: Mapping[str, float]
    exponents: ComplexArray
    stiffness: FloatArray
    damping: FloatArray
    left: tuple[float, ...]

    @property
    def frequencies(self) -> FloatArray:
        """Frequencies (n,) Hz of small motions about it, undamped; 0 of what nothing resists."""
        return np.sort(np.abs(self.exponents.imag)) / (2 * pi)

    @property
    def damped(self) -> ComplexArray:
        """Exponents (1/s) with dampers and contacts that lose energy; of each pair that of Im > 0.

        Empty where nothing damps.
        """
        if not np.any(self.damping):
            return np.zeros(0, dtype=complex)
        count = len(self.damping)
        by_state = np.hstack([-self.stiffness, -self.damping])
        exponents = np.linalg.eigvals(np.vstack([np.eye(count, 2 * count, count), by_state]))
        exponents = exponents[exponents.imag >= 0].astype(complex)
        return np.asarray(exponents[np.argsort(np.abs(exponents))])

    @property
    def growth(self) -> float:
        """Rate (1/s) at which a small motion grows most; 0 if none does."""
        return float(np.abs(self.exponents.real).max(initial=0.0))

    @property
    def stable(self) -> bool:
        """Whether small motions stay small."""
        return self.growth == 0

    @property
    def poses(self) -> dict[str, FloatArray]:
        """By body [x, y, angle] (m, m, rad), of a flexible one those of its rods (rods, 3)."""
        q, bodies = self.assembly.state.q, self.assembly.mechanism.bodies.items()
        return {name: q[list(parts)] if len(parts) > 1 else q[parts[0]] for name, parts in bodies}

    @property
    def points(self) -> dict[str, FloatArray]:
        """Place [x, y] (m) of every point, by 'body.point'."""
        points = self.assembly.mechanism.points.items()
        return {name: anchor_position(anchor, self.assembly.state.q) for name, anchor in points}

    @property
    def forces(self) -> dict[str, FloatArray]:
        """Force [x, y] (N) in every joint, on the body of its second point."""
        pushes = self.joints.slopes[:, 1, :2] * self.multipliers[:, None]
        kinds, mechanism = ("revolute", "weld", "slide", "slot"), self.assembly.mechanism
        carried = {name: np.array([force]) for name, force in self.gears.items()}
        q = self.assembly.state.q[None]
        presses = {name: np.array([press]) for name, press in self.presses.items()}
        teeth = tooth_pushes(mechanism.gears, carried, q)
        teeth += flank_pushes(mechanism.contacts, presses, q)
        return {
            name: without_teeth(name, pushes[rows].sum(axis=0)[None], teeth)[0]
            for name, rows in self._rows(*kinds)
        }

    @property
    def gears(self) -> dict[str, float]:
        """Tangential force (N) of gears, racks and belts, without pitch circles a torque (N m)."""
        return {name: self._last(rows) for name, rows in self._rows("gear")}

    @property
    def torques(self) -> dict[str, float]:
        """Torque (N m) of what can't turn, welds and slides, on the same body."""
        return {name: self._last(rows) for name, rows in self._rows("weld", "slide")}

    @property
    def drives(self) -> dict[str, float]:
        """What drives hold that prescribe motions, on the same body: N m, along a slide N."""
        return {name: self._last(rows) for name, rows in self._rows("drive", "slide drive")}

    def _last(self, rows: slice) -> float:
        return float(self.multipliers[rows][-1])

    def _rows(self, *kinds: str) -> list[tuple[str, slice]]:
        """Names and rows of joints or drives of some kinds, without those within bodies."""
        joints, mechanism = self.joints, self.assembly.mechanism
        starts = joints.first_rows.tolist()
        named = zip(joints.names, joints.kinds, starts, starts[1:], strict=False)
        return [
            (name, slice(first, last))
            for name, kind, first, last in named
            if kind in kinds and not within_body(mechanism, *joints.parts[first, :2].tolist())
        ]

    @property
    def notes(self) -> list[str]:
        """What has to be known of this rest, in sentences."""
        texts = []
        if not self.stable:
            texts.append(f"it is unstable: small motions grow by exp({self.growth:.4g} t/s)")
        elif self.left:
            texts.append(
                f"an unstable rest was found first (it grows by exp({self.left[0]:.4g} t/s)), and "
                "left: guess other angles to take the other side"
            )
        frictions = self.assembly.mechanism.frictions
        if wheels := [friction.name for friction in frictions if friction.one_way]:
            texts.append(
                f"what {', '.join(wheels)} would hold as a freewheel is left out: this is where it "
                "has nothing to hold"
            )
        if rubbing := [friction.name for friction in frictions if not friction.one_way]:
            texts.append(
                f"dry friction of {', '.join(rubbing)} would hold anywhere near, within its bound: "
                "this is where nothing has to"
            )
        if shared := shared_forces(self.assembly):
            texts.append(
                f"forces in {', '.join(sorted(shared))} are not unique: the least are told"
            )
        return texts


STEPS, HALVINGS, CLOSING = 400, 40, 12
LONGEST = 0.5  # rad, or of the largest part's reach: of one step
KICK = 0.05  # likewise: off an unstable balance
KICKS = 8
DT = 1e-5  # likewise: of central differences
SETTLED = 1e-7  # likewise: the forces after a step so short are rounding
STIFFNESS_ROUNDING = 1e-8  # of the largest stiffness: less is rounding of differences
BALANCED = 1e-9  # of all forces: so little is left of them where they balance
REACH_ROUNDING = 1e-15  # of the reach: joints are as closed as they can be
DEPENDENT = 1e-9  # of the size of a motion or of a joint's row: less than this is rounding
SLOWEST = 1e-6  # 1/s^2: what resists less is as good as free
OF_ENERGY = 1e-5  # of the largest stiffness: K is symmetric, as forces with an energy have it


def rest_of(assembly: Assembly) -> Rest:
    """Find the rest that lies downhill from an assembled mechanism, drives held at time 0.

    Dry friction, freewheels and dampers do nothing; springs at rest as assembled stay as they are.
    Contacts whose law has a stiffness press by their depth.

    Raises:
        ArithmeticError: a drive or a spring has no value where the search begins.
        NoRestError: none is found, or a contact by impulse would have to hold it.

    """
    search, unstable, before = _Search(assembly), list[_Look](), np.inf
    q, places = assembly.state.q, assembly.state.places
    for _ in range(STEPS):
        look = search.look(q, places)
        step = look.newton
        size = search.size(step)
        if not look.balanced or size < before / 2:
            before = size if look.balanced else np.inf
            moved = search.downhill(look, step)
        elif look.lowest >= 0 or len(unstable) == KICKS:
            return search.resting(look, unstable)
        else:
            unstable.append(look)
            step, before = look.upset, np.inf
            moved = search.moved(q, places, step * (KICK / search.size(step)))
        if moved is None:
            break
        q, places = moved
    if unstable:  # nothing is below it
        return search.resting(unstable[0], [])
    raise _no_rest(assembly.mechanism, look)


@dataclass(frozen=True)
class _Look:
    """The forces at coordinates `q`, and how they change with the motions N that joints allow."""

    q: FloatArray
    places: FloatArray
    joints: Constraints
    multipliers: FloatArray
    presses: dict[str, float]
    motions: FloatArray  # N: (parts, 3, n)
    slope: FloatArray  # (n,): minus the forces along them
    stiffness: FloatArray  # K: (n, n)
    rounding: float  # of the slope: of forces that joints hold, and of places by the stiffness

    @property
    def balanced(self) -> bool:
        """Whether nothing is left of the forces but rounding."""
        return bool(np.abs(self.slope).max(initial=0.0) <= self.rounding)

    @property
    def squares(self) -> FloatArray:
        """Squares (n,) of angular frequencies, 1/s^2; complex where forces have no energy."""
        largest = float(np.abs(self.stiffness).max(initial=0.0))
        if np.abs(self.stiffness - self.stiffness.T).max(initial=0.0) > OF_ENERGY * largest:
            eigenvalues = np.sort_complex(np.linalg.eigvals(self.stiffness))
        else:
            eigenvalues = self._modes[0].astype(complex)
        return np.where(np.abs(eigenvalues) > STIFFNESS_ROUNDING * largest, eigenvalues, 0.0)

    @property
    def lowest(self) -> float:
        """The least of them by energy: negative where forces drive off."""
        return float(min(self.squares.real.min(initial=0.0), 0.0))

    @property
    def upset(self) -> FloatArray:
        """Motion (parts, 3) that the forces drive off most; largest to the positive side."""
        motion = self.motions @ self._modes[1][:, 0]
        return np.asarray(motion * np.sign(motion.ravel()[np.argmax(np.abs(motion))]))

    @property
    def newton(self) -> FloatArray:
        """The next step (parts, 3): Newton's, downhill where K is negative, far where it is 0."""
        values, ways = self._modes
        least = STIFFNESS_ROUNDING * float(np.abs(values).max(initial=0.0))
        along = ways.T @ self.slope
        if self.balanced:  # what resists nothing stays
            along = np.where(np.abs(values) > least, along, 0.0)
        sizes = np.maximum(np.abs(values), max(least, SLOWEST))
        if values.min(initial=0.0) >= -least and self.balanced and len(values):
            kept = ways[:, values > least]
            curvature = kept.T @ self.stiffness @ kept
            return np.asarray(
                -self.motions @ (kept @ np.linalg.solve(curvature, kept.T @ self.slope))
            )
        return np.asarray(-self.motions @ (ways @ (along / sizes)))

    @cached_property
    def _modes(self) -> tuple[FloatArray, FloatArray]:
        values, ways = np.linalg.eigh((self.stiffness + self.stiffness.T) / 2)
        return values, ways


class _Search:
    """A mechanism whose drives and gears hold what they have at first; the scale of its motions.

    It has no dry friction.
    """

    def __init__(self, assembly: Assembly) -> None:
        self._assembly, q = assembly, assembly.state.q
        mechanism = assembly.mechanism
        motors = mechanism.speed_motors
        held = tuple(replace(motor, start=float(motor_place(motor, q))) for motor in motors)
        joints = constraint_rows(mechanism, q, assembly.state.places)
        firsts = zip(joints.kinds, joints.first_rows.tolist(), strict=False)
        meshed = iter(joints.residual[[row for kind, row in firsts if kind == "gear"]].tolist())
        gears = tuple(replace(gear, start=next(meshed)) for gear in mechanism.gears)
        self._mechanism = replace(mechanism, speed_motors=held, gears=gears, frictions=())
        self._tree = spanning_tree(mechanism)
        pairs, idle = mechanism.contacts_and_pairs, mechanism.idle_walls
        self._contacts = tuple(_held(pair) for k, pair in enumerate(pairs) if k not in idle)
        self._reach = max(part.reach for part in mechanism.parts)

    def size(self, step: FloatArray) -> float:
        """How large a step (parts, 3) is: rad, and of the largest part's reach."""
        return float((np.abs(step) / (self._reach, self._reach, 1.0)).max(initial=0.0))

    # --- forces -------------------------------------------------------------------------------

    def look(self, q: FloatArray, places: FloatArray) -> _Look:
        """Find the forces, and how they change with motions."""
        forces, presses = self._forces(q)
        joints = constraints_at(self._mechanism, q, places)
        back = np.linalg.inv(np.linalg.cholesky(mass_blocks(self._mechanism, q)))
        rows = joints.jacobian().reshape(-1, *q.shape)
        rows = np.einsum("rnj,nkj->rnk", rows, back).reshape(-1, q.size)
        lengths = np.maximum(np.linalg.norm(rows, axis=1), 1e-300)
        left, sizes, ways = np.linalg.svd(rows / lengths[:, None])
        rank = int((sizes > DEPENDENT * sizes.max(initial=0.0)).sum())
        pulled = np.einsum("nij,nj->ni", back, forces.reshape(q.shape)).ravel()
        multipliers = -(left[:, :rank] / sizes[:rank]) @ (ways[:rank] @ pulled) / lengths
        motions = np.einsum("nji,njk->nik", back, ways[rank:].T.reshape(*q.shape, -1))
        stiffness = self._stiffness(q, places, multipliers, motions)
        slope, stiffest = -ways[rank:] @ pulled, float(np.abs(stiffness).max(initial=0.0))
        longest = max(
            (1 / self.size(motion) for motion in np.moveaxis(motions, -1, 0)), default=0.0
        )
        off = (
            REACH_ROUNDING * max(1.0, self.size(q)) * longest
        )  # places and angles are rounded, too
        rounding = BALANCED * float(np.linalg.norm(pulled)) + stiffest * off
        return _Look(q, places, joints, multipliers, presses, motions, slope, stiffness, rounding)

    def _forces(
        self, q: FloatArray, v: FloatArray | None = None
    ) -> tuple[FloatArray, dict[str, float]]:
        """Generalised forces (3 parts,) with those of contacts, and these (N) by name; at rest."""
        speeds = np.zeros_like(q) if v is None else v
        forces, presses = applied_forces(self._mechanism, q, speeds, 0.0), {}
        for contact in (self._contacts[k] for k in pressed_among(self._contacts, q)):
            if not isinstance(contact.law, Impulse):
                touch = approach(contact, q, speeds)
                press = float(contact.law.force(-touch.gap, -touch.gap_rate, 0.0))
                forces += press * gradient(contact, q)
                presses[contact.name] = press
        return forces, presses

    def _stiffness(
        self, q: FloatArray, places: FloatArray, multipliers: FloatArray, motions: FloatArray
    ) -> FloatArray:
        """K, by central differences; what joints hold with turns as their parts do."""
        columns = []
        for motion in np.moveaxis(motions, -1, 0):
            dt = DT / self.size(motion)
            before, after = (
                self._forces(pose)[0]
                + constraints_at(self._mechanism, pose, places).holding(multipliers).ravel()
                for pose in (q - dt * motion, q + dt * motion)
            )
            columns.append((before - after) / (2 * dt))
        changes = np.array(columns).reshape(-1, q.size)
        return np.asarray(motions.reshape(q.size, -1).T @ changes.T)

    def _damping(self, look: _Look) -> FloatArray:
        """C, by central differences of speeds."""
        columns = []
        for motion in np.moveaxis(look.motions, -1, 0):
            dt = DT / self.size(motion)
            slower, faster = (self._forces(look.q, v)[0] for v in (-dt * motion, dt * motion))
            columns.append((slower - faster) / (2 * dt))
        changes = np.array(columns).reshape(-1, look.q.size)
        return np.asarray(look.motions.reshape(look.q.size, -1).T @ changes.T)

    def resting(self, look: _Look, unstable: list[_Look]) -> Rest:
        """Put together what is known of a rest, and of those that were left for it."""
        mechanism, laps = self._assembly.mechanism, self._assembly.state.laps
        for k in pressed_among(self._contacts, look.q):
            if isinstance(self._contacts[k].law, Impulse):
                raise NoRestError("contact", self._contacts[k].name)
        slots = zip(mechanism.slots, laps, look.places.tolist(), strict=True)
        places = np.array([kept_in(slot, lap, look.q, place) for slot, lap, place in slots])
        whole = standing_at(mechanism, look.q, places, laps)
        exponents = np.sqrt(-look.squares.astype(complex))
        growing = (float(np.sqrt(-left.lowest)) for left in unstable)
        return Rest(
            whole, look.joints, look.multipliers, look.presses, exponents,
            look.stiffness, self._damping(look), tuple(growing),
        )  # fmt: skip

    # --- steps --------------------------------------------------------------------------------

    def downhill(self, look: _Look, step: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Go along a step so far that the forces do not yet drive back by half of what they did."""
        size, first = self.size(step), self._power((look.q, look.places), step)
        step = step * min(1.0, LONGEST / max(size, 1e-300))
        for _ in range(HALVINGS):
            moved = self.moved(look.q, look.places, step)
            if moved is not None and (size < SETTLED or self._power(moved, step) >= -first / 2):
                return moved
            step = step / 2
        return None

    def _power(self, state: tuple[FloatArray, FloatArray], step: FloatArray) -> float:
        """Work of the forces along a motion at coordinates and places."""
        forces, mechanism = self._forces(state[0])[0], self._mechanism
        moving = pushed(mechanism, *state, forces)
        return float(np.einsum("ni,nij,nj", moving, mass_blocks(mechanism, state[0]), step))

    def moved(
        self, q: FloatArray, places: FloatArray, step: FloatArray
    ) -> tuple[FloatArray, FloatArray] | None:
        """Go along a step and close the joints; None where they don't, or a curve ends."""
        try:
            q = self._on_arcs(q, step)
            for _ in range(CLOSING):
                places = places_near(self._mechanism, q, places)
                joints = constraints_at(self._mechanism, q, places)
                if np.abs(joints.residual).max(initial=0.0) <= REACH_ROUNDING * self._reach:
                    break
                roots = scale_roots(self._mechanism)
                q = q + LeastMotion(self._mechanism, joints, roots, -joints.residual).nearest()
            self._forces(q)
        except (ArithmeticError, np.linalg.LinAlgError):  # a table or a formula ends before
            return None
        slots = zip(self._mechanism.slots, places.tolist(), strict=True)
        off = [np.abs(slot_point(slot, q) - slot.curve.point(u)).max() for slot, u in slots]
        worst = max([*off, np.abs(joints.residual).max(initial=0.0)])
        return (q, places) if worst <= CLOSED else None

    def _on_arcs(self, q: FloatArray, step: FloatArray) -> FloatArray:
        """Turn and slide joints of the spanning tree: straight moves would stretch what turns."""
        tree, placed = self._tree, q + step
        joints = [*self._mechanism.attachments, *self._mechanism.slides]
        for part in tree.order:
            if tree.joints[part] == NO_JOINT:
                continue
            joint = joints[tree.joints[part]]
            way = 1 if joint.second.part == part else -1
            other, first = (joint.first, joint.second)[::way]
            placed[part, :2] += anchor_position(other, placed) - anchor_position(first, placed)
            if isinstance(joint, Slide):
                length = length_along(joint, q) + speed_along(joint, q, step)
                placed[part, :2] += way * length * line_of(joint, placed)
        return placed


def _held(contact: Contact) -> Contact:
    """Return a contact as it is at a rest: a winch stands still."""
    if not isinstance(contact, RopeContact):
        return contact
    return replace(contact, free_length=Ramp(contact.free_length.at(0.0)))


def _no_rest(mechanism: Mechanism, look: _Look) -> NoRestError:
    """Name the body that forces drive on most."""
    driven = np.einsum("nij,nj->ni", mass_blocks(mechanism, look.q), -look.motions @ look.slope)
    part = int(np.argmax(np.linalg.norm(driven[:, :2], axis=1)))
    far = float(np.linalg.norm(driven[part, :2]))
    return NoRestError("body", mechanism.parts[part].body, far)


STARTS = 24  # searches, each from other guesses: four-bars and sliders show both ways by the third
SAME = 1e-6  # rad: by so little or less the angles of one way differ


def moved_by_forces(assembly: Assembly) -> list[str]:
    """Names of the bodies that can move while every speed drive stands still.

    A flexible body counts as straight here: that it bends is no motion of the others.
    """
    mechanism = assembly.mechanism
    names, moved = list(mechanism.bodies), set[int]()
    for bodies, motions in free_motions(mechanism, assembly.state):
        sizes = np.linalg.norm(motions.reshape(len(bodies), -1), axis=1)
        moved |= set(bodies[sizes > DEPENDENT].tolist())
    return [name for body, name in enumerate(names) if body in moved]


def free_motions(mechanism: Mechanism, state: State) -> Iterator[tuple[IndexArray, FloatArray]]:
    """Give bodies (n,) that joints and drives connect, with all motions (3 n, freedoms) they allow.

    Bodies move as one with their first part. Those that nothing connects are solved apart, so that
    the work grows with the cube of a group, not of the mechanism.
    """
    firsts = np.array([parts[0] for parts in mechanism.bodies.values()], dtype=int)
    body_numbers = np.repeat(np.arange(len(firsts)), [len(p) for p in mechanism.bodies.values()])
    joints = constraint_rows(mechanism, state.q, state.places)
    carried = np.tile(np.eye(3), (len(body_numbers), 1, 1))
    arms = state.q[:, :2] - state.q[firsts[body_numbers], :2]
    carried[:, 0, 2], carried[:, 1, 2] = -arms[:, 1], arms[:, 0]
    moving = joints.parts != GROUND
    slopes = np.where(moving[:, :, None], joints.slopes, 0.0)[:, :, None] @ carried[joints.parts]
    # What is the ground counts as one of the parts that the same row moves.
    moved = joints.parts.max(axis=1, keepdims=True)
    ends = body_numbers[np.where(moving, joints.parts, moved)]
    group_numbers = _connected(len(firsts), ends)
    by_group = np.argsort(group_numbers, kind="stable")
    for bodies in np.split(by_group, np.flatnonzero(np.diff(group_numbers[by_group])) + 1):
        inside = np.flatnonzero(group_numbers[ends[:, 0]] == group_numbers[bodies[0]])
        rows = np.zeros((len(inside), len(bodies), 3))
        for side in range(ends.shape[1]):
            np.add.at(rows, (np.arange(len(inside)), np.searchsorted(bodies, ends[inside, side])),
                      slopes[inside, side, 0])  # fmt: skip
        yield bodies, _null_space(rows.reshape(len(inside), 3 * len(bodies)))


def _connected(bodies: int, ends: IndexArray) -> IndexArray:
    """Give each body the number of its group: that of the first body in it."""
    # SciPy has this, too, but `check` would wait for its import.
    groups, before = np.arange(bodies), np.full(bodies, -1)
    while (groups != before).any():
        before = groups.copy()
        np.minimum.at(groups, ends, before[ends].min(axis=1)[:, None])
        groups = groups[groups]
    return groups


def _null_space(rows: FloatArray) -> FloatArray:
    """Motions (coordinates, freedoms) that all rows allow, perpendicular and of length 1."""
    _, sizes, directions = np.linalg.svd(rows)
    rank = int((sizes > DEPENDENT * sizes.max(initial=0.0)).sum())
    return np.asarray(directions[rank:].T)


def shared_forces(assembly: Assembly) -> set[str]:
    """Names of the joints whose forces the motion does not tell, for others hold the same."""
    if not assembly.surplus:
        return set()
    joints = constraint_rows(assembly.mechanism, assembly.state.q, assembly.state.places)
    idle = np.abs(_null_space(joints.jacobian().T)).max(axis=1, initial=0.0) > DEPENDENT
    starts = joints.first_rows[:-1]
    return {name for name, any_idle in zip(joints.names, np.logical_or.reduceat(idle, starts),
                                           strict=True) if any_idle}  # fmt: skip


def other_branches(assembly: Assembly, start: Start) -> list[FloatArray]:
    """Angles (parts,) in rad of every other way to close the joints that a few searches find.

    What is free to move stays where the assembly has it, and so does what `start` holds. Flexible
    bodies are straight in all of them.
    """
    mechanism = assembly.mechanism
    bodies = list(mechanism.bodies.values())
    firsts = [parts[0] for parts in bodies]
    held = _independent(assembly)
    pose = assembly.state.q
    angles = dict(start.angles)
    for body, axis in held:
        if axis == 2:
            angles |= {part: float(pose[part, 2]) for part in bodies[body]}
    places = {firsts[body]: (float(x), float(y)) for body, axis in held if axis < 2
              for x, y in [pose[firsts[body], :2]]}  # fmt: skip
    fixed = replace(start, angles=angles, positions={**start.positions, **places})
    loose = [parts for parts in bodies if parts[0] not in angles]
    return _searched(assembly, fixed, loose) if loose else []


def _searched(assembly: Assembly, fixed: Start, loose: list[tuple[int, ...]]) -> list[FloatArray]:
    mechanism = without_play(assembly.mechanism, set(fixed.angles))
    known = [assembly.state.q[:, 2]]
    for start in shuffled(fixed, loose, STARTS):
        try:
            q, _ = straight_positions(mechanism, start)
        except CannotAssembleError:
            continue
        if all(_apart(q[:, 2], angles) > SAME for angles in known):
            known.append(q[:, 2])
    return known[1:]


def _apart(first: FloatArray, second: FloatArray) -> float:
    """Largest difference of two sets of angles, whole turns left out."""
    return float(np.abs(np.angle(np.exp(1j * (first - second)))).max(initial=0.0))


def _independent(assembly: Assembly) -> list[tuple[int, int]]:
    """Coordinates (body, axis) that decide where all bodies stand; angles are preferred."""
    # What a drive, or a gear, moves is free here, and then held where it stands.
    without = replace(without_play(assembly.mechanism, set()), speed_motors=(), gears=())
    independent = []
    for bodies, free in free_motions(without, assembly.state):
        motions = free
        for axis in (2, 0, 1):
            for k, body in enumerate(bodies.tolist()):
                left = motions[3 * k + axis]
                size = float(np.linalg.norm(left))
                if size > DEPENDENT:
                    independent.append((body, axis))
                    motions = motions - np.outer(motions @ left, left) / size**2
    return independent

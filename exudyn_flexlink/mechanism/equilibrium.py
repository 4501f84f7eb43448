"""Rests: poses at which all forces balance while drives stand still, searched downhill.

With f the applied forces, J the slopes of the joints and l their multipliers, a rest has ``f + J^T
l = 0``. Motions that joints allow are ``N z``, with ``N^T M N = 1``, so that ``K = -N^T d(f + J^T
l)/dq N`` has the squares of the angular frequencies as its eigenvalues. Each step is Newton's with
the absolute values of these: along motions of negative K it leads away from the balance (Y. Dauphin
et al., Adv. Neural Inf. Process. Syst. 27 (2014)). If the search still ends at an unstable balance,
the mechanism is pushed off and the search goes on.

The module gives the rest of a mechanism, with forces in joints and small motions about it; the
bodies that can move while drives stand still; and other ways to close the joints.
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
from exudyn_flexlink.mechanism.joints import GROUND, NO_ITEM, Contact, RopeContact, Slide
from exudyn_flexlink.mechanism.least_motion import (
    LeastMotion,
    scale_roots,
    spanning_tree,
    within_body,
)
from exudyn_flexlink.mechanism.model import Mechanism
from exudyn_flexlink.mechanism.prescribed import Ramp
from exudyn_flexlink.raising import Sendable
from exudyn_flexlink.rounding import NEGLIGIBLE, TINY, UNIT_ROUNDING


class NoRestError(Sendable, ValueError):
    """There is no rest near the start.

    The `kind` of reason is "body", with the `name` of a body that a `force` (N) drives on and on;
    or "contact", with the name of a contact by impulse that would have to press.
    """

    def __init__(self, kind: str, name: str, force: float = 0.0) -> None:
        super().__init__(f"no rest is found: {kind} '{name}'")
        self.kind, self.name, self.force = kind, name, force


@dataclass(frozen=True)
class Rest:
    """A pose at which all forces balance; SI units.

    `presses` are forces of the contacts that press, by name (N; N m at a hinge's stop). Small
    motions without dampers go as exp(s t), with the `exponents` s (n,), which are imaginary at a
    stable rest. `damped` has the exponents with dampers. `stiffness` and `damping` (n, n) are by
    motions of unit mass. `left` are growth rates (1/s) of unstable rests that the search met and
    left.
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
        """Frequencies (n,), Hz, of small undamped motions; 0 for motions without stiffness."""
        return np.sort(np.abs(self.exponents.imag)) / (2 * pi)

    @property
    def damped(self) -> ComplexArray:
        """Exponents (1/s) with dampers and contacts that lose energy; of pairs those of Im > 0.

        Empty without damping.
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
        """Largest growth rate (1/s) of a small motion; 0 if none grows."""
        return float(np.abs(self.exponents.real).max(initial=0.0))

    @property
    def stable(self) -> bool:
        """Whether small motions stay small."""
        return self.growth == 0

    @property
    def poses(self) -> dict[str, FloatArray]:
        """Pose [x, y, angle] (m, m, rad) by body; (rods, 3) for flexible ones."""
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
        """Tangential force (N) of gears, racks and belts; torque (N m) without pitch circles."""
        return {name: self._last(rows) for name, rows in self._rows("gear")}

    @property
    def torques(self) -> dict[str, float]:
        """Torque (N m) of welds and slides, which can't turn, on the same body."""
        return {name: self._last(rows) for name, rows in self._rows("weld", "slide")}

    @property
    def drives(self) -> dict[str, float]:
        """Torque (N m), or force along a slide (N), of drives that prescribe motions; same body."""
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
        """Remarks on this rest, in sentences."""
        texts = []
        if not self.stable:
            texts.append(f"it is unstable: small motions grow by exp({self.growth:.4g} t/s)")
        elif self.left:
            texts.append(
                f"the search left an unstable rest (it grows by exp({self.left[0]:.4g} t/s)): "
                "guess other angles to take its other side"
            )
        frictions = self.assembly.mechanism.frictions
        if wheels := [friction.name for friction in frictions if friction.one_way]:
            texts.append(
                f"freewheels are left out ({', '.join(wheels)}): at this rest they hold nothing"
            )
        if rubbing := [friction.name for friction in frictions if not friction.one_way]:
            texts.append(
                f"dry friction is left out ({', '.join(rubbing)}): within its bound it can hold "
                "the mechanism anywhere near this rest"
            )
        if shared := shared_forces(self.assembly):
            texts.append(
                f"forces in {', '.join(sorted(shared))} are not unique: the smallest are given"
            )
        return texts


STEPS, HALVINGS, CLOSING = 400, 40, 12
LONGEST = 0.5  # rad, or of the largest part's reach: largest step
KICK = 0.05  # likewise: push off an unstable rest
KICKS = 8
DT = 1e-5  # likewise: step of central differences
SETTLED = 1e-7  # likewise: after so short a step the forces are rounding
STIFFNESS_ROUNDING = 1e-8  # of the largest stiffness: less is rounding of differences
SLOWEST = 1e-6  # 1/s^2: a motion of less stiffness counts as free
OF_ENERGY = 1e-5  # of the largest stiffness: K counts as symmetric, so forces have an energy


def rest_of(assembly: Assembly) -> Rest:
    """Find the rest downhill from an assembled mechanism, with drives held at time 0.

    Dry friction, freewheels and dampers are left out. A spring without tension as assembled keeps
    its rest length.
    Contacts whose law has a stiffness press by their depth.

    Raises:
        ArithmeticError: a drive or a spring has no value at the start of the search.
        NoRestError: no rest is found, or a contact by impulse would have to hold it.

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
    if unstable:  # no rest is below it
        return search.resting(unstable[0], [])
    raise _no_rest(assembly.mechanism, look)


@dataclass(frozen=True)
class _Look:
    """Forces at coordinates `q`, and their slopes along the motions N that joints allow."""

    q: FloatArray
    places: FloatArray
    joints: Constraints
    multipliers: FloatArray
    presses: dict[str, float]
    motions: FloatArray  # N: (parts, 3, n)
    slope: FloatArray  # (n,): minus the forces along the motions
    stiffness: FloatArray  # K: (n, n)
    rounding: float  # of the slope, by forces in joints, and by rounded places times stiffness

    @property
    def balanced(self) -> bool:
        """Whether the sum of forces is rounding."""
        return bool(np.abs(self.slope).max(initial=0.0) <= self.rounding)

    @property
    def squares(self) -> FloatArray:
        """Squares (n,) of angular frequencies, 1/s^2; complex if forces have no energy."""
        largest = float(np.abs(self.stiffness).max(initial=0.0))
        if np.abs(self.stiffness - self.stiffness.T).max(initial=0.0) > OF_ENERGY * largest:
            eigenvalues = np.sort_complex(np.linalg.eigvals(self.stiffness))
        else:
            eigenvalues = self._modes[0].astype(complex)
        return np.where(np.abs(eigenvalues) > STIFFNESS_ROUNDING * largest, eigenvalues, 0.0)

    @property
    def lowest(self) -> float:
        """The least square; negative if forces drive off the rest, else 0."""
        return float(min(self.squares.real.min(initial=0.0), 0.0))

    @property
    def upset(self) -> FloatArray:
        """Motion (parts, 3) that forces drive off most; its largest entry is positive."""
        motion = self.motions @ self._modes[1][:, 0]
        return np.asarray(motion * np.sign(motion.ravel()[np.argmax(np.abs(motion))]))

    @property
    def newton(self) -> FloatArray:
        """The next step (parts, 3): Newton's; downhill if K is negative, long if it is 0."""
        values, ways = self._modes
        least = STIFFNESS_ROUNDING * float(np.abs(values).max(initial=0.0))
        along = ways.T @ self.slope
        if self.balanced:  # no motion without stiffness
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
    """A mechanism whose drives and gears keep their first values, and the scale of its motions.

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
        """Size of a step (parts, 3), in rad and parts of the largest reach."""
        return float((np.abs(step) / (self._reach, self._reach, 1.0)).max(initial=0.0))

    # --- forces -------------------------------------------------------------------------------

    def look(self, q: FloatArray, places: FloatArray) -> _Look:
        """Compute the forces and their slopes along motions."""
        forces, presses = self._forces(q)
        joints = constraints_at(self._mechanism, q, places)
        back = np.linalg.inv(np.linalg.cholesky(mass_blocks(self._mechanism, q)))
        rows = joints.jacobian().reshape(-1, *q.shape)
        rows = np.einsum("rnj,nkj->rnk", rows, back).reshape(-1, q.size)
        lengths = np.maximum(np.linalg.norm(rows, axis=1), TINY)
        left, sizes, ways = np.linalg.svd(rows / lengths[:, None])
        rank = int((sizes > NEGLIGIBLE * sizes.max(initial=0.0)).sum())
        pulled = np.einsum("nij,nj->ni", back, forces.reshape(q.shape)).ravel()
        multipliers = -(left[:, :rank] / sizes[:rank]) @ (ways[:rank] @ pulled) / lengths
        motions = np.einsum("nji,njk->nik", back, ways[rank:].T.reshape(*q.shape, -1))
        stiffness = self._stiffness(q, places, multipliers, motions)
        slope, stiffest = -ways[rank:] @ pulled, float(np.abs(stiffness).max(initial=0.0))
        longest = max(
            (1 / self.size(motion) for motion in np.moveaxis(motions, -1, 0)), default=0.0
        )
        off = UNIT_ROUNDING * max(1.0, self.size(q)) * longest  # rounding of places and angles
        rounding = NEGLIGIBLE * float(np.linalg.norm(pulled)) + stiffest * off
        return _Look(q, places, joints, multipliers, presses, motions, slope, stiffness, rounding)

    def _forces(
        self, q: FloatArray, v: FloatArray | None = None
    ) -> tuple[FloatArray, dict[str, float]]:
        """Generalised forces (3 parts,), and forces of contacts (N) by name; `v` is 0 if None."""
        speeds = np.zeros_like(q) if v is None else v
        forces, presses = applied_forces(self._mechanism, q, speeds, 0.0), {}
        for contact in (self._contacts[k] for k in pressed_among(self._contacts, q)):
            if not isinstance(contact.law, Impulse):
                touch = approach(contact, q, speeds, 0.0)
                press = float(contact.law.force(-touch.gap, -touch.gap_rate, 0.0))
                forces += press * gradient(contact, q)
                presses[contact.name] = press
        return forces, presses

    def _stiffness(
        self, q: FloatArray, places: FloatArray, multipliers: FloatArray, motions: FloatArray
    ) -> FloatArray:
        """K, by central differences; forces in joints turn with their parts."""
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
        """Make the Rest; `unstable` are the rests that the search left."""
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
        """Go along a step, shortened until forces drive back at most half as much as on."""
        size, first = self.size(step), self._power((look.q, look.places), step)
        step = step * min(1.0, LONGEST / max(size, TINY))
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
        """Go along a step and close the joints; None if they don't close, or a curve ends."""
        try:
            q = self._on_arcs(q, step)
            for _ in range(CLOSING):
                places = places_near(self._mechanism, q, places)
                joints = constraints_at(self._mechanism, q, places)
                if np.abs(joints.residual).max(initial=0.0) <= UNIT_ROUNDING * self._reach:
                    break
                roots = scale_roots(self._mechanism)
                q = q + LeastMotion(self._mechanism, joints, roots, -joints.residual).nearest()
            self._forces(q)
        except (ArithmeticError, np.linalg.LinAlgError):  # a table or a formula has no value
            return None
        slots = zip(self._mechanism.slots, places.tolist(), strict=True)
        off = [np.abs(slot_point(slot, q) - slot.curve.point(u)).max() for slot, u in slots]
        worst = max([*off, np.abs(joints.residual).max(initial=0.0)])
        return (q, places) if worst <= CLOSED else None

    def _on_arcs(self, q: FloatArray, step: FloatArray) -> FloatArray:
        """Turn and slide joints of the spanning tree: straight steps would stretch parts."""
        tree, placed = self._tree, q + step
        joints = [*self._mechanism.attachments, *self._mechanism.slides]
        for part in tree.order:
            if tree.joints[part] == NO_ITEM:
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
    """Return a contact at rest: the winch of a rope stands still."""
    if not isinstance(contact, RopeContact):
        return contact
    return replace(contact, free_length=Ramp(contact.free_length.at(0.0)))


def _no_rest(mechanism: Mechanism, look: _Look) -> NoRestError:
    """Name the body that forces drive on most."""
    driven = np.einsum("nij,nj->ni", mass_blocks(mechanism, look.q), -look.motions @ look.slope)
    part = int(np.argmax(np.linalg.norm(driven[:, :2], axis=1)))
    far = float(np.linalg.norm(driven[part, :2]))
    return NoRestError("body", mechanism.parts[part].body, far)


STARTS = 24  # searches from different guesses: four-bars and sliders need three for both branches
SAME_WAY = 1e-6  # rad, or rad/s, m/s: largest difference of bodies that stand, or move, alike


def moved_by_forces(assembly: Assembly) -> list[str]:
    """Names of the bodies that can move while every speed drive stands still.

    A flexible body counts as straight: its bending is no motion of other bodies.
    """
    mechanism = assembly.mechanism
    names, moved = list(mechanism.bodies), set[int]()
    for bodies, motions in free_motions(mechanism, assembly.state):
        sizes = np.linalg.norm(motions.reshape(len(bodies), -1), axis=1)
        moved |= set(bodies[sizes > NEGLIGIBLE].tolist())
    return [name for body, name in enumerate(names) if body in moved]


def free_motions(mechanism: Mechanism, state: State) -> Iterator[tuple[IndexArray, FloatArray]]:
    """Yield groups of connected bodies (n,) with all motions (3 n, freedoms) that joints allow.

    All parts of a body move with its first part. Groups without a connection are solved apart: so
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
    # In place of the ground, another part that the same row moves is counted.
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
    """Number of each body's group: that of the first body in it."""
    # SciPy has this, too, but `check` would wait for its import.
    groups, before = np.arange(bodies), np.full(bodies, -1)
    while (groups != before).any():
        before = groups.copy()
        np.minimum.at(groups, ends, before[ends].min(axis=1)[:, None])
        groups = groups[groups]
    return groups


def _null_space(rows: FloatArray) -> FloatArray:
    """Orthonormal motions (coordinates, freedoms) that all rows allow."""
    _, sizes, directions = np.linalg.svd(rows)
    rank = int((sizes > NEGLIGIBLE * sizes.max(initial=0.0)).sum())
    return np.asarray(directions[rank:].T)


def shared_forces(assembly: Assembly) -> set[str]:
    """Names of the joints whose forces are not unique, since other joints hold the same."""
    if not assembly.surplus:
        return set()
    joints = constraint_rows(assembly.mechanism, assembly.state.q, assembly.state.places)
    idle = np.abs(_null_space(joints.jacobian().T)).max(axis=1, initial=0.0) > NEGLIGIBLE
    starts = joints.first_rows[:-1]
    return {name for name, any_idle in zip(joints.names, np.logical_or.reduceat(idle, starts),
                                           strict=True) if any_idle}  # fmt: skip


def other_branches(assembly: Assembly, start: Start) -> list[FloatArray]:
    """Angles (parts,), rad, of every other branch that a few searches find.

    A branch is a way to close the joints. Free coordinates stay as assembled, held ones as in
    `start`. Flexible bodies are straight.
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
        if all(_apart(q[:, 2], angles) > SAME_WAY for angles in known):
            known.append(q[:, 2])
    return known[1:]


def _apart(first: FloatArray, second: FloatArray) -> float:
    """Largest difference between two sets of angles, without whole turns."""
    return float(np.abs(np.angle(np.exp(1j * (first - second)))).max(initial=0.0))


def _independent(assembly: Assembly) -> list[tuple[int, int]]:
    """Coordinates (body, axis) that determine all poses; angles are preferred."""
    # Bodies that a drive or a gear moves are free here, and are then held in their poses.
    without = replace(without_play(assembly.mechanism, set()), speed_motors=(), gears=())
    independent = []
    for bodies, free in free_motions(without, assembly.state):
        motions = free
        for axis in (2, 0, 1):
            for k, body in enumerate(bodies.tolist()):
                left = motions[3 * k + axis]
                size = float(np.linalg.norm(left))
                if size > NEGLIGIBLE:
                    independent.append((body, axis))
                    motions = motions - np.outer(motions @ left, left) / size**2
    return independent

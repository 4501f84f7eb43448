"""Guide, link and levers as they move at instants: what the equations are solved for, and with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.curves import Places
from exudyn_flexlink.engines.lagrangian.contacts import Contacts, Pushed
from exudyn_flexlink.engines.lagrangian.equations import Frame, frame_of, mass_and_force
from exudyn_flexlink.engines.lagrangian.model import Model, turning_row
from exudyn_flexlink.engines.lagrangian.track import TrackPoint
from exudyn_flexlink.engines.touching import Touches
from exudyn_flexlink.result import Event

BAUMGARTE_RATE = 1e3  # 1/s: decay of the rounding in the gap of a held contact (Baumgarte 1972)


class Timed(NamedTuple):
    """What time alone tells at instants (m,) s.

    Angle, speed and acceleration of a driven guide, torques of motors (m, N); where P is, if that
    follows: its places (m,) on its piece, and `track` as in `equations`.
    """

    t: FloatArray
    angle: FloatArray
    speed: FloatArray
    alpha: FloatArray
    motors: FloatArray
    place: FloatArray | None = None
    track: Places | None = None


class Motion(NamedTuple):
    """What is known at instants (m,) before accelerations; `mass` and `force` are of all N."""

    t: FloatArray
    frame: Frame
    place: FloatArray  # (m,): P's on its piece
    alpha: FloatArray  # (m,): prescribed acceleration of the guide, rad/s^2
    motors: FloatArray  # (m, N): torques of motors
    mass: FloatArray
    force: FloatArray  # without rigid contacts
    pushed: Pushed | None  # by the contacts that press with a penalty

    def pick(self, which: int | slice | None) -> Motion:
        """Return one of several instants, some, or (None) the only one as one of one."""
        pushed = self.pushed and self.pushed.pick(which)
        alone = (self.t, self.place, self.alpha, self.motors, self.mass, self.force)
        t, *rest = (own[which] for own in alone)
        return Motion._make((t, self.frame.pick(which), *rest, pushed))


def joined(parts: Sequence[Motion]) -> Motion:
    """Return instants one after the other; the same contacts press at all of them."""
    t, frames, *rest, pushes = zip(*parts, strict=True)
    frame = Frame._make(map(np.concatenate, zip(*frames, strict=True)))
    pushed: Pushed | None = pushes[0]
    if pushed is not None:
        columns = zip(*(own[1:] for own in pushes), strict=True)
        pushed = Pushed(pushed.which, *map(np.concatenate, columns))
    return Motion._make((np.concatenate(t), frame, *map(np.concatenate, rest), pushed))


class System:
    """The equations of a model, with the contacts that press now."""

    def __init__(self, model: Model, laps: list[Event]) -> None:
        self.model = model
        self.contacts = Contacts(model)
        self.touches = Touches(self.contacts.all, self.contacts.faces)
        state, layout = model.assembly.state, model.layout
        slot = model.mechanism.slots[0]
        self.track = TrackPoint(slot, float(state.places[0]), state.laps[0], laps)
        self._centre = complex(*layout.guide.at)
        self._angle = float(model.start[0][0])
        self._timed: Timed | None = None
        self._motors = [
            (ramp, turning_row(layout, motor.first, motor.second)) for motor, ramp in layout.torques
        ]

    @property
    def giving_way(self) -> IndexArray:
        """Contacts that press with a penalty."""
        return np.flatnonzero(self.touches.pressed & ~self.touches.rigid)

    @property
    def held(self) -> IndexArray:
        """Contacts by impulse whose gaps stay closed."""
        return np.flatnonzero(self.touches.pressed & self.touches.rigid)

    @property
    def dead_centre(self) -> str:
        """Says so where the guide's angle as good as does not tell where P is."""
        return "" if self.model.layout.play else self.track.touched_by_axis(self._centre)

    def forget(self) -> None:
        """P goes on from another place, or on another piece."""
        self._timed = None

    def _at(self, t: FloatArray) -> Timed:
        """What time tells at instants, once for all rounds of a step, and for its end."""
        known = self._timed
        if known is not None and len(known.t) == len(t) and (known.t == t).all():
            return known
        layout, count = self.model.layout, self.model.layout.count
        ramp, way, none = layout.ramp, layout.way, np.zeros(len(t))
        motors = np.zeros((len(t), count))
        for own, row in self._motors:
            motors += np.outer(own.values(t), row)
        if ramp is None:
            self._timed = Timed(t, none, none, none, motors)
            return self._timed
        angle = self._angle + way * ramp.integrals(t)
        found = Timed(t, angle, way * ramp.values(t), way * ramp.rates(t), motors)
        if not layout.play:
            u, places = self.track.crossed(self._centre, np.exp(1j * angle))
            found = found._replace(place=u, track=places)
        self._timed = found
        return found

    def frame(self, t: FloatArray, q: FloatArray, v: FloatArray) -> tuple[Frame, FloatArray]:
        """Where all is at instants (m,) s and free coordinates and speeds; P's places (m,).

        Raises:
            DeadCentreError: the guide's angle does not tell where P is.

        """
        model, now = self.model, self._at(t)
        if model.first:
            q = np.concatenate([now.angle[:, None], q], axis=1)
            v = np.concatenate([now.speed[:, None], v], axis=1)
        u, places = now.place, now.track
        if model.layout.play:
            u = q[:, -1]
            places = self.track.at(u)
        elif u is None or places is None:
            u, places = self.track.crossed(self._centre, np.exp(1j * q[:, 0]))
        return frame_of(model.numbers, q, v, places), u

    def motion(self, t: FloatArray, q: FloatArray, v: FloatArray) -> Motion:
        """Mass matrices and forces; see `frame`."""
        at, u = self.frame(t, q, v)
        numbers, now = self.model.numbers, self._at(t)
        mass, force = mass_and_force(numbers, at)
        force, which = force + now.motors, self.giving_way
        pushed = self.contacts.push(at, which) if len(which) else None
        if pushed is not None:
            force = force + pushed.force
        return Motion(t, at, u, now.alpha, now.motors, mass, force, pushed)

    def accelerations(self, at: Motion) -> tuple[FloatArray, FloatArray]:
        """Accelerations (m, N), and forces (m, k) of the contacts that are held closed, N.

        ``M q'' = Q - h + G^T F``, and for each of them ``g'' = G q'' + b = 0``, with what rounding
        leaves of the gap dying out.
        """
        first, held = self.model.first, self.held
        found = np.zeros(at.force.shape)
        if first:
            found[:, 0] = at.alpha
        right = at.force[:, first:] - at.mass[:, first:, 0] * at.alpha[:, None] * bool(first)
        mass, count = at.mass[:, first:, first:], at.force.shape[1] - first
        if not len(held):
            found[:, first:] = np.linalg.solve(mass, right[:, :, None])[:, :, 0]
            return found, np.zeros((len(at.t), 0))
        closed = self.contacts.push(at.frame, held)
        rows = closed.rows[:, :, first:]
        whole = np.zeros((len(at.t), count + len(held), count + len(held)))
        whole[:, :count, :count], whole[:, count:, :count] = mass, rows
        whole[:, :count, count:] = -rows.swapaxes(1, 2)
        bend = self.contacts.bend(at.frame, held)
        bend += BAUMGARTE_RATE * (2 * closed.gap_rate + BAUMGARTE_RATE * closed.gap)
        if first:
            bend += closed.rows[:, :, 0] * at.alpha[:, None]
        solved = np.linalg.solve(whole, np.concatenate([right, -bend], axis=1)[:, :, None])
        found[:, first:] = solved[:, :count, 0]
        return found, solved[:, count:, 0]

    def motor_torque(self, at: Motion, a: FloatArray, held: FloatArray) -> FloatArray:
        """Torque (m,) of the speed drive on the guide, from its own row of the equations, N m."""
        if not self.model.first:
            return np.zeros(len(at.t))
        torque = np.einsum("mj,mj->m", at.mass[:, 0], a) - at.force[:, 0]
        if held.shape[1]:
            rows = self.contacts.push(at.frame, self.held).rows[:, :, 0]
            torque = torque - (rows * held).sum(axis=1)
        return np.asarray(torque)

"""Motion of guide, link and levers at instants, and its equations.

Without play P is where the axis from the guide's pivot C, along e, crosses the track: with
``w = gamma(u) - C`` and x the 2D cross product, ``e x w = 0``. Derivatives by the angle, with
``sigma = e x gamma_u`` and ``r = e.w``:

    u' = r / sigma,    u'' = (2 (e.gamma_u) u' - (e x gamma_uu) u'^2) / sigma
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray, IndexArray
from exudyn_flexlink.curves import Places
from exudyn_flexlink.engines.lagrangian.contacts import (
    Contacts,
    PinnedContacts,
    PinOnTrack,
    Pushed,
)
from exudyn_flexlink.engines.lagrangian.model import (
    Frame,
    Model,
    frame_of,
    mass_and_force,
    moved_by,
    turning_row,
)
from exudyn_flexlink.engines.touching import Side, Touches, press_by
from exudyn_flexlink.engines.track_follower import (
    LEAST_PART,
    NEWTON_STEPS,
    QUADRATIC,
    DeadCentreError,
    TrackFollower,
)
from exudyn_flexlink.integrate.problem import Evaluation, Press
from exudyn_flexlink.mechanism import Seen, place_in
from exudyn_flexlink.result import Event
from exudyn_flexlink.rounding import NEGLIGIBLE

# Sine of the angle between guide and track at a dead centre, if steps get too short to go on.
NEARLY = 1e-5
SLANTING = 1e-2  # such a sine: an axis that lost the track at a larger angle did not touch it
TOUCHES = "the guide's axis touches the track"
MISSES = "the guide's axis misses the track"


class TrackPoint(TrackFollower):
    """The track of P; `u` is P's place on the present piece after the last accepted step.

    Every search starts from it, so trial steps leave no trace. Only the `trouble` of the last
    search without a result is kept.
    """

    trouble = ""

    @property
    def at(self) -> Callable[[FloatArray], Places]:
        """Places and two derivatives (m,) at parameters (m,) of the present piece."""
        return self.curve.pieces[self.piece].places

    def crossed(self, centre: complex, axes: ComplexArray) -> tuple[FloatArray, Places]:
        """Crossings of axes (m,) from `centre` with the piece: u, gamma, derivatives by angle.

        Of several crossings it is the one that P reaches from its last place. The axis turns to it
        in parts, each short enough for Newton's method; on the way it must not be tangential to the
        track, and P must not pass the pivot.

        Raises:
            DeadCentreError: P reaches no crossing.

        """
        u, done, part = np.full(len(axes), self.u), 0.0, 1.0
        places = self.at(u)
        home = places[0] - centre
        # The axis may have turned so far that P is behind the pivot; half turns do not count.
        turned = np.mod(np.angle(axes / home) + np.pi / 2, np.pi) - np.pi / 2
        rays = axes * np.where((axes / home * np.exp(-1j * turned)).real > 0, 1.0, -1.0)
        while done < 1.0:
            now, ahead = (rays * np.exp(1j * (to - 1.0) * turned) for to in (done, done + part))
            near = self._near(centre, (now, ahead), part * turned, (u, places))
            if near is not None:
                done += part
                (u, places), part = near, min(2 * part, 1.0 - done)
                continue
            part /= 2
            if part < LEAST_PART:
                first = places[1]
                slanting = np.abs((now.conj() * first).imag) > SLANTING * np.abs(first)
                self.trouble = MISSES if slanting.all() else TOUCHES
                raise DeadCentreError(self.trouble)
        place, by_u, by_uu = places
        rate, bend = _by_angle(centre, rays, places)
        return u, (place, by_u * rate, by_uu * rate**2 + by_u * bend)

    def _near(
        self,
        centre: complex,
        rays: tuple[ComplexArray, ComplexArray],
        turned: FloatArray,
        last: tuple[FloatArray, Places],
    ) -> tuple[FloatArray, Places] | None:
        """Follow rays to their directions ahead by Newton's method; None if P might jump.

        There is only one crossing on the way if the track bends little enough.
        """
        (now, ahead), (home, known) = rays, last
        back, by_u = ahead.conj(), known[1]
        slope_before, steepness = (now.conj() * by_u).imag, np.abs((back * by_u).imag)
        if np.any(np.abs(slope_before) < NEGLIGIBLE * np.abs(by_u)):
            return None
        rate, bend = _by_angle(centre, now, known)
        u, largest = home + turned * (rate + 0.5 * turned * bend), np.inf
        for _ in range(NEWTON_STEPS):
            place, first, second = places = self.at(u)
            slope, away = (back * first).imag, back * (place - centre)
            if largest <= QUADRATIC * (1 + abs(self.u)):  # convergence is quadratic
                break
            step = away.imag / slope
            u, last_change, largest = u - step, largest, float(np.abs(step).max())
            if not largest < last_change:
                return None
        bends = max(np.abs(second).max(), np.abs(known[2]).max())
        steep = bends * np.abs(u - home) <= np.minimum(np.abs(slope), steepness)
        enough = np.abs(slope) >= NEGLIGIBLE * np.abs(first)
        return (
            (u, places)
            if (steep & enough & (slope * slope_before > 0) & (away.real > 0)).all()
            else None
        )

    def touched_by_axis(self, centre: complex) -> str:
        """Message if P is so near to a dead centre that its place is practically undecided."""
        place, first, _ = (column[0] for column in self.at(np.array([self.u])))
        ray = (place - centre).conjugate()
        return TOUCHES if abs((ray * first).imag) < NEARLY * abs(ray * first) else ""

    @property
    def shift(self) -> float:
        """Difference between the parameter of the whole curve and that of the present piece."""
        return float(self.curve.breaks[self.piece] - self.present.start)


def _by_angle(centre: complex, rays: ComplexArray, places: Places) -> tuple[FloatArray, FloatArray]:
    """First two derivatives of places u by the angle of the rays that cross the track at u."""
    place, by_u, by_uu = places
    back = rays.conj()
    slope = (back * by_u).imag
    rate = (back * (place - centre)).real / slope
    return rate, (2 * (back * by_u).real * rate - (back * by_uu).imag * rate**2) / slope


ON_FACE = 1e9  # m: length of a face that counts as endless
BAUMGARTE_RATE = 1e3  # 1/s: rounding in the gap of a held contact decays with it (Baumgarte 1972)


class Timed(NamedTuple):
    """Functions of time alone, at instants (m,), s.

    Angle, speed and acceleration of a driven guide, and torques of motors (m, N). If the guide's
    angle determines P: its places (m,) on the piece, and `track` with derivatives by the angle.
    """

    t: FloatArray
    angle: FloatArray
    speed: FloatArray
    alpha: FloatArray
    motors: FloatArray
    place: FloatArray | None = None
    track: Places | None = None


class Motion(NamedTuple):
    """Motion at instants (m,) without accelerations; `mass` and `force` have all N rows."""

    t: FloatArray
    frame: Frame
    place: FloatArray  # (m,): P's place on its piece
    alpha: FloatArray  # (m,): prescribed acceleration of the guide, rad/s^2
    motors: FloatArray  # (m, N): torques of motors
    mass: FloatArray
    force: FloatArray  # without rigid contacts
    pushed: Pushed | None  # of the contacts that press with a penalty

    def pick(self, which: int | slice | None) -> Motion:
        """Return one of several instants, or some; None puts an axis of length 1 before a state."""
        pushed = self.pushed and self.pushed.pick(which)
        alone = (self.t, self.place, self.alpha, self.motors, self.mass, self.force)
        t, *rest = (column[which] for column in alone)
        return Motion._make((t, self.frame.pick(which), *rest, pushed))


def joined(parts: Sequence[Motion]) -> Motion:
    """Join motions along their instants; the same contacts press at all of them."""
    t, frames, *rest, pushes = zip(*parts, strict=True)
    frame = Frame._make(map(np.concatenate, zip(*frames, strict=True)))
    pushed: Pushed | None = pushes[0]
    if pushed is not None:
        columns = zip(*(push[1:] for push in pushes), strict=True)
        pushed = Pushed(pushed.which, *map(np.concatenate, columns))
    return Motion._make((np.concatenate(t), frame, *map(np.concatenate, rest), pushed))


class System:
    """The equations of a model, with the contacts that press now."""

    def __init__(self, model: Model, laps: list[Event]) -> None:
        self.model = model
        state, layout = model.assembly.state, model.layout
        self.track: TrackPoint | PinOnTrack
        if layout.slides:
            groove = model.mechanism.grooves[0]
            self.track = PinOnTrack(groove, place_in(groove.slot, groove.lap, state.q), laps)
            self.contacts: Contacts = PinnedContacts(model, self.track)
        else:
            slot = model.mechanism.slots[0]
            self.track = TrackPoint(slot, float(state.places[0]), state.laps[0], laps)
            self.contacts = Contacts(model)
        self.touches = Touches(self.contacts.all, self.contacts.faces)
        self._centre = complex(*layout.guide.at)
        self._angle = float(model.start[0][0])
        self._timed: Timed | None = None
        self._moves: ComplexArray  # motions of points per unit of the coordinates, for `size`
        self._motors = [
            (ramp, turning_row(layout, motor.first, motor.second)) for motor, ramp in layout.torques
        ]

    @property
    def giving_way(self) -> IndexArray:
        """Contacts that press with a penalty."""
        return np.flatnonzero(self.touches.pressed & ~self.touches.rigid)

    @property
    def held(self) -> IndexArray:
        """Contacts by impulse that stay closed."""
        return np.flatnonzero(self.touches.pressed & self.touches.rigid)

    @property
    def dead_centre(self) -> str:
        """Message if the guide's angle does not determine P's place, or hardly; else empty."""
        track = self.track
        if self.model.layout.play or not isinstance(track, TrackPoint):
            return ""
        return track.trouble or track.touched_by_axis(self._centre)

    def forget(self) -> None:
        """Forget functions of time: P goes on from another place, or on another piece."""
        self._timed = None

    def _timed_at(self, t: FloatArray) -> Timed:
        """Functions of time at instants, computed once for all rounds of a step and for its end."""
        known = self._timed
        if known is not None and len(known.t) == len(t) and (known.t == t).all():
            return known
        layout, count = self.model.layout, self.model.layout.count
        ramp, way, none = layout.ramp, layout.way, np.zeros(len(t))
        motors = np.zeros((len(t), count))
        for motor, row in self._motors:
            motors += np.outer(motor.values(t), row)
        if ramp is None:
            self._timed = Timed(t, none, none, none, motors)
            return self._timed
        angle = self._angle + way * ramp.integrals(t)
        timed = Timed(t, angle, way * ramp.values(t), way * ramp.rates(t), motors)
        if not layout.play and isinstance(self.track, TrackPoint):
            u, places = self.track.crossed(self._centre, np.exp(1j * angle))
            timed = timed._replace(place=u, track=places)
        self._timed = timed
        return timed

    def frame(self, t: FloatArray, q: FloatArray, v: FloatArray) -> tuple[Frame, FloatArray]:
        """Frame and P's places (m,) at instants (m,), s, for free coordinates and speeds.

        Raises:
            DeadCentreError: the guide's angle does not determine P's place.

        """
        model, now = self.model, self._timed_at(t)
        if model.first:
            q = np.concatenate([now.angle[:, None], q], axis=1)
            v = np.concatenate([now.speed[:, None], v], axis=1)
        u, places = now.place, now.track
        if not isinstance(self.track, TrackPoint):  # P slides along the guide, or moves freely
            along = np.exp(1j * q[:, 0])
            place = self._centre + q[:, -1] * along
            if model.numbers.free:
                along = np.ones_like(along)
                place = q[:, -2] + 1j * q[:, -1]
            slot_point = place, along, np.zeros_like(along)
            frame = frame_of(model.numbers, q, v, slot_point)
            return frame, self.track.feet(frame.points[:, 0])[0]
        if model.layout.play:
            u = q[:, -1]
            places = self.track.at(u)
        elif u is None or places is None:
            u, places = self.track.crossed(self._centre, np.exp(1j * q[:, 0]))
        return frame_of(model.numbers, q, v, places), u

    def motion(self, t: FloatArray, q: FloatArray, v: FloatArray) -> Motion:
        """Mass matrices and forces; see `frame`."""
        frame, u = self.frame(t, q, v)
        numbers, now = self.model.numbers, self._timed_at(t)
        mass, force = mass_and_force(numbers, frame)
        force, which = force + now.motors, self.giving_way
        pushed = self.contacts.push(frame, which, self.touches.approach) if len(which) else None
        if pushed is not None:
            force = force + pushed.force
        return Motion(t, frame, u, now.alpha, now.motors, mass, force, pushed)

    def accelerations(self, motion: Motion) -> tuple[FloatArray, FloatArray]:
        """Accelerations (m, N), and forces (m, k) of the contacts that stay closed, N.

        ``M q'' = Q - h + G^T F``, and for each of these contacts ``g'' = G q'' + b = 0``, with
        terms that let rounding in the gap die out.
        """
        first, held = self.model.first, self.held
        a = np.zeros(motion.force.shape)
        if first:
            a[:, 0] = motion.alpha
        right = motion.force[:, first:] - motion.mass[:, first:, 0] * motion.alpha[:, None] * bool(
            first
        )
        mass, count = motion.mass[:, first:, first:], motion.force.shape[1] - first
        if not len(held):
            a[:, first:] = np.linalg.solve(mass, right[:, :, None])[:, :, 0]
            return a, np.zeros((len(motion.t), 0))
        closed = self.contacts.push(motion.frame, held, self.touches.approach)
        rows = closed.rows[:, :, first:]
        whole = np.zeros((len(motion.t), count + len(held), count + len(held)))
        whole[:, :count, :count], whole[:, count:, :count] = mass, rows
        whole[:, :count, count:] = -rows.swapaxes(1, 2)
        bend = self.contacts.bend(motion.frame, held)
        bend += BAUMGARTE_RATE * (2 * closed.gap_rate + BAUMGARTE_RATE * closed.gap)
        if first:
            bend += closed.rows[:, :, 0] * motion.alpha[:, None]
        solved = np.linalg.solve(whole, np.concatenate([right, -bend], axis=1)[:, :, None])
        a[:, first:] = solved[:, :count, 0]
        return a, solved[:, count:, 0]

    def motor_torque(self, motion: Motion, a: FloatArray, held: FloatArray) -> FloatArray:
        """Torque (m,), N m, of the speed drive on the guide, from the guide's equation."""
        if not self.model.first:
            return np.zeros(len(motion.t))
        torque = np.einsum("mj,mj->m", motion.mass[:, 0], a) - motion.force[:, 0]
        if held.shape[1]:
            closed = self.contacts.push(motion.frame, self.held, self.touches.approach)
            rows = closed.rows[:, :, 0]
            torque = torque - (rows * held).sum(axis=1)
        return np.asarray(torque)

    # --- contacts, for events -------------------------------------------------------------------

    def from_sides(self, path: Seen) -> Seen:
        """Contacts seen from their present sides: behind a face the gap is that to its back.

        A contact that stays closed counts as behind a face that never opens.
        """
        contacts, faces = self.contacts, self.contacts.faces
        endless = np.isinf(contacts.length)
        if endless.any():  # a point is always beside an endless face
            place, slip = np.where(endless, 1.0, path.place), np.where(endless, 0.0, path.slip)
            path = path._replace(place=place, slip=slip)
        closed = contacts.held | (self.touches.rigid & self.touches.pressed)
        if closed.any():
            path = path.closed(closed)
        behind = [k for k in range(faces) if self.touches.sides[k] is Side.BEHIND]
        if behind:
            way = np.ones(len(closed))
            way[behind] = -1.0
            path = path._replace(gap=way * path.gap, gap_rate=way * path.gap_rate)
        return path

    def without_ends(self, path: Seen) -> tuple[Seen, FloatArray]:
        """Contacts and lengths, with endless faces for levers' contacts that do not press."""
        free = ~self.touches.pressed
        free[self.contacts.faces :] = False
        place, slip = np.where(free, ON_FACE / 2, path.place), np.where(free, 0.0, path.slip)
        lengths = np.where(free, ON_FACE, self.contacts.length)
        return path._replace(place=place, slip=slip), lengths

    def guide_speed(self, time: float, v: FloatArray) -> tuple[float, float]:
        """Speed of the guide, rad/s, and the prescribed acceleration, rad/s^2, at a time (s)."""
        ramp, now = self.model.layout.ramp, np.array([time])
        if ramp is None:
            return float(v[0]), 0.0
        return float(ramp.values(now)[0]), float(ramp.rates(now)[0])

    # --- the interface of `integrate.radau` ----------------------------------------------------

    def evaluate(self, t: float, q: FloatArray, v: FloatArray) -> Evaluation:
        """Mass matrix and force at one instant (s)."""
        return self.evaluate_stages(np.array([t]), q[None], v[None]).pick(0)

    def evaluate_stages(self, t: FloatArray, q: FloatArray, v: FloatArray) -> Evaluation:
        """Mass matrices and forces at several instants, for free coordinates."""
        motion = self.motion(t, q, v)
        first, faces = self.model.first, self.contacts.faces
        force, mass = motion.force[:, first:], motion.mass[:, first:, first:]
        if first:
            force = force - motion.mass[:, first:, 0] * motion.alpha[:, None]
        touching = np.zeros((len(t), 0, 2))
        if motion.pushed is not None:
            of_faces = motion.pushed.which < faces
            touching = np.stack(
                [motion.pushed.gap[:, of_faces], motion.pushed.gap_rate[:, of_faces]], axis=2
            )
        return Evaluation(mass, force, motion, touching)

    def jacobians(self, evaluation: Evaluation) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping of springs, dampers, walls and friction."""
        kept: Motion = evaluation.kept.pick(None)
        first, numbers = self.model.first, self.model.numbers
        self.measure_moves(kept.frame)
        stiffness, damping = numbers.stiffness, numbers.damping
        if kept.pushed is not None:
            more = self.contacts.slopes_of(kept.pushed)
            stiffness, damping = stiffness + more[0], damping + more[1]
        return stiffness[first:, first:], damping[first:, first:]

    def measure_moves(self, frame: Frame) -> None:
        """Measure motions of points per unit of the coordinates at a frame (1,), for `size`."""
        self._moves = moved_by(self.model.numbers, frame)[:, self.model.first :].T.copy()

    def contacts_at(self, evaluation: Evaluation) -> tuple[FloatArray, Press] | None:
        """Gradients (c, n) of the gaps of levers' contacts that press, and their forces."""
        pushed, first = evaluation.kept.pushed, self.model.first
        if pushed is None or not (pushed.which < self.contacts.faces).any():
            return None
        of_faces = pushed.which < self.contacts.faces
        which = pushed.which[of_faces]
        laws = [self.contacts.all[k].law for k in which.tolist()]
        return pushed.rows[of_faces][:, first:], press_by(laws, self.touches.approach[which])

    def size(self, change: FloatArray) -> float:
        """Largest motion (m) of a point by changes (..., n) of the coordinates."""
        return float(np.abs(change @ self._moves).max(initial=0.0))

    def knots(self) -> list[tuple[FloatArray, FloatArray]]:
        """Parameters and sizes of jumps of the third derivative on the track's present piece."""
        if self.model.layout.slides:
            return []
        values, jumps = self.track.present.knots
        return [(values, jumps)]

    def places(self, evaluation: Evaluation) -> list[float]:
        """P's place on this piece; none for a pin with play: the track does not always push it."""
        return [] if self.model.layout.slides else [float(evaluation.kept.place)]

    def moved_by_point(self, k: int, evaluation: Evaluation) -> float:  # noqa: ARG002
        """Largest acceleration (m/s^2) of a point if the track pushes P aside by 1 m/s^2.

        P then slides along the guide by 1 / sine of the angle between guide and track, unless link
        and guide have play.
        """
        if not len(evaluation.force) or not isinstance(self.track, TrackPoint):
            return 0.0
        model, frame, place = (
            self.model,
            evaluation.kept.frame,
            np.array([float(evaluation.kept.place)]),
        )
        along = self.track.at(place)[1][0]
        along /= abs(along)
        pushed = 1j * along
        if not model.layout.play:
            axis = frame.axes[0]
            pushed = axis / max(abs((axis.conjugate() * along).imag), NEGLIGIBLE)
        by = frame.by[model.numbers.centres, model.first :]
        pulled = ((by.conj() * pushed).real * model.numbers.masses[:, None]).sum(axis=0)
        return self.size(np.asarray(np.linalg.solve(evaluation.mass, pulled)))

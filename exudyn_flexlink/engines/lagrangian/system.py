"""Motion of guide, link and levers at instants, and the equations that it solves.

Without play P is where the axis from the guide's pivot C, along e, crosses the track: with
``w = gamma(u) - C`` and x the 2D cross product, ``e x w = 0``. Differentiated by the angle, with
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
from exudyn_flexlink.engines.track_follower import DeadCentreError, TrackFollower
from exudyn_flexlink.integrate.problem import Evaluation, Press
from exudyn_flexlink.mechanism import Seen, place_in
from exudyn_flexlink.result import Event

NEWTON_STEPS = 30
QUADRATIC = 1e-8  # of the parameter: a last change
LEAST_PART = 1e-6  # of the way that the guide has turned
LEAST_SLOPE = 1e-9  # sine of the angle between guide and track at a dead centre
NEARLY = 1e-5  # likewise, where steps got too short to go on
SLANTING = 1e-2  # likewise, where a track that is lost was not touched
TOUCHES = "the guide's axis touches the track"
MISSES = "the guide's axis misses the track"


class TrackPoint(TrackFollower):
    """The track of P; `u` is where P was after the last accepted step, on the present piece.

    Every search starts there: trial steps leave no trace, but for the `trouble` of the last one
    that found no place.
    """

    trouble = ""

    @property
    def at(self) -> Callable[[FloatArray], Places]:
        """Places and two derivatives (m,) at parameters (m,) of the present piece."""
        return self.curve.pieces[self.piece].places

    def crossed(self, centre: complex, axes: ComplexArray) -> tuple[FloatArray, Places]:
        """Where axes (m,) from `centre` cross the present piece: u, and gamma and by the angle.

        Of several crossings it is the one that P comes to from its last place: along the way, which
        is gone in parts that are sure, the axis must not be tangential to the track, nor P pass the
        pivot.

        Raises:
            DeadCentreError: there is none.

        """
        u, done, part = np.full(len(axes), self.u), 0.0, 1.0
        places = self.at(u)
        home = places[0] - centre
        # The axis may have turned so far that P is on its other side: half turns do not count.
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
        """Go along with rays to where they are ahead, by Newton's method; None if that is not sure.

        Seen along the ray there is one crossing on the way if the track bends there so little.
        """
        (now, ahead), (home, known) = rays, last
        back, by_u = ahead.conj(), known[1]
        was, before = (now.conj() * by_u).imag, np.abs((back * by_u).imag)
        if np.any(np.abs(was) < LEAST_SLOPE * np.abs(by_u)):
            return None
        rate, bend = _by_angle(centre, now, known)
        u, largest = home + turned * (rate + 0.5 * turned * bend), np.inf
        for _ in range(NEWTON_STEPS):
            place, first, second = places = self.at(u)
            slope, away = (back * first).imag, back * (place - centre)
            if largest <= QUADRATIC * (1 + abs(self.u)):  # quadratic: the last step made it exact
                break
            step = away.imag / slope
            u, before_it, largest = u - step, largest, float(np.abs(step).max())
            if not largest < before_it:
                return None
        bends = max(np.abs(second).max(), np.abs(known[2]).max())
        steep = bends * np.abs(u - home) <= np.minimum(np.abs(slope), before)
        enough = np.abs(slope) >= LEAST_SLOPE * np.abs(first)
        return (u, places) if (steep & enough & (slope * was > 0) & (away.real > 0)).all() else None

    def touched_by_axis(self, centre: complex) -> str:
        """Say so if P is so near to a dead centre that its place is as good as undecided."""
        place, first, _ = (column[0] for column in self.at(np.array([self.u])))
        ray = (place - centre).conjugate()
        return TOUCHES if abs((ray * first).imag) < NEARLY * abs(ray * first) else ""

    @property
    def shift(self) -> float:
        """By how much the parameter of the whole curve is more than that of the present piece."""
        return float(self.curve.breaks[self.piece] - self.present.start)


def _by_angle(centre: complex, rays: ComplexArray, places: Places) -> tuple[FloatArray, FloatArray]:
    """Two derivatives of places u by the angle of the rays that cross the track there."""
    place, by_u, by_uu = places
    back = rays.conj()
    slope = (back * by_u).imag
    rate = (back * (place - centre)).real / slope
    return rate, (2 * (back * by_u).real * rate - (back * by_uu).imag * rate**2) / slope


ON_FACE = 1e9  # m: a face so long has no ends
LEAST_SINE = 1e-9  # of the angle between guide and track
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
        t, *rest = (column[which] for column in alone)
        return Motion._make((t, self.frame.pick(which), *rest, pushed))


def joined(parts: Sequence[Motion]) -> Motion:
    """Return instants one after the other; the same contacts press at all of them."""
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
        self._moves: ComplexArray  # how far coordinates move points, for `size`
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
        """Says so where the guide's angle does not tell where P is, or as good as not."""
        track = self.track
        if self.model.layout.play or not isinstance(track, TrackPoint):
            return ""
        return track.trouble or track.touched_by_axis(self._centre)

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
        """Where all is at instants (m,) s and free coordinates and speeds; P's places (m,).

        Raises:
            DeadCentreError: the guide's angle does not tell where P is.

        """
        model, now = self.model, self._at(t)
        if model.first:
            q = np.concatenate([now.angle[:, None], q], axis=1)
            v = np.concatenate([now.speed[:, None], v], axis=1)
        u, places = now.place, now.track
        if not isinstance(self.track, TrackPoint):  # P slides along the guide, or goes anywhere
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
        numbers, now = self.model.numbers, self._at(t)
        mass, force = mass_and_force(numbers, frame)
        force, which = force + now.motors, self.giving_way
        pushed = self.contacts.push(frame, which, self.touches.approach) if len(which) else None
        if pushed is not None:
            force = force + pushed.force
        return Motion(t, frame, u, now.alpha, now.motors, mass, force, pushed)

    def accelerations(self, motion: Motion) -> tuple[FloatArray, FloatArray]:
        """Accelerations (m, N), and forces (m, k) of the contacts that are held closed, N.

        ``M q'' = Q - h + G^T F``, and for each of them ``g'' = G q'' + b = 0``, with what rounding
        leaves of the gap dying out.
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
        """Torque (m,) of the speed drive on the guide, from its own row of the equations, N m."""
        if not self.model.first:
            return np.zeros(len(motion.t))
        torque = np.einsum("mj,mj->m", motion.mass[:, 0], a) - motion.force[:, 0]
        if held.shape[1]:
            closed = self.contacts.push(motion.frame, self.held, self.touches.approach)
            rows = closed.rows[:, :, 0]
            torque = torque - (rows * held).sum(axis=1)
        return np.asarray(torque)

    # --- contacts, as events see them ----------------------------------------------------------

    def from_sides(self, path: Seen) -> Seen:
        """Contacts seen from where they are: behind a face its gap is that to its back.

        What is held closed is as if behind a face that never opens.
        """
        contacts, faces = self.contacts, self.contacts.faces
        endless = np.isinf(contacts.length)
        if endless.any():  # they may be anywhere
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
        """Levers' contacts that do not press, as if their faces had no ends; and all lengths."""
        free = ~self.touches.pressed
        free[self.contacts.faces :] = False
        place, slip = np.where(free, ON_FACE / 2, path.place), np.where(free, 0.0, path.slip)
        lengths = np.where(free, ON_FACE, self.contacts.length)
        return path._replace(place=place, slip=slip), lengths

    def guide_speed(self, time: float, v: FloatArray) -> tuple[float, float]:
        """Speed of the guide, rad/s, and of a driven one its rate, rad/s^2, at a time (s)."""
        ramp, now = self.model.layout.ramp, np.array([time])
        if ramp is None:
            return float(v[0]), 0.0
        return float(ramp.values(now)[0]), float(ramp.rates(now)[0])

    # --- as `integrate.radau` asks for it -----------------------------------------------------

    def evaluate(self, t: float, q: FloatArray, v: FloatArray) -> Evaluation:
        """Mass matrix and force at one instant (s)."""
        return self.evaluate_stages(np.array([t]), q[None], v[None]).pick(0)

    def evaluate_stages(self, t: FloatArray, q: FloatArray, v: FloatArray) -> Evaluation:
        """Likewise at several, of free coordinates."""
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
        """Springs and dampers, walls and friction."""
        kept: Motion = evaluation.kept.pick(None)
        first, numbers = self.model.first, self.model.numbers
        self.measure_moves(kept.frame)
        stiffness, damping = numbers.stiffness, numbers.damping
        if kept.pushed is not None:
            more = self.contacts.slopes_of(kept.pushed)
            stiffness, damping = stiffness + more[0], damping + more[1]
        return stiffness[first:, first:], damping[first:, first:]

    def measure_moves(self, frame: Frame) -> None:
        """Take how far coordinates move points at a frame (1,), for `size`."""
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
        """How far (m) changes (..., n) of the coordinates move anything, at most."""
        return float(np.abs(change @ self._moves).max(initial=0.0))

    def knots(self) -> list[tuple[FloatArray, FloatArray]]:
        """Of the track's present piece: where its third derivative jumps, and by how much."""
        if self.model.layout.slides:
            return []
        values, jumps = self.track.present.knots
        return [(values, jumps)]

    def places(self, evaluation: Evaluation) -> list[float]:
        """P's place on it, but for a pin with play: its track does not push it all the time."""
        return [] if self.model.layout.slides else [float(evaluation.kept.place)]

    def moved_by_point(self, k: int, evaluation: Evaluation) -> float:  # noqa: ARG002
        """How much (m/s^2) things accelerate if the track pushes P aside by 1 m/s^2.

        Pushed aside, P slides along the guide by 1 / sine of the angle between the two, unless
        there is play between them.
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
            pushed = axis / max(abs((axis.conjugate() * along).imag), LEAST_SINE)
        by = frame.by[model.numbers.centres, model.first :]
        pulled = ((by.conj() * pushed).real * model.numbers.masses[:, None]).sum(axis=0)
        return self.size(np.asarray(np.linalg.solve(evaluation.mass, pulled)))

"""All contacts of a run: which are looked at after a step, and what they ask of the next one."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray, IndexArray
from exudyn_flexlink.engines.exudyn.redundant.contact_item import AHEAD, BESIDE, ContactItem
from exudyn_flexlink.engines.exudyn.redundant.events import StepEnd
from exudyn_flexlink.engines.exudyn.redundant.recording import Changed
from exudyn_flexlink.engines.touching import Touches
from exudyn_flexlink.mechanism import Channel, FaceContact

RESTART = 0.02  # of a contact's step, after a force that jumped: accelerations settle in it
# Steps ahead for which pairs of link and guide are looked at one by one: a look tells the gap's
# acceleration by the look before, and what it asks of a step should be asked in time.
LOOK_AHEAD = AHEAD + 2
# Of a pair's own step, likewise: where a gap closes within so much, a step ends before that.
MARGIN = 1.5


class Contacts:
    """Contacts in the order of the run's numbers: the scene's, its bearings, pairs of channels."""

    def __init__(self, contacts: Sequence[ContactItem]) -> None:
        self.all = contacts
        self._always = [own for own in contacts if own.channel is None]
        self.touches = Touches([own.contact for own in contacts], len(self._always))
        for own in contacts:
            self.touches.sides[own.index] = own.side
        self._pairs = [own for own in contacts if own.channel is not None]
        faces = [own.contact for own in self._pairs if isinstance(own.contact, FaceContact)]
        self._broad_phase = BroadPhase(faces)
        self._margin = MARGIN * max((own.contact_step for own in self._pairs), default=0.0)
        self._near: list[int] = []  # numbers of the pairs that are looked at
        self._looked_at = self._always

    def after_step(self, now: StepEnd, step: float) -> float:
        """Look at what began or ended with the last step; return the next step (s)."""
        if self._pairs:
            self._choose(now, step)
        for contact in self._looked_at:
            step = contact.after_step(now, step)
        return step

    def aim(self, step: float) -> None:
        """Prepare the forces for the next step (s), which is known now."""
        for contact in self._looked_at:
            contact.aim(step)

    @property
    def changes(self) -> list[Changed]:
        """What happened as the last step ended."""
        return [own.changed for own in self._looked_at if own.changed is not None]

    @property
    def broken(self) -> Channel | None:
        """Channel whose wall the link has broken through."""
        return next((own.channel for own in self._looked_at if own.broken), None)

    @property
    def restart_step(self) -> float:
        """Longest step (s) after a force that jumped in the last one; inf if none did."""
        leaping = [changed.contact for changed in self.changes if changed.leaps]
        return RESTART * min((self.all[k].contact_step for k in leaping), default=inf)

    def _choose(self, now: StepEnd, step: float) -> None:
        """Look at pairs that may touch soon, and at those that act; let the others rest."""
        near = set(self._broad_phase.near(now, LOOK_AHEAD * step + self._margin).tolist())
        near.update(k for k in self._near if self._pairs[k].items.awake)
        for k in self._near:
            if k not in near:
                self._pairs[k].rest()
        self._near = sorted(near)
        self._looked_at = [*self._always, *(self._pairs[k] for k in self._near)]


class BroadPhase:
    """Which pairs of link and guide may touch soon: one look at all of them, after every step.

    Nearly all are far from touching at any time; only the others are looked at one by one.

    With C a pair's point, O the origin of the part that carries its face, w that part's angular
    velocity and e the face's direction (complex numbers, global axes), the point is in the axes of
    the face at

        z = e* (C - O) - z_0,      z' = e* (C' - O') - i w (z + z_0),

    along the face by Re z, to its left by Im z; z_0 is where the face starts.
    """

    def __init__(self, pairs: Sequence[FaceContact]) -> None:
        self._points = np.array([pair.point.part for pair in pairs])
        self._bases = np.array([pair.start.part for pair in pairs])
        self._own = np.array([complex(pair.point.x, pair.point.y) for pair in pairs])
        starts = np.array([complex(pair.start.x, pair.start.y) for pair in pairs])
        ends = np.array([complex(pair.end.x, pair.end.y) for pair in pairs])
        self._back = np.conj(ends - starts) / np.abs(ends - starts)
        self._start = self._back * starts
        lengths = np.array([pair.length for pair in pairs])
        self._low, self._high = -BESIDE * lengths, (1 + BESIDE) * lengths
        self._side = np.array([pair.side for pair in pairs])
        self._gap_rate: FloatArray | None = None  # at the last look

    def near(self, now: StepEnd, ahead: float) -> IndexArray:
        """Numbers of the pairs that may touch within a time (s) ahead, or touch now.

        Gaps go on with their rate and with its change in the last step, where that closes them;
        places with the slip. A pair that is held on its line from both sides touches wherever its
        point is over the face.
        """
        at, rate = self._seen(now)
        gap, gap_rate = self._side * at.imag, self._side * rate.imag
        closing = np.minimum(gap_rate, 0.0)
        if self._gap_rate is not None and now.step > 0:
            closing += (0.5 * ahead / now.step) * np.minimum(gap_rate - self._gap_rate, 0.0)
        self._gap_rate = gap_rate
        close = (gap + ahead * closing <= 0).nonzero()[0]
        if not len(close):
            return close
        place, slide = at.real[close], ahead * rate.real[close]
        over = (place + np.maximum(slide, 0.0) >= self._low[close]) & (
            place + np.minimum(slide, 0.0) <= self._high[close]
        )
        return close[over]

    def _seen(self, now: StepEnd) -> tuple[ComplexArray, ComplexArray]:
        """Where the points are in the axes of the faces, and the rates of that."""
        x, y, angle = np.array(now.q_list).reshape(-1, 3).T
        u, v, spin = np.array(now.v_list).reshape(-1, 3).T
        points, bases = self._points, self._bases
        axis, turning = np.exp(1j * angle), 1j * spin
        origin, moving = x + 1j * y, u + 1j * v
        arm = axis[points] * self._own
        back = axis.conj()[bases] * self._back
        apart = back * (origin[points] - origin[bases] + arm)
        rate = back * (moving[points] - moving[bases] + turning[points] * arm)
        return apart - self._start, rate - turning[bases] * apart

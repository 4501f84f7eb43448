"""All contacts of a run: which are looked at after a step, and what they ask of the next one."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

from exudyn_flexlink.engines.exudyn.redundant.broad_phase import BroadPhase
from exudyn_flexlink.engines.exudyn.redundant.contact_item import AHEAD, ContactItem
from exudyn_flexlink.engines.exudyn.redundant.recording import Changed
from exudyn_flexlink.engines.exudyn.redundant.step_end import StepEnd
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

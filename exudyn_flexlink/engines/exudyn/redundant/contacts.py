"""All contacts of a run: which are looked at after a step, and what they ask of the next one."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import numpy as np

from exudyn_flexlink.arrays import BoolArray
from exudyn_flexlink.engines.exudyn.redundant.broad_phase import BroadPhase
from exudyn_flexlink.engines.exudyn.redundant.contact_item import AHEAD, ContactItem
from exudyn_flexlink.engines.exudyn.redundant.intervals import Entry
from exudyn_flexlink.engines.exudyn.redundant.step_end import StepEnd
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
        self._pairs = [own for own in contacts if own.channel is not None]
        faces = [own.contact for own in self._pairs if isinstance(own.contact, FaceContact)]
        self._broad_phase = BroadPhase(faces)
        self._margin = MARGIN * max((own.contact_step for own in self._pairs), default=0.0)
        self.entries: list[Entry] = []  # of all steps so far
        self.pressed = np.zeros(len(contacts), dtype=bool)  # those that act
        self.before_jump: BoolArray | None = None  # likewise, where a force jumped in the last step
        self._near: list[int] = []  # numbers of the pairs that are looked at
        self._looked_at = self._always

    def after_step(self, now: StepEnd, step: float) -> float:
        """Note what began or ended in the last step; return the next step (s)."""
        if self._pairs:
            self._choose(now, step)
        for contact in self._looked_at:
            step = contact.after_step(now, step)
        fresh = [own.entry for own in self._looked_at if own.entry is not None]
        self.entries += fresh
        jumped = any(contact.jumped for contact in self._looked_at)
        self.before_jump = self.pressed.copy() if jumped else None
        for entry in fresh:
            self.pressed[entry.index] = self.all[entry.index].pressed
        return step

    def aim(self, step: float) -> None:
        """Prepare the forces for the next step (s), which is known now."""
        for contact in self._looked_at:
            contact.aim(step)

    @property
    def struck(self) -> bool:
        """Whether one of the scene's contacts, or of its bearings, presses."""
        return any(contact.pressed for contact in self._always)

    @property
    def broken(self) -> Channel | None:
        """Channel whose wall the link has broken through."""
        return next((own.channel for own in self._looked_at if own.broken), None)

    @property
    def restart_step(self) -> float:
        """Longest step (s) after a force that jumped in the last one; inf if none did."""
        jumped = [own.contact_step for own in self._looked_at if own.jumped]
        return RESTART * min(jumped, default=inf)

    def _choose(self, now: StepEnd, step: float) -> None:
        """Look at pairs that may touch soon, and at those that act; let the others rest."""
        near = set(self._broad_phase.near(now, LOOK_AHEAD * step + self._margin).tolist())
        near.update(k for k in self._near if self._pairs[k].items.awake)
        for k in self._near:
            if k not in near:
                self._pairs[k].rest()
        self._near = sorted(near)
        self._looked_at = [*self._always, *(self._pairs[k] for k in self._near)]

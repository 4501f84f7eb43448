"""Touches as they are shown: when, where, and how strong."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exudyn_flexlink.animation.film import Film, Take
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.intervals import Intervals
from exudyn_flexlink.mechanism import (
    Anchor,
    CircleContact,
    Contact,
    CurveContact,
    anchor_position,
    approach,
    pairs,
)
from exudyn_flexlink.plots.outline import Line, through, walled


@dataclass(frozen=True)
class Touching:
    """What touches in one contact of the scene, or in a joint with clearance.

    `touches` are those within the film. `contact` tells where, of two parts; of a guide it is None,
    and `places` are those of its pairs. `force` (N, k) are the forces in N of its pairs at the
    samples of the run: of a contact one column.
    """

    name: str
    touches: Intervals
    contact: Contact | None
    places: Line | None
    force: FloatArray

    def spots(self, take: Take, times: FloatArray) -> FloatArray:
        """Places (K, pairs, 2) m of its pairs at instants (K,) s."""
        poses = take.poses(times)
        if self.places is not None:
            return self.places.at(poses)
        assert self.contact is not None
        return spot_of(self.contact, poses)[:, None]

    def forces(self, take: Take, times: FloatArray) -> FloatArray:
        """Forces (K, pairs) N of its pairs at instants (K,) s."""
        own = take.result.time
        return np.stack([np.interp(times, own, force) for force in self.force.T], axis=1)


def touching_of(film: Film, take: Take) -> list[Touching]:
    """All that can touch in a take: contacts of the scene, bearings, guides with clearance."""
    result, model = take.result, take.model
    found = []
    for contact in model.touching:
        histories = result.contacts if contact.name in result.contacts else result.bearings
        own = histories[contact.name]
        inside = _within(own.touches, film)
        found.append(Touching(contact.name, inside, contact, None, own.force[:, None]))
    for channel in walled(model):
        sleeve = result.sleeves[channel.name]
        places = through(channel.name, *(pair.point for pair in pairs(channel)))
        inside = _within(sleeve.touches, film)
        found.append(Touching(channel.name, inside, None, places, sleeve.force))
    return found


def _within(touches: Intervals, film: Film) -> Intervals:
    return touches.where((touches.begin <= film.end) & (touches.end >= film.begin))


def strength(touches: Intervals) -> FloatArray:
    """How strong touches are (K,): peak force in N; of an impact, which has none, minus its N s."""
    return np.where(np.isfinite(touches.peak_force), touches.peak_force, -touches.impulse)


def spot_of(contact: Contact, poses: FloatArray) -> FloatArray:
    """Where a contact touches, or is nearest to it, (..., 2) m: the edge of its first part."""
    point, radius = _centre(contact)
    here = anchor_position(point, poses)
    if radius == 0:
        return here
    return here - radius * approach(contact, poses, np.zeros_like(poses)).normal


def _centre(contact: Contact) -> tuple[Anchor, float]:
    """Centre and radius (m) of the part of a contact that strikes."""
    if isinstance(contact, CircleContact):
        return contact.first, contact.radii[0]
    return contact.point, contact.radius if isinstance(contact, CurveContact) else 0.0

"""Touches as they are shown, and what is drawn larger: a guide with clearance, a struck face."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exudyn_flexlink.animation.film import Film, Take
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.intervals import Intervals
from exudyn_flexlink.mechanism import (
    Anchor,
    Channel,
    CircleContact,
    Contact,
    CurveContact,
    FaceContact,
    anchor_position,
    angle_of,
    approach,
    pairs,
    turned,
)
from exudyn_flexlink.plots.outline import Line, faces, through, walled
from exudyn_flexlink.plots.sleeve import ROOM

ROOM_AT_FACE = (0.06, 0.14)  # of the length that is seen: the zoom on a face, below and above it
STRIKE_PART = 0.06  # of the picture: the length of a face that is seen, or more
BESIDE = 0.08  # of its length: how much of the zoom is before and behind a guide
MOST_FACES = 2  # of as many struck faces each has a zoom: those of more would hide the mechanism
ROOM_ALONG = 1.5  # of where touches are along a face: the length of it that is seen
SLIDES = 0.15  # of the picture: the zoom on touches that go along more is not much larger than it


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


@dataclass(frozen=True)
class Viewpoint:
    """Where a zoom is seen from: an origin, and the angle (rad) of its x-axis in that part."""

    origin: Anchor
    angle: float = 0.0

    def seen(self, points: FloatArray, poses: FloatArray) -> FloatArray:
        """Points (..., n, 2) m of the ground in its axes, with the parts at `poses`."""
        away = points - anchor_position(self.origin, poses)[..., None, :]
        angle = self.angle + angle_of(self.origin.part, poses)
        return np.asarray(turned(away, -np.asarray(angle)[..., None]))


@dataclass(frozen=True)
class Zoom:
    """A zoom on the contact or joint `name`: what it shows `along` its x-axis, and `across`, m.

    `channel` is the guide with clearance that it shows; None: a face.
    """

    name: str
    view: Viewpoint
    along: tuple[float, float]
    across: tuple[float, float]
    channel: Channel | None = None

    @property
    def length(self) -> float:
        """What it shows along its x-axis, m."""
        return self.along[1] - self.along[0]

    @property
    def words(self) -> str:
        """What it shows, in words."""
        return f"in {self.name}" if self.channel is not None else f"at {self.name}"


def zooms_of(film: Film, take: Take) -> list[Zoom]:
    """Zooms of a take: its guides with clearance, and its faces that are struck in the film."""
    struck = {own.name: own for own in touching_of(film, take) if len(own.touches)}
    found = [face for face in faces(take.model) if face.name in struck]
    shown = found if len(found) <= MOST_FACES else []
    at_faces = [_at_face(film, take, face, struck[face.name]) for face in shown]
    return [
        *(_in_guide(channel) for channel in walled(take.model)),
        *(zoom for zoom in at_faces if zoom.length <= SLIDES * film.size),
    ]


def _in_guide(channel: Channel) -> Zoom:
    length, reach = channel.length, ROOM * channel.clearance
    along = -BESIDE * length, (1 + BESIDE) * length
    return Zoom(channel.name, Viewpoint(channel.guide), along, (-reach, reach), channel)


def _at_face(film: Film, take: Take, face: FaceContact, own: Touching) -> Zoom:
    """The part of a face that is touched in a film, what strikes it above."""
    # Seen so that the free side, which is left of the way from start to end, is above.
    start, end = (face.end, face.start) if face.side < 0 else (face.start, face.end)
    view = Viewpoint(start, float(np.arctan2(end.y - start.y, end.x - start.x)))
    instants = _while_touching(film, take, own)
    x = view.seen(own.spots(take, instants), take.poses(instants))[..., 0]
    middle = float(np.min(x) + np.max(x)) / 2
    length = max(STRIKE_PART * film.size, ROOM_ALONG * float(np.ptp(x)))
    below, above = (part * length for part in ROOM_AT_FACE)
    return Zoom(face.name, view, (middle - length / 2, middle + length / 2), (-below, above))


def _while_touching(film: Film, take: Take, own: Touching) -> FloatArray:
    """Instants (K,) s of the film at which something touches: begins of touches, and samples."""
    begin = np.sort(own.touches.begin)
    time = np.clip(np.concatenate([take.result.time, begin]), film.begin, film.end)
    latest = np.searchsorted(begin, time, side="right") - 1
    lasts = (latest >= 0) & (time <= own.touches.until(film.end)[latest])
    return np.asarray(time[lasts])

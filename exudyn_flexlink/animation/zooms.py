"""What is drawn larger below a picture: a guide with clearance, and a face that is struck.

Each is seen from the part that it belongs to, its walls or its face along the x-axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exudyn_flexlink.animation.film import Film, Take, Touching, touching_of
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import Anchor, Channel, FaceContact
from exudyn_flexlink.plots.outline import Viewpoint, faces, walled
from exudyn_flexlink.plots.sleeve import ROOM

ROOM_AT_FACE = (0.06, 0.14)  # of the length that is seen: the zoom on a face, below and above it
STRIKE_PART = 0.06  # of the picture: the length of a face that is seen, or more
BESIDE = 0.08  # of its length: how much of the zoom is before and behind a guide
MOST_FACES = 2  # of as many struck faces each has a zoom: those of more would hide the mechanism
ROOM_ALONG = 1.5  # of where touches are along a face: the length of it that is seen
SLIDES = 0.15  # of the picture: the zoom on touches that go along more is not much larger than it


@dataclass(frozen=True)
class Zoom:
    """A zoom on the contact or joint `name`: what it shows `along` its x-axis, and `across`, m.

    `channel` is the guide with clearance that it shows; None: a face, which `point` may strike.
    """

    name: str
    view: Viewpoint
    along: tuple[float, float]
    across: tuple[float, float]
    channel: Channel | None = None
    point: Anchor | None = None
    point_name: str = ""

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
    guides = []
    for own in walled(take.model):
        along, reach = (-BESIDE * own.length, (1 + BESIDE) * own.length), ROOM * own.clearance
        guides.append(Zoom(own.name, Viewpoint(own.guide), along, (-reach, reach), own))
    return [*guides, *(zoom for zoom in at_faces if zoom.length <= SLIDES * film.size)]


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
    along = (middle - length / 2, middle + length / 2)
    striking = take.result.scene.all_contacts[face.name].striking
    return Zoom(face.name, view, along, (-below, above), point=face.point, point_name=striking)


def _while_touching(film: Film, take: Take, own: Touching) -> FloatArray:
    """Instants (K,) s of the film at which something touches: begins of touches, and samples."""
    begin = np.sort(own.touches.begin)
    time = np.clip(np.concatenate([take.result.time, begin]), film.begin, film.end)
    latest = np.searchsorted(begin, time, side="right") - 1
    lasts = (latest >= 0) & (time <= own.touches.until(film.end)[latest])
    return np.asarray(time[lasts])

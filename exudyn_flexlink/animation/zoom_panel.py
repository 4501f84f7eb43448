"""A zoom below the picture: a guide with clearance, or a face that is struck, drawn larger."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from matplotlib.artist import Artist

from exudyn_flexlink.animation.actors import (
    Actor,
    GlowsActor,
    Place,
    PointsActor,
    mechanism_actors,
)
from exudyn_flexlink.animation.guide import WalledLink, draw_walls
from exudyn_flexlink.animation.shots import Largest, Shots
from exudyn_flexlink.animation.zooms import Zoom
from exudyn_flexlink.observables import State, contact_states

STATES = {
    State.FREE: "free",
    State.ONE_POINT: "one point",
    State.SAME_SIDE: "two points, same side",
    State.OPPOSITE_SIDES: "two points, opposite sides",
}


class ZoomPanel:
    """The zoom of a name, of one run or of two over each other.

    `scale` is that of the picture above, pixels per m.
    """

    def __init__(
        self, place: Place, takes: Sequence[Shots], name: str, largest: Largest, scale: float
    ) -> None:
        zooms = {i: shots.zooms[name] for i, shots in enumerate(takes) if name in shots.zooms}
        own = next(iter(zooms.values()))
        larger = _fit(place, own, scale)
        if own.channel is not None:
            draw_walls(place, own.channel)
        self._actors: list[Actor] = []
        for i, zoom in zooms.items():
            seen = replace(place, rank=i if len(takes) > 1 else -1, view=zoom.view)
            self._actors += _shown(seen, takes[i], zoom, largest)
        self._title = place.axes.text(
            0.012, 0.98, "", transform=place.axes.transAxes, va="top", color="#666666",
            fontsize=place.points(12),
        )  # fmt: skip
        self._told = own.words + larger
        alone = len(takes) == 1 and own.channel is not None
        self._states = contact_states(takes[0].take.result, name) if alone else None
        self._frames = takes[0].frames
        self.artists: list[Artist] = []

    def show(self, frame: int) -> None:
        """Move to a frame."""
        state = ""
        if self._states is not None:
            now = self._states.at(self._frames.times[frame : frame + 1])[0]
            state = f" \N{EN DASH} {STATES[State(int(now))]}"
        self._title.set_text(self._told + state)
        for actor in self._actors:
            actor.show(frame)
        self.artists = [self._title, *(own for actor in self._actors for own in actor.artists)]


def _shown(place: Place, shots: Shots, zoom: Zoom, largest: Largest) -> Iterator[Actor]:
    """What moves in the zoom of one run."""
    if zoom.channel is not None:
        yield WalledLink(place, shots, zoom.channel, largest)
        return
    yield from mechanism_actors(place, shots)
    if place.rank <= 0:
        yield PointsActor(place, shots, zoom.length)
    yield GlowsActor(place, shots, largest, only=zoom.name)


def _fit(place: Place, own: Zoom, scale: float) -> str:
    """Let axes show a zoom; tells how much larger it is.

    A guide is larger across than along where there is room, a face never, or angles would be wrong.
    """
    axes = place.axes
    room = axes.get_window_extent()
    head = 20 * place.thick  # pixels: the line of words
    low, high = own.across
    across = (room.height - head) / (high - low)
    along = min(room.width / own.length, across)
    if own.channel is None:
        across = along
    middle, half = sum(own.along) / 2, room.width / along / 2
    axes.set_xlim(middle - half, middle + half)
    middle, half = sum(own.across) / 2, (room.height - head) / across / 2
    axes.set_ylim(middle - half, middle + half + head / across)
    if own.channel is None:
        return f", {along / scale:.2g} times larger"
    ratio = across / along
    return f", {ratio:.2g} times larger across" if ratio > 1.05 else ""

"""Contents of an animation: one run, or two over each other, with touches, slow motion, zooms.

Slow motion applies to stretches of time around strikes, and around touches in joints with
clearance. Zooms are panels below the picture. They show guides with clearance and struck faces,
each in the axes of its part, with walls or face along the x-axis.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import inf, isfinite
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import (
    Anchor,
    Channel,
    CircleContact,
    Contact,
    FaceContact,
    FlatContact,
    Mechanism,
    anchor_position,
    approach,
    build_mechanism,
)
from exudyn_flexlink.observables import (
    between_samples,
    crank_angle,
    crank_joint,
    joints_with_play,
    strikes,
)
from exudyn_flexlink.plots.forces import ROOM
from exudyn_flexlink.plots.frame import doubts_of
from exudyn_flexlink.plots.outline import (
    Drawn,
    Line,
    Mark,
    Viewpoint,
    box_around,
    circles_of,
    drawn_lines,
    faces,
    joint_marks,
    named_points,
    pivots,
    through,
    walled,
)
from exudyn_flexlink.plots.panels import colours_of_both, horizon
from exudyn_flexlink.result import Intervals, Result
from exudyn_flexlink.scene import Scene, stage_scenes
from exudyn_flexlink.source import did_you_mean

ANY = "strike"
"""Name that stands for the strikes of all contacts, unless a contact has this name."""

BEFORE, AFTER = 0.3, 1.0  # of a strike's duration: time that a stretch adds before and after it
BRIEFEST, LONGEST = 0.004, 0.03  # of the run: limits of the duration in a stretch.
# An impact has no duration, but must be visible; of a long contact only the begin is slow.


@dataclass(frozen=True)
class Slow:
    """A request for slow motion: the name of a contact or of a joint with clearance.

    `number` chooses one of its strikes, counted from 1; None: all of them.
    """

    name: str = ANY
    number: int | None = None

    @classmethod
    def of(cls, text: str) -> Slow:
        """Read 'NAME', or 'NAME:2' for the second strike.

        Raises:
            ValueError: the text after the colon is no number from 1.

        """
        name, colon, number = text.partition(":")
        if not colon:
            return cls(name.strip())
        if not number.strip().isdecimal() or int(number) < 1:
            raise ValueError(f"'{text}' is no name, nor a name and a number, such as 'strike:2'")
        return cls(name.strip(), int(number))

    @property
    def text(self) -> str:
        """The request in words."""
        return f"'{self.name}'" if self.number is None else f"'{self.name}' number {self.number}"


class Stretch(NamedTuple):
    """Time from `begin` to `end`, s."""

    begin: float
    end: float


def around_strikes(result: Result) -> tuple[Stretch, ...]:
    """Return the stretches of time around the strikes of all contacts."""
    return _joined(result, _strikes(result, *result.scene.all_contacts))


def around(result: Result, asked: Slow) -> tuple[Stretch, ...]:
    """Return the stretches of time that a request for slow motion selects.

    Raises:
        ValueError: it selects none.

    """
    known = {name: _strikes(result, name) for name in result.scene.all_contacts}
    for joint in joints_with_play(result):
        interval = result.intervals[joint]
        known[joint] = list(
            zip(interval.begin.tolist(), interval.until(result.time[-1]), strict=True)
        )
    known_interval = known.get(asked.name)
    if known_interval is None and asked.name == ANY and result.scene.all_contacts:
        known_interval = _strikes(result, *result.scene.all_contacts)
    if known_interval is None:
        listed = ", ".join(f"'{name}'" for name in known) or "none"
        hint = did_you_mean(asked.name, known) or f"; there is: {listed}"
        raise ValueError(f"no contact or joint with clearance '{asked.name}'{hint}")
    if not known_interval:
        raise ValueError(f"nothing touched in '{asked.name}': no slow motion")
    if asked.number is None:
        return _joined(result, known_interval)
    if not 1 <= asked.number <= len(known_interval):
        many = (
            f"it struck {len(known_interval)} times"
            if len(known_interval) > 1
            else "it struck once"
        )
        raise ValueError(f"no strike number {asked.number} of '{asked.name}': {many}")
    return _joined(result, [known_interval[asked.number - 1]])


def _strikes(result: Result, *contacts: str) -> list[tuple[float, float]]:
    """Return the begins and ends (s) of the strikes of some contacts, in order."""
    all_strikes = [strike for name in contacts for strike in strikes(result, name)]
    return sorted((strike.begin, strike.end) for strike in all_strikes)


def _joined(result: Result, strikes_: list[tuple[float, float]]) -> tuple[Stretch, ...]:
    """Return stretches around strikes in order; overlapping stretches become one."""
    least, most = np.array([BRIEFEST, LONGEST]) * float(result.time[-1] - result.time[0])
    stretches: list[Stretch] = []
    for begin, end in strikes_:
        length = float(np.clip(end - begin, least, most))
        stretch = Stretch(begin - BEFORE * length, begin + (1 + AFTER) * length)
        if stretches and stretch.begin <= stretches[-1].end:
            stretches[-1] = Stretch(stretches[-1].begin, max(stretches[-1].end, stretch.end))
        else:
            stretches.append(stretch)
    return tuple(stretches)


KINDS = ("curve", "face", "wall", "guide", "spring", "rope", "stop", "ring", "spoke", "bar", "link")
"""Kinds of lines; kinds in front come last."""
LOOKS = 400  # instants from which the box of a picture is computed
BELOW = 0.1  # of the box: margin below, with room for a scale of lengths


class FilmError(ValueError):
    """What was asked for can't be shown; every mistake is a line."""


@dataclass(frozen=True)
class Take:
    """A run in an animation: its name, and its colour; None: each body has a colour of its own."""

    result: Result
    name: str
    colour: str | None

    @cached_property
    def model(self) -> Mechanism:
        """Mechanism of its scene."""
        return build_mechanism(self.result.scene)

    @property
    def watched(self) -> Anchor:
        """The point S, which has a trail."""
        return self.named["S"]

    def poses(self, times: FloatArray) -> FloatArray:
        """Return poses (K, parts, 3) at instants (K,) s, exact at samples; see `Result.poses`."""
        run = self.result
        return between_samples(run.time, run.poses, run.rates, times)

    def crank(self, times: FloatArray) -> FloatArray | None:
        """Return the angle (K,) rad of the crank at instants (K,) s; None without a crank."""
        if crank_joint(self.result.scene) is None:
            return None
        return np.interp(times, self.result.time, crank_angle(self.result))

    @cached_property
    def lines(self) -> list[Drawn]:
        """Lines of the mechanism; those in front come last."""
        lines = drawn_lines(self.result.scene, self.model)
        coloured = [replace(drawn, colour=self.colour or drawn.colour) for drawn in lines]
        return sorted(coloured, key=lambda drawn: KINDS.index(drawn.kind))

    @cached_property
    def marks(self) -> list[Mark]:
        """Marks of the joints; those of the ground come first."""
        joints_marked = joint_marks(self.result.scene, self.model)
        return sorted(joints_marked, key=lambda mark: "ground" not in mark.kind)

    def spans(self, thing: Drawn | Mark) -> list[Stretch]:
        """Return the spans (s) in which a line or a mark exists; stages may add or remove it."""
        return [span for span, things in self._in_stages if _key(thing) in things]

    def exists(self, thing: Drawn | Mark, time: float) -> bool:
        """Whether a line or a mark exists at an instant (s)."""
        return any(begin <= time < end for begin, end in self.spans(thing))

    @cached_property
    def _in_stages(self) -> list[tuple[Stretch, set[tuple[object, ...]]]]:
        """Spans of all stages, and the keys of their lines and marks."""
        begins = [-inf, *(begin for begin, _ in self.result.stages), inf]
        spans = [Stretch(*span) for span in pairwise(begins)]
        scenes = stage_scenes(self.result.scene)  # more than spans if a run ends early
        return [(span, _drawn_in(scene)) for span, scene in zip(spans, scenes, strict=False)]

    @cached_property
    def named(self) -> dict[str, Anchor]:
        """Points that the paper names; the origin only if the scene has the paper's slot."""
        anchors = named_points(self.result.scene, self.model)
        return {
            name: anchor for name, anchor in anchors.items() if name != "O" or self.model.all_slots
        }

    def points(self, begin: float, end: float) -> list[FloatArray]:
        """Return points (..., 2) m of all lines between two instants (s)."""
        poses = self.poses(np.linspace(begin, end, LOOKS))
        ends = [np.array([anchor.x, anchor.y]) for anchor in pivots(self.model)]
        return [*(drawn.line.at(poses) for drawn in self.lines), *ends]


def _key(thing: Drawn | Mark) -> tuple[object, ...]:
    """Return a key that identifies a line, or a mark, within its stage."""
    return (thing.kind, thing.line.name) if isinstance(thing, Drawn) else (thing.kind, thing.anchor)


def _drawn_in(scene: Scene) -> set[tuple[object, ...]]:
    """Return the keys of all lines and marks of a stage."""
    model = build_mechanism(scene)
    things: list[Drawn | Mark] = [*drawn_lines(scene, model), *joint_marks(scene, model)]
    return {_key(thing) for thing in things}


@dataclass(frozen=True)
class Film:
    """One run, or two over each other, from `begin` to `end` (s), with slow motion in stretches.

    Time in the stretches `slow` is slowed down; `strikes` are the stretches that may be slowed.
    """

    takes: tuple[Take, ...]
    begin: float
    end: float
    slow: tuple[Stretch, ...]
    strikes: tuple[Stretch, ...]

    @cached_property
    def box(self) -> tuple[FloatArray, FloatArray]:
        """Lower left and upper right corner (2,) m of the picture."""
        points = [point for take in self.takes for point in take.points(self.begin, self.end)]
        return box_around(points, BELOW)

    @cached_property
    def horizon(self) -> tuple[float, str] | None:
        """Instant (s) from which one of the runs is not known well enough, and the reason."""
        horizons = [beyond for take in self.takes if (beyond := horizon(take.result)) is not None]
        return min(horizons, default=None)

    @property
    def doubts(self) -> str:
        """Doubts about each run, in words; empty without doubts."""
        doubts = [(f"{take.name}: ", doubts_of(take.result)) for take in self.takes]
        return "; ".join(name * (len(doubts) > 1) + doubt for name, doubt in doubts if doubt)

    @cached_property
    def largest(self) -> tuple[float, float]:
        """Largest force (N) and largest impulse (N s) of all touches; 0 if there is none."""
        histories = [touching for take in self.takes for touching in touching_of(self, take)]
        values = np.concatenate(
            [np.zeros(1), *(strength(touching.touches) for touching in histories)]
        )
        return float(values.max()), float(-values.min())

    def part(self, value: float) -> float:
        """Return the strength of a touch (see `strength`) over the largest of its kind."""
        largest = self.largest[value < 0]
        return abs(value) / largest if largest > 0 else 0.0

    @property
    def size(self) -> float:
        """Larger side of the picture, m."""
        low, high = self.box
        return float(np.max(high - low))


@dataclass(frozen=True)
class Touching:
    """The touches of one contact of the scene, or of one joint with clearance.

    `touches` are those within the film. `contact` gives the place of a contact between two parts;
    it is None for a guide, which has the `places` of its pairs instead. `force` (N, k) has the
    force of each pair at the samples of the run; a contact has one column. Its `unit` is N m for
    the stop of a hinge.
    """

    name: str
    touches: Intervals
    contact: Contact | None
    places: Line | None
    force: FloatArray
    unit: str = "N"

    def spots(self, take: Take, times: FloatArray) -> FloatArray:
        """Return the places (K, pairs, 2) m of its pairs at instants (K,) s."""
        poses = take.poses(times)
        if self.places is not None:
            return self.places.at(poses)
        assert self.contact is not None
        return spot_of(self.contact, poses)[:, None]

    def forces(self, take: Take, times: FloatArray) -> FloatArray:
        """Return the forces (K, pairs) of its pairs at instants (K,) s."""
        instants = take.result.time
        return np.stack([np.interp(times, instants, force) for force in self.force.T], axis=1)


def touching_of(film: Film, take: Take) -> list[Touching]:
    """Return all contacts of a run's scene, and all its joints with clearance."""
    result, model = take.result, take.model
    all_touching = []
    for contact in (*model.contacts, *model.bearings):
        histories = result.contacts if contact.name in result.contacts else result.bearings
        history = histories[contact.name]
        inside = _within(history.touches, film)
        unit = result.scene.unit_of(contact.name, "N")
        all_touching.append(
            Touching(contact.name, inside, contact, None, history.force[:, None], unit)
        )
    for groove in model.grooves:
        walls = result.sleeves[groove.name]
        for k, wall in enumerate(groove.contacts):
            inside = _within(walls.touches.where(walls.touches.pair == k), film)
            all_touching.append(
                Touching(groove.name, inside, wall, None, walls.force[:, k : k + 1])
            )
    for channel in walled(model):
        sleeve = result.sleeves[channel.name]
        places = through(channel.name, *(pair.point for pair in channel.contacts))
        inside = _within(sleeve.touches, film)
        all_touching.append(Touching(channel.name, inside, None, places, sleeve.force))
    return all_touching


def _within(touches: Intervals, film: Film) -> Intervals:
    return touches.where((touches.begin <= film.end) & (touches.end >= film.begin))


def strength(touches: Intervals) -> FloatArray:
    """Return the strengths (K,) of touches: peak force (N); for impacts, minus impulse (N s)."""
    return np.where(np.isfinite(touches.peak_force), touches.peak_force, -touches.impulse)


def spot_of(contact: Contact, poses: FloatArray) -> FloatArray:
    """Return the place (..., 2) m of a touch, or the nearest one: on the edge of the first part."""
    round_parts = circles_of(contact)
    if isinstance(contact, FlatContact):
        look = approach(contact, poses, np.zeros_like(poses), 0.0)
        beside = look.place[..., None] * look.along - look.gap[..., None] * look.normal
        return np.asarray(anchor_position(contact.start, poses) + beside)
    if not isinstance(contact, CircleContact) and not round_parts:
        return anchor_position(contact.point, poses)
    point, radius = round_parts[0]
    normal = approach(contact, poses, np.zeros_like(poses), 0.0).normal
    return np.asarray(anchor_position(point, poses) - radius * normal)


def film_of(
    result: Result,
    other: Result | None = None,
    *,
    names: tuple[str, str] | None = None,
    window: tuple[float | None, float | None] = (None, None),
    slow: Slow | None = None,
) -> Film:
    """Return the film of a run, with `other` over it.

    `window` has the begin and the end (s); None: the begin, and the end of the shorter run. `names`
    are the names of both runs, by default their engines. `slow` requests slow motion.

    Raises:
        FilmError: there is nothing to show, or a request can't be met; it lists all mistakes.

    """
    takes, (begin, end) = _takes(result, other, names), window
    first = max(float(take.result.time[0]) for take in takes)
    last = min(float(take.result.time[-1]) for take in takes)
    start, stop = first if begin is None else begin, last if end is None else end
    mistakes = [
        f"{name} {value:g} s is not within the run: it goes from {first:g} s to {last:g} s"
        for name, value in (("the begin", begin), ("the end", end))
        if value is not None and not (isfinite(value) and first <= value <= last)
    ]
    if not mistakes and not start < stop:
        mistakes.append(
            f"nothing to animate: it would begin at {start:g} s and end at {stop:g} s"
            if begin is not None or end is not None
            else "nothing to animate: the run has one instant only"
        )
    asked: tuple[Stretch, ...] = ()
    try:
        asked = () if slow is None else around(result, slow)
    except ValueError as error:
        mistakes.append(str(error))
    if mistakes:
        raise FilmError("\n".join(mistakes))
    inside = [
        tuple(Stretch(max(a, start), min(b, stop)) for a, b in some if a < stop and b > start)
        for some in (asked, around_strikes(result))
    ]
    if slow is not None and not inside[0]:
        raise FilmError(f"{slow.text} is not between {start:g} s and {stop:g} s")
    return Film(takes, start, stop, *inside)


def _takes(result: Result, other: Result | None, names: tuple[str, str] | None) -> tuple[Take, ...]:
    """Return one run in the colours of its bodies, or two, each in a colour of its own."""
    if other is None:
        return (Take(result, result.engine, None),)
    first, second = names or (result.engine, other.engine)
    if first == second:
        first, second = f"{first} (first)", f"{second} (second)"
    first_colour, second_colour = colours_of_both(result, other)
    return Take(result, first, first_colour), Take(other, second, second_colour)


ROOM_AT_FACE = (0.06, 0.14)  # of the visible length: room below and above a face
STRIKE_PART = 0.06  # of the picture: smallest visible length of a face
BESIDE = 0.08  # of a guide's length: room before and behind a guide in its zoom
MOST_FACES = 2  # most struck faces; of more, none has a zoom: zooms would hide the mechanism
ROOM_ALONG = 1.5  # visible length of a face, as a multiple of the length of its touches
SLIDES = 0.15  # of the picture: longest zoom on a face; longer ones would enlarge too little


@dataclass(frozen=True)
class Zoom:
    """A zoom on the contact or joint `name`: its ranges `along` its x-axis and `across`, m.

    `channel` is its guide with clearance. It is None for a face, which `point` may strike.
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
        """Length of the zoom along its x-axis, m."""
        return self.along[1] - self.along[0]

    @property
    def words(self) -> str:
        """Caption of the zoom."""
        return f"in {self.name}" if self.channel is not None else f"at {self.name}"


def zooms_of(film: Film, take: Take) -> list[Zoom]:
    """Return the zooms of a run: guides with clearance, and faces that are struck in the film."""
    struck = {
        touching.name: touching for touching in touching_of(film, take) if len(touching.touches)
    }
    struck_faces = [face for face in faces(take.model) if face.name in struck]
    shown = struck_faces if len(struck_faces) <= MOST_FACES else []
    at_faces = [_at_face(film, take, face, struck[face.name]) for face in shown]
    guides = []
    for channel in walled(take.model):
        along, reach = (
            (-BESIDE * channel.length, (1 + BESIDE) * channel.length),
            ROOM * channel.clearance,
        )
        guides.append(Zoom(channel.name, Viewpoint(channel.guide), along, (-reach, reach), channel))
    return [*guides, *(zoom for zoom in at_faces if zoom.length <= SLIDES * film.size)]


def _at_face(film: Film, take: Take, face: FaceContact, touching: Touching) -> Zoom:
    """Return the zoom on the part of a face that is touched in a film; its free side is above."""
    # The free side is left of the line from start to end; the zoom has it above.
    start, end = (face.end, face.start) if face.side < 0 else (face.start, face.end)
    view = Viewpoint(start, float(np.arctan2(end.y - start.y, end.x - start.x)))
    instants = _while_touching(film, take, touching)
    x = view.seen(touching.spots(take, instants), take.poses(instants))[..., 0]
    middle = float(np.min(x) + np.max(x)) / 2
    length = max(STRIKE_PART * film.size, ROOM_ALONG * float(np.ptp(x)))
    below, above = (part * length for part in ROOM_AT_FACE)
    along = (middle - length / 2, middle + length / 2)
    striking = take.result.scene.all_contacts[face.name].striking
    return Zoom(face.name, view, along, (-below, above), point=face.point, point_name=striking)


def _while_touching(film: Film, take: Take, touching: Touching) -> FloatArray:
    """Return the instants (K,) s of a film with a touch: begins of touches, and samples."""
    begin = np.sort(touching.touches.begin)
    time = np.clip(np.concatenate([take.result.time, begin]), film.begin, film.end)
    latest = np.searchsorted(begin, time, side="right") - 1
    lasts = (latest >= 0) & (time <= touching.touches.until(film.end)[latest])
    return np.asarray(time[lasts])

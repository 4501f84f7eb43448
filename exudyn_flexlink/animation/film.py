"""What an animation shows: a run, or two over each other, with touches, slow motion and zooms.

Slow motion is in stretches of time around strikes, and touches in joints with clearance. Zooms, in
panels below the picture, are of guides with clearance and of struck faces; each is seen from its
part, with walls or face along the x-axis.
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
"""What stands for the strikes of all contacts, unless a contact has that name."""

BEFORE, AFTER = 0.3, 1.0  # of its duration: how long before and after a strike is seen, too
BRIEFEST, LONGEST = 0.004, 0.03  # of the run: a strike is seen no shorter, as an impact would be,
# and no longer: of what then lies on the other, the begin


@dataclass(frozen=True)
class Slow:
    """Asks for slow motion: a contact, or joint with clearance, by its name; which of its strikes.

    `number` counts from 1; None: all of them.
    """

    name: str = ANY
    number: int | None = None

    @classmethod
    def of(cls, text: str) -> Slow:
        """Read 'NAME', or 'NAME:2' for the second strike.

        Raises:
            ValueError: what follows the colon is no number from 1.

        """
        name, colon, number = text.partition(":")
        if not colon:
            return cls(name.strip())
        if not number.strip().isdecimal() or int(number) < 1:
            raise ValueError(f"'{text}' is no name, nor a name and a number, such as 'strike:2'")
        return cls(name.strip(), int(number))

    @property
    def text(self) -> str:
        """What is asked for, in words."""
        return f"'{self.name}'" if self.number is None else f"'{self.name}' number {self.number}"


class Stretch(NamedTuple):
    """From `begin` to `end`, s."""

    begin: float
    end: float


def around_strikes(result: Result) -> tuple[Stretch, ...]:
    """Stretches of time around the strikes of all contacts."""
    return _joined(result, _strikes(result, *result.scene.all_contacts))


def around(result: Result, asked: Slow) -> tuple[Stretch, ...]:
    """Stretches of time that slow motion is asked for.

    Raises:
        ValueError: there are none.

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
    """Begins and ends (s) of the strikes of some contacts, in order."""
    all_strikes = [strike for name in contacts for strike in strikes(result, name)]
    return sorted((strike.begin, strike.end) for strike in all_strikes)


def _joined(result: Result, strikes_: list[tuple[float, float]]) -> tuple[Stretch, ...]:
    """Stretches around strikes in order; those that meet are one."""
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
"""Kinds of lines, those in front last."""
LOOKS = 400  # instants at which the room that a mechanism takes is looked at
BELOW = 0.1  # of the size of what is shown, below: there stands a length that sizes are read by


class FilmError(ValueError):
    """What was asked for can't be shown; every mistake is a line."""


@dataclass(frozen=True)
class Take:
    """A run as it is shown: by a name, and in a colour of its own; None: each body has its own."""

    result: Result
    name: str
    colour: str | None

    @cached_property
    def model(self) -> Mechanism:
        """The mechanism of its scene."""
        return build_mechanism(self.result.scene)

    @property
    def watched(self) -> Anchor:
        """The point S, whose trail is drawn."""
        return self.named["S"]

    def poses(self, times: FloatArray) -> FloatArray:
        """Poses (K, parts, 3) at instants (K,) s; see `Result.poses`. Exact at samples."""
        run = self.result
        return between_samples(run.time, run.poses, run.rates, times)

    def crank(self, times: FloatArray) -> FloatArray | None:
        """Angle (K,) rad of the crank at instants; None without one."""
        if crank_joint(self.result.scene) is None:
            return None
        return np.interp(times, self.result.time, crank_angle(self.result))

    @cached_property
    def lines(self) -> list[Drawn]:
        """Lines of the mechanism, those in front last."""
        lines = drawn_lines(self.result.scene, self.model)
        coloured = [replace(drawn, colour=self.colour or drawn.colour) for drawn in lines]
        return sorted(coloured, key=lambda drawn: KINDS.index(drawn.kind))

    @cached_property
    def marks(self) -> list[Mark]:
        """Marks of the joints; those of the ground first."""
        joints_marked = joint_marks(self.result.scene, self.model)
        return sorted(joints_marked, key=lambda mark: "ground" not in mark.kind)

    def spans(self, thing: Drawn | Mark) -> list[Stretch]:
        """Spans (s) in which a line or a mark is there: its part may come, or go, with a stage."""
        return [span for span, things in self._in_stages if _key(thing) in things]

    def is_there(self, thing: Drawn | Mark, time: float) -> bool:
        """Tell whether a line or a mark is there at an instant (s)."""
        return any(begin <= time < end for begin, end in self.spans(thing))

    @cached_property
    def _in_stages(self) -> list[tuple[Stretch, set[tuple[object, ...]]]]:
        """Spans of all stages, and what is drawn in each."""
        begins = [-inf, *(begin for begin, _ in self.result.stages), inf]
        spans = [Stretch(*span) for span in pairwise(begins)]
        scenes = stage_scenes(self.result.scene)  # more than spans where a stage never came
        return [(span, _drawn_in(scene)) for span, scene in zip(spans, scenes, strict=False)]

    @cached_property
    def named(self) -> dict[str, Anchor]:
        """Points that the paper names; the origin only where the paper's slot is."""
        anchors = named_points(self.result.scene, self.model)
        return {
            name: anchor for name, anchor in anchors.items() if name != "O" or self.model.all_slots
        }

    def points(self, begin: float, end: float) -> list[FloatArray]:
        """Points (..., 2) m of all that is drawn between two instants."""
        poses = self.poses(np.linspace(begin, end, LOOKS))
        ends = [np.array([anchor.x, anchor.y]) for anchor in pivots(self.model)]
        return [*(drawn.line.at(poses) for drawn in self.lines), *ends]


def _key(thing: Drawn | Mark) -> tuple[object, ...]:
    """What tells a line, or a mark, of one stage from all others of that."""
    return (thing.kind, thing.line.name) if isinstance(thing, Drawn) else (thing.kind, thing.anchor)


def _drawn_in(scene: Scene) -> set[tuple[object, ...]]:
    """Keys of all that is drawn in a stage."""
    model = build_mechanism(scene)
    things: list[Drawn | Mark] = [*drawn_lines(scene, model), *joint_marks(scene, model)]
    return {_key(thing) for thing in things}


@dataclass(frozen=True)
class Film:
    """One take, or two over each other, from `begin` to `end` (s), with slow motion in places.

    `slow` are the stretches of time that are slowed down, `strikes` those that may be.
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
        """Instant (s) from which on one of the runs is not known well enough, and why."""
        horizons = [beyond for take in self.takes if (beyond := horizon(take.result)) is not None]
        return min(horizons, default=None)

    @property
    def doubts(self) -> str:
        """What is doubtful of each run, in words; or nothing."""
        doubts = [(f"{take.name}: ", doubts_of(take.result)) for take in self.takes]
        return "; ".join(name * (len(doubts) > 1) + doubt for name, doubt in doubts if doubt)

    @cached_property
    def largest(self) -> tuple[float, float]:
        """Largest force (N) and impulse (N s) of all touches; 0 where there is none."""
        histories = [touching for take in self.takes for touching in touching_of(self, take)]
        values = np.concatenate(
            [np.zeros(1), *(strength(touching.touches) for touching in histories)]
        )
        return float(values.max()), float(-values.min())

    def part(self, value: float) -> float:
        """How strong a touch is, see `strength`, as a part of the largest of its kind."""
        largest = self.largest[value < 0]
        return abs(value) / largest if largest > 0 else 0.0

    @property
    def size(self) -> float:
        """Larger side of the picture, m."""
        low, high = self.box
        return float(np.max(high - low))


@dataclass(frozen=True)
class Touching:
    """What touches in one contact of the scene, or in a joint with clearance.

    `touches` are those within the film. `contact` tells where, of two parts; of a guide it is None,
    and `places` are those of its pairs. `force` (N, k) are the forces of its pairs at the samples
    of the run, of a contact one column, in its `unit`: N m of a hinge's stop.
    """

    name: str
    touches: Intervals
    contact: Contact | None
    places: Line | None
    force: FloatArray
    unit: str = "N"

    def spots(self, take: Take, times: FloatArray) -> FloatArray:
        """Places (K, pairs, 2) m of its pairs at instants (K,) s."""
        poses = take.poses(times)
        if self.places is not None:
            return self.places.at(poses)
        assert self.contact is not None
        return spot_of(self.contact, poses)[:, None]

    def forces(self, take: Take, times: FloatArray) -> FloatArray:
        """Forces (K, pairs) of its pairs at instants (K,) s."""
        instants = take.result.time
        return np.stack([np.interp(times, instants, force) for force in self.force.T], axis=1)


def touching_of(film: Film, take: Take) -> list[Touching]:
    """All that can touch in a take: contacts of the scene, and joints with clearance."""
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
    """How strong touches are (K,): peak force in N; of an impact, which has none, minus its N s."""
    return np.where(np.isfinite(touches.peak_force), touches.peak_force, -touches.impulse)


def spot_of(contact: Contact, poses: FloatArray) -> FloatArray:
    """Where a contact touches, or is nearest to it, (..., 2) m: the edge of its first part."""
    round_parts = circles_of(contact)
    if isinstance(contact, FlatContact):
        look = approach(contact, poses, np.zeros_like(poses))
        beside = look.place[..., None] * look.along - look.gap[..., None] * look.normal
        return np.asarray(anchor_position(contact.start, poses) + beside)
    if not isinstance(contact, CircleContact) and not round_parts:
        return anchor_position(contact.point, poses)
    point, radius = round_parts[0]
    normal = approach(contact, poses, np.zeros_like(poses)).normal
    return np.asarray(anchor_position(point, poses) - radius * normal)


def film_of(
    result: Result,
    other: Result | None = None,
    *,
    names: tuple[str, str] | None = None,
    window: tuple[float | None, float | None] = (None, None),
    slow: Slow | None = None,
) -> Film:
    """Return what is shown of a run, with `other` over it.

    `window` is from when to when (s), None: from the begin, to the end of the shorter run. `names`
    are those of both runs, by default their engines. `slow` asks for slow motion.

    Raises:
        FilmError: there is nothing to show, or nothing of what was asked for; all mistakes at once.

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
    """One run in the colours of its bodies, or two, each in a colour of its own."""
    if other is None:
        return (Take(result, result.engine, None),)
    first, second = names or (result.engine, other.engine)
    if first == second:
        first, second = f"{first} (first)", f"{second} (second)"
    first_colour, second_colour = colours_of_both(result, other)
    return Take(result, first, first_colour), Take(other, second, second_colour)


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
    """The part of a face that is touched in a film, what strikes it above."""
    # Seen so that the free side, which is left of the way from start to end, is above.
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
    """Instants (K,) s of the film at which something touches: begins of touches, and samples."""
    begin = np.sort(touching.touches.begin)
    time = np.clip(np.concatenate([take.result.time, begin]), film.begin, film.end)
    latest = np.searchsorted(begin, time, side="right") - 1
    lasts = (latest >= 0) & (time <= touching.touches.until(film.end)[latest])
    return np.asarray(time[lasts])

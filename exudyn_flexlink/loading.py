"""Model file to scene: read, checked in every part, and assembled at time 0.

Mistakes use the words of the model file. Some concern joints whose forces are not determined, for
example with friction, gears or redundant joints. Others concern scenes that can't be assembled at
time 0.
"""

from __future__ import annotations

import json
import re
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from math import degrees, inf
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.expressions import Expression, NoValueError
from exudyn_flexlink.laws import SpringTable
from exudyn_flexlink.mechanism import (
    Assembly,
    CannotAssembleError,
    CannotMoveError,
    CircleContact,
    Contact,
    FaceContact,
    FlatContact,
    Held,
    Mechanism,
    NoRestError,
    Rest,
    Sense,
    Slide,
    Start,
    always_redundant,
    anchor_position,
    approach,
    assemble,
    build_curves,
    build_mechanism,
    drive_mistakes,
    end_of_run,
    extent,
    formulation,
    in_guides,
    least_tolerance,
    other_branches,
    pressed_at,
    rest_of,
    sample_bytes,
    sensed,
    shared_forces,
    until_mistakes,
    with_pulses,
)
from exudyn_flexlink.mechanism.tree import tree_layout
from exudyn_flexlink.once import once_for_each
from exudyn_flexlink.rounding import INVISIBLE, PLACE_ROUNDING
from exudyn_flexlink.scene import (
    GROUND,
    LinearSpring,
    Scene,
    apply_settings,
    check_document,
    first_stage,
    stage_scenes,
)
from exudyn_flexlink.source import (
    Document,
    Mistake,
    SceneError,
    Setting,
    load_document,
    parse_document,
)


def rubbing_badly(assembly: Assembly) -> list[Mistake]:
    """Friction in joints that is not determined, or that the rest of the scene does not allow."""
    mechanism, notes = assembly.mechanism, []
    shared = shared_forces(assembly) if mechanism.frictions else set()
    for friction in mechanism.frictions:
        path = ("joints", friction.name, "friction")
        if friction.share > 0 and friction.name in shared:
            message = "the force in this joint is not known: other joints hold the same"
            hint = "take one of them away; or give a torque, along a slide a force"
            notes.append(Mistake((*path, "coefficient"), message, hint))
        if isinstance(friction.joint, Slide) and friction.name not in tree_layout(mechanism).joints:
            message = "friction of a slide that closes a loop of slides is not known"
            notes.append(Mistake(path, message, "give it to another slide of the loop"))
    return notes


def geared_badly(scene: Scene, assembly: Assembly) -> list[Mistake]:
    """Racks whose slide is not a minimal coordinate."""
    mechanism = assembly.mechanism
    slides = {
        tie.slide.name: gear.name for gear in mechanism.all_gears for tie in gear.ties if tie.slide
    }
    if not slides or formulation(scene) != "minimal":
        return []
    layout, hint = tree_layout(mechanism), "mesh with another slide of the loop"
    return [
        Mistake(
            ("joints", gear), f"'{slide}' closes a loop of slides: no gear is known there", hint
        )
        for slide, gear in slides.items()
        if slide not in layout.joints
    ]


def ended_badly(scene: Scene, assembly: Assembly) -> list[Mistake]:
    """An `until` with forces that motion does not determine, or not below 0 at time 0."""
    mechanism, (path, _) = assembly.mechanism, scene.ending
    until = mechanism.until
    if until is None:
        return []
    senses, motion = list[Sense](), assembly.state
    shared = shared_forces(assembly) if until.by_forces else set()
    for sense in until.senses:
        if not isinstance(sense, Held):
            senses.append(sense)
        elif sense.joint in shared:
            message = f"the force in '{sense.joint}' is not known: other joints hold the same"
            return [Mistake(path, message, "take one of them away, or name another joint")]
    if until.by_forces or scene.initial.states:
        return []  # the run's preparation checks it; or it counts after it was below 0
    try:
        values = [np.array([sensed(sense, motion.q, motion.v)]) for sense in senses]
        return until_mistakes(until, values, path)
    except NoValueError as error:
        return [Mistake(path, str(error), error.advice)]


def redundancies(scene: Scene, assembly: Assembly) -> list[Mistake]:
    """Redundant joints and drives, whose forces are not determined.

    Minimal coordinates leave out joints that others always imply. They do not leave out drives, or
    joints of a structure that nothing can move.
    """
    moves = assembly.degrees_of_freedom > 0 or assembly.mechanism.speed_motors
    may = assembly.surplus and moves and not set(scene.drives) & set(assembly.surplus)
    if may and formulation(scene) == "minimal" and always_redundant(assembly):
        return []
    notes = []
    hint = (
        "two joints do the same, two drives move one freedom, or the mechanism starts at a dead "
        "centre: take one away, or start at another angle; of a body pinned at both ends between "
        "parts that move alike, let one pin slide along it, in a slot"
    )
    for name, count in assembly.surplus.items():
        drive = name in scene.drives and name not in scene.joints
        what = "drive" if drive else "joint" if name in scene.joints else "body's hinge"
        times = "" if count == 1 else f" {count} times"
        path = ("drives", name) if drive else path_of(scene, name)
        notes.append(Mistake(path, f"this {what} holds{times} what others hold already", hint))
    return notes


NO_START = (NoValueError, CannotAssembleError, CannotMoveError, NoRestError)
"""Errors if a mechanism can't be assembled, or has no rest."""
TYPED_ROUNDED = 1e-4  # m: penetration of a place on a face that was typed with few digits

_OPEN = {
    "slot": (
        "the point can't be on its curve at the start",
        "move the curve or the joint that carries the point, or give another initial angle",
    ),
    "revolute": (
        "the joint can't close at the start",
        "check lengths and places; under 'initial: guesses' say roughly where the bodies stand",
    ),
    "weld": (
        "the weld can't close at the start",
        "check places and angles of the two bodies, and 'initial: angles'",
    ),
    "position": (
        "the joints do not allow this position",
        "leave it out: what follows from the joints needs none",
    ),
    "prismatic": (
        "the point can't be on its line at the start",
        "check places, 'axis' and 'angle'; under 'initial: guesses' say roughly where bodies stand",
    ),
    "along": (
        "the joints do not allow this length",
        "leave it out: what follows from other joints and drives needs none",
    ),
    "slide drive": (
        "the joint can't have the length that this drive gives it at the start",
        "the drive's value at t = 0 s, or 'initial: along', contradicts the other joints",
    ),
    "drive": (
        "the joint can't have the angle that this drive gives it at the start",
        "the drive's value at t = 0 s, or 'initial: angles', contradicts the other joints",
    ),
    "sleeve": (
        "the link can't lie in its guide at the start",
        "check the angles of guide and link under 'initial: angles'",
    ),
}
"""Why a kind of joint does not close, in the user's words, and a hint."""
_ELSEWHERE: dict[str, tuple[str, ...]] = {
    "position": ("initial", "positions"),
    "along": ("initial", "along"),
    "drive": ("drives",),
    "slide drive": ("drives",),
}
"""Paths in the file of things that are not joints."""


def start_mistake(scene: Scene, error: Exception) -> Mistake:
    """Return one of the errors `NO_START` in the words of the model file."""
    if isinstance(error, CannotAssembleError):
        return _open_mistake(scene, error)
    if isinstance(error, CannotMoveError):
        return _speed_mistake(error)
    if isinstance(error, NoRestError):
        return _rest_mistake(scene, error)
    assert isinstance(error, NoValueError)
    return _value_mistake(scene, error)


def path_of(scene: Scene, joint: str) -> tuple[str | int, ...]:
    """Path in the file of a joint, or of the flexible body that contains it."""
    if joint in scene.joints:
        return ("joints", joint)
    body = re.split(" (?:hinge|stretch) ", joint, maxsplit=1)[0]
    return ("bodies", body) if body in scene.bodies else ()


def _loop_of(scene: Scene, joint: str) -> list[str]:
    """Names of the joints on the shortest other way between a joint's two bodies."""
    bodies = {
        name: (*joint.bodies, GROUND)[:2] for name, joint in scene.joints.items() if joint.bodies
    }
    if joint not in bodies:
        return []
    first, last = bodies.pop(joint)
    ways, seen = deque([(first, list[str]())]), {first}
    while ways:
        part, names = ways.popleft()
        if part == last:
            return [f"'{name}'" for name in names]
        for name, ends in bodies.items():
            if part in ends and (other := ends[0] if part == ends[1] else ends[1]) not in seen:
                seen.add(other)
                ways.append((other, [*names, name]))
    return []


def _open_mistake(scene: Scene, error: CannotAssembleError) -> Mistake:
    """A joint that can't close, or the given value that prevents this."""
    joint = None if error.kind in _ELSEWHERE else scene.joints.get(error.joint)
    within = "revolute" if error.kind == "slide" else error.kind  # in a body
    message, hint = _OPEN[within if joint is None else joint.type]
    gap = [f"{error.gap:.3g} m"] if error.gap > INVISIBLE or error.turn <= INVISIBLE else []
    missing = [*gap, *([f"{degrees(error.turn):.3g} deg"] if error.turn > INVISIBLE else [])]
    if error.near is not None:
        hint = f"the joints allow [{error.near[0]:.9g}, {error.near[1]:.9g}] next to it"
    if joint is not None and (others := _loop_of(scene, error.joint)):
        hint += f"; it closes a loop with {', '.join(others)}: any of them may be misplaced"
    held = scene.initial.angles
    if held and joint is not None and joint.type in ("revolute", "prismatic", "slot"):
        names = ", ".join(f"'{body}'" for body in held)
        hint += f"; or 'initial: angles' holds one too many ({names}): 'guesses' leaves it free"
    path = path_of(scene, error.joint)
    if error.kind in _ELSEWHERE:
        path = (*_ELSEWHERE[error.kind], error.joint)
    return Mistake(path, f"{message}: {' and '.join(missing)} missing", hint)


def _value_mistake(scene: Scene, error: NoValueError) -> Mistake:
    """Name the drive or spring whose expression or table has no value at the start."""
    path: tuple[str | int, ...] = ("drives",)
    for name, drive in scene.drives.items():
        values = drive.value if isinstance(drive.value, tuple) else (drive.value,)
        if any(isinstance(item, Expression) and item.text == error.text for item in values):
            path = ("drives", name, "value")
    for name, spring in scene.springs.items():
        key = "force" if isinstance(spring, LinearSpring) else "torque"
        law = getattr(spring, key)
        if error.text == (law.text if isinstance(law, Expression) else name):
            path = ("springs", name, key)
    return Mistake(path, str(error), "as the mechanism starts")


def _speed_mistake(error: CannotMoveError) -> Mistake:
    """A drive or a start speed that joints, or earlier drives and speeds, do not allow."""
    if error.path[0] == "drives":
        return Mistake(
            error.path,
            "the mechanism can't follow this drive at the start: joints or other drives block it",
            "a dead centre, or two drives of one freedom; start at another angle",
        )
    what = "velocity" if "velocities" in error.path else "speed"
    return Mistake(
        error.path,
        f"this {what} contradicts the joints, the drives or the speeds above",
        "leave out what follows from others",
    )


def _rest_mistake(scene: Scene, error: NoRestError) -> Mistake:
    """No rest near the start."""
    if error.kind == "contact":
        path = scene.stops[error.name].path if error.name in scene.stops else None
        message = f"'{error.name}' would press at rest, and a law by impulse has no depth for that"
        return Mistake(path or ("contacts", error.name), message, "give it a law with stiffness")
    pull = f"a force of {error.force:.4g} N" if error.force > 0 else "a torque"
    message = f"no rest is found: {pull} drives '{error.name}' on"
    hint = (
        "does anything hold it? Contacts by impulse don't; or start nearer, by 'initial: guesses'"
    )
    return Mistake(("initial", "at_rest"), message, hint)


def moving_drives(assembly: Assembly) -> list[Mistake]:
    """Drives with a speed at time 0 in a run that should start at rest."""
    about = "moves at {:.4g} {} at first, so that nothing can start at rest"
    hint = "give it a 'ramp', or a formula that begins with speed 0"
    winches = [
        Mistake(("springs", rope.name, "length"), about.format(speed, "m/s"), hint)
        for rope in assembly.mechanism.ropes
        if (speed := float(rope.free_length.rates(np.zeros(1))[0])) != 0
    ]
    return winches + [
        Mistake(
            ("drives", motor.name), about.format(speed, "m/s" if motor.slide else "rad/s"), hint
        )
        for motor in assembly.mechanism.speed_motors
        if (speed := motor.speed.at(0.0)) != 0
    ]


def pressing_badly(scene: Scene, mechanism: Mechanism) -> list[Mistake]:
    """Unknown names or pairs among the contacts that press as a scene continues a run."""
    counts = dict.fromkeys(mechanism.numbers, 1)
    counts |= {channel.name: len(channel.contacts) for channel in mechanism.channels}
    counts |= {groove.name: len(groove.contacts) for groove in mechanism.grooves}
    notes = []
    for name, pairs in scene.initial.pressing.items():
        path, count = ("initial", "pressing", name), counts.get(name, 0)
        if not count:
            message = f"'{name}' is no contact, no stop and no joint with walls"
            notes.append(Mistake(path, message, on_key=True))
        elif not all(0 <= pair < count for pair, _ in pairs):
            notes.append(Mistake(path, f"'{name}' has the pairs 0 to {count - 1} alone"))
    return notes


def penetrations(scene: Scene, assembly: Assembly, resting: bool = False) -> list[Mistake]:
    """Contacts, bearings and slots that start pressed: no step size can correct this.

    At rest (`resting`) contacts may press, but not beyond their tables of forces. If a run
    continues another one, a point behind its face that does not press has gone around an end of the
    face; only redundant coordinates do not know this.
    """
    notes = [] if resting else list(_beyond_stops(scene, assembly))
    state, pressing = assembly.state, scene.initial.pressing
    goes_on = bool(scene.initial.states) and formulation(scene) == "minimal"
    for contact in assembly.mechanism.contacts:
        if contact.name not in scene.contacts:
            law, depth = contact.law, -float(approach(contact, state.q, state.v, 0.0).gap)
            if isinstance(law, SpringTable) and depth > law.depths[-1]:
                message = f"the table ends {law.depths[-1]:.3g} m from 'length', it starts at "
                hint = "give the table more rows: no force is made up beyond them"
                path = ("springs", contact.name, "force")
                notes.append(Mistake(path, f"{message}{depth:.3g} m", hint))
            continue
        look = approach(contact, state.q, state.v, 0.0)
        # A point deeper than the face's length is beside the face, and may come around its end.
        if pressed_at(contact, look) and not resting and not goes_on:
            depth = -float(look.gap)
            message = f"starts with a penetration of {depth:.3g} m"
            notes.append(Mistake(("contacts", contact.name), message, _apart(contact, depth)))
    for bearing in assembly.mechanism.bearings:
        gap = float(approach(bearing, state.q, state.v, 0.0).gap)
        if gap < -PLACE_ROUNDING and not resting and bearing.name not in pressing:
            message = f"the journal starts {-gap:.3g} m inside its bearing's wall"
            hint = "check lengths and 'initial', or widen the clearance"
            notes.append(Mistake(("joints", bearing.name), message, hint))
    for groove in assembly.mechanism.grooves:
        walls = [groove.contacts[k] for k in groove.walls(groove.lap)]
        depth = max(-float(approach(wall, state.q, state.v, 0.0).gap) for wall in walls)
        if depth > PLACE_ROUNDING and not resting and groove.name not in pressing:
            message = f"the pin starts {depth:.3g} m inside a wall of its slot"
            hint = "check lengths and 'initial', or widen the clearance"
            notes.append(Mistake(("joints", groove.name), message, hint))
    return notes


def _beyond_stops(scene: Scene, assembly: Assembly) -> Iterator[Mistake]:
    """Joints that start beyond their limits."""
    for contact in assembly.mechanism.contacts:
        stop = scene.stops.get(contact.name)
        gap = float(approach(contact, assembly.state.q, assembly.state.v, 0.0).gap)
        pressing = contact.name in scene.initial.pressing
        if stop is not None and gap < -PLACE_ROUNDING and not pressing:
            place = stop.at + gap * (1.0 if stop.end == "from" else -1.0)
            way = "less" if stop.end == "from" else "more"
            message = f"'{stop.joint}' starts at {stop.text(place)}, {way} than its limit"
            hint = "whole turns count: " if stop.turns else ""
            key = "angles" if stop.turns else "along"
            hint += f"start it within its limits, see 'initial: {key}', or move the limit"
            yield Mistake(stop.path, message, hint)


def _apart(contact: Contact, depth: float) -> str:
    """Hint for a contact that starts pressed."""
    what = "line" if isinstance(contact, (FaceContact, FlatContact)) else "curve"
    other, away = f"choose the other 'side' of the {what}", "out"
    if isinstance(contact, CircleContact):
        other, away = "make a radius smaller", "apart"
    elif depth < TYPED_ROUNDED:
        return f"what is meant to rest there may start that much above; or {other}"
    rests = "where both just touch: what rests there sinks in by itself"
    return f"start {depth:.3g} m farther {away}, {rests}; or {other}"


def pressed_walls(scene: Scene, assembly: Assembly) -> list[Mistake]:
    """Links with clearance that start beyond a wall or a corner of their guide."""
    notes, state = [], assembly.state
    for channel in assembly.mechanism.channels:
        depths = {
            contact.name.removeprefix(f"{channel.name}: "): -float(look.gap)
            for contact in (channel.contacts if channel.clearance > 0 else ())
            for look in [approach(contact, state.q, state.v, 0.0)]
            if 0 <= look.place <= contact.length and look.gap < -PLACE_ROUNDING
        }
        if depths and channel.name not in scene.initial.pressing:
            pair, depth = max(depths.items(), key=lambda item: item[1])
            message = f"the link starts {depth:.3g} m inside its guide's walls: {pair}"
            hint = "turn the link under 'initial: angles', or widen the clearance"
            notes.append(Mistake(("joints", channel.name), message, hint))
    return notes


def outside_guides(scene: Scene, assembly: Assembly) -> list[Mistake]:
    """Links that start wholly outside their guides, where nothing holds a link."""
    about = "the link starts outside its guide, {:.3g} of the guide's length away"
    hint = "check lengths, places, and the units of curves; or say 'initial: along'"
    return [
        Mistake(("joints", name), about.format(far), hint)
        for name, low, high in in_guides(scene, assembly.mechanism, assembly.state.q)
        if (far := max(float(low) - 1, -float(high))) > INVISIBLE
    ]


def without_direction(scene: Scene, assembly: Assembly) -> list[Mistake]:
    """Springs whose ends meet at the start, though they have a length: they act in no direction."""
    notes = []
    for spring in assembly.mechanism.linear_springs:
        if spring.slide is not None:
            continue
        spec, q = scene.springs[spring.name], assembly.state.q
        apart = anchor_position(spring.second, q) - anchor_position(spring.first, q)
        given = spec.length if isinstance(spec, LinearSpring) else 0.0
        if given != 0 and max(abs(apart)) <= INVISIBLE:
            message = "its ends meet at the start, where its force has no direction"
            hint = "'length: 0' for a spring that draws its ends together; else another place"
            notes.append(Mistake(("springs", spring.name), message, hint))
    for rope in assembly.mechanism.ropes:
        for i, piece in enumerate(rope.pieces, start=1):
            if -approach(piece, assembly.state.q, assembly.state.v, 0.0).gap <= rope.shortest:
                message = "at the same place as the one before, as the mechanism starts"
                hint = "a piece of a rope needs a length, or it has no direction"
                notes.append(Mistake(("springs", rope.name, "over", i), message, hint))
    return notes


MOST_MEMORY = 4_000_000_000  # bytes for samples: half the memory of a computer with 8 GB
WIDTH = 100  # columns of a model file that is written
SHORTEST_RUN = 1e-9  # s: ten thousand times the time resolution of the numerical methods


def load_scene(
    path: str | Path, settings: Iterable[Setting] = (), allow_outside: bool = False
) -> Scene:
    """Read a model file and check all of it.

    `settings` such as ``"run.turns=2"`` replace values of the file. `allow_outside` lets CSV files
    lie outside the model's folder.

    Raises:
        SceneError: the file has mistakes; all that can be seen at once are in it.

    """
    return scene_of(load_document(Path(path)), settings, allow_outside)


def require_length(name: str, length: float | None, scene: Scene) -> None:
    """Refuse a length, such as an allowed error, that runs of a scene can't keep.

    Raises:
        ImpossibleLengthError: rounding is larger than it, or the mechanism is smaller than it.

    """
    assembly = assemble_scene(scene)
    least, most = least_tolerance(assembly), extent(assembly)
    if length is None or least <= length <= most:
        return
    why = (
        f"is less than rounding allows; at least {least:g} m"
        if length < least
        else f"is more than the mechanism reaches; at most {most:.2g} m"
    )
    raise ImpossibleLengthError(f"{name}: {length:g} m {why}")


class ImpossibleLengthError(ValueError):
    """A length given outside the scene can't be kept; the text says which, and what is possible."""


def scene_of(
    document: Document, settings: Iterable[Setting] = (), allow_outside: bool = False
) -> Scene:
    """Check a document that is already read; see `load_scene`."""
    checked = check_document(apply_settings(document, settings), allow_outside)
    scene = checked.to_scene(others=build_curves(checked.curves)[1])
    assembly = assemble_scene(scene)
    stage_scenes(scene)
    beyond = [*run_mistakes(scene), *_tolerance_mistakes(scene, assembly)]
    if beyond:
        raise SceneError(scene.document, beyond)
    return scene


def document_of(scene: Scene) -> Document:
    """Return the document of a scene.

    If the scene is as it was read, this is its file, with known places; if it was changed since,
    the document holds its data.
    """
    document = scene.document
    if document.data and scene_of(document, (), True) == scene:
        return document
    return document_of_data(scene.to_data(), "the scene")


def yaml_of(scene: Scene) -> str:
    """Return a scene as the text of a model file, in SI units, with all points and tables in it."""
    text: str = yaml.safe_dump(
        scene.to_data(), sort_keys=False, allow_unicode=True, default_flow_style=None, width=WIDTH
    )
    return text


def document_of_data(data: Mapping[str, Any], name: str) -> Document:
    """Return plain data as a document called `name`; its files are read from the current folder.

    Raises:
        SceneError: the data are not a mapping of sections.
        TypeError: the data hold an object that no model can.

    """
    text = json.dumps(data, indent=2, ensure_ascii=False, default=plain_data)
    read = parse_document(text, name, Path.cwd())
    return replace(read, data=json.loads(text))  # YAML gives places, but ends lines at \x85, too


def plain_data(value: Any) -> Any:
    """Turn numpy's numbers and arrays, and paths, into types of JSON.

    Raises:
        TypeError: the value is none of these.

    """
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, PathLike):
        return str(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"a model can't hold {value!r}: numbers, texts, lists and dicts only")


@once_for_each
def assemble_scene(scene: Scene) -> Assembly:
    """Assemble the scene's mechanism at time 0, or at its rest.

    This is done once for each scene: both are frozen, and loading a scene has assembled it already.

    Raises:
        SceneError: a curve is impossible, joints can't close, speeds contradict joints, a contact
            starts with penetration, or a link starts outside its guide; or there is no rest.

    """
    resting = scene.initial.at_rest
    assembly = rest_of_scene(scene).assembly if resting else put_together(scene)
    mistakes = moving_drives(assembly) if resting else _start_mistakes(scene, assembly)
    if mistakes:
        raise SceneError(scene.document, mistakes)
    end = end_of_run(scene, assembly.mechanism)
    return with_pulses(assembly, scene.accuracy.tolerance, end)


@once_for_each
def rest_of_scene(scene: Scene) -> Rest:
    """Find the state where all forces balance, near the start; drives hold their start values.

    Raises:
        SceneError: see `assemble_scene`; or no state balances.

    """
    assembly = put_together(scene)
    try:
        rest = rest_of(assembly)
    except NO_START as error:
        raise SceneError(scene.document, [start_mistake(scene, error)]) from error
    mistakes = _start_mistakes(scene, rest.assembly, resting=True)
    if mistakes:
        raise SceneError(scene.document, mistakes)
    return rest


def put_together(scene: Scene) -> Assembly:
    """Like `assemble_scene` at the start, but contacts may press and links be outside guides."""
    scene = first_stage(scene)
    try:
        mechanism = build_mechanism(scene)
        undriven = drive_mistakes(mechanism, end_of_run(scene, mechanism))
        if undriven:
            raise SceneError(scene.document, undriven)
        return assemble(mechanism, _start(scene, mechanism))
    except NO_START as error:
        raise SceneError(scene.document, [start_mistake(scene, error)]) from error


def _start_mistakes(scene: Scene, assembly: Assembly, resting: bool = False) -> list[Mistake]:
    """Mistakes of the state at time 0; if `resting`, contacts may press."""
    return [
        *pressing_badly(scene, assembly.mechanism),
        *penetrations(scene, assembly, resting),
        *(() if resting else pressed_walls(scene, assembly)),
        *outside_guides(scene, assembly),
        *redundancies(scene, assembly),
        *without_direction(scene, assembly),
        *rubbing_badly(assembly),
        *geared_badly(scene, assembly),
        *ended_badly(scene, assembly),
    ]


def other_ways(scene: Scene, assembly: Assembly) -> list[dict[str, float]]:
    """Other ways to close the joints at time 0, found by a few searches.

    Each has the angle (rad) of every body; for a flexible body that of its first rod. There are
    none if the scene gives all states.
    """
    if scene.initial.states:
        return []
    mechanism = assembly.mechanism
    branches = other_branches(assembly, _start(scene, mechanism))
    bodies = mechanism.bodies.items()
    return [{body: float(angles[parts[0]]) for body, parts in bodies} for angles in branches]


def run_mistakes(scene: Scene) -> list[Mistake]:
    """Return mistakes that prevent a run: it ends at once, or samples don't fit into memory.

    Raises:
        SceneError: the scene can't be assembled.

    """
    mechanism = assemble_scene(scene).mechanism
    run, end, size = scene.run, end_of_run(scene, mechanism), sample_bytes(mechanism)
    if end < SHORTEST_RUN:
        key = "turns" if run.duration is None else "duration"
        message = f"the run would last {end:.2g} s, which is too short to be solved"
        return [Mistake(("run", key), message, f"it must last {SHORTEST_RUN:g} s or longer")]
    if run.sample is None:  # then samples are thinned
        return []
    most, count = MOST_MEMORY // size, end / run.sample
    if count <= most:
        return []
    message = (
        f"would keep {count:.2g} samples, {count * size / 1e9:.2g} GB; {most} of {size} bytes fit "
        f"into {MOST_MEMORY / 1e9:.0f} GB"
    )
    shorter = "run.duration" if run.turns is None else "run.turns"
    hint = f"a run.sample of at least {end / most:.2g} s, or a smaller {shorter}"
    return [Mistake(("run", "sample"), message, hint)]


def _tolerance_mistakes(scene: Scene, assembly: Assembly) -> list[Mistake]:
    """A tolerance, or a step, that is too small for rounded numbers."""
    least, asked = least_tolerance(assembly), scene.accuracy.tolerance
    if asked is None:
        end, step = end_of_run(scene, assembly.mechanism), scene.accuracy.step or inf
        least = float(np.spacing(end))
        if not step < least:
            return []
        message = f"{step:g} s is less than a clock shows that runs to {end:.2g} s"
        return [Mistake(("accuracy", "step"), message, f"at least {least:.2g} s")]
    if asked >= least:
        return []
    far = f"numbers are rounded, in a mechanism that reaches {extent(assembly):.2g} m"
    message = f"{asked:g} m is less than rounding allows"
    return [Mistake(("accuracy", "tolerance"), message, f"at least {least:g} m: {far}")]


def _start(scene: Scene, mechanism: Mechanism) -> Start:
    initial = scene.initial

    def by_part(values: dict[str, float]) -> dict[int, float]:
        return {part: x for body, x in values.items() for part in mechanism.bodies[body]}

    return Start(
        by_part(dict(initial.angles)),
        by_part(dict(initial.guesses)),
        by_part(dict(initial.speeds)),
        {mechanism.bodies[body][0]: v for body, v in initial.velocities.items()},
        {mechanism.bodies[body][0]: x for body, x in initial.positions.items()},
        dict(initial.along),
        dict(initial.speeds_along),
        _states(scene, mechanism),
        dict(initial.laps),
    )


def _states(scene: Scene, mechanism: Mechanism) -> FloatArray | None:
    """Coordinates and velocities (parts, 6) of all parts, if the scene gives them.

    Raises:
        SceneError: a body has more or fewer parts than the scene gives.

    """
    given = scene.initial.states
    if not given:
        return None
    mistakes = [
        Mistake(
            ("initial", "states", body),
            f"'{body}' has {len(parts)} parts, not {len(given[body])}",
            "states belong to the model that they came from; leave 'states' out",
        )
        for body, parts in mechanism.bodies.items()
        if len(parts) != len(given[body])
    ]
    if mistakes:
        raise SceneError(scene.document, mistakes)
    return np.concatenate([np.array(given[body], dtype=float) for body in mechanism.bodies])

"""What keeps a mechanism from being put together at time 0, in the words of the model file."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Iterator
from math import degrees

from exudyn_flexlink.expressions import Expression, NoValueError
from exudyn_flexlink.laws import SpringTable
from exudyn_flexlink.mechanism import (
    TOUCHING,
    Assembly,
    CannotAssembleError,
    CannotMoveError,
    CircleContact,
    Contact,
    FaceContact,
    FlatContact,
    NoRestError,
    anchor_position,
    approach,
    in_guides,
    pairs,
    pressed_at,
)
from exudyn_flexlink.scene import GROUND, LinearSpring, Scene
from exudyn_flexlink.source import Mistake

NO_START = (NoValueError, CannotAssembleError, CannotMoveError, NoRestError)
"""What keeps a mechanism from being put together, or from its rest."""
CLOSED = 1e-9  # m or rad: less is not worth a word
ROUNDED = 1e-4  # m: so deep may be a place on a face that was typed with few digits

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
"""What a kind of joint can't do, in the reader's words, and what to do about it."""
_ELSEWHERE: dict[str, tuple[str, ...]] = {
    "position": ("initial", "positions"),
    "along": ("initial", "along"),
    "drive": ("drives",),
    "slide drive": ("drives",),
}
"""Where in the file those stand that are no joints."""


def start_mistake(scene: Scene, error: Exception) -> Mistake:
    """Say one of `NO_START` in the words of the model file."""
    if isinstance(error, CannotAssembleError):
        return _open_mistake(scene, error)
    if isinstance(error, CannotMoveError):
        return _speed_mistake(error)
    if isinstance(error, NoRestError):
        return _rest_mistake(scene, error)
    assert isinstance(error, NoValueError)
    return _value_mistake(scene, error)


def path_of(scene: Scene, joint: str) -> tuple[str | int, ...]:
    """Place in the file of a joint, or of the flexible body within which it is."""
    if joint in scene.joints:
        return ("joints", joint)
    body = re.split(" (?:hinge|stretch) ", joint, maxsplit=1)[0]
    return ("bodies", body) if body in scene.bodies else ()


def _loop_of(scene: Scene, joint: str) -> list[str]:
    """Names of the joints that connect a joint's two bodies without it, by the shortest way."""
    bodies = {name: (*own.bodies, GROUND)[:2] for name, own in scene.joints.items() if own.bodies}
    if joint not in bodies:
        return []
    first, last = bodies.pop(joint)
    ways, seen = deque([(first, list[str]())]), {first}
    while ways:
        at, names = ways.popleft()
        if at == last:
            return [f"'{name}'" for name in names]
        for name, ends in bodies.items():
            if at in ends and (other := ends[0] if at == ends[1] else ends[1]) not in seen:
                seen.add(other)
                ways.append((other, [*names, name]))
    return []


def _open_mistake(scene: Scene, error: CannotAssembleError) -> Mistake:
    """A joint that can't close, or what is given that keeps it from closing."""
    joint = None if error.kind in _ELSEWHERE else scene.joints.get(error.joint)
    within = "revolute" if error.kind == "slide" else error.kind  # a body's hinge, or its stretch
    message, hint = _OPEN[within if joint is None else joint.type]
    gap = [f"{error.gap:.3g} m"] if error.gap > CLOSED or error.turn <= CLOSED else []
    missing = [*gap, *([f"{degrees(error.turn):.3g} deg"] if error.turn > CLOSED else [])]
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
    """Name the drive or the spring whose expression, or table, has no value at the start."""
    path: tuple[str | int, ...] = ("drives",)
    for name, drive in scene.drives.items():
        values = drive.value if isinstance(drive.value, tuple) else (drive.value,)
        if any(isinstance(one, Expression) and one.text == error.text for one in values):
            path = ("drives", name, "value")
    for name, spring in scene.springs.items():
        key = "force" if isinstance(spring, LinearSpring) else "torque"
        law = getattr(spring, key)
        if error.text == (law.text if isinstance(law, Expression) else name):
            path = ("springs", name, key)
    return Mistake(path, str(error), "as the mechanism starts")


def _speed_mistake(error: CannotMoveError) -> Mistake:
    """A drive or a speed at the start that joints, or others before it, do not allow."""
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
    """Drives that move as a run starts that should start at rest."""
    told = "moves at {:.4g} {} at first, so that nothing can start at rest"
    hint = "give it a 'ramp', or a formula that begins with speed 0"
    return [
        Mistake(("drives", own.name), told.format(speed, "m/s" if own.slide else "rad/s"), hint)
        for own in assembly.mechanism.speed_motors
        if (speed := own.speed.at(0.0)) != 0
    ]


def penetrations(scene: Scene, assembly: Assembly, resting: bool = False) -> list[Mistake]:
    """Contacts and bearings that start pressed: a start that no step size can mend.

    What starts `resting` may press; tables of forces still end.
    """
    found = [] if resting else list(_beyond_stops(scene, assembly))
    state = assembly.state
    for contact in assembly.mechanism.contacts:
        if contact.name not in scene.contacts:
            law, depth = contact.law, -float(approach(contact, state.q, state.v).gap)
            if isinstance(law, SpringTable) and depth > law.depths[-1]:
                message = f"the table ends {law.depths[-1]:.3g} m from 'length', it starts at "
                hint = "give the table more rows: no force is made up beyond them"
                path = ("springs", contact.name, "force")
                found.append(Mistake(path, f"{message}{depth:.3g} m", hint))
            continue
        at = approach(contact, state.q, state.v)
        # Farther behind than the face is long, it is beside it and may come round its end.
        if pressed_at(contact, at) and not resting:
            depth = -float(at.gap)
            message = f"starts with a penetration of {depth:.3g} m"
            found.append(Mistake(("contacts", contact.name), message, _apart(contact, depth)))
    for bearing in assembly.mechanism.bearings:
        gap = float(approach(bearing, state.q, state.v).gap)
        if gap < -TOUCHING and not resting:
            message = f"the journal starts {-gap:.3g} m inside its bearing's wall"
            hint = "check lengths and 'initial', or widen the clearance"
            found.append(Mistake(("joints", bearing.name), message, hint))
    return found


def _beyond_stops(scene: Scene, assembly: Assembly) -> Iterator[Mistake]:
    """Joints that start beyond their limits."""
    for contact in assembly.mechanism.contacts:
        stop = scene.stops.get(contact.name)
        gap = float(approach(contact, assembly.state.q, assembly.state.v).gap)
        if stop is not None and gap < -TOUCHING:
            place = stop.at + gap * (1.0 if stop.end == "from" else -1.0)
            way = "less" if stop.end == "from" else "more"
            message = f"'{stop.joint}' starts at {stop.told(place)}, {way} than its limit"
            hint = "whole turns count: " if stop.turns else ""
            key = "angles" if stop.turns else "along"
            hint += f"start it within its limits, see 'initial: {key}', or move the limit"
            yield Mistake(stop.path, message, hint)


def _apart(contact: Contact, depth: float) -> str:
    """What to do about a contact that starts pressed."""
    what = "line" if isinstance(contact, (FaceContact, FlatContact)) else "curve"
    other, away = f"choose the other 'side' of the {what}", "out"
    if isinstance(contact, CircleContact):
        other, away = "make a radius smaller", "apart"
    elif depth < ROUNDED:
        return f"what is meant to rest there may start that much above; or {other}"
    rests = "where both just touch: what rests there sinks in by itself"
    return f"start {depth:.3g} m farther {away}, {rests}; or {other}"


def pressed_walls(assembly: Assembly) -> list[Mistake]:
    """Links with clearance that start beyond a wall or a corner of their guide."""
    found, state = [], assembly.state
    for channel in assembly.mechanism.channels:
        depths = {
            contact.name.removeprefix(f"{channel.name}: "): -float(at.gap)
            for contact in (pairs(channel) if channel.clearance > 0 else ())
            for at in [approach(contact, state.q, state.v)]
            if 0 <= at.place <= contact.length and at.gap < -TOUCHING
        }
        if depths:
            pair, depth = max(depths.items(), key=lambda item: item[1])
            message = f"the link starts {depth:.3g} m inside its guide's walls: {pair}"
            hint = "turn the link under 'initial: angles', or widen the clearance"
            found.append(Mistake(("joints", channel.name), message, hint))
    return found


def outside_guides(scene: Scene, assembly: Assembly) -> list[Mistake]:
    """Links that start wholly outside their guides, where nothing holds a link."""
    told = "the link starts outside its guide, {:.3g} of the guide's length away"
    hint = "check lengths, places, and the units of curves; or say 'initial: along'"
    return [
        Mistake(("joints", name), told.format(far), hint)
        for name, low, high in in_guides(scene, assembly.mechanism, assembly.state.q)
        if (far := max(float(low) - 1, -float(high))) > CLOSED
    ]


def without_direction(scene: Scene, assembly: Assembly) -> list[Mistake]:
    """Springs whose ends meet at the start, though they have a length: they act in no direction."""
    found = []
    for spring in assembly.mechanism.linear_springs:
        if spring.slide is not None:
            continue
        spec, q = scene.springs[spring.name], assembly.state.q
        apart = anchor_position(spring.second, q) - anchor_position(spring.first, q)
        given = spec.length if isinstance(spec, LinearSpring) else 0.0
        if given != 0 and max(abs(apart)) <= CLOSED:
            message = "its ends meet at the start, where its force has no direction"
            hint = "'length: 0' for a spring that draws its ends together; else another place"
            found.append(Mistake(("springs", spring.name), message, hint))
    return found

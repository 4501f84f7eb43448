"""Whether the names in the sections initial, run and outputs lead to what is needed there."""

from __future__ import annotations

from collections.abc import Iterator

from exudyn_flexlink.scene.base import GROUND
from exudyn_flexlink.scene.curve_specs import LapsSpec
from exudyn_flexlink.scene.forces import SpeedDrive
from exudyn_flexlink.scene.joints import RevoluteJoint, SlotJoint, WeldJoint
from exudyn_flexlink.scene.lookup import Lookup, valid
from exudyn_flexlink.source import Mistake


def initial(look: Lookup) -> Iterator[Mistake]:
    """Refuse bodies and joints in initial that are none."""
    for key in ("positions", "angles", "guesses", "speeds", "velocities", "states"):
        for body in getattr(look.parts.initial, key, ()):
            for found in look.missing(("initial", key, body), "bodies", body):
                yield Mistake(found.path, found.message, found.hint, on_key=True)
    for key in ("along", "speeds_along"):
        for joint in getattr(look.parts.initial, key, ()):
            if key == "speeds_along" and isinstance(look.get("joints", joint), SlotJoint):
                continue
            for found in look.sliding(("initial", key, joint), joint, play=True):
                yield Mistake(found.path, found.message, found.hint, on_key=True)

    yield from _laps(look)
    yield from _missing_states(look)
    yield from _unfinished_ramps(look)


def _laps(look: Lookup) -> Iterator[Mistake]:
    """Refuse laps of what is no slot, or of a curve that has none, and lap 0."""
    for joint, lap in (look.parts.initial.laps if look.parts.initial else {}).items():
        path = ("initial", "laps", joint)
        yield from look.missing(path, "joints", joint)
        slot = look.get("joints", joint)
        if slot is None:
            continue
        if not isinstance(slot, SlotJoint):
            yield Mistake(path, f"'{joint}' is no slot", on_key=True)
            continue
        curve = look.get("curves", slot.curve)
        if lap == 0:
            yield Mistake(path, "there is no lap 0", "before lap 1 is lap -1")
        elif curve is not None and lap != 1 and not isinstance(curve, LapsSpec):
            yield Mistake(path, f"the curve '{slot.curve}' has no laps", "leave it out")


def _missing_states(look: Lookup) -> Iterator[Mistake]:
    """Refuse states of some bodies alone."""
    given = look.parts.initial.states if look.parts.initial else {}
    for body in look.parts.bodies or {}:
        if given and body not in given:
            yield Mistake(("initial", "states"), f"missing '{body}'", "states are of all bodies")


def _unfinished_ramps(look: Lookup) -> Iterator[Mistake]:
    """Refuse a start in the middle of a drive's ramp."""
    clock = look.parts.initial.clock if look.parts.initial else 0.0
    for name, drive in valid(look.parts.drives):
        ramp = getattr(drive, "ramp", 0.0)
        if 0 < clock < ramp:
            message = f"the drive '{name}' comes up to its value until {ramp:g} s"
            yield Mistake(("initial", "clock"), message, f"0, or at least {ramp:g} s")


def run(look: Lookup) -> Iterator[Mistake]:
    """Refuse a joint whose turns can never end the run."""
    run = look.parts.run
    if run is None or run.of is None:
        return
    yield from look.revolute(("run", "of"), run.of)
    drives = look.parts.drives
    if run.at_most or drives is None or None in drives.values():
        return
    speeds = {
        drive.joint: (name, drive.value)
        for name, drive in valid(drives)
        if isinstance(drive, SpeedDrive) and isinstance(drive.value, float)
    }
    driver, speed = speeds.get(run.of, (None, 0.0))
    if driver is not None and speed == 0:
        hint = f"another speed, or 'run: at_most' to end without the turns of '{run.of}'"
        yield Mistake(("drives", driver, "value"), "a joint at rest makes no turns", hint)
    if driver is None and isinstance(look.get("joints", run.of), RevoluteJoint):
        hint = f"no drive gives '{run.of}' a constant speed, so the turns may never be reached"
        yield Mistake(("run",), "missing 'at_most'", hint, on_key=True)


def outputs(look: Lookup) -> Iterator[Mistake]:
    """Refuse a watched point that is none, or never moves."""
    point = look.parts.outputs.watch if look.parts.outputs else None
    if point is None:
        return
    path = ("outputs", "watch")
    yield from look.point(path, point)
    for name, joint in valid(look.parts.joints):
        played = isinstance(joint, RevoluteJoint) and joint.clearance > 0
        pinned = isinstance(joint, (RevoluteJoint, WeldJoint)) and not played
        if pinned and {point, GROUND} == {*joint.points}:
            message = f"'{point}' never moves: the joint '{name}' holds it on the ground"
            yield Mistake(path, message, "errors are judged by this point; watch another one")

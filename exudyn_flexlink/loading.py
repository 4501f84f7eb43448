"""Model file to scene: read, checked in every part, and able to be put together."""

from __future__ import annotations

from collections.abc import Iterable
from math import degrees, inf
from pathlib import Path

from exudyn_flexlink.expressions import Expression, NoValueError
from exudyn_flexlink.mechanism import (
    Assembly,
    CannotAssembleError,
    CannotMoveError,
    Channel,
    CircleContact,
    Contact,
    Mechanism,
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
    face_length,
    formulation,
    least_tolerance,
    on_the_contact,
    other_branches,
    pairs,
    sample_bytes,
)
from exudyn_flexlink.scene import LinearSpring, Scene, apply_settings, check_document
from exudyn_flexlink.source import Document, Mistake, SceneError, load_document

CLOSED = 1e-9  # m or rad: less is not worth a word
MOST_MEMORY = 4_000_000_000  # bytes that samples may take: what is left on a computer with 8 GB
TOUCHING = 1e-12  # m: a gap smaller than rounding is contact without penetration


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
    "drive": ("drives",),
}
"""Where in the file those stand that are no joints."""


def load_scene(
    path: str | Path, settings: Iterable[str] = (), allow_outside: bool = False
) -> Scene:
    """Read a model file and check it whole.

    `settings` such as ``"run.turns=2"`` replace values of the file. `allow_outside` lets CSV files
    lie outside the model's folder.

    Raises:
        SceneError: the file has mistakes; all that can be seen at once are in it.

    """
    return scene_of(load_document(Path(path)), settings, allow_outside)


def require_length(name: str, length: float | None, scene: Scene) -> None:
    """Refuse a length, such as an error that is allowed, that no two runs of a scene can keep.

    Raises:
        ImpossibleLengthError: rounding is larger, or the mechanism smaller.

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
    """A length asked for beside the scene can't be kept; the text says which, and what can."""


def scene_of(
    document: Document, settings: Iterable[str] = (), allow_outside: bool = False
) -> Scene:
    """Check a document that is already read; see `load_scene`."""
    checked = check_document(apply_settings(document, settings), allow_outside)
    scene = checked.to_scene(others=build_curves(checked.curves)[1])
    assembly = assemble_scene(scene)
    beyond = [*_samples_mistakes(scene, assembly), *_tolerance_mistakes(scene, assembly)]
    if beyond:
        raise SceneError(scene.document, beyond)
    return scene


def assemble_scene(scene: Scene) -> Assembly:
    """Put the scene's mechanism together at time 0.

    Raises:
        SceneError: a curve can't be, joints can't close, speeds contradict joints, or a contact
            starts with penetration.

    """
    try:
        mechanism = build_mechanism(scene)
        undriven = drive_mistakes(mechanism, end_of_run(scene, mechanism))
        if undriven:
            raise SceneError(scene.document, undriven)
        assembly = assemble(mechanism, _start(scene, mechanism))
    except NoValueError as error:
        raise SceneError(scene.document, [_value_mistake(scene, error)]) from error
    except CannotAssembleError as error:
        raise SceneError(scene.document, [_open_mistake(scene, error)]) from error
    except CannotMoveError as error:
        raise SceneError(scene.document, [_speed_mistake(mechanism, error)]) from error
    mistakes = [
        *_penetrations(assembly),
        *_pressed_walls(assembly),
        *_redundancies(scene, assembly),
        *_without_direction(scene, assembly),
    ]
    if mistakes:
        raise SceneError(scene.document, mistakes)
    return assembly


def other_ways(scene: Scene, assembly: Assembly) -> list[dict[str, float]]:
    """Other ways in which the joints close at time 0, found by a few searches.

    Each is the angle (rad) of every body, of a flexible one that of its first rod.
    """
    mechanism = assembly.mechanism
    found = other_branches(assembly, _start(scene, mechanism))
    bodies = mechanism.bodies.items()
    return [{body: float(angles[parts[0]]) for body, parts in bodies} for angles in found]


def _samples_mistakes(scene: Scene, assembly: Assembly) -> list[Mistake]:
    """A sampling interval so short that the samples would not fit into memory."""
    run = scene.run
    if run.sample is None:  # then samples are thinned
        return []
    end, each = end_of_run(scene, assembly.mechanism), sample_bytes(assembly.mechanism)
    most, count = MOST_MEMORY // each, end / run.sample
    if count <= most:
        return []
    message = (
        f"would keep {count:.2g} samples, {count * each / 1e9:.2g} GB; {most} of {each} bytes fit "
        f"into {MOST_MEMORY / 1e9:.0f} GB"
    )
    shorter = "run.duration" if run.turns is None else "run.turns"
    hint = f"a run.sample of at least {end / most:.2g} s, or a smaller {shorter}"
    return [Mistake(("run", "sample"), message, hint)]


def _tolerance_mistakes(scene: Scene, assembly: Assembly) -> list[Mistake]:
    """A tolerance that no run can keep, since numbers are rounded."""
    least, asked = least_tolerance(assembly), scene.accuracy.tolerance
    if asked is None or asked >= least:
        return []
    far = f"numbers are rounded, in a mechanism that reaches {extent(assembly):.2g} m"
    message = f"{asked:g} m is less than rounding allows"
    return [Mistake(("accuracy", "tolerance"), message, f"at least {least:g} m: {far}")]


def _start(scene: Scene, mechanism: Mechanism) -> Start:
    initial = scene.initial

    def by_part(values: dict[str, float]) -> dict[int, float]:
        return {part: x for body, x in values.items() for part in mechanism.parts_of(body)}

    return Start(
        by_part(dict(initial.angles)),
        by_part(dict(initial.guesses)),
        by_part(dict(initial.speeds)),
        {mechanism.parts_of(body)[0]: v for body, v in initial.velocities.items()},
        {mechanism.parts_of(body)[0]: x for body, x in initial.positions.items()},
    )


def _path_of(scene: Scene, joint: str) -> tuple[str | int, ...]:
    """Place in the file of a joint, or of the flexible body whose hinge it is."""
    if joint in scene.joints:
        return ("joints", joint)
    body = joint.split(" hinge ", maxsplit=1)[0]
    return ("bodies", body) if body in scene.bodies else ()


def _open_mistake(scene: Scene, error: CannotAssembleError) -> Mistake:
    joint = scene.joints.get(error.joint)  # None: a hinge of a body
    message, hint = _OPEN[error.kind if joint is None else joint.type]
    missing = []
    if error.gap > CLOSED:
        missing.append(f"{error.gap:.3g} m")
    if error.turn > CLOSED:
        missing.append(f"{degrees(error.turn):.3g} deg")
    path = _path_of(scene, error.joint)
    if error.kind in _ELSEWHERE:
        path = (*_ELSEWHERE[error.kind], error.joint)
    return Mistake(path, f"{message}: {' and '.join(missing)} missing", hint)


def _value_mistake(scene: Scene, error: NoValueError) -> Mistake:
    """Name the drive whose expression has no value at the start."""
    path: tuple[str | int, ...] = ("drives",)
    for name, drive in scene.drives.items():
        values = drive.value if isinstance(drive.value, tuple) else (drive.value,)
        if any(isinstance(one, Expression) and one.text == error.text for one in values):
            path = ("drives", name, "value")
    return Mistake(path, str(error), "as the mechanism starts")


def _speed_mistake(mechanism: Mechanism, error: CannotMoveError) -> Mistake:
    if error.part is None:
        return Mistake(
            ("drives", str(error.drive)),
            "the mechanism can't follow this drive at the start: joints or other drives block it",
            "a dead centre, or two drives of one freedom; start at another angle",
        )
    body = mechanism.parts[error.part].body
    turning = error.axis == 2
    return Mistake(
        ("initial", "speeds" if turning else "velocities", body),
        f"this {'speed' if turning else 'velocity'} contradicts the joints, the drives or the "
        "speeds above",
        "leave out what follows from others",
    )


def _penetrations(assembly: Assembly) -> list[Mistake]:
    """Contacts and bearings that start pressed: a start that no step size can mend."""
    found = []
    state = assembly.state
    for contact in assembly.mechanism.contacts:
        at = approach(contact, state.q, state.v)
        deepest, hint = _deepest_start(contact)
        if on_the_contact(contact, float(at.place)) and -deepest < at.gap < -TOUCHING:
            message = f"starts with a penetration of {-float(at.gap):.3g} m"
            found.append(Mistake(("contacts", contact.name), message, hint))
    for bearing in assembly.mechanism.bearings:
        gap = float(approach(bearing, state.q, state.v).gap)
        if gap < -TOUCHING:
            message = f"the journal starts {-gap:.3g} m inside its bearing's wall"
            hint = "check lengths and 'initial', or widen the clearance"
            found.append(Mistake(("joints", bearing.name), message, hint))
    return found


def _deepest_start(contact: Contact) -> tuple[float, str]:
    """Penetration (m) from which on a start is no slip, and what to do about one that is."""
    if isinstance(contact, CircleContact):
        return inf, "move one of the bodies, or make a radius smaller"
    # Farther behind than the face is long, it is beside it and may come round its end.
    return face_length(contact), "move the body away, or choose the other 'side' of the line"


def _pressed_walls(assembly: Assembly) -> list[Mistake]:
    """Links with clearance that start beyond a wall or a corner of their guide."""
    found = []
    for channel in assembly.mechanism.channels:
        pressed = _deepest(assembly, channel) if channel.clearance > 0 else None
        if pressed is not None:
            pair, depth = pressed
            found.append(
                Mistake(
                    ("joints", channel.name),
                    f"the link starts {depth:.3g} m inside its guide's walls: {pair}",
                    "turn the link under 'initial: angles', or widen the clearance",
                )
            )
    return found


def _deepest(assembly: Assembly, channel: Channel) -> tuple[str, float] | None:
    """Pair that starts deepest in a wall or a corner, and its penetration in m; None without."""
    state = assembly.state
    depths = {}
    for contact in pairs(channel):
        at = approach(contact, state.q, state.v)
        if 0 <= at.place <= face_length(contact) and at.gap < -TOUCHING:
            depths[contact.name.removeprefix(f"{channel.name}: ")] = -float(at.gap)
    return max(depths.items(), key=lambda item: item[1], default=None)


def _without_direction(scene: Scene, assembly: Assembly) -> list[Mistake]:
    """Springs whose ends meet at the start, though they have a length: they act in no direction."""
    found = []
    for spring in assembly.mechanism.linear_springs:
        if spring.along_slide:
            continue
        spec, q = scene.springs[spring.name], assembly.state.q
        apart = anchor_position(spring.second, q) - anchor_position(spring.first, q)
        given = spec.length if isinstance(spec, LinearSpring) else 0.0
        if given != 0 and max(abs(apart)) <= CLOSED:
            message = "its ends meet at the start, where its force has no direction"
            hint = "'length: 0' for a spring that draws its ends together; else another place"
            found.append(Mistake(("springs", spring.name), message, hint))
    return found


def _may_be_redundant(scene: Scene, assembly: Assembly) -> bool:
    """Tell whether joints that others imply always can be left out: in minimal coordinates.

    Not those of a structure that nothing can move, nor drives.
    """
    moves = assembly.degrees_of_freedom > 0 or assembly.mechanism.speed_motors
    drives = set(scene.drives) & set(assembly.surplus)
    if not (assembly.surplus and moves) or drives:
        return False
    if formulation(scene) != "minimal":
        return False
    return always_redundant(assembly)


def _redundancies(scene: Scene, assembly: Assembly) -> list[Mistake]:
    """Joints and drives that hold what others hold already: forces in them have no one answer."""
    if _may_be_redundant(scene, assembly):
        return []
    found = []
    for name, count in assembly.surplus.items():
        drive = name in scene.drives and name not in scene.joints
        what = "drive" if drive else "joint" if name in scene.joints else "body's hinge"
        times = "" if count == 1 else f" {count} times"
        found.append(
            Mistake(
                ("drives", name) if drive else _path_of(scene, name),
                f"this {what} holds{times} what others hold already",
                "two joints do the same, two drives move one freedom, or the mechanism starts at "
                "a dead centre: take one away, or start at another angle",
            )
        )
    return found

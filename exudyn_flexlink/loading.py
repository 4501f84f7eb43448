"""Model file to scene: read, checked in every part, and able to be put together."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from exudyn_flexlink.mechanism import (
    Assembly,
    CannotAssembleError,
    CannotMoveError,
    Mechanism,
    Start,
    approach,
    assemble,
    build_mechanism,
    face_length,
)
from exudyn_flexlink.scene import Scene, apply_settings, parse_scene
from exudyn_flexlink.source import Document, Mistake, SceneError, load_document

TOUCHING = 1e-12  # m: a gap smaller than rounding is contact without penetration


@dataclass(frozen=True)
class _Open:
    """In the reader's words, what a joint that can't close leaves open."""

    message: str
    hint: str


_OPEN = {
    "slot": _Open(
        "the point can't be on its curve at the start: it stays {gap:.3g} m off",
        "move the curve, the joint that carries the point, or give another initial angle",
    ),
    "revolute": _Open(
        "the joint can't close at the start: its points stay {gap:.3g} m apart",
        "check lengths and places; under 'initial: guesses' say roughly where the bodies stand",
    ),
    "weld": _Open(
        "the weld can't close at the start: {gap:.3g} (m, rad) stay open",
        "check places and angles of the two bodies, and 'initial: angles'",
    ),
    "sleeve": _Open(
        "the link can't lie in its guide at the start: {gap:.3g} (m, rad) stay open",
        "check the angles of guide and link under 'initial: angles'",
    ),
}


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


def scene_of(
    document: Document, settings: Iterable[str] = (), allow_outside: bool = False
) -> Scene:
    """Check a document that is already read; see `load_scene`."""
    scene = parse_scene(apply_settings(document, settings), allow_outside)
    assemble_scene(scene)
    return scene


def assemble_scene(scene: Scene) -> Assembly:
    """Put the scene's mechanism together at time 0.

    Raises:
        SceneError: a curve can't be, joints can't close, speeds contradict joints, or a contact
            starts with penetration.

    """
    mechanism = build_mechanism(scene)
    try:
        assembly = assemble(mechanism, _start(scene, mechanism))
    except CannotAssembleError as error:
        words = _OPEN[error.kind]
        path = _path_of(scene, error.joint)
        mistake = Mistake(path, words.message.format(gap=error.gap), words.hint)
        raise SceneError(scene.document, [mistake]) from error
    except CannotMoveError as error:
        raise SceneError(scene.document, [_speed_mistake(scene, error)]) from error
    mistakes = [*_penetrations(assembly), *_redundancies(assembly)]
    if mistakes:
        raise SceneError(scene.document, mistakes)
    return assembly


def _start(scene: Scene, mechanism: Mechanism) -> Start:
    initial = scene.initial

    def by_part(values: dict[str, float]) -> dict[int, float]:
        return {part: x for body, x in values.items() for part in mechanism.parts_of(body)}

    return Start(
        by_part(dict(initial.angles)),
        by_part(dict(initial.guesses)),
        by_part(dict(initial.speeds)),
    )


def _path_of(scene: Scene, joint: str) -> tuple[str | int, ...]:
    """Place in the file of a joint, or of the flexible body whose hinge it is."""
    if joint in scene.joints:
        return ("joints", joint)
    body = joint.split(" hinge ", maxsplit=1)[0]
    return ("bodies", body) if body in scene.bodies else ()


def _speed_mistake(scene: Scene, error: CannotMoveError) -> Mistake:
    if error.kind == "drive":
        return Mistake(
            ("drives", error.joint),
            "the mechanism can't follow this drive at the start: another joint blocks it",
            "a dead centre, or two drives of one freedom; start at another angle",
        )
    if error.kind == "speed":
        return Mistake(
            ("initial", "speeds"),
            "these speeds contradict the joints or the drives",
            "leave out the speeds that follow from others",
        )
    return Mistake(
        _path_of(scene, error.joint), "the speeds given at the start tear this joint apart"
    )


def _penetrations(assembly: Assembly) -> list[Mistake]:
    """Contacts whose point starts beyond its face: a start that no step size can mend."""
    found = []
    state = assembly.state
    for contact in assembly.mechanism.contacts:
        at = approach(contact, state.q, state.v)
        inside = 0 <= at.place <= face_length(contact)
        # Far behind the face is beside it, not in it: only a shallow start can be a slip.
        if inside and -0.1 * face_length(contact) < at.gap < -TOUCHING:
            found.append(
                Mistake(
                    ("contacts", contact.name),
                    f"starts with a penetration of {-float(at.gap):.3g} m",
                    "move the body away, or choose the other 'side' of the line",
                )
            )
    return found


def _redundancies(assembly: Assembly) -> list[Mistake]:
    if not assembly.redundant:
        return []
    free = assembly.degrees_of_freedom
    return [
        Mistake(
            ("joints",),
            f"the joints and drives give {assembly.redundant} more constraint(s) than the bodies "
            f"can take ({free} degree(s) of freedom remain)",
            "two joints do the same, two drives move one freedom, or the mechanism starts at a "
            "dead centre: take one away, or start at another angle",
        )
    ]

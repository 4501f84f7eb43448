"""Model file to scene: read, checked in every part, and able to be put together."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import replace
from math import inf
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.assembly_mistakes import (
    NO_START,
    moving_drives,
    outside_guides,
    penetrations,
    pressed_walls,
    start_mistake,
    without_direction,
)
from exudyn_flexlink.joint_mistakes import geared_badly, redundancies, rubbing_badly
from exudyn_flexlink.mechanism import (
    Assembly,
    Mechanism,
    Rest,
    Start,
    assemble,
    build_curves,
    build_mechanism,
    drive_mistakes,
    end_of_run,
    extent,
    least_tolerance,
    other_branches,
    rest_of,
    sample_bytes,
    with_pulses,
)
from exudyn_flexlink.once import once_for_each
from exudyn_flexlink.scene import Scene, apply_settings, check_document
from exudyn_flexlink.settings import Setting
from exudyn_flexlink.source import Document, Mistake, SceneError, load_document, parse_document

MOST_MEMORY = 4_000_000_000  # bytes that samples may take: what is left on a computer with 8 GB
WIDTH = 100  # columns of a model file that is written
SHORTEST_RUN = 1e-9  # s: ten thousand times what the numerical methods tell apart


def load_scene(
    path: str | Path, settings: Iterable[Setting] = (), allow_outside: bool = False
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
    document: Document, settings: Iterable[Setting] = (), allow_outside: bool = False
) -> Scene:
    """Check a document that is already read; see `load_scene`."""
    checked = check_document(apply_settings(document, settings), allow_outside)
    scene = checked.to_scene(others=build_curves(checked.curves)[1])
    assembly = assemble_scene(scene)
    beyond = [*run_mistakes(scene), *_tolerance_mistakes(scene, assembly)]
    if beyond:
        raise SceneError(scene.document, beyond)
    return scene


def document_of(scene: Scene) -> Document:
    """Return the document that says what a scene is.

    That which it was read from, where its places are known; of one changed since, its own data.
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
    """Return plain data as a document called `name`; files that it names are looked for here.

    Raises:
        SceneError: it is no mapping of sections.
        TypeError: it holds what no model can.

    """
    text = json.dumps(data, indent=2, ensure_ascii=False, default=plain_data)
    read = parse_document(text, name, Path.cwd())
    return replace(read, data=json.loads(text))  # YAML tells places; to it a line may end at \x85


def plain_data(value: Any) -> Any:
    """Turn what JSON does not know into what it does: numpy's numbers and arrays, paths.

    Raises:
        TypeError: it is none of these.

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
    """Put the scene's mechanism together at time 0, or where it is at rest.

    Once for each scene: both are frozen, and a scene that was loaded has been put together already.

    Raises:
        SceneError: a curve can't be, joints can't close, speeds contradict joints, a contact
            starts with penetration, or a link outside its guide; or there is no rest.

    """
    resting = scene.initial.at_rest
    assembly = rest_of_scene(scene).assembly if resting else _put_together(scene)
    mistakes = moving_drives(assembly) if resting else _start_mistakes(scene, assembly)
    if mistakes:
        raise SceneError(scene.document, mistakes)
    end = end_of_run(scene, assembly.mechanism)
    return with_pulses(assembly, scene.accuracy.tolerance, end)


@once_for_each
def rest_of_scene(scene: Scene) -> Rest:
    """Find where all forces balance, from the start on, while drives hold what they have then.

    Raises:
        SceneError: as of `assemble_scene`; or nothing balances.

    """
    assembly = _put_together(scene)
    try:
        rest = rest_of(assembly)
    except NO_START as error:
        raise SceneError(scene.document, [start_mistake(scene, error)]) from error
    mistakes = _start_mistakes(scene, rest.assembly, resting=True)
    if mistakes:
        raise SceneError(scene.document, mistakes)
    return rest


def _put_together(scene: Scene) -> Assembly:
    try:
        mechanism = build_mechanism(scene)
        undriven = drive_mistakes(mechanism, end_of_run(scene, mechanism))
        if undriven:
            raise SceneError(scene.document, undriven)
        return assemble(mechanism, _start(scene, mechanism))
    except NO_START as error:
        raise SceneError(scene.document, [start_mistake(scene, error)]) from error


def _start_mistakes(scene: Scene, assembly: Assembly, resting: bool = False) -> list[Mistake]:
    """What can't be at time 0; where it is `resting`, contacts may press."""
    return [
        *penetrations(scene, assembly, resting),
        *(() if resting else pressed_walls(assembly)),
        *outside_guides(scene, assembly),
        *redundancies(scene, assembly),
        *without_direction(scene, assembly),
        *rubbing_badly(assembly),
        *geared_badly(scene, assembly),
    ]


def other_ways(scene: Scene, assembly: Assembly) -> list[dict[str, float]]:
    """Other ways in which the joints close at time 0, found by a few searches.

    Each is the angle (rad) of every body, of a flexible one that of its first rod. A scene that
    gives all states means this one way.
    """
    if scene.initial.states:
        return []
    mechanism = assembly.mechanism
    found = other_branches(assembly, _start(scene, mechanism))
    bodies = mechanism.bodies.items()
    return [{body: float(angles[parts[0]]) for body, parts in bodies} for angles in found]


def run_mistakes(scene: Scene) -> list[Mistake]:
    """Return what keeps a run from being made: it ends at once, or samples don't fit into memory.

    Raises:
        SceneError: the scene can't be put together.

    """
    mechanism = assemble_scene(scene).mechanism
    run, end, each = scene.run, end_of_run(scene, mechanism), sample_bytes(mechanism)
    if end < SHORTEST_RUN:
        key = "turns" if run.duration is None else "duration"
        message = f"the run would last {end:.2g} s, which is too short to be solved"
        return [Mistake(("run", key), message, f"it must last {SHORTEST_RUN:g} s or longer")]
    if run.sample is None:  # then samples are thinned
        return []
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
    """A tolerance that no run can keep, or a step that no clock shows: numbers are rounded."""
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
        SceneError: a body has more parts, or less, than are given.

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

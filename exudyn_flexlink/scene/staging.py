"""The scene of each stage of a run: the scene before with the changes of the stage."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from exudyn_flexlink.scene.model import Scene, check_document
from exudyn_flexlink.scene.run import INITIAL_OF_JOINTS
from exudyn_flexlink.scene.stages import CHANGING, Stage, at_first
from exudyn_flexlink.source import Document, Mistake, SceneError, did_you_mean, dotted


def stage_scenes(scene: Scene) -> list[Scene]:
    """Return the scenes of all stages in order, as far as they are known before a run.

    Raises:
        SceneError: a stage can't be made; see `after_stage`.

    """
    scenes = [first_stage(scene)]
    while scenes[-1].stages:
        scenes.append(after_stage(scenes[-1], number=len(scenes)))
    return scenes


def whole_scene(scene: Scene) -> Scene:
    """Return a scene with the parts of all its stages, so that a result's names are all in it.

    It runs like the scene itself, since `first_stage` takes the added parts out again.
    """
    sections = {section: dict(getattr(scene, section)) for section in CHANGING}
    for stage in scene.stages:
        for section, parts in sections.items():
            for name, part in getattr(stage.add, section).items():
                parts.setdefault(name, part)
    return scene.changed(**sections) if scene.stages else scene


def first_stage(scene: Scene) -> Scene:
    """Return a scene without the parts that later stages add."""
    sections = {key: at_first(key, getattr(scene, key), scene.stages) for key in CHANGING}
    fewer = any(len(parts) < len(getattr(scene, key)) for key, parts in sections.items())
    return scene.changed(**sections) if fewer else scene


def after_stage(
    scene: Scene, angles: Mapping[str, float] | None = None, *, number: int = 1
) -> Scene:
    """Return the scene after the first of its `stages`; the later stages remain in it.

    A weld or slide that the stage adds without an angle gets it from `angles` (rad). `number` is
    the stage's number in the whole run, for messages.

    Raises:
        SceneError: the stage removes a part that does not exist, or adds one that exists already;
            or the new scene has mistakes.

    """
    data, stage = scene.to_data(), scene.stages[0]
    changes = data["stages"].pop(0)
    mistakes = list(_change(data, changes))
    for name, angle in (angles or {}).items():
        data["joints"][name]["angle"] = angle
    # The stage begins with a state of the run. It drops start values of joints that it removes.
    joints = data.get("joints", {})
    for key in INITIAL_OF_JOINTS:
        given = data["initial"].get(key, {})
        data["initial"][key] = {name: x for name, x in given.items() if name in joints}
    if not mistakes:
        checked = check_document(Document(scene.document.name, data=data))
        mistakes = [_within(mistake, stage) for mistake in checked.mistakes]
    if mistakes:
        in_stage = [replace(x, path=("stages", number - 1, *x.path)) for x in mistakes]
        raise SceneError(scene.document, in_stage)
    return Scene.from_parts(checked.sections, scene.document)


def _change(data: dict[str, Any], changes: Mapping[str, Any]) -> Iterator[Mistake]:
    """Change a scene's plain data as a stage does; the paths of mistakes begin at the stage."""
    for k, name in enumerate(changes.get("remove", ())):
        section, _, part = name.partition(".")
        if section not in CHANGING:
            hint = f"{' or '.join(CHANGING)}, a dot, and a name; bodies stay"
            yield Mistake(("remove", k), f"'{name}' can't be removed", hint)
        elif data.get(section, {}).pop(part, None) is None:
            yield Mistake(("remove", k), *_unknown(part, section, data))
    for section, parts in changes.get("add", {}).items():
        for name, part in parts.items():
            if name in data.setdefault(section, {}):
                message = f"there is '{name}' among {section} already"
                hint = "another name; or remove it in this stage"
                yield Mistake(("add", section, name), message, hint, on_key=True)
            data[section][name] = part
    for key, value in changes.get("set", {}).items():
        yield from _set(data, key, value)


def _set(data: dict[str, Any], key: str, value: Any) -> Iterator[Mistake]:
    """Give one key of a scene's plain data another value."""
    if key == "gravity":
        data[key] = value
        return
    section, *names = key.split(".")
    if section not in CHANGING or not names[1:]:  # a path needs a part and its key
        hint = f"{' or '.join(CHANGING)}, a name and a key, with dots between; or gravity"
        yield Mistake(("set", key), f"'{key}' can't be set", hint, on_key=True)
        return
    if names[0] not in data.get(section, {}):
        yield Mistake(("set", key), *_unknown(names[0], section, data), on_key=True)
        return
    part = data[section]
    for name in names[:-1]:
        inner = part.get(name)
        part[name] = part = dict(inner) if isinstance(inner, Mapping) else {}
    part[names[-1]] = value


def _unknown(name: str, section: str, data: Mapping[str, Any]) -> tuple[str, str]:
    known = list(data.get(section, {}))
    hint = f"{section} then: {', '.join(known)}" if known else f"there are no {section} then"
    return f"no '{name}' among {section}{did_you_mean(name, known)}", hint


def _within(mistake: Mistake, stage: Stage) -> Mistake:
    """A mistake of a stage's scene, at the key of the stage that causes it."""
    path = mistake.path
    if len(path) > 1 and path[1] in getattr(stage.add, str(path[0]), {}):
        return replace(mistake, path=("add", *path))
    for key in stage.set:
        keys = tuple(key.split("."))
        if path[: len(keys)] == keys or keys[: len(path)] == path:
            return replace(mistake, path=("set", key))
    message = f"{dotted(path)}, as it is from this stage on: {mistake.message}"
    return Mistake((), message, mistake.hint)

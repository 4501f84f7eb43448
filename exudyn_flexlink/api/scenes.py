"""Scenes from a name, a file or a dict, and the same scenes with other values."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from html import escape
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from exudyn_flexlink import effects, loading
from exudyn_flexlink.once import hand_on
from exudyn_flexlink.scene import SECTION_OF
from exudyn_flexlink.scene import Scene as PlainScene
from exudyn_flexlink.settings import Setting
from exudyn_flexlink.shipped import known_names, model_file, model_names
from exudyn_flexlink.source import Document, Mistake, SceneError, did_you_mean, load_document


class Scene(PlainScene):
    """A mechanism, what drives it and how long it is to be simulated; frozen, in SI units.

    Its sections are attributes: ``scene.bodies["link"].length``.
    """

    def with_(self, changes: Mapping[str, Any]) -> Scene:
        """Return the scene with other values, by the paths of the model file.

        ``scene.with_({"joints.sleeve.clearance": "2 mm", "run.turns": 2})``: values are numbers,
        texts with units, lists or dicts; None takes a value away.

        Raises:
            SceneError: a path leads nowhere, or a value can't be; with a hint, as of `load_scene`.

        """
        return own_scene(loading.scene_of(loading.document_of(self), _settings(changes), True))

    def __repr__(self) -> str:
        return f"<Scene '{self.title}': {'; '.join(_parts(self))}>"

    def __str__(self) -> str:
        return repr(self)

    def _repr_html_(self) -> str:
        rows = "".join(f"<li>{escape(part)}</li>" for part in _parts(self))
        return f"<b>{escape(self.title)}</b><ul>{rows}</ul>"


def load_scene(
    model: str | PathLike[str] | Mapping[str, Any],
    changes: Mapping[str, Any] | Iterable[str] = (),
    *,
    allow_outside: bool = False,
    **settings: Any,
) -> Scene:
    """Load a scene: a model that comes with the program by name, a file, or a dict of sections.

    `settings` are keys of the sections accuracy, initial, run and solver: ``tolerance=1e-7``,
    ``turns=2``, ``formulation="redundant"``. `changes` are by path, as those of `Scene.with_`, or
    texts such as ``"run.turns=2"``. `allow_outside` lets CSV files lie outside the model's folder.

    Raises:
        SceneError: there is no such model, or it has mistakes: all of them, each with its place.
        TypeError: a setting that no section knows, or a dict that holds what no model can.

    """
    texts: list[Setting] = _settings(changes) if isinstance(changes, Mapping) else list(changes)
    texts += _settings({_path_of(key): value for key, value in settings.items()})
    return own_scene(loading.scene_of(_document(model), texts, allow_outside))


def idealise(scene: PlainScene, without: str | Iterable[str]) -> Scene:
    """Return the scene without some effects: clearance, flexibility, friction, damping, impact.

    Raises:
        ValueError: there is no such effect.
        SceneError: what is left can't be.

    """
    names = [without] if isinstance(without, str) else list(without)
    return own_scene(effects.idealise(given_scene(scene), names))


def given_scene(given: Any) -> PlainScene:
    """Return what was given as a scene.

    Raises:
        TypeError: it is none, but a file, a name or a dict, of which `load_scene` makes one.

    """
    if isinstance(given, PlainScene):
        return given
    if isinstance(given, str | PathLike):
        raise TypeError(f"expected a Scene; load_scene({fspath(given)!r}) makes one")
    hint = "; load_scene(..) makes one of a dict" if isinstance(given, Mapping) else ""
    raise TypeError(f"expected a Scene, got {type(given).__name__}{hint}")


def own_scene(found: PlainScene) -> Scene:
    """Return a scene with the methods of this room."""
    if isinstance(found, Scene):
        return found
    sections = {key: getattr(found, key) for key in PlainScene.model_fields}
    own = Scene.from_parts(sections, found.document)
    assert isinstance(own, Scene)
    hand_on(found, own)
    return own


def _document(model: str | PathLike[str] | Mapping[str, Any]) -> Document:
    if isinstance(model, Mapping):
        return loading.document_of_data(model, "the dict")
    path = Path(model)
    if isinstance(model, str) and not path.is_file():  # nor is a folder of that name a model
        shipped = model_file(model)
        if shipped is None and not path.suffix and not path.exists():
            near = did_you_mean(model, known_names())
            message = f"no such file, and no model of that name comes with the program{near}"
            first = ", ".join(name for name in model_names() if "/" not in name)
            hint = f"there are: {first}; exudyn_flexlink.model_names() tells all"
            mistake = Mistake((), message, hint)
            raise SceneError(Document(model), [mistake])
        path = shipped or path
    return load_document(path)


def _settings(changes: Mapping[str, Any]) -> list[Setting]:
    """Return changes by path as settings: values are plain data, never YAML to be read again."""
    return [(path, _plain(value)) for path, value in changes.items()]


def _plain(value: Any) -> Any:
    if isinstance(value, str):
        return str(value)
    return json.loads(json.dumps(value, default=loading.plain_data))


def _path_of(key: str) -> str:
    if key not in SECTION_OF:
        raise TypeError(
            f"no setting '{key}'{did_you_mean(key, SECTION_OF)}; by keyword there are: "
            f"{', '.join(SECTION_OF)}; others by their path: "
            "scene.with_({'joints.sleeve.clearance': '2 mm'})"
        )
    return f"{SECTION_OF[key]}.{key}"


def _parts(found: PlainScene) -> list[str]:
    """What a scene is made of, in words."""
    accuracy, run = found.accuracy, found.run
    length = f"{run.turns:g} turns of {run.of}" if run.turns is not None else f"{run.duration:g} s"
    if accuracy.tolerance is not None:
        error = f"tolerance {accuracy.tolerance:g} m"
    else:
        error = f"steps of {accuracy.step:g} s"
    kinds = ("bodies", "joints", "springs", "drives", "contacts")
    named = [f"{kind} {', '.join(getattr(found, kind))}" for kind in kinds if getattr(found, kind)]
    return [*named, length, error]

"""Scenes from a name, a file or a dict, the same with other values, and mechanisms at rest."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from html import escape
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from exudyn_flexlink import effects, loading
from exudyn_flexlink.api import with_methods
from exudyn_flexlink.arguments import among, excerpt, instance_of, place, plain, takes, values
from exudyn_flexlink.loading import rest_of_scene
from exudyn_flexlink.mechanism import Rest
from exudyn_flexlink.once import hand_on
from exudyn_flexlink.report import equilibrium_text, rest_text
from exudyn_flexlink.scene import SECTION_OF
from exudyn_flexlink.scene import Scene as PlainScene
from exudyn_flexlink.shipped import ENGINES, known_names, model_file, model_names
from exudyn_flexlink.source import (
    Document,
    KeyPath,
    Mistake,
    SceneError,
    Setting,
    did_you_mean,
    load_document,
)

ENGINE = among(lambda _: ENGINES, "engine")


def _changes(value: Any, _: Any = None) -> Mapping[str, Any]:
    """Take values by path."""
    if not isinstance(value, Mapping):
        raise TypeError(f"expected a dict such as {{'run.turns': 2}}, got {excerpt(value)}")
    for item in value:
        if not isinstance(item, str) or "=" in item or not all(map(str.strip, item.split("."))):
            raise ValueError(f"expected paths such as 'run.turns', got {excerpt(item)}")
    return value


def _changes_or_texts(value: Any, _: Any = None) -> Any:
    """Take values by path, or texts such as 'run.turns=2'."""
    if isinstance(value, Mapping):
        return _changes(value)
    if not isinstance(value, list | tuple) or not all(isinstance(text, str) for text in value):
        raise TypeError(f"expected a dict, or texts such as ['run.turns=2'], got {excerpt(value)}")
    return list(value)


def _model(value: Any, _: Any = None) -> Any:
    """Take what `load_scene` makes a scene of."""
    if isinstance(value, PlainScene | Mapping):
        return value
    if not isinstance(value, str | PathLike):
        raise TypeError(f"expected a name, a path, a dict or a Scene, got {excerpt(value)}")
    return value if place(value) and isinstance(value, str) else place(value)


def _effects(value: Any, _: Any = None) -> list[str]:
    """Take the name of an effect, or some."""
    known = among(lambda _: effects.EFFECTS, "effect")
    return [
        known(effect, None) for effect in ([value] if isinstance(value, str) else values(value))
    ]


class Scene(PlainScene):
    """A mechanism, what drives it and how long it is to be simulated; frozen, in SI units.

    Its sections are attributes: ``scene.bodies["link"].length``.
    """

    def __init__(self, **sections: Any) -> None:
        """Put checked parts together; `load_scene` makes a scene of plain data.

        Raises:
            TypeError: a part is none of a scene.

        """
        try:
            super().__init__(**sections)
        except ValidationError:
            expected = f"expected parts of a scene, got {', '.join(sections) or 'nothing'}"
            raise TypeError(f"{expected}; load_scene(..) makes scenes of plain data") from None

    @takes(changes=_changes)
    def with_(self, changes: Mapping[str, Any]) -> Scene:
        """Return the scene with other values, by the paths of the model file.

        ``scene.with_({"joints.sleeve.clearance": "2 mm", "run.turns": 2})``: values are numbers,
        texts with units, lists or dicts; None takes a value away.

        Raises:
            SceneError: a path leads nowhere, or a value can't be; with a hint, as of `load_scene`.

        """
        return _changed(self, _settings(changes))

    def to_dict(self) -> dict[str, Any]:
        """Return the sections as plain data in SI units, of which `load_scene` makes the scene."""
        return self.to_data()

    def to_yaml(self) -> str:
        """Return the text of a model file of the scene, in SI units.

        Points and tables that came from files are in it, comments of its own file are not.
        """
        return loading.yaml_of(self)

    def __dir__(self) -> list[str]:
        return [*PlainScene.model_fields, "to_dict", "to_yaml", "with_"]

    def __repr__(self) -> str:
        return f"<Scene '{self.title}': {'; '.join(_parts(self))}>"

    def __str__(self) -> str:
        return repr(self)

    def _repr_html_(self) -> str:
        rows = "".join(f"<li>{escape(part)}</li>" for part in _parts(self))
        return f"<b>{escape(self.title)}</b><ul>{rows}</ul>"


@takes(model=_model, changes=_changes_or_texts)
def load_scene(
    model: str | PathLike[str] | Mapping[str, Any] | PlainScene,
    changes: Mapping[str, Any] | Iterable[str] = (),
    *,
    allow_outside: bool = False,
    **settings: Any,
) -> Scene:
    """Load a scene: a model that comes with the program by name, a file, or a dict of sections.

    A model that is a scene already is returned, with the changes if there are any.

    `settings` are keys of the sections accuracy, initial, run and solver: ``tolerance=1e-7``,
    ``turns=2``, ``formulation="redundant"``. `changes` are by path, as those of `Scene.with_`, or
    texts such as ``"run.turns=2"``. `allow_outside` lets CSV files lie outside the model's folder.

    Raises:
        SceneError: there is no such model, or it has mistakes: all of them, each with its place.
        TypeError: a setting that no section knows, or a dict that holds what no model can.

    """
    texts: list[Setting] = _settings(changes) if isinstance(changes, Mapping) else list(changes)
    texts += _settings({_path_of(key): value for key, value in settings.items()})
    if isinstance(model, PlainScene):
        return _changed(model, texts, settings) if texts else api_scene(model)
    with _python_words(settings):
        return api_scene(loading.scene_of(_document(model), texts, allow_outside))


def given_scene(given: Any, _: Any = None) -> Any:
    """Take a scene. For a file, a name or a dict the error says which function makes a scene."""
    if isinstance(given, str | PathLike):
        raise TypeError(f"expected a Scene; load_scene({fspath(given)!r}) makes one")
    return instance_of(PlainScene, "load_scene(..) makes one" if given is not None else "")(
        given, None
    )


@takes(scene=given_scene, without=_effects)
def idealise(scene: PlainScene, without: str | Iterable[str]) -> Scene:
    """Return the scene without some effects: clearance, flexibility, friction, damping, impact.

    Raises:
        ValueError: there is no such effect.
        SceneError: what is left can't be.

    """
    return api_scene(effects.idealise(scene, without))


def api_scene(plain: PlainScene) -> Scene:
    """Return a scene with the methods of this room."""
    if isinstance(plain, Scene):
        return plain
    sections = {key: getattr(plain, key) for key in PlainScene.model_fields}
    scene = Scene.from_parts(sections, plain.document)
    assert isinstance(scene, Scene)
    hand_on(plain, scene)
    return scene


def _document(model: str | PathLike[str] | Mapping[str, Any]) -> Document:
    if isinstance(model, Mapping):
        return loading.document_of_data(_plain(model, "model"), "the dict")
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


def _changed(scene: PlainScene, settings: list[Setting], keywords: Collection[str] = ()) -> Scene:
    with _python_words(keywords):
        return api_scene(loading.scene_of(loading.document_of(scene), settings, True))


@contextmanager
def _python_words(keywords: Collection[str] = ()) -> Iterator[None]:
    """Let errors name settings by their paths, or by `keywords`, not as options of a shell."""
    try:
        yield
    except SceneError as error:
        short: dict[KeyPath, str] = {(SECTION_OF[key], key): key for key in keywords}
        mistakes = [
            replace(mistake, path=(short[mistake.path[:2]], *mistake.path[2:]))
            if mistake.path[:2] in short
            else mistake
            for mistake in error.mistakes
        ]
        given = dict.fromkeys([*error.document.settings, *((key,) for key in keywords)], "")
        raise SceneError(replace(error.document, settings=given), mistakes) from None


def _settings(changes: Mapping[str, Any]) -> list[Setting]:
    """Return changes by path as settings: values are plain data, never YAML to be read again."""
    return [(path, _plain(value, path)) for path, value in changes.items()]


def _plain(value: Any, name: str) -> Any:
    """Return a value as plain data, or raise TypeError where no model can hold it."""
    if isinstance(value, str):
        return str(value)
    try:
        return json.loads(json.dumps(value, default=_plain_entry))
    except (TypeError, ValueError, RecursionError) as error:
        why = str(error) if "can't hold" in str(error) else f"a model can't hold {excerpt(value)}"
        raise TypeError(f"{name}: {why}") from None


def _plain_entry(value: Any) -> Any:
    return plain(value) if hasattr(value, "to_base_units") else loading.plain_data(value)


def _path_of(key: str) -> str:
    if key not in SECTION_OF:
        raise TypeError(
            f"no setting '{key}'{did_you_mean(key, SECTION_OF)}; by keyword there are: "
            f"{', '.join(SECTION_OF)}; others by their path: "
            "scene.with_({'joints.sleeve.clearance': '2 mm'})"
        )
    return f"{SECTION_OF[key]}.{key}"


def _parts(plain: PlainScene) -> list[str]:
    """What a scene is made of, in words."""
    accuracy, run = plain.accuracy, plain.run
    length = f"{run.turns:g} turns of {run.of}" if run.turns is not None else f"{run.duration:g} s"
    if accuracy.tolerance is not None:
        error = f"tolerance {accuracy.tolerance:g} m"
    else:
        error = f"steps of {accuracy.step:g} s"
    kinds = ("bodies", "joints", "springs", "drives", "contacts")
    named = [f"{kind} {', '.join(getattr(plain, kind))}" for kind in kinds if getattr(plain, kind)]
    return [*named, length, error]


@dataclass(frozen=True, repr=False)
class Equilibrium(Rest):
    """A mechanism where all forces balance; frozen, in SI units.

    ``poses["arm"]`` is [x, y, angle] of a body (of a flexible one, of its rods) and
    ``points["arm.end"]`` the place of a point. ``forces["pin"]`` [x, y] N acts on the body of a
    joint's second point, as ``torques["weld"]`` N m does; ``drives["motor"]`` is what a drive holds
    (N m, or N), ``gears["mesh"]`` the tangential force of a gear or a belt (N; N m without pitch
    circles), and ``presses["floor"]`` N the force of a contact. Undamped small motions have the
    `frequencies` (Hz; 0: nothing resists), and it is `stable` unless one grows, at the rate
    `growth` (1/s); with dampers they have the exponents `damped` (1/s). `notes` tell what else is
    to be known, as of an unstable balance left.
    """

    scene: PlainScene

    def summary(self) -> str:
        """Return what ``check --equilibrium`` tells."""
        return equilibrium_text(self.scene, self)

    def __repr__(self) -> str:
        """Return one line: whether it is stable, and its lowest frequency."""
        moving = self.frequencies[self.frequencies > 0]
        lowest = f", lowest frequency {moving[0]:.5g} Hz" if len(moving) else ""
        return f"<Equilibrium of '{self.scene.title}': {rest_text(self)}{lowest}>"


@takes(scene=given_scene)
def equilibrium(scene: PlainScene) -> Equilibrium:
    """Find where all forces balance while drives hold what they have at time 0.

    It is searched downhill from the assembled start, whether or not the scene says
    ``initial: {at_rest: true}``. Dry friction and dampers do nothing there.

    Raises:
        SceneError: nothing balances, or only a contact by impulse could hold it.

    """
    return with_methods(Equilibrium, rest_of_scene(scene), scene=scene)

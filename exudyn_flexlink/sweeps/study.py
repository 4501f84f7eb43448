"""A file that describes a sweep: a model, what varies in it, and who solves it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, Strict, TypeAdapter, ValidationError

from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.scene.base import Part, Text
from exudyn_flexlink.scene.wording import mistakes_of
from exudyn_flexlink.shipped import known_names, model_file
from exudyn_flexlink.source import Document, Mistake, SceneError, did_you_mean, load_document
from exudyn_flexlink.sweeps.designs import Design, drawn, grid, listed

DESIGNS = ("grid", "list", "latin_hypercube", "random")


class Drawn(Part):
    """Points that are drawn within ranges."""

    count: Annotated[int, Strict(), Field(ge=1)] = Field(description="number of points")
    seed: Annotated[int, Strict(), Field(ge=0)] = Field(
        0, description="another seed draws other points, the same one the same points"
    )
    ranges: Mapping[str, Any] = Field(description="'lowest:highest' by the paths of the model")


class StudyFile(Part):
    """What a study file says."""

    one_of = (DESIGNS,)
    model: Text = Field(description="model file beside this one, or the name of a shipped model")
    settings: tuple[Text, ...] = Field((), alias="set", description="such as 'run.turns=2'")
    engine: Literal["exudyn", "lagrangian"] = Field("exudyn", description="who solves it")
    grid: Mapping[str, Any] | None = Field(
        None, description="values by path, each with every value of the others"
    )
    list: tuple[Any, ...] | None = Field(None, description="points, each with values by path")
    latin_hypercube: Drawn | None = Field(None, description="points that fill ranges evenly")
    random: Drawn | None = Field(None, description="points drawn independently")


@dataclass(frozen=True)
class Study:
    """A study that was read: its scene, what varies, and `mistakes` found in that."""

    document: Document
    scene: Scene
    engine: str
    design: Design | None
    mistakes: tuple[Mistake, ...]


def read_study(file: Path, settings: Iterable[str] = (), allow_outside: bool = False) -> Study:
    """Read a study file and its model; `settings` are applied after those of the file.

    The model, and the files it names, must be in the study's folder, unless `allow_outside`.

    Raises:
        SceneError: the file or the model has mistakes.

    """
    no_study = "this is a model, no study"
    hint = "vary its values with '--over path=values', or let a study name it: 'model: ...'"
    if not file.suffix and model_file(file.as_posix()) and not file.is_file():
        raise SceneError(Document(str(file)), [Mistake((), no_study, hint)])
    document = load_document(file)
    if "bodies" in document.data:
        raise SceneError(document, [Mistake(("bodies",), no_study, hint, True)])
    try:
        found = TypeAdapter(StudyFile).validate_python(document.data)
    except ValidationError as error:
        mistakes = mistakes_of(error, StudyFile, document.data, ())
        raise SceneError(document, mistakes) from None
    scene = _scene(document, found, settings, allow_outside)
    mistakes = []
    design = _design(found, mistakes)
    return Study(document, scene, found.engine, design, tuple(mistakes))


def _design(found: StudyFile, mistakes: list[Mistake]) -> Design | None:
    if found.grid is not None:
        return grid(found.grid, ("grid",), mistakes)
    if found.list is not None:
        return listed(found.list, ("list",), mistakes)
    kind = "random" if found.latin_hypercube is None else "latin_hypercube"
    own: Drawn = getattr(found, kind)
    return drawn(kind, own.ranges, own.count, (kind, "ranges"), mistakes, seed=own.seed)


def _scene(
    document: Document, found: StudyFile, settings: Iterable[str], allow_outside: bool
) -> Scene:
    """Load the model; a mistake of the study's settings is told at its place."""
    model = _model(document, found.model, allow_outside)
    try:
        return load_scene(model, [*found.settings, *settings], allow_outside)
    except SceneError as error:
        own = [
            Mistake(("set", found.settings.index(text)), mistake.message, mistake.hint)
            for mistake in error.mistakes
            if (text := error.document.setting_of(mistake.path)) in found.settings
        ]
        if len(own) == len(error.mistakes):
            raise SceneError(document, own) from None
        raise


def _model(document: Document, name: str, allow_outside: bool) -> Path:
    """Return the file of a study's model; refuse one that is outside the study's folder."""

    def mistake(message: str, hint: str = "") -> SceneError:
        return SceneError(document, [Mistake(("model",), message, hint)])

    folder = (document.folder or Path()).resolve()
    try:
        file = (folder / name).resolve()
        there = file.is_file()
    except (OSError, ValueError, RuntimeError) as error:
        raise mistake(f"can't read the model: {error}") from None
    shipped = None if there or Path(name).suffix else model_file(name)
    if shipped is not None:
        return shipped
    if not allow_outside and not file.is_relative_to(folder):
        raise mistake("the model must be in the study's folder, or below it", "'--allow-outside'")
    if not there:
        near = did_you_mean(name, known_names())
        raise mistake(f"no file '{name}' in the study's folder, and no such model{near}")
    return file

"""A file of published numbers, and the model that it belongs to."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, TypeAdapter, ValidationError

from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.observables import point_names
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.scene.base import FrozenMapping, Part, Text
from exudyn_flexlink.scene.wording import mistakes_of
from exudyn_flexlink.shipped import PUBLISHED
from exudyn_flexlink.source import (
    Document,
    KeyPath,
    Mistake,
    SceneError,
    did_you_mean,
    load_document,
)
from exudyn_flexlink.verification.numbers import PublishedNumber


class _Head(Part):
    """The file, down to its runs."""

    source: Text = Field(description="who published the numbers")
    runs: Mapping[str, Any] = Field(description="runs of the model, by name")


class _RunHead(Part):
    """One run of the model, down to its numbers."""

    settings: tuple[Text, ...] = Field((), alias="set", description="such as 'run.duration=2'")
    engine: Literal["exudyn", "lagrangian"] = Field("exudyn", description="who solves it")
    numbers: Mapping[str, Any] = Field(description="published numbers, by name")


@dataclass(frozen=True)
class BenchmarkRun:
    """A run of a benchmark: its scene, the engine that solves it, and published numbers."""

    name: str
    scene: Scene
    engine: str
    numbers: Mapping[str, PublishedNumber]


@dataclass(frozen=True)
class Benchmark:
    """A model with published numbers; `document` is the file that gives them."""

    name: str
    source: str
    runs: tuple[BenchmarkRun, ...]
    document: Document


def read_benchmark(file: Path) -> Benchmark:
    """Read a file of published numbers, and the model beside it, once for every run.

    Raises:
        SceneError: either of them has mistakes, or a number is of a part that the model has not.

    """
    document = load_document(file)
    mistakes: list[Mistake] = []
    head = _checked(_Head, document.data, (), mistakes)
    heads = {
        name: _checked(_RunHead, data, ("runs", name), mistakes)
        for name, data in (head.runs if head else {}).items()
    }
    numbers = {
        name: {
            what: _checked(PublishedNumber, data, ("runs", name, "numbers", what), mistakes)
            for what, data in one.numbers.items()
        }
        for name, one in heads.items()
        if one
    }
    if not mistakes and not heads:
        mistakes.append(Mistake(("runs",), "no run is given", on_key=True))
    if mistakes:
        raise SceneError(document, mistakes)
    own = file.name.removesuffix(PUBLISHED)
    model = file.with_name(f"{own}.yaml")
    runs = []
    for name, one in heads.items():
        scene = load_scene(model, one.settings)
        for what, number in numbers[name].items():
            mistakes += _unknown(number, scene, ("runs", name, "numbers", what))
        runs.append(BenchmarkRun(name, scene, one.engine, FrozenMapping(numbers[name])))
    if mistakes:
        raise SceneError(document, mistakes)
    return Benchmark(own, head.source, tuple(runs), document)


def _checked(annotation: Any, data: Any, path: KeyPath, mistakes: list[Mistake]) -> Any:
    """Return what `data` describes, or None after noting its mistakes."""
    try:
        return TypeAdapter(annotation).validate_python(data)
    except ValidationError as error:
        mistakes += mistakes_of(error, annotation, data, path)
        return None


def _unknown(number: PublishedNumber, scene: Scene, path: KeyPath) -> Iterator[Mistake]:
    """Names of parts that the scene does not have."""
    joints = scene.joints.items()
    with_clearance = [name for name, joint in joints if getattr(joint, "clearance", 0.0) > 0]
    known = {
        "point": point_names(scene),
        "body": list(scene.bodies),
        "relative_to": list(scene.bodies),
        "seen_from": list(scene.bodies),
        "contact": [*scene.contacts, *with_clearance],
    }
    for key, names in known.items():
        given = getattr(number, key, None)
        if given is not None and given not in names:
            hint = f"there are: {', '.join(names)}" if names else "the model has none"
            what = "point" if key == "point" else "contact" if key == "contact" else "body"
            message = f"the model has no {what} '{given}'{did_you_mean(given, names)}"
            yield Mistake((*path, key), message, hint)

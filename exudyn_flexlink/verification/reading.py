"""A file of published numbers, and the model that it belongs to."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pydantic import Field, ValidationError

from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.observables import point_names
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.scene.base import Named, Part, Text
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


class RunSpec(Part):
    """One run of the model."""

    settings: tuple[Text, ...] = Field((), alias="set", description="such as 'run.duration=2'")
    engine: Literal["exudyn", "lagrangian"] = Field("exudyn", description="who solves it")
    numbers: Named[PublishedNumber] = Field(description="published numbers, by name")


class PublishedFile(Part):
    """What a file of published numbers says."""

    source: Text = Field(description="who published the numbers")
    runs: Named[RunSpec] = Field(description="runs of the model, by name", min_length=1)


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
    try:
        found = PublishedFile.model_validate(document.data)
    except ValidationError as error:
        told = mistakes_of(error, PublishedFile, document.data, ())
        raise SceneError(document, told) from None
    own = file.name.removesuffix(PUBLISHED)
    model = file.with_name(f"{own}.yaml")
    runs, mistakes = list[BenchmarkRun](), list[Mistake]()
    for name, one in found.runs.items():
        scene = load_scene(model, one.settings)
        for what, number in one.numbers.items():
            mistakes += _unknown(number, scene, ("runs", name, "numbers", what))
        runs.append(BenchmarkRun(name, scene, one.engine, one.numbers))
    if mistakes:
        raise SceneError(document, mistakes)
    return Benchmark(own, found.source, tuple(runs), document)


def _unknown(number: PublishedNumber, scene: Scene, path: KeyPath) -> Iterator[Mistake]:
    """Names of parts that the scene does not have."""
    joints = scene.joints.items()
    with_clearance = [name for name, joint in joints if getattr(joint, "clearance", 0.0) > 0]
    known = {
        "point": point_names(scene),
        "body": list(scene.bodies),
        "relative_to": list(scene.bodies),
        "seen_from": list(scene.bodies),
        "contact": [*scene.all_contacts, *with_clearance],
    }
    for key, names in known.items():
        given = getattr(number, key, None)
        if given is not None and given not in names:
            hint = f"there are: {', '.join(names)}" if names else "the model has none"
            what = "point" if key == "point" else "contact" if key == "contact" else "body"
            message = f"the model has no {what} '{given}'{did_you_mean(given, names)}"
            yield Mistake((*path, key), message, hint)

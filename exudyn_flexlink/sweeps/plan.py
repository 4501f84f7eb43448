"""What a sweep is: a scene, values that vary, and points in a fixed order that never changes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from exudyn_flexlink.loading import document_of
from exudyn_flexlink.scene import Scene, apply_settings, check_document
from exudyn_flexlink.settings import Setting
from exudyn_flexlink.source import Document, KeyPath, Mistake, SceneError, dotted
from exudyn_flexlink.sweeps.designs import Design
from exudyn_flexlink.sweeps.dimensions import column_of, in_si, si_unit
from exudyn_flexlink.sweeps.values import Value, setting_of, unit_of
from exudyn_flexlink.versions import THIS, version_of

HASH_DIGITS = 16  # hex digits of a SHA-256: no two of a million points share one
MOST_CHECKED = 1000  # values of a path that are all checked before anything runs: in some seconds
PACKAGES = (THIS, "exudyn", "numpy", "scipy")  # on whose versions numbers depend


@dataclass(frozen=True)
class Varied:
    """A path of the scene whose values vary; `unit` is that of the SI, `given` that of the user.

    Both are empty where there is none, `given` also where values were given in SI.
    """

    path: str
    unit: str
    given: str

    @property
    def column(self) -> str:
        """Name of its column, with the unit of the SI."""
        return column_of(self.path, self.unit)


@dataclass(frozen=True)
class Point:
    """One point of a sweep: its number from 1, settings of the scene, values in SI.

    `id` is made of the scene, the settings and how it is solved: the same in every process, and
    whenever the sweep is planned again.
    """

    number: int
    id: str
    settings: tuple[Setting, ...]
    values: tuple[Value, ...]


@dataclass(frozen=True)
class Sweep:
    """A plan: which runs are made of a scene, and what is observed of each.

    `observed` names what is observed, so that rows of two kinds never end up in one table.
    """

    scene: Scene
    engine: str
    varied: tuple[Varied, ...]
    points: tuple[Point, ...]
    measure: bool = True
    observed: str = ""
    allow_outside: bool = False

    def __len__(self) -> int:
        return len(self.points)


def planned(  # noqa: PLR0913  (all of these make other numbers)
    scene: Scene,
    design: Design | None,
    document: Document,
    *,
    engine: str = "exudyn",
    measure: bool = True,
    observed: str = "",
    allow_outside: bool = False,
    mistakes: Iterable[Mistake] = (),
) -> Sweep:
    """Make a sweep of a scene; `document` is where the design was given.

    `mistakes` are those found while it was read, of which `design` has left out the paths.

    Raises:
        SceneError: a path leads nowhere, or a value can't be; all such mistakes are in it. Values
            that only can't be together with others make a row that says so, as a run that fails.

    """
    found = list(mistakes)
    if design is None:
        raise SceneError(document, found)
    settings = [
        tuple(setting_of(path, value) for path, value in zip(design.paths, point, strict=True))
        for point in design.points
    ]
    found += _mistakes(scene, design, settings, allow_outside)
    if found:
        raise SceneError(document, found)
    how = json.dumps([scene.to_data(), engine, measure], sort_keys=True)
    base = hashlib.sha256(how.encode()).hexdigest()
    units = [si_unit(scene, path) for path in design.paths]
    points = tuple(
        Point(number, _id(base, own), own, tuple(map(in_si, values, units)))
        for number, (own, values) in enumerate(zip(settings, design.points, strict=True), 1)
    )
    given = zip(*design.points, strict=True)
    values = zip(*(point.values for point in points), strict=True)
    varied = tuple(
        _varied(path, unit, column, unit_of(own))
        for path, unit, column, own in zip(design.paths, units, values, given, strict=True)
    )
    return Sweep(scene, engine, varied, points, measure, observed, allow_outside)


def versions() -> dict[str, str]:
    """Versions of the packages on which numbers depend."""
    return {name: version_of(name) for name in PACKAGES}


def _id(base: str, settings: Sequence[Setting]) -> str:
    text = "\n".join([base, *sorted(map(json.dumps, settings))])
    return hashlib.sha256(text.encode()).hexdigest()[:HASH_DIGITS]


def _varied(path: str, unit: str, values: Sequence[Value], given: str) -> Varied:
    """Texts, such as 'beam', have no unit."""
    numbers = any(isinstance(value, float) for value in values)
    return Varied(path, unit if numbers else "", given if numbers else "")


def _mistakes(
    scene: Scene, design: Design, settings: Sequence[Sequence[Setting]], allow_outside: bool
) -> Iterator[Mistake]:
    """Mistakes of values by themselves, at the places where the values are given."""
    document = document_of(scene)
    nowhere: set[str] = set()  # paths that lead nowhere, whatever the value
    for path, own, places in zip(design.paths, settings[0], design.places, strict=True):
        try:
            apply_settings(document, [own])
        except SceneError as error:
            nowhere.add(path)
            place = next(iter(places.values()))
            at = place[:-1] if isinstance(place[-1], int) else place
            yield from (Mistake(at, one.message, one.hint) for one in error.mistakes)
    for i, (path, places) in enumerate(zip(design.paths, design.places, strict=True)):
        if path in nowhere:
            continue
        first: dict[Value, Sequence[Setting]] = {}  # the point with which a value is checked
        for point, given in zip(design.points, settings, strict=True):
            first.setdefault(point[i], given)
        wrong: set[KeyPath] = set()  # of a range one value tells what is wrong with all
        steps, values = tuple(path.split(".")), tuple(places)
        for value in (*values[:: -(-len(values) // MOST_CHECKED)], values[-1]):
            place = places[value]
            if place in wrong:
                continue
            together = [setting for setting in first[value] if setting[0] not in nowhere]
            for mistake in check_document(
                apply_settings(document, together), allow_outside
            ).mistakes:
                if _is_of(mistake, steps):
                    wrong.add(place)
                    yield _moved(mistake, place, len(steps))


def _is_of(mistake: Mistake, path: KeyPath) -> bool:
    """Tell whether a mistake stands at a path, below it, or where the path leads nowhere."""
    texts, own = [str(step) for step in mistake.path], [str(step) for step in path]
    shorter = min(len(texts), len(own))
    return texts[:shorter] == own[:shorter]


def _moved(mistake: Mistake, place: KeyPath, length: int) -> Mistake:
    inner = dotted(mistake.path[length:])
    message = f"{inner}: {mistake.message}" if inner else mistake.message
    return Mistake(place, message, mistake.hint)

"""A file that describes a sweep: a model, what varies in it, and who solves it.

A sweep's table, and how it comes about: a row for every point, kept as soon as it is there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import closing, suppress
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
from exudyn_flexlink.sweeps.executors import Executor, rows_of
from exudyn_flexlink.sweeps.plan import Design, Sweep, Value, Varied, drawn, grid, listed
from exudyn_flexlink.sweeps.rows import COLUMNS, Row, Scalar, Work

Told = Callable[[Row, int], None]
"""Called with each row, and the number of rows that are there."""


@dataclass(frozen=True)
class SweepTable:
    """What a sweep has given: its rows in the order of their points, and the `values` of these.

    `points` is the number of points of the plan: more than there are rows, if the sweep was
    interrupted. Numbers are in SI.
    """

    title: str
    engine: str
    varied: tuple[Varied, ...]
    points: int
    rows: tuple[Row, ...]
    values: tuple[tuple[Value, ...], ...]

    @property
    def whole(self) -> bool:
        """Whether every point has its row."""
        return len(self.rows) == self.points

    @property
    def observables(self) -> tuple[str, ...]:
        """Names of all observables, in the order in which rows first tell them."""
        return tuple(dict.fromkeys(name for row in self.rows for name in row.numbers))

    def count(self, status: str) -> int:
        """How many rows are done, doubtful or failed."""
        return sum(row.status == status for row in self.rows)

    def columns(self) -> dict[str, list[Scalar]]:
        """Return all columns by name: the run, its values, how it ended, its observables.

        None stands for a number that there is not.
        """
        told: dict[str, list[Scalar]] = {
            column: [getattr(row, name) for row in self.rows] for column, name in COLUMNS.items()
        }
        first = {column: told.pop(column) for column in ("run", "id")}
        varied: dict[str, list[Scalar]] = {
            one.column: [values[i] for values in self.values] for i, one in enumerate(self.varied)
        }
        seen = {name: [row.numbers.get(name) for row in self.rows] for name in self.observables}
        return first | varied | told | seen


def table_of(
    title: str,
    engine: str,
    varied: Iterable[Varied],
    points: Iterable[tuple[str, Iterable[Value]]],
    rows: Mapping[str, Row],
) -> SweepTable:
    """Return the table of points, each an id and values; `rows` are by ids, and may not be all."""
    every = [(one, tuple(values)) for one, values in points]
    there = [(rows[one], values) for one, values in every if one in rows]
    return SweepTable(
        title,
        engine,
        tuple(varied),
        len(every),
        tuple(row for row, _ in there),
        tuple(values for _, values in there),
    )


def carried_out(
    sweep: Sweep,
    work: Work,
    executor: Executor,
    known: Mapping[str, Row],
    told: Told,
) -> SweepTable:
    """Make the runs of all points that have no row yet.

    `known` are rows of an earlier part of the sweep, by the id of their points. Ctrl-C ends the
    sweep: what is missing then stays missing.

    Raises:
        CannotStartError: no process can do the work.

    """
    rows = {point.id: known[point.id] for point in sweep.points if point.id in known}
    missing = [point for point in sweep.points if point.id not in rows]
    coming = rows_of(executor, work, missing)
    with suppress(KeyboardInterrupt), closing(coming):
        for row in coming:
            rows[row.id] = row
            told(row, len(rows))
    points = ((point.id, point.values) for point in sweep.points)
    return table_of(sweep.scene.title, sweep.engine, sweep.varied, points, rows)


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

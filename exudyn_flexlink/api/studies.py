"""Studies, as a script or a notebook asks for them.

How stable a motion is, sweeps, sensitivities, and a mechanism's linear equations about a state.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass, is_dataclass
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink import engines, linear, sensitivities, stability, storage, sweeps
from exudyn_flexlink.api import with_methods
from exudyn_flexlink.api.figures import Shown, needed, style, style_of
from exudyn_flexlink.api.results import PERIOD, Result, api_result
from exudyn_flexlink.api.scenes import ENGINE, Scene, api_scene, given_scene
from exudyn_flexlink.arguments import (
    among,
    excerpt,
    function,
    instance_of,
    number,
    plain,
    takes,
    text,
    values,
    whole,
)
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.fitting import parameters_of
from exudyn_flexlink.observables import watched_point
from exudyn_flexlink.quantities import Dimension
from exudyn_flexlink.report import exponent_text, linear_text, sensitivity_text, stability_text
from exudyn_flexlink.result import Result as PlainResult
from exudyn_flexlink.scene import Run
from exudyn_flexlink.scene import Scene as PlainScene
from exudyn_flexlink.shipped import EXUDYN
from exudyn_flexlink.source import Document, Mistake, unknown
from exudyn_flexlink.sweeps import DOUBTFUL, FAILED, OneRun, Scalar
from exudyn_flexlink.sweeps.plan import MOST_POINTS

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


def _numbers(given: Any, _: Any = None) -> FloatArray:
    """Take numbers."""
    return np.array([number()(quantity, None) for quantity in values(given)])


@dataclass(frozen=True, repr=False)
class Stability(Shown, stability.Stability):
    """What one run of many laps, and its neighbours, tell of a motion; SI units throughout."""

    _figure, _text = "stability", stability_text

    @takes()
    def save(self, folder: str | PathLike[str], *, force: bool = False) -> Path:
        """Write ``stability.json`` and tables into a folder; return the folder.

        Raises:
            StorageError: the folder can't be written, or holds what is no study.

        """
        with storage.staged_folder(Path(folder), force=force) as staged:
            storage.save_study(self, staged)
        return Path(folder)

    def __repr__(self) -> str:
        return f"<Stability of {self.point}: {exponent_text(self.exponent)}; {self.behaviour}>"


@dataclass(frozen=True, repr=False)
class Branches(stability.Branches):
    """Sections of runs in which one value is varied: a bifurcation diagram."""

    @takes(axis=among(lambda _: ("x", "y"), "axis"), style=style)
    def plot(self, axis: str = "y", style: str = "screen") -> Figure:
        """Draw the place of the point once a lap, x or y, over the value."""
        from exudyn_flexlink import plots

        return plots.bifurcation(self, axis=axis, style=style_of(style))

    def __repr__(self) -> str:
        """Return one line: what is varied, in how many runs, and how many of them failed."""
        failed = f", {len(self.failed)} failed" if self.failed else ""
        return f"<Branches over {self.path}: {len(self.values)} values{failed}>"


LAPS = {
    "laps": whole(1),
    "after": number(at_least=0.0),
    "lap": PERIOD,
    "angle": number(Dimension.ANGLE),
}


@takes(scene=given_scene, engine=ENGINE, **LAPS, tolerance=number(Dimension.LENGTH, above=0.0))
def stability_of(
    scene: PlainScene,
    engine: str = EXUDYN,
    *,
    laps: int = stability.Asked.laps,
    after: float = stability.Asked.after,
    lap: float | None = None,
    angle: float = 0.0,
    tolerance: float | None = None,
    twice: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Stability:
    """Measure how stable a scene's motion is, over so many laps, those `after` the first few.

    A lap is a turn of the joint that a drive turns at one speed, or takes `lap` (s); ``run`` of the
    scene does not count. The section is at the crank angle `angle` (rad). The tolerance (m) is by
    default fine enough for neighbours well above it; with `twice` the exponent is made again at a
    tenth of it.

    Raises:
        ImpossibleLapsError: no run can have such laps, or so many.
        NoRhythmError: nothing tells what a lap is.
        NotRepresentableError: the engine can't represent a part of the scene.
        StoppedError: a run stopped before its end.
        TooShortError: there are too few laps.

    """
    asked = stability.Asked(laps, after, lap, angle, tolerance, twice)
    simulate = partial(engines.simulate, engine=engine, measure=False)
    return with_methods(Stability, stability.study(scene, simulate, asked, progress))


def lyapunov(scene: PlainScene, engine: str = EXUDYN, **more: Any) -> stability.Exponent:
    """Largest Lyapunov exponent (1/s) of a scene's motion; `more` is as of `stability_of`."""
    return stability_of(scene, engine, **more).exponent


@takes(scene=given_scene, values=_numbers, **LAPS)
def bifurcation(
    scene: Scene,
    path: str,
    values: Iterable[float],
    engine: str = EXUDYN,
    progress: Callable[[float], None] | None = None,
    *,
    laps: int = stability.Asked.laps,
    after: float = stability.Asked.after,
    lap: float | None = None,
    angle: float = 0.0,
    folder: str | PathLike[str] | None = None,
    resume: bool = False,
    force: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
) -> Branches:
    """Look at the watched point once a lap, for values (SI) of what `path` names in the scene.

    Each value starts anew, from the scene's own start. Where a drive's speed is varied, laps are of
    that speed. It is a sweep, whose table has a section in each row: `folder`, `resume`, `force`,
    `workers`, `scheduler` and `progress` are those of `sweep`, also that a script must call this
    below ``if __name__ == "__main__":`` unless `workers` is 1. A run that fails leaves its value
    without a section.

    Raises:
        CannotStartError: no process can do the work.
        SceneError: the path leads nowhere, or a value can't be.
        StoppedError: no value has a section; the text says why the first has none.
        StorageError: the folder can't be written, or holds something else.

    """
    table = sweep(
        scene,
        {path: values},
        engine,
        progress,
        observe=_SectionRow(laps, after, lap, angle),
        folder=folder,
        resume=resume,
        force=force,
        workers=workers,
        scheduler=scheduler,
        measure=False,
    )
    if not table.whole:
        raise KeyboardInterrupt
    rows = [(float(value), row) for (value,), row in zip(table.values, table.rows, strict=True)]
    whole = [(value, row.numbers) for value, row in rows if row.status != FAILED]
    if not whole:
        value, row = rows[0]
        raise stability.StoppedError(
            f"no value of {path} has a section; at {value:g}: {row.reason}"
        )
    point = watched_point(scene)
    return Branches(
        path,
        np.array([value for value, _ in whole]),
        [stability.section_of_row(row, point, angle, by_crank=lap is None) for _, row in whole],
        {value: row.reason for value, row in rows if row.status == FAILED},
        {value: row.reason for value, row in rows if row.status == DOUBTFUL},
    )


@dataclass(frozen=True)
class _SectionRow:
    """Runs so many laps, and tells the section; can be sent to other processes."""

    laps: int
    after: float
    lap: float | None
    angle: float

    def __call__(self, scene: Scene, simulate: Simulate) -> Mapping[str, Scalar]:
        rhythm = stability.rhythm_of(scene, self.lap)
        stability.require_possible(self.laps, rhythm)
        begin = self.after * rhythm.lap

        def row(result: PlainResult) -> Mapping[str, Scalar]:
            if self.lap is None:
                return stability.section_row(
                    stability.section_by_crank(result, self.angle, after=begin)
                )
            return stability.section_row(stability.section_by_time(result, rhythm.lap, after=begin))

        long = api_scene(scene.changed(run=Run(duration=self.laps * rhythm.lap)))
        return OneRun(row)(long, cast(Any, simulate))


Simulate = Callable[[Scene], Result]
"""Runs a scene by the engine of a sweep; a run that fails is a Result, too."""

RowFunction = Callable[[Result], Mapping[str, sweeps.Scalar]]
"""Observables of one run, by the names of their columns, which end in their units."""

Observe = Callable[[Scene, Simulate], Mapping[str, sweeps.Scalar]]
"""Observables of one point that may need several runs."""


def _varied(value: Any, _: Any = None) -> Any:
    """Take values by path, or a list of points, each a dict; texts and numbers stay as they are."""
    if not isinstance(value, Mapping):
        return [_varied(item) if isinstance(item, Mapping) else item for item in values(value)]
    for name in value:
        if not isinstance(name, str):
            raise TypeError(f"expected paths such as 'run.turns', got {excerpt(name)}")
    return {name: _values(given) for name, given in value.items()}


def _values(value: Any) -> Any:
    """Turn quantities of Pint into texts with units."""
    if hasattr(value, "to_base_units") and getattr(value.magnitude, "size", 1) > 1:
        value = list(value)
    if isinstance(value, list | tuple):
        return [_values(item) for item in value]
    return plain(value) if hasattr(value, "to_base_units") else value


@dataclass(frozen=True, repr=False)
class SweepTable(sweeps.SweepTable):
    """What a sweep has given: a row for every point, in SI units."""

    @takes()
    def __getitem__(self, column: str) -> NDArray[Any]:
        """Return a column (rows,) by name: numbers, nan where there is none, or texts.

        Raises:
            KeyError: there is no such column; `columns` lists all.

        """
        columns = self.columns()
        if column not in columns:
            raise KeyError(unknown("column", column, columns))
        values = columns[column]
        texts = any(isinstance(value, str) for value in values)
        return np.array(values, dtype=object if texts else float)

    @takes(names=among(lambda table: table.columns(), "column"), style=style)
    def plot(self, *names: str, style: str = "screen") -> Figure:
        """Draw columns by `names`, or the first that differ: lines, maps, parallel coordinates.

        Raises:
            ValueError: there is no such column or style, or no row has numbers.

        """
        from exudyn_flexlink import plots

        figure = plots.sweep(self, names, style=style_of(style))
        if figure is None:
            raise ValueError("no row has numbers that differ from those of the others")
        return figure

    def to_dataframe(self) -> DataFrame:
        """Return the table of pandas; columns carry their units, as in the CSV file.

        Raises:
            ImportError: pandas is not installed.

        """
        frame: DataFrame = needed("pandas").DataFrame(self.columns())
        return frame

    def __repr__(self) -> str:
        """Return one line: what varied, how many rows, how many of them are to be looked at."""
        paths = ", ".join(path_varied.path for path_varied in self.varied)
        counts = [f"{self.count(s)} {s}" for s in (sweeps.DOUBTFUL, sweeps.FAILED) if self.count(s)]
        many = f"{len(self.rows)} rows"
        many = many if self.whole else f"interrupted, {len(self.rows)} of {self.points} rows"
        return f"<Sweep of {paths}: {', '.join([many, *counts])}>"


@takes(
    scene=given_scene,
    varied=_varied,
    engine=ENGINE,
    row=function,
    observe=function,
    latin_hypercube=whole(1, MOST_POINTS),
    random=whole(1, MOST_POINTS),
    seed=whole(0),
    workers=whole(1),
)
def sweep(
    scene: Scene,
    varied: Mapping[str, Any] | Iterable[Mapping[str, Any]],
    engine: str = EXUDYN,
    progress: Callable[[float], None] | None = None,
    *,
    row: RowFunction | None = None,
    observe: Observe | None = None,
    latin_hypercube: int | None = None,
    random: int | None = None,
    seed: int = 0,
    folder: str | PathLike[str] | None = None,
    resume: bool = False,
    force: bool = False,
    series: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    measure: bool = True,
) -> SweepTable:
    """Simulate a scene at many points, and return one table with a row for each.

    `varied` are values by the paths of the model file: ``{"drives.motor.value": "6:14:9 rad/s",
    "joints.sleeve.clearance": "1, 2, 5 mm"}``, texts as those of ``--over``, or sequences of
    values. Every value of each is put together with every value of the others. A list of dicts
    names the points one by one. With ``latin_hypercube=50`` or ``random=50`` the values are ranges,
    ``"2:40"``, in which as many points are chosen, the same ones for the same `seed`.

    What is told of a run is `standard_row`; another function of a Result may stand in its place,
    `row`. What needs several runs is `observe`, a function of the point's scene and of `simulate`,
    which runs a scene by the sweep's engine::

        def slower(scene, simulate):
            first, second = simulate(scene), simulate(scene.with_({"run.turns": 2}))
            return {"energy_J": first.energy.dissipated[-1] - second.energy.dissipated[-1]}

    Both return numbers and texts by the names of their columns. Several processes must be able to
    import them: they are functions of a module, at its top level. A run that fails, or whose
    function raises, is a row with its `reason`; one that warns is doubtful.

    With a `folder` each row is kept there at once: after an interrupt `resume` goes on, `force`
    begins anew; `series` saves all runs whole in it. `workers` are processes, one for every core if
    left out, 1 for this process itself; a script must then call this below
    ``if __name__ == "__main__":``. `scheduler` is the address of Dask's, whose workers run instead.
    Numbers do not depend on who runs. `measure` is that of `simulate`; `progress` is called with
    the part that is done, 0 to 1. Ctrl-C ends the sweep: the table has the rows that are finished,
    and its `whole` is False.

    Raises:
        CannotStartError: no process can do the work: a function that others can't import.
        SceneError: a path leads nowhere, or a value can't be: all such mistakes.
        StorageError: the folder can't be written, or holds something else.
        ValueError: options that exclude each other.

    """
    for wrong, why in (
        (None not in (row, observe), "'row' observes one run, 'observe' several: give one of both"),
        (series and folder is None, "'series' are saved in the sweep's folder: give 'folder', too"),
        (resume and force, "'resume' goes on, 'force' begins anew: give one of both"),
    ):
        if wrong:
            raise ValueError(why)
    place = None if folder is None else Path(folder)
    executor = sweeps.executor_of(workers, scheduler)
    mistakes: list[Mistake] = []
    plan = sweeps.planned(
        scene,
        _design(varied, latin_hypercube, random, seed, mistakes),
        Document("the sweep"),
        engine=engine,
        measure=measure,
        observed=_name_of(observe or row or sweeps.standard_row),
        allow_outside=True,
        mistakes=mistakes,
    )
    work = sweeps.work_of(
        plan,
        partial(engines.simulate, engine=engine, measure=measure),
        _ForUsers(observe or cast(Observe, sweeps.OneRun(cast(Any, row or sweeps.standard_row)))),
        storage.SeriesKeeper(place.resolve()) if series and place else None,
    )
    kept = nullcontext() if place is None else storage.open_journal(
        place, plan, resume=resume, force=force, series=series
    )  # fmt: skip
    with kept as journal:

        def keep(made_row: sweeps.Row, count: int) -> None:
            if journal is not None:
                journal.add(made_row)
            if progress is not None:
                progress(count / len(plan))

        known = {} if journal is None else journal.known
        table = sweeps.carried_out(plan, work, executor, known, keep)
        if place is not None:
            with storage.staged_folder(place, force=force) as staged:
                storage.save_table(plan, table, staged)
    if progress is not None and table.whole:
        progress(1.0)
    return with_methods(SweepTable, table)


@dataclass(frozen=True, repr=False)
class Sensitivities:
    """How quantities of a run change with numbers of its scene: `rows`, and the `table` of runs.

    Each row has `quantity`, `parameter`, the values of both, `value` and `at`, the `derivative`
    with its `unit` and `error`, the `step` to both sides that it was taken over, and `relative`,
    by how many per cent the quantity changes for one of the parameter.
    """

    rows: tuple[sensitivities.Sensitivity, ...]
    table: SweepTable

    def summary(self) -> str:
        """Return a line for each, the most sensitive first."""
        return sensitivity_text(self.rows)

    def to_dataframe(self) -> DataFrame:
        """Return a row for each: quantity, parameter, value, derivative, error, relative.

        Raises:
            ImportError: pandas is not installed.

        """
        columns = [vars(row) | {"relative": row.relative} for row in self.rows]
        frame: DataFrame = needed("pandas").DataFrame(columns)
        return frame

    def __repr__(self) -> str:
        """Return one line: of what, to what."""
        of, to = (dict.fromkeys(getattr(row, key) for row in self.rows)
                  for key in ("quantity", "parameter"))  # fmt: skip
        return f"<Sensitivities of {', '.join(of)} to {', '.join(to)}>"


def _texts(value: Any, _: Any = None) -> list[str]:
    """Take a text, or several."""
    return [text(value)] if isinstance(value, str) else [text(item) for item in values(value)]


@takes(scene=given_scene, of=_texts, to=_texts, engine=ENGINE, workers=whole(1))
def sensitivity(
    scene: Scene,
    of: str | Iterable[str],
    to: str | Iterable[str],
    engine: str = EXUDYN,
    progress: Callable[[float], None] | None = None,
    *,
    row: RowFunction | None = None,
    workers: int | None = None,
) -> Sensitivities:
    """Tell how quantities of a run change with numbers of its scene, with errors.

    `of` are columns of a sweep's table, such as ``"strike.greatest_force_N"``, `to` paths of the
    model file, such as ``"springs.lever_return.frequency"``. They are differences of runs, by steps
    of 2 % and less, at a tenth of the scene's tolerance: two runs, and six for each path. `row` and
    `workers` are those of `sweep`.

    Raises:
        NoSensitivityError: no such quantity, or none that changes smoothly enough to tell.
        SceneError: a path leads to no number.

    """
    parameters = parameters_of(scene, list(to), "to")
    points = sensitivities.points_of(scene, parameters)
    table = sweep(scene, points, engine, progress, row=row, workers=workers, measure=False)
    if not table.whole:
        raise KeyboardInterrupt
    return Sensitivities(tuple(sensitivities.sensitivities_in(table, list(of), parameters)), table)


@takes()
def load_sweep(folder: str | PathLike[str]) -> SweepTable:
    """Read the table of a sweep, also of one that was interrupted.

    Raises:
        StorageError: the folder holds no sweep, or a file of it is damaged.

    """
    return with_methods(SweepTable, storage.load_sweep(Path(folder)))


@dataclass(frozen=True)
class _ForUsers:
    """Observes with scenes and results that have the methods of this room."""

    observe: Observe

    def __call__(self, scene: PlainScene, simulate: sweeps.Simulate) -> Mapping[str, sweeps.Scalar]:
        return self.observe(api_scene(scene), lambda changed: api_result(simulate(changed)))


def _design(
    varied: Mapping[str, Any] | Iterable[Mapping[str, Any]],
    hypercube: int | None,
    drawn: int | None,
    seed: int,
    mistakes: list[Mistake],
) -> sweeps.Design | None:
    """Return the points that arguments of `sweep` ask for; None after a mistake in all of it."""
    if hypercube is not None and drawn is not None:
        raise ValueError("'latin_hypercube' and 'random' are two designs: give one of both")
    if not isinstance(varied, Mapping):
        if hypercube is not None or drawn is not None:
            raise ValueError("points that are listed are not drawn: give ranges by path")
        return sweeps.listed(list(varied), (), mistakes)
    kind, count = ("random", drawn) if hypercube is None else ("latin_hypercube", hypercube)
    if count is None:
        return sweeps.grid(varied, (), mistakes)
    return sweeps.drawn(kind, varied, count, (), mistakes, seed=seed)


def _name_of(function: Any) -> str:
    """Name of a function, by which a later sweep knows whether it observes the same."""
    kind = type(function)
    known_name = function if hasattr(function, "__qualname__") else kind
    name = f"{known_name.__module__}.{known_name.__qualname__}"
    return f"{name} {function!r}" if known_name is kind and is_dataclass(function) else name


POINT = among(lambda model: model.assembly.mechanism.points, "point")
AXIS = among(lambda _: ("x", "y"), "axis")
RUN = instance_of(PlainResult, "load_scene(..) gives a scene, simulate(..) a run")


def _hertz(value: Any, _: Any = None) -> FloatArray:
    """Take frequencies."""
    read = number(Dimension.FREQUENCY, above=0.0)
    return np.array([read(frequency, None) for frequency in values(value)])


@dataclass(frozen=True, repr=False)
class Response(Shown, linear.Response):
    """How a point answers a force that oscillates: `x`, `y` (F,) m/N over `frequency` (F,) Hz."""

    _figure, _text = "response", repr

    def __repr__(self) -> str:
        """Return one line: from where to where."""
        low, high = self.frequency[[0, -1]]
        return f"<Response of {self.at} to {self.force}: {low:.4g} Hz to {high:.4g} Hz>"


@dataclass(frozen=True, repr=False)
class LinearModel(Shown, linear.LinearModel):
    """``M z'' + C z' + K z = f`` about one state; SI units, n independent coordinates z.

    `coordinates` are their names, `units` rad or m: angles and lengths of joints, ``link hinge 2``
    of a flexible link, ``ball.x`` of what nothing holds; places along curves of points in slots.
    `mass`, `damping` and `stiffness` are (n, n); `damping_error` and `stiffness_error` tell how far
    entries may be off. `eigenvalues` (2 n,) are in 1/s, `modes` motions of one of them each, with
    `frequency` (Hz), `damping_ratio`, and complex amplitudes: `coordinates` (n,), `poses` (parts,
    3) and `points` by name. `motions` (parts, 3, n) are slopes of poses by z. Contacts `pressing`
    go on pressing. `time` (s) is that of the run, None about a rest.
    """

    _figure, _text = "modes", linear_text

    @takes(force=POINT, at=POINT, frequency=_hertz, along=AXIS)
    def response(
        self,
        force: str,
        at: str,
        frequency: FloatArray | None = None,
        along: str = "y",
    ) -> Response:
        """Return how the point `at` answers 1 N along x or y at the point `force`.

        Over the `frequency` (Hz), by default about all of the modes.
        """
        response = linear.LinearModel.response(self, force, at, frequency, along)
        return with_methods(Response, response)

    def __repr__(self) -> str:
        """Return one line: about what, and how many coordinates there are."""
        about = "its rest" if self.time is None else f"t = {self.time:.6g} s"
        return f"<Linear model of '{self.scene.title}' about {about}: {len(self.mass)} coordinates>"


def _scene_or_run(value: Any, _: Any = None) -> Any:
    """Take a scene, or a run."""
    return given_scene(value) if isinstance(value, PlainScene) else RUN(value, None)


@takes(of=_scene_or_run, at=number(Dimension.TIME, at_least=0.0))
def linearised(of: PlainScene | PlainResult, at: float | None = None) -> LinearModel:
    """Linearise a scene about its rest, or a run about its sample next to `at` (s), or its end.

    Mass, damping and stiffness of the independent coordinates, with eigenvalues, modes, and answers
    to forces. Drives hold at a rest what they have at time 0, and prescribe in a run what they do;
    contacts that press then go on pressing. A rest is where ``equilibrium`` finds it.

    Raises:
        CannotContinueError: the run has no such instant.
        NotLinearError: friction holds a joint or a contact, or a contact by impulse presses.
        NotRepresentableError: a link is a beam of Exudyn.
        SceneError: nothing balances.
        ValueError: `at` is given, and there is no run.

    """
    if at is not None and isinstance(of, PlainScene):
        raise ValueError("'at' is an instant of a run; a scene is linearised about its rest")
    return with_methods(LinearModel, engines.linear_model(of, at))

"""Sweeps, as a script or a notebook asks for them."""

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

from exudyn_flexlink import engines, storage, sweeps
from exudyn_flexlink.api import with_methods
from exudyn_flexlink.api.figures import style, style_of
from exudyn_flexlink.api.results import Result, own_result
from exudyn_flexlink.api.scenes import ENGINE, Scene, given_scene, own_scene
from exudyn_flexlink.api.tables import needed
from exudyn_flexlink.arguments import among, function, plain, takes, told, values, whole
from exudyn_flexlink.scene import Scene as PlainScene
from exudyn_flexlink.source import Document, Mistake, unknown

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


Simulate = Callable[[Scene], Result]
"""Runs a scene by the engine of a sweep; a run that fails is a Result, too."""

RowFunction = Callable[[Result], Mapping[str, sweeps.Scalar]]
"""Observables of one run, by the names of their columns, which end in their units."""

Observe = Callable[[Scene, Simulate], Mapping[str, sweeps.Scalar]]
"""Observables of one point that may need several runs."""

MOST_POINTS = 10**6


def _varied(value: Any, _: Any = None) -> Any:
    """Take values by path, or a list of points, each a dict; texts and numbers stay as they are."""
    if not isinstance(value, Mapping):
        return [_varied(one) if isinstance(one, Mapping) else one for one in values(value)]
    for name in value:
        if not isinstance(name, str):
            raise TypeError(f"expected paths such as 'run.turns', got {told(name)}")
    return {name: _values(own) for name, own in value.items()}


def _values(own: Any) -> Any:
    """Turn quantities of Pint into texts with units."""
    if hasattr(own, "to_base_units") and getattr(own.magnitude, "size", 1) > 1:
        own = list(own)
    if isinstance(own, list | tuple):
        return [_values(one) for one in own]
    return plain(own) if hasattr(own, "to_base_units") else own


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

    @takes(names=among(lambda own: own.columns(), "column"), style=style)
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
        paths = ", ".join(one.path for one in self.varied)
        told = [f"{self.count(s)} {s}" for s in (sweeps.DOUBTFUL, sweeps.FAILED) if self.count(s)]
        many = f"{len(self.rows)} rows"
        many = many if self.whole else f"interrupted, {len(self.rows)} of {self.points} rows"
        return f"<Sweep of {paths}: {', '.join([many, *told])}>"


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
    engine: str = "exudyn",
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
        _Own(observe or cast(Observe, sweeps.OneRun(cast(Any, row or sweeps.standard_row)))),
        storage.SeriesKeeper(place.resolve()) if series and place else None,
    )
    kept = nullcontext() if place is None else storage.open_journal(
        place, plan, resume=resume, force=force, series=series
    )  # fmt: skip
    with kept as journal:

        def told(found: sweeps.Row, count: int) -> None:
            if journal is not None:
                journal.add(found)
            if progress is not None:
                progress(count / len(plan))

        there = {} if journal is None else journal.known
        table = sweeps.carried_out(plan, work, executor, there, told)
        if place is not None:
            with storage.staged_folder(place, force=force) as staged:
                storage.save_table(plan, table, staged)
    if progress is not None and table.whole:
        progress(1.0)
    return with_methods(SweepTable, table)


@takes()
def load_sweep(folder: str | PathLike[str]) -> SweepTable:
    """Read the table of a sweep, also of one that was interrupted.

    Raises:
        StorageError: the folder holds no sweep, or a file of it is damaged.

    """
    return with_methods(SweepTable, storage.load_sweep(Path(folder)))


@dataclass(frozen=True)
class _Own:
    """Observes with scenes and results that have the methods of this room."""

    observe: Observe

    def __call__(self, scene: PlainScene, simulate: sweeps.Simulate) -> Mapping[str, sweeps.Scalar]:
        return self.observe(own_scene(scene), lambda own: own_result(simulate(own)))


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
    told = function if hasattr(function, "__qualname__") else kind
    name = f"{told.__module__}.{told.__qualname__}"
    return f"{name} {function!r}" if told is kind and is_dataclass(function) else name

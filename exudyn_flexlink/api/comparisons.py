"""Runs side by side, or one after the other; runs beside measurements, and values that fit them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

from exudyn_flexlink import engines, fitting, storage
from exudyn_flexlink.api import with_methods
from exudyn_flexlink.api.figures import RESULT, Shown
from exudyn_flexlink.api.results import Result, own_result
from exudyn_flexlink.api.scenes import ENGINE, Scene, given_scene, own_scene
from exudyn_flexlink.arguments import measured, number, takes, texts_by_name, told, two_texts
from exudyn_flexlink.comparison import Comparison as PlainComparison
from exudyn_flexlink.comparison import compare as compare_runs
from exudyn_flexlink.continuing import joined as join
from exudyn_flexlink.observables import name_of
from exudyn_flexlink.quantities import Dimension
from exudyn_flexlink.report import against_text, comparison_text, fit_text
from exudyn_flexlink.result import Result as PlainResult
from exudyn_flexlink.scene import Scene as PlainScene


@dataclass(frozen=True, repr=False)
class Comparison(Shown, PlainComparison):
    """Two runs at common instants: how far points are apart, strikes in pairs."""

    _figure, _text = "comparison", comparison_text

    def __repr__(self) -> str:
        return (
            f"<Comparison of {self.first.name} and {self.second.name}: "
            f"{name_of(self.judged_by)} apart by {self.judged.largest:.3g} m at most>"
        )


@dataclass(frozen=True, repr=False)
class MeasuredComparison(Shown, fitting.Against):
    """A run beside a measured series, at the series' instants; SI units throughout."""

    _figure, _text = "against", against_text

    def __repr__(self) -> str:
        told = ", ".join(f"{d.signal} {d.rms:.3g} {d.unit}" for d in self.distances)
        if self.outside:
            told += f"; {self.outside} of {len(self.series.time)} rows are outside the run"
        return f"<Comparison of {self.result.engine} and {self.series.source}: apart by rms {told}>"


def _other(value: Any, _: Any = None) -> Any:
    """Take a run, or measurements."""
    if isinstance(value, PlainResult):
        return value
    try:
        return measured(value)
    except TypeError as error:
        raise TypeError(f"{error}".replace("expected", "expected a Result,")) from None


@takes(
    first=RESULT,
    second=_other,
    names=two_texts,
    columns=texts_by_name,
    shift=number(Dimension.TIME, words=("find",)),
)
def compare(
    first: PlainResult,
    second: Any,
    *,
    names: tuple[str, str] | None = None,
    columns: Mapping[str, str] | None = None,
    shift: float | str = 0.0,
) -> Comparison | MeasuredComparison:
    """Compare two runs of one scene, or with `names` of two scenes: rigid and flexible, say.

    Two scenes are compared in what both have, and instant by instant up to the earlier horizon.

    In place of a second run there may be a measured series: a CSV file, or columns by name, such as
    a data frame's. `columns` says which column is what, ``{"theta": "lever.angle"}``: a body's
    ``angle`` or ``rate``, a point's ``x`` or ``y``; columns that are so named need no more. One is
    the time. Units in brackets behind a name count, ``theta (deg)``, else they are SI. `shift` (s,
    or a text with a unit) is added to its times; ``"find"`` looks for the one that fits best.

    Raises:
        NoOverlapError: fewer than three rows of the series lie within the run.
        SceneError: the series can't be used: all mistakes, with their lines and columns.
        ValueError: the runs have nothing in common, or without names are not of one scene.

    """
    if isinstance(second, PlainResult):
        if columns is not None or shift != 0:
            raise ValueError("'columns' and 'shift' are for a measured series")
        return with_methods(Comparison, compare_runs(first, second, names=names))
    if names is not None:
        raise ValueError("'names' are for two runs, 'second' is a series")
    series = fitting.read_series(first.scene, second, columns)
    return with_methods(MeasuredComparison, fitting.against(first, series, shift))


@takes(first=RESULT, second=RESULT)
def joined(first: PlainResult, second: PlainResult) -> Result:
    """Return one result of a run and of one that goes on from it, see `Result.continued`.

    It goes on from the end. Samples, forces, touches, extremes, laps and energies are those of
    both, as of one run. The error is that of the first run, and is known up to where the second
    begins: what the second makes of it nobody measured. The scene is the first one, which runs as
    long as both; settings and versions are those of the first.

    Raises:
        CannotContinueError: something presses where the first run ends.
        ValueError: the second run does not go on from there, or is by another engine; or a contact
            strikes a body that no joint carries, whose displacement is told from each start anew.

    """
    return own_result(join(first, second))


@dataclass(frozen=True, repr=False)
class Fit(Shown, fitting.Fit):
    """Values of a scene that fit a measured series best, with their errors; SI units throughout.

    `scene` has them; fields are those of `fitting.Fit`.
    """

    scene: Scene
    _figure = "fit"

    def summary(self) -> str:
        """Return what the command line tells."""
        return "\n\n".join([fit_text(self), *(f"warning: {told}" for told in self.warnings)])

    @takes()
    def save(self, folder: str | PathLike[str], *, force: bool = False) -> Path:
        """Write ``fit.json`` and ``residuals.csv`` into a folder; return the folder.

        Raises:
            StorageError: the folder can't be written, or holds what is no fit.

        """
        with storage.staged_folder(Path(folder), force=force) as staged:
            storage.save_fit(self, staged)
        return Path(folder)

    def __repr__(self) -> str:
        told = (
            f"{path} {value:.10g} +- {self.standard_errors[path]:.2g}"
            for path, value in self.values.items()
        )
        return f"<Fit to {self.against.series.source}: {', '.join(told)}>"


def _vary(value: Any, _: Any = None) -> Any:
    """Take a path, several, or paths with bounds, which `fitting` reads."""
    many = isinstance(value, Mapping | list | tuple)
    if not (isinstance(value, str) or many) or not all(isinstance(one, str) for one in value):
        raise TypeError(f"expected paths such as ['springs.s.stiffness'], got {told(value)}")
    return value


@takes(scene=given_scene, measured=measured, columns=texts_by_name, vary=_vary, engine=ENGINE)
def fit(
    scene: PlainScene,
    measured: Any,
    columns: Mapping[str, str] | None = None,
    *,
    vary: fitting.Vary,
    engine: str = "exudyn",
    progress: Callable[[float], None] | None = None,
) -> Fit:
    """Find values of a scene that fit measurements best: least squares, by SciPy.

    `measured` and `columns` are as in `compare`. `vary` lists paths of the model file,
    ``["springs.s.stiffness", "initial.angles.lever"]``, or gives them bounds, two numbers (SI) or a
    text with a unit: ``{"springs.s.stiffness": (1, 10)}``, None for those of the key itself. Each
    starts at the scene's own value. Runs go from time 0 to the last row, whatever ``run`` says, at
    the scene's tolerance or a smaller one: it is made smaller until it adds less than a tenth to
    the standard errors. `progress` is called with the part that is done, 0 to 1. Ctrl-C raises
    KeyboardInterrupt.

    Raises:
        NoFitError: no run can be made where the search begins, or it comes to no end.
        NotRepresentableError: the engine can't represent a part of the scene.
        SceneError: the series can't be used, or what is varied is no number of the scene.

    """
    series = fitting.read_series(scene, measured, columns)
    simulate = partial(engines.simulate, engine=engine, measure=False)
    found = fitting.fit(scene, series, vary, simulate, progress)
    return with_methods(Fit, found, scene=own_scene(found.scene))

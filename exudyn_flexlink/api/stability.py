"""How stable a motion is, as a notebook asks for it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from exudyn_flexlink import engines, stability, storage
from exudyn_flexlink.api import with_methods
from exudyn_flexlink.api.figures import Shown, style, style_of
from exudyn_flexlink.api.results import PERIOD
from exudyn_flexlink.api.scenes import ENGINE, Scene, given_scene, own_scene
from exudyn_flexlink.api.sweeps import Simulate, sweep
from exudyn_flexlink.arguments import among, number, takes, values, whole
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables import watched_point
from exudyn_flexlink.report import exponent_text, stability_text
from exudyn_flexlink.result import Result as PlainResult
from exudyn_flexlink.scene import Run
from exudyn_flexlink.scene import Scene as PlainScene
from exudyn_flexlink.sweeps import DOUBTFUL, FAILED, OneRun, Scalar
from exudyn_flexlink.units import Dimension

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _numbers(given: Any, _: Any = None) -> FloatArray:
    """Take numbers."""
    return np.array([number()(one, None) for one in values(given)])


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
            storage.save_stability(self, self.summary(), staged)
        return Path(folder)

    def __repr__(self) -> str:
        return f"<Stability of {self.point}: {exponent_text(self.exponent)}; {self.told}>"


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
    engine: str = "exudyn",
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


def lyapunov(scene: PlainScene, engine: str = "exudyn", **more: Any) -> stability.Exponent:
    """Largest Lyapunov exponent (1/s) of a scene's motion; `more` is as of `stability_of`."""
    return stability_of(scene, engine, **more).exponent


@takes(scene=given_scene, values=_numbers, **LAPS)
def bifurcation(
    scene: Scene,
    path: str,
    values: Iterable[float],
    engine: str = "exudyn",
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

        long = own_scene(scene.changed(run=Run(duration=self.laps * rhythm.lap)))
        return OneRun(row)(long, cast(Any, simulate))

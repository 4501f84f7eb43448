"""Runs and what they mean, as a notebook asks for them, alone or compared with each other.

Runs may also stand beside measurements, with the values that fit these.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from exudyn_flexlink import engines, observables, storage
from exudyn_flexlink.api import with_methods
from exudyn_flexlink.api.figures import (
    RESULT,
    Animation,
    Plots,
    data_frame,
    data_set,
    needed,
    page,
    table_names,
)
from exudyn_flexlink.api.scenes import ENGINE, Scene, api_scene, given_scene
from exudyn_flexlink.arguments import among, instants, number, takes, two_texts, whole
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.continuing import continued
from exudyn_flexlink.observables import (
    Bending,
    BodyMotion,
    Energies,
    Force,
    Happening,
    JointForce,
    LeverResponse,
    PointPath,
    Strike,
    Vibration,
)
from exudyn_flexlink.quantities import Dimension
from exudyn_flexlink.report import failure_text, run_text
from exudyn_flexlink.result import Intervals
from exudyn_flexlink.result import Result as PlainResult
from exudyn_flexlink.shipped import EXUDYN
from exudyn_flexlink.stability import (
    LapDistances,
    Section,
    lap_distances,
    rhythm_of,
    section_by_crank,
)

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset
from collections.abc import Mapping
from functools import partial
from typing import Any, TypeVar

from exudyn_flexlink import fitting
from exudyn_flexlink.api.figures import Shown
from exudyn_flexlink.arguments import excerpt, measured, texts_by_name
from exudyn_flexlink.comparison import Comparison as PlainComparison
from exudyn_flexlink.comparison import compare as compare_runs
from exudyn_flexlink.continuing import joined as join
from exudyn_flexlink.observables import name_of
from exudyn_flexlink.report import against_text, comparison_text, fit_text
from exudyn_flexlink.scene import Scene as PlainScene

POINT = among(lambda result: observables.point_names(result.scene), "point")
TIME = number(Dimension.TIME, at_least=0.0)
PERIOD = number(Dimension.TIME, above=0.0)


@dataclass(frozen=True, repr=False)
class Result(PlainResult):
    """One run: samples, contacts, energies, how it ended, and the scene it belongs to.

    SI units throughout; N is the number of samples. A name that the scene does not have is a
    ValueError that says which there are.
    """

    @takes(point=POINT)
    def path(self, point: str) -> PointPath:
        """Return the motion of a point 'body.point': position, velocity and acceleration."""
        return observables.path(self, point)

    @takes(name=among(lambda result: (*result.scene.bodies, *result.part_names), "body"))
    def body(self, name: str) -> BodyMotion:
        """Return the motion of a body: `angle`, `rate` (N,), `position`, `velocity` (N, 2).

        A rod of a flexible link goes by its name among the `part_names`, ``"link 2"``.
        """
        return observables.body_motion(self, name)

    @takes(name=among(lambda result: result.scene.joints, "joint"))
    def joint(self, name: str) -> JointForce:
        """Return the `force` (N, 2) in a joint and its `error` (N,), and the torque of its drives.

        Of a revolute joint also its `angle` and `rate` (N,).

        Raises:
            ValueError: no force of it is kept.

        """
        return observables.joint_force(self, name)

    @takes(name=among(observables.forces_of, "force"))
    def force(self, name: str) -> Force:
        """Return any force or torque, its `values` (N,) or (N, 2), and its `error` (N,).

        The name is that of the summary: ``"contact force of strike"``, ``"joint force of crank"``.
        """
        return observables.force_of(self, name)

    @takes(time=instants)
    def at(self, time: ArrayLike) -> Samples:
        """Return what the run was at instants (M,) s, between samples too.

        Angles and places are cubics through those of the samples around and their rates; forces,
        energies and all else go straight from one sample to the next. Where something jumps there
        is a sample on both sides, and at that instant itself the later one counts.

        Raises:
            ValueError: one of them is not in the run.

        """
        return Samples(self, np.atleast_1d(time))

    @takes(every=PERIOD)
    def resampled(self, every: float) -> Samples:
        """Return what the run was at instants evenly `every` (s) apart, as a spectrum needs them.

        They begin with the first sample. See `at`. It is no Result, as strikes, extremes and
        errors of a run are not those of such instants.
        """
        return Samples(self, observables.even_instants(self.time, every))

    @takes(name=among(lambda result: observables.bent_links(result.scene), "flexible body"))
    def link(self, name: str) -> Bending:
        """Return how a flexible link is bent: `moment`, `stress`, `strain` (N, H) of its hinges."""
        return observables.bending(self, name)

    @takes(contact=among(lambda result: result.scene.all_contacts, "contact"))
    def strikes(self, contact: str) -> Rows[Strike]:
        """Return the strikes of a contact in order, each a burst of touches: a list.

        Its `to_dataframe()` is a table of pandas, as of `touches` and `happenings`.
        """
        columns = partial(storage.strike_columns, self, contact)
        return Rows(observables.strikes(self, contact), columns)

    @takes()
    def happenings(self) -> Rows[Happening]:
        """Return all that happens, in order: a list of `time` (s), `what` and `where`.

        Touches, lift-offs, impacts, joints that turn back, rests by dry friction, laps.
        """
        return Rows(observables.happenings(self), partial(storage.happening_columns, self))

    @takes(body=among(lambda result: observables.struck_bodies(result.scene), "struck body"))
    def lever(self, body: str) -> LeverResponse:
        """Return the motion of a struck body: angle or displacement, and that of its tip."""
        return observables.lever_response(self, observables.struck_bodies(self.scene)[body])

    @takes(name=among(lambda result: result.intervals, "contact or joint with clearance"))
    def touches(self, name: str) -> Touches:
        """Return every contact of a joint with clearance, or of one of the scene's, as columns.

        Of a sleeve `pair` says which point met which wall: an index into
        ``result.sleeves[name].pairs``. `to_dataframe()` has the largest gap of each flight, too.
        """
        columns = partial(storage.touch_columns, self, name)
        return with_methods(Touches, self.intervals[name], columns=columns)

    @takes(at=TIME, turns=number(above=0.0), duration=PERIOD)
    def continued(
        self,
        at: float | None = None,
        *,
        turns: float | None = None,
        duration: float | str | None = None,
    ) -> Scene:
        """Return the scene that goes on from this run's sample next to `at` (s), or from its end.

        It runs for so many `turns` of the crank or a `duration`, by its own clock; left out, as
        long as this one did. In minimal coordinates what presses goes on to press; other runs can't
        go on from such an instant. `joined` makes one result of both runs.

        Raises:
            CannotContinueError: something presses then, and the run is not in minimal coordinates;
                the text says when nothing does.
            SceneError: it can't run so long.
            ValueError: turns and a duration; or turns, and the scene has no revolute joint.

        """
        scene = api_scene(continued(self, at))
        if turns is not None and duration is not None:
            raise ValueError("'turns' and 'duration' exclude each other: give one of both")
        if turns is not None:
            crank = observables.crank_joint(scene)
            if crank is None:
                raise ValueError("the scene has no revolute joint whose turns count: give duration")
            return scene.with_({"run.turns": turns, "run.of": crank})
        return scene if duration is None else scene.with_({"run.duration": duration})

    @takes(angle=number(Dimension.ANGLE), point=POINT, after=TIME)
    def poincare(self, angle: float = 0.0, point: str | None = None, after: float = 0.0) -> Section:
        """Return where a point is, and how fast, whenever the crank passes an angle (rad).

        The point is the watched one if left out; from `after` (s) on.

        Raises:
            ValueError: the scene has no crank.

        """
        return section_by_crank(self, angle, point, after)

    @takes(lap=PERIOD, point=POINT, after=TIME)
    def lap_distances(
        self, lap: float | None = None, point: str | None = None, after: float = 0.0
    ) -> LapDistances:
        """Return how far a point is in each lap from where it was one to eight laps before.

        A lap takes `lap` (s), or as long as a drive of one speed takes for a turn. Up to the
        horizon of the run (`error`) that tells of the motion, after it of the solver, too.

        Raises:
            NoRhythmError: nothing tells what a lap is.

        """
        return lap_distances(self, rhythm_of(self.scene, lap).lap, point, after)

    @takes(after=TIME)
    def vibration(self, after: float = 0.0) -> Vibration:
        """Return how the watched point is off its ideal place, from `after` (s) on."""
        return observables.vibration(self, after)

    @takes(name=among(table_names, "point, body, contact or joint"), every=PERIOD)
    def to_dataframe(self, name: str | None = None, *, every: float | None = None) -> DataFrame:
        """Return a table: of a point's path, a struck body, a flexible link's moments, or touches.

        Without a name all that is told at every sample: bodies and points, answers of struck
        bodies, forces, energies; as ``lever.angle_rad``, ``link.end.x_m``, ``energy.kinetic_J``,
        ``crank.joint_force_x_N``.

        Samples are closer where more happens, and stand on both sides of a jump. With `every` (s)
        rows are evenly so far apart, as a spectrum needs them; touches stay one a row.

        Columns carry their units, as in the CSV files of a saved run. Needs pandas.

        Raises:
            ImportError: pandas is not installed.

        """
        return data_frame(
            self, name, None if every is None else observables.even_instants(self.time, every)
        )

    def to_xarray(self) -> Dataset:
        """Return all samples, poses, forces and energies, as one dataset. Needs xarray.

        Raises:
            ImportError: xarray is not installed.

        """
        return data_set(self)

    @cached_property
    def plot(self) -> Plots:
        """The figures, by name: ``result.plot.coordinates()``; ``dir(result.plot)`` lists them."""
        return Plots(self)

    @takes(
        other=RESULT,
        names=two_texts,
        begin=TIME,
        end=TIME,
        speed=number(above=0.0),
        fps=number(above=0.0),
        width=whole(1),
    )
    def animate(
        self,
        path: str | PathLike[str] | None = None,
        *,
        other: PlainResult | None = None,
        names: tuple[str, str] | None = None,
        begin: float | None = None,
        end: float | None = None,
        slow: str | None = None,
        speed: float | None = None,
        fps: float | None = None,
        width: int | None = None,
        force: bool = False,
        progress: Callable[[float], None] | None = None,
    ) -> Animation:
        """Return the run as an animation, which a notebook shows; with `path` write it, too.

        The ending of `path` says how: ``.html``, ``.gif`` or ``.mp4``; see `Animation.save`, also
        for `force` and `progress`. `other` is a run that is shown over this one, `names` are those
        of both. `begin` and `end` are in s. `slow` asks for slow motion around the strikes of a
        contact, or the touches in a joint with clearance: its name, or ``"strike:2"`` for the
        second. `speed` is how many seconds of the run pass in one of the film; a GIF or a video has
        `fps` frames in a second, and is `width` pixels wide.

        Raises:
            FilmError: what is asked for can't be shown, or not in that format.
            StorageError: the file can't be written, or may not be replaced.

        """
        from exudyn_flexlink.animation import FilmError, Filming, Slow, film_of

        asked, filming = None if slow is None else Slow.of(slow), Filming(fps, speed, width)
        film = film_of(self, other, names=names, window=(begin, end), slow=asked)
        if mistakes := filming.mistakes("html"):  # a notebook could not tell them
            raise FilmError("\n".join(mistakes))
        film_shown = Animation(film, filming)
        if path is not None:
            film_shown.save(path, force=force, progress=progress)
        return film_shown

    @takes(every=PERIOD)
    def save(
        self, folder: str | PathLike[str], *, every: float | None = None, force: bool = False
    ) -> Path:
        """Write the run into a folder that `load` reads, whole or not at all; return the folder.

        With `every` (s) rows of its tables are evenly so far apart; ``result.nc`` has all samples.
        An earlier run there is replaced; other files are not, unless `force` says so.

        Raises:
            StorageError: the folder can't be written, or holds what is no run.

        """
        with storage.staged_folder(Path(folder), force=force) as staged:
            storage.save(self, staged, every)
        return Path(folder)

    @takes()
    def report(self, path: str | PathLike[str], *, force: bool = False) -> Path:
        """Write the run as one page of HTML, which loads nothing else; return its path.

        A report there is replaced; another file is not, unless `force` says so.

        Raises:
            StorageError: the file can't be written, or is no report.

        """
        from exudyn_flexlink.page import write_page

        write_page(self, Path(path), force=force)
        return Path(path)

    def summary(self) -> str:
        """Return what the command line tells of the run."""
        end = [] if self.outcome.completed else [failure_text(self)]
        return "\n\n".join(
            [run_text(self), *end, *(f"warning: {warning}" for warning in self.warnings)]
        )

    def __dir__(self) -> list[str]:
        names = (*self.__dataclass_fields__, *vars(PlainResult), *vars(Result))
        return sorted({name for name in names if not name.startswith("_")})

    def __repr__(self) -> str:
        """Return one line: who made it, how it ended, what to be warned of."""
        outcome = self.outcome
        end = "completed" if outcome.completed else f"stopped: {outcome.reason}"
        many = f", {len(self.warnings)} warnings" if len(self.warnings) > 1 else ""
        warned = ", 1 warning" if len(self.warnings) == 1 else many
        return (
            f"<Result '{self.scene.title}' by {self.engine}: {end} at {outcome.time:g} s, "
            f"{len(self.time)} samples{warned}>"
        )

    def _repr_html_(self) -> str:
        from exudyn_flexlink import plots

        return page(self.scene.title, self.summary(), plots.coordinates(self))


Item = TypeVar("Item")


class Tabled:
    """What a run tells one by one, also as a table; `columns` makes its columns by name."""

    columns: Callable[[], Mapping[str, Any]]

    def to_dataframe(self) -> DataFrame:
        """Return a table with a row for each; columns carry their units. Needs pandas."""
        frame: DataFrame = needed("pandas").DataFrame(self.columns())
        return frame


class Rows(Tabled, list[Item]):
    """What a run tells one by one: a list."""

    def __init__(self, items: Iterable[Item], columns: Callable[[], Mapping[str, Any]]) -> None:
        super().__init__(items)
        self.columns = columns


@dataclass(frozen=True, repr=False)
class Touches(Tabled, Intervals):
    """Touches as columns (K,), in order of their begins; iterated, one by one."""

    columns: Callable[[], Mapping[str, Any]]

    def __repr__(self) -> str:
        return f"<Touches: {len(self)}>"


class Samples:
    """A run at instants `time` (M,) s: what its methods of the same names give, at these."""

    def __init__(self, result: Result, time: FloatArray) -> None:
        observables.require_inside(result.time, time)
        self._result, self.time = result, time

    def path(self, point: str) -> PointPath:
        """Return the motion of a point, see `Result.path`."""
        return self._result.path(point).seen_at(self.time)

    def body(self, name: str) -> BodyMotion:
        """Return the motion of a body, see `Result.body`."""
        return self._result.body(name).at(self.time)

    def joint(self, name: str) -> JointForce:
        """Return what acts in a joint, see `Result.joint`."""
        return self._result.joint(name).at(self.time)

    def force(self, name: str) -> Force:
        """Return a force or torque, see `Result.force`."""
        return self._result.force(name).at(self.time)

    def link(self, name: str) -> Bending:
        """Return how a flexible link is bent, see `Result.link`."""
        return self._result.link(name).at(self.time)

    def lever(self, body: str) -> LeverResponse:
        """Return the motion of a struck body, see `Result.lever`."""
        return self._result.lever(body).at(self.time)

    @cached_property
    def energy(self) -> Energies:
        """Energies (M,), J, with what their balance misses."""
        return observables.energies(self._result).at(self.time)

    @takes(
        name=among(lambda samples: table_names(samples._result), "point, body, contact or joint")
    )
    def to_dataframe(self, name: str | None = None) -> DataFrame:
        """Return a table with a row for each instant, see `Result.to_dataframe`. Needs pandas."""
        return data_frame(self._result, name, self.time)

    def __repr__(self) -> str:
        return f"<Samples of '{self._result.scene.title}': {observables.samples_text(self.time)}>"


def api_result(plain: PlainResult) -> Result:
    """Return a result with the methods of this room."""
    return with_methods(Result, plain, scene=api_scene(plain.scene))


@takes(scene=given_scene, engine=ENGINE)
def simulate(
    scene: Scene,
    engine: str = EXUDYN,
    progress: Callable[[float], None] | None = None,
    *,
    measure: bool = True,
) -> Result:
    """Simulate a scene with ``"exudyn"`` or ``"lagrangian"``; a run that fails is a Result, too.

    Its `outcome` says whether it ran to its end. `progress` is called with the part that is done, 0
    to 1. With a tolerance two runs are made, of which the second is finer: it is the result, whose
    `error` is what their distance tells. ``measure=False`` makes one, of which no error is known. A
    run whose own numbers are doubtful warns.

    Ctrl-C ends it after the step under way: what was computed is returned, and `outcome` says that
    it was interrupted. After it the second run, if under way, is given up.

    Raises:
        KeyboardInterrupt: the user had enough before the first step.
        NotRepresentableError: the engine can't represent a part of the scene.

    """
    try:
        made = engines.simulate(scene, engine, progress, measure=measure)
    except engines.LateInterruptError as late:  # all that it has computed is there
        made = late.result
    return api_result(made)


@takes()
def load(folder: str | PathLike[str]) -> Result:
    """Read a saved run.

    Raises:
        StorageError: the folder holds no run, or a file of it is damaged.

    """
    return api_result(storage.load(Path(folder)))


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
        distances = ", ".join(f"{d.signal} {d.rms:.3g} {d.unit}" for d in self.distances)
        if self.outside:
            distances += f"; {self.outside} of {len(self.series.time)} rows are outside the run"
        what = f"{self.result.engine} and {self.series.source}"
        return f"<Comparison of {what}: apart by rms {distances}>"


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
        CannotContinueError: something presses where the first run ends, and it is not in minimal
            coordinates.
        ValueError: the second run does not go on from there, or is by another engine; or a contact
            strikes a body that no joint carries, whose displacement is told from each start anew.

    """
    return api_result(join(first, second))


@dataclass(frozen=True, repr=False)
class Fit(Shown, fitting.Fit):
    """Values of a scene that fit a measured series best, with their errors; SI units throughout.

    `scene` has them; fields are those of `fitting.Fit`.
    """

    scene: Scene
    _figure = "fit"

    def summary(self) -> str:
        """Return what the command line tells."""
        return "\n\n".join([fit_text(self), *(f"warning: {warning}" for warning in self.warnings)])

    @takes()
    def save(self, folder: str | PathLike[str], *, force: bool = False) -> Path:
        """Write ``fit.json`` and ``residuals.csv`` into a folder; return the folder.

        Raises:
            StorageError: the folder can't be written, or holds what is no fit.

        """
        with storage.staged_folder(Path(folder), force=force) as staged:
            storage.save_study(self, staged)
        return Path(folder)

    def __repr__(self) -> str:
        parts = (
            f"{path} {value:.10g} +- {self.standard_errors[path]:.2g}"
            for path, value in self.values.items()
        )
        return f"<Fit to {self.against.series.source}: {', '.join(parts)}>"


def _vary(value: Any, _: Any = None) -> Any:
    """Take a path, several, or paths with bounds, which `fitting` reads."""
    many = isinstance(value, Mapping | list | tuple)
    if not (isinstance(value, str) or many) or not all(isinstance(path, str) for path in value):
        raise TypeError(f"expected paths such as ['springs.s.stiffness'], got {excerpt(value)}")
    return value


@takes(scene=given_scene, measured=measured, columns=texts_by_name, vary=_vary, engine=ENGINE)
def fit(
    scene: PlainScene,
    measured: Any,
    columns: Mapping[str, str] | None = None,
    *,
    vary: fitting.Vary,
    engine: str = EXUDYN,
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
    fitted = fitting.fit(scene, series, vary, simulate, progress)
    return with_methods(Fit, fitted, scene=api_scene(fitted.scene))

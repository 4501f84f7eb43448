"""A sweep: its file with a model and varied paths, the executors of its runs, and its table.

This process, other processes of this machine, or workers of Dask make the runs: all are pools of
`concurrent.futures`. A row of the table is kept as soon as its run is finished.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, ProcessPoolExecutor, wait
from contextlib import AbstractContextManager, closing, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from multiprocessing import connection, current_process, get_context, parent_process
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, Strict, TypeAdapter, ValidationError
from threadpoolctl import threadpool_limits

from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.scene.base import Part, Text
from exudyn_flexlink.scene.wording import mistakes_of
from exudyn_flexlink.shipped import EXUDYN, EngineName, known_names, model_file
from exudyn_flexlink.source import Document, Mistake, SceneError, did_you_mean, load_document
from exudyn_flexlink.sweeps.plan import (
    Design,
    Point,
    Sweep,
    Value,
    Varied,
    drawn,
    grid,
    listed,
    versions,
)
from exudyn_flexlink.sweeps.rows import COLUMNS, FAILED, Row, Scalar, Work

MOST_PROCESSES = 61  # of a pool: the limit on Windows
AHEAD = 2  # tasks for each worker of Dask: the present one and the next
SECONDS_TO_CONNECT = 20  # to Dask's scheduler
ENDED = (
    "the process that ran it ended, as often as it was tried: killed, perhaps for want of memory, "
    "or a crash"
)
NOT_BEGUN = (
    "a process ended before it could begin. A script that sweeps must do so below "
    "\"if __name__ == '__main__':\", since each process reads it again; or give 'workers=1'"
)
NOT_SENT = (
    "what is observed can't be sent to other processes: {}. Put the function into a module, at its "
    "top level, or give 'workers=1'"
)


class CannotStartError(Exception):
    """No process of an executor can do the work at all; the text says why, and what to do."""


@dataclass(frozen=True)
class Pool:
    """Makes the run of a point in a task, and up to `most` tasks at once.

    A task raises `lost` if the process that made the run has ended.
    """

    submit: Callable[[Point], Future[Row]]
    most: int = 1
    lost: type[Exception] = BrokenExecutor


Executor = Callable[[Work], AbstractContextManager[Pool]]
"""Opens a pool for a work, or raises CannotStartError; leaving the pool ends all runs."""


def executor_of(workers: int | None = None, scheduler: str | None = None) -> Executor:
    """Return the executor of the runs: `workers` processes, by default one for every core.

    A single worker is this process itself. A process that is a worker of another pool makes all
    runs itself, since it can't start others (daemonic processes have no children). With the address
    of Dask's `scheduler`, the workers of Dask make the runs.

    Raises:
        ValueError: both are given, or `workers` is less than 1.

    """
    if scheduler is not None:
        if workers is not None:
            raise ValueError("a scheduler has its own workers: give one of both")
        return partial(dask_cluster, scheduler)
    cores = (
        os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1)
    )
    count = len(cores) if workers is None else workers
    if count < 1:
        raise ValueError(f"needs at least one worker, got {count}")
    here = count == 1 or current_process().daemon
    return in_this_process if here else partial(local_processes, count)


def rows_of(executor: Executor, work: Work, points: Sequence[Point]) -> Generator[Row, None, None]:
    """Give a row for every point, each once, in the order in which they are finished.

    If a process ends, any of the present runs may be the cause. So each of these is tried once
    more, alone, when all others are done. Closing the iterator ends all runs.

    Raises:
        CannotStartError: the executor can't do the work.

    """
    lost = yield from _tried(executor, work, points)
    lost = yield from _tried(executor, work, lost, alone=True)
    for point in lost:
        yield Row(point.number, point.id, FAILED, ENDED, 0, 0.0)


def _tried(
    executor: Executor, work: Work, points: Sequence[Point], *, alone: bool = False
) -> Generator[Row, None, list[Point]]:
    """Try points, one at a time if `alone`; return the points whose process ended.

    A pool that has lost a process gets no more points: a new pool takes the waiting points.
    """
    waiting, lost = deque(points), []
    while waiting:
        with executor(work) as pool:
            running: dict[Future[Row], Point] = {}
            most, intact = 1 if alone else pool.most, True
            while running or (waiting and intact):
                try:
                    while intact and waiting and len(running) < most:
                        task = pool.submit(waiting[0])  # which may raise
                        running[task] = waiting.popleft()
                except pool.lost:
                    intact = False
                for task in wait(running, return_when=FIRST_COMPLETED).done:
                    point = running.pop(task)
                    try:
                        row = task.result()
                    except pool.lost:
                        intact = False
                        lost.append(point)
                    except CannotStartError:
                        raise
                    except Exception as error:
                        raise CannotStartError(f"a process can't do the work: {error}") from error
                    else:
                        yield row
    return lost


@contextmanager
def in_this_process(work: Work) -> Iterator[Pool]:
    """Yield a pool that makes each run in this process, as soon as it gets the point."""

    def submit(point: Point) -> Future[Row]:
        made: Future[Row] = Future()
        made.set_result(work.row(point))
        return made

    yield Pool(submit)


# --- processes of this machine ----------------------------------------------------------------


@contextmanager
def local_processes(count: int, work: Work) -> Iterator[Pool]:
    """Yield a pool of `count` processes of this machine, which end with it.

    Raises:
        CannotStartError: the work can't be sent to other processes, or they can't begin.

    """
    try:
        sent = pickle.dumps(work)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise CannotStartError(NOT_SENT.format(error)) from error
    count = min(count, MOST_PROCESSES)
    context = get_context("spawn")  # a fork would share threads and locks of the engines
    pool = ProcessPoolExecutor(count, context, _begin, (sent,))

    def submit(point: Point) -> Future[Row]:
        with _starting():
            return pool.submit(_local_row, point)

    try:
        with _starting():
            first = pool.submit(int)
        yield Pool(submit, count)
        if isinstance(first.exception(), BrokenExecutor):
            raise CannotStartError(NOT_BEGUN)
    finally:
        for process in [*(pool._processes or {}).values()]:
            process.terminate()  # its present run is not wanted any more
        pool.shutdown(cancel_futures=True)


@contextmanager
def _starting() -> Iterator[None]:
    """Start processes inside this context, so that they neither get Ctrl-C nor fail to begin.

    Ctrl-C is for the sweep as a whole. A new process reads the main script again. This fails if the
    script is not a file, such as '<stdin>': then the process is made to read nothing.
    """
    main, masks = sys.modules["__main__"], hasattr(signal, "pthread_sigmask")  # not on Windows
    file = getattr(main, "__file__", None)
    absent = file is not None and not os.path.exists(file)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if masks else set()
    if absent:
        del main.__file__
    try:
        yield
    finally:
        if absent:
            main.__file__ = file
        if masks:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


_sent: list[bytes] = []  # the work, in a process of the pool


def _begin(sent: bytes) -> None:
    """Begin a process of the pool."""
    _sent.append(sent)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    threadpool_limits(limits=1)


def _local_row(point: Point) -> Row:
    """Make the run of a point, in a process of the pool."""
    try:
        work: Work = pickle.loads(_sent[0])
    except Exception as error:  # this process can't import a function of the work
        raise CannotStartError(NOT_SENT.format(error)) from error
    return work.row(point)


def _end_with_parent() -> None:
    """End this process when the process that started it ends, for whatever reason."""
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os.kill(os.getpid(), signal.SIGTERM)  # its handler waits for a run that is being saved


# --- workers of Dask --------------------------------------------------------------------------


@contextmanager
def dask_cluster(address: str, work: Work) -> Iterator[Pool]:
    """Yield a pool of the workers of a scheduler at an address such as ``tcp://host:8786``.

    When the pool closes, runs that did not begin are cancelled. If a worker ends, Dask gives its
    tasks to other workers; if that happens to a task a few times, Dask gives the task up.

    Raises:
        CannotStartError: there is no such scheduler, no worker that fits, or no Dask.

    """
    try:
        distributed = import_module("distributed")
        client = distributed.Client(address, timeout=SECONDS_TO_CONNECT)
    except ImportError as error:
        needs = "this needs Dask: pip install 'exudyn-flexlink[cluster]'"
        raise CannotStartError(needs) from error
    except (OSError, ValueError, TimeoutError) as error:
        raise CannotStartError(f"no scheduler answers at {address}: {error}") from error
    with client:
        with suppress(TimeoutError):  # a worker that ended may be on its way back
            client.wait_for_workers(1, timeout=SECONDS_TO_CONNECT)
        workers = client.nthreads()
        if not workers:
            raise CannotStartError(
                f"the scheduler at {address} has no workers; start 'dask worker'"
            )
        many = [name for name, threads in workers.items() if threads != 1]
        if many:
            raise CannotStartError(
                f"the worker at {many[0]} has more than one thread, which the engines do not "
                "share; start workers with '--nworkers auto --nthreads 1'"
            )
        pool = client.get_executor(pure=False)
        submit = partial(pool.submit, _dask_row, work, versions())
        try:
            yield Pool(submit, AHEAD * len(workers), distributed.KilledWorker)
        finally:
            pool.shutdown(wait=False)


def _dask_row(work: Work, needed: Mapping[str, str], point: Point) -> Row:
    """Make the run of a point on a worker; a worker that joined late may have other packages."""
    if versions() != needed:
        raise RuntimeError(f"this worker has {versions()}")
    return work.row(point)


Keeper = Callable[[Row, int], None]
"""Called with each row, and the number of rows so far."""


@dataclass(frozen=True)
class SweepTable:
    """The table of a sweep: rows in the order of their points, and the `values` of these points.

    `points` is the number of points of the plan. An interrupted sweep has fewer rows. Numbers are
    in SI.
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
        """Names of all observables, in the order of their first row."""
        return tuple(dict.fromkeys(name for row in self.rows for name in row.numbers))

    def count(self, status: str) -> int:
        """Number of rows with this status: done, doubtful or failed."""
        return sum(row.status == status for row in self.rows)

    def columns(self) -> dict[str, list[Scalar]]:
        """Return all columns by name: the run, its values, its status, its observables.

        None means that a number does not exist.
        """
        columns: dict[str, list[Scalar]] = {
            column: [getattr(row, name) for row in self.rows] for column, name in COLUMNS.items()
        }
        first = {column: columns.pop(column) for column in ("run", "id")}
        varied: dict[str, list[Scalar]] = {
            varied.column: [values[i] for values in self.values]
            for i, varied in enumerate(self.varied)
        }
        seen = {name: [row.numbers.get(name) for row in self.rows] for name in self.observables}
        return first | varied | columns | seen


def table_of(
    title: str,
    engine: str,
    varied: Iterable[Varied],
    points: Iterable[tuple[str, Iterable[Value]]],
    rows: Mapping[str, Row],
) -> SweepTable:
    """Return the table of points, each an id and values; `rows` are by id, some may be missing."""
    every = [(identity, tuple(values)) for identity, values in points]
    made = [(rows[identity], values) for identity, values in every if identity in rows]
    return SweepTable(
        title,
        engine,
        tuple(varied),
        len(every),
        tuple(row for row, _ in made),
        tuple(values for _, values in made),
    )


def carried_out(
    sweep: Sweep,
    work: Work,
    executor: Executor,
    known: Mapping[str, Row],
    keep: Keeper,
) -> SweepTable:
    """Make the runs of all points that have no row yet.

    `known` are rows of an earlier part of the sweep, by the id of their points. Ctrl-C ends the
    sweep; the table then lacks the rows of the other points.

    Raises:
        CannotStartError: no process can do the work.

    """
    rows = {point.id: known[point.id] for point in sweep.points if point.id in known}
    missing = [point for point in sweep.points if point.id not in rows]
    coming = rows_of(executor, work, missing)
    with suppress(KeyboardInterrupt), closing(coming):
        for row in coming:
            rows[row.id] = row
            keep(row, len(rows))
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
    engine: EngineName = Field(EXUDYN, description="who solves it")
    grid: Mapping[str, Any] | None = Field(
        None, description="values by path, each with every value of the others"
    )
    list: tuple[Any, ...] | None = Field(None, description="points, each with values by path")
    latin_hypercube: Drawn | None = Field(None, description="points that fill ranges evenly")
    random: Drawn | None = Field(None, description="points drawn independently")


@dataclass(frozen=True)
class Study:
    """A study that was read: its scene, its varied paths, and `mistakes` in these."""

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
        study_file = TypeAdapter(StudyFile).validate_python(document.data)
    except ValidationError as error:
        mistakes = mistakes_of(error, StudyFile, document.data, ())
        raise SceneError(document, mistakes) from None
    scene = _scene(document, study_file, settings, allow_outside)
    mistakes = []
    design = _design(study_file, mistakes)
    return Study(document, scene, study_file.engine, design, tuple(mistakes))


def _design(file: StudyFile, mistakes: list[Mistake]) -> Design | None:
    if file.grid is not None:
        return grid(file.grid, ("grid",), mistakes)
    if file.list is not None:
        return listed(file.list, ("list",), mistakes)
    kind = "random" if file.latin_hypercube is None else "latin_hypercube"
    distribution: Drawn = getattr(file, kind)
    return drawn(
        kind,
        distribution.ranges,
        distribution.count,
        (kind, "ranges"),
        mistakes,
        seed=distribution.seed,
    )


def _scene(
    document: Document, file: StudyFile, settings: Iterable[str], allow_outside: bool
) -> Scene:
    """Load the model; mistakes in the study's settings get their places in the study."""
    model = _model(document, file.model, allow_outside)
    try:
        return load_scene(model, [*file.settings, *settings], allow_outside)
    except SceneError as error:
        of_settings = [
            Mistake(("set", file.settings.index(text)), mistake.message, mistake.hint)
            for mistake in error.mistakes
            if (text := error.document.setting_of(mistake.path)) in file.settings
        ]
        if len(of_settings) == len(error.mistakes):
            raise SceneError(document, of_settings) from None
        raise


def _model(document: Document, name: str, allow_outside: bool) -> Path:
    """Return the file of a study's model; refuse one that is outside the study's folder."""

    def mistake(message: str, hint: str = "") -> SceneError:
        return SceneError(document, [Mistake(("model",), message, hint)])

    folder = (document.folder or Path()).resolve()
    try:
        file = (folder / name).resolve()
        exists = file.is_file()
    except (OSError, ValueError, RuntimeError) as error:
        raise mistake(f"can't read the model: {error}") from None
    shipped = None if exists or Path(name).suffix else model_file(name)
    if shipped is not None:
        return shipped
    if not allow_outside and not file.is_relative_to(folder):
        raise mistake("the model must be in the study's folder, or below it", "'--allow-outside'")
    if not exists:
        near = did_you_mean(name, known_names())
        raise mistake(f"no file '{name}' in the study's folder, and no such model{near}")
    return file

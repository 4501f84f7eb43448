"""Files of studies: comparisons, work-precision studies, studies of stability, fits, sweeps.

Each study is a document in JSON with tables beside it; `report` makes their contents. All
functions raise OSError if the folder can't be written.

A sweep on disk has a plan, a journal to which each row is added at once, and a table.
``sweep.json`` is the plan; it exists from the beginning. The table is made from the journal when
all rows are there, or when the sweep is interrupted.
"""

from __future__ import annotations

import json
import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import current_thread, main_thread
from typing import Any

from exudyn_flexlink.accuracy import Study
from exudyn_flexlink.comparison import Comparison
from exudyn_flexlink.fitting import Against, Fit
from exudyn_flexlink.report import (
    Document,
    accuracy_document,
    against_document,
    comparison_document,
    fit_document,
    stability_document,
)
from exudyn_flexlink.result import Result
from exudyn_flexlink.stability import Stability
from exudyn_flexlink.storage.documents import (
    JOURNAL,
    Journal,
    check_readable,
    in_json,
    journal_in,
    locked,
    other_version,
    rows_of,
    write_csv,
    write_document,
)
from exudyn_flexlink.storage.replacing import (
    ACCURACY,
    COMPARISON,
    FIT,
    FORMAT,
    KINDS,
    MANIFEST,
    PROGRAM,
    STABILITY,
    SWEEP,
    StorageError,
    check_regular,
    read_manifest,
    staged_folder,
)
from exudyn_flexlink.storage.run import save
from exudyn_flexlink.sweeps import (
    FAILED,
    Row,
    Sweep,
    SweepTable,
    Varied,
    table_of,
    versions,
)

AnyStudy = Comparison | Against | Study | Stability | Fit
DOCUMENTS: Mapping[Any, tuple[str, Callable[..., Document]]] = {
    Comparison: (COMPARISON, comparison_document),
    Against: (COMPARISON, against_document),
    Study: (ACCURACY, accuracy_document),
    Stability: (STABILITY, stability_document),
    Fit: (FIT, fit_document),
}
"""Name of the document of each kind of study, and the function that makes it."""


def save_study(study: AnyStudy, folder: Path, **options: Any) -> None:
    """Write the document of a study, and its tables, into an existing folder.

    `options` go to the function that makes the document, see `comparison_document`.
    """
    name, document_of = next(DOCUMENTS[kind] for kind in DOCUMENTS if isinstance(study, kind))
    write_document(folder, name, *document_of(study, **options))


SERIES = "series"
AGAIN = "sweep again"
ENDINGS = ("SIGINT", "SIGTERM", "SIGHUP")  # signals that end a process; Windows has no SIGHUP


@dataclass(frozen=True)
class SeriesKeeper:
    """Saves runs, each in its own folder in ``series``; it can be sent to other processes."""

    folder: Path

    def __call__(self, result: Result, name: str) -> None:
        """Save a run over an earlier run of the same name, before the process may end.

        Raises:
            StorageError: the run can't be written, or this machine does not see the sweep's folder.

        """
        if not (self.folder / SWEEP).is_file():
            raise StorageError(f"can't save series: there is no {self.folder / SWEEP} to see here")
        check_regular(self.folder, f"{SERIES}/{name}/{MANIFEST}")
        with (
            _ends_later(),
            staged_folder(self.folder / SERIES / name, force=True) as staged,
        ):
            save(result, staged)


@contextmanager
def _ends_later() -> Iterator[None]:
    """Delay Ctrl-C and requests to end until the context ends; only the main thread gets them."""
    asked: list[int] = []
    numbers = [getattr(signal, name) for name in ENDINGS if hasattr(signal, name)]
    taken = numbers if current_thread() is main_thread() else []
    before = {number: signal.signal(number, lambda n, _: asked.append(n)) for number in taken}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        for number in asked:
            signal.raise_signal(number)


@contextmanager
def open_journal(
    folder: Path, sweep: Sweep, *, resume: bool = False, force: bool = False, series: bool = False
) -> Iterator[Journal]:
    """Begin a sweep in a folder, or continue it; two processes never work in one folder.

    `force` begins again, whatever the folder holds. With `series` each run is saved; a row whose
    run was not saved is computed again.

    Raises:
        StorageError: the folder holds something else, or rows of this sweep without `resume`; it
            can't be written, or another process sweeps in it.

    """
    folder = Path(folder)
    with locked(folder):
        if series:
            check_regular(folder, f"{SERIES}/{MANIFEST}")
        if force or not _goes_on(folder, sweep, resume=resume):
            with staged_folder(folder, force=force, what=KINDS[SWEEP]) as staged:
                _write_plan(staged, sweep, completed=False)
                (folder / JOURNAL).unlink(missing_ok=True)
        with journal_in(folder, {point.id for point in sweep.points}) as journal:
            if series:
                journal.known = {k: x for k, x in journal.known.items() if _has_series(folder, x)}
            yield journal


def load_sweep(folder: Path) -> SweepTable:
    """Read the table of a sweep, even if the sweep is incomplete.

    Raises:
        StorageError: the folder holds no sweep, or one of its files is damaged.

    """
    folder = Path(folder)
    plan = _read_plan(folder)
    if plan is None:
        raise StorageError(f"{folder} has no {SWEEP}; give the folder of a sweep")
    content = _content(folder / JOURNAL)
    if content is None:
        raise StorageError(f"{folder} has no {JOURNAL}: no run of the sweep is there")
    rows = rows_of(content, folder / JOURNAL)
    try:
        varied = [Varied(**entry) for entry in plan["varied"]]
        return table_of(plan["title"], plan["engine"], varied, plan["points"], rows)
    except (KeyError, TypeError, ValueError) as error:
        why = f"no {error} in it" if isinstance(error, KeyError) else "it is not what was written"
        raise StorageError(f"{folder / SWEEP} is damaged: {why}; {AGAIN}") from error


def is_sweep(folder: Path) -> bool:
    """Tell whether a folder holds a sweep."""
    return (Path(folder) / SWEEP).is_file()


def save_table(sweep: Sweep, table: SweepTable, folder: Path) -> None:
    """Write ``sweep.json`` and ``table.csv`` into a folder, or raise OSError."""
    _write_plan(folder, sweep, completed=table.whole)
    write_csv(folder / "table.csv", table.columns())


def _write_plan(folder: Path, sweep: Sweep, *, completed: bool) -> None:
    """Write the plan in one line, because it may have many points."""
    (folder / SWEEP).write_bytes(in_json(_plan(sweep) | {"completed": completed}))


def _plan(sweep: Sweep) -> dict[str, Any]:
    return {
        "program": PROGRAM,
        "format": FORMAT,
        "title": sweep.scene.title,
        "engine": sweep.engine,
        "measure": sweep.measure,
        "observed": sweep.observed,
        "versions": versions(),
        "varied": sweep.varied,
        "scene": sweep.scene.to_data(),
        "points": [[point.id, point.values] for point in sweep.points],
    }


def _read_plan(folder: Path) -> dict[str, Any] | None:
    """Read the plan in a folder; None if there is none. Refuse a damaged one or another version."""
    file = folder / SWEEP
    content = _content(file)
    if content is None:
        return None
    try:
        plan = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise StorageError(f"{file} is damaged: {error}; {AGAIN}") from error
    if not isinstance(plan, dict) or plan.get("program") != PROGRAM:
        raise StorageError(f"{file} was not written by {PROGRAM}; give the folder of a sweep")
    if other := other_version(plan):
        raise StorageError(f"{file} was written by {other}; {AGAIN}")
    return plan


def _content(file: Path) -> bytes | None:
    """Read a file; None if there is none. Refuse an unreadable file."""
    check_readable(file)
    try:
        return file.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise StorageError(f"can't read {file}: {error.strerror or error}") from error


def _goes_on(folder: Path, sweep: Sweep, *, resume: bool) -> bool:
    """Tell whether this sweep continues in a folder or begins there; refuse if neither may be."""
    plan, rows = _read_plan(folder), _content(folder / JOURNAL)
    if plan is None and rows is not None:
        raise StorageError(
            f"{folder} has a {JOURNAL}, but no {SWEEP} that tells of which sweep: put that back, "
            "or force it, which begins anew",
            forcible=True,
        )
    if plan is None:
        earlier = read_manifest(folder)
        if earlier is not None:
            raise StorageError(
                f"{folder} holds a {earlier.words}; choose another place, or remove that yourself"
            )
        return False
    if difference := _difference(plan, sweep):
        raise StorageError(
            f"{folder} holds another sweep, {difference}; choose another place, or "
            "force it, which begins anew",
            forcible=True,
        )
    count = (rows or b"").count(b"\n")
    if count and not resume:  # without rows nothing can be lost
        raise StorageError(
            f"{folder} holds {count} of the {len(sweep)} rows of this very sweep; resume it, or "
            "force it, which begins anew",
            forcible=True,
        )
    return True


def _difference(plan: Mapping[str, Any], sweep: Sweep) -> str:
    """Name the first difference of an earlier sweep from this one; empty if there is none."""
    now = json.loads(in_json(_plan(sweep)))
    words = {
        "title": "of another model",
        "engine": "by another engine",
        "varied": "of other values",
        "scene": "of another scene",
        "measure": "measured otherwise",
        "points": "of other points",
        "observed": "with other observables",
        "versions": "by other versions of the packages",
    }
    return next((words_for for key, words_for in words.items() if plan.get(key) != now[key]), "")


def _has_series(folder: Path, row: Row) -> bool:
    """Tell whether the run of a row is saved whole; a failed row may have no run."""
    return row.status == FAILED or (folder / SERIES / row.id).is_dir()

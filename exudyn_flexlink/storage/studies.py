"""Studies to files: comparisons, a work-precision study, one of stability, a fit.

Each is a document in JSON, with tables beside it. SI numbers, units in the names. Of a comparison
they hold what two runs tell: what each tells by itself is in the summary of that run. All raise
OSError where the folder can't be written.

A sweep on disk: its plan, a journal to which each row is added at once, and its table.

``sweep.json`` is the plan and stands there from the beginning. Tables are written from the journal
once no more rows come.
"""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import current_thread, main_thread
from typing import Any

import numpy as np

from exudyn_flexlink.accuracy import Advice, Errors, Point, Source, Study, advise, dominating
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.comparison import Comparison, Statistics
from exudyn_flexlink.fitting import Against, Fit
from exudyn_flexlink.observables import Deviation, Measure, measures
from exudyn_flexlink.result import ForceDeviation, Result
from exudyn_flexlink.stability import Exponent, Stability, section_columns
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
    column_of,
    table_of,
    versions,
)


def save_comparison(
    comparison: Comparison, folder: Path, tolerance: float | None = None, *, whole: bool = True
) -> None:
    """Write ``comparison.json`` and ``comparison.csv`` into an existing folder.

    `tolerance` (m) is what the deviation up to the horizon was held against, if anything; `whole`
    tells whether all runs were made, also those that tell the errors.
    """
    ended = all(seen.result.outcome.completed for seen in comparison.both)
    verdict: dict[str, Any] = {"completed": whole and ended, "tolerance_m": tolerance}
    if tolerance is not None:
        verdict["exceeded"] = comparison.exceeds(tolerance)
    data, columns = _comparison(comparison) | verdict, _comparison_columns(comparison)
    write_document(folder, COMPARISON, data, {"comparison.csv": columns})


def _comparison_columns(comparison: Comparison) -> dict[str, FloatArray]:
    """Instants, deviation, the watched point and the levers of both runs, by name and unit."""
    columns = {"t_s": comparison.time, "deviation_m": comparison.deviation.distance}
    for seen in comparison.both:
        name = seen.name.replace(" ", "_")
        columns |= {f"{name}_{axis}_m": seen.position[:, i] for i, axis in enumerate("xy")}
        columns |= {
            f"{name}_{body}_{seen.levers[body].measure.name}": values
            for body, values in seen.answers.items()
        }
    return columns


def _comparison(comparison: Comparison) -> dict[str, Any]:
    return {
        "title": comparison.second.result.scene.title,
        "runs": [seen.name for seen in comparison.both],
        "point": comparison.point,
        "judged_by": list(comparison.judged_by),
        "end_s": comparison.time[-1],
        "horizon_s": comparison.horizon,
        "first_strike_s": comparison.first_strike,
        "deviation": {
            "up_to_the_first_strike": _deviation(comparison.before_strike),
            "up_to_the_horizon": _deviation(comparison.judged),
            "whole_run": _deviation(comparison.deviation),
        },
        "forces_up_to_the_horizon": {
            name: _force(force) for name, force in comparison.forces.items()
        },
        "levers": {
            f"{body}_largest_difference_{comparison.measures[body].unit}": np.abs(apart).max()
            for body, apart in comparison.answer_differences.items()
        },
        "beyond_the_horizon": _beyond(comparison),
    }


def _deviation(part: Deviation | None) -> dict[str, float] | None:
    if part is None or not len(part.time):
        return None
    at = float(part.time[int(part.distance.argmax())])
    return {"largest_m": part.largest, "largest_at_s": at, "rms_m": part.rms}


def _force(deviation: ForceDeviation) -> dict[str, Any]:
    """How far a force is apart, in its unit; None where the runs have no such instant."""
    parts = {"free": deviation.free, "in_contact": deviation.touching}
    return {
        "unit": deviation.unit,
        "instants_of_touches_s": deviation.instants,
        **{
            when: None if part is None else {**vars(part), "relative": part.relative}
            for when, part in parts.items()
        },
    }


def _beyond(comparison: Comparison) -> dict[str, Any] | None:
    if comparison.beyond is None:
        return None
    return {
        seen.name: _statistics(part, comparison.measures)
        for seen, part in zip(comparison.both, comparison.beyond, strict=True)
    }


def _statistics(part: Statistics, measures: Mapping[str, Measure]) -> dict[str, Any]:
    keys = ("mean", "rms", "least", "greatest")
    levers = {f"{body}_{measures[body].name}": list(ends) for body, ends in part.levers.items()}
    return {f"{key}_m": getattr(part, key).tolist() for key in keys} | levers


def save_accuracy(study: Study, sentence: str, folder: Path) -> None:
    """Write ``accuracy.json`` and ``accuracy.csv``; `sentence` is the recommendation in words."""
    data = _accuracy(study) | {"recommendation": sentence}
    points = [_point(point) for point in study.points]
    columns = [name for name in points[0] if name != "settings"] if points else []
    table = {name: [point[name] for point in points] for name in columns}
    write_document(folder, ACCURACY, data, {"accuracy.csv": table})


def _accuracy(study: Study) -> dict[str, Any]:
    runs, largest = study.runs, dominating(study.sources)
    return {
        "title": study.scene.title,
        "completed": not runs.interrupted,
        "judged_by": list(study.judged_by),
        "target_m": study.target,
        "reference": {
            "run": study.reference.label,
            "processor_time_s": study.reference.processor,
        },
        "check": {
            "run": study.check.label if study.check else "",
            "independent": study.independent,
        },
        "floor_m": study.floor,
        "floor_force_relative": study.force_floor,
        "end_s": study.end,
        "judged_until_s": study.until,
        "horizon": study.horizon,
        "points": [_point(point) for point in study.points],
        "own": None if study.model_point is None else study.model_point.label,
        "sources": [_source(source, measures(study.scene)) for source in study.sources],
        "dominating": None if largest is None else largest.kind,
        "still": study.still,
        "advice": _advice(advise(study)),
        "left_out": runs.left_out,
        "interrupted": runs.interrupted,
        "wall_time_s": runs.spent,
        "scene": study.scene.to_data(),
    }


def _point(point: Point) -> dict[str, Any]:
    return {
        "method": point.method.name,
        "engine": point.method.engine,
        "knob": point.method.knob,
        "value": point.value,
        "settings": dict(point.method.settings),
        "processor_time_s": point.processor,
        "repeats": point.repeats,
        "steps": point.steps,
        **_errors(point.errors),
        "below_floor": point.below_floor,
    }


def _errors(errors: Errors) -> dict[str, float | str]:
    return {
        "error_rms_m": errors.rms,
        "error_largest_m": errors.largest,
        "error_point": errors.worst,
        "error_force_relative": errors.force,
        "error_force": errors.worst_force,
    }


def _source(source: Source, measures_by: Mapping[str, Measure]) -> dict[str, Any]:
    peaks = {f"{body}_{measures_by[body].name}": x for body, x in source.errors.levers.items()}
    return {
        "kind": source.kind,
        **_errors(source.errors),
        "peaks": peaks,
        "order": source.order,
        "at_most": source.at_most,
        "cost_of_the_finer_model": source.dearer,
    }


def _advice(advice: Advice) -> dict[str, Any]:
    return {
        "choice": None if advice.choice is None else _point(advice.choice),
        "limited_by": None if advice.limit is None else advice.limit.kind,
        "target_below_floor": advice.below_floor,
    }


def save_stability(study: Stability, sentence: str, folder: Path) -> None:
    """Write ``stability.json`` and tables of growth, laps, section and spectrum into a folder.

    `sentence` says in words what the motion does.
    """
    tables = {
        "growth.csv": _growth(study.exponent),
        "laps.csv": _laps(study),
        "section.csv": section_columns(study.section),
    }
    for axis, spectrum in (("x", study.vibration.x), ("y", study.vibration.y)):
        columns = {"frequency_Hz": spectrum.frequency, "power_m2_per_Hz": spectrum.power}
        tables[f"spectrum_{axis}.csv"] = columns
    write_document(folder, STABILITY, _stability(study) | {"told": sentence}, tables)


def _stability(study: Stability) -> dict[str, Any]:
    laps = study.repeating
    return {
        "title": study.run.scene.title,
        "completed": True,
        "engine": study.run.engine,
        "point": study.point,
        "lap_s": study.rhythm.lap,
        "laps_of_a_cycle": study.rhythm.laps,
        "after_s": study.after,
        "end_s": float(study.run.time[-1]),
        "tolerance_m": study.tolerance,
        "exponent": _exponent(study.exponent),
        "exponent_at_a_tenth_of_the_tolerance": study.tighter and _exponent(study.tighter),
        "horizon_s": study.horizon,
        "repeats_after_laps": laps and laps.laps,
        "settles_by_factor": laps and laps.settles,
        "laps_apart_m": laps and laps.least,
        "laps_before": laps and laps.nearest,
        "laps_known_until_s": laps and laps.until,
        "places_of_section": study.section.distinct(study.limit),
        "places_apart_by_m": study.limit,
        "lines_Hz": {"x": study.vibration.x.lines, "y": study.vibration.y.lines},
        "lines_off_ideal_place": study.vibration.off_ideal,
        "scene": study.run.scene.to_data(),
    }


def _exponent(exponent: Exponent) -> dict[str, Any]:
    return {
        "value_per_s": exponent.value,
        "uncertainty_per_s": exponent.uncertainty,
        "solver_per_s": exponent.noise,
        "sign": exponent.sign,
        "neighbours_apart_m": exponent.distance,
        "batch_means_per_s": exponent.means.tolist(),
    }


def _growth(exponent: Exponent) -> dict[str, Any]:
    """Growth of neighbours' distance in each stretch; `counts` is 0 while they settle."""
    counts = np.arange(len(exponent.rates)) >= exponent.settled
    return {
        "begin_s": exponent.times[:-1],
        "end_s": exponent.times[1:],
        "growth_per_s": exponent.rates,
        "counts": counts.astype(float),
    }


def _laps(study: Stability) -> dict[str, Any]:
    laps = study.laps
    rows = zip(laps.before.tolist(), laps.largest, strict=True)
    return {"lap": laps.laps.astype(float), "end_s": laps.end} | {
        f"from_{before}_before_m": row for before, row in rows
    }


def save_against(beside: Against, folder: Path) -> None:
    """Write ``comparison.json`` and ``comparison.csv`` into an existing folder."""
    data = _held(beside) | {"completed": beside.result.outcome.completed}
    write_document(folder, COMPARISON, data, {"comparison.csv": _beside(beside)})


def save_fit(fitted: Fit, folder: Path) -> None:
    """Write ``fit.json`` and ``residuals.csv`` into an existing folder."""
    write_document(folder, FIT, _fit(fitted), {"residuals.csv": _beside(fitted.against)})


def _beside(beside: Against) -> dict[str, FloatArray]:
    """Instants of the run, and of each quantity what was measured, computed, and the difference."""
    columns = {"t_s": beside.time}
    for name, apart in beside.differences.items():
        column = column_of(name, beside.series.signals[name].unit)
        columns[f"{column}_measured"] = beside.measured[name]
        columns |= {f"{column}_computed": beside.computed[name], f"{column}_difference": apart}
    return columns


def _fit(fitted: Fit) -> dict[str, Any]:
    accuracy = fitted.against.result.scene.accuracy
    return _held(fitted.against) | {
        "completed": True,
        "parameters": [vars(parameter) for parameter in fitted.parameters],
        "values": fitted.values,
        "standard_errors": fitted.standard_errors,
        "correlations": fitted.correlations,
        "moved_by_integrator": fitted.integrator,
        "tolerance_m": accuracy.tolerance,
        "step_s": accuracy.step,
        "runs": fitted.runs,
        "warnings": fitted.warnings,
        "scene": fitted.scene.to_data(),
    }


def _held(beside: Against) -> dict[str, Any]:
    return {
        "title": beside.result.scene.title,
        "engine": beside.result.engine,
        "series": beside.series.source,
        "shift_s": beside.shift,
        "rows": len(beside.time),
        "rows_outside_the_run": beside.outside,
        "distances": [vars(distance) for distance in beside.distances],
        "own_error_m": beside.result.error.largest,
        "horizon_s": beside.result.error.known_until,
    }


SERIES = "series"
AGAIN = "sweep again"
ENDINGS = ("SIGINT", "SIGTERM", "SIGHUP")  # Windows has no SIGHUP


@dataclass(frozen=True)
class SeriesKeeper:
    """Saves runs, each in a folder of its own in ``series``; can be sent to other processes."""

    folder: Path

    def __call__(self, result: Result, name: str) -> None:
        """Save a run, in place of an earlier one of the same name, before the process may end.

        Raises:
            StorageError: that can't be written, or this machine does not see the sweep's folder.

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
    """Let Ctrl-C and requests to end wait for what is inside; only the main thread takes them."""
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
    """Begin a sweep in a folder, or go on with it; two processes never work in one.

    `force` begins anew, whatever stands there. With `series` runs are wanted whole: a row whose run
    was not saved is made again.

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
    """Read the table of a sweep, also of one that is not whole.

    Raises:
        StorageError: the folder holds no sweep, or a file of it is damaged.

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
    """Write the plan in one line: its points may be many."""
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
    """Read the plan in a folder, None if none is; refuse a damaged one, or of another version."""
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
    """Read a file, None if there is none; refuse one that can't be read."""
    check_readable(file)
    try:
        return file.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise StorageError(f"can't read {file}: {error.strerror or error}") from error


def _goes_on(folder: Path, sweep: Sweep, *, resume: bool) -> bool:
    """Tell whether this sweep goes on in a folder, or begins there; refuse where neither may be."""
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
    if count and not resume:  # without rows there is nothing to lose
        raise StorageError(
            f"{folder} holds {count} of the {len(sweep)} rows of this very sweep; resume it, or "
            "force it, which begins anew",
            forcible=True,
        )
    return True


def _difference(plan: Mapping[str, Any], sweep: Sweep) -> str:
    """Say in what an earlier sweep differs: the first thing that does; empty if nothing does."""
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
    """Tell whether the run of a row is there whole; one that failed may have none."""
    return row.status == FAILED or (folder / SERIES / row.id).is_dir()

"""A work-precision study to files: everything as JSON, its points as a table."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from exudyn_flexlink.accuracy import Advice, Errors, Point, Source, Study, advise, dominating
from exudyn_flexlink.observables import Measure, measures
from exudyn_flexlink.storage.documents import write_document
from exudyn_flexlink.storage.errors import ACCURACY


def save_accuracy(study: Study, sentence: str, folder: Path) -> None:
    """Write ``accuracy.json`` and ``accuracy.csv`` into an existing folder.

    `sentence` is the recommendation in words.

    Raises:
        OSError: the folder can't be written.

    """
    data = accuracy_data(study) | {"recommendation": sentence}
    points = [_point(point) for point in study.points]
    columns = [name for name in points[0] if name != "settings"] if points else []
    table = {name: [point[name] for point in points] for name in columns}
    write_document(folder, ACCURACY, data, {"accuracy.csv": table})


def accuracy_data(study: Study) -> dict[str, Any]:
    """Return a study as plain data: SI numbers, units in the names."""
    runs, largest = study.runs, dominating(study.sources)
    return {
        "title": study.scene.title,
        "completed": not runs.interrupted,
        "judged_by": list(study.judged_by),
        "target_m": study.target,
        "reference": {
            "run": study.reference.told,
            "processor_time_s": study.reference.processor,
        },
        "check": {"run": study.check.told if study.check else "", "independent": study.independent},
        "floor_m": study.floor,
        "floor_force_relative": study.force_floor,
        "end_s": study.end,
        "judged_until_s": study.until,
        "horizon": study.horizon,
        "points": [_point(point) for point in study.points],
        "own": None if study.own is None else study.own.told,
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


def _source(source: Source, told: Mapping[str, Measure]) -> dict[str, Any]:
    peaks = {f"{body}_{told[body].name}": x for body, x in source.errors.levers.items()}
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

"""A run as tables of pandas, and as a dataset of xarray."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables import point_names, struck_bodies
from exudyn_flexlink.result import Result
from exudyn_flexlink.storage import (
    all_columns,
    arrays_of,
    attributes_of,
    lever_columns,
    touch_columns,
    trajectory_columns,
)

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset


def data_frame(result: Result, name: str | None) -> DataFrame:
    """Return what is known of a point, a struck body, a contact or a joint as a table; or all."""
    columns = all_columns(result) if name is None else _columns(result, name)
    frame: DataFrame = needed("pandas").DataFrame(columns)
    return frame


def _columns(result: Result, name: str) -> Mapping[str, FloatArray]:
    struck = struck_bodies(result.scene)
    if name in struck:
        return lever_columns(result, struck[name])
    if name in result.intervals:
        return touch_columns(result, name)
    return trajectory_columns(result, name)


def told_names(result: Result) -> list[str]:
    """Names of what a table can tell of: struck bodies, contacts, joints with clearance, points."""
    return [*struck_bodies(result.scene), *result.intervals, *point_names(result.scene)]


def data_set(result: Result) -> Dataset:
    """Return all arrays as one dataset, with the names, dimensions and units of the saved file."""
    arrays = {
        name: (array.dimensions, array.values, dict(array.attributes))
        for name, array in arrays_of(result).items()
    }
    found: Dataset = needed("xarray").Dataset(arrays, attrs=attributes_of(result))
    return found


def needed(package: str) -> Any:
    """Import an optional package.

    Raises:
        ImportError: it is not installed; the message says how it is.

    """
    try:
        return import_module(package)
    except ImportError as error:
        raise ImportError(
            f"this needs {package}: pip install {package}, or pip install 'exudyn-flexlink[tables]'"
        ) from error

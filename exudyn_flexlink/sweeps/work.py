"""The runs of one point: what every executor does, in whatever process."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import count
from math import isnan
from time import perf_counter
from typing import Any

from exudyn_flexlink.loading import document_of_data, scene_of
from exudyn_flexlink.result import INTERRUPTED, Result
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.source import Document, SceneError, dotted
from exudyn_flexlink.sweeps.plan import Point, Sweep
from exudyn_flexlink.sweeps.rows import (
    COLUMNS,
    DONE,
    DOUBTFUL,
    FAILED,
    Observe,
    Row,
    RunFailedError,
    Scalar,
    Simulate,
)

LONGEST_REASON = 500  # characters: a row is read by people

Keep = Callable[[Result, str], None]
"""Saves a run under a name."""


@dataclass(frozen=True)
class Work:
    """What is the same at all points, and sent to each process once.

    `document` is the scene as plain data, with the points of its files in it; `simulate` runs a
    scene, `observe` tells of the runs what goes into the row; `keep`, if there is one, saves each.
    """

    document: Document
    simulate: Simulate
    observe: Observe
    keep: Keep | None = None
    allow_outside: bool = False

    def row(self, point: Point) -> Row:
        """Make the runs of a point; whatever goes wrong in them is told in the row."""
        began = perf_counter()
        warned: list[str] = []
        numbers: Mapping[str, Scalar] = {}
        names = (point.id if k == 1 else f"{point.id}-{k}" for k in count(1))

        def simulate(scene: Scene) -> Result:
            result = self.simulate(scene)
            if result.outcome.reason == INTERRUPTED:  # and with it the sweep: it is no row
                raise KeyboardInterrupt
            end = [] if result.outcome.completed else [f"a run {result.outcome.told}"]
            warned.extend([*result.warnings, *end])
            if self.keep is not None:
                self.keep(result, next(names))
            return result

        try:
            scene = scene_of(self.document, point.settings, self.allow_outside)
            numbers = _checked(self.observe(scene, simulate))
        except SceneError as error:
            first = error.mistakes[0]
            why = f"{dotted(first.path)}: {first.message}" if first.path else first.message
        except RunFailedError as error:
            why = str(error)
        except MemoryError:
            why = "not enough memory"
        except Exception as error:  # of an engine that refuses the scene, or of the user's function
            why = f"{type(error).__name__}: {error}"
        else:
            why = ""
        status = FAILED if why else DOUBTFUL if warned else DONE
        told = shortened(why or "; ".join(dict.fromkeys(warned)), LONGEST_REASON)
        wall = perf_counter() - began
        return Row(point.number, point.id, status, told, len(warned), wall, numbers)


def work_of(sweep: Sweep, simulate: Simulate, observe: Observe, keep: Keep | None = None) -> Work:
    """Return what the processes of a sweep do at each point; see `Work`."""
    data = document_of_data(sweep.scene.to_data(), "the scene")
    document = replace(data, folder=sweep.scene.document.folder)  # of files that are varied
    return Work(document, simulate, observe, keep, sweep.allow_outside)


def shortened(text: str, most: int) -> str:
    """Return a text of no more than so many characters, with dots for what is left out."""
    return text if len(text) <= most else f"{text[: most - 4]} ..."


def _checked(observed: Mapping[str, Any]) -> Mapping[str, Scalar]:
    """Return observables as what a row holds; refuse names that are no texts, or are taken."""
    for name in observed:
        if not isinstance(name, str):
            raise TypeError(f"a column's name is a text, no {type(name).__name__}")
        if name in COLUMNS:
            raise ValueError(f"every sweep has a column '{name}': give yours another name")
    return {name: _plain(value) for name, value in observed.items()}


def _plain(value: Any) -> Scalar:
    """Return a number, text, bool or None, or raise TypeError; None stands for nan."""
    if hasattr(value, "item"):  # of numpy
        value = value.item()
    if isinstance(value, float) and isnan(value):
        return None
    if value is None or isinstance(value, float | int | bool | str):
        return value
    raise TypeError(f"a row holds numbers and texts, no {type(value).__name__}")

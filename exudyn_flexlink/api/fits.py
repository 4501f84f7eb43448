"""Values of a scene that fit measurements best, as a notebook asks for them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

from exudyn_flexlink import engines, fitting, storage
from exudyn_flexlink.api import with_methods
from exudyn_flexlink.api.figures import Shown
from exudyn_flexlink.api.scenes import ENGINE, Scene, given_scene, own_scene
from exudyn_flexlink.arguments import measured, takes, texts_by_name, told
from exudyn_flexlink.report import fit_text
from exudyn_flexlink.scene import Scene as PlainScene


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

"""Slot-driven flexible mechanisms with impact: from a YAML model to numbers one can trust.

A scene is a model that comes with the program, by name (`fl.model_names()` lists all); a file; or a
dict:

>>> import exudyn_flexlink as fl
>>> scene = fl.load_scene("no_clearance", tolerance=1e-6, turns=0.6)
>>> scene = scene.with_({"bodies.link.rods": 3, "drives.motor.value": "12 rad/s"})
>>> rigid = fl.idealise(scene, without=["flexibility"])
>>> rigid
<Scene 'Extensible flexible link on a double track, striking a sprung lever': ...>

A run is a result, in SI units; so is one that fails, which says when, why and what to try:

>>> result = fl.simulate(scene)
>>> result
<Result 'Extensible flexible link on a double track, ...' by exudyn: completed at 0.314159 s, ...>
>>> s = result.path("link.end")
>>> s.time.shape, s.position.shape, s.velocity.shape
((...,), (..., 2), (..., 2))
>>> [strike] = result.strikes("strike")
>>> print(f"struck at {strike.begin:.3f} s with {strike.approach_speed:.2f} m/s")
struck at 0.262 s with 1.5... m/s
>>> lever = result.lever("lever")
>>> bool(abs(lever.farthest) > 0.1)
True
>>> touches = result.touches("strike")  # or a sleeve with clearance: every touch of its walls
>>> bool(touches.peak_force.max() > 1)
True
>>> bool(abs(result.energy.residual).max() < 1e-6)
True

Figures are matplotlib's; a notebook shows them, and `savefig` writes them:

>>> result.plot.coordinates().savefig("s.pdf")
>>> folder = result.save("runs/a")
>>> fl.load(folder)
<Result ...>

So does an animation: a player in a notebook, and a page, a GIF or a video as a file:

>>> film = result.animate("s.html", slow="strike")
>>> film
<Animation of 'Extensible flexible link on a double track, ...' by exudyn: 0 s to 0.314159 s>

The second opinion is the hand-written Lagrangian:

>>> fl.compare(result, fl.simulate(scene, engine="lagrangian"))
<Comparison of exudyn and lagrangian: all 8 named points apart by ... m at most>
>>> fl.compare(fl.simulate(rigid), result, names=("rigid", "flexible"))
<Comparison of rigid and flexible: ...>

So are measurements, in a CSV file or a table; `fl.fit` finds the values that fit them best:

>>> measured = {"t": s.time[::20], "x": s.position[::20, 0]}
>>> fl.compare(result, measured, columns={"x": "link.end.x"})
<Comparison of exudyn and the table: apart by rms link.end.x ... m>

Many runs, each a row of one table, on all cores (here on one):

>>> table = fl.sweep(rigid, {"drives.motor.value": "10, 12 rad/s"}, workers=1)
>>> table
<Sweep of drives.motor.value: 2 rows...>
>>> fast = table.columns()["link.end.greatest_speed_m_per_s"]
>>> bool(fast[1] > fast[0])
True

``result.to_dataframe("link.end")`` and ``result.to_xarray()`` give the samples as tables, with
pandas and xarray: ``pip install 'exudyn-flexlink[tables]'``.

The names are imported when they are first used, so that the command line answers at once.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from exudyn_flexlink.animation import FilmError as FilmError
    from exudyn_flexlink.api.exudyn_systems import exudyn_system as exudyn_system
    from exudyn_flexlink.api.figures import Animation as Animation
    from exudyn_flexlink.api.results import Comparison as Comparison
    from exudyn_flexlink.api.results import Fit as Fit
    from exudyn_flexlink.api.results import MeasuredComparison as MeasuredComparison
    from exudyn_flexlink.api.results import Result as Result
    from exudyn_flexlink.api.results import compare as compare
    from exudyn_flexlink.api.results import fit as fit
    from exudyn_flexlink.api.results import joined as joined
    from exudyn_flexlink.api.results import load as load
    from exudyn_flexlink.api.results import simulate as simulate
    from exudyn_flexlink.api.scenes import Equilibrium as Equilibrium
    from exudyn_flexlink.api.scenes import Scene as Scene
    from exudyn_flexlink.api.scenes import equilibrium as equilibrium
    from exudyn_flexlink.api.scenes import idealise as idealise
    from exudyn_flexlink.api.scenes import load_scene as load_scene
    from exudyn_flexlink.api.studies import Branches as Branches
    from exudyn_flexlink.api.studies import LinearModel as LinearModel
    from exudyn_flexlink.api.studies import Sensitivities as Sensitivities
    from exudyn_flexlink.api.studies import Simulate as Simulate
    from exudyn_flexlink.api.studies import Stability as Stability
    from exudyn_flexlink.api.studies import SweepTable as SweepTable
    from exudyn_flexlink.api.studies import bifurcation as bifurcation
    from exudyn_flexlink.api.studies import linearised as linearised
    from exudyn_flexlink.api.studies import load_sweep as load_sweep
    from exudyn_flexlink.api.studies import lyapunov as lyapunov
    from exudyn_flexlink.api.studies import sensitivity as sensitivity
    from exudyn_flexlink.api.studies import stability_of as stability_of
    from exudyn_flexlink.api.studies import sweep as sweep
    from exudyn_flexlink.continuing import CannotContinueError as CannotContinueError
    from exudyn_flexlink.engines import NotRepresentableError as NotRepresentableError
    from exudyn_flexlink.engines.exudyn.redundant.opened import ExudynSystem as ExudynSystem
    from exudyn_flexlink.fitting import NoFitError as NoFitError
    from exudyn_flexlink.fitting import NoOverlapError as NoOverlapError
    from exudyn_flexlink.linear import NotLinearError as NotLinearError
    from exudyn_flexlink.sensitivities import NoSensitivityError as NoSensitivityError
    from exudyn_flexlink.shipped import model_names as model_names
    from exudyn_flexlink.source import SceneError as SceneError
    from exudyn_flexlink.stability import ImpossibleLapsError as ImpossibleLapsError
    from exudyn_flexlink.stability import NoRhythmError as NoRhythmError
    from exudyn_flexlink.stability import StoppedError as StoppedError
    from exudyn_flexlink.stability import TooShortError as TooShortError
    from exudyn_flexlink.storage import StorageError as StorageError
    from exudyn_flexlink.sweeps import CannotStartError as CannotStartError
    from exudyn_flexlink.sweeps import standard_row as standard_row

    __version__: str

_HOMES = {
    "animation": ("FilmError",),
    "api.exudyn_systems": ("ExudynSystem", "exudyn_system"),
    "api.figures": ("Animation",),
    "api.results": (
        "Comparison",
        "Fit",
        "MeasuredComparison",
        "Result",
        "compare",
        "fit",
        "joined",
        "load",
        "simulate",
    ),
    "api.scenes": ("Equilibrium", "Scene", "equilibrium", "idealise", "load_scene"),
    "api.studies": (
        "Branches",
        "LinearModel",
        "Sensitivities",
        "Simulate",
        "Stability",
        "SweepTable",
        "bifurcation",
        "linearised",
        "load_sweep",
        "lyapunov",
        "sensitivity",
        "stability_of",
        "sweep",
    ),
    "continuing": ("CannotContinueError",),
    "engines": ("NotRepresentableError",),
    "fitting": ("NoFitError", "NoOverlapError"),
    "linear": ("NotLinearError",),
    "sensitivities": ("NoSensitivityError",),
    "shipped": ("model_names",),
    "source": ("SceneError",),
    "stability": ("ImpossibleLapsError", "NoRhythmError", "StoppedError", "TooShortError"),
    "storage": ("StorageError",),
    "sweeps": ("CannotStartError", "standard_row"),
}
_NAMES = ["__version__", *(name for names in _HOMES.values() for name in names)]
if not TYPE_CHECKING:  # type checkers take the imports above
    __all__ = [*_NAMES]  # noqa: PLE0604


def __getattr__(name: str) -> Any:
    if name == "__version__":
        shipped = import_module(f"{__name__}.shipped")
        return shipped.version_of(shipped.THIS)
    for home, names in _HOMES.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{home}"), name)
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(_NAMES)

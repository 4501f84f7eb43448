"""What comes with the program: engines, models, versions, and what else users choose by name.

The models are in the folder `models` of an installation or a checkout. Names stand here, and not
beside what they are names of: a help text must be there at once, and figures take long to import.
"""

from __future__ import annotations

from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Literal, NamedTuple

THIS = "exudyn-flexlink"  # name of the package to pip

EngineName = Literal["exudyn", "lagrangian"]


class Engine(NamedTuple):
    """Name of an engine in texts, and the module that runs it."""

    title: str
    module: str


EXUDYN: EngineName = "exudyn"
"""The engine that runs where none is named."""

LAGRANGIAN: EngineName = "lagrangian"
"""The engine whose tight run is compared with other runs."""

ENGINES: dict[str, Engine] = {
    EXUDYN: Engine("Exudyn", "exudyn_flexlink.engines.exudyn.run"),
    LAGRANGIAN: Engine("Lagrangian", "exudyn_flexlink.engines.lagrangian.run"),
}

# What can be left out of a scene, see `effects`.
EFFECT_NAMES = ("clearance", "flexibility", "impact", "friction", "damping")

# Figures of a run, see `plots`; of formats and styles the first is the usual one.
FIGURE_NAMES = (
    *("coordinates", "polar", "lever", "mechanism"),
    *("guide_contact", "energy", "forces", "bending"),
)
FIGURE_FORMATS = ("png", "pdf", "svg")
FIGURE_STYLES = ("screen", "print")

FILM_FORMATS = ("mp4", "gif", "html")
LAPS, AFTER = 24, 4  # of a study of stability; in the latter the motion settles


@cache
def version_of(package: str) -> str:
    """Return the version of an installed package; 'not installed' of one that is not."""
    try:
        return version(package)
    except PackageNotFoundError:  # this program may run from its source
        return "not installed"


HERE = Path(__file__).parent
PUBLISHED = ".published.yaml"
"""Ending of a file of published numbers, which stands beside its model."""


class NoModelsError(FileNotFoundError):
    """The installation is damaged: it has no models; the text says where they should be."""


def models_folder() -> Path:
    """Return the folder of the models.

    Raises:
        NoModelsError: the installation has none.

    """
    for folder in (HERE / "models", HERE.parent / "models"):
        if (folder / "no_clearance.yaml").is_file():
            return folder
    raise NoModelsError(f"the models are missing beside {HERE}; install the program again")


def model_names() -> list[str]:
    """Names of the models, such as ``no_clearance`` or ``textbook/whitworth``."""
    folder = models_folder()
    files = (file for file in folder.rglob("*.yaml") if not file.name.endswith(PUBLISHED))
    return sorted(file.relative_to(folder).with_suffix("").as_posix() for file in files)


def known_names() -> list[str]:
    """Names of the models, and the last parts of them, by which they may be called, too."""
    return [called for name in model_names() for called in (name, name.split("/")[-1])]


def model_file(name: str) -> Path | None:
    """Return the file of a model by its name, or by the last part of it; None if there is none."""
    names = model_names()
    names_alike = [known for known in names if name in (known, known.split("/")[-1])]
    names_alike = [name] if name in names else names_alike
    return models_folder() / f"{names_alike[0]}.yaml" if len(names_alike) == 1 else None


def benchmark_files() -> dict[str, Path]:
    """Files of published numbers by the names of their models, such as ``n_four_bar``."""
    files = sorted((models_folder() / "benchmarks").glob(f"*{PUBLISHED}"))
    return {file.name.removesuffix(PUBLISHED): file for file in files}

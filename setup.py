"""The packages of the wheel; everything else stands in pyproject.toml."""

from setuptools import find_namespace_packages, find_packages, setup

MODELS = "exudyn_flexlink.models"  # the folder `models`, as data of the package
FOLDERS = [f"{MODELS}.{name}" for name in find_namespace_packages("models")]

setup(
    packages=[*find_packages(include=["exudyn_flexlink*"]), MODELS, *FOLDERS],
    package_dir={MODELS: "models"},
    package_data={
        "exudyn_flexlink": ["py.typed"],
        "": ["*.yaml", "*.csv", "*.json"],
        "exudyn_flexlink.animation": ["player/*"],
        "exudyn_flexlink.page": ["templates/*"],
    },
)

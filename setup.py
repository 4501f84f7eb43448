"""The packages of the wheel; everything else stands in pyproject.toml."""

from setuptools import find_packages, setup

MODELS = "exudyn_flexlink.models"  # the folder `models`, as data of the package

setup(
    packages=[*find_packages(include=["exudyn_flexlink*"]), MODELS],
    package_dir={MODELS: "models"},
    package_data={"exudyn_flexlink": ["py.typed"], MODELS: ["**/*"]},
)

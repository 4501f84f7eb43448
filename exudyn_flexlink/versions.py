"""Versions of this program, and of packages that it uses."""

from __future__ import annotations

from functools import cache
from importlib.metadata import PackageNotFoundError, version

THIS = "exudyn-flexlink"  # name of the package to pip


@cache
def version_of(package: str) -> str:
    """Return the version of an installed package; 'not installed' of one that is not."""
    try:
        return version(package)
    except PackageNotFoundError:  # this program may run from its source
        return "not installed"

"""Machine code for the inner functions where numba is installed (extra ``fast``), else Python."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any, TypeVar, cast

numba: ModuleType | None
try:
    import numba
except ImportError:
    numba = None

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Compile the function at its first call, and keep the code on disk; the same without numba."""
    return function if numba is None else cast(F, numba.njit(cache=True)(function))


def version() -> str:
    """Version of numba; empty without it."""
    return "" if numba is None else str(numba.__version__)

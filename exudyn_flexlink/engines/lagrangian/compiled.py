"""Machine code for the inner functions where numba is installed (extra ``fast``), else Python.

Compiled functions contain those that they call, but numba keeps one on disk until its own file
changes. Here it is dropped when any file of this package with compiled functions changes.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar, cast

numba: ModuleType | None
try:
    import numba
except ImportError:
    numba = None

MARKED = re.compile(rb"^@(compiled|inner)$", re.MULTILINE)
REORDERED = {"reassoc", "contract"}  # sums may be reordered; what is not a number stays so

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Compile the function at its first call, and keep the code on disk; the same without numba."""
    return _compiled(function)


def inner(function: F) -> F:
    """As `compiled`, of a function that compiled ones alone call.

    To take arguments from Python apart would be a large part of what there is to compile.
    """
    return _compiled(function, no_cpython_wrapper=True)


def _compiled(function: F, **options: bool) -> F:
    if numba is None:
        return function
    dispatcher = numba.njit(
        cache=True, no_cfunc_wrapper=True, error_model="numpy", fastmath=REORDERED, **options
    )(function)
    with suppress(AttributeError):  # compiling switched off, or kept elsewhere than in files
        dispatcher._cache._cache_file._source_stamp = _STAMP
    return cast(F, dispatcher)


def kept(function: Callable[..., Any]) -> bool:
    """Tell whether machine code of a compiled function lies on disk, or none will ever be made."""
    if numba is None:
        return True
    with suppress(AttributeError, OSError):
        return bool(function._cache._cache_file._load_index())  # type: ignore[attr-defined]
    return True


def version() -> str:
    """Version of numba; empty without it."""
    return "" if numba is None else str(numba.__version__)


def fingerprint(folder: Path) -> str:
    """Fingerprint of all sources in a folder that have compiled functions."""
    sources = [file.read_bytes() for file in sorted(folder.glob("*.py"))]
    return sha256(b"".join(source for source in sources if MARKED.search(source))).hexdigest()


_STAMP = fingerprint(Path(__file__).parent)

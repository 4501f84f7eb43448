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
from typing import Any, Literal, TypeVar, cast

numba: ModuleType | None
try:
    import numba
except ImportError:
    numba = None

MARKED = re.compile(rb"^@(compiled|inner)$", re.MULTILINE)
REORDERED = {"reassoc", "contract"}  # sums may be reordered; what is not a number stays so

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Compile the function at its first call; the same without numba.

    The code is kept on disk where there is a place for it, else compiled in every run.
    """
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
        no_cfunc_wrapper=True, error_model="numpy", fastmath=REORDERED, **options
    )(function)
    with suppress(AttributeError):  # compiling switched off, or kept elsewhere than in files
        with suppress(RuntimeError):  # neither this folder nor the user's can be written
            dispatcher.enable_caching()
        dispatcher._cache._cache_file._source_stamp = _STAMP
    return cast(F, dispatcher)


Compilation = Literal["none", "once", "every run"]
"""What is still to be compiled: nothing, code that is then kept, or code that is not."""


def compilation(function: Callable[..., Any]) -> Compilation:
    """Tell what the next call of a compiled function will begin with."""
    dispatcher: Any = function
    with suppress(AttributeError, OSError):  # no numba, compiling switched off, kept elsewhere
        if dispatcher.signatures:
            return "none"
        if dispatcher.stats.cache_path is None:
            return "every run"
        return "none" if dispatcher._cache._cache_file._load_index() else "once"
    return "none"


def version() -> str:
    """Version of numba; empty without it."""
    return "" if numba is None else str(numba.__version__)


def fingerprint(folder: Path) -> str:
    """Fingerprint of all sources in a folder that have compiled functions."""
    sources = [file.read_bytes() for file in sorted(folder.glob("*.py"))]
    return sha256(b"".join(source for source in sources if MARKED.search(source))).hexdigest()


_STAMP = fingerprint(Path(__file__).parent)

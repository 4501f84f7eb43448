"""Machine code for the inner functions where numba is installed (extra ``fast``), else Python.

Compiled functions contain those that they call, but numba keeps one on disk until its own file
changes. So the code lies in a folder named by all sources that have compiled functions, and by what
compiled them: another source, another folder.
"""

from __future__ import annotations

import gc
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from hashlib import sha256
from importlib import import_module
from pathlib import Path
from platform import machine
from shutil import rmtree
from typing import Any, TypeVar, cast

from exudyn_flexlink.engines import Compilation
from exudyn_flexlink.integrate import clock, collocation, control

if sys.platform != "win32":
    import fcntl

numba: Any
try:
    import numba
except ImportError:
    numba = None

MARKED = re.compile(rb"^@(compiled|inner|inlined)$|by_(address|reference)\(", re.MULTILINE)
REORDERED = {"reassoc", "contract"}  # sums may be reordered; what is not a number stays so
PREFIX = "numba-"
PARTS = "parts-"  # begins the name of a folder in which processes share one compilation
SELDOM = (100_000, 50, 50)  # objects between looks, looks between larger ones, and those of all

_BY_ADDRESS: set[Callable[..., Any]] = set()  # compiled by this process, or read from disk

R = TypeVar("R", bound=tuple[Any, ...])
V = TypeVar("V")
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


def inlined(function: F) -> F:
    """As `inner`, of a function that few call: it becomes part of those, and is not compiled alone.

    LLVM works through a called function once more in each of its callers, and theirs.
    """
    return _compiled(function, no_cpython_wrapper=True, inline="always")


def by_reference(record: type[R], name: str, module: str) -> tuple[Any, Callable[..., R]]:
    """Return a type of this name, and what makes one of a record's fields in compiled functions.

    Compiled functions hand on its address alone; of a tuple each number is an argument of its own,
    and to hand on a hundred of them is most of what there is to compile. The caller's module must
    keep the type by its name. Without numba the record itself is made.
    """
    if numba is None:
        return record, record
    structref: Any = import_module("numba.experimental.structref")

    def named_briefly(self: Any, fields: Any) -> None:
        """Names of functions hold those of all types, and types within them at full length."""
        numba.types.StructRef.__init__(self, fields)
        self.name = f"{name}_{sha256(self.name.encode()).hexdigest()[:16]}"

    members = {"__module__": module, "__init__": named_briefly}
    kind = structref.register(type(name, (numba.types.StructRef,), members))

    def made(*fields: Any) -> R:
        return record(*fields)

    structref.define_constructor(made, kind, list(cast(Any, record)._fields))
    structref.define_boxing(kind, structref.StructRefProxy)
    return kind, made


def for_python(given: Callable[..., V]) -> Callable[..., V]:
    """Let Python call what makes a record of a tuple of its fields, as `by_reference` makes them.

    Handed over as one address it takes a microsecond, and as a tuple a tenth of a millisecond.
    """

    def called(*fields: Any) -> V:
        # The types are those of every such record: to ask for those of functions takes 0.3 ms.
        for code in getattr(given, "overloads", {}).values():
            return cast(V, code.entry_point(fields))
        return given(fields)

    return called


def _itself(value: V) -> V:
    """Return the value: Python's counting of who keeps an array costs next to nothing."""
    return value


def _borrowed(_typing: Any, value: Any) -> Any:
    """An array, or those of a tuple, which a compiled function does not keep: something else must.

    To count up and down who keeps an array is half of what equations of motion would take.
    """
    types = import_module("numba.types")

    def lent(context: Any, builder: Any, kind: Any, given: Any) -> Any:
        if isinstance(kind, types.BaseTuple):
            parts = [
                lent(context, builder, part, builder.extract_value(given, i))
                for i, part in enumerate(kind)
            ]
            return context.make_tuple(builder, kind, parts)
        if not isinstance(kind, types.Array):
            context.nrt.incref(builder, kind, given)
            return given
        view = context.make_array(kind)(context, builder, given)
        view.meminfo, view.parent = (part.type(None) for part in (view.meminfo, view.parent))
        return view._getvalue()

    def code(context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        return lent(context, builder, value, given[0])

    return value(value), code


def by_address(function: F, signature: Any) -> F:
    """Compile a function, of numba's signature, for itself: compiled ones are given it to call.

    They do not contain it, as they do what they call by name, and LLVM works through it only once;
    and what is given may be another function of the same types. A call takes 3 ns more.
    """
    _BY_ADDRESS.add(function)
    options = {"cache": FOLDER is not None, "error_model": "numpy", "fastmath": REORDERED}
    with _kept_in(FOLDER):
        return cast(F, numba.cfunc(signature, **options)(function))


def compiling() -> bool:
    """Tell whether functions are compiled: numba is installed, and not switched off."""
    return numba is not None and not numba.config.DISABLE_JIT


borrowed = import_module("numba.extending").intrinsic(_borrowed) if compiling() else _itself


@contextmanager
def seldom_collecting() -> Iterator[None]:
    """Let Python seldom look for cyclic garbage, as is best while much is compiled.

    The compiler makes millions of objects that live on, and to look through them again and again
    takes a good part of its time.
    """
    before = gc.get_threshold()
    gc.set_threshold(*SELDOM)
    try:
        yield
    finally:
        gc.set_threshold(*before)


@contextmanager
def hearing_interrupts() -> Iterator[None]:
    """Let Ctrl-C end a compilation, also one that LLVM is at work for.

    Python sees it as LLVM calls back, where no exception can get out: it is told at the terminal,
    and what LLVM called back for is missing, so that another error follows, or none.

    Raises:
        KeyboardInterrupt: Ctrl-C came.

    """
    lost, before = list[object](), sys.unraisablehook

    def hook(unraisable: Any) -> None:
        if issubclass(unraisable.exc_type, KeyboardInterrupt):
            lost.append(unraisable.exc_type)
        else:
            before(unraisable)

    sys.unraisablehook = hook
    try:
        yield
    except Exception:
        if not lost:
            raise
    finally:
        sys.unraisablehook = before
    if lost:
        raise KeyboardInterrupt


def _compiled(function: F, **options: Any) -> F:
    if numba is None:
        return function
    jit = {"no_cfunc_wrapper": True, "error_model": "numpy", "fastmath": REORDERED, **options}
    with _kept_in(FOLDER):
        return cast(F, numba.njit(cache=FOLDER is not None, **jit)(function))


def compilation(*functions: Callable[..., Any]) -> Compilation:
    """Tell what the next use of functions, compiled ones or those by address, will begin with."""
    if not compiling() or all(map(_in_memory, functions)):
        return "none"
    if FOLDER is None:
        return "every run"
    # One folder for each of the sources; deeper ones are parts that another process has made.
    return "none" if all(any(FOLDER.glob(f"*/{_index_of(each)}")) for each in functions) else "once"


def _index_of(function: Callable[..., Any]) -> str:
    """Pattern of the file in which numba keeps a function's index: other files have namesakes."""
    return f"{function.__module__.rpartition('.')[2]}.{function.__name__}-*.nbi"


def _in_memory(function: Any) -> bool:
    return function in _BY_ADDRESS or bool(getattr(function, "signatures", ()))


@contextmanager
def one_at_a_time() -> Iterator[None]:
    """Wait until no other process compiles: what it keeps need not be compiled once more.

    Nobody but a process that was killed can then have left parts; they are removed. Where folders
    can't be locked (Windows, some network disks) each process compiles for itself.
    """
    lock: int | None = None
    if sys.platform != "win32" and FOLDER is not None:
        with suppress(OSError):
            lock = os.open(FOLDER, os.O_RDONLY | os.O_DIRECTORY)
            fcntl.flock(lock, fcntl.LOCK_EX)
            for left in FOLDER.glob(f"{PARTS}*"):
                rmtree(left, ignore_errors=True)
    try:
        yield
    finally:
        if lock is not None:
            os.close(lock)


def version() -> str:
    """Version of numba; empty without it."""
    return "" if numba is None else str(numba.__version__)


def fingerprint(folder: Path, more: Iterable[Path] = ()) -> str:
    """Fingerprint of all sources in a folder that have compiled functions, and of more."""
    found = [file.read_bytes() for file in sorted(folder.glob("*.py"))]
    sources = [source for source in found if MARKED.search(source)]
    return sha256(b"".join([*sources, *(file.read_bytes() for file in more)])).hexdigest()


@contextmanager
def _kept_in(folder: Path | None) -> Iterator[None]:
    """Let numba keep code in a folder."""
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(folder or "")
    try:
        yield
    finally:
        numba.config.CACHE_DIR = before


def _folder() -> Path | None:
    """Return the folder for the code: as NUMBA_CACHE_DIR says, here, or the user's; None without.

    Here, code of other sources is thrown away.
    """
    here = Path(__file__).parent
    made_by = f"{version()} {sys.version} {machine()}".encode()
    sources = fingerprint(
        here, (Path(str(module.__file__)) for module in (clock, collocation, control))
    )
    name = PREFIX + sha256(made_by + sources.encode()).hexdigest()[:16]
    asked = os.environ.get("NUMBA_CACHE_DIR")
    own = here / "__pycache__"
    places = [Path(asked)] if asked else [own, *_users_cache()]
    for place in places:
        with suppress(OSError):
            (place / name).mkdir(parents=True, exist_ok=True)
            if os.access(place / name, os.W_OK):
                if place == own:
                    _keep_only(name, own)
                return place / name
    return None


def _users_cache() -> Iterator[Path]:
    with suppress(RuntimeError):  # a user without a home
        yield Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "exudyn-flexlink"


def _keep_only(name: str, place: Path) -> None:
    for other in place.glob(f"{PREFIX}*"):
        if other.name != name:
            rmtree(other, ignore_errors=True)


FOLDER = None if numba is None else _folder()

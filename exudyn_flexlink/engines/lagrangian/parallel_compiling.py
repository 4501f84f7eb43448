"""The first compilation, by several processes at once: each takes the next function that is left.

What is called by address, and what Python calls, is compiled for itself, so that processes need
nothing of one another. Each keeps its code in a folder of its own, which is taken over in the end:
numba's own folders are no place for two at once. What is then missing, for instance since a process
was ended, is compiled as ever, where it is called.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from glob import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from exudyn_flexlink.engines.lagrangian import compiled
from exudyn_flexlink.engines.lagrangian.addresses import Kind, equations_with, steps_with
from exudyn_flexlink.engines.lagrangian.advance import advance
from exudyn_flexlink.engines.lagrangian.compiled import (
    PARTS,
    by_address,
    compilation,
    compiling,
    hearing_interrupts,
    seldom_collecting,
)
from exudyn_flexlink.engines.lagrangian.sampling import motions_at
from exudyn_flexlink.engines.lagrangian.signatures import (
    advance_arguments,
    equation_signatures,
    motions_arguments,
    step_signatures,
    wall_arguments,
)
from exudyn_flexlink.engines.lagrangian.walls import wall_forces, wall_work

PATIENCE = 120.0  # s: for the last unit of the others; alone the longest takes 15 s on one core
MOST = 4  # processes: more do not help, as 'advance' takes a third of the time of all
HELPER = """
import json, sys
sys.path[:], *given = json.loads(sys.argv[1])
from exudyn_flexlink.engines.lagrangian.parallel_compiling import help_compiling
help_compiling(*given)
"""


class Unit(NamedTuple):
    """A function that is compiled for itself, and how."""

    function: Callable[..., Any]
    compile: Callable[[], object]


def compile_in_parallel(kind: Kind) -> None:
    """Compile what is not yet on disk for mechanisms of a kind.

    Do nothing where there is but one core, where no folder can be written, or where this is no
    Python that could be started once more.
    """
    frozen = not sys.executable or getattr(sys, "frozen", False)
    if compiled.FOLDER is None or not compiling() or frozen:
        return
    left = [k for k, unit in enumerate(units(kind)) if compilation(unit.function) != "none"]
    count = min(cores(), MOST, len(left)) - 1
    if count < 1:
        return
    with suppress(OSError):  # too little room, or too many processes: then it is done later
        _share(count, kind, left, compiled.FOLDER)


def help_compiling(kind: list[bool], left: list[int], place: str) -> None:
    """Compile what nobody else does; called in a process of its own, which ends with its parent."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _compile(Kind(*kind), left, Path(place))


def units(kind: Kind) -> list[Unit]:
    """All that is compiled for itself; what takes long comes first."""
    functions = [*equations_with(kind), *steps_with(kind)]
    signatures = [*equation_signatures(), *step_signatures()]
    found = [
        _of_python(advance, advance_arguments()),
        *map(_of_address, functions, signatures),
        _of_python(motions_at, motions_arguments()),
    ]
    if kind.walls:
        found += map(_of_python, (wall_forces, wall_work), wall_arguments())
    return found


def cores() -> int:
    """Number of cores that this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def take_over(part: Path, folder: Path) -> None:
    """Move the code of all functions of which a folder has none; an index goes after its code."""
    own = part / folder.name  # of the same sources: others may have been installed meanwhile
    for index in own.rglob("*.nbi"):
        there = folder / index.relative_to(own)
        if there.exists():
            continue
        there.parent.mkdir(parents=True, exist_ok=True)
        for code in index.parent.glob(f"{escape(index.stem)}.*.nbc"):
            code.replace(there.with_name(code.name))
        index.replace(there)


def _of_python(function: Any, arguments: tuple[Any, ...]) -> Unit:
    return Unit(function, lambda: function.compile(arguments))


def _of_address(function: Callable[..., Any], signature: Any) -> Unit:
    return Unit(function, lambda: by_address(function, signature))


def _compile(kind: Kind, left: list[int], place: Path) -> None:
    """Compile, one after the other, the units that are left and that nobody has taken."""
    every = units(kind)
    with seldom_collecting():
        for k in left:
            if _taken(place / f"unit-{k}"):
                with hearing_interrupts():
                    every[k].compile()


def _taken(sign: Path) -> bool:
    """Take a unit, unless another process has: only one of them can make the sign."""
    try:
        sign.touch(exist_ok=False)
    except FileExistsError:
        return False
    return True


def _share(count: int, kind: Kind, left: list[int], folder: Path) -> None:
    """Compile the units that are left, with so many helpers."""
    with TemporaryDirectory(prefix=PARTS, dir=folder, ignore_cleanup_errors=True) as place:
        parts = [Path(place) / f"part-{number}" for number in range(count)]
        paths = [path for path in sys.path if isinstance(path, str)]  # imports pass over others
        given = json.dumps([paths, kind, left, place])
        with processes([sys.executable, "-c", HELPER, given], parts) as helpers:
            _compile(kind, left, Path(place))
            _wait(helpers)
        for part in parts:
            take_over(part, folder)


def _wait(helpers: list[subprocess.Popen[bytes]]) -> None:
    """Wait for the last unit of each, but not for one that hangs: its unit is compiled later."""
    until = time.monotonic() + PATIENCE
    for helper in helpers:
        with suppress(subprocess.TimeoutExpired):
            helper.wait(max(until - time.monotonic(), 0.0))


@contextmanager
def processes(command: list[str], parts: list[Path]) -> Iterator[list[subprocess.Popen[bytes]]]:
    """Processes that keep their code in the parts of a folder; all have ended afterwards."""
    helpers: list[subprocess.Popen[bytes]] = []
    try:
        for part in parts:
            environment = {**os.environ, "NUMBA_CACHE_DIR": str(part)}
            helpers.append(
                subprocess.Popen(
                    command,
                    env=environment,
                    stdin=subprocess.PIPE,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                )
            )
        yield helpers
    finally:
        for helper in helpers:
            helper.kill()
            helper.communicate()


def _end_with_parent() -> None:
    """Wait until nobody holds the other end of the standard input."""
    sys.stdin.read()
    os._exit(1)

"""Handing one input to the loader, and what is a finding: anything but a scene or a SceneError."""

from __future__ import annotations

import resource
import signal
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

from exudyn_flexlink.loading import assemble_scene, load_scene
from exudyn_flexlink.report import check_text
from exudyn_flexlink.source import SceneError
from fuzzing.inputs import Input

LONGEST = 20.0  # s of processor time that an input may take
MEMORY = 4 * 2**30  # bytes


class TooLongError(BaseException):
    """An input takes too long; no Exception, which the loader might catch."""


def loads(given: Input, folder: Path) -> bool:
    """Load an input and say what it means, as the command `check` does; False if it is refused.

    Raises whatever the loader lets out that is no SceneError: warnings, too.
    """
    path = given.write(folder)
    with warnings.catch_warnings(), limited():
        warnings.simplefilter("error")
        try:
            scene = load_scene(path, given.settings)
            check_text(scene, assemble_scene(scene))
        except SceneError as error:
            str(error)  # it can be shown
            return False
    return True


@contextmanager
def limited(longest: float = LONGEST) -> Iterator[None]:
    """Raise TooLongError in what takes too much processor time."""

    def stop(_: int, __: FrameType | None) -> None:
        raise TooLongError(f"more than {longest:g} s of processor time")

    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, longest)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def limit_memory() -> None:
    """Let this process have so much memory: an input that takes more is a MemoryError."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.RLIM_INFINITY))


def signature(error: BaseException) -> str:
    """Tell one finding from another: the kind of error and the package's line that it came by."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [f for f in frames if "exudyn_flexlink" in f.filename] or list(frames)
    last = own[-1]
    # Where time ran out is chance: the outermost line tells more.
    if isinstance(error, TooLongError):
        last = own[min(3, len(own) - 1)]
    return f"{type(error).__name__} at {Path(last.filename).name}:{last.lineno}"

"""The second run of a scene, in a process of its own beside the first one.

It is a command of this program, with files in and out: so it works from scripts and notebooks, too,
and Ctrl-C reaches it only from here.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import parent_process
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp

from exudyn_flexlink.engines.interrupts import interrupts
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene

COMMAND = "exudyn_flexlink.cli.second"
ASKED, DONE, MADE = "asked", "done", "made"
"""Files: scene and engine; part that is done; result, or an exception."""
SURE = 1.0  # s: after which the length of a run is foreseen
WORTH = 3.0  # s: of a run that takes longer; that process needs one to start
BETWEEN_LOOKS = 0.02  # s: between two looks at the process


class Beside:
    """The second run of a scene by an engine.

    It is begun as the first one, which `watch` follows, turns out to be long; as a context it ends
    with what is inside. Where it never began `made` returns None, and so it does in processes that
    others have started, who know better what to run at once, and on one core.
    """

    def __init__(self, scene: Scene, engine: str) -> None:
        self._asked = scene, engine
        self._began = time.monotonic()
        self._folder: Path | None = None
        self._process: subprocess.Popen[bytes] | None = None
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
        alone = parent_process() is None and bool(sys.executable) and cores != 1
        self._possible = alone and scene.accuracy.tolerance is not None

    def __enter__(self) -> Beside:
        return self

    def __exit__(self, *_: object) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        if self._folder is not None:
            rmtree(self._folder, ignore_errors=True)

    def watch(self, progress: Callable[[float], None] | None) -> Callable[[float], None]:
        """Return what is to be called with the part of the first run that is done, 0 to 1."""

        def told(done: float) -> None:
            passed = time.monotonic() - self._began
            if self._possible and passed > max(SURE, WORTH * done):
                self._possible = False
                with suppress(OSError):  # no room for files or processes: one after the other
                    self._start()
            if progress is not None:
                progress(done)

        return told

    def made(self, progress: Callable[[float], None] | None) -> Result | None:
        """Wait for the run; None if it never began, or its process came to no end.

        Raises:
            LateInterruptError: the user ended it late; the result, which is whole, is in it.
            MemoryError: there was not enough memory for it.

        """
        if self._process is None or self._folder is None:
            return None
        with interrupts(self._interrupt):
            while self._process.poll() is None:
                if progress is not None:
                    progress(_number(self._folder / DONE))
                time.sleep(BETWEEN_LOOKS)
        try:
            made = pickle.loads((self._folder / MADE).read_bytes())
        except OSError:
            return None
        if isinstance(made, BaseException):
            raise made
        assert isinstance(made, Result)
        return made

    def _start(self) -> None:
        self._folder = Path(mkdtemp(prefix="flexlink-second-"))
        (self._folder / ASKED).write_bytes(pickle.dumps(self._asked))
        here = str(Path(__file__).parents[2])
        before = os.environ.get("PYTHONPATH")
        path = here if before is None else f"{here}{os.pathsep}{before}"
        self._process = subprocess.Popen(
            [sys.executable, "-m", COMMAND, str(self._folder)], cwd=self._folder,
            env={**os.environ, "PYTHONPATH": path}, stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip

    def _interrupt(self) -> None:
        """End the run after the step that is under way."""
        if self._process is not None:
            self._process.send_signal(signal.SIGINT if os.name == "posix" else signal.SIGTERM)


def _number(file: Path) -> float:
    """Part of the run that is done; 0 where that is just being written."""
    try:
        return float(file.read_text())
    except (OSError, ValueError):
        return 0.0

"""Where a command puts its result: where it is asked to, or beside it."""

from __future__ import annotations

import argparse
import os
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from exudyn_flexlink.cli.ctrl_c import deferrable_interrupts
from exudyn_flexlink.cli.naming import run_name
from exudyn_flexlink.cli.terminal import BAD_INPUT, INTERRUPTED, refuse, tell
from exudyn_flexlink.storage import KeptBesideError, own_files, staged_folder


class Place:
    """The folder a result shall end in, `target`; after writing, the one it did end in."""

    def __init__(self, options: argparse.Namespace, suffix: str = "", what: str = "run") -> None:
        """Take the place that was asked for, or a folder in `runs` named as the run is.

        `what` is the kind of result, see `storage.manifest`.
        """
        self._what = what
        self.target: Path = options.out or Path("runs") / run_name(options, suffix)
        self._force, self._quiet = options.force, options.quiet
        self._replaces: bool | None = None  # an earlier run; known when writing begins
        self._why: KeptBesideError | None = None
        self._pressed = False

    def code(self, code: int) -> int:
        """Exit code of a command that would end with `code` if Ctrl-C had not come last."""
        return INTERRUPTED if self._pressed else code

    def tell(self, text: str) -> None:
        """Print a summary, then where the result is and what is in it; nothing if it is `quiet`."""
        if self._quiet:
            return
        tell(text)
        instead = " in place of an earlier run" if self._replaces else ""
        tell(f"\nWritten to {self.target}{os.sep}{instead}:\n  {_contents(self.target)}")

    def ended(self, code: int) -> int:
        """Say why the result is not where it should be; returns the exit code."""
        return refuse(self._why, code or BAD_INPUT) if self._why else code

    @contextmanager
    def written(self) -> Iterator[Path]:
        """Yield the folder to write into; Ctrl-C does not keep what is in it from its place.

        Raises:
            StorageError: the target can't be written; see `staged_folder`.

        """
        if self._replaces is None:  # what is written twice replaces no earlier run
            self._replaces = bool(own_files(self.target))
        with deferrable_interrupts() as ctrl_c:
            try:
                with staged_folder(self.target, force=self._force, what=self._what) as folder:
                    yield folder
                    ctrl_c.defer()
            except KeptBesideError as error:
                self.target, self._why = error.folder, error
                self._replaces = False
        self._pressed = ctrl_c.pending


def _contents(folder: Path) -> str:
    """Name the files of a result, and count those of every folder in it."""
    paths = sorted(own_files(folder))
    inside = Counter(path.partition("/")[0] for path in paths if "/" in path)
    told = [path for path in paths if "/" not in path]
    return ", ".join([*told, *(f"{name}/ ({number} files)" for name, number in inside.items())])

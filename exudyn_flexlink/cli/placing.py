"""Where a command puts its result: where it is asked to, or beside it."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from exudyn_flexlink.cli.ctrl_c import deferrable_interrupts
from exudyn_flexlink.cli.terminal import BAD_INPUT, INTERRUPTED, complain


class Place:
    """The folder a result shall end in, `target`; after writing, the one it did end in."""

    def __init__(self, target: Path) -> None:
        self.target = target
        self._why, self._pressed = "", False

    def code(self, code: int) -> int:
        """Exit code of a command that would end with `code` if Ctrl-C had not come last."""
        return INTERRUPTED if self._pressed else code

    def tell(self, code: int) -> int:
        """Say why the result is not where it should be; returns the exit code."""
        return complain(self._why, code or BAD_INPUT) if self._why else code

    @contextmanager
    def written(self, *, force: bool) -> Iterator[Path]:
        """Yield the folder to write into; Ctrl-C does not keep what is in it from its place.

        Raises:
            StorageError: the target can't be written; see `staged_folder`.

        """
        from exudyn_flexlink.storage import KeptBesideError, staged_folder

        with deferrable_interrupts() as ctrl_c:
            try:
                with staged_folder(self.target, force=force) as folder:
                    yield folder
                    ctrl_c.defer()
            except KeptBesideError as error:
                self.target, self._why = error.folder, str(error)
        self._pressed = ctrl_c.pending


def place_of(options: argparse.Namespace, suffix: str = "") -> Place:
    """Return the place that was asked for, or a folder in `runs` with the name of the model."""
    model: Path = options.model
    # The stem of '..yaml' is '.', which would be `runs` itself.
    name = model.stem if model.stem.strip(".") else model.name
    return Place(options.out or Path("runs") / f"{name}{suffix}")

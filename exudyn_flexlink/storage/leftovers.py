"""Temporary folders that no run owns any more: of processes that were killed.

A run holds a lock on its temporary folder, which goes with the process however that ends. Whoever
gets the lock may remove the folder: nobody writes there any more. Locks may not reach other hosts
of a shared disk, so that the host is in the name and only its own folders are touched; a pid would
not do, since containers on one disk count their own. Where folders can't be locked (Windows, some
network disks) leftovers stay.
"""

from __future__ import annotations

import os
import platform
import re
import secrets
import shutil
from contextlib import suppress
from pathlib import Path

from exudyn_flexlink.storage.locking import locked_folder
from exudyn_flexlink.storage.manifest import PREFIX

ATTEMPTS = 20
DIGITS = 12  # of the random part of a name


class Owned:
    """A new temporary folder, `path`, locked until `release`."""

    def __init__(self, parent: Path) -> None:
        """Make it in `parent`, which is made if it is missing.

        Raises:
            OSError: it can't be made.

        """
        for _ in range(ATTEMPTS):
            self.path = parent / f"{_prefix()}{secrets.token_hex(DIGITS // 2)}"
            self.path.mkdir(parents=True)
            with suppress(BlockingIOError, FileNotFoundError):
                self._lock = locked_folder(self.path)
                if self.path.is_dir():
                    return
                self.release()
            # Another run took it for a leftover before it was locked.
        raise OSError("temporary folders are removed as they are made")

    def release(self) -> None:
        """Give up the lock."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None


def remove_leftovers(parent: Path) -> None:
    """Remove temporary folders in `parent` that no process owns; what can't be removed stays."""
    own = re.compile(re.escape(_prefix()) + f"[0-9a-f]{{{DIGITS}}}")
    with suppress(OSError):
        for folder in list(parent.iterdir()):
            if own.fullmatch(folder.name) and folder.is_dir() and not folder.is_symlink():
                _remove_if_free(folder)


def _remove_if_free(folder: Path) -> None:
    with suppress(OSError):  # someone owns it, or it is gone
        lock = locked_folder(folder)
        if lock is not None:
            shutil.rmtree(folder, ignore_errors=True)
            os.close(lock)


def _prefix() -> str:
    host = re.sub(r"[^A-Za-z0-9]", "_", platform.node())[:40]
    return f"{PREFIX}{host}-"

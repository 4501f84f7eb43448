"""Locks against other processes, which go with this one however it ends.

Windows and some network disks have none: there nothing is locked, and all goes on as if it were.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

if sys.platform != "win32":
    import fcntl


def lock(descriptor: int, *, wait: bool = False) -> bool:
    """Lock an open file or folder until it is closed; tells whether that can be.

    Raises:
        BlockingIOError: another process holds the lock, and this one is not to `wait`.

    """
    if sys.platform == "win32":
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except BlockingIOError:
        raise
    except OSError:
        return False
    return True


def locked_folder(folder: Path, *, wait: bool = False) -> int | None:
    """Descriptor that holds a lock on a folder until it is closed; None where there are no locks.

    Raises:
        BlockingIOError: see `lock`.
        OSError: there is no such folder.

    """
    if sys.platform == "win32":
        return None
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)  # a pipe would wait
    locked = False
    try:
        locked = lock(descriptor, wait=wait)
    finally:
        if not locked:
            os.close(descriptor)
    return descriptor if locked else None

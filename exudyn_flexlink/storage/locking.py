"""Locks against other processes, which go with this one however it ends.

Windows and some network disks have none: there nothing is locked, and all goes on as if it were.
"""

from __future__ import annotations

import sys

if sys.platform != "win32":
    import fcntl


def lock(descriptor: int) -> None:
    """Lock an open file until it is closed, where that can be.

    Raises:
        BlockingIOError: another process holds the lock.

    """
    if sys.platform == "win32":
        return
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:
        return

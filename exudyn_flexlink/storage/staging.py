"""The folder of a run appears whole or not at all: written beside its place, then renamed."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

from exudyn_flexlink.storage.errors import (
    ACCURACY,
    COMPARISON,
    SUMMARY,
    StorageError,
    cannot_write,
)
from exudyn_flexlink.storage.leftovers import Owned, discard, remove_leftovers
from exudyn_flexlink.storage.reading import read_json

ATTEMPTS = 20  # to put a folder in place while other runs do the same


@contextmanager
def staged_folder(target: Path) -> Iterator[Path]:
    """Yield a temporary folder beside `target`; once all is written there, rename it to `target`.

    An existing `target` is replaced if it is empty or holds an earlier run, comparison or study of
    this program. After any exception or interrupt the temporary folder is removed and `target`
    is as it was; temporary folders of processes that were killed are removed by the next one.

    Raises:
        StorageError: the target can't be replaced (found before anything is written), or the place
            can't be written. If the target can't be replaced any more once all is written, the
            folder is kept beside it, and the message says where.

    """
    target = _resolved(target)
    _check_replaceable(target)
    with _temporary(target.parent, target) as staged:
        yield staged
        try:
            _check_replaceable(target)  # hours may have passed
            _put_in_place(staged, target)
        except (StorageError, OSError) as error:
            beside = _kept_beside(staged, target)
            told = cannot_write(target, error) if isinstance(error, OSError) else error
            raise StorageError(f"{told}. What was computed is in {beside}") from None


@contextmanager
def staged_files(folder: Path) -> Iterator[Path]:
    """Yield a temporary folder; once all is written there, its files are moved into `folder`.

    `folder` is made if it is missing; files of the same names in it are replaced, others stay.

    Raises:
        StorageError: the folder can't be written.

    """
    folder = _resolved(folder)
    with _temporary(folder, folder) as staged:
        yield staged
        for file in staged.iterdir():
            file.replace(folder / file.name)
        staged.rmdir()


def _resolved(target: Path) -> Path:
    """Return the whole path of a place.

    Raises:
        StorageError: it is no path, such as a link to itself.

    """
    try:
        return Path(target).resolve()
    except (OSError, RuntimeError, ValueError) as error:
        raise StorageError(f"can't write {target}: {error}; choose another place") from error


@contextmanager
def _temporary(parent: Path, target: Path) -> Iterator[Path]:
    """Yield a new folder in `parent`; after any exception or interrupt all of it is gone again.

    Raises:
        StorageError: it can't be written; `target` is what the user knows the place by.

    """
    missing: list[Path] = []
    owned: Owned | None = None
    try:
        missing += [folder for folder in (parent, *parent.parents) if not folder.exists()]
        remove_leftovers(parent)
        owned = Owned(parent)
        yield owned.path
    except BaseException as error:
        if owned is not None:
            shutil.rmtree(owned.path, ignore_errors=True)
        for folder in missing:
            with suppress(OSError):
                folder.rmdir()
        cause = error.__cause__ if isinstance(error, StorageError) else error
        if isinstance(cause, OSError):  # the temporary folder means nothing to the user
            raise StorageError(cannot_write(target, cause)) from cause
        raise
    finally:
        if owned is not None:
            owned.release()


def _check_replaceable(target: Path) -> None:
    try:
        if not target.exists():
            return
    except OSError as error:  # such as a name that is too long
        raise StorageError(cannot_write(target, error)) from error
    if not target.is_dir():
        raise StorageError(f"{target} is a file; give the name of a folder")
    here = Path.cwd()
    if target in (here, *here.parents):
        where = "is the folder you are in" if target == here else "holds the folder you are in"
        raise StorageError(f"{target} {where}; give the name of a folder in it")
    try:
        empty = not any(target.iterdir())
    except OSError as error:
        raise StorageError(f"can't read {target}: {error.strerror or error}") from error
    if empty:
        return
    advice = "choose another name, or remove it yourself"
    own = next(
        (name for name in (SUMMARY, COMPARISON, ACCURACY) if (target / name).is_file()), None
    )
    if own is None:
        raise StorageError(f"{target} holds files that are no run of this program; {advice}")
    try:
        read_json(target, own)
    except StorageError as error:
        raise StorageError(f"{target} is not replaced: {error}. Or {advice}") from error


def _put_in_place(staged: Path, target: Path) -> None:
    """Rename the staged folder; a folder in its place is moved aside first, and back if need be.

    Another run may put its own folder there in between: the last one stays.
    """
    for attempt in range(ATTEMPTS):
        old = staged.with_name(f"{staged.name}-old{attempt}")
        moved = _moved_aside(target, old)
        try:
            staged.rename(target)
        except BaseException as error:
            taken = isinstance(error, OSError) and error.errno in (errno.EEXIST, errno.ENOTEMPTY)
            if moved and taken:
                discard(old)
            elif moved:
                old.rename(target)
            if not taken or attempt == ATTEMPTS - 1:
                raise
        else:
            if moved:
                discard(old)
            return


def _kept_beside(staged: Path, target: Path) -> Path:
    """Rename the staged folder to a free name beside that of the target.

    Raises:
        OSError: that can't be done either.

    """
    names = (target.with_name(f"{target.name}-{number}") for number in count(2))
    beside = next(place for place in names if not os.path.lexists(place))
    return staged.rename(beside)


def _moved_aside(target: Path, old: Path) -> bool:
    """Move an existing folder out of the way; False if there is none."""
    try:
        target.rename(old)
    except FileNotFoundError:
        return False
    return True

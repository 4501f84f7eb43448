"""The folder of a run appears whole or not at all: written beside its place, then renamed."""

from __future__ import annotations

import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from exudyn_flexlink.storage.errors import (
    ACCURACY,
    COMPARISON,
    SUMMARY,
    StorageError,
    cannot_write,
)
from exudyn_flexlink.storage.reading import read_json


@contextmanager
def staged_folder(target: Path) -> Iterator[Path]:
    """Yield a temporary folder beside `target`; once all is written there, rename it to `target`.

    An existing `target` is replaced if it is empty or holds an earlier run, comparison or study of
    this program. After any exception or interrupt the temporary folder is removed and `target`
    is as it was.

    Raises:
        StorageError: the target can't be replaced (found before anything is written), or the place
            can't be written.

    """
    target = Path(target).resolve()
    _check_replaceable(target)
    missing = [parent for parent in target.parents if not parent.exists()]
    staged = target.parent / f".flexlink-{secrets.token_hex(6)}"
    try:
        staged.mkdir(parents=True)
        yield staged
        _check_replaceable(target)  # hours may have passed
        _put_in_place(staged, target)
    except BaseException as error:
        shutil.rmtree(staged, ignore_errors=True)
        for parent in missing:
            with suppress(OSError):
                parent.rmdir()
        if isinstance(error, OSError):
            raise StorageError(cannot_write(target, error)) from error
        raise


def _check_replaceable(target: Path) -> None:
    if not target.exists():
        return
    if not target.is_dir():
        raise StorageError(f"{target} is a file; give the name of a folder")
    here = Path.cwd()
    if target in (here, *here.parents):
        raise StorageError(f"{target} is the folder you are in; give the name of a folder in it")
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
    """Rename the staged folder; a folder in its place is moved aside first, and back if need be."""
    if not target.exists():
        staged.rename(target)
        return
    old = staged.with_name(staged.name + "-old")
    target.rename(old)
    try:
        staged.rename(target)
    except BaseException:
        old.rename(target)
        raise
    shutil.rmtree(old, ignore_errors=True)

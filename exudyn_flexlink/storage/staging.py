"""Results and figures appear whole or not at all: written elsewhere, then moved to their place."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory

from exudyn_flexlink.storage.errors import MANIFEST, StorageError, cannot_write
from exudyn_flexlink.storage.manifest import PREFIX, is_regular, own_files, read_manifest
from exudyn_flexlink.storage.replacing import check_kind, check_replaceable, kind_of, put


class KeptBesideError(StorageError):
    """A result was written whole, but not where it should be: it is in `folder`."""

    def __init__(self, why: StorageError, folder: Path) -> None:
        super().__init__(f"{why}. What was computed is in {folder}", forcible=why.forcible)
        self.folder = folder


@contextmanager
def staged_folder(target: Path, *, force: bool = False, what: str = "") -> Iterator[Path]:
    """Yield a temporary folder; once all is written there, its files move to `target`.

    `target` may be new, empty, or hold a result of this program: then the new files replace those
    that its manifest names, and whatever else is in it stays. A result that is not complete
    replaces no complete one, nor one of another kind, which `what` tells before anything is
    written. After any exception or interrupt `target` is as it was. `force`
    replaces a complete result by an incomplete one, writes into a folder of other files, and
    replaces files of the user that have the names of new ones.

    Raises:
        KeptBesideError: all is written, but may not, or can't, be moved to `target`.
        StorageError: that is known before anything is written, or the place can't be written.

    """
    target = _resolved(target)
    _check_place(target, force=force)
    if what:
        check_kind(target, what)
    with _temporary(target) as staged:
        yield staged
        try:
            _check_place(target, force=force)  # hours may have passed
            put(staged, target, force=force)
        except (StorageError, OSError) as error:
            why = StorageError(cannot_write(target, error)) if isinstance(error, OSError) else error
            raise KeptBesideError(why, _kept_beside(staged, target)) from None


@contextmanager
def staged_files(folder: Path, *, force: bool = False) -> Iterator[Path]:
    """Yield a temporary folder; once all is written there, its files are moved into `folder`.

    `folder` is made if it is missing. Files of the same names in it are replaced if its manifest
    names them, or with `force`; all others stay.

    Raises:
        StorageError: the folder can't be written, or a file of the user is in the way.

    """
    folder = _resolved(folder)
    with _temporary(folder) as staged:
        _try_to_write(folder)
        yield staged
        if any(staged.iterdir()):
            put(staged, folder, force=force, add=True)


def replace_file(
    file: Path, content: bytes, is_own: Callable[[bytes], bool], *, force: bool
) -> None:
    """Write a file, whole or not at all.

    A file that stands there is replaced if its content `is_own`, this program's, or with `force`;
    links, devices and folders never are.

    Raises:
        StorageError: the file may not be replaced, or can't be written.

    """
    if not file.parent.is_dir():
        raise StorageError(f"can't write {file}: there is no such folder")
    if os.path.lexists(file):
        if not is_regular(file):
            raise StorageError(f"can't write {file}: it is {kind_of(file)}; give a new name")
        with suppress(OSError):  # what can't be read is not known to be the program's
            force = force or is_own(file.read_bytes())
        if not force:
            raise StorageError(
                f"can't write {file}: this program did not write what is in it; choose another "
                "name, or force it",
                forcible=True,
            )
    beside = file.with_name(f"{PREFIX}{file.name}")
    try:
        beside.write_bytes(content)
        os.replace(beside, file)
    except BaseException as error:
        beside.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise StorageError(cannot_write(file, error)) from error
        raise


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
def _temporary(target: Path) -> Iterator[Path]:
    """Yield a new folder among the system's temporary ones, for what shall be in `target`.

    Raises:
        StorageError: something can't be written; `target` is what the user knows the place by.

    """
    try:
        with TemporaryDirectory(prefix="flexlink-", ignore_cleanup_errors=True) as folder:
            yield Path(folder)
    except OSError as error:
        raise StorageError(cannot_write(target, error)) from error


def _check_place(target: Path, *, force: bool) -> None:
    """Look whether a result may be put into a folder, as far as can be told without it.

    Raises:
        StorageError: it may not, or the folder can't be written.

    """
    try:
        there = [entry.name for entry in target.iterdir()] if target.exists() else []
        others = any(not name.startswith(PREFIX) for name in there)
        if others and read_manifest(target) is None and not force:
            raise StorageError(
                f"{target} holds files that are no run of this program, or of an earlier version: "
                f"no {MANIFEST} names them; choose another name, or force it: files with the names "
                "of new ones are replaced then, and no others",
                forcible=True,
            )
        check_replaceable(target, own_files(target), force=force)
    except NotADirectoryError:
        raise StorageError(f"{target} is {kind_of(target)}; give the name of a folder") from None
    except PermissionError as error:
        raise StorageError(f"can't read {target}: {error.strerror or error}") from error
    except OSError as error:  # such as a name that is too long
        raise StorageError(cannot_write(target, error)) from error
    _try_to_write(target)


def _try_to_write(target: Path) -> None:
    """Make a folder in a place and remove it; a place that is missing is missing afterwards, too.

    Raises:
        StorageError: that can't be.

    """
    trial = target / f"{PREFIX}trial"
    missing = [folder for folder in (trial, *trial.parents) if not folder.exists()]
    try:
        trial.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(cannot_write(target, error)) from error
    finally:
        for folder in missing:
            with suppress(OSError):
                folder.rmdir()


def _kept_beside(staged: Path, target: Path) -> Path:
    """Move the staged files to a folder with a free name beside that of the target.

    Raises:
        OSError: that can't be done either.

    """
    names = (target.with_name(f"{target.name}-{number}") for number in count(2))
    beside = next(place for place in names if not os.path.lexists(place))
    try:
        put(staged, beside, force=False)
    except OSError:
        shutil.rmtree(beside, ignore_errors=True)
        raise
    return beside

"""Results are written whole or not at all; they replace only files of an earlier result.

All files are first written into a temporary folder. Then they move into the folder of the result.
That folder can't be replaced as a whole, because it may hold files of the user. A process may be
killed at any time, so each step leaves a state that the next run recognises:

1. The manifest names the present files and the new ones.
2. Tables, figures and summaries of the earlier result are deleted.
3. ``result.nc``, which is the run, replaces the earlier one in one move.
4. Tables, figures and summaries of the new result follow; last the manifest, which now names only
   new files.

Before step 3 the folder holds the earlier run, after it the new run; never tables of one beside
the other. The next run reads all file names in the manifest, so no file blocks it. If two runs end
in one folder at the same instant, the last one stays, or an error tells of it.

The manifest names the files that a result wrote, each with its SHA-256. A file belongs to the
program if the manifest names it and its content is as written. Every other file belongs to the
user, including a file of the program that was changed later. While a result replaces an earlier
one, a file may have the content of either.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import shutil
import stat
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import Annotated, Final, Literal

from pydantic import AfterValidator, TypeAdapter
from pydantic_core import to_json

from exudyn_flexlink.raising import Sendable

PROGRAM: Final = "exudyn-flexlink"
FORMAT = 17
SUMMARY, ARRAYS = "summary.json", "result.nc"
COMPARISON, ACCURACY = "comparison.json", "accuracy.json"
STABILITY, SWEEP, FIT = "stability.json", "sweep.json", "fit.json"
MANIFEST = "manifest.json"


class StorageError(Sendable, Exception):
    """A run can't be written or read: a sentence that names the file and says what to do.

    `forcible` tells that it can be written all the same, with `force`.
    """

    def __init__(self, message: str, *, forcible: bool = False) -> None:
        super().__init__(message)
        self.forcible = forcible


def cannot_write(place: Path, error: OSError | RecursionError) -> str:
    """Say plainly why a place can't be written, and what to do."""
    if isinstance(error, RecursionError):  # `Path.mkdir` calls itself for each folder
        return f"can't write {place}: too many folders in each other; choose another place"
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return f"can't write {place}: the disk is full; make room, or choose another place"
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return f"can't write {place}: no permission to write there; choose another place"
    if error.errno in (errno.ENOENT, errno.ENOTDIR):
        return f"can't write {place}: no folder can be made there; choose another place"
    return f"can't write {place}: {error.strerror or error}; choose another place"


FIGURES = "figures"  # a folder without a document holds figures
KINDS = {
    SUMMARY: "run",
    COMPARISON: "comparison",
    ACCURACY: "study",
    SWEEP: "sweep",
    STABILITY: "stability",
    FIT: "fit",
}
"""Contents of a folder, by the document in it."""


def _inside(name: str) -> str:
    """Return the path, with "/", of a file in the folder or below it; else raise ValueError."""
    if {"", ".", ".."} & set(name.split("/")) or set(name) & set("\\\0"):
        raise ValueError(f"'{name}' is no name of a file in the folder")
    return name


Name = Annotated[str, AfterValidator(_inside)]


@dataclass(frozen=True)
class Manifest:
    """Contents of a folder, and the SHA-256 that each of its files may have, by path."""

    what: str
    title: str
    completed: bool
    files: dict[Name, tuple[str, ...]]
    program: Literal["exudyn-flexlink"] = PROGRAM

    @property
    def words(self) -> str:
        """Contents of the folder in words."""
        return f"{self.what} of '{self.title}'" if self.title else self.what

    def content(self) -> bytes:
        """Return the content of the manifest's file."""
        return to_json(self, indent=2) + b"\n"


_MANIFEST = TypeAdapter(Manifest)


def read_manifest(folder: Path) -> Manifest | None:
    """Read the manifest of a folder; None if it has none, or one that another program wrote."""
    file = folder / MANIFEST
    try:
        return _MANIFEST.validate_json(file.read_bytes()) if is_regular(file) else None
    except (OSError, ValueError):
        return None


def manifest_of(folder: Path) -> Manifest:
    """Return the manifest of the present files of a folder that holds only a result.

    Raises:
        OSError: a file can't be read.

    """
    files: dict[str, tuple[str, ...]] = {
        file.relative_to(folder).as_posix(): (digest(file),)
        for file in sorted(folder.rglob("*"))
        if is_regular(file)
    }
    document = next((name for name in KINDS if name in files), None)
    if document is None:
        return Manifest(FIGURES, "", False, files)
    content = json.loads((folder / document).read_bytes())
    return Manifest(KINDS[document], content["title"], content["completed"], files)


def written_files(folder: Path) -> tuple[str, ...]:
    """Return the paths, with "/", of the manifest and of all files that it names."""
    manifest = read_manifest(folder)
    return () if manifest is None else (MANIFEST, *manifest.files)


def folders_to(folder: Path, name: str) -> list[Path]:
    """Return the folders on the path from a folder to a file in it, the outermost first."""
    return [folder / above for above in PurePosixPath(name).parents][-2::-1]


def is_ours(folder: Path, name: str, contents: tuple[str, ...]) -> bool:
    """Tell whether a file has one of these SHA-256, and no link leads to it from the folder."""
    reached = all(is_folder(above) for above in folders_to(folder, name))
    return reached and is_regular(folder / name) and digest(folder / name) in contents


def is_regular(file: Path) -> bool:
    """Tell whether a path is a regular file: no link, folder, device or pipe."""
    try:
        return stat.S_ISREG(os.lstat(file).st_mode)
    except (OSError, ValueError):
        return False


def is_folder(folder: Path) -> bool:
    """Tell whether a path is a folder, and no link to a folder."""
    return folder.is_dir() and not folder.is_symlink()


def digest(file: Path) -> str:
    """Return the SHA-256 of a file; OSError if it can't be read."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


PREFIX = ".flexlink-"  # of temporary files and folders


class KeptBesideError(StorageError):
    """A result was written whole, but into `folder`, because its own place can't take it."""

    def __init__(self, why: StorageError, folder: Path) -> None:
        super().__init__(f"{why}. What was computed is in {folder}", forcible=why.forcible)
        self.folder = folder


@contextmanager
def staged_folder(target: Path, *, force: bool = False, what: str = "") -> Iterator[Path]:
    """Yield a temporary folder; after the context its files move to `target`.

    `target` may be new, empty, or hold a result of this program. New files then replace those that
    its manifest names; other files stay. An incomplete result replaces no complete result, and no
    result of another kind; `what` gives the kind before anything is written. After any exception or
    interrupt `target` is unchanged. With `force` an incomplete result replaces a complete one, a
    folder of other files is accepted, and files of the user with names of new files are replaced.

    Raises:
        KeptBesideError: all files are written, but may not, or can't, be moved to `target`.
        StorageError: this is known before anything is written, or `target` can't be written.

    """
    target = _resolved(target)
    _check_place(target, Manifest(what, "", True, {}), force=force)
    with _temporary(target) as staged:
        yield staged
        now = manifest_of(staged)
        try:
            _check_place(target, now, force=force)  # again: hours may have passed
            _put(staged, now, target)
        except (StorageError, OSError) as error:
            why = StorageError(cannot_write(target, error)) if isinstance(error, OSError) else error
            raise KeptBesideError(why, _kept_beside(staged, now, target)) from None


@contextmanager
def staged_files(folder: Path, *, force: bool = False) -> Iterator[Path]:
    """Yield a temporary folder; after the context its files move into `folder`.

    `folder` is made if it is missing. Files with the same names are replaced if its manifest names
    them, or with `force`; others stay. A run of a comparison has no manifest of its own: the
    manifest of the comparison names its files.

    Raises:
        StorageError: the folder can't be written, or a file of the user has the name of a new file.

    """
    folder = _resolved(folder)
    above = None if read_manifest(folder) else read_manifest(folder.parent)
    part = any(name.startswith(f"{folder.name}/") for name in (above.files if above else ()))
    home = folder.parent if part else folder
    with _temporary(folder) as staged:
        _try_to_write(folder)
        files = staged / folder.relative_to(home)
        files.mkdir(exist_ok=True)
        yield files
        now = manifest_of(staged)
        _check_files(home, now.files, read_manifest(home), force=force)
        if now.files:
            _put(staged, now, home, add=True)


def replace_file(
    file: Path, content: bytes, replaceable: Callable[[bytes], bool], *, force: bool
) -> None:
    """Write a file, whole or not at all.

    An existing file is replaced if its content is `replaceable`, or with `force`; links, devices
    and folders are never replaced.

    Raises:
        StorageError: the file may not be replaced, or can't be written.

    """
    if not file.parent.is_dir():
        raise StorageError(f"can't write {file}: there is no such folder")
    if os.path.lexists(file):
        if not is_regular(file):
            raise StorageError(f"can't write {file}: it is {kind_of(file)}; give a new name")
        with suppress(OSError):  # an unreadable file may be the user's
            force = force or replaceable(file.read_bytes())
        if not force:
            raise StorageError(
                f"can't write {file}: this program did not write what is in it; choose another "
                "name, or force it",
                forcible=True,
            )
    try:
        _write(file, content)
    except OSError as error:
        raise StorageError(cannot_write(file, error)) from error


def check_regular(folder: Path, name: str) -> None:
    """Check that a path in a folder contains no link, and is a file or does not exist yet.

    Raises:
        StorageError: it is something else, which is never replaced or followed.

    """
    wrong = [above for above in folders_to(folder, name) if not is_folder(above)]
    wrong += [] if is_regular(folder / name) else [folder / name]
    for place in filter(os.path.lexists, wrong):
        raise StorageError(
            f"{place} is {kind_of(place)}; it is never replaced: move it away yourself, or choose "
            "another folder"
        )


def kind_of(place: Path) -> str:
    """Say what a path is."""
    if place.is_symlink():
        return "a link"
    kinds = {"folder": place.is_dir, "file": place.is_file, "pipe": place.is_fifo}
    return f"a {next((kind for kind, is_so in kinds.items() if is_so()), 'device')}"


def _put(staged: Path, now: Manifest, target: Path, *, add: bool = False) -> None:
    """Move the files of a folder to `target`, in place of the files of its earlier result.

    With `add`, the earlier files stay. OSError: `target` can't be written.
    """
    earlier = read_manifest(target)
    old = earlier.files if earlier else {}
    both = {name: (*old.get(name, ()), *now.files.get(name, ())) for name in old | now.files}
    completed = earlier is not None and earlier.completed and (add or now.completed)
    target.mkdir(parents=True, exist_ok=True)
    _write(target / MANIFEST, replace(earlier or now, files=both, completed=completed).content())
    runs = [name for name in now.files if Path(name).name == ARRAYS]
    whole = runs or [name for name in KINDS if name in now.files]  # replaced in one move
    for name in () if add else set(old) - set(whole):
        if is_ours(target, name, old[name]):
            (target / name).unlink()
    for name in sorted(now.files, key=lambda name: (name not in whole, name)):
        (target / name).parent.mkdir(exist_ok=True)
        _write(target / name, (staged / name).read_bytes())
    for folder in {target, *((target / name).parent for name in both)}:
        for rest in folder.glob(f"{PREFIX}*"):  # half-written files of killed processes
            with suppress(OSError):
                rest.rmdir() if is_folder(rest) else rest.unlink()
        with suppress(OSError):  # the folder is not empty
            folder.rmdir()
    last = replace(earlier, files=old | now.files) if add and earlier else now
    _write(target / MANIFEST, last.content())


def _write(place: Path, content: bytes) -> None:
    """Write a temporary file, then move it to its place, or raise OSError; a link is replaced."""
    beside = place.with_name(f"{PREFIX}{place.name}")
    try:
        beside.unlink(missing_ok=True)  # left by a killed process, or a link
        with beside.open("xb") as stream:
            stream.write(content)
        os.replace(beside, place)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


def _resolved(target: Path) -> Path:
    """Return the absolute path of a place; refuse an impossible path, such as a link to itself."""
    try:
        return Path(target).resolve()
    except (OSError, RuntimeError, ValueError) as error:
        raise StorageError(f"can't write {target}: {error}; choose another place") from error


@contextmanager
def _temporary(target: Path) -> Iterator[Path]:
    """Yield a new folder among the system's temporary folders, for files that move to `target`.

    Errors name `target`, which the user knows: StorageError replaces OSError.
    """
    try:
        with TemporaryDirectory(prefix="flexlink-", ignore_cleanup_errors=True) as folder:
            yield Path(folder)
    except OSError as error:
        raise StorageError(cannot_write(target, error)) from error


def _check_place(target: Path, now: Manifest, *, force: bool) -> None:
    """Refuse a folder that the result may not go into, or that can't be written.

    The result's kind is empty if it is not known yet.
    """
    try:
        earlier = read_manifest(target)
        entries = target.iterdir() if target.exists() else ()
        others = [entry for entry in entries if not entry.name.startswith(PREFIX)]
        if earlier is not None and now.what and earlier.what not in (now.what, FIGURES):
            does_not = f"{FIGURES} do not" if now.what == FIGURES else f"a {now.what} does not"
            raise StorageError(
                f"{target} holds a {earlier.words}, which {does_not} replace: choose another "
                "folder, or remove that one yourself"
            )
        if earlier is not None and earlier.completed and not (force or now.completed):
            raise StorageError(
                f"{target} holds a complete {earlier.words}; this one is incomplete and does not "
                "replace it, unless that is forced",
                forcible=True,
            )
        if earlier is None and others and not force:
            raise StorageError(
                f"{target} holds files that are no run of this program, or of an earlier version: "
                f"no {MANIFEST} names them; choose another name, or force it: files with the names "
                "of new ones are replaced then, and no others",
                forcible=True,
            )
        _check_files(
            target, [*now.files, *(earlier.files if earlier else ())], earlier, force=force
        )
    except NotADirectoryError:
        raise StorageError(f"{target} is {kind_of(target)}; give the name of a folder") from None
    except PermissionError as error:
        raise StorageError(f"can't read {target}: {error.strerror or error}") from error
    except OSError as error:  # for instance, the name is too long
        raise StorageError(cannot_write(target, error)) from error
    _try_to_write(target)


def _check_files(
    target: Path, names: Iterable[str], earlier: Manifest | None, *, force: bool
) -> None:
    """Refuse to write files of these names into a folder, unless its manifest names them.

    With `force`, files of the user may be replaced, but never a folder, link or device.
    """
    files = earlier.files if earlier else {}
    for name in (*names, MANIFEST):
        place = target / name
        check_regular(target, name)
        ours = name == MANIFEST and earlier is not None
        if force or ours or not place.exists() or is_ours(target, name, files.get(name, ())):
            continue
        changed = "was changed since the run there wrote it"
        why = changed if name in files else f"is the user's: no {MANIFEST} names it"
        raise StorageError(
            f"{place} {why}; rename it, choose another folder, or force it", forcible=True
        )


def _try_to_write(target: Path) -> None:
    """Refuse a place in which no folder can be made; delete the folders that this test makes."""
    trial = target / f"{PREFIX}trial"
    missing = [folder for folder in (trial, *trial.parents) if not folder.exists()]
    try:
        trial.mkdir(parents=True, exist_ok=True)
    except (OSError, RecursionError) as error:
        raise StorageError(cannot_write(target, error)) from error
    finally:
        for folder in missing:
            with suppress(OSError):
                folder.rmdir()


def _kept_beside(staged: Path, now: Manifest, target: Path) -> Path:
    """Move the staged files to a folder with a free name beside the target, or raise OSError."""
    names = (target.with_name(f"{target.name}-{number}") for number in count(2))
    beside = next(place for place in names if not os.path.lexists(place))
    try:
        _put(staged, now, beside)
    except OSError:
        shutil.rmtree(beside, ignore_errors=True)
        raise
    return beside

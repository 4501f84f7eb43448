"""Results appear whole or not at all, in place of what an earlier one wrote and of nothing else.

All is written into a temporary folder first. Then its files move into the folder of the result,
which can't be renamed away: files of the user may be in it. A process may be killed anywhere in
between, so that each step leaves what can be told apart:

1. The manifest names the files that are there and those that will come.
2. What was printed from the earlier result goes: tables, figures, summaries.
3. ``result.nc``, which is the run, takes the place of the earlier one in one move.
4. What was printed from the new one follows, then the manifest that names nothing else.

Up to step 3 the folder holds the earlier run, then the new one; never tables of the one beside the
other. The next run finds all files in the manifest, so that nothing keeps it from its place. Runs
that end in one folder in the same instant are not kept apart: the last stays, or it is told.

The manifest names the files that a result wrote, each with its SHA-256. A file is the program's own
if the manifest names it and it still has a content that was written. Everything else is the user's,
also a file of ours that was changed since. While a result takes the place of an earlier one, a file
may have the content of either.
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
    if isinstance(error, RecursionError):  # of `Path.mkdir`, which calls itself for each folder
        return f"can't write {place}: too many folders in each other; choose another place"
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return f"can't write {place}: the disk is full; make room, or choose another place"
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return f"can't write {place}: no permission to write there; choose another place"
    if error.errno in (errno.ENOENT, errno.ENOTDIR):
        return f"can't write {place}: no folder can be made there; choose another place"
    return f"can't write {place}: {error.strerror or error}; choose another place"


FIGURES = "figures"  # what a folder holds that has no document
KINDS = {
    SUMMARY: "run",
    COMPARISON: "comparison",
    ACCURACY: "study",
    SWEEP: "sweep",
    STABILITY: "stability",
    FIT: "fit",
}
"""What a folder holds, by the document that is in it."""


def _inside(name: str) -> str:
    """Return a path, with "/", that leads to a file in the folder or below; else ValueError."""
    if {"", ".", ".."} & set(name.split("/")) or set(name) & set("\\\0"):
        raise ValueError(f"'{name}' is no name of a file in the folder")
    return name


Name = Annotated[str, AfterValidator(_inside)]


@dataclass(frozen=True)
class Manifest:
    """What stands in a folder, and the SHA-256 that every file of it may have, by its path."""

    what: str
    title: str
    completed: bool
    files: dict[Name, tuple[str, ...]]
    program: Literal["exudyn-flexlink"] = PROGRAM

    @property
    def words(self) -> str:
        """What stands in the folder, in words."""
        return f"{self.what} of '{self.title}'" if self.title else self.what

    def content(self) -> bytes:
        """Return what stands in its file."""
        return to_json(self, indent=2) + b"\n"


_MANIFEST = TypeAdapter(Manifest)


def read_manifest(folder: Path) -> Manifest | None:
    """Read the manifest of a folder; None if it has none, or one that is not this program's."""
    file = folder / MANIFEST
    try:
        return _MANIFEST.validate_json(file.read_bytes()) if is_regular(file) else None
    except (OSError, ValueError):
        return None


def manifest_of(folder: Path) -> Manifest:
    """Return the manifest of a folder that holds nothing but a result, as it is now.

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
    """Paths of the files that the manifest of a folder names, with "/", and of that itself."""
    manifest = read_manifest(folder)
    return () if manifest is None else (MANIFEST, *manifest.files)


def folders_to(folder: Path, name: str) -> list[Path]:
    """Folders on the way from a folder to a file in it, the outermost first."""
    return [folder / above for above in PurePosixPath(name).parents][-2::-1]


def is_ours(folder: Path, name: str, contents: tuple[str, ...]) -> bool:
    """Tell whether a file of a folder, reached without a link, has one of these SHA-256."""
    reached = all(is_folder(above) for above in folders_to(folder, name))
    return reached and is_regular(folder / name) and digest(folder / name) in contents


def is_regular(file: Path) -> bool:
    """Tell whether there is a regular file: no link, folder, device or pipe."""
    try:
        return stat.S_ISREG(os.lstat(file).st_mode)
    except (OSError, ValueError):
        return False


def is_folder(folder: Path) -> bool:
    """Tell whether there is a folder, and no link to one."""
    return folder.is_dir() and not folder.is_symlink()


def digest(file: Path) -> str:
    """SHA-256 of a file, or OSError if it can't be read."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


PREFIX = ".flexlink-"  # of what is there only while something is written


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
    _check_place(target, Manifest(what, "", True, {}), force=force)
    with _temporary(target) as staged:
        yield staged
        now = manifest_of(staged)
        try:
            _check_place(target, now, force=force)  # hours may have passed
            _put(staged, now, target)
        except (StorageError, OSError) as error:
            why = StorageError(cannot_write(target, error)) if isinstance(error, OSError) else error
            raise KeptBesideError(why, _kept_beside(staged, now, target)) from None


@contextmanager
def staged_files(folder: Path, *, force: bool = False) -> Iterator[Path]:
    """Yield a temporary folder; once all is written there, its files are moved into `folder`.

    `folder` is made if it is missing. Files of the same names in it are replaced if its manifest
    names them, or with `force`; all others stay. A run of a comparison has no manifest of its own:
    that of the comparison names its files.

    Raises:
        StorageError: the folder can't be written, or a file of the user is in the way.

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

    A file that stands there is replaced if its content is `replaceable`, or with `force`;
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
    """Look whether a path in a folder leads, through no link, to a file or to nothing yet.

    Raises:
        StorageError: something else is there, which is never replaced nor followed.

    """
    wrong = [above for above in folders_to(folder, name) if not is_folder(above)]
    wrong += [] if is_regular(folder / name) else [folder / name]
    for place in filter(os.path.lexists, wrong):
        raise StorageError(
            f"{place} is {kind_of(place)}; it is never replaced: move it away yourself, or choose "
            "another folder"
        )


def kind_of(place: Path) -> str:
    """Say what stands in a place."""
    if place.is_symlink():
        return "a link"
    kinds = {"folder": place.is_dir, "file": place.is_file, "pipe": place.is_fifo}
    return f"a {next((kind for kind, is_so in kinds.items() if is_so()), 'device')}"


def _put(staged: Path, now: Manifest, target: Path, *, add: bool = False) -> None:
    """Move the files of a folder to `target`, in place of those of the result that is there.

    Where some are to be added, all of that stay. OSError: the place can't be written.
    """
    earlier = read_manifest(target)
    old = earlier.files if earlier else {}
    both = {name: (*old.get(name, ()), *now.files.get(name, ())) for name in old | now.files}
    completed = earlier is not None and earlier.completed and (add or now.completed)
    target.mkdir(parents=True, exist_ok=True)
    _write(target / MANIFEST, replace(earlier or now, files=both, completed=completed).content())
    runs = [name for name in now.files if Path(name).name == ARRAYS]
    whole = runs or [name for name in KINDS if name in now.files]  # it is replaced in one move
    for name in () if add else set(old) - set(whole):
        if is_ours(target, name, old[name]):
            (target / name).unlink()
    for name in sorted(now.files, key=lambda name: (name not in whole, name)):
        (target / name).parent.mkdir(exist_ok=True)
        _write(target / name, (staged / name).read_bytes())
    for folder in {target, *((target / name).parent for name in both)}:
        for rest in folder.glob(f"{PREFIX}*"):  # what killed processes left half written
            with suppress(OSError):
                rest.rmdir() if is_folder(rest) else rest.unlink()
        with suppress(OSError):  # it is not empty
            folder.rmdir()
    last = replace(earlier, files=old | now.files) if add and earlier else now
    _write(target / MANIFEST, last.content())


def _write(place: Path, content: bytes) -> None:
    """Write a file beside its place, then move it there, or raise OSError; a link is replaced."""
    beside = place.with_name(f"{PREFIX}{place.name}")
    try:
        beside.unlink(missing_ok=True)  # what a killed process left, or a link
        with beside.open("xb") as stream:
            stream.write(content)
        os.replace(beside, place)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


def _resolved(target: Path) -> Path:
    """Return the whole path of a place; refuse what is none, such as a link to itself."""
    try:
        return Path(target).resolve()
    except (OSError, RuntimeError, ValueError) as error:
        raise StorageError(f"can't write {target}: {error}; choose another place") from error


@contextmanager
def _temporary(target: Path) -> Iterator[Path]:
    """Yield a new folder among the system's temporary ones, for what shall be in `target`.

    Tell by that name, which the user knows, what can't be written: StorageError, not OSError.
    """
    try:
        with TemporaryDirectory(prefix="flexlink-", ignore_cleanup_errors=True) as folder:
            yield Path(folder)
    except OSError as error:
        raise StorageError(cannot_write(target, error)) from error


def _check_place(target: Path, now: Manifest, *, force: bool) -> None:
    """Refuse a folder that a result may not be put into, or that can't be written.

    The result's kind is empty if nobody knows it yet.
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
    except OSError as error:  # such as a name that is too long
        raise StorageError(cannot_write(target, error)) from error
    _try_to_write(target)


def _check_files(
    target: Path, names: Iterable[str], earlier: Manifest | None, *, force: bool
) -> None:
    """Refuse to write files of these names into a folder with the manifest `there`, if one is not.

    With `force`, the user's files may be replaced, too; never a folder, link or device.
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
    """Refuse a place in which no folder can be made; what is missing is missing afterwards, too."""
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
    """Move the staged files to a folder with a free name beside that of the target, or OSError."""
    names = (target.with_name(f"{target.name}-{number}") for number in count(2))
    beside = next(place for place in names if not os.path.lexists(place))
    try:
        _put(staged, now, beside)
    except OSError:
        shutil.rmtree(beside, ignore_errors=True)
        raise
    return beside

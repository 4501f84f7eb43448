"""New files take the place of those that an earlier run wrote, and of no others.

A folder that holds files of the user can't be renamed away: files move one by one. To be whole or
not at all, as far as a file system allows it, this is done in an order that can be taken up again:

1. A list of the files that have to go is written into the folder `WORK`.
2. The new files move to `WORK`/new together, by one rename. From then on they will all be there.
3. The old files move to `WORK`/old, the new ones to their places; then `WORK` is removed.

If a move fails, all are undone. If the process is killed before step 2 is done, the old result is
as it was. If it is killed later, list and folders tell which moves are missing, and whoever opens
the folder next makes them (`turn`), be it to read or to write.

Processes take turns by a lock on the folder. Where folders can't be locked (Windows, some network
disks), two runs that end in one folder in the same instant may hinder each other: that is an error,
and the later one is kept beside it. Power cuts are beyond this: what the disk has not yet written
then is lost.
"""

from __future__ import annotations

import errno
import json
import os
import shutil
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from exudyn_flexlink.storage.errors import MANIFEST, StorageError
from exudyn_flexlink.storage.locking import locked_folder
from exudyn_flexlink.storage.manifest import (
    PREFIX,
    is_folder,
    is_own,
    is_regular,
    own_files,
    read_manifest,
)

WORK = f"{PREFIX}replacing"
GOING = "going.json"
KINDS = ((stat.S_ISLNK, "link"), (stat.S_ISDIR, "folder"), (stat.S_ISFIFO, "pipe"))
_ADVICE = "it is never replaced: move it away yourself, or choose another folder"
TAKEN = (errno.EEXIST, errno.ENOTEMPTY, errno.ENOTDIR)


def put(staged: Path, target: Path, *, force: bool, add: bool = False) -> None:
    """Move a sealed folder, or its files, to `target`; after any error all is as it was.

    Files of an earlier run that the new one does not have are removed, unless it is to `add` some.

    Raises:
        StorageError: a file in the way is not the program's own, or what stands there is complete
            and the new result is not, without `force`.
        OSError: the place can't be written.

    """
    if not os.path.lexists(target):
        try:
            os.rename(staged, target)
        except OSError as error:
            if error.errno not in TAKEN:  # another run was faster
                raise
        else:
            return
    with turn(target):
        _check_complete(staged, target, force=force)
        new = list(_files(staged))
        check_replaceable(target, new, force=force)
        going = [name for name in new if os.path.lexists(target / name)]
        if not add:
            old = own_files(target).items()
            going += [n for n, content in old if n not in new and is_own(target / n, content)]
        _exchange(staged, target, going)


@contextmanager
def turn(folder: Path) -> Iterator[None]:
    """Wait until no other process moves files in a folder, and keep others waiting.

    What a killed process began to move is finished first.

    Raises:
        StorageError: it can't be.

    """
    descriptor: int | None = None
    with suppress(OSError):  # there is no folder
        descriptor = locked_folder(folder, wait=True)
    try:
        _finish(Path(folder) / WORK, Path(folder))
        yield
    finally:
        if descriptor is not None:
            os.close(descriptor)


def _finish(work: Path, folder: Path) -> None:
    try:
        if is_folder(work / "new"):
            _move(work, folder)
        elif is_folder(work):
            shutil.rmtree(work)
    except (OSError, ValueError) as error:
        raise StorageError(
            f"{folder} was being replaced when the program was killed, and that can't be finished: "
            f"{error}; see {work}"
        ) from None


def check_replaceable(target: Path, names: Iterable[str], *, force: bool) -> None:
    """Look whether files of these names may be written into an existing folder.

    With `force`, the user's files may be replaced, too; never a folder, link or device.

    Raises:
        StorageError: one of them may not.

    """
    own = own_files(target)
    for name in names:
        place = target / name
        for above in (folder for folder in place.parents if target in folder.parents):
            if os.path.lexists(above) and not is_folder(above):
                raise StorageError(f"{above} is {kind_of(above)}; {_ADVICE}")
        check_regular(target, [name])
        if not force and os.path.lexists(place) and not is_own(place, own.get(name)):
            changed = "was changed since the run there wrote it"
            why = changed if name in own else f"is the user's: no {MANIFEST} names it"
            raise StorageError(
                f"{place} {why}; rename it, choose another folder, or force it", forcible=True
            )


def check_regular(folder: Path, names: Iterable[str]) -> None:
    """Look whether nothing but regular files would be written over.

    Raises:
        StorageError: there is a link, a device or a folder.

    """
    for place in (Path(folder) / name for name in names):
        if os.path.lexists(place) and not is_regular(place):
            raise StorageError(f"{place} is {kind_of(place)}; {_ADVICE}")


def kind_of(place: Path) -> str:
    """Say what stands in a place."""
    mode = os.lstat(place).st_mode
    if stat.S_ISREG(mode):
        return "a file"
    return next((f"a {kind}" for test, kind in KINDS if test(mode)), "a device")


def _check_complete(staged: Path, target: Path, *, force: bool) -> None:
    there, new = read_manifest(target), read_manifest(staged)
    if there is not None and there.completed and not (force or (new and new.completed)):
        raise StorageError(
            f"{target} holds a complete {there.told}; this one is incomplete and does not replace "
            "it, unless that is forced",
            forcible=True,
        )


def _exchange(staged: Path, target: Path, going: list[str]) -> None:
    """Move the files `going` out of the target, and those staged into it.

    Raises:
        StorageError: something is in the way.
        OSError: the place can't be written.

    """
    work = target / WORK
    work.mkdir()
    try:
        (work / GOING).write_text(json.dumps(going), encoding="utf-8")
        os.rename(staged, work / "new")
        _move(work, target)
    except (OSError, StorageError):
        if not any(_files(work / "old")):  # all is undone
            with suppress(FileNotFoundError):
                os.rename(work / "new", staged)
            shutil.rmtree(work, ignore_errors=True)
        raise


def _move(work: Path, target: Path) -> None:
    """Make the moves that are missing, then remove `work`.

    Raises:
        StorageError: something is in the way.
        OSError: a move failed; all are undone.

    """
    new, old = work / "new", work / "old"
    listed = json.loads((work / GOING).read_text(encoding="utf-8"))
    going = [n for n in listed if os.path.lexists(target / n) and not os.path.lexists(old / n)]
    coming = list(_files(new))
    for name in coming:
        if name not in going and os.path.lexists(target / name):
            raise StorageError(
                f"{target} was being replaced when the program was killed; {target / name} is in "
                f"the way of the new one, in {new}: rename it"
            )
    moves = [(target / name, old / name) for name in going]
    moves += [(new / name, target / name) for name in coming]
    done = []
    try:
        for source, place in moves:
            place.parent.mkdir(parents=True, exist_ok=True)
            os.rename(source, place)
            done.append((source, place))
    except OSError:
        for source, place in reversed(done):
            os.rename(place, source)
        raise
    for folder in {(target / name).parent for name in listed} - {target}:
        with suppress(OSError):  # something of the user, or of the new run, is in it
            folder.rmdir()
    shutil.rmtree(new, ignore_errors=True)
    shutil.rmtree(work, ignore_errors=True)


def _files(folder: Path) -> Iterator[str]:
    """Paths of all files in a folder, relative to it, with "/"."""
    for entry in sorted(folder.iterdir()) if folder.is_dir() else ():
        if is_folder(entry):
            yield from (f"{entry.name}/{name}" for name in _files(entry))
        else:
            yield entry.name

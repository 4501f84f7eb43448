"""New files take the place of those that an earlier result wrote, and of no others.

A folder that holds files of the user can't be renamed away: files are replaced one by one. A
process may be killed anywhere in between, so that each step leaves what can be told apart:

1. The manifest names the files that are there and those that will come.
2. What was printed from the earlier result goes: tables, figures, summaries.
3. ``result.nc``, which is the run, takes the place of the earlier one in one move.
4. What was printed from the new one follows, then the manifest that names nothing else.

Up to step 3 the folder holds the earlier run, then the new one; never tables of the one beside the
other. The next run finds all files in the manifest, so that nothing keeps it from its place. Runs
that end in one folder in the same instant are not kept apart: the last stays, or it is told.
"""

from __future__ import annotations

import os
import shutil
import stat
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from exudyn_flexlink.storage.errors import ARRAYS, MANIFEST, StorageError
from exudyn_flexlink.storage.manifest import (
    FIGURES,
    KINDS,
    PREFIX,
    is_folder,
    is_own,
    is_regular,
    manifest_of,
    own_files,
    read_manifest,
)

WHOLE = (ARRAYS, *KINDS)  # the first of them that there is stands for the whole result
FILE_KINDS = ((stat.S_ISLNK, "link"), (stat.S_ISDIR, "folder"), (stat.S_ISFIFO, "pipe"))
_ADVICE = "it is never replaced: move it away yourself, or choose another folder"


def put(staged: Path, target: Path, *, force: bool, add: bool = False) -> None:
    """Move the files of a folder to `target`, which is made if it is missing.

    Files of an earlier result that the new one does not have are removed, unless it is to `add`
    some.

    Raises:
        StorageError: a file in the way is not the program's own, or what stands there is complete
            and the new result is not, without `force`.
        OSError: the place can't be written.

    """
    now, there = manifest_of(staged), read_manifest(target)
    if not add:
        check_kind(target, now.what)
        if there is not None and there.completed and not (force or now.completed):
            raise StorageError(
                f"{target} holds a complete {there.told}; this one is incomplete and does not "
                "replace it, unless that is forced",
                forcible=True,
            )
    check_replaceable(target, _files(staged), force=force)
    _replace(staged, target, add=add)


def _replace(staged: Path, target: Path, *, add: bool) -> None:
    """Replace the files of a folder, and of those in it: they come before what tells of them."""
    target.mkdir(parents=True, exist_ok=True)
    now, there = manifest_of(staged), read_manifest(target)
    new, coming = list(now.files), replace(now, completed=False)
    if there is not None:
        old, folders = there.files, tuple(dict.fromkeys((*there.folders, *now.folders)))
        both = {name: (*old.get(name, ()), *now.files.get(name, ())) for name in old | now.files}
        done = there.completed and now.completed
        coming = replace(there, files=both, folders=folders, completed=done)
        if add:
            now = replace(there, files=old | now.files, folders=folders)
    coming.write(target)
    inside = manifest_of(staged).folders
    whole = None if inside else next((name for name in WHOLE if name in new), None)
    if not add:
        _remove_own(target, but=whole)
    for name in inside:
        _replace(staged / name, target / name, add=add)
    for name in sorted(new, key=lambda name: (name != whole, name)):
        _move(staged / name, target / name)
    for name in set(coming.folders) - set(now.folders):
        _remove_folder(target / name)
    now.write(target)
    for rest in target.glob(f"{PREFIX}*"):  # what killed processes left half copied
        with suppress(OSError):
            rest.rmdir() if is_folder(rest) else rest.unlink()


def _remove_own(folder: Path, *, but: str | None = None) -> None:
    """Remove the files of a result from a folder, but for its manifest."""
    manifest = read_manifest(folder)
    for name, contents in manifest.files.items() if manifest else ():
        if name != but and is_own(folder / name, contents):
            (folder / name).unlink()


def _remove_folder(folder: Path) -> None:
    """Remove a folder of an earlier result, and those in it, unless something else is in it."""
    manifest = read_manifest(folder) if is_folder(folder) else None
    if manifest is None:
        return
    for name in manifest.folders:
        _remove_folder(folder / name)
    _remove_own(folder)
    (folder / MANIFEST).unlink()
    with suppress(OSError):
        folder.rmdir()


def _move(source: Path, place: Path) -> None:
    """Copy a file beside its place, which may be on another disk, then move it there at once."""
    beside = place.with_name(f"{PREFIX}{place.name}")
    shutil.copyfile(source, beside)
    os.replace(beside, place)


def check_replaceable(target: Path, names: Iterable[str], *, force: bool) -> None:
    """Look whether files of these names may be written into an existing folder.

    With `force`, the user's files may be replaced, too; never a folder, link or device.

    Raises:
        StorageError: one of them may not.

    """
    own = own_files(target)
    for name in (*names, MANIFEST):
        place = target / name
        for above in (folder for folder in place.parents if target in folder.parents):
            if os.path.lexists(above) and not is_folder(above):
                raise StorageError(f"{above} is {kind_of(above)}; {_ADVICE}")
        if not os.path.lexists(place):
            continue
        if not is_regular(place):
            raise StorageError(f"{place} is {kind_of(place)}; {_ADVICE}")
        if not force and not is_own(place, own.get(name, ())):
            changed = "was changed since the run there wrote it"
            why = changed if name in own else f"is the user's: no {MANIFEST} names it"
            raise StorageError(
                f"{place} {why}; rename it, choose another folder, or force it", forcible=True
            )


def check_kind(target: Path, what: str) -> None:
    """Look whether a folder holds nothing else than what is to be put there.

    Raises:
        StorageError: it holds a result of another kind, which is never replaced.

    """
    there = read_manifest(target)
    if there is not None and there.what not in (what, FIGURES):
        does_not = f"{what} do not" if what == FIGURES else f"a {what} does not"
        raise StorageError(
            f"{target} holds a {there.told}, which {does_not} replace: choose another "
            "folder, or remove that one yourself"
        )


def kind_of(place: Path) -> str:
    """Say what stands in a place."""
    mode = os.lstat(place).st_mode
    if stat.S_ISREG(mode):
        return "a file"
    return next((f"a {kind}" for test, kind in FILE_KINDS if test(mode)), "a device")


def _files(folder: Path) -> Iterator[str]:
    """Paths of all files in a folder, relative to it, with "/"."""
    for entry in sorted(folder.rglob("*")):
        if not is_folder(entry):
            yield entry.relative_to(folder).as_posix()

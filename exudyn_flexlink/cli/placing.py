"""Where a command puts its result: where it is asked to, or beside it, and what it calls it."""

from __future__ import annotations

import argparse
import hashlib
import os
import re
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from exudyn_flexlink.cli.ctrl_c import deferrable_interrupts
from exudyn_flexlink.cli.terminal import BAD_INPUT, INTERRUPTED, complain, refuse, tell
from exudyn_flexlink.storage import KeptBesideError, own_files, staged_folder

LONGEST = 80  # characters: a name that a listing shows whole, far below the 255 of file systems
DIGEST = 8  # hex digits of a SHA-256: 4e9 names; a folder holds a few hundred
UNSAFE = re.compile(r"[^\w.,=+-]+")  # what a shell, or a file system, takes for something else
NUMBER = re.compile(r"([+-]?[\d.]+(?:e[+-]?\d+)?)\s*([a-z][a-z /]*)?", re.IGNORECASE)


class Place:
    """The folder a result shall end in, `target`; after writing, the one it did end in."""

    def __init__(self, options: argparse.Namespace, suffix: str = "", what: str = "run") -> None:
        """Take the place that was asked for, or a folder in `runs` named as the run is.

        `what` is the kind of result, see `storage.manifest`.
        """
        self._what = what
        self.target: Path = options.out or Path("runs") / run_name(options, suffix)
        self._force, self._quiet = options.force, options.quiet
        self._replaces: bool | None = None  # an earlier run; known when writing begins
        self._why: KeptBesideError | None = None
        self._pressed = False

    def code(self, code: int) -> int:
        """Exit code of a command that would end with `code` if Ctrl-C had not come last."""
        return INTERRUPTED if self._pressed else code

    def tell(self, text: str) -> None:
        """Print a summary, then where the result is and what is in it; nothing if it is `quiet`."""
        if self._quiet:
            return
        tell(text)
        instead = " in place of an earlier run" if self._replaces else ""
        tell(f"\nWritten to {self.target}{os.sep}{instead}:\n  {contents(self.target)}")

    def ended(self, code: int, whole: str = "") -> int:
        """Say why the result is not where it should be; returns the exit code, see `code`.

        If Ctrl-C came, but so late that something is `whole`, that is said.
        """
        code = self.code(code)
        if code == INTERRUPTED and whole:
            complain(f"interrupted: {whole}, in {self.target}{os.sep}")
        return refuse(self._why, code or BAD_INPUT) if self._why else code

    @contextmanager
    def written(self) -> Iterator[Path]:
        """Yield the folder to write into; Ctrl-C does not keep what is in it from its place."""
        if self._replaces is None:  # what is written twice replaces no earlier run
            self._replaces = bool(own_files(self.target))
        with deferrable_interrupts() as ctrl_c:
            try:
                with staged_folder(self.target, force=self._force, what=self._what) as folder:
                    yield folder
                    ctrl_c.defer()
            except KeptBesideError as error:
                self.target, self._why = error.folder, error
                self._replaces = False
        self._pressed = ctrl_c.pending


def contents(folder: Path) -> str:
    """Name the files of a result, and count those of every folder in it."""
    paths = sorted(own_files(folder))
    inside = Counter(path.partition("/")[0] for path in paths if "/" in path)
    told = [path for path in paths if "/" not in path]
    return ", ".join([*told, *(f"{name}/ ({number} files)" for name, number in inside.items())])


def run_name(options: argparse.Namespace, suffix: str = "") -> str:
    """Return the name of the folder for a run of a model with the options of the command line.

    Such as ``no_clearance-lagrangian-turns=2``. Only what changes the motion is in the name: the
    engine if it is not Exudyn, the kind of impact, effects left out, and settings, with what is
    varied, in the order of their names. A name that is too long, or has lost characters, ends in a
    digest of all of it.
    """
    model: Path = options.model
    # The stem of '..yaml' is '.', which would be the folder above.
    stem = model.stem if model.stem.strip(".") and not model.is_dir() else model.resolve().name
    whole = f"{stem}{suffix}"
    engine = getattr(options, "engine", None) or "exudyn"
    parts = [engine] if engine != "exudyn" else []
    parts += [options.impact] if options.impact else []
    without = sorted(set(options.without))
    parts += [f"without_{'_'.join(without)}"] if without else []
    given = [*options.settings, *getattr(options, "over", [])]
    settings = dict(setting.partition("=")[::2] for setting in given)
    told = [(_setting(path, value), f"{path}={value}") for path, value in sorted(settings.items())]
    parts += [name for name, _ in told]
    short = "-".join([whole, *parts])
    lossless = all(UNSAFE.search(name) is None for name in parts)
    if lossless and len(short) <= max(LONGEST, len(whole)):
        return short
    digest = hashlib.sha256("\n".join([*parts, *(text for _, text in told)]).encode()).hexdigest()
    room = max(LONGEST - len(whole) - DIGEST - 2, 0)  # 2: hyphens
    kept = UNSAFE.sub("_", "-".join(parts)).replace("=_", "=")[:room]
    return "-".join(part for part in (whole, kept.rstrip("-_.=,"), digest[:DIGEST]) if part)


def _setting(path: str, value: str) -> str:
    """Return a setting without its section, and a number without the spaces before its unit."""
    key = path.strip().partition(".")[2] or path.strip()
    value = value.strip()
    if not value:  # what is varied within its own bounds
        return key
    quantity = NUMBER.fullmatch(value)
    if quantity:  # "15 rad/s", "2 N m s/rad": no unit has a dot or an underscore, nothing is lost
        number, unit = quantity[1], quantity[2] or ""
        value = number + ".".join(unit.split()).replace("/", "_")
    return f"{key}={value}"

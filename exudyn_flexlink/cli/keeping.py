"""How commands keep their results: if a figure or a page fails, no numbers are lost.

A result goes into the folder that the user names, or else into a folder named by the options.
Numbers are saved first, then figures are drawn. Ctrl-C waits while numbers are saved. The command
`new`, which copies a model that comes with the program, is here, too.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import re
import shlex
import signal
import textwrap
from argparse import ArgumentTypeError, Namespace
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

from exudyn_flexlink.cli.figures import draw_figure
from exudyn_flexlink.cli.terminal import (
    BAD_INPUT,
    DONE,
    FAILED,
    INTERRUPTED,
    complain,
    how_called,
    refuse,
    tell,
)
from exudyn_flexlink.engines.interrupts import Stopping, stopped_by
from exudyn_flexlink.loading import ImpossibleLengthError
from exudyn_flexlink.report.text import WIDTH
from exudyn_flexlink.scene import is_schema
from exudyn_flexlink.shipped import EXUDYN, FIGURE_FORMATS, model_names, models_folder
from exudyn_flexlink.source import SceneError, load_document
from exudyn_flexlink.storage import (
    KeptBesideError,
    StorageError,
    replace_file,
    save_study,
    staged_folder,
    written_files,
)
from exudyn_flexlink.storage.studies import AnyStudy
from exudyn_flexlink.sweeps import CannotStartError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


DIGEST = 8  # hex digits of a SHA-256: 4e9 names; a folder holds a few hundred
UNSAFE = re.compile(r"[^\w.,=+-]+")  # special to a shell or a file system
NUMBER = re.compile(r"([+-]?[\d.]+(?:e[+-]?\d+)?)\s*([a-z][a-z /]*)?", re.IGNORECASE)


class Place:
    """The folder of a result: `target` is the wanted folder, and after writing the actual one."""

    def __init__(self, options: argparse.Namespace, suffix: str = "", what: str = "run") -> None:
        """Take the folder that the options name, or a folder in `runs` with the name of the run.

        `what` is the kind of result, see `storage.manifest`.
        """
        self._what = what
        self.target: Path = options.out or Path("runs") / run_name(options, suffix)
        self._force, self._quiet = options.force, options.quiet
        self._replaces: bool | None = None  # an earlier run? Known when writing begins
        self._why: KeptBesideError | None = None
        self._pressed = False

    def code(self, code: int) -> int:
        """Exit code of a command: `code`, or that of an interrupt if Ctrl-C came during writing."""
        return INTERRUPTED if self._pressed else code

    def tell(self, text: str) -> None:
        """Print a summary, the folder of the result and its contents; nothing with `--quiet`."""
        if self._quiet:
            return
        tell(text)
        instead = " in place of an earlier run" if self._replaces else ""
        tell(f"\nWritten to {self.target}{os.sep}{instead}:\n  {contents(self.target)}")

    def ended(self, code: int, whole: str = "") -> int:
        """Say why the result is not in the wanted folder; returns the exit code.

        `whole` is the message if Ctrl-C came after the result was complete.
        """
        code = self.code(code)
        if code == INTERRUPTED and whole:
            complain(f"interrupted: {whole}, in {self.target}{os.sep}")
        return refuse(self._why, code or BAD_INPUT) if self._why else code

    @contextmanager
    def written(self) -> Iterator[Path]:
        """Yield a folder to write into, which then replaces the target; Ctrl-C waits for that."""
        if self._replaces is None:  # the second writing of one run replaces no earlier run
            self._replaces = bool(written_files(self.target))
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
    paths = sorted(written_files(folder))
    inside = Counter(path.partition("/")[0] for path in paths if "/" in path)
    files = [path for path in paths if "/" not in path]
    return ", ".join([*files, *(f"{name}/ ({number} files)" for name, number in inside.items())])


def run_name(options: argparse.Namespace, suffix: str = "") -> str:
    """Return the name of the folder for a run of a model with the options of the command line.

    An example is ``no_clearance-lagrangian-turns=2``. The name has only what changes the motion:
    the engine if it is not Exudyn, the kind of impact, effects left out, then settings and varied
    paths, in alphabetical order. If the name is shortened, or loses characters, it ends in a digest
    of the whole name.
    """
    model: Path = options.model
    # The stem of '..yaml' is '.', which would be the folder above.
    stem = model.stem if model.stem.strip(".") and not model.is_dir() else model.resolve().name
    whole = f"{stem}{suffix}"
    engine = getattr(options, "engine", None) or EXUDYN
    parts = [engine] if engine != EXUDYN else []
    parts += [options.impact] if options.impact else []
    without = sorted(set(options.without))
    parts += [f"without_{'_'.join(without)}"] if without else []
    given = [*options.settings, *getattr(options, "over", [])]
    settings = dict(setting.partition("=")[::2] for setting in given)
    set_values = [
        (_setting(path, value), f"{path}={value}") for path, value in sorted(settings.items())
    ]
    parts += [name for name, _ in set_values]
    short = "-".join([whole, *parts])
    lossless = all(UNSAFE.search(name) is None for name in parts)
    if lossless and len(short) <= max(WIDTH, len(whole)):  # short enough to stay whole
        return short
    digest = hashlib.sha256(
        "\n".join([*parts, *(text for _, text in set_values)]).encode()
    ).hexdigest()
    room = max(WIDTH - len(whole) - DIGEST - 2, 0)  # 2: hyphens
    kept = UNSAFE.sub("_", "-".join(parts)).replace("=_", "=")[:room]
    return "-".join(part for part in (whole, kept.rstrip("-_.=,"), digest[:DIGEST]) if part)


def _setting(path: str, value: str) -> str:
    """Return a setting without its section, and without spaces between a number and its unit."""
    key = path.strip().partition(".")[2] or path.strip()
    value = value.strip()
    if not value:  # a varied path without bounds
        return key
    quantity = NUMBER.fullmatch(value)
    if quantity:  # "15 rad/s", "2 N m s/rad": no unit has a dot or an underscore, nothing is lost
        number, unit = quantity[1], quantity[2] or ""
        value = number + ".".join(unit.split()).replace("/", "_")
    return f"{key}={value}"


REFUSALS = (ArgumentTypeError, CannotStartError, ImpossibleLengthError, SceneError, StorageError)
"""Errors by which a command refuses a request; the exit code is then 2.

They mean impossible options, models with mistakes, unreadable or unwritable places, no workers.
"""


def save_and_draw(save: Callable[[], Any], draw: Callable[[], Any] | None, folder: Path) -> int:
    """Save numbers while Ctrl-C waits; then `draw` figures, if any are wanted.

    Returns the exit code; see `draw_figures`.
    """
    with deferrable_interrupts() as ctrl_c:
        ctrl_c.defer()
        save()
    if ctrl_c.pending or draw is None:
        return INTERRUPTED if ctrl_c.pending else DONE
    return draw_figures(folder, draw)


def write_study(
    study: AnyStudy, folder: Path, options: Namespace, figure: str, **verdict: Any
) -> int:
    """Write a study, and its figure, unless none is wanted; `verdict` is for `save_study`.

    Returns the exit code; see `draw_figures`.
    """
    draw = None if options.no_plots else partial(draw_figure, options, figure, study, folder)
    return save_and_draw(partial(save_study, study, folder, **verdict), draw, folder)


def draw_figures(folder: Path, draw: Callable[[], Any]) -> int:
    """Draw figures into a folder beside the numbers.

    Returns the exit code: `DONE`, `INTERRUPTED` if the user pressed Ctrl-C, or `FAILED`, with a
    message, if figures can't be drawn. Unless it is `DONE`, no figure is left in the folder.
    """
    code = add_output("figures", draw)
    for suffix in FIGURE_FORMATS if code else ():
        for file in folder.rglob(f"*.{suffix}"):  # the last may be incomplete
            file.unlink()
    return code


def add_output(what: str, make: Callable[[], Any]) -> int:
    """Make a figure or a page of saved numbers; returns the exit code.

    A message says why it failed, and that the numbers are kept.
    """
    try:
        make()
    except KeyboardInterrupt:
        return INTERRUPTED
    except Exception as error:  # includes errors in the program itself
        return complain(f"no {what}: {_why_not(error)}; the numbers are kept", FAILED)
    return DONE


def write_figure(file: Path, draw: Callable[[], Figure], *, force: bool) -> int:
    """Draw a figure into a file; returns the exit code, see `make_output`."""
    from exudyn_flexlink.plots import figure_bytes, is_figure

    def write() -> None:
        content = figure_bytes(draw(), file.suffix[1:].lower())
        replace_file(file, content, is_figure, force=force)

    return make_output("figure", write)


def make_output(what: str, make: Callable[[], Any]) -> int:
    """Make the only output of a command; returns the exit code, and reports errors of the program.

    Raises:
        REFUSALS: the user asked for something impossible.

    """
    try:
        make()
    except REFUSALS:
        raise
    except Exception as error:
        return complain(f"no {what}: {_why_not(error)}; please report it", FAILED)
    return DONE


def _why_not(error: Exception) -> str:
    """Say why there are no figures, or no page."""
    if isinstance(error, MemoryError):
        return "not enough memory"
    if isinstance(error, OSError):
        return f"they can't be written: {error.strerror or error}"
    return str(error) if isinstance(error, StorageError) else f"{type(error).__name__}: {error}"


SCHEMA = "flexlink.schema.json"
SCHEMA_LINE = re.compile(r"(?<=^# yaml-language-server: \$schema=)\S+", re.MULTILINE)


def new_command(options: argparse.Namespace) -> int:
    """Copy a model with the files it needs, or list all models; returns the exit code."""
    if options.list:
        tell(_listed())
        return DONE
    model: Path = options.model
    document = load_document(model)
    target: Path = options.file or Path(model.name)
    target = target / model.name if target.is_dir() else target
    points = list(dict.fromkeys(_point_files(document.data)))
    texts = {target: SCHEMA_LINE.sub(SCHEMA, document.text)}
    texts |= {target.with_name(name): _text(model.parent / name) for name in points}
    texts[target.with_name(SCHEMA)] = _text(models_folder() / SCHEMA)
    _write(texts, model.stem, force=options.force)
    tell(_next_steps(target, document.data["title"], points))
    return DONE


def _point_files(value: Any) -> Iterator[str]:
    """Names of the CSV files that a model reads."""
    if isinstance(value, dict):
        if isinstance(value.get("file"), str):
            yield value["file"]
        value = list(value.values())
    for item in value if isinstance(value, list) else ():
        yield from _point_files(item)


def _write(texts: dict[Path, str], model: str, *, force: bool) -> None:
    """Write all files, the model first. If one fails, the new ones are removed again."""
    new = [file for file in texts if not file.exists()]
    try:
        for file, text in texts.items():
            content = text.encode()
            same = holds_schema if file.name == SCHEMA else content.__eq__
            replace_file(file, content, same, force=force)
    except StorageError as error:
        for other in new:
            with suppress(OSError):
                other.unlink()
        if file != next(iter(texts)):
            hint = f"hint: '{model}' needs it beside itself; give a FILE in another folder"
            raise StorageError(f"{error}\n{hint}") from error
        raise


def _next_steps(target: Path, title: str, points: list[str]) -> str:
    """Say what was written, and what the user may do with it."""
    program, file = how_called(), shlex.quote(str(target))
    needed = [f"  {target.with_name(name)}  its points" for name in points]
    return "\n".join(
        [
            f"Written to {target}: {title}",
            *needed,
            f"  {target.with_name(SCHEMA)}  with which editors complete and check it",
            "",
            "Change it, look at what it is now, and run it:",
            f"  {program} check {file}",
            f"  {program} simulate {file}",
        ]
    )


def _listed() -> str:
    """All models with their titles: those of the paper first, then the other folders."""
    names = sorted(model_names(), key=lambda name: ("/" in name, name))
    titles = {name: load_document(models_folder() / f"{name}.yaml").data["title"] for name in names}
    lines, folder = [f"Models; '{how_called()} new MODEL' copies one:", ""], ""
    for name, title in titles.items():
        above = name.rpartition("/")[0]
        if above != folder:
            lines.append("")
        folder = above
        same = [len(other) for other in names if other.rpartition("/")[0] == above]
        row = f"  {name:{max(same)}}  "
        lines += textwrap.wrap(title, WIDTH, initial_indent=row, subsequent_indent=" " * len(row))
    return "\n".join(lines)


def holds_schema(content: bytes) -> bool:
    """Tell whether the content of a file is the schema of model files."""
    return is_schema(content.decode(errors="replace"))


def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8")


class DeferrableInterrupt:
    """A handler of Ctrl-C: it calls the handler `before`; after `defer` it only sets `pending`."""

    def __init__(self, before: Any) -> None:
        self.before = before
        self._defers = False
        self.pending = False
        """Whether a Ctrl-C was deferred."""

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Take a Ctrl-C."""
        if self._defers:
            self.pending = True
        elif callable(self.before):
            self.before(number, frame)
        elif number != signal.SIGINT:
            # Other signals come through this handler, too. Only Ctrl-C may be ignored.
            raise KeyboardInterrupt

    def defer(self) -> None:
        """Let Ctrl-C set `pending` from now on, and do nothing else."""
        self._defers = True


@contextmanager
def _handled_by(handler: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    """Let a handler take Ctrl-C within this context."""
    before = signal.getsignal(signal.SIGINT)
    try:
        signal.signal(signal.SIGINT, handler)
    except ValueError:  # only the main thread may handle signals
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)


@contextmanager
def deferrable_interrupts() -> Iterator[DeferrableInterrupt]:
    """Let Ctrl-C do what it did before, until `defer` is called on the handler."""
    handler = DeferrableInterrupt(signal.getsignal(signal.SIGINT))
    with _handled_by(handler):
        yield handler


@contextmanager
def interrupts(end: Callable[[], None]) -> Iterator[None]:
    """Let Ctrl-C call `end` in place of interrupting a solver anywhere.

    Then `simulate` puts the result together, and further Ctrl-C is deferred. If Ctrl-C is ignored,
    it stays ignored; only other signals, which use the same handler, then end the run.
    """
    before = signal.getsignal(signal.SIGINT)
    ignored = (
        before.before if isinstance(before, DeferrableInterrupt) else before
    ) is signal.SIG_IGN

    def handle(number: int, _frame: FrameType | None) -> None:
        if number != signal.SIGINT or not ignored:
            end()

    with _handled_by(handle):
        try:
            yield
        finally:
            if isinstance(before, DeferrableInterrupt):
                before.defer()


@contextmanager
def ends_runs() -> Iterator[None]:
    """Let Ctrl-C end the runs within this context: see `interrupts`."""
    with stopped_by(Stopping(interrupts, deferrable_interrupts)):
        yield

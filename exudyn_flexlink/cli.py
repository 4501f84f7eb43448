"""The program at a terminal: arguments in, one function called, an exit code out.

Exit codes: 0 done; 1 the run failed, what it computed is kept; 2 bad input; 130 interrupted.
Whatever is slow to import is imported by the command that needs it: `check` must answer at once.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from exudyn_flexlink.result import Result

DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
SOON = 1.0  # s: a run shorter than this needs no progress bar


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program with the arguments of a command line; returns its exit code."""
    options = _parser().parse_args(arguments)
    try:
        code: int = options.command(options)
        sys.stdout.flush()
    except KeyboardInterrupt:
        return _complain("interrupted; nothing was written", INTERRUPTED)
    except BrokenPipeError:
        # The reader, such as `head`, has seen enough: Python must not complain as it flushes.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    return code


# --- commands -------------------------------------------------------------------------------


def _simulate(options: argparse.Namespace) -> int:
    from exudyn_flexlink.engines import NotRepresentableError, simulate
    from exudyn_flexlink.loading import load_scene
    from exudyn_flexlink.source import SceneError
    from exudyn_flexlink.storage import StorageError, staged_folder

    target: Path = options.out or Path("runs") / options.model.stem
    try:
        scene = load_scene(options.model, options.settings, options.allow_outside)
        # The folder is staged first: one that can't be written is no news for the end of a run.
        with staged_folder(target) as folder:
            with _progress_bar(options.quiet) as progress:
                result = simulate(scene, progress=progress)
            _write(result, folder, figures=not options.no_plots)
    except (SceneError, StorageError) as error:
        return _complain(str(error), BAD_INPUT)
    except NotRepresentableError as error:
        return _complain(f"{options.model}: {error}", BAD_INPUT)
    return _tell(result, target, options.quiet)


def _write(result: Result, folder: Path, *, figures: bool) -> None:
    from exudyn_flexlink.storage import save

    save(result, folder)
    if figures:
        from exudyn_flexlink.plots import save_figures

        save_figures(result, folder)


def _tell(result: Result, target: Path, quiet: bool) -> int:
    """Print the summary; warnings and a failure also where the summary is not wanted."""
    from exudyn_flexlink.report import failure_text, run_text
    from exudyn_flexlink.result import INTERRUPTED as STOPPED

    if not quiet:
        print(run_text(result))
        print(f"\nWritten to {target}{os.sep}: {', '.join(_names(target))}")
        sys.stdout.flush()  # so that what follows on stderr stands below it
    for warning in result.warnings:
        _complain(f"warning: {warning}")
    if result.outcome.completed:
        return DONE
    code = INTERRUPTED if result.outcome.reason == STOPPED else FAILED
    kept = f"what was computed until then is in {target}{os.sep}, marked as incomplete"
    return _complain(f"{failure_text(result)}\n{kept}", code)


def _names(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def _check(options: argparse.Namespace) -> int:
    from exudyn_flexlink.loading import assemble_scene, load_scene
    from exudyn_flexlink.report import check_text
    from exudyn_flexlink.source import SceneError

    try:
        scene = load_scene(options.model, options.settings, options.allow_outside)
        assembly = assemble_scene(scene)
    except SceneError as error:
        return _complain(str(error), BAD_INPUT)
    print(f"{options.model}: no mistakes\n\n{check_text(scene, assembly)}")
    return DONE


def _plot(options: argparse.Namespace) -> int:
    from exudyn_flexlink.plots import save_figures
    from exudyn_flexlink.storage import StorageError, load

    folder: Path = options.out or options.run
    try:
        result = load(options.run)
        folder.mkdir(parents=True, exist_ok=True)
        save_figures(result, folder)
    except StorageError as error:
        return _complain(str(error), BAD_INPUT)
    except OSError as error:
        return _complain(f"can't write to {folder}: {error.strerror}", BAD_INPUT)
    print(f"Figures written to {folder}{os.sep}")
    return DONE


def _schema(options: argparse.Namespace) -> int:
    from exudyn_flexlink.scene import json_schema

    text = json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n"
    if options.out is None:
        print(text, end="")
        return DONE
    try:
        options.out.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        return _complain(f"can't write {options.out}: {error.strerror}", BAD_INPUT)
    return DONE


def _complain(text: str, code: int = DONE) -> int:
    """Say something on stderr, and hand on the exit code that goes with it."""
    print(text, file=sys.stderr)
    return code


# --- progress -------------------------------------------------------------------------------


@contextmanager
def _progress_bar(quiet: bool) -> Iterator[_Bar | None]:
    """Give a bar if there is someone at a terminal to see it, else None."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    bar = _Bar()
    try:
        yield bar
    finally:
        bar.close()


class _Bar:
    """A progress bar with the time left, on stderr, that appears only in runs over a second."""

    def __init__(self) -> None:
        self._began = time.monotonic()
        self._bar: Any = None

    def __call__(self, done: float) -> None:
        if self._bar is None:
            if time.monotonic() - self._began < SOON:
                return
            self._open()
        self._bar.update(self._bar.task_ids[0], completed=done)

    def close(self) -> None:
        """Take the bar away."""
        if self._bar is not None:
            self._bar.stop()

    def _open(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn
        from rich.progress import TimeRemainingColumn as TimeLeft

        columns = (TextColumn("simulating"), BarColumn(), TaskProgressColumn(), TimeLeft())
        self._bar = Progress(*columns, TextColumn("left"), console=Console(stderr=True),
                             transient=True)  # fmt: skip
        self._bar.add_task("simulating", total=1.0)
        self._bar.start()


# --- arguments ------------------------------------------------------------------------------


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="exudyn-flexlink",
        description="Slot-driven flexible mechanisms with impact, from a YAML model to numbers.",
        epilog="'exudyn-flexlink COMMAND --help' shows the options of a command, with examples",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add_simulate(commands)
    _add_check(commands)
    _add_plot(commands)
    _add_schema(commands)
    return parser


class _Version(argparse.Action):
    """Looks the version up only when it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from importlib.metadata import PackageNotFoundError, version

        try:
            print(f"exudyn-flexlink {version('exudyn-flexlink')}")
        except PackageNotFoundError:
            print("exudyn-flexlink, not installed: run from its source")
        parser.exit()


def _add_simulate(commands: Any) -> None:
    parser = _command(
        commands,
        "simulate",
        _simulate,
        "simulate a model, save its results and draw its figures",
        """\
        exudyn-flexlink simulate models/no_clearance.yaml
        exudyn-flexlink simulate models/no_clearance.yaml --set run.turns=2 --out runs/short
        exudyn-flexlink simulate models/smooth.yaml --set accuracy.step=1e-4 --no-plots --quiet""",
    )
    _add_model(parser)
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="where to write; default: runs/<name of the model>"
    )
    parser.add_argument("--no-plots", action="store_true", help="draw no figures")
    parser.add_argument(
        "--quiet", action="store_true", help="no progress and no summary; warnings stay"
    )


def _add_check(commands: Any) -> None:
    parser = _command(
        commands,
        "check",
        _check,
        "check a model without simulating it: parts, effects, frequencies, steps",
        """\
        exudyn-flexlink check models/no_clearance.yaml
        exudyn-flexlink check models/no_clearance.yaml --set bodies.link.hinges.stiffness=beam
        exudyn-flexlink check models/smooth.yaml --set bodies.link.rods=20""",
    )
    _add_model(parser)


def _add_plot(commands: Any) -> None:
    parser = _command(
        commands,
        "plot",
        _plot,
        "draw the figures of a saved run again",
        """\
        exudyn-flexlink plot runs/no_clearance
        exudyn-flexlink plot runs/no_clearance --out figures""",
    )
    parser.add_argument("run", type=Path, metavar="RUN", help="folder that 'simulate' wrote")
    parser.add_argument("--out", type=Path, metavar="DIR", help="where to; default: that folder")


def _add_schema(commands: Any) -> None:
    parser = _command(
        commands,
        "schema",
        _schema,
        "print the JSON schema of model files, which editors complete and check with",
        """\
        exudyn-flexlink schema
        exudyn-flexlink schema --out models/flexlink.schema.json""",
    )
    parser.add_argument("--out", type=Path, metavar="FILE", help="write it to this file")


def _command(
    commands: Any, name: str, function: Any, about: str, examples: str
) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=about,
        description=about[0].upper() + about[1:] + ".",
        epilog="examples:\n" + examples.replace("        ", "  "),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(command=function)
    return parser


def _add_model(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("model", type=Path, metavar="MODEL", help="model file, YAML")
    parser.add_argument(
        "--set",
        dest="settings",
        action="append",
        default=[],
        metavar="PATH=VALUE",
        help="replace a value of the model, such as run.turns=2; may be repeated",
    )
    parser.add_argument(
        "--allow-outside",
        action="store_true",
        help="let the model read CSV files outside its own folder",
    )

"""How bad arguments of the command line are answered: with what is wrong and what was meant."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

from exudyn_flexlink.cli.keeping import draw_figure, holds_schema, look_of, made, write_figure
from exudyn_flexlink.cli.running import read_scene
from exudyn_flexlink.cli.terminal import BAD_INPUT, DONE, PROGRAM, complain, tell
from exudyn_flexlink.loading import assemble_scene, rest_of_scene
from exudyn_flexlink.mechanism import beyond_redundant, formulation, input_notes
from exudyn_flexlink.report import check_text, equilibrium_text
from exudyn_flexlink.scene import json_schema
from exudyn_flexlink.source import SceneError, did_you_mean
from exudyn_flexlink.storage import is_sweep, load, load_sweep, replace_file, staged_files
from exudyn_flexlink.sweeps import SweepTable

WENT = {
    "--horizon": "it is always told: leave the option out",
    "--no-horizon": "'--no-measure' makes one run, of which no error is known",
    "--vary": "of a sweep it is '--over PATH=VALUES'",
    "--retries": "the result is always that of a finer run: leave the option out; for more, "
    "'--set accuracy.tolerance=...'",
}
"""Options of earlier versions, with what to do instead."""


def _setting_of(key: str) -> str:
    """Return how a key of the model is set, if it is one of those that `load_scene` takes, too."""
    from exudyn_flexlink.scene import SECTION_OF

    section = SECTION_OF.get(key)
    return f"it is a value of the model: '--set {section}.{key}=...'" if section else ""


class Parser(argparse.ArgumentParser):
    """A parser that says what is wrong, without ten lines of usage before it."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Refuse here what is unknown: a command knows its own options, the program does not."""
        found, unknown = super().parse_known_args(args, namespace)
        if unknown:
            from exudyn_flexlink.source import did_you_mean

            word = next((one for one in unknown if one.startswith("-")), unknown[0])
            name, options = word.partition("=")[0], self._option_string_actions
            if name in WENT:
                self.error(f"there is no '{name}' any more\nhint: {WENT[name]}")
            before = args[max(args.index(word) - 1, 0)] if word in args else ""
            if "=" in before:
                told = f"what has blanks stands in quotes: '{before} {word}'"
                self.error(f"unknown argument '{word}'\nhint: {told}")
            key = name.lstrip("-")
            if "--set" in options and (hint := _setting_of(key)):
                self.error(f"no option '{name}'\nhint: {hint}")
            # Without hyphens, which all options have in common.
            known = [one.lstrip("-") for one in options] if key != name else []
            near = did_you_mean(key, known, "--")
            self.error(f"unknown argument '{word}'{near}")
        return found, unknown

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        """Tell which choice was meant, a command or a value of an option."""
        if action.choices is None or value in action.choices:
            return
        from exudyn_flexlink.source import did_you_mean

        known = [*map(str, action.choices)]
        near = did_you_mean(str(value), known)
        if action.metavar == "COMMAND" and Path(str(value)).suffix in {".yaml", ".yml"}:
            near = f"; did you mean 'simulate {value}'?"
        listed = f"{' There' if near else '; there'} is: {', '.join(known)}"
        raise argparse.ArgumentError(action, f"no '{value}'{near}{listed}")

    def error(self, message: str) -> NoReturn:
        """Say it, with a hint, and end the program: bad input."""
        complain(f"{self.prog}: {message}")
        if "\nhint: " not in message:
            complain(f"hint: '{self.prog} --help' tells what it takes")
        self.exit(BAD_INPUT)


class ShowVersion(argparse.Action):
    """Looks the version up only when it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        """Print it, and end the program."""
        from exudyn_flexlink.shipped import THIS, version_of

        print(f"{THIS} {version_of(THIS)}")
        parser.exit()


SHELLS = ("bash", "zsh")
PREFIX = "_exudyn_flexlink_"  # of the scripts' functions

# What follows a command. shtab's bash script takes functions with "_file" or "_dir" in their names
# for those of paths, and puts a slash, not a space, behind a folder.
MODEL, MODEL_OR_FILE, FILE, FOLDER = "model", "file_or_model", "file", "dir"
BENCHMARK = "benchmark"

BASH = """\
{prefix}model() {{ compgen -W "{names}" -- "$1"; }}
{prefix}benchmark() {{ compgen -W "{benchmarks}" -- "$1"; }}
{prefix}file() {{ compgen -f -- "$1"; }}
{prefix}dir() {{ compgen -d -- "$1"; }}
{prefix}file_or_model() {{ {prefix}model "$1"; {prefix}file "$1"; }}
"""
ZSH = """\
{prefix}model() {{ _values -w model {names} }}
{prefix}benchmark() {{ _values -w benchmark {benchmarks} }}
{prefix}file() {{ _files }}
{prefix}dir() {{ _files -/ }}
{prefix}file_or_model() {{ _alternative "models:model:({names})" "files:file:_files" }}
"""


def completion_command(options: argparse.Namespace) -> int:
    """Print the script for a shell; returns the exit code."""
    import shtab

    from exudyn_flexlink.cli.arguments import program_parser
    from exudyn_flexlink.shipped import benchmark_files, model_names

    functions = {"bash": BASH, "zsh": ZSH}[options.shell]
    named = {"names": " ".join(model_names()), "benchmarks": " ".join(benchmark_files())}
    preamble = functions.format(prefix=PREFIX, **named)
    print(shtab.complete(program_parser(PROGRAM), options.shell, preamble=preamble))
    return DONE


def check_command(options: argparse.Namespace) -> int:
    """Check a model without simulating it; returns the exit code."""
    scene = read_scene(options)
    assembly = assemble_scene(scene)
    refused = beyond_redundant(scene)
    if refused and formulation(scene) != "minimal":
        raise SceneError(scene.document, refused)
    tell(f"{options.model}: no mistakes\n\n{check_text(scene, assembly)}")
    if options.equilibrium:
        tell(f"\n{equilibrium_text(scene, rest_of_scene(scene))}")
    for told in input_notes(scene, assembly):
        complain(f"warning: {told}")
    if options.figure is None:
        return DONE
    from exudyn_flexlink.plots import start

    return write_figure(options.figure, partial(start, scene, assembly), force=options.force)


def plot_command(options: argparse.Namespace) -> int:
    """Draw the figures of a saved run, or of a sweep, again; returns the exit code."""
    folder: Path = options.out or options.run

    def draw() -> None:
        swept = load_sweep(options.run) if is_sweep(options.run) else None
        _require_columns(options.of, swept)
        result = load(options.run) if swept is None else None
        with staged_files(folder, force=options.force) as staged:
            if result is not None:
                look_of(options).save_run(result, staged)
            if swept is not None:
                draw_figure(options, "sweep", swept, staged, names=options.of)

    code = made("figures", draw)
    if code == DONE:
        print(f"Figures written to {folder}{os.sep}")
    return code


def _require_columns(names: Sequence[str], swept: SweepTable | None) -> None:
    """Refuse names that are no observables of a sweep."""
    if names and swept is None:
        raise argparse.ArgumentTypeError("'--of' is for the folder of a sweep")
    known = () if swept is None else swept.observables
    wrong = [f"no column '{one}'{did_you_mean(one, known)}" for one in names if one not in known]
    if wrong:
        raise argparse.ArgumentTypeError(f"{'; '.join(wrong)}. There are: {', '.join(known)}")


def report_command(options: argparse.Namespace) -> int:
    """Write the page of a saved run; returns the exit code."""
    from exudyn_flexlink.page import PAGE, write_page

    def write() -> None:
        result = load(options.run)
        if options.out is None:
            with staged_files(options.run, force=options.force) as staged:
                write_page(result, staged / PAGE)
        else:
            write_page(result, options.out, force=options.force)

    code = made("report", write)
    if code == DONE:
        print(f"Report written to {options.out or options.run / PAGE}")
    return code


def schema_command(options: argparse.Namespace) -> int:
    """Print, or write, the JSON schema of model files; returns the exit code."""
    if sys.flags.optimize > 1:
        raise argparse.ArgumentTypeError(
            "the schema explains keys by docstrings, which Python leaves out with '-OO' or "
            "PYTHONOPTIMIZE=2: call it without"
        )
    text = json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n"
    if options.out is None:
        print(text, end="")
        return DONE
    replace_file(options.out, text.encode(), holds_schema, force=options.force)
    return DONE

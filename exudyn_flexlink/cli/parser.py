"""The parser of the command line: for bad arguments it says what is wrong and what was meant.

The command `completion`: a script with which a shell completes this program's arguments.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, NoReturn

from exudyn_flexlink.cli.terminal import BAD_INPUT, DONE, PROGRAM, complain

WENT = {
    "--horizon": "it is always told: leave the option out",
    "--no-horizon": "'--no-measure' makes one run, of which no error is known",
    "--vary": "of a sweep it is '--over PATH=VALUES'",
    "--retries": "the result is always that of a finer run: leave the option out; for more, "
    "'--set accuracy.tolerance=...'",
}
"""Options of earlier versions, with what to do instead."""


def _setting_of(key: str) -> str:
    """Return how to set a key of the model, if `load_scene` takes this key, too."""
    from exudyn_flexlink.scene import SECTION_OF

    section = SECTION_OF.get(key)
    return f"it is a value of the model: '--set {section}.{key}=...'" if section else ""


class Parser(argparse.ArgumentParser):
    """A parser that says what is wrong, without ten lines of usage before it."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Refuse unknown arguments here: only a command knows its own options."""
        parsed, unknown = super().parse_known_args(args, namespace)
        if unknown:
            from exudyn_flexlink.source import did_you_mean

            word = next(
                (word_given for word_given in unknown if word_given.startswith("-")), unknown[0]
            )
            name, options = word.partition("=")[0], self._option_string_actions
            if name in WENT:
                self.error(f"there is no '{name}' any more\nhint: {WENT[name]}")
            before = args[max(args.index(word) - 1, 0)] if word in args else ""
            if "=" in before:
                about = f"what has blanks stands in quotes: '{before} {word}'"
                self.error(f"unknown argument '{word}'\nhint: {about}")
            key = name.lstrip("-")
            if "--set" in options and (hint := _setting_of(key)):
                self.error(f"no option '{name}'\nhint: {hint}")
            # Compare without hyphens: all options have these.
            known = [option.lstrip("-") for option in options] if key != name else []
            near = did_you_mean(key, known, "--")
            self.error(f"unknown argument '{word}'{near}")
        return parsed, unknown

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
        """Print the message with a hint, and end the program with the exit code of bad input."""
        complain(f"{self.prog}: {message}")
        if "\nhint: " not in message:
            complain(f"hint: '{self.prog} --help' tells what it takes")
        self.exit(BAD_INPUT)


class ShowVersion(argparse.Action):
    """Looks up the version only when the user asks for it."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        """Print the version, and end the program."""
        from exudyn_flexlink.shipped import THIS, version_of

        print(f"{THIS} {version_of(THIS)}")
        parser.exit()


SHELLS = ("bash", "zsh")
PREFIX = "_exudyn_flexlink_"  # of the functions in completion scripts

# Kinds of a command's arguments. In shtab's bash script, functions with "_file" or "_dir" in their
# names complete paths: they append a slash, not a space, to a folder.
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

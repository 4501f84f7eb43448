"""How bad arguments of the command line are answered: with what is wrong and what was meant."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, NoReturn

from exudyn_flexlink.cli.terminal import BAD_INPUT, complain

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
        from exudyn_flexlink.versions import THIS, version_of

        print(f"{THIS} {version_of(THIS)}")
        parser.exit()

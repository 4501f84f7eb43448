"""What the command line knows: its commands, in the order of its help."""

from __future__ import annotations

import argparse
from typing import Any, NoReturn

from exudyn_flexlink.cli import file_options, model_options
from exudyn_flexlink.cli.options import Command, add_command
from exudyn_flexlink.cli.terminal import BAD_INPUT, PROGRAM, complain

COMMANDS: dict[str, tuple[str, Command]] = {
    "simulate": ("simulating", model_options.simulate_options),
    "compare": ("comparing", model_options.compare_options),
    "accuracy": ("studying", model_options.accuracy_options),
    "stability": ("stability", model_options.stability_options),
    "sweep": ("sweeping", model_options.sweep_options),
    "verify": ("verifying", model_options.verify_options),
    "check": ("commands", model_options.check_options),
    "plot": ("commands", file_options.plot_options),
    "report": ("reporting", file_options.report_options),
    "animate": ("animating", file_options.animate_options),
    "new": ("copying", file_options.new_options),
    "schema": ("commands", file_options.schema_options),
    "completion": ("completing", file_options.completion_options),
}
"""Modules that carry commands out, and what these take."""


def program_parser(called: str = PROGRAM) -> argparse.ArgumentParser:
    """Return what reads the arguments of a command line; `called` as usage lines say."""
    parser = _Parser(
        prog=called,
        description="Slot-driven flexible mechanisms with impact, from a YAML model to numbers.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="first steps:\n"
        f"  {called} simulate no_clearance\n"
        f"  {called} new no_clearance mine.yaml\n"
        f"  {called} simulate --help",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version")
    parser.set_defaults(command=lambda _: complain(parser.format_help().rstrip(), BAD_INPUT))
    commands = parser.add_subparsers(metavar="COMMAND")
    for name, (module, command) in COMMANDS.items():
        add_command(commands, name, module, command)
    return parser


WENT = {
    "--horizon": "it is always told: leave the option out",
    "--no-horizon": "'--no-measure' makes one run, of which no error is known",
    "--retries": "the result is always that of a finer run: leave the option out; for more, "
    "'--set accuracy.tolerance=...'",
}
"""Options of earlier versions, with what to do instead."""


class _Parser(argparse.ArgumentParser):
    """A parser that says what is wrong, without ten lines of usage before it."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Refuse here what is unknown: a command knows its own options, the program does not."""
        found, unknown = super().parse_known_args(args, namespace)
        if unknown:
            from exudyn_flexlink.source import did_you_mean

            word = next((one for one in unknown if one.startswith("-")), unknown[0])
            name = word.partition("=")[0]
            if name in WENT:
                self.error(f"there is no '{name}' any more\nhint: {WENT[name]}")
            self.error(
                f"unknown argument '{word}'{did_you_mean(name, self._option_string_actions)}"
            )
        return found, unknown

    def error(self, message: str) -> NoReturn:
        """Say it, with a hint, and end the program: bad input."""
        complain(f"{self.prog}: {message}")
        if "\nhint: " not in message:
            complain(f"hint: '{self.prog} --help' tells what it takes")
        self.exit(BAD_INPUT)


class _Version(argparse.Action):
    """Looks the version up only when it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from exudyn_flexlink.versions import THIS, version_of

        print(f"{THIS} {version_of(THIS)}")
        parser.exit()

"""The commands of the program, in the order of its help, and their arguments.

The class of an option, options that several commands share, and the parser, which for bad arguments
says what is wrong and what was meant. The command `completion`: a script with which a shell
completes this program's arguments.
"""

from __future__ import annotations

import argparse
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from exudyn_flexlink.cli import values
from exudyn_flexlink.cli.terminal import BAD_INPUT, DONE, PROGRAM, complain, refuse
from exudyn_flexlink.cli.values import figure_file, model_path, names_of
from exudyn_flexlink.shipped import (
    AFTER,
    EFFECT_NAMES,
    ENGINES,
    EXUDYN,
    FIGURE_FORMATS,
    FIGURE_STYLES,
    FILM_FORMATS,
    LAPS,
)

WENT = {
    "--horizon": "it is always told: leave the option out",
    "--no-horizon": "'--no-measure' makes one run, of which no error is known",
    "--vary": "of a sweep it is '--over PATH=VALUES'",
    "--retries": "the result is always that of a finer run: leave the option out; for more, "
    "'--set accuracy.tolerance=...'",
}
"""Options of earlier versions, with what to do instead."""


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
            if "--set" in options:
                from exudyn_flexlink.scene import SECTION_OF

                if section := SECTION_OF.get(key):
                    hint = f"it is a value of the model: '--set {section}.{key}=...'"
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
MODEL_ALONE, MODEL_OR_FILE, FILE, FOLDER = "model", "file_or_model", "file", "dir"
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

# fmt: off
# Tables follow: they are easier to read with several words in a line.


class Option:
    """An option, or an argument, of a command: its help, and the rest as `argparse` has it.

    `completed` tells how a shell completes the option, see `SHELLS`. Without metavar it is a
    switch.
    """

    def __init__(self, name: str, about: str, metavar: str = "", completed: str = "",
                 **more: Any) -> None:
        if metavar:
            more["metavar"] = metavar
        elif "choices" not in more:
            more.setdefault("action", "store_true")
        self._name, self._completed, self._more = name, completed, {"help": about, **more}

    def add(self, parser: argparse.ArgumentParser) -> None:
        """Add it to the parser of a command."""
        action: Any = parser.add_argument(self._name, **self._more)
        if self._completed:
            action.complete = dict.fromkeys(SHELLS, PREFIX + self._completed)


CHANGES = (
    Option("--set", "replace a value of the model, such as run.turns=2; null takes a key away that "
           "is there; may be repeated", "PATH=VALUE", dest="settings", action="append", default=[]),
    Option("--watch", "show this point, and judge errors by it alone, not by all named points; "
           "short for --set outputs.watch=BODY.POINT", "BODY.POINT", dest="settings",
           action="append", type="outputs.watch={}".format),
    Option("--allow-outside", "let the model read CSV files outside its own folder"),
)
"""Options that replace values of the model, or let it read other files."""

MODEL = (
    Option("model", "model file, YAML; or the name of a model that comes with the program", "MODEL",
           MODEL_OR_FILE, type=model_path),
    *CHANGES,
)
"""The model, and the options that change it."""

IMPACT = Option("--impact", "how contacts strike, instead of what the model says",
                choices=("penalty", "impulse"))
MEASURE = Option("--no-measure", "make each run once: its errors are not known then; without this "
                 "option a second, finer run measures them, and is the result",
                 dest="measure", action="store_false")


def engine(about: str = f"what solves the equations of motion; default: {EXUDYN}",
           default: str | None = EXUDYN) -> Option:
    """Option for the engine that runs."""
    return Option("--engine", about, choices=tuple(ENGINES), default=default)


def without(more: str = "") -> Option:
    """Option for effects that are left out."""
    about = (f"{more}leave out {', '.join(EFFECT_NAMES)} (of hinges and springs; restitution "
             "stays); may be repeated")
    return Option("--without", about, "EFFECT[,EFFECT]", type=names_of(EFFECT_NAMES, "effect"),
                  action="extend", default=[])


def force(about: str) -> Option:
    """Option that lets files be replaced."""
    return Option("--force", about)


def out(metavar: str, about: str, read: Any = Path) -> Option:
    """Option for where something is written: a folder (DIR) or a file."""
    return Option("--out", about, metavar, FOLDER if metavar == "DIR" else FILE, type=read)


def formats(known: tuple[str, ...], about: str, default: str) -> Option:
    """Option for formats of files; `default` says in words which are usual."""
    read = names_of(known, "format")
    about = f"{about}: {', '.join(known)}; default: {default}; may be repeated"
    return Option("--format", about, "FORMAT[,FORMAT]", action="extend",
                  type=lambda text: read(text.lower()))


FIGURES = (
    formats(FIGURE_FORMATS, "formats of figures", FIGURE_FORMATS[0]),
    Option("--style", "how figures look: print is one column of a page wide, 86 mm, without "
           f"titles; default: {FIGURE_STYLES[0]}", choices=FIGURE_STYLES),
)
"""How figures look."""


def figure(about: str) -> tuple[Option, Option]:
    """Options for a single figure, by the name of its file."""
    about += "; png, pdf or svg by FILE's ending"
    return (Option("--figure", about, "FILE", FILE, type=figure_file),
            force("replace FILE also if it is no figure of this program"))


def output(suffix: str = "") -> tuple[Option, ...]:
    """Options for where a run is written, with which figures, and how quietly."""
    return (
        out("DIR", f"where to write; default: runs/<name of the model>{suffix}, with the options "
            "in its name"),
        force("replace also files that no run wrote, or that were changed since, where names are "
              "the same, and a complete result by an incomplete one"),
        Option("--no-plots", "draw no figures"),
        *FIGURES,
        Option("--quiet", "no progress and no summary; warnings stay"),
    )


def add_figures(parser: argparse.ArgumentParser) -> None:
    """Add the options that say how figures look."""
    for name in FIGURES:
        name.add(parser)


NEW_MODEL = "no_clearance"
"""What `new` copies if nothing is named."""


class Command(NamedTuple):
    """Arguments of a command, and its help: a sentence, and examples without the program's name.

    ``NAME_command`` of the module carries it out. The module is imported when the command runs:
    this takes much longer than to print a help text. The help is not a docstring, since
    ``python -OO`` removes docstrings.
    """

    module: str
    about: str
    examples: tuple[str, ...]
    options: tuple[Option, ...]


COLUMN = Option("--column", "what a column of the CSV file is: BODY.angle or .rate, BODY.POINT.x "
                "or .y; may be repeated; default: columns that are so named", "NAME=QUANTITY",
                action="append", default=[])


def _run(commands: str) -> Option:
    """The folder of a saved run; `commands` write it."""
    return Option("run", f"folder that {commands} wrote", "RUN", FOLDER, type=Path)


COMMANDS = {
    "simulate": Command(
        "running", "Simulate a model, save its results and draw its figures.",
        ("no_clearance",
         "no_clearance --set run.turns=2 --out runs/short",
         "no_clearance --engine lagrangian --impact impulse",
         "clearance_friction --without friction,damping",
         "clearance --set run.turns=1 --no-measure --report --every 1ms"),
        (*MODEL, engine(), IMPACT, without(), MEASURE,
         Option("--every", "rows of CSV files are evenly so far apart, in s or such as 1ms; "
                "default: where the run has its samples, closer where more happens. result.nc "
                "has these all the same", "TIME", type=values.duration),
         Option("--report", "write report.html, too: one page with outcome, figures, tables and "
                "the model, which loads nothing else"),
         *output())),
    "compare": Command(
        "studying",
        "Compare both engines, a model with and without an effect, or a run with measurements.",
        ("smooth --set run.turns=2 --tolerance 1e-5",
         "no_clearance --impact impulse --out runs/impulse",
         "clearance --without clearance --set run.turns=1",
         "runs/a runs/b",
         "runs/a measured.csv --column theta=lever.angle --shift find"),
        (Option("model", "model file, YAML; the name of a model that comes with the program; or "
                "with OTHER the folder of a saved run", "MODEL|RUN", MODEL_OR_FILE, type=Path),
         Option("other", "what a run is compared with: the folder of another, or a CSV file",
                "OTHER", FILE, nargs="?", type=Path),
         COLUMN,
         Option("--shift", "what is added to times of the CSV file, such as '0.1 s'; 'find' looks "
                "for the one that fits best; default: 0", "TIME", type=values.shift, default=0.0),
         *CHANGES,
         Option("--tolerance", "end with code 1 if a point differs by more than this, in m or such "
                "as 1um, up to the horizon", "LENGTH", type=values.length),
         IMPACT,
         without("compare the model with itself without the effect, in one engine: "),
         engine("the engine of '--without'; default: exudyn", None), MEASURE,
         *output("-compare"))),
    "fit": Command(
        "studying", "Fit values of a model to measurements, by least squares, with their errors.",
        ("rigid measured.csv --column theta=lever.angle --vary springs.lever_return.frequency "
         "--vary contacts.strike.law.restitution",
         "rigid measured.csv --column x=link.end.x --vary drives.motor.value=9:11"),
        (*MODEL[:1],
         Option("measured", "CSV file with a column of time; units may stand in its header: "
                "'t (ms)'", "MEASURED", FILE, type=Path),
         COLUMN,
         Option("--vary", "a value of the model that is found, from where the model has it; "
                "LOW:HIGH bounds it, by default its key does; may be repeated", "PATH[=LOW:HIGH]",
                action="append", default=[]),
         *CHANGES,
         engine(), IMPACT, without(), *output("-fit"))),
    "accuracy": Command(
        "studying",
        "Study what accuracy costs in a model: error over processor time, and what limits it.",
        ("smooth",
         "no_clearance --set run.turns=2 --target 1e-5",
         "no_clearance --watch link.end",
         "clearance --set run.turns=0.5 --budget 300"),
        (*MODEL,
         Option("--target", "error that is good enough, in m or such as 1um; default: the "
                "model's tolerance, or 1e-4", "LENGTH", type=values.length),
         Option("--budget", "time that the study may take, in s or such as 5min; no run takes "
                "more than half of what is left; default: 60", "TIME", type=values.duration,
                default=60.0),
         IMPACT, without(), *output("-accuracy"))),
    "stability": Command(
        "studying",
        "Tell whether a motion repeats itself, and how fast neighbouring motions part.",
        ("no_clearance --engine lagrangian",
         "clearance --engine lagrangian --twice",
         "clearance --engine lagrangian --set joints.sleeve.clearance=1mm",
         "slider_crank_clearance --laps 40 --at 90"),
        (*MODEL,
         Option("--laps", f"laps to run, whatever the model's 'run' says; default: {LAPS}", "N",
                type=values.count, default=LAPS),
         Option("--after", "laps in which the motion settles, which do not count; default: "
                f"{AFTER}", "N", type=values.count, default=AFTER),
         Option("--lap", "how long a lap is, in s or such as 20ms; default: a turn of the joint "
                "that a drive turns at one speed", "TIME", type=values.duration),
         Option("--at", "crank angle of the Poincare section, in degrees or such as 1rad; "
                "default: 0", "ANGLE",
                type=values.degrees, default=0.0),
         Option("--tolerance", "error that runs may make, in m or such as 1um; default: the "
                "model's, or less, so that neighbours are well above it", "LENGTH",
                type=values.length),
         Option("--twice", "make the exponent again at a tenth of the tolerance, to see whether "
                "that matters"),
         engine(), IMPACT, without(), *output("-stability"))),
    "sweep": Command(
        "studying", "Simulate a model at many points, each a row of one table.",
        ("no_clearance --over drives.motor.value=6:14:9rad/s --set run.turns=2",
         "clearance --over joints.sleeve.clearance=1,2,5mm --workers 2",
         "clearance --over drives.motor.value=6:14:9rad/s --resume",
         "study.yaml",
         "study.yaml --scheduler tcp://192.168.0.10:8786"),
        (Option("source", "with '--over' a model, its file or the name of one that comes with the "
                "program; without it a study file, which says what is varied", "MODEL|STUDY",
                MODEL_OR_FILE),
         Option("--over", "values of the model, start:stop:count such as 'drives.motor.value="
                "6:14:9 rad/s' or a list such as 'joints.sleeve.clearance=0.5, 1, 2 mm', with the "
                "unit last; may be repeated: each value with every other", "PATH=VALUES",
                action="append", default=[]),
         *CHANGES,
         engine("what solves the equations of motion; default: exudyn, or the study's", None),
         IMPACT, without(), MEASURE,
         Option("--series", "save every run whole, in the sweep's folder"),
         Option("--resume", "go on with a sweep that was interrupted: rows that are there are not "
                "made again"),
         Option("--workers", "processes that run; default: one for every core", "N",
                type=values.at_least_one),
         Option("--scheduler", "run on the workers of this scheduler of Dask, such as "
                "tcp://host:8786", "ADDRESS"),
         *output("-sweep"))),
    "verify": Command(
        "studying", "Run benchmarks and hold the results against published numbers.",
        ("",
         "pendulum n_four_bar",
         "cantilever --figure cantilever.png",
         "pendulum --as json"),
        (Option("benchmarks", "a model with published numbers that comes with the program, or a "
                "file 'MODEL.published.yaml' beside a model; default: all that come with the "
                "program", "NAME", BENCHMARK, nargs="*", type=values.published_file),
         Option("--as", "how results are printed; default: text", dest="form",
                choices=("text", "markdown", "json"), default="text"),
         *figure("draw the differences, and what is allowed"),
         Option("--quiet", "no progress; results stay"))),
    "check": Command(
        "commands",
        "Check a model without simulating it: parts, effects, frequencies, steps, formulation.",
        ("no_clearance",
         "no_clearance --set bodies.link.hinges.stiffness=beam",
         "clearance --without impact",
         "whitworth --figure whitworth.png",
         "hanging_chain --equilibrium --figure modes.png"),
        (*MODEL, without(),
         Option("--equilibrium", "tell where all forces balance while drives stand still, what "
                "joints hold there, and the frequencies of small motions about it"),
         *figure("draw the mechanism where it starts, with names; with '--equilibrium' its slowest "
                 "motions about the rest"))),
    "plot": Command(
        "commands", "Draw the figures of a saved run, or of a sweep, again.",
        ("runs/no_clearance",
         "runs/no_clearance --out figures",
         "runs/no_clearance --out paper --format pdf,svg --style print",
         "runs/no_clearance-sweep --of lever.swing_rad,strike.strikes"),
        (_run("'simulate' or 'sweep'"),
         out("DIR", "where to; default: that folder"),
         Option("--of", "columns of a sweep's table to draw; default: the first that differ",
                "COLUMN[,COLUMN]", type=values.names, default=[]),
         *FIGURES,
         force("replace also figures that no run drew, or that were changed since"))),
    "report": Command(
        "commands",
        "Write the report of a saved run as one page of HTML, which loads nothing else.",
        ("runs/no_clearance",
         "runs/no_clearance --out strike.html"),
        (_run("'simulate'"),
         out("FILE", "where to, a file .html; default: report.html in the folder of the run",
             values.page_file),
         force("replace the file also if it is no report, or was changed since"))),
    "animate": Command(
        "commands",
        "Animate a saved run: a video, a GIF, and a page to play and step through it.",
        ("runs/no_clearance",
         "runs/no_clearance --slow strike",
         "runs/no_clearance --slow strike:2 --from 1.5 --to 1.7 --format gif",
         "runs/clearance --with runs/no_clearance --format html"),
        (_run("'simulate'"),
         Option("--with", "show this run over the first, each in its engine's colour", "RUN",
                FOLDER, dest="other", type=Path),
         Option("--slow", "slow motion around the strikes of a contact, or the touches in a joint "
                "with clearance; or around one of them, counted from 1; 'strike' stands for all "
                "contacts", "NAME[:NUMBER]", type=values.slow),
         Option("--from", "begin at this instant, in s or such as 20ms", "TIME", dest="begin",
                type=values.instant),
         Option("--to", "end there", "TIME", dest="end", type=values.instant),
         formats(FILM_FORMATS, "formats", "mp4, or gif without ffmpeg, and html"),
         Option("--speed", "seconds of the run in a second of the film: 0.1 is ten times slower "
                "than it is; default: one at which motions can be followed", "X", type=values.rate),
         Option("--fps", "frames in a second; default: mp4 30, gif 20", "N", type=values.rate),
         Option("--width", "default: mp4 1280, gif 640", "PIXELS", type=values.count),
         out("DIR", "where to; default: the folder of RUN"),
         force("replace also files that this program did not write, or that were changed"),
         Option("--quiet", "no progress"))),
    "new": Command(
        "keeping", "Copy a model that comes with the program, to change it.",
        ("",
         "clearance mine.yaml",
         "spline_track dwells.yaml",
         "--list"),
        (Option("model", f"its name, as '--list' tells it; default: {NEW_MODEL}", "MODEL",
                MODEL_ALONE, nargs="?", type=values.shipped_model, default=NEW_MODEL),
         Option("file", "where to, a file or a folder; default: the model's name, here. What the "
                "model needs, and the schema for editors, is put beside it", "FILE", FILE,
                nargs="?", type=Path),
         Option("--list", "list all models with their titles"),
         force("replace files that stand there, too"))),
    "schema": Command(
        "commands", "Print the JSON schema of model files, which editors complete and check with.",
        ("",
         "--out flexlink.schema.json"),
        (out("FILE", "write it to this file"),
         force("replace the file also if it is no such schema"))),
    "completion": Command(
        "arguments", "Print a script with which a shell completes commands, options and models.",
        ("bash",
         "zsh"),
        (Option("shell", "the shell it is for", choices=SHELLS),)),
}
# fmt: on


def program_parser(called: str = PROGRAM) -> argparse.ArgumentParser:
    """Return the parser of a command line; usage lines give the program the name `called`."""
    parser = Parser(
        prog=called,
        description="Slot-driven flexible mechanisms with impact, from a YAML model to numbers.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="first steps:\n"
        f"  {called} simulate no_clearance\n"
        f"  {called} new no_clearance mine.yaml\n"
        f"  {called} simulate --help",
    )
    parser.add_argument("--version", action=ShowVersion, nargs=0, help="print the version")
    parser.set_defaults(command=lambda _: complain(parser.format_help().rstrip(), BAD_INPUT))
    commands = parser.add_subparsers(metavar="COMMAND")
    for name, command in COMMANDS.items():
        examples = (f"  {called} {name} {example}".rstrip() for example in command.examples)
        command_parser = commands.add_parser(
            name,
            help=command.about[:1].lower() + command.about[1:].rstrip("."),
            description=command.about,
            formatter_class=argparse.RawDescriptionHelpFormatter,
            epilog="\n".join(["examples:", *examples]),
        )
        carry_out = partial(_carried_out, command.module, f"{name}_command")
        command_parser.set_defaults(command=carry_out, impact=None)
        for option in command.options:
            option.add(command_parser)
    return parser


def _carried_out(module: str, function: str, options: argparse.Namespace) -> int:
    try:
        code: int = getattr(import_module(f"exudyn_flexlink.cli.{module}"), function)(options)
    except Exception as error:
        from exudyn_flexlink.cli.keeping import REFUSALS

        if isinstance(error, REFUSALS):
            return refuse(error)
        raise
    return code


def completion_command(options: argparse.Namespace) -> int:
    """Print the script for a shell; returns the exit code."""
    import shtab

    from exudyn_flexlink.shipped import benchmark_files, model_names

    functions = {"bash": BASH, "zsh": ZSH}[options.shell]
    named = {"names": " ".join(model_names()), "benchmarks": " ".join(benchmark_files())}
    preamble = functions.format(prefix=PREFIX, **named)
    print(shtab.complete(program_parser(PROGRAM), options.shell, preamble=preamble))
    return DONE

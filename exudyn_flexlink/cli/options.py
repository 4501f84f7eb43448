"""Options that several commands share, and what an option is."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from exudyn_flexlink.cli.completing import FILE, FOLDER, MODEL_OR_FILE, PREFIX, SHELLS
from exudyn_flexlink.cli.figures import FIGURE_FORMATS, FIGURE_STYLES
from exudyn_flexlink.cli.values import EFFECT_NAMES, figure_file, model_path, names_of

# fmt: off
# From here on tables: filled lines are read better than one of each word.


class Option:
    """An option, or an argument, of a command: its help, and the rest as `argparse` has it.

    `completed` is what a shell completes it with, see `completing`; without metavar it is a switch.
    """

    def __init__(self, name: str, about: str, metavar: str = "", completed: str = "",
                 **more: Any) -> None:
        if metavar:
            more["metavar"] = metavar
        elif "choices" not in more:
            more.setdefault("action", "store_true")
        self._name, self._completed, self._more = name, completed, {"help": about, **more}

    def add(self, parser: argparse.ArgumentParser) -> None:
        """Let a command take it."""
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
"""What replaces values of the model, and what the model may read."""

MODEL = (
    Option("model", "model file, YAML; or the name of a model that comes with the program", "MODEL",
           MODEL_OR_FILE, type=model_path),
    *CHANGES,
)
"""The model, with what changes it."""

IMPACT = Option("--impact", "how contacts strike, instead of what the model says",
                choices=("penalty", "impulse"))
MEASURE = Option("--no-measure", "make each run once: its errors are not known then; without this "
                 "option a second, finer run measures them, and is the result",
                 dest="measure", action="store_false")


def engine(about: str = "what solves the equations of motion; default: exudyn",
           default: str | None = "exudyn") -> Option:
    """Which engine runs."""
    return Option("--engine", about, choices=("exudyn", "lagrangian"), default=default)


def without(more: str = "") -> Option:
    """Effects that are left out."""
    about = (f"{more}leave out {', '.join(EFFECT_NAMES)} (of hinges and springs; restitution "
             "stays); may be repeated")
    return Option("--without", about, "EFFECT[,EFFECT]", type=names_of(EFFECT_NAMES, "effect"),
                  action="extend", default=[])


def force(about: str) -> Option:
    """That files are replaced."""
    return Option("--force", about)


def out(metavar: str, about: str, read: Any = Path) -> Option:
    """Where something is written, a folder (DIR) or a file."""
    return Option("--out", about, metavar, FOLDER if metavar == "DIR" else FILE, type=read)


def formats(known: tuple[str, ...], about: str, default: str) -> Option:
    """Formats of files; `default` says in words which are usual."""
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
    """One figure, by the name of its file."""
    about += "; png, pdf or svg by FILE's ending"
    return (Option("--figure", about, "FILE", FILE, type=figure_file),
            force("replace FILE also if it is no figure of this program"))


def output(suffix: str = "") -> tuple[Option, ...]:
    """Where a run is written, with which figures, and how quietly."""
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
    for one in FIGURES:
        one.add(parser)

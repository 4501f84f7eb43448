"""Make every figure of the README and the documentation again, and every table of measured numbers.

Usage:
  .venv/bin/python scripts/make_docs.py                  all of them, which takes hours
  .venv/bin/python scripts/make_docs.py tutorial promises  some, by name
  .venv/bin/python scripts/make_docs.py --list           names, files and how long they take
  .venv/bin/python scripts/make_docs.py --check          measure cheap parts again, write nothing

Each is one or more commands that draw into a scratch folder or print Markdown tables; what they
made is put into docs/ once all commands of an item have ended. Exit code 1: a command failed, or
`--check` found text and measurement apart.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from written import DOCS, ROOT, parts_of, with_parts

OUT = "{out}"  # in a command: the scratch folder
PROGRAM = ("-m", "exudyn_flexlink")
TYPED = "exudyn-flexlink"
NOISE = 3.0  # factor by which errors and counts of steps may differ between machines and versions
ROUNDING = 1e-12  # what is smaller is rounding, and equal
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?!\w)")
SECONDS = re.compile(r"\d+(?:\.\d+)?(?= s\b)")  # times of a machine are not compared


@dataclass(frozen=True)
class Item:
    """What is made together: commands, and the files of docs/ that come of them.

    `figures` are files of docs/ by the file of the scratch folder that they are; `page` is the
    file of docs/ that takes what is printed, between the markers of the item's name; `sample` a
    cheap command whose rows have to be there.
    """

    name: str
    takes: str
    commands: tuple[tuple[str, ...], ...]
    figures: Mapping[str, str] = field(default_factory=dict)
    page: str = ""
    sample: tuple[str, ...] = ()

    @property
    def files(self) -> list[str]:
        """All files that it writes, relative to docs/."""
        return [*self.figures, *([self.page] if self.page else [])]

    @property
    def shown(self) -> list[str]:
        """Its commands as one would type them in an activated environment."""
        told = [
            re.sub(r" --out \S+", "", f"python {' '.join(command)}") for command in self.commands
        ]
        program = f"python {' '.join(PROGRAM)}"
        return [one.replace(f"{OUT}/", "runs/").replace(program, TYPED) for one in told]


def script(name: str, *arguments: str) -> tuple[str, ...]:
    """A command that runs a script of this folder."""
    return (f"scripts/{name}.py", *arguments)


def run_of(model: str, *options: str) -> tuple[str, ...]:
    """A command that simulates a model into a folder of its name."""
    out = ("--quiet", "--out", f"{OUT}/{Path(model).stem}")
    return (*PROGRAM, "simulate", model, *options, *out)


def gif_of(run: str, *options: str) -> tuple[str, ...]:
    """A command that animates a run of the scratch folder."""
    smooth = ("--format", "gif", "--fps", "16.7", "--quiet")  # 0.06 s a frame: small, and fluent
    return (*PROGRAM, "animate", f"{OUT}/{run}", *smooth, *options)


def measured(
    name: str, page: str, takes: str, *arguments: str, sample: tuple[str, ...] = ()
) -> Item:
    """A script of the item's name, that prints a table; `sample` are its cheap arguments."""
    cheap = script(name, *sample) if sample else ()
    return Item(name, takes, (script(name, *arguments),), page=f"{page}.md", sample=cheap)


STUDY = (*PROGRAM, "accuracy", "models/no_clearance.yaml", "--set", "run.turns=2",
         "--set", "bodies.link.hinges.stiffness=beam", "--budget", "90")  # fmt: skip
SWEEP = (*PROGRAM, "sweep", "no_clearance", "--over", "drives.motor.value=5:15:11 rad/s",
         "--over", "springs.lever_return.frequency=20:60:5 Hz", "--set", "run.turns=1",
         "--set", "bodies.link.rods=4", "--quiet", "--no-plots",
         "--out", f"{OUT}/speeds")  # fmt: skip
SWEPT = (*PROGRAM, "plot", f"{OUT}/speeds", "--of", "lever.swing_rad,strike.greatest_force_N")
STABLE = (*PROGRAM, "stability", "models/no_clearance.yaml", "--engine", "lagrangian")
VERIFY = (*PROGRAM, "verify", "--quiet", "--as", "markdown")
PAPER = {f"paper_fig{number}.png": f"paper_fig{number}.png" for number in (3, 4, 5)}

ONE_TURN, TWO_TURNS = ("--set", "run.turns=1"), ("--set", "run.turns=2")
# Textbook models as animations, with options of their runs and of their films.
SHOWN: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "geneva_wheel": (ONE_TURN, ("--speed", "0.1")), "cam_follower": ((), ()), "pump": ((), ()),
}  # fmt: skip
SLOW = ("--slow", "strike", "--speed", "0.2")

ITEMS = (
    Item(
        "mechanism",
        "5 s",
        (run_of("models/no_clearance.yaml"),),
        {"no_clearance_mechanism.png": "no_clearance/mechanism.png"},
    ),
    Item(
        "animation",
        "1 min",
        (
            run_of("models/no_clearance.yaml", "--no-plots", *TWO_TURNS),
            gif_of("no_clearance", "--width", "560", *SLOW),
        ),
        {"animation.gif": "no_clearance/animation.gif"},
    ),
    Item(
        "gallery",
        "2 min",
        (
            run_of("models/clearance.yaml", "--no-plots", *ONE_TURN),
            gif_of("clearance", "--width", "400", *SLOW),
            *(
                command
                for name, (of_run, of_film) in SHOWN.items()
                for command in (
                    run_of(f"models/textbook/{name}.yaml", "--no-plots", *of_run),
                    gif_of(name, "--width", "360", *of_film),
                )
            ),
        ),
        {f"animation_{name}.gif": f"{name}/animation.gif" for name in ("clearance", *SHOWN)},
    ),
    Item(
        "tutorial",
        "20 s",
        tuple(run_of(f"docs/tutorial/{n}.yaml") for n in ("2_slide", "4_flexible", "5_strike")),
        {
            "tutorial_2.png": "2_slide/mechanism.png",
            "tutorial_4.png": "4_flexible/coordinates.png",
            "tutorial_5.png": "5_strike/lever.png",
        },
    ),
    Item(
        "report",
        "10 s, with a Chromium",
        (script("report_picture", "--out", OUT),),
        {"report.png": "report.png"},
    ),
    Item(
        "modes",
        "5 s",
        ((*PROGRAM, "check", "no_clearance", "--equilibrium", "--figure", f"{OUT}/modes.png"),),
        {"modes.png": "modes.png"},
    ),
    Item("paper", "2 min", (script("paper_figures", "--out", OUT),), PAPER),
    Item(
        "stability",
        "2 min",
        ((*STABLE, "--quiet", "--out", f"{OUT}/stability"),),
        {"stability.png": "stability/stability.png"},
    ),
    measured("paper_stability", "stability", "5 min"),
    Item(
        "stability_map",
        "20 min",
        (
            script(
                "stability_map",
                *("--speeds", "2", "5", "10", "20", "40"),
                *("--clearances", "0", "1", "5", "--out", OUT, "--work", f"{OUT}/work"),
            ),
        ),
        {"stability_map.png": "stability_map.png"},
        "stability.md",
    ),
    measured("published_exponents", "stability", "15 min"),
    measured("clearance_statements", "paper", "10 min"),
    Item(
        "slot_play",
        "3 min",
        (script("slot_play", "--out", OUT),),
        {"slot_play.png": "slot_play.png"},
        page="paper.md",
    ),
    Item(
        "closing_clearance",
        "5 min",
        (script("closing_clearance", "--out", OUT),),
        {"closing_clearance.png": "closing_clearance.png"},
    ),
    measured("clearance_limits", "modelling", "30 min", "--speeds", "100", "10"),
    Item(
        "beam_against_rods",
        "3 min",
        (script("beam_against_rods", "--out", OUT),),
        {"beam_against_rods.png": "beam_against_rods.png"},
        "modelling.md",
    ),
    Item(
        "impact_models",
        "3 min",
        tuple(script("impact_models", study, "--out", OUT) for study in ("stiffness", "rods")),
        {name: name for name in ("penalty_to_impulse.png", "rods_and_strike.png")},
        "engines.md",
    ),
    measured("restitution", "modelling", "1 min"),
    measured("tolerance", "accuracy", "15 min", "--engine", "exudyn", "lagrangian"),
    Item(
        "loop_tolerance",
        "3 min",
        (script("tolerance", "--mechanisms"),),
        page="accuracy_measured.md",
        sample=script("tolerance", "--mechanisms", "--models", "textbook/double_pendulum"),
    ),
    measured("promises", "accuracy_measured", "5 min", sample=("--only", "frequencies")),
    Item(
        "verify",
        "2 min",
        ((*VERIFY, "--figure", f"{OUT}/verify.png"),),
        {"verify.png": "verify.png"},
        "accuracy_measured.md",
        (*VERIFY, "pendulum", "flores_slider"),
    ),
    Item(
        "accuracy",
        "2 min",
        ((*STUDY, "--out", f"{OUT}/study"),),
        {"accuracy.png": "study/accuracy.png"},
        "cost.md",
    ),
    Item("sweep", "2 min", (SWEEP, SWEPT), {"sweep.png": "speeds/sweep.png"}),
    measured("sweep_speed", "sweeps", "10 min"),
    measured("benchmark", "cost", "10 min", "naive", "rods", "effects", "startup"),
    Item("others", "5 min", (script("benchmark", "others"),), page="cost.md"),
    measured("told_errors", "accuracy_measured", "15 min", "--count", "20"),
    measured("random_touches", "accuracy_measured", "30 min"),
    measured(
        "hard_cases",
        "hard_cases",
        "5 min",
        "--quick",
        sample=("--quick", "--only", "tip", "two_contacts"),
    ),
    measured("random_scenes", "accuracy_measured", "5 min"),
    measured("random_mechanisms", "accuracy_measured", "10 min"),
    Item("silent_kinds", "4 min", (script("random_silent"),), page="accuracy_measured.md"),
    measured("many_turns", "accuracy_measured", "10 min"),
)


def output_of(command: tuple[str, ...], out: Path) -> tuple[str, int]:
    """Run a command from the project's folder; what it printed, and its exit code."""
    arguments = [argument.replace(OUT, str(out)) for argument in command]
    wide = {**os.environ, "COLUMNS": "160"}
    ended = subprocess.run(
        [sys.executable, *arguments],
        cwd=ROOT,
        env=wide,
        stdout=subprocess.PIPE,
        text=True,
        check=False,
    )
    return ended.stdout, ended.returncode


def told(text: str, name: str) -> str:
    """Return what a page keeps of what was printed: tables and their bold captions, or a report."""
    lines = text.splitlines()
    if name == "accuracy":  # from its first table to its advice
        first = next(i for i, line in enumerate(lines) if line.startswith("Errors"))
        last = max(i for i, line in enumerate(lines) if line.startswith(("Recomm", "That is:")))
        called = " ".join([sys.executable, *PROGRAM])
        report = [line.replace(called, f".venv/bin/{TYPED}") for line in lines]
        return "\n".join(["```text", *report[first : last + 1], "```"]) + "\n"
    kept: list[str] = []
    for line in lines:
        if line.startswith(("|", "**")):
            kept.append(line)
        elif kept and kept[-1]:
            kept.append("")
    return "\n".join(kept).strip() + "\n"


def make(item: Item) -> bool:
    """Make the files of an item; tells whether all its commands ended well."""
    fine, printed = True, []
    with TemporaryDirectory() as folder:
        out = Path(folder)
        for command in item.commands:
            text, code = output_of(command, out)
            printed.append(text)
            if code:
                fine = False
                print(f"{item.name}: exit code {code} of {' '.join(command)}", file=sys.stderr)
        missing = [source for source in item.figures.values() if not (out / source).exists()]
        if missing or (item.page and not any(printed)):
            print(f"{item.name}: not made: {', '.join(missing) or item.page}", file=sys.stderr)
            return False
        for name, source in item.figures.items():
            shutil.copyfile(out / source, DOCS / name)
    if item.page:
        page = DOCS / item.page
        text = with_parts(page, {item.name: told("\n".join(printed), item.name)})
        page.write_text(text, encoding="utf-8")
    print(f"{item.name}: written: {', '.join(item.files)}", flush=True)
    return fine


def check(item: Item) -> list[str]:
    """Measure the sample of an item; returns rows that the table does not have."""
    with TemporaryDirectory() as folder:
        text, code = output_of(item.sample, Path(folder))
    if code:
        return [f"exit code {code} of {' '.join(item.sample)}"]
    rows = told(text, item.name).splitlines()
    table = parts_of(DOCS / item.page)[item.name].splitlines()
    return list(apart(rows, table))


def apart(rows: list[str], table: list[str]) -> Iterator[str]:
    """Yield the rows (Markdown) that no row of a table agrees with."""
    for row in rows:
        if not any(agree(row, other) for other in table):
            yield row


def agree(row: str, other: str) -> bool:
    """Whether two rows name the same, have the same words, and numbers within the noise."""
    row, other = SECONDS.sub("", row), SECONDS.sub("", other)
    if row.split("|")[:2] != other.split("|")[:2] or NUMBER.sub("#", row) != NUMBER.sub("#", other):
        return False
    pairs = zip(NUMBER.findall(row), NUMBER.findall(other), strict=True)
    return all(close(float(one), float(two)) for one, two in pairs)


def close(one: float, two: float) -> bool:
    """Whether two numbers differ by noise alone."""
    small, large = sorted((abs(one), abs(two)))
    return large < ROUNDING or (one * two > 0 and large <= NOISE * small) or one == two


def main() -> int:
    """Make, list or check items."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    names = [item.name for item in ITEMS]
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of: {', '.join(names)}")
    parser.add_argument("--list", action="store_true", help="print names, files and times")
    parser.add_argument("--check", action="store_true", help="measure cheap parts again")
    options = parser.parse_args()
    if unknown := [name for name in options.names if name not in names]:
        parser.error(f"nothing is named '{unknown[0]}'; there is: {', '.join(names)}")
    chosen = [item for item in ITEMS if not options.names or item.name in options.names]
    if options.list:
        for item in chosen:
            print(f"{item.name}: {', '.join(item.files)}; about {item.takes}")
        return 0
    if options.check:
        found = {item.name: check(item) for item in chosen if item.sample}
        for name, rows in found.items():
            print(f"{name}: {'fine' if not rows else 'measured now, and not in the table:'}")
            print("".join(f"  {row}\n" for row in rows), end="")
        return 1 if any(found.values()) else 0
    failed = [item.name for item in chosen if not make(item)]
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())

"""The report of a run as one page of HTML for a browser, a phone or a printer.

The page loads nothing. `page_of` makes it of a `Result`: figures of `plots` and tables of
`report`, section by section, and the command that repeats the run. Templates only arrange these.
They escape all text that is not markup of this program.
"""

from __future__ import annotations

import json
import re
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

from exudyn_flexlink.animation import film_of, player
from exudyn_flexlink.loading import yaml_of
from exudyn_flexlink.mechanism import build_mechanism
from exudyn_flexlink.observables import joints_with_play
from exudyn_flexlink.plots import PRINT, SCREEN, figure_bytes, figures
from exudyn_flexlink.report import (
    Table,
    bending_table,
    cost_table,
    effects_table,
    energy_table,
    error_table,
    failure_text,
    friction_table,
    guide_facts,
    guide_table,
    number,
    pair_table,
    peak_table,
    positions_text,
    response_table,
    run_force_errors,
    strike_table,
    touch_table,
)
from exudyn_flexlink.report.text import MOST_ROWS, UNITS
from exudyn_flexlink.result import INTERRUPTED, NOT_ASKED, EngineSettings, Result
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.shipped import EXUDYN, THIS, version_of
from exudyn_flexlink.source import LARGEST_FILE
from exudyn_flexlink.storage import StorageError, replace_file

PAGE = "report.html"
"""Name of the page in the folder of its run."""

GENERATOR = "exudyn-flexlink report"
"""Mark of pages that this program wrote."""

PROGRAM = re.compile(r"<script>(.*?)</script>", re.DOTALL)  # other scripts hold data
NUMBER = re.compile(rf"([-+]?\d[\d.]*(?:e[-+]?\d+)?(?: (?:{UNITS})(?![\w/]))?)")


def page_of(result: Result) -> str:
    """Return the report of a run as one page of HTML."""
    environment = Environment(
        loader=PackageLoader("exudyn_flexlink.page"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.tests["numeric"] = lambda text: NUMBER.fullmatch(text) is not None
    environment.filters["numbers_apart"] = NUMBER.split  # every second piece is a number
    contents = contents_of(result)
    players = "".join(section.player for section in contents["sections"])
    return environment.get_template("page.html").render(
        **contents,
        generator=GENERATOR,
        policy=_policy(players),
        name_of_model=MODEL,
        model_link=data_uri("text/yaml", (contents["model"] or "").encode("utf-8")),
        program=f"{THIS} {version_of(THIS)}",
    )


def _policy(players: str) -> str:
    """Return the page's content security policy: load nothing, run only scripts of `players`."""
    programs = [sha256(program.encode("utf-8")).digest() for program in PROGRAM.findall(players)]
    hashes = " ".join(f"'sha256-{b64encode(program).decode('ascii')}'" for program in programs)
    allowed = f"; script-src {hashes}" if hashes else ""
    return f"default-src 'none'; img-src data:; style-src 'unsafe-inline'{allowed}"


ENDINGS = (".html", ".htm")


def write_page(result: Result, file: Path, *, force: bool = False) -> None:
    """Write the page of a run; it replaces an earlier page, but another file only with `force`.

    Raises:
        StorageError: the file may not be replaced, or can't be written.

    """
    if file.suffix.lower() not in ENDINGS:
        about = "a report is a page of HTML, whose name ends in"
        raise StorageError(f"can't write {file}: {about} {' or '.join(ENDINGS)}")
    replace_file(file, page_of(result).encode("utf-8"), is_page, force=force)


def is_page(content: bytes) -> bool:
    """Whether the content of a file is a page of this program."""
    return f'name="generator" content="{GENERATOR}"'.encode() in content[:1000]


MOST_STRIKES = 100  # most rows of a contact's table: some screens of a phone
MOST_TOUCHES = 200  # most rows of a folded table, which readers open themselves
MODEL = "model.yaml"
"""Name under which the page offers the model file."""

WIDE = replace(SCREEN, titled=False)  # the page has the title as text
NARROW = PRINT  # a column in print, 86 mm, is about as wide as a phone
PIXELS = 96  # pixels of a page per inch
MOST_SVG = 250_000  # bytes: a larger SVG becomes pixels, which take less room
COORDINATES = re.compile(rb' (?:d|x|y)="[^"]*"')
DECIMALS = re.compile(rb"(\.\d\d)\d+")  # differences below 0.01 point are invisible


@dataclass(frozen=True)
class Picture:
    """A figure with its caption, and its description in words (`alt`).

    `wide` and `narrow` are data URIs; `size` is the size of `wide`, in pixels of a page.
    """

    name: str
    caption: str
    alt: str
    wide: str
    narrow: str
    size: tuple[int, int]


@dataclass(frozen=True)
class Section:
    """A part of the page under a heading: texts, then figures, then tables; some are folded.

    `player` is the markup of an animation, which print omits.
    """

    key: str
    heading: str
    texts: Sequence[str] = ()
    pictures: Sequence[Picture] = ()
    tables: Sequence[Table] = ()
    folded: Sequence[Table] = ()
    player: str = ""

    def __bool__(self) -> bool:
        """Whether the section has any content."""
        return any((self.texts, self.pictures, self.tables, self.folded, self.player))


def contents_of(result: Result) -> dict[str, Any]:
    """Return the contents of a run's page, by their names in the template.

    `why` tells why the run stopped, and what to try. `model` is the scene as a model file; it is
    None if that file would be too long.
    """
    pictures, moves = pictures_of(result), result.time[0] < result.time[-1]
    effects = effects_table(result.scene, build_mechanism(result.scene))
    effects = replace(effects, caption="Effects, simulated or not")
    errors = replace(error_table(result), caption="How far the run is off")
    sections = [
        Section("mechanism", "Mechanism", pictures=_of(pictures, "mechanism")),
        Section("animation", "Animation", player=player(film_of(result)) if moves else ""),
        Section("motion", "Motion", pictures=_of(pictures, "coordinates", "polar")),
        _strikes(result, pictures),
        _touches(result, pictures),
        Section("forces", "Forces", (), _of(pictures, "forces"), _filled([peak_table(result)])),
        Section(
            "bending", "Bending", (), _of(pictures, "bending"), _filled([bending_table(result)])
        ),
        Section(
            "energy",
            "Energy",
            (),
            _of(pictures, "energy"),
            _filled([energy_table(result), friction_table(result)]),
        ),
        Section("effects", "Effects", tables=[effects]),
        Section("errors", "Errors", tables=_filled([errors, run_force_errors(result)])),
    ]
    ending = "Completed"
    if not result.outcome.completed:
        interrupted = result.outcome.reason == INTERRUPTED
        ending = "Interrupted" if interrupted else "Stopped before its end"
    return {
        "title": result.scene.title,
        "source": result.scene.source,
        "ending": ending,
        "why": [] if result.outcome.completed else failure_text(result).split("\n"),
        "warnings": result.warnings,
        "facts": _facts(result),
        "sections": [section for section in sections if section],
        "model": model_text(result.scene),
        "command": command_of(result),
        "settings": Table("Settings of the engine, in SI units", _settings(result.settings)),
        "versions": Table("Versions", _rows(result.versions)),
    }


def _facts(result: Result) -> Table:
    """Return the table of engine, accuracy, cost, and error of positions."""
    way = result.settings.formulation
    engine = result.engine if way is None else f"{result.engine}, formulation '{way}'"
    accuracy = result.scene.accuracy
    asked = f"fixed steps of {number(accuracy.step or 0.0)} s"
    if accuracy.tolerance is not None:
        asked = f"an error of {number(accuracy.tolerance)} m at most"
    rows = [["engine", engine], ["accuracy asked for", asked], *cost_table(result).rows]
    return Table("The run", [*rows, ["positions", positions_text(result.error)]])


def _strikes(result: Result, pictures: Mapping[str, Picture]) -> Section:
    contacts = result.scene.all_contacts
    tables = [strike_table(result, contact, MOST_STRIKES) for contact in contacts]
    texts = [f"{shown.caption}: none." for shown in tables if not shown.rows]
    answers = response_table(result)
    return Section("strikes", "Strikes", texts, _of(pictures, "lever"), _filled([*tables, answers]))


def _touches(result: Result, pictures: Mapping[str, Picture]) -> Section:
    joints, tables, folded = joints_with_play(result), list[Table](), list[Table]()
    for joint in joints:
        facts = replace(guide_facts(result, joint), caption=f"Depth and duration in '{joint}'")
        tables += [guide_table(result, joint), facts, pair_table(result, joint, MOST_ROWS)]
        folded.append(touch_table(result, joint, MOST_TOUCHES))
    drawn = _of(pictures, "guide_contact")
    return Section("touches", "Touches", [], drawn, _filled(tables), _filled(folded))


def _of(pictures: Mapping[str, Picture], *names: str) -> list[Picture]:
    return [pictures[name] for name in names if name in pictures]


def _filled(tables: Iterable[Table]) -> list[Table]:
    return [shown for shown in tables if shown.rows]


def _settings(settings: EngineSettings) -> list[list[str]]:
    """Return the rows of the settings in use; those of the integrator come first."""
    values = vars(settings.integrator) | vars(settings)
    del values["integrator"]
    return _rows({name: value for name, value in values.items() if value is not None})


def _rows(values: Mapping[str, float | str]) -> list[list[str]]:
    return [
        [name, value if isinstance(value, str) else number(value)] for name, value in values.items()
    ]


def model_text(scene: Scene) -> str | None:
    """Return the scene as a model file, in SI units; None if it is too long for one.

    The text includes points of splines, and tables, even if they came from other files.
    """
    data = scene.to_data()
    if len(json.dumps(data, ensure_ascii=False).encode("utf-8")) > LARGEST_FILE // 2:
        return None  # YAML takes more room, and a YAML reader takes seconds
    return yaml_of(scene)


def command_of(result: Result) -> str:
    """Return the command that repeats the run from its model file."""
    words = ["exudyn-flexlink simulate", MODEL]
    if result.engine != EXUDYN:
        words.append(f"--engine {result.engine}")
    if result.error == NOT_ASKED:
        words.append("--no-measure")
    return " ".join(words)


def pictures_of(result: Result) -> dict[str, Picture]:
    """Return all figures of a run, by name."""
    wide, narrow = figures(result, WIDE), figures(result, NARROW)
    return {
        name: Picture(
            name,
            str(figure.get_label()),
            described(figure),
            _uri(figure),
            _uri(narrow[name]),
            (round(PIXELS * figure.get_figwidth()), round(PIXELS * figure.get_figheight())),
        )
        for name, figure in wide.items()
    }


def _uri(figure: Figure) -> str:
    """Return a figure as a data URI: a sharp SVG, or a PNG if the SVG is too large."""
    svg = COORDINATES.sub(
        lambda number: DECIMALS.sub(rb"\1", number[0]), figure_bytes(figure, "svg")
    )
    if len(svg) <= MOST_SVG:
        return data_uri("image/svg+xml", svg)
    return data_uri("image/png", figure_bytes(figure, "png"))


def data_uri(kind: str, content: bytes) -> str:
    """Return the content of a file as a data URI, which a page accepts as an address."""
    return f"data:{kind};base64,{b64encode(content).decode('ascii')}"


def described(figure: Figure) -> str:
    """Describe a figure in words: its panels, the ranges of their lines, its legends."""
    texts = []
    for axes in (axis for axis in figure.axes if axis.axison):
        scale = next(filter(None, (axis.get_ylabel() for axis in (axes, *axes.child_axes))), "")
        lines = [line for line in axes.lines if line.get_transform() == axes.transData]
        heights = np.concatenate([[np.nan], *(line.get_ydata() for line in lines)])
        if scale and not np.isnan(heights).all():
            scale += f" from {np.nanmin(heights):.4g} to {np.nanmax(heights):.4g}"
        over = f"over {axes.get_xlabel()}" if axes.get_xlabel() else ""
        texts.append(f"{axes.get_title(loc='left')} {scale} {over}")
    legends = [legend for axes in figure.axes if (legend := axes.get_legend())]
    names = [
        text.get_text() for legend in (*legends, *figure.legends) for text in legend.get_texts()
    ]
    texts += [f"shown are {', '.join(dict.fromkeys(names))}"] * bool(names)
    return "; ".join(" ".join(words.split()) for words in texts if words.strip()).replace("$", "")

"""A page's contents to HTML, by templates that escape whatever is not markup of this program."""

from __future__ import annotations

import re
from base64 import b64encode
from hashlib import sha256
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from exudyn_flexlink.page.contents import MODEL, contents_of, data_uri
from exudyn_flexlink.report.text import UNITS
from exudyn_flexlink.result import Result
from exudyn_flexlink.storage import StorageError, replace_file
from exudyn_flexlink.versions import THIS, version_of

PAGE = "report.html"
"""Name of the page in the folder of its run."""

GENERATOR = "exudyn-flexlink report"
"""How a page says that this program wrote it."""

PROGRAM = re.compile(r"<script>(.*?)</script>", re.DOTALL)  # others hold data
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
    """Return what a browser lets a page do: load nothing, and run nothing but these players."""
    programs = [sha256(own.encode("utf-8")).digest() for own in PROGRAM.findall(players)]
    hashes = " ".join(f"'sha256-{b64encode(own).decode('ascii')}'" for own in programs)
    allowed = f"; script-src {hashes}" if hashes else ""
    return f"default-src 'none'; img-src data:; style-src 'unsafe-inline'{allowed}"


ENDINGS = (".html", ".htm")


def write_page(result: Result, file: Path, *, force: bool = False) -> None:
    """Write the page of a run; one that stands there is replaced, another file only with `force`.

    Raises:
        StorageError: the file may not be replaced, or can't be written.

    """
    if file.suffix.lower() not in ENDINGS:
        told = "a report is a page of HTML, whose name ends in"
        raise StorageError(f"can't write {file}: {told} {' or '.join(ENDINGS)}")
    replace_file(file, page_of(result).encode("utf-8"), is_page, force=force)


def is_page(content: bytes) -> bool:
    """Whether the content of a file is a page of this program."""
    return f'name="generator" content="{GENERATOR}"'.encode() in content[:1000]

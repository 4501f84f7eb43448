"""Parts of pages that scripts write: between two markers, so that a page reads where it lies."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PART = re.compile(
    r"^<!-- begin (?P<name>\w+), written by a script -->\n(?P<text>.*?)^<!-- end (?P=name) -->$",
    re.MULTILINE | re.DOTALL,
)


def parts_of(page: Path) -> dict[str, str]:
    """Return the texts between markers in a page, by name."""
    return {found["name"]: found["text"] for found in PART.finditer(_text(page))}


def without_parts(page: Path) -> str:
    """Return what was written by hand in a page."""
    return PART.sub("", _text(page))


def with_parts(page: Path, texts: dict[str, str]) -> str:
    """Return a page with these texts between the markers of their names."""

    def written(found: re.Match[str]) -> str:
        text = texts.get(found["name"])
        if text is None:
            return found[0]
        first, last = found[0].split("\n", 1)[0], found[0].rsplit("\n", 1)[-1]
        return f"{first}\n{text.strip()}\n{last}"

    return PART.sub(written, _text(page))


def _text(page: Path) -> str:
    return page.read_text(encoding="utf-8")

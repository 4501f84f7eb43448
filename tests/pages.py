"""A page of HTML as tests read it: its elements, its tables, and what it refers to."""

from __future__ import annotations

from dataclasses import dataclass, field
from html.parser import HTMLParser

VOID = {"meta", "source", "img", "br", "input", "link", "hr", "wbr"}
SPACED = {"p", "li", "td", "th", "tr", "caption", "h1", "h2", "h3", "div", "title", "section"}


@dataclass
class Element:
    """A tag with its attributes, and what is in it, as elements and texts."""

    tag: str
    attributes: dict[str, str]
    inside: list[Element | str] = field(default_factory=list)

    def all(self, *tags):
        """Elements of these tags within it, in order."""
        found = []
        for one in self.inside:
            if isinstance(one, Element):
                found += [one] if one.tag in tags or not tags else []
                found += one.all(*tags)
        return found

    @property
    def text(self):
        """All text in it, but for styles and programs."""
        if self.tag in ("style", "script"):
            return ""
        parts = (one if isinstance(one, str) else one.text for one in self.inside)
        between = " " if self.tag in SPACED else ""
        return between + "".join(parts) + between

    @property
    def words(self):
        """Its text with single spaces."""
        return " ".join(self.text.split())


class _Reader(HTMLParser):
    """Reads a page, and refuses elements that are left open, or closed where they are not open."""

    def __init__(self):
        super().__init__(convert_charrefs=True)
        self.open = [Element("page", {})]

    def handle_starttag(self, tag, attrs):
        names = [name for name, _ in attrs]
        assert len(set(names)) == len(names), f"<{tag}> has an attribute twice"
        new = Element(tag, {name: value or "" for name, value in attrs})
        self.open[-1].inside.append(new)
        if tag not in VOID:
            self.open.append(new)

    def handle_endtag(self, tag):
        assert self.open[-1].tag == tag, f"</{tag}> ends <{self.open[-1].tag}>"
        self.open.pop()

    def handle_data(self, data):
        self.open[-1].inside.append(data)


def read_page(text):
    """Read a page; whatever is not well formed fails the test."""
    assert text.lstrip().startswith("<!DOCTYPE html>")
    reader = _Reader()
    reader.feed(text)
    reader.close()
    assert len(reader.open) == 1, f"left open: {[one.tag for one in reader.open[1:]]}"
    return reader.open[0]


def tables_of(page):
    """Rows of every table by its caption, the names of columns first if there are any."""
    return {
        table.all("caption")[0].words: [
            [cell.words for cell in row.all("td", "th")] for row in table.all("tr")
        ]
        for table in page.all("table")
    }

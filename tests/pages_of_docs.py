"""README and documentation as the tests read them: pages, code blocks, printed commands."""

import re
import shlex
from pathlib import Path

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PROGRAM = "exudyn-flexlink"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.glob("*.md")),
         *sorted((DOCS / "reference").glob("*.md"))]  # fmt: skip
BLOCK = re.compile(r"^ *```(?P<language>\w*)\n(?P<text>.*?)^ *```$", re.MULTILINE | re.DOTALL)


def text_of(page):
    return page.read_text(encoding="utf-8")


def blocks(page, language):
    return [
        found["text"] for found in BLOCK.finditer(text_of(page)) if found["language"] == language
    ]


def commands():
    """The page and the words of every command that README or documentation print."""
    for page in PAGES:
        for block in blocks(page, ""):
            for line in re.split(r"\n| && ", block):
                if line.lstrip().startswith((".venv/", "python", f"{PROGRAM} ")):
                    yield page.name, shlex.split(line.replace(f".venv/bin/{PROGRAM}", PROGRAM))

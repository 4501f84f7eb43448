"""Statements, files and constants of each room of the package, and how densely it is written.

Usage:
  .venv/bin/python scripts/rooms.py   exit code 1 where something is above its ceiling

Statements are those of Python's grammar, without docstrings: text that is squeezed into fewer lines
has as many. The mean of nodes of a simple statement rises where lines are packed; imports do not
count in it, as larger rooms have fewer of them. Constants are
numbers that get a name at the head of a module. Who needs more than a ceiling raises it here, and
says why in the commit.
"""

from __future__ import annotations

import argparse
import ast
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parent.parent
PACKAGE = "exudyn_flexlink"
MOST_STATEMENTS = 31_623  # of the package
MOST_FILES = 173  # of the package: a new one has a subject that no other file has
MOST_CONSTANTS = 430  # of the package: a quantity has one, where all can take it from
MOST_NODES = 17.11  # of the syntax tree, a simple statement of the package, on average
LEFT_OUT = (
    ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.If, ast.For, ast.While, ast.With,
    ast.Try, ast.Match, ast.Import, ast.ImportFrom,
)  # fmt: skip
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


class Size(NamedTuple):
    """What some files hold; `simple` statements but imports have so many `nodes` in all."""

    files: int = 0
    statements: int = 0
    simple: int = 0
    nodes: int = 0
    constants: int = 0

    def with_file(self, path: Path) -> Size:
        """Return the size with one more file."""
        tree = ast.parse(path.read_text(encoding="utf-8"))
        found = [node for node in ast.walk(tree) if isinstance(node, ast.stmt)]
        simple = [one for one in found if not isinstance(one, LEFT_OUT) and not _is_text(one)]
        nodes = sum(1 for one in simple for _ in ast.walk(one))
        statements = len(found) - sum(map(_has_docstring, ast.walk(tree)))
        constants = sum(map(_is_constant, tree.body))
        more = (1, statements, len(simple), nodes, constants)
        return Size(*(a + b for a, b in zip(self, more, strict=True)))


def _has_docstring(node: ast.AST) -> bool:
    return isinstance(node, DOCUMENTED) and ast.get_docstring(node, clean=False) is not None


def _is_text(node: ast.stmt) -> bool:
    """Tell whether a statement is a text alone, such as a docstring."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _is_constant(node: ast.stmt) -> bool:
    """Tell whether a statement gives a name to a number, or to a sum of numbers alone."""
    if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
        return False
    leaves = [one for one in ast.walk(node.value) if isinstance(one, ast.expr)]
    return all(
        isinstance(one, ast.UnaryOp | ast.BinOp)
        or (isinstance(one, ast.Constant) and type(one.value) in {int, float})
        for one in leaves
    )


def room_of(path: Path) -> str:
    """The room that a file of the package is in: its folder."""
    folder = path.parent.relative_to(ROOT / PACKAGE).as_posix()
    return "top modules" if folder == "." else folder


def rooms() -> dict[str, Size]:
    """Size of each room of the package."""
    found: dict[str, Size] = {}
    for path in _files(PACKAGE):
        room = room_of(path)
        found[room] = found.get(room, Size()).with_file(path)
    return found


def size_of(folder: str) -> Size:
    """Size of all Python files in a folder of the repository."""
    size = Size()
    for path in _files(folder):
        size = size.with_file(path)
    return size


def _files(folder: str) -> list[Path]:
    return sorted((ROOT / folder).rglob("*.py"))


def _complaints(whole: Size) -> Iterator[str]:
    if whole.statements > MOST_STATEMENTS:
        yield f"the package has more than {MOST_STATEMENTS:,} statements"
    if whole.files > MOST_FILES:
        yield f"the package has more than {MOST_FILES} files"
    if whole.constants > MOST_CONSTANTS:
        yield f"the package has more than {MOST_CONSTANTS} numeric constants at module heads"
    if whole.nodes / whole.simple > MOST_NODES:
        yield f"its simple statements have more than {MOST_NODES} nodes on average: unpack them"


def main() -> int:
    """Print all rooms; the exit code is 1 if the package is above a ceiling."""
    argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0]).parse_args()
    print(f"{'':28} statements  files  constants  nodes a simple statement")
    whole = size_of(PACKAGE)
    rows = {**rooms(), PACKAGE: whole, "tests": size_of("tests"), "scripts": size_of("scripts")}
    for name, size in rows.items():
        counts = f"{size.statements:10,}  {size.files:5,}  {size.constants:9,}"
        print(f"{name:28} {counts}  {size.nodes / size.simple:6.2f}")
    complaints = list(_complaints(whole))
    print("\n".join(complaints), end="\n" if complaints else "")
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())

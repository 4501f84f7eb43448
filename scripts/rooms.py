"""Lines of code by room, and how many files of the engines speak of a subject; with ceilings.

Usage:
  .venv/bin/python scripts/rooms.py   exit code 1 where a room is above its ceiling

What is counted are lines of Python files, with comments and blank ones. Ceilings are what was
reached: who needs more room raises one here, and says why in the commit.
"""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
PACKAGE = "exudyn_flexlink"
# A folder belongs to the room that names most of its path.
CEILINGS = {
    "integrate": 1_610,
    "engines": 2_540,
    "engines/exudyn/minimal": 5_705,
    "engines/exudyn/redundant": 3_355,
    "engines/lagrangian": 2_015,
    "mechanism": 6_065,
    "scene": 4_080,
    "expressions": 1_225,
    "curves": 1_305,
    "observables": 1_925,
    "accuracy": 940,
    "stability": 880,
    "verification": 430,
    "storage": 1_930,
    "sweeps": 1_475,
    "plots": 3_340,
    "report": 2_125,
    "page": 340,
    "animation": 1_685,
    "cli": 2_635,
    "api": 1_735,
    "": 5_235,
}
WHOLE = {PACKAGE: 52_540, "tests": 26_180, "scripts": 8_700}
SPEAK_OF = {"clearance": 5, "tolerance": 14}  # files of the engines and integrate
LONGEST = 350  # lines of a file


def lines_of(path: Path) -> int:
    """How many lines a file has."""
    return path.read_text(encoding="utf-8").count("\n")


def room_of(path: Path) -> str:
    """The room that a file of the package is in."""
    folder = path.parent.relative_to(ROOT / PACKAGE).as_posix() + "/"
    return max((room for room in CEILINGS if folder.startswith(f"{room}/")), key=len, default="")


def rows() -> list[tuple[str, int, int]]:
    """Everything that has a ceiling: its name, what there is, and the ceiling."""
    files = sorted((ROOT / PACKAGE).rglob("*.py"))
    found = dict.fromkeys(CEILINGS, 0)
    for path in files:
        found[room_of(path)] += lines_of(path)
    told = [(room or "top modules", found[room], most) for room, most in CEILINGS.items()]
    for folder, most in WHOLE.items():
        told.append((folder, sum(map(lines_of, (ROOT / folder).rglob("*.py"))), most))
    deep = [path for path in files if room_of(path).split("/")[0] in ("engines", "integrate")]
    for word, most in SPEAK_OF.items():
        said = re.compile(rf"\b{word}\b", re.IGNORECASE)
        speaking = sum(bool(said.search(path.read_text(encoding="utf-8"))) for path in deep)
        told.append((f"files of engines and integrate that speak of {word}", speaking, most))
    told.append(("longest file of the package", max(map(lines_of, files)), LONGEST))
    return told


def main() -> int:
    """Print all rows; the exit code is 1 if one is above its ceiling."""
    argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0]).parse_args()
    above = 0
    for name, there, most in rows():
        over = there > most
        above += over
        print(f"{name:58} {there:7,} of {most:7,}{'  above its ceiling' if over else ''}")
    return 1 if above else 0


if __name__ == "__main__":
    sys.exit(main())

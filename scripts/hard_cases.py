"""Hard cases: whether the answer is right, refused as documented, or wrong.

Usage:
  .venv/bin/python scripts/hard_cases.py                      the whole catalogue
  .venv/bin/python scripts/hard_cases.py --quick              a part of every case
  .venv/bin/python scripts/hard_cases.py --only speed strip --way minimal

Every model of `models/hard` is run in its variants, by every engine and formulation that represents
it, and held against the truth that stands at its head. Prints a table; the exit code is 1 if
anything is WRONG. `deviation` is that of the point that strikes and of the lever's tip, in parts of
a metre, with what the run's own tolerance allows.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator

from hard.case import ALL, Case, Variant
from hard.catalogue import CASES
from hard.judging import RIGHT, WRONG, Row, judge, properties

HEAD = "| case | solved as | truth | deviation (allowed), m | steps | warnings | verdict |"


def lines(cases: list[Case], ways: list[str], quick: bool) -> Iterator[Row]:
    """Judge cases, one row after the other."""
    for case in cases:
        for variant in case.variants:
            if quick and not variant.quick:
                continue
            for way in variant.ways or case.ways:
                if way in ways:
                    yield judge(case, variant, way)
        if case.properties and not quick:
            for way in case.ways:
                if way in ways:
                    yield from properties(case, _for_properties(case), way)


def _for_properties(case: Case) -> Variant:
    """The variant in the middle of a range, of those that run to their end."""
    whole = [variant for variant in case.variants if not variant.refused]
    return whole[len(whole) // 2]


def text_of(row: Row) -> str:
    """One line of the table, and what is wrong."""
    case = f"{row.case}, {row.variant}" if row.variant else row.case
    off = "" if row.deviation != row.deviation else f"{row.deviation:.1e} ({row.allowed:.0e})"
    verdict = row.verdict if row.verdict == RIGHT else f"{row.verdict}: {'; '.join(row.broken)}"
    steps = str(row.steps) if row.steps else ""
    warned = str(len(row.warnings)) if row.warnings else ""
    return f"| {case} | {row.way} | {row.truth} | {off} | {steps} | {warned} | {verdict} |"


def main() -> int:
    """Print the table; 1 if anything is wrong."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="a part of every case")
    parser.add_argument("--only", nargs="+", choices=[case.name for case in CASES])
    parser.add_argument("--way", nargs="+", choices=ALL, default=list(ALL))
    parser.add_argument("--verbose", action="store_true", help="print warnings, too")
    options = parser.parse_args()
    chosen = [case for case in CASES if not options.only or case.name in options.only]
    print(HEAD)
    print("|---|---|---|---|---|---|---|")
    wrong = count = 0
    for row in lines(chosen, options.way, options.quick):
        print(text_of(row), flush=True)
        if options.verbose:
            for warning in row.warnings:
                print(f"    warning: {warning}")
        wrong += row.verdict == WRONG
        count += 1
    print(f"\n{count} runs, {wrong} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

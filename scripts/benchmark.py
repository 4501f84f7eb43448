"""Measure whether this tool is ahead of what one would script by hand, and what its parts cost.

  .venv/bin/python scripts/benchmark.py                  everything, about ten minutes
  .venv/bin/python scripts/benchmark.py naive rods       some parts
  .venv/bin/python scripts/benchmark.py --quick          smaller ones, about three minutes

Parts: naive (the script by hand), others (MuJoCo, if it is installed, and DOP853), rods (cost of a
step over their number), effects (what each costs), startup.

Costs are processor times, the least of `--repeat` runs, and whatever is compared is measured in
turn (A B A B ...) in this one run: trust the ratios, and not the seconds, of a shared machine.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

from benchmarks import effects, naive, others, rods, startup
from benchmarks.measuring import Table

Part = Callable[..., list[Table]]

PARTS: dict[str, Part] = {
    "naive": naive.tables,
    "others": others.tables,
    "rods": rods.tables,
    "effects": effects.tables,
    "startup": startup.tables,
}


def main() -> None:
    """Measure the parts asked for, and print their tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("parts", nargs="*", metavar="part", help=f"of: {', '.join(PARTS)}")
    parser.add_argument("--quick", action="store_true", help="smaller scenes, fewer points")
    parser.add_argument("--repeat", type=int, default=3, help="runs of which the best counts")
    options = parser.parse_args()
    if unknown := [part for part in options.parts if part not in PARTS]:
        parser.error(f"no part '{unknown[0]}'; there is: {', '.join(PARTS)}")
    for name in options.parts or PARTS:
        for table in PARTS[name](quick=options.quick, repeat=max(1, options.repeat)):
            print(table)


if __name__ == "__main__":
    main()

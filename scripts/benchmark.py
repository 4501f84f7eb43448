"""Measure whether this tool is ahead of what one would script by hand, and of its peers.

  .venv/bin/python scripts/benchmark.py                  everything, about a quarter of an hour
  .venv/bin/python scripts/benchmark.py naive rods       some parts
  .venv/bin/python scripts/benchmark.py --quick          smaller ones, about three minutes

Parts: naive (the script by hand), scipy, mujoco, loops (peers; the last two against MuJoCo, if
installed, on a chain and on a closed loop), rods (cost of a step over their number), effects (what
each costs), startup.

Costs are processor times, the least of `--repeat` runs, and whatever is compared is measured in
turn (A B A B ...) in this one run: trust the ratios, and not the seconds, of a shared machine.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial

from benchmarks import effects, naive, peer_loops, peer_mujoco, peer_scipy, rods, startup
from benchmarks.measuring import Table
from benchmarks.printing import markdown, show
from rich.console import Console

Part = Callable[..., list[Table]]

PARTS: dict[str, Part] = {
    "naive": naive.tables,
    "scipy": peer_scipy.tables,
    "mujoco": peer_mujoco.tables,
    "loops": peer_loops.tables,
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
    parser.add_argument("--markdown", action="store_true", help="print tables as Markdown")
    parser.add_argument("--full", action="store_true", help="scipy: two turns, not a part of one")
    options = parser.parse_args()
    if unknown := [part for part in options.parts if part not in PARTS]:
        parser.error(f"no part '{unknown[0]}'; there is: {', '.join(PARTS)}")
    console = Console(width=120)
    for name in options.parts or PARTS:
        measure = partial(PARTS[name], quick=options.quick, repeat=max(1, options.repeat))
        if name == "scipy":
            measure = partial(measure, full=options.full)
        for table in measure():
            if options.markdown:
                print(markdown(table))
            else:
                show(console, table)


if __name__ == "__main__":
    main()

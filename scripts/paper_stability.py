"""Measure how stable the paper's motions are: without and with clearance, for both hinge rules.

  .venv/bin/python scripts/paper_stability.py
  .venv/bin/python scripts/paper_stability.py --laps 48 --only "clearance, paper"

Prints a Markdown table: largest Lyapunov exponents with their uncertainty, at the tolerance and at
a tenth of it, and what S does from lap to lap. By the Lagrangian, which takes four minutes.
"""

from __future__ import annotations

import argparse
from math import isfinite

from exudyn_flexlink import Stability, load_scene, stability_of
from exudyn_flexlink.report import exponent_text

CASES = {
    f"{words}, {hinges}": (model, hinges)
    for hinges in ("paper", "beam")
    for model, words in (("no_clearance", "no clearance"), ("clearance", "clearance"))
}


def main() -> None:
    """Study all scenes and print what they do."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--laps", type=int, default=24, help="of each study")
    parser.add_argument("--only", choices=CASES, nargs="*", default=list(CASES))
    options = parser.parse_args()
    print("| scene, hinges | exponent (95 %) | at a tenth of the tolerance | S | known for |")
    print("|---|---|---|---|---|")
    for name in options.only:
        model, hinges = CASES[name]
        scene = load_scene(model, {"bodies.link.hinges.stiffness": hinges})
        found = stability_of(scene, "lagrangian", laps=options.laps, twice=True)
        print(row(name, found), flush=True)


def row(name: str, found: Stability) -> str:
    """One scene as a row of the table."""
    assert found.tighter is not None
    known = f"{found.horizon:.2g} s" if isfinite(found.horizon) else "always"
    both = f"{exponent_text(found.exponent)} | {exponent_text(found.tighter)}"
    return f"| {name} | {both} | {found.behaviour} | {known} |"


if __name__ == "__main__":
    main()

"""Which restitution contact laws give, by that which is asked: of impacts that are simulated.

Usage:
  .venv/bin/python scripts/restitution.py   prints a Markdown table; takes half a minute
"""

from __future__ import annotations

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory

from exudyn_flexlink import load_scene
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.laws import FACTORS

ASKED = (0.1, 0.3, 0.5, 0.7, 0.9)
BALL = """title: a ball strikes a wall
bodies: {ball: {type: rigid, mass: 1, inertia: 0.1}}
curves: {wall: {type: line, from: [0, 1], to: [0, -1]}}
contacts:
  hit:
    type: point_on_curve
    point: ball.centre
    curve: wall
    side: left
    law: {type: %s, stiffness: 1.0e+6, restitution: %s}
initial: {positions: {ball: [0.01, 0]}, velocities: {ball: [-1, 0]}}
run: {duration: 0.1}
accuracy: {tolerance: 1.0e-11}
"""


def given(kind: str, asked: float) -> float:
    """Restitution of an impact by a law that is asked for one."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "ball.yaml"
        path.write_text(BALL % (kind, asked), encoding="utf-8")
        touch = simulate(load_scene(path)).contacts["hit"].touches
    return float(touch.separation_speed[0] / touch.approach_speed[0])


def main() -> None:
    """Print the table."""
    argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0]).parse_args()
    print(f"| asked | {' | '.join(f'`{kind}`' for kind in FACTORS)} |")
    print("|---" * (1 + len(FACTORS)) + "|")
    for asked in ASKED:
        print(f"| {asked} | {' | '.join(f'{given(kind, asked):.4f}' for kind in FACTORS)} |")


if __name__ == "__main__":
    main()

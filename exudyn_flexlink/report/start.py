"""What `check` says of a mechanism as it is put together: its freedoms, and where it starts."""

from __future__ import annotations

from collections.abc import Mapping
from math import degrees

import numpy as np

from exudyn_flexlink.loading import other_ways
from exudyn_flexlink.mechanism import (
    Assembly,
    idle_at_start,
    length_along,
    moved_by_forces,
    speed_along,
    wound_at_start,
)
from exudyn_flexlink.report.text import listed, number, table
from exudyn_flexlink.scene import FlexibleBody, Scene

NOTICEABLE = 1e-6  # rad, rad/s, m/s: by more than this a body stands otherwise, or moves
DECIMALS = 9  # of degrees and metres that are told: what is smaller is rounding of the assembly


def freedom_lines(scene: Scene, assembly: Assembly) -> list[str]:
    """Return the degrees of freedom, what decides each, and joints that hold twice."""
    drives = [motor.name for motor in assembly.mechanism.speed_motors]
    left = assembly.degrees_of_freedom
    rows = []
    if drives:
        rows.append(["prescribed", f"{len(drives)}, by {listed(drives)}"])
    if left:
        rows.append(["left to forces", f"{left}: {_moved(scene, assembly)}"])
    if assembly.surplus:  # which minimal coordinates leave out
        names = listed(list(assembly.surplus))
        told = f"what {names} would hold, other joints hold already, in every position"
        rows.append(["held twice", told])
    count = left + len(drives)
    fixed = "" if count else ", nothing can move"
    return [f"Degrees of freedom: {count}{fixed}", *table(rows)]


def _moved(scene: Scene, assembly: Assembly) -> str:
    """What forces move, and what they bend."""
    moved = moved_by_forces(assembly)
    bodies = scene.bodies.items()
    bent = [name for name, body in bodies if isinstance(body, FlexibleBody) and body.rods > 1]
    told = [f"they move {listed(moved)}"] if moved else []
    told += [f"they bend {listed(bent)}"] if bent else []
    return "; ".join(told)


def start_lines(scene: Scene, assembly: Assembly) -> list[str]:
    """Return angles of bodies and places along slides at time 0, with their speeds.

    A flexible body has those of its first rod. Other ways to close the joints, and contacts that
    do not act at first, are told, too.
    """
    state, bodies = assembly.state, assembly.mechanism.bodies.items()
    here = {body: float(state.q[parts[0], 2]) for body, parts in bodies}
    speeds = {body: float(state.v[parts[0], 2]) for body, parts in bodies}
    ways = [
        {b: a for b, a in way.items() if abs(_wrapped(a - here[b])) > NOTICEABLE}
        for way in other_ways(scene, assembly)
    ]
    others = [
        ["The joints close in other ways, too; 'initial: guesses' picks one:"],
        *(["", _angles(way, {})] for way in ways),
    ]
    idle = [["", told] for _, told in idle_at_start(assembly.mechanism, state.q, state.v)]
    idle += [["", told] for told in wound_at_start(assembly.mechanism, state.q)]
    slides = [["", _places(assembly)]] if assembly.mechanism.slides else []
    return [
        "Start",
        *table([["", _angles(here, speeds)], *slides, *(others if ways else []), *idle]),
    ]


def _angles(angles: dict[str, float], speeds: Mapping[str, float]) -> str:
    told = {body: f"{body} {_told(degrees(_wrapped(a)))} deg" for body, a in angles.items()}
    return listed([at + _moving(speeds.get(body, 0.0), "rad/s") for body, at in told.items()])


def _places(assembly: Assembly) -> str:
    """How far along each line is what slides on it, as `initial: along` gives it."""
    slides, q, v = assembly.mechanism.slides, assembly.state.q, assembly.state.v
    told = [f"along {s.name} {_told(float(length_along(s, q)))} m" for s in slides]
    speeds = [float(speed_along(s, q, v)) for s in slides]
    return listed([at + _moving(speed, "m/s") for at, speed in zip(told, speeds, strict=True)])


def _moving(speed: float, unit: str) -> str:
    """What is said of a speed after the place; nothing where there is none."""
    return f" at {_told(speed)} {unit}" if abs(speed) > NOTICEABLE else ""


def _told(value: float) -> str:
    return number(round(value, DECIMALS) + 0.0)  # no -0


def _wrapped(angle: float) -> float:
    """Angle between -pi and pi."""
    return float(np.angle(np.exp(1j * angle)))

"""Other ways to put a mechanism together: loops of joints mostly close in two or more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism.assembly import Assembly, without_play
from exudyn_flexlink.mechanism.closing import CannotAssembleError, shuffled, straight_positions
from exudyn_flexlink.mechanism.laying_out import Start
from exudyn_flexlink.mechanism.mobility import DEPENDENT, free_motions

STARTS = 24  # searches, each from other guesses: four-bars and sliders show both ways by the third
SAME = 1e-6  # rad: by so little or less the angles of one way differ


def other_branches(assembly: Assembly, start: Start) -> list[FloatArray]:
    """Angles (parts,) in rad of every other way to close the joints that a few searches find.

    What is free to move stays where the assembly has it, and so does what `start` holds. Flexible
    bodies are straight in all of them.
    """
    mechanism = assembly.mechanism
    bodies = list(mechanism.bodies.values())
    firsts = [parts[0] for parts in bodies]
    held = _independent(assembly)
    at = assembly.state.q
    angles = dict(start.angles)
    for body, axis in held:
        if axis == 2:
            angles |= {part: float(at[part, 2]) for part in bodies[body]}
    places = {firsts[body]: (float(x), float(y)) for body, axis in held if axis < 2
              for x, y in [at[firsts[body], :2]]}  # fmt: skip
    fixed = replace(start, angles=angles, positions={**start.positions, **places})
    loose = [parts for parts in bodies if parts[0] not in angles]
    return _searched(assembly, fixed, loose) if loose else []


def _searched(assembly: Assembly, fixed: Start, loose: list[tuple[int, ...]]) -> list[FloatArray]:
    mechanism = without_play(assembly.mechanism, set(fixed.angles))
    known = [assembly.state.q[:, 2]]
    for start in shuffled(fixed, loose, STARTS):
        try:
            q, _ = straight_positions(mechanism, start)
        except CannotAssembleError:
            continue
        if all(_apart(q[:, 2], angles) > SAME for angles in known):
            known.append(q[:, 2])
    return known[1:]


def _apart(one: FloatArray, other: FloatArray) -> float:
    """Largest difference of two sets of angles, whole turns left out."""
    return float(np.abs(np.angle(np.exp(1j * (one - other)))).max(initial=0.0))


def _independent(assembly: Assembly) -> list[tuple[int, int]]:
    """Coordinates (body, axis) that decide where all bodies stand; angles are preferred."""
    # What a drive moves is free here, and then held where it stands.
    without = replace(without_play(assembly.mechanism, set()), speed_motors=())
    found = []
    for bodies, free in free_motions(without, assembly.state):
        motions = free
        for axis in (2, 0, 1):
            for k, body in enumerate(bodies.tolist()):
                left = motions[3 * k + axis]
                size = float(np.linalg.norm(left))
                if size > DEPENDENT:
                    found.append((body, axis))
                    motions = motions - np.outer(motions @ left, left) / size**2
    return found

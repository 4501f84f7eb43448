"""What mechanics forbids: a balance of energy with a gap, open joints, impacts that give energy."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite

import numpy as np

from exudyn_flexlink.intervals import Intervals
from exudyn_flexlink.result import Outcome, Result

ENERGY = 1e-2  # of the largest kinetic energy, missing in the balance
GAIN = 1e-4  # of the largest kinetic energy, gained in one impact: more than rounding
OPEN = 1e-8  # m or rad, residual of a joint: more than a converged iteration leaves
GROSS = 0.1  # of all energy that moves: a run that misses more is no motion of the mechanism
NO_ENERGY = 1e-12  # J: what is less is rounding, and no measure of an error
STORED = 1e-10  # of the energy stored: so little beside it is rounding, too, as of what is at rest


def doubts(result: Result) -> list[str]:
    """Say what is wrong with the numbers of a run, and would be less so with smaller steps."""
    return [*_energy(result), *_joints(result), *_gains(result)]


def refusal(result: Result) -> Outcome | None:
    """Return how a run ended whose energy balance is grossly wrong; None if it is not."""
    energy = result.energy
    moved = np.abs(energy.stored - energy.stored[0]) + energy.kinetic + np.abs(energy.dissipated)
    all_of_it = max(float(moved.max()), kinetic(result))
    if result.checks.energy_residual <= GROSS * all_of_it:
        return None
    off = np.abs(energy.residual)
    at = result.time[int(np.argmax(off > min(GROSS * all_of_it, 0.5 * off.max())))]
    return Outcome(
        False,
        float(at),
        f"the energy balance misses {result.checks.energy_residual / all_of_it:.2g} of all energy",
        f"what follows is no motion of this mechanism; {_remedy(result)}, and look at it there",
    )


def kinetic(result: Result) -> float:
    """Largest kinetic energy of a run, J, by which its errors are measured; never 0."""
    stored = float(np.abs(result.energy.stored).max(initial=0.0))
    return max(result.checks.largest_kinetic_energy, NO_ENERGY, STORED * stored)


def _remedy(result: Result) -> str:
    return "shorten the step" if result.settings.integrator.step else "tighten the tolerance"


def _energy(result: Result) -> Iterator[str]:
    missing, largest = result.checks.energy_residual, kinetic(result)
    if missing > ENERGY * largest:
        yield (
            f"the energy balance misses {missing:.3g} J, {missing / largest:.2g} of the largest "
            f"kinetic energy: {_remedy(result)} and compare"
        )


def _joints(result: Result) -> Iterator[str]:
    gap = result.checks.constraint_error
    if gap > OPEN:
        yield f"a joint is violated by {gap:.3g} (m or rad): {_remedy(result)}"


def _gains(result: Result) -> Iterator[str]:
    """Strikes, and contacts with walls, that give more energy than they took.

    What still presses as the run ends is left out: what it stores is not given back yet.
    """
    largest = kinetic(result)
    gaining = [
        (-lost, end, name)
        for histories in (result.contacts, result.bearings, result.sleeves)
        for name, history in histories.items()
        for lost, end in _stays(history.touches)
        if lost < -GAIN * largest and isfinite(end)
    ]
    if not gaining:
        return
    gain, at, name = max(gaining)
    told = "an impact gives more energy than it takes"
    if len(gaining) > 1:
        told = f"{len(gaining)} impacts give more energy than they take"
    more = ", or raise 'solver.steps_per_contact'" if result.settings.steps_per_contact else ""
    yield (
        f"{told}, that of '{name}' at {at:.6g} s {gain:.3g} J, {gain / largest:.2g} of the largest "
        f"kinetic energy: {_remedy(result)}{more}"
    )


def _stays(touches: Intervals) -> Iterator[tuple[float, float]]:
    """Energy lost (J) and end (s) of contacts, of which touches that overlap in time are one.

    As a link slides in its guide, one pair takes over what another has pressed in: the energy that
    is stored there is lost in one and given in the other.
    """
    if not len(touches):
        return
    until = np.maximum.accumulate(touches.end)
    begins = np.flatnonzero(np.append(True, touches.begin[1:] > until[:-1]))
    lost = np.add.reduceat(touches.energy_lost, begins)
    yield from zip(lost.tolist(), np.maximum.reduceat(touches.end, begins).tolist(), strict=True)

"""How a run ended that controls its error: what both engines tell of it, and no mechanics."""

from __future__ import annotations

from math import inf, isfinite
from typing import Protocol

from exudyn_flexlink.mechanism import Mechanism, cut_short
from exudyn_flexlink.result import Checks, Outcome
from exudyn_flexlink.scene import Scene


class Counted(Protocol):
    """Steps that were made: how many, the shortest and the longest (s), iterations in them."""

    steps: int
    smallest: float
    largest: float

    @property
    def iterations(self) -> int:
        """Newton's iterations; 0 of an explicit method."""


class Checked(Protocol):
    """What a recorder found: J, J and m; see `result.Checks`."""

    energy_residual: float
    largest_kinetic_energy: float
    constraint_error: float


def checks(made: Counted, found: Checked, deepest: float) -> Checks:
    """Checks of a run whose contacts went in by `deepest` (m) at most."""
    return Checks(
        energy_residual=found.energy_residual,
        largest_kinetic_energy=found.largest_kinetic_energy,
        constraint_error=found.constraint_error,
        steps=made.steps,
        newton_iterations=made.iterations,
        smallest_step=made.smallest if isfinite(made.smallest) else 0.0,
        largest_step=made.largest,
        steps_per_contact=inf,  # the error is controlled there as everywhere
        largest_penetration=deepest,
    )


def of_turns(scene: Scene, mechanism: Mechanism, time: float, reached: bool | None) -> Outcome:
    """Outcome of a run that came to its end at `time` (s): failed, if turns are still to be made.

    `reached` tells whether they were made; None where the end was known beforehand.
    """
    if cut_short(scene, mechanism) if reached is None else not reached:
        return turns_missing(scene, time)
    return Outcome(True, time)


def turns_missing(scene: Scene, time: float) -> Outcome:
    """Outcome of a run that was over at `time` (s), before its turns were made."""
    return Outcome(
        False,
        time,
        f"'at_most' was reached before joint '{scene.run.of}' made its turns",
        "raise 'at_most', or the drive's value",
    )


def stops(mechanism: Mechanism, end: float) -> list[float]:
    """Instants (s) at which a drive, or a derivative of it, jumps, and the end."""
    return [*mechanism.knots(end), end]

"""How a run ended that controls its error: what both engines tell of it, and no mechanics."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, isfinite, pi
from typing import Protocol

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.mechanism import Contact, Mechanism, cut_off
from exudyn_flexlink.result import Checks, Integrator, Outcome
from exudyn_flexlink.scene import Scene

RADAU = Integrator("Radau IIA", 9)


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


TOO_DEEP_ADVICE = "take a law without such a bound: 'formula: sphere', or one with a stiffness"


class DepthBounds:
    """Penetrations (m) of contacts (c,) beyond which their laws have no force."""

    def __init__(self, contacts: Sequence[Contact]) -> None:
        self._names = [contact.name for contact in contacts]
        laws = [contact.law for contact in contacts]
        bounds = [inf if isinstance(law, Impulse) else law.deepest for law in laws]
        self._bounds = np.array(bounds, dtype=np.float64)
        self.any = bool(np.isfinite(self._bounds).any())

    def passed(self, depths: FloatArray) -> str:
        """Say which contact is too deep, of depths (c,), m; empty if none is."""
        beyond = np.flatnonzero(depths > self._bounds)
        if not len(beyond):
            return ""
        k = int(beyond[0])
        bound = f"beyond {self._bounds[k]:.4g} m its law has no force"
        return f"'{self._names[k]}' was pressed {depths[k]:.4g} m deep: {bound}"


def of_turns(scene: Scene, mechanism: Mechanism, time: float, left: float | None) -> Outcome:
    """Outcome of a run that came to its end at `time` (s): failed, if turns are still to be made.

    `left` is the angle still to turn (rad); None where the end was known beforehand.
    """
    missing = cut_off(scene, mechanism) if left is None else left
    if missing <= 0:
        return Outcome(True, time)
    run = scene.run
    turns = run.turns or 0.0
    return Outcome(
        False,
        time,
        f"'at_most' was reached when joint '{run.of}' had made {turns - missing / (2 * pi):.3g} "
        f"turns of {turns:g}",
        "raise 'at_most', or a drive's value" if scene.drives else "raise 'at_most'",
    )

"""Energies of a run over time, with the residual of their balance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from exudyn_flexlink.arrays import FloatArray, Variable
from exudyn_flexlink.observables.instants import OverTime
from exudyn_flexlink.result import Result


@dataclass(frozen=True)
class Energies(OverTime):
    """Energies in J at samples `time` (N,) s: those of `EnergyHistory`, and its `residual`."""

    time: FloatArray
    kinetic: Annotated[FloatArray, Variable("time", "J", "kinetic energy")]
    stored: Annotated[FloatArray, Variable("time", "J", "energy in springs, weight, contacts")]
    dissipated: Annotated[FloatArray, Variable("time", "J", "energy dissipated")]
    supplied: Annotated[FloatArray, Variable("time", "J", "energy supplied by drives")]
    residual: Annotated[FloatArray, Variable("time", "J", "what the balance misses")]


def energies(result: Result) -> Energies:
    """Energies of a run."""
    energy = result.energy
    return Energies(result.time, **vars(energy), residual=energy.residual)

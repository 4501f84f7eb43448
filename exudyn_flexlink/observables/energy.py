"""What the energy balance says about a run."""

from __future__ import annotations

from exudyn_flexlink.result import Result


def relative_energy_residual(result: Result) -> float:
    """Largest error of the energy balance over the largest kinetic energy; 0 if nothing moved."""
    kinetic = result.checks.largest_kinetic_energy
    return result.checks.energy_residual / kinetic if kinetic else 0.0

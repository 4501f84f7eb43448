"""Cross-sections and rods: area, second moment of area, mass, inertia, bending stiffness."""

from __future__ import annotations

import math
from dataclasses import dataclass


def _positive(**values: float) -> None:
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f"{name} must be positive and finite, got {value!r}")


@dataclass(frozen=True)
class Section:
    """Cross-section of a rod bending in the plane.

    ``area`` A in m^2, ``second_moment`` I in m^4 about the axis normal to the plane of motion.

    Raises:
        ValueError: a value is not positive and finite.

    """

    area: float
    second_moment: float

    def __post_init__(self) -> None:
        _positive(area=self.area, second_moment=self.second_moment)

    @property
    def thickness(self) -> float:
        """Height in m of the rectangle with this I/A, ``sqrt(12 I/A)``: h itself for a rectangle.

        A rod of any section then has the inertia ``m l^2/12 + m h^2/12``.
        """
        return math.sqrt(12 * self.second_moment / self.area)


def mass_per_length(density: float, section: Section) -> float:
    """Mass per length ``rho A`` in kg/m."""
    return density * section.area


def rod_mass(density: float, section: Section, length: float) -> float:
    """Mass ``rho A l`` in kg of a uniform rod."""
    return density * section.area * length


def rod_inertia(mass: float, length: float, thickness: float | None = None) -> float:
    """Moment of inertia in kg m^2 of a uniform rod about its centre, for turning in the plane.

    Slender ``m l^2/12``; with ``thickness`` h (m), ``m l^2/12 + m h^2/12``. About an end add
    ``m l^2/4``.
    """
    depth = 0.0 if thickness is None else thickness
    return mass * (length**2 + depth**2) / 12


def bending_stiffness(youngs_modulus: float, section: Section) -> float:
    """Bending stiffness ``E I`` in N m^2."""
    return youngs_modulus * section.second_moment

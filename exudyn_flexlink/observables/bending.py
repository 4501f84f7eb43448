"""Bending of flexible links: moments of their hinges, and stress and strain at their surface.

A hinge with angle phi, stiffness k and damping c has the moment ``M = k phi + c phi'``. In a
section with the second moment I, the outermost fibre is h/2 from the bending axis. Its stress is
``M h / (2 I)``, and its strain ``M h / (2 E I)``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from exudyn_flexlink.arrays import FloatArray, Variable
from exudyn_flexlink.observables.forces import BENDING, bending_places, bent_links, moments
from exudyn_flexlink.observables.instants import OverTime
from exudyn_flexlink.observables.parting import force_error
from exudyn_flexlink.observables.points import samples_text
from exudyn_flexlink.result import Result


@dataclass(frozen=True)
class BendingPeak:
    """The largest bending of a link: `moment` (N m, of either sign), its `place` (m) and `at` (s).

    `stress` (Pa) and `strain` are the largest in size; None of a section whose height is not known.
    """

    moment: float
    place: float
    at: float
    stress: float | None
    strain: float | None


@dataclass(frozen=True)
class Bending(OverTime):
    """How a flexible link is bent at hinges, stations and welded ends, at samples `time` (N,) s.

    `place` (H,) m is that of each of these on the straight link, from its start. `moment` (N, H)
    N m is positive where the link bends to its left; beside hinges it is that of the straight line
    through two of them, see `moments`. `stress` (N, H) Pa and `strain` (N, H) are those
    of the surface on its right, positive where that is stretched; None of a section whose height is
    not known. `error` (N,) N m bounds how far moments are off, as `force_error` has it.
    """

    link: str
    time: FloatArray
    place: FloatArray
    moment: Annotated[FloatArray, Variable("time .place", "N m", "bending moment")]
    stress: Annotated[FloatArray | None, Variable("time .place", "Pa", "stress of the surface")]
    strain: Annotated[FloatArray | None, Variable("time .place", "1", "strain of the surface")]
    error: Annotated[FloatArray, Variable("time", "N m", "error of the moment", bound=True)]

    @property
    def largest(self) -> BendingPeak:
        """Where and when the moment is largest in size, with the largest stress and strain."""
        moment, time = np.atleast_2d(self.moment), np.atleast_1d(self.time)
        size = np.abs(moment)
        n, hinge = np.unravel_index(int(size.argmax()), size.shape)
        stress, strain = (
            None if values is None else float(np.abs(values).max())
            for values in (self.stress, self.strain)
        )
        peak = float(moment[n, hinge])
        return BendingPeak(peak, float(self.place[hinge]), float(time[n]), stress, strain)

    def __repr__(self) -> str:
        largest = self.largest
        return (
            f"<Bending of {self.link}: to {largest.moment:.5g} N m at {largest.place:.4g} m, "
            f"{len(self.place)} places; {samples_text(self.time)}>"
        )


def bending(result: Result, link: str) -> Bending:
    """Return how a flexible link is bent.

    Raises:
        ValueError: the link has no hinges.

    """
    scene, known = result.scene, bent_links(result.scene)
    if link not in known:
        names = ", ".join(known) or "none"
        raise ValueError(f"'{link}' has no hinges that bend; there are: {names}")
    body = known[link]
    moment, stress, strain = moments(result, link), None, None
    if (half := body.section.half_height) is not None:
        stress = moment * half / body.section.second_moment
        strain = stress / scene.materials[body.material].youngs_modulus
    error = force_error(result, f"{BENDING} of {link}")
    return Bending(link, result.time, bending_places(scene, link), moment, stress, strain, error)

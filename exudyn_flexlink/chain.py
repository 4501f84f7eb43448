"""A flexible link as a chain of rigid rods and sprung hinges (finite segments).

Rod angles are absolute. The paper (Dupac & Noroozi) uses equal rods and the hinge stiffness EI/L; a
hinge that represents the bending of a cell of length l has EI/l instead. Only the latter converges
to the Euler-Bernoulli beam.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from exudyn_flexlink.arrays import FloatArray

PRODUCTS = 20  # number of products; each reduces the error of a frequency to less than a tenth
BESIDE = 4  # vectors in addition to twice the number of frequencies
Layout = Literal["equal", "half_ends"]
StiffnessRule = Literal["paper", "beam"]


@dataclass(frozen=True)
class Beam:
    """A uniform link, or rod.

    Length L (m), mass per length rho A (kg/m), bending stiffness EI (N m^2). A ``thickness`` h (m)
    adds ``m h^2/12`` to the inertia of every rod; 0 if slender.
    """

    length: float
    mass_per_length: float
    bending_stiffness: float
    thickness: float = 0.0

    def rod(self, length: float) -> Rod:
        """A rigid rod of a length l (m): a piece of the link, of inertia ``m (l^2 + h^2)/12``."""
        mass = self.mass_per_length * length
        return Rod(length, mass, mass * (length**2 + self.thickness**2) / 12)


@dataclass(frozen=True)
class Rod:
    """A rigid rod: length (m), mass (kg), inertia about its centre (kg m^2)."""

    length: float
    mass: float
    inertia: float


@dataclass(frozen=True)
class Hinge:
    """A joint of two neighbouring rods: stiffness (N m/rad), damping (N m s/rad)."""

    stiffness: float
    damping: float


@dataclass(frozen=True)
class Chain:
    """Rods in order from the root; hinge i joins rod i to rod i + 1."""

    rods: tuple[Rod, ...]
    hinges: tuple[Hinge, ...]

    def cantilever_frequencies(self, count: int = 1) -> FloatArray:
        """Lowest ``count`` natural frequencies in rad/s of the straight chain, first rod clamped.

        The chain has as many frequencies as hinges.
        """
        # With hinge angles scaled to unit stiffness, the lowest frequencies belong to the largest
        # eigenvalues of the mass matrix. A block of twice as many vectors contains them after a few
        # products, since eigenvalues of a chain fall with the fourth power of their number.
        roots = np.sqrt([hinge.stiffness for hinge in self.hinges])[:, None]
        size = min(len(self.hinges), 2 * count + BESIDE)
        block = np.random.default_rng(0).standard_normal((len(self.hinges), size))
        for _ in range(PRODUCTS):
            block = np.linalg.qr(block)[0]
            moved = self._mass_of_bent(block / roots) / roots
            values, mixed = np.linalg.eigh(block.T @ moved)
            block = moved @ mixed
        return np.asarray(1 / np.sqrt(values[::-1][:count]))

    def _mass_of_bent(self, bends: FloatArray) -> FloatArray:
        """Mass matrix of the straight, clamped chain, by hinge angles, times (hinges, columns).

        Running sums along the chain are faster than the matrix of a long chain.
        """
        lengths, masses, inertias = np.array(
            [(rod.length, rod.mass, rod.inertia) for rod in self.rods[1:]]
        ).T[:, :, None]
        angles = np.cumsum(bends, axis=0)
        reached = np.cumsum(lengths * angles, axis=0)
        forces = masses * (reached - lengths * angles / 2)
        beyond = np.cumsum(forces[::-1], axis=0)[::-1]
        moments = lengths * (beyond - forces / 2) + inertias * angles
        return np.asarray(np.cumsum(moments[::-1], axis=0)[::-1])


def discretise(
    beam: Beam,
    cells: int,
    layout: Layout = "equal",
    stiffness: StiffnessRule | float = "paper",
    damping: float = 0.0,
) -> Chain:
    """Replace ``beam``, cut into ``cells`` = n equal cells of length l = L/n, by rods and hinges.

    ``equal`` (Dupac & Noroozi): n rods of length l, n - 1 hinges between the cells. A clamped root
    rod makes this beam too short by l/2, so frequencies converge as O(1/n).
    ``half_ends``: a hinge in the middle of each cell, hence n hinges and n + 1 rods of which the
    first and last have length l/2; O(1/n^2).

    ``stiffness`` of each hinge: ``paper`` EI/L, ``beam`` EI/l, or a number in N m/rad.
    ``damping`` of each hinge in N m s/rad.
    """
    cell = beam.length / cells
    lengths = [cell] * cells
    if layout == "half_ends":
        lengths = [cell / 2, *[cell] * (cells - 1), cell / 2]
    if stiffness == "paper":
        stiffness = beam.bending_stiffness / beam.length
    elif stiffness == "beam":
        stiffness = beam.bending_stiffness * cells / beam.length
    hinge = Hinge(stiffness, damping)
    return Chain(tuple(beam.rod(length) for length in lengths), (hinge,) * (len(lengths) - 1))


def euler_bernoulli_cantilever(beam: Beam, count: int = 4) -> FloatArray:
    """Lowest ``count`` natural frequencies (rad/s) of the clamped-free beam, bending only.

    ``(beta L)^2 sqrt(EI/(rho A L^4))`` with beta L from :func:`cantilever_roots`.
    """
    scale = math.sqrt(beam.bending_stiffness / beam.mass_per_length) / beam.length**2
    return np.asarray(cantilever_roots(count) ** 2 * scale)


def cantilever_roots(count: int) -> FloatArray:
    """First ``count`` positive roots of cos x cosh x = -1 (clamped-free beam), by Newton's method.

    Solved as ``cos x + 1/cosh x = 0``, which cannot overflow, from the asymptote (i - 1/2) pi.
    """
    x = (np.arange(1, count + 1) - 0.5) * math.pi
    for _ in range(20):
        # sech without cosh, which overflows beyond the 226th root
        sech = 2 * np.exp(-x) / (1 + np.exp(-2 * x))
        x = x + (np.cos(x) + sech) / (np.sin(x) + sech * np.tanh(x))
    return np.asarray(x)

"""How finely a run is resolved: what rounding leaves, how long contacts last, their steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from math import ceil, floor, inf, log10

import numpy as np

from exudyn_flexlink.laws import Impulse, RestitutionPenalty
from exudyn_flexlink.mechanism.assembly import Assembly
from exudyn_flexlink.mechanism.contact_pairs import Channel, Contact, pairs
from exudyn_flexlink.mechanism.dynamics import contact_mass
from exudyn_flexlink.scene import Scene

WALL_SHARE = 0.5  # of the steps of a strike: a wall presses longer than it strikes
ELASTIC = 0.99  # restitution of an impact that must not lose energy by its steps either
ELASTIC_STEPS = 2.0  # times the steps there: 60 lose 1e-5 of the energy in an impact, 120 an eighth
# Roundings of a position at the mechanism's extent. Over two turns of the paper's mechanism with
# its strikes, tree and Lagrangian stay 1.5e-13 m apart however small the tolerance, 4000 of them
# (`scripts/rounding.py`); without a strike 4e-15 m, from where on steps are as short as can be.
ROUNDINGS = 5e3
NO_SMALL_PART = 0.1  # of what a mechanism reaches: an error that hides how it moves


@dataclass(frozen=True)
class Resolution:
    """Half the period of a contact's stiffness with the least mass on it, and its step, s."""

    half_period: float
    step: float

    def steps(self, given: float | None) -> float:
        """Steps of the contact where the user gave a step (s), which may be shorter."""
        return self.half_period / min(self.step, given or inf)


def resolutions(
    scene: Scene,
    assembly: Assembly,
    half_of: Callable[[Contact | Channel], float] | None = None,
) -> list[Resolution]:
    """Resolutions of contacts and bearings, then of sleeves; none of contacts that take no time.

    `half_of` tells half the period (s) of each; left out, `half_period` does.
    """
    half_of = half_of or partial(half_period, assembly)
    asked, found = scene.solver.steps_per_contact, []
    for contact in assembly.mechanism.touching:
        if isinstance(contact.law, RestitutionPenalty):
            half = half_of(contact)
            steps = asked * (ELASTIC_STEPS if contact.law.restitution > ELASTIC else 1.0)
            found.append(Resolution(half, half / steps))
    for channel in assembly.mechanism.channels:
        half = half_of(channel)
        found.append(Resolution(half, half / (WALL_SHARE * asked)))
    return found


def half_period(assembly: Assembly, contact: Contact | Channel) -> float:
    """Half the period of a stiffness with the least mass behind it, s; inf of a rigid contact."""
    if isinstance(contact.law, Impulse):
        return inf
    state = assembly.state
    mass = contact_mass(assembly.mechanism, contact, state.q, state.places)
    return contact.law.half_period(mass)


def half_periods(assembly: Assembly) -> list[float]:
    """Return those of all contacts and bearings, then of all pairs of links and guides."""
    mechanism = assembly.mechanism
    found = [half_period(assembly, contact) for contact in mechanism.touching]
    for channel in mechanism.channels:
        found += [half_period(assembly, channel)] * len(pairs(channel))
    return found


def extent(assembly: Assembly) -> float:
    """Distance (m) from the origin of coordinates to the farthest point, at the start."""
    q = assembly.state.q
    reaches = [part.reach for part in assembly.mechanism.parts]
    return float((np.hypot(q[:, 0], q[:, 1]) + reaches).max())


def least_tolerance(assembly: Assembly) -> float:
    """Least error in positions (m) that a run can be asked for, rounded up to one digit."""
    least = ROUNDINGS * float(np.finfo(float).eps) * extent(assembly)
    power = floor(log10(least))
    return float(f"{ceil(least / 10.0**power)}e{power}")


def coarse_tolerance(assembly: Assembly, asked: float | None) -> Iterator[str]:
    """Say that a tolerance (m) that was asked for is no small part of the mechanism."""
    if asked is not None and asked > NO_SMALL_PART * extent(assembly):
        yield (
            f"the tolerance of {asked:.3g} m is no small part of the mechanism, which reaches "
            f"{extent(assembly):.3g} m; is a unit missing, as in '1 um'?"
        )

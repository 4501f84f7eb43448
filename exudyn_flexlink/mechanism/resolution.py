"""How long contacts last, and how short steps are in them where a number of steps resolves them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import inf

from exudyn_flexlink.laws import Impulse, RestitutionPenalty
from exudyn_flexlink.mechanism.assembly import Assembly
from exudyn_flexlink.mechanism.contact_pairs import Channel, Contact
from exudyn_flexlink.mechanism.dynamics import contact_mass
from exudyn_flexlink.scene import Scene

WALL_SHARE = 0.5  # of the steps of a strike: a wall presses longer than it strikes
ELASTIC = 0.99  # restitution of an impact that must not lose energy by its steps either
ELASTIC_STEPS = 2.0  # times the steps there: 60 lose 1e-5 of the energy in an impact, 120 an eighth


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
